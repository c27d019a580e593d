"""The picture of a measured loop: what it shows, and that it is the same every time."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_support import triangle
from plot_support import picture

from cfmkit.experiment.curves_and_metrics_of_recording import measure_recording
from cfmkit.experiment.figures import figures
from cfmkit.experiment.measurement_and_calibration_outputs import report_on
from cfmkit.experiment.reading import Recording
from cfmkit.metrics import Window


def report(rise):
    motion = triangle(2)
    way = np.sign(np.diff(motion, append=motion[-2]))
    return report_on(
        measure_recording(Recording("made.csv", motion * 1e-3, 50 + 0.5 * way + rise * motion)),
        window=Window(0.01, 0.03),
    )


@pytest.mark.parametrize(("rise", "shown"), [(0.01, True), (0.4, False)])
def test_forces_outside_the_window_are_shown_where_they_do_not_flatten_the_loop(rise, shown):
    found = report(rise)
    low, high = figures(found.source, found.numbers)["loop"]().axes[1].get_ylim()
    efforts = np.concatenate([curve.effort for curve in found.source.raw])
    assert bool(low < efforts.min() and efforts.max() < high) is shown


def test_a_picture_has_the_same_bytes_every_time():
    found = report(0.01)
    first, second = (picture(figures(found.source, found.numbers)["loop"]()) for _ in range(2))
    assert first == second

"""Turning points of cubics between samples."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.numerics.sampled_extremes import monotone


def test_turning_points_between_samples_are_found():
    x = np.linspace(0.0, 3.0, 4)
    curves, slopes = (
        np.array([x**3 - 4 * x, (x - 1.5) ** 3 - 0.1 * x]),
        np.array([3 * x**2 - 4, 3 * (x - 1.5) ** 2 - 0.1]),
    )

    def cubics(places):
        return np.stack([places[0] ** 3 - 4 * places[0], (places[1] - 1.5) ** 3 - 0.1 * places[1]])

    cut = monotone(x, curves, slopes, cubics)
    assert (np.diff(cut.place, axis=1) >= 0).all()
    assert cut.value[0].min() == pytest.approx(-16 / 27**0.5)
    steps = np.diff(cut.value[1])
    assert (np.diff(np.sign(steps[steps != 0])) != 0).sum() == 2  # both within one cell

"""Pictures of sensitivity studies: drawn whatever failed, readable, the same bytes every time."""

from __future__ import annotations

from pathlib import Path

import pytest

import cfmkit
from cfmkit.plots.sensitivity import short
from cfmkit.plots.style import INCHES_PER_MM, png
from cfmkit.studies.sensitivity import METHOD_NAMES

CONFIG = Path(__file__).parents[2] / "configs" / "studies" / "cam_tolerance.yaml"
PARAMETERS = {
    "mechanism.rest_half_width": ("67.95 mm", "68.05 mm"),
    "mechanism.springs.stiffness.*": {"uniform": "1 %"},
}


BROKEN = {"mechanism.rolling_friction": ("-0.001", "0.004"), "mechanism.roller_radius": {"uniform": "0.05 mm"}}


def study(method, parameters=PARAMETERS):
    spec = cfmkit.load(CONFIG).replace({"sensitivity": {"method": method, "parameters": parameters, "samples": 4}})
    return cfmkit.sensitivity(spec)


@pytest.mark.parametrize("method", METHOD_NAMES)
@pytest.mark.parametrize("parameters", [PARAMETERS, BROKEN], ids=["complete", "with failures"])
def test_pictures_are_drawn_whatever_failed_and_their_bytes_repeat(method, parameters):
    found = study(method, parameters)
    assert len(found.figures) >= len(found.findings.setup.study.metrics)
    for name, draw in found.figures.items():
        picture = png(draw())
        assert picture == png(draw()), name
        assert len(picture) > 5000


@pytest.mark.parametrize("method", METHOD_NAMES)
def test_labels_of_axes_stay_clear_of_the_edges_of_the_picture(method):
    for name, draw in study(method).figures.items():
        figure = draw()
        figure.canvas.draw()
        room = 4.0 * INCHES_PER_MM * figure.dpi
        for axes in figure.axes:
            box = axes.xaxis.label.get_window_extent()
            assert room <= box.x0, name
            assert box.x1 <= (axes.bbox.x1 if name == "yield_gain" else figure.bbox.x1 - room), name


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("mechanism.brace_length", "brace length"),
        ("mechanism.springs.stiffness.0, mechanism.springs.stiffness.1", "springs stiffness (2)"),
        ("mechanism.a, mechanism.b", "a, b"),
    ],
)
def test_names_on_pictures_are_short(path, name):
    assert short(path) == name

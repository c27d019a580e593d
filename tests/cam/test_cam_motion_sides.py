"""One side of the mechanism in motion: where its roller is on a turned track, and what a left side inherits."""

from __future__ import annotations

import numpy as np
import pytest
from cam_motion import moving
from cam_support import analyze

from cfmkit.families.cam.dynamics.machine_from_spec import build

TURNED = {
    "as designed": {},
    "deviating": {"errors__slider_deviation": "5 deg"},
    "badly cut": {"errors__flank_angle": "-0.4 deg"},
    "other left roller": {"left__roller_radius": "17 mm"},
    "other left brace": {"left__brace_length": "201 mm"},
    "cut for friction, turned": {"profile__friction": 0.004, "errors__slider_deviation": "2 deg"},
}


@pytest.mark.parametrize("position", ["220 mm", "188.5 mm"], ids=["flank", "corner"])
@pytest.mark.parametrize("changes", TURNED.values(), ids=TURNED)
def test_braces_join_rollers_on_turned_tracks_to_the_slider(changes, position):
    """Their tangents and curvatures are those of differences along the track."""
    parts = build(moving(**changes, analysis__dynamics__slider_position=position))
    for side in (parts.machine.right, parts.machine.left):
        start = max(parts.motion.start, side.span[0] + 1e-5)
        slider = start + np.array([1e-5, 2e-4, 0.1])[:, None] + 1e-7 * np.arange(-1, 2)
        stance = side.stance(slider)
        drop = np.sqrt(side.parts.brace_length**2 - stance.center.real**2)
        np.testing.assert_allclose(stance.center.imag + drop, slider, rtol=0, atol=4e-15)
        steps = np.diff(stance.center[:, ::2], axis=1)
        np.testing.assert_allclose(steps / np.abs(steps), stance.tangent[:, 1:2], rtol=0, atol=1e-5)
        turns = np.angle(stance.tangent[:, 2:] / stance.tangent[:, :1])
        np.testing.assert_allclose(turns / np.abs(steps), stance.curvature[:, 1:2], rtol=1e-3)


def test_a_left_flank_without_a_stroke_is_cut_for_that_of_the_right_one():
    short = {"force_constant": "10 mm"}
    result = analyze(moving(left__profile=short))
    assert result.status.key == "complete"
    whole = analyze(moving(left__profile=short | {"stroke": "240 mm"}))
    np.testing.assert_array_equal(result.curve.force, whole.curve.force)

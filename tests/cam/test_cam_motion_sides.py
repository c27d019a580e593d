"""One side of the mechanism in motion: how few evaluations of its curve it takes, and what a left side inherits."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from cam_motion import moving
from cam_support import analyze

from cfmkit.families.cam.dynamics.machine_from_spec import build


@dataclass(frozen=True)
class Counted:
    """A piece of a curve that counts how often it is evaluated."""

    piece: Any
    calls: list[int] = field(default_factory=list)
    on_corner = False

    @property
    def ends(self):
        return self.piece.ends

    def evaluate(self, parameter):
        self.calls.append(np.size(parameter))
        return self.piece.evaluate(parameter)


TURNED = {
    "as designed": {},
    "deviating": {"errors__slider_deviation": "5 deg"},
    "badly cut": {"errors__flank_angle": "-0.4 deg"},
    "other left roller": {"left__roller_radius": "17 mm"},
    "other left brace": {"left__brace_length": "201 mm"},
    "cut for friction, turned": {"profile__friction": 0.004, "errors__slider_deviation": "2 deg"},
}


@pytest.mark.parametrize("changes", TURNED.values(), ids=TURNED)
def test_the_guide_is_so_good_that_each_position_needs_one_evaluation_of_the_curve(changes):
    parts = build(moving(**changes))
    slider = parts.motion.evaluate(parts.motion.times(201)).position
    for side in (parts.machine.right, parts.machine.left):
        pieces = tuple(Counted(piece) for piece in side.pieces)
        counting = replace(side, pieces=pieces)
        counting.stance(slider[:1])  # builds the guide
        for piece in pieces:
            piece.calls.clear()
        stance = counting.stance(slider)
        assert [call for piece in pieces for call in piece.calls] == [201]
        drop = np.sqrt(side.parts.brace_length**2 - stance.center.real**2)
        np.testing.assert_allclose(stance.center.imag + drop, slider, rtol=0, atol=1e-15)


def test_a_left_flank_without_a_stroke_is_cut_for_that_of_the_right_one():
    short = {"force_constant": "10 mm"}
    result = analyze(moving(left__profile=short))
    assert result.status.key == "complete"
    whole = analyze(moving(left__profile=short | {"stroke": "240 mm"}))
    np.testing.assert_array_equal(result.curve.force, whole.curve.force)

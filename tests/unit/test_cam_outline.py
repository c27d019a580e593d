"""The outline of the cam plate follows the flanks of extreme designs, too; without a plate there is none."""

from __future__ import annotations

import pytest
from cam_support import cam

import cfmkit
from cfmkit.export.arcs import outlines
from cfmkit.families.refusals import CannotBuild

TURNS_AT_ONCE = {
    "brace_length": "1647.65 mm",
    "rest_half_width": "1450.49 mm",
    "roller_radius": "15.53 mm",
    "profile__force_constant": "0.004125 mm",
    "profile__friction": -0.108,
    "profile__stroke": "607 mm",
}
NEARLY_VERTICAL = {
    "brace_length": "425.2 mm",
    "rest_half_width": "347.1 mm",
    "roller_radius": "3.15 mm",
    "profile__force_constant": "5634 mm",
    "profile__friction": 0.1,
    "profile__stroke": "761.4 mm",
}


@pytest.mark.parametrize("changes", [TURNS_AT_ONCE, NEARLY_VERTICAL])
def test_a_flank_that_turns_in_a_short_stretch_can_be_cut(changes):
    drawn = outlines(cfmkit.drawing(cam(**changes)))
    assert [outline.layer for outline in drawn].count("cut") >= 1


def test_flanks_that_cross_leave_no_plate_to_draw():
    with pytest.raises(CannotBuild, match="no plate is left between them") as caught:
        cfmkit.drawing(cam(rest_half_width="2 mm", profile__force_constant="1 mm"))
    assert caught.value.finding.name == "flanks_collide"

"""The outline of the cam plate follows the flanks of extreme designs, too; without a plate there is none."""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import cam, fixed

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.export import Smooth, files
from cfmkit.families import CannotBuild, family

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
    drawing = cfmkit.drawing(cam(**changes))
    assert "cut" in [contour.layer for contour in drawing.contours]
    assert files(drawing)


def test_flanks_that_cross_leave_no_plate_to_draw():
    with pytest.raises(CannotBuild, match="no plate is left between them") as caught:
        cfmkit.drawing(cam(rest_half_width="2 mm", profile__force_constant="1 mm"))
    assert caught.value.finding.name == "flanks_collide"


LEFT = {
    "other curve": {"profile": {"force_constant": "12 mm"}},
    "smaller roller": {"profile": {"force_constant": "9.058 mm"}, "roller_radius": "10 mm"},
    "longer brace, shorter stroke": {
        "profile": {"force_constant": "8 mm", "stroke": "150 mm"},
        "brace_length": "210 mm",
    },
    "wider": {"profile": {"force_constant": "9 mm", "rest_half_width": "70 mm"}},
}


@pytest.mark.parametrize("left", LEFT.values(), ids=LEFT)
def test_the_left_flank_that_is_cut_is_the_one_that_is_analysed(left):
    spec = fixed(cam(), left=left)
    lone = cam(**{key: left[key] for key in ("brace_length", "roller_radius") if key in left})
    lone = lone.replace({f"mechanism.profile.{key}": value for key, value in left["profile"].items()})
    drawn, alone, right = (cfmkit.drawing(item) for item in (spec, lone, fixed(cam())))
    tables = {table.name: table for table in drawn.tables}
    wanted = {table.name: table for table in (*alone.tables[2:], *right.tables[:2])}
    for name, table in wanted.items():
        for column, (values, _) in table.columns.items():
            assert np.array_equal(tables[name].columns[column][0], values), (name, column)
    plate = next(contour for contour in drawn.contours if contour.layer == "cut" and not contour.hole)
    up, down = (edge for edge in plate.edges if isinstance(edge, Smooth))
    assert np.array_equal(up.points[:, 0], tables["cam-right"].columns["x"][0])
    assert np.array_equal(down.points[::-1, 0], tables["cam-left"].columns["x"][0])
    paths = [contour.edges[0].points for contour in drawn.contours if contour.layer == "path"]
    assert np.array_equal(paths[1][:, 0], tables["roller-path-left"].columns["x"][0])
    files(drawn)  # closed, and nowhere crossing itself


def test_a_left_side_without_a_flank_of_its_own_leaves_the_cam_symmetric():
    plain, braced = (cfmkit.drawing(fixed(cam(), **left)) for left in ({}, {"left": {"brace_length": "205 mm"}}))
    for one, other in zip(plain.tables, braced.tables, strict=True):
        assert np.array_equal(one.columns["x"][0], other.columns["x"][0])


def test_what_the_left_flank_leaves_out_is_written_out():
    left = {"brace_length": "205 mm", "profile": {"force_constant": "12 mm"}}
    profile = family("cam").resolve(cam(left=left)).mechanism.left.profile
    numbers = (profile.brace_length, profile.rest_half_width, profile.roller_radius, profile.stroke)
    assert numbers == pytest.approx((0.205, 0.068, 0.016, 0.24))


def test_a_tab_that_would_cut_into_the_rollers_is_refused_with_the_room_there_is():
    with pytest.raises(SpecError, match="leave 104 mm between them") as caught:
        cam(plate={"base_width": "120 mm"})
    assert caught.value.problems[0].path == "mechanism.plate.base_width"
    drawn = cfmkit.drawing(cam(plate={"base_width": "104 mm"}))
    plate = next(contour for contour in drawn.contours if contour.closed and not contour.hole)
    below = [end for edge in plate.edges if not isinstance(edge, Smooth) for end in edge.ends if end.imag < 0]
    assert max(end.real for end in below) == pytest.approx(0.052)
    left = {"roller_radius": "18 mm", "profile": {"force_constant": "9 mm", "rest_half_width": "66 mm"}}
    with pytest.raises(SpecError, match="leave 96 mm between them"):
        cam(plate={"base_width": "100 mm"}, left=left)


@pytest.mark.parametrize(
    ("plate", "words"),
    [
        ({"hole_diameter": "20 mm"}, ["holes of the tab are left out"]),
        ({"base_height": "10 mm"}, ["holes of the tab are left out"]),
        ({"hole_diameter": "60 mm"}, ["holes of the tab are left out", "near the top are left out"]),
        ({}, []),
        ({"hole_diameter": "0"}, []),
        ({"base_height": "0"}, []),
    ],
)
def test_holes_that_find_no_room_are_not_left_out_in_silence(plate, words):
    notes = cfmkit.drawing(cam(plate=plate)).notes
    assert len(notes) == len(words)
    assert all(word in note for word, note in zip(words, notes, strict=True))

"""The box that a mechanism stays in, by family, against what its parts say by themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from beam_support import cantilever

import cfmkit
from cfmkit.export import box as box_of
from cfmkit.families import family


def room_of(name, **changes):
    return box(cfmkit.load(f"configs/{name}.yaml").replace(changes))


def box(spec):
    result = cfmkit.analyze(spec)
    return family(result.spec.family).envelope(result), result


def test_a_cam_is_as_wide_as_its_rollers_at_the_end_of_the_stroke():
    room, result = room_of("cam")
    end = 68e-3 + 0.5 * result.values["spring_elongation_max"].value
    assert room.across == pytest.approx(2 * (end + 16e-3), rel=1e-9)


def test_a_cam_is_as_high_as_from_its_tab_to_the_slider_with_its_pin():
    room, _ = room_of("cam_no_undercut")
    longer, _ = room_of("cam_no_undercut", **{"mechanism.plate.base_height": "50 mm"})
    assert longer.along - room.along == pytest.approx(10e-3, abs=1e-9)


def test_a_mechanism_of_v_beams_has_room_for_its_walls_and_its_preload():
    room, result = room_of("vcfm_pla")
    leaf, frame = result.spec.mechanism.bistable, result.spec.mechanism.frame
    walls = 2 * (leaf.length * math.cos(leaf.angle) + frame.block) + frame.shuttle_width
    assert room.across == pytest.approx(walls, rel=1e-6)
    assert room.depth == pytest.approx(10.47e-3)
    free, _ = room_of("vcfm_pla", **{"analysis.preloads": ("0 mm",)})
    pulled, _ = room_of("vcfm_pla", **{"analysis.preloads": ("0 mm", "-2 mm")})
    assert pulled.along - free.along == pytest.approx(2e-3, rel=1e-6)


def test_a_mirrored_network_is_twice_as_wide_as_its_half_with_its_pads():
    room, result = room_of("beam_lan2010")
    assert room.across > 2 * 34.5e-3
    assert room.across < 2 * 34.5e-3 + 8 * result.spec.mechanism.thickness
    assert room.along > 40e-3
    assert room.depth == pytest.approx(10e-3)


@pytest.mark.parametrize(("beam", "deep"), [("120 mm", 120e-3), ("50 mm", 100e-3)])
def test_the_widest_of_beams_and_pads_is_the_depth(beam, deep):
    room, _ = box(cantilever(("end: tip}", f"end: tip, width: {beam}}}")))
    assert room.depth == pytest.approx(deep)


def test_a_beam_with_a_thickness_of_its_own_takes_the_same_box_as_one_with_that_of_the_mechanism():
    usual, _ = box(cantilever(("thickness: 1 mm", "thickness: 6 mm")))
    own, _ = box(cantilever(("end: tip}", "end: tip, thickness: 6 mm}")))
    unused, _ = box(cantilever(("thickness: 1 mm", "thickness: 50 mm"), ("end: tip}", "end: tip, thickness: 6 mm}")))
    assert own == usual
    assert unused == usual


def test_legs_side_by_side_take_the_depth():
    room, _ = room_of("beam_lan2010_subcfm")
    assert room.depth == pytest.approx(8 * 6e-3)


def test_a_strip_counts_the_way_of_its_slider_and_its_pads():
    room, result = room_of("slider_crank_strip")
    assert room.along >= 100e-3
    assert room.depth == pytest.approx(result.spec.mechanism.beam.width)


def test_links_and_pins_have_no_known_depth():
    room, _ = room_of("slider_crank_bilancia2019")
    assert room.depth is None
    assert "springs" in room.assumed


def test_the_box_of_a_part_with_fillets_ends_where_its_material_does():
    room, result = room_of("beam_lan2010")
    points = np.concatenate([one.points(1e-8) for one in cfmkit.drawing(result.spec).contours if one.layer == "cut"])
    assert room.corner[1] == pytest.approx(points[:, 1].min(), abs=1e-7)


def test_the_box_of_a_straight_spring_counts_its_middle_block_as_it_is_drawn():
    """The block reaches one and a half blocks below the shuttle; it counted as one."""
    room, result = room_of("vcfm_straight")
    frame = result.spec.mechanism.frame
    lowest = -frame.clearance - 1.5 * frame.block - float(result.curve.motion[-1])
    assert room.corner[1] == pytest.approx(lowest, rel=1e-9)


def test_films_stay_within_the_box_of_what_moves():
    for name in ("vcfm_pla", "beam_lan2010", "slider_crank_lumped", "cam"):
        room, result = room_of(name)
        part = family(result.spec.family).part(result)
        (left, bottom), (right, top) = box_of(part.bodies)
        assert room.drawn == pytest.approx((right - left, top - bottom))
        assert {body.role for body in part.bodies} >= {"held", "driven"}
        for body in part.bodies:
            for pose in range(len(body.core)):
                outline = body.outline(pose)
                assert (outline >= np.array([left, bottom]) - 1e-9).all()
                assert (outline <= np.array([right, top]) + 1e-9).all()

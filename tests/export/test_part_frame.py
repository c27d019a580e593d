"""What stands around a part: a frame that joins what is held, a stop of the travel, a seat of the spring."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import CONFIGS
from shapely import LineString, Point, Polygon

import cfmkit
from cfmkit.errors import GeometryError
from cfmkit.families import family

GROUND = "mechanism.part.frame={ground: 6 mm, wall: 8 mm, shuttle: 9 mm}"


def loaded(name, *changes):
    return cfmkit.load(CONFIGS / f"{name}.yaml", changes)


def material(drawing):
    """Return what is left of the sheet, as a shapely geometry [m]."""
    outer = [one for one in drawing.contours if one.layer == "cut"]
    found = Polygon()
    for one in sorted(outer, key=lambda contour: contour.hole):
        own = Polygon(one.points(1e-7))
        assert own.is_valid
        found = found.difference(own) if one.hole else found.union(own)
    return found


def pieces(shape):
    return list(getattr(shape, "geoms", [shape]))


@pytest.mark.parametrize("name", ["beam_lan2010", "beam_design_arch", "slider_crank_strip", "slider_crank_lumped"])
def test_a_frame_and_the_part_are_one_valid_piece_with_bodies(name):
    from cfmkit.export import files

    drawing = cfmkit.drawing(loaded(name, GROUND))
    whole = material(drawing)
    assert whole.is_valid
    assert len(pieces(whole)) == 1
    assert set(files(drawing, formats=("dxf", "svg", "stl"))) == {
        f"{drawing.name}.{one}" for one in ("dxf", "svg", "stl")
    }


def test_the_frame_stays_clear_of_beams_over_the_travel():
    # bars stop short of the ring by nothing but what clears the beams: poses of the engine are looked at again here
    spec = loaded("beam_lan2010", GROUND)
    held = [Polygon(one.points(1e-7)) for one in cfmkit.drawing(spec).contours if one.layer == "held"]
    sides = sorted(held, key=lambda one: -max(one.bounds[2] - one.bounds[0], one.bounds[3] - one.bounds[1]))[:4]
    path = cfmkit.analyze(spec).state.path
    gaps = [
        LineString(path.shape(name, point)).distance(side) - 0.5e-3
        for point in range(0, len(path), 5)
        for name in path.network.beams
        for side in sides
    ]
    assert min(gaps) >= 2e-3 - 1e-5
    assert min(gaps) < 3e-3  # and no farther away than that


@pytest.mark.parametrize("name", ["beam_lan2010", "slider_crank_strip"])
def test_a_frame_changes_nothing_of_what_is_solved(name):
    def part(*changes):
        record = family((spec := loaded(name, *changes)).family)
        return record.elastic.solids(spec)[0].part

    hole = "mechanism.part.holes=[{at: [-10 mm, -11 mm], diameter: 3 mm}]"
    bare = part("mechanism.part.frame={wall: 8 mm, shuttle: 9 mm}")
    framed = part(GROUND, *([hole] if name == "beam_lan2010" else []))
    assert not bare.obstacles
    assert len(framed.obstacles) > 4
    assert len(bare.rings) == len(framed.rings)  # the hole is in the frame, which stands
    for one, other in zip(bare.rings, framed.rings, strict=True):
        assert np.array_equal(one.places, other.places)


def test_a_frame_in_the_way_is_told_with_its_place():
    tight = "mechanism.part.frame={ground: 6 mm, inside: [[-34 mm, -6 mm], [34 mm, 55 mm]]}"
    with pytest.raises(
        GeometryError, match=r"in the way of the moving parts at \(.* mm, .* mm\); make 'mechanism.part.frame.inside'"
    ):
        cfmkit.drawing(loaded("beam_lan2010", tight))


def test_a_solid_that_comes_to_its_frame_ends_there():
    from cfmkit.export import polygon
    from cfmkit.solid import MATERIAL_LAWS, HeldOrDriven, Part, PathEnd, rings_of

    strip = polygon([(0.0, 0.0), (0.05, 0.0), (0.05, 0.001), (0.0, 0.001)], "cut")
    law = MATERIAL_LAWS["st-venant-kirchhoff"](2e9, 0.3)
    root = HeldOrDriven("root", (np.array([[0.0, 0.0], [0.0, 0.001]]),), np.zeros(2))
    tip = HeldOrDriven(
        "tip", (np.array([[0.05, 0.0], [0.05, 0.001]]),), np.array([0.05, 0.0005]), np.array([0.0, -1.0, 0.0]),
        np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
    )  # fmt: skip
    wall = np.array([[0.02, -0.004], [0.06, -0.004], [0.06, -0.005], [0.02, -0.005]])
    part = Part(rings_of((strip,)), 0.001, 0.01, law, (root, tip), obstacles=(wall,))
    course = part.create_mesh(0.0006).follow_stops([0.0, 0.003, 0.006, 0.01]).course
    assert course.ending is PathEnd.CONTACT
    assert course.travel[-1] == pytest.approx(0.004, abs=2e-5)  # the tip's lower edge is then at the wall
    assert course.touching[1] == pytest.approx(-0.004, abs=1e-4)


@pytest.mark.parametrize("name", ["vcfm_ding2022", "vcfm_u_shape", "vcfm_straight", "vcfm_cosine", "vcfm_hybrid"])
def test_ground_stop_and_seat_of_leaves_are_one_valid_piece_beside_the_spring(name):
    spec = loaded(name, "mechanism.part.frame={ground: 8 mm, stop: 8 mm, seat: 0.5 mm}")
    drawing = cfmkit.drawing(spec)
    leaves, spring = sorted(pieces(material(drawing)), key=lambda one: -one.area)
    assert leaves.is_valid
    # the stop: walls below the bar across the shuttle, at the travel's distance
    gap = next(one for one in drawing.dimensions if one.name == "stop")
    assert gap.value == pytest.approx(8e-3)
    x = gap.start[0] - 1e-3
    between = LineString([(x, gap.start[1] + 1e-6), (x, gap.end[1] - 1e-6)])
    assert not leaves.intersects(between)
    assert leaves.contains(Point(x, gap.start[1] - 1e-4))
    assert leaves.contains(Point(x, gap.end[1] + 1e-4))
    # the seat: as far below the shuttle as the spring is high, less the preload
    seat = next(one for one in drawing.dimensions if one.name == "seat of the spring")
    _, low, _, high = spring.bounds
    assert seat.value == pytest.approx(high - low - 0.5e-3, abs=1e-9)


def test_a_stop_within_the_travel_is_bad_input():
    with pytest.raises(cfmkit.InputError, match="stop: the stop holds the shuttle at 5 mm, but the travel is 6 mm"):
        loaded("vcfm_ding2022", "mechanism.part.frame={stop: 5 mm}")


def test_a_spring_that_does_not_fit_onto_its_seat_is_told():
    """Pressed flat it is two leaves, a block and a corner wide; walls are two leaves and a shuttle apart."""
    words = r"onto its seat, at \(.*: it is 98 mm wide and the walls are 77.48 mm apart"
    with pytest.raises(GeometryError, match=rf"does not fit between the walls {words}"):
        cfmkit.drawing(loaded("vcfm_ding2022", "mechanism.part.frame={seat: 1 mm}", "mechanism.positive.length=40 mm"))

"""Fillets in outlines that have them as a few lines, and meshes that are fine in a few corners only."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon

from cfmkit.solid.boundary_and_element_sizes import GRADING, Ring, Sizes, smallest_arc, with_arcs
from cfmkit.solid.mesh import _lattice, mesh

TURN = np.radians(1.0)


def angle_piece(radius: float, lines: int, hole: bool = False) -> Ring:
    """Return a thick L with one inside corner, rounded as by growing and shrinking it; or a square hole likewise."""
    corners = [(0, 0), (6, 0), (6, 6), (0, 6)] if hole else [(0, 0), (20, 0), (20, 4), (4, 4), (4, 20), (0, 20)]
    shape = Polygon(1e-3 * np.array(corners))
    # a hole's corners are rounded from within
    steps = (-radius, radius) if hole else (radius, -radius)
    for step in steps:
        shape = shape.buffer(step, quad_segs=lines, join_style="mitre" if step == steps[0] else "round")
    return Ring.of(np.asarray(shape.exterior.coords), hole)


@pytest.mark.parametrize("hole", [False, True])
@pytest.mark.parametrize(("radius", "lines"), [(0.7e-3, 5), (0.03e-3, 3)])
def test_an_arc_of_a_few_lines_becomes_one_of_many_on_the_same_circle(radius, lines, hole):
    coarse = angle_piece(radius, lines, hole)
    fine = with_arcs(coarse, radius, TURN)
    arcs = 4 if hole else 1
    many = lines * np.ceil(90 / lines)
    within = [0.5 * radius**2 * count * np.sin(np.pi / 2 / count) for count in (lines, many)]  # sectors of lines
    assert coarse.area - fine.area == pytest.approx(arcs * (within[1] - within[0]), rel=1e-6)
    straight = with_arcs(coarse, 1.3 * radius, TURN)
    np.testing.assert_array_equal(straight.points, coarse.points)  # another radius is no fillet
    turned = np.degrees(np.abs(fine.turns))
    assert np.median(turned) == pytest.approx(90 / many, rel=0.02)
    held = {tuple(point) for point in np.round(coarse.points, 12)}
    assert held <= {tuple(point) for point in np.round(fine.points, 12)}


def test_outside_corners_and_none_at_all_stay_as_they_are():
    round_plate = Ring.of(np.asarray(Polygon([(0, 0), (0.01, 0), (0.01, 0.01)]).buffer(1e-3).exterior.coords), False)
    np.testing.assert_array_equal(with_arcs(round_plate, 1e-3, TURN).points, round_plate.points)
    assert with_arcs(round_plate, 0.0, TURN) is round_plate


def test_the_smallest_arc_is_where_a_quarter_is_one_line():
    least = smallest_arc(1e-6)
    chord = least * (1 - np.cos(np.pi / 4))
    assert chord == pytest.approx(0.5e-6)


def test_points_are_thrown_where_small_elements_are_wanted_and_nowhere_else():
    """One place of 1 um in a plate of 100 mm: cells of 16 um all over it would be 39 million."""
    spot, size = np.array([31e-3, 47e-3]), 1e-6
    field = Sizes(spot[None], np.array([size]), 1e-3)
    points = _lattice((0.0, 0.0, 0.1, 0.1), field, size)
    assert len(points) < 20_000
    wanted = np.hypot(*(points - spot).T) < size / GRADING  # sizes below twice that: a lattice of equal triangles
    assert wanted.sum() == pytest.approx(np.pi / GRADING**2 / np.sqrt(0.75), rel=0.05)


def test_a_small_fillet_is_meshed_in_its_corner_only():
    ring = with_arcs(angle_piece(0.2e-3, 8), 0.2e-3, TURN)
    grid = mesh((ring,), 1e-3, share=0.2)
    sides = np.hypot(*(grid.nodes[grid.edges[:, 0]] - grid.nodes[grid.edges[:, 1]]).T)
    assert sides.min() < 50e-6 < 0.5e-3 < sides.max()
    assert grid.area == pytest.approx(ring.area, rel=1e-5)

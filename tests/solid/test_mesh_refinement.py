"""Triangles of a mesh are split inside their parents, on the true edge, and all fit together."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.solid.boundary_and_element_sizes import Ring
from cfmkit.solid.mesh import mesh
from cfmkit.solid.mesh_refinement import refine

TURN = np.linspace(0, 2 * np.pi, 400, endpoint=False)
SQUARE = Ring.from_points(1e-3 * np.array([[-5.0, -4.0], [5.0, -4.0], [5.0, 4.0], [-5.0, 4.0]]), False)
PLATE = (SQUARE, Ring.from_points(2e-3 * np.column_stack([np.cos(TURN), np.sin(TURN)]), True))


@pytest.fixture(scope="module")
def plate():
    return mesh(PLATE, 1.5e-3)


def angles(grid):
    corners = grid.nodes[grid.triangles[:, :3]]
    sides = np.roll(corners, -1, axis=1) - corners
    back = -np.roll(sides, 1, axis=1)
    cross = sides[..., 0] * back[..., 1] - sides[..., 1] * back[..., 0]
    return np.arctan2(cross, (sides * back).sum(axis=-1))


def sides_met(grid):
    sides = np.sort(grid.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.bincount(np.unique(sides, axis=0, return_counts=True)[1], minlength=3)


def test_all_triangles_are_split_in_four_with_the_boundary_on_the_true_edge(plate):
    finer = refine(plate, PLATE).mesh
    assert len(finer.triangles) == 4 * len(plate.triangles)
    assert finer.area == pytest.approx(80e-6 - 4e-6 * 200 * np.sin(2 * np.pi / 400), rel=1e-6)
    hole = np.unique(finer.edges[finer.rings == 1])
    assert np.hypot(*finer.nodes[hole].T) == pytest.approx(2e-3, rel=1e-4)
    assert sides_met(finer)[1:].tolist() == [len(finer.edges), (3 * len(finer.triangles) - len(finer.edges)) // 2]


def test_splitting_near_a_corner_over_and_over_spoils_no_angle_and_leaves_the_rest(plate):
    grid = plate
    for round_ in range(7):
        middles = grid.nodes[grid.triangles[:, :3]].mean(axis=1)
        grid = refine(grid, PLATE, np.hypot(*(middles - [5e-3, 4e-3]).T) < 2e-3 * 0.6**round_).mesh
        assert sides_met(grid)[3:].sum() == 0  # no node hangs on a side
    assert angles(grid).min() > 0.5 * angles(plate).min()
    assert len(grid.triangles) < 8 * len(plate.triangles)
    far = {tuple(place) for place in plate.nodes if place[0] < -2e-3}
    assert far <= {tuple(place) for place in grid.nodes}


def test_a_parabola_is_interpolated_exactly_on_straight_sides():
    grid = mesh((SQUARE,), 2e-3)
    finer = refine(grid, (SQUARE,), np.arange(len(grid.triangles)) % 3 == 0)

    def parabola(nodes):
        x, y = 1e3 * nodes.T
        return np.column_stack([x * x - 2 * x * y, 3 * y * y + x])

    found = finer.interpolate(parabola(grid.nodes))
    assert found == pytest.approx(parabola(finer.mesh.nodes), abs=1e-12)


def test_new_nodes_are_held_only_between_held_ones():
    grid = mesh((SQUARE,), 2e-3)
    finer = refine(grid, (SQUARE,))
    held = np.abs(grid.nodes[:, 0] + 5e-3) < 1e-9
    found = finer.transfer_selection(held)
    assert (found == (np.abs(finer.mesh.nodes[:, 0] + 5e-3) < 1e-9)).all()


def test_a_motion_without_strain_is_interpolated_exactly_beside_curved_edges(plate):
    """New nodes inside curved triangles stand elsewhere than half way in them: the estimate saw errors there."""
    once = refine(plate, PLATE)
    for grid, marked in ((plate, None), (once.mesh, np.arange(len(once.mesh.triangles)) % 3 == 0)):
        finer = refine(grid, PLATE, marked)
        assert finer.interpolate(grid.nodes) == pytest.approx(finer.mesh.nodes, abs=1e-12)

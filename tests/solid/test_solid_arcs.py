"""Meshes that are fine in a few corners only."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.export import OutlinePiece, merge_pieces
from cfmkit.solid.boundary_and_element_sizes import SIZE_GRADING, Ring, Sizes
from cfmkit.solid.mesh import _lattice_points, mesh
from cfmkit.solid.meshed_part import rings_of


def angle_piece(radius: float) -> Ring:
    """Return a thick L whose inside corner is rounded."""
    corners = [(0, 0), (20, 0), (20, 4), (4, 4), (4, 20), (0, 20)]
    return rings_of(merge_pieces([OutlinePiece.polygon(1e-3 * np.array(corners))], 4e-3, radius), 4e-3)[0]


def test_points_are_thrown_where_small_elements_are_wanted_and_nowhere_else():
    """One place of 1 um in a plate of 100 mm: cells of 16 um all over it would be 39 million."""
    spot, size = np.array([31e-3, 47e-3]), 1e-6
    field = Sizes(spot[None], np.array([size]), 1e-3)
    points = _lattice_points((0.0, 0.0, 0.1, 0.1), field, size)
    assert len(points) < 20_000
    wanted = np.hypot(*(points - spot).T) < size / SIZE_GRADING  # sizes below twice that: a lattice of equal triangles
    assert wanted.sum() == pytest.approx(np.pi / SIZE_GRADING**2 / np.sqrt(0.75), rel=0.05)


def test_a_small_fillet_is_meshed_in_its_corner_only():
    ring = angle_piece(0.2e-3)
    grid = mesh((ring,), 1e-3, share=0.2)
    sides = np.hypot(*(grid.nodes[grid.edges[:, 0]] - grid.nodes[grid.edges[:, 1]]).T)
    assert sides.min() < 50e-6 < 0.5e-3 < sides.max()
    assert grid.area == pytest.approx(ring.area, rel=1e-5)

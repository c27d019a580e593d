"""Distances between the parts of a cam, against shapely's."""

import math

import numpy as np
import pytest
import shapely

from cfmkit.export import Arc, Line
from cfmkit.families.cam.part_sizes_and_clearances import _to_edges


@pytest.mark.parametrize("seed", range(4))
def test_distances_from_edges_and_fillets_are_those_of_the_shape(seed):
    """A rectangle with round corners: places outside and inside, some face a fillet."""
    half, height, radius = 0.02, 0.01, 0.006
    corners = [(half - radius, height - radius, 0), (radius - half, height - radius, 1)]
    corners += [(radius - half, radius - height, 2), (half - radius, radius - height, 3)]
    arcs = [Arc((x, y), radius, 0.5 * math.pi * k, 0.5 * math.pi * (k + 1)) for x, y, k in corners]
    ends = [
        [tuple(np.add(arc.center, radius * np.array([math.cos(a), math.sin(a)]))) for a in (arc.start, arc.end)]
        for arc in arcs
    ]
    lines = [Line(ends[k][1], ends[(k + 1) % 4][0]) for k in range(4)]
    shape = shapely.box(radius - half, radius - height, half - radius, height - radius).buffer(radius, quad_segs=2000)
    x, y = np.random.default_rng(seed).uniform(-0.05, 0.05, (2, 200))
    expected = shapely.distance(shapely.points(x, y), shape.exterior)
    np.testing.assert_allclose(_to_edges((x, y), (*lines, *arcs)), expected, atol=1e-9)

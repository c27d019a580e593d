"""Pictures of stresses in a part."""

import numpy as np
from half_vee import VEE

import cfmkit
from cfmkit.families import family
from cfmkit.plots.stress_map import boundary_nodes


def test_the_boundary_of_a_refined_mesh_is_drawn_from_edge_to_edge():
    """Before, halved edges stood behind all others, and stress maps had grey areas between places far apart."""
    (solid,) = family("beam").elastic.solids(cfmkit.loads(VEE))
    coarse = solid.part.create_mesh()
    meshes = [one.problem.elements.mesh for one in (coarse, coarse.refine()[0])]
    assert len(meshes[0].edges) < len(meshes[1].edges)
    (nodes,) = boundary_nodes(meshes[1])
    drawn = np.sort(np.column_stack([nodes, np.roll(nodes, -1)]), axis=1)
    halves = np.sort(meshes[1].edges[:, [0, 2, 2, 1]].reshape(-1, 2), axis=1)
    assert sorted(map(tuple, drawn)) == sorted(map(tuple, halves))

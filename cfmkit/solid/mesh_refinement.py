"""Refinement of a finite-element mesh: marked triangles are split, each inside its parent, for estimates of errors.

Assumes six-node triangles that meet along whole sides. A marked triangle is split in four by the nodes in the middle of
its sides; its neighbours are split in two or three, always through their longest side, so that no angle gets smaller
and smaller [R]. New nodes on the boundary stand on the true edge. Spaces of displacements on straight-sided meshes are
nested: what two meshes in a row differ by shows the order of convergence, as meshes of a free mesher do not.

Reference
---------
[R] M.-C. Rivara, Algorithms for refining triangular grids, Int. J. Num. Meth. Eng. 20 (1984) 745-756.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array

from cfmkit.arrays import read_only
from cfmkit.solid.elements import PARENT_NODES, shape_functions, slopes
from cfmkit.solid.mesh import TriangleMesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.boundary_and_element_sizes import Ring

    IntArray = NDArray[np.int64]

CHILDREN_BY_SIDES = {
    (False, False, False): ((0, 1, 2),),
    (True, False, False): ((2, 0, 3), (1, 2, 3)),
    (True, True, False): ((2, 0, 3), (3, 1, 4), (2, 3, 4)),
    (True, False, True): ((3, 2, 5), (0, 3, 5), (1, 2, 3)),
    (True, True, True): ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
}  # corners of the children by which sides are halved; side 0, from node 0 to node 1, is the longest
N_NEWTON_STEPS = 3  # of Newton's method for places in curved triangles: one is exact in straight-sided ones


@dataclass(frozen=True, eq=False)
class RefinedMesh:
    """A mesh whose triangles are parts of those of another one."""

    mesh: TriangleMesh
    origins: IntArray  # node of the other mesh that each corner of triangles is, (c,)
    parents: IntArray  # triangle of the other mesh that each triangle lies in, (m,)
    node_parents: IntArray  # nodes of the parent triangle of each node, (n, 6)
    node_shares: FloatArray  # values of their shape functions at the node, (n, 6)

    def transfer_selection(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which nodes (n,) are chosen ones of the other mesh, or in the middle of a side between two of them."""
        corners = self.mesh.triangles[:, :3].max(initial=-1) + 1
        is_marked = np.zeros(len(self.mesh.nodes), bool)
        is_marked[:corners] = chosen[self.origins]
        for first, last, middle in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):
            ends = self.mesh.triangles[:, [first, last]]
            is_marked[self.mesh.triangles[:, middle]] = is_marked[ends].all(axis=1)
        return is_marked

    def interpolate(self, values: FloatArray) -> FloatArray:
        """Return values (n, ...) at the nodes from values at the nodes of the other mesh."""
        starts = np.arange(0, self.node_parents.size + 1, 6)
        shape = (len(self.node_parents), len(values))
        return np.asarray(csr_array((self.node_shares.ravel(), self.node_parents.ravel(), starts), shape) @ values)


def refine(
    mesh: TriangleMesh,
    rings: tuple[Ring, ...],  # the boundary that it was made on
    marked: NDArray[np.bool_] | None = None,  # (m,) of bool: which triangles are split in four; all if left out
) -> RefinedMesh:
    """Return a mesh with some triangles split in four, and neighbours as far as they must be."""
    rotated, halved = _halved_sides(mesh, marked)
    corners, parents, places = [], [], []
    patterns = halved[rotated[:, 3:]]
    for sides, children in CHILDREN_BY_SIDES.items():
        chosen = np.flatnonzero((patterns == sides).all(axis=1))
        for child in children:
            corners.append(rotated[chosen][:, child])
            parents.append(chosen)
            places.append(np.broadcast_to(PARENT_NODES[list(child)], (len(chosen), 3, 2)))
    return _with_side_nodes(
        mesh, rings, rotated, halved, np.concatenate(corners), np.concatenate(parents), np.concatenate(places)
    )


def _halved_sides(mesh: TriangleMesh, marked: NDArray[np.bool_] | None) -> tuple[IntArray, NDArray[np.bool_]]:
    """Return the triangles (m, 6), turned so that side 0 is the longest, and which nodes (n,) halve their sides."""
    points = mesh.nodes[mesh.triangles[:, :3]]
    lengths = np.hypot(*(np.roll(points, -1, axis=1) - points).transpose(2, 0, 1))
    # of sides that are equally long but for rounding both neighbours take the same: the one with the larger number
    ranks = np.round(lengths / lengths.max(), 9)
    longest = np.where(ranks == ranks.max(axis=1, keepdims=True), mesh.triangles[:, 3:], -1).argmax(axis=1)
    turn = (longest[:, None] + np.arange(3)) % 3
    rows = np.arange(len(turn))[:, None]
    rotated = np.concatenate([mesh.triangles[rows, turn], mesh.triangles[rows, 3 + turn]], axis=1)
    halved = np.zeros(len(mesh.nodes), bool)
    halved[rotated[:, 3:] if marked is None else rotated[marked, 3:]] = True
    while True:
        sides = halved[rotated[:, 3:]]
        open_sides = sides.any(axis=1) & ~sides[:, 0]
        if not open_sides.any():
            return rotated, halved
        halved[rotated[open_sides, 3]] = True


def _with_side_nodes(
    mesh: TriangleMesh,
    rings: tuple[Ring, ...],
    rotated: IntArray,
    halved: NDArray[np.bool_],
    corners: IntArray,
    parents: IntArray,
    places: FloatArray,
) -> RefinedMesh:
    """Return the mesh of some corners (m, 3), numbered as in the other mesh, with new nodes on their sides."""
    used = np.unique(corners)
    number = np.full(len(mesh.nodes), -1)
    number[used] = np.arange(len(used))
    sides = np.sort(number[corners[:, [0, 1, 1, 2, 2, 0]]].reshape(-1, 2), axis=1)
    keys, which = np.unique(sides[:, 0] * len(used) + sides[:, 1], return_inverse=True)
    ends = np.column_stack([keys // len(used), keys % len(used)])
    points = mesh.nodes[used]
    middles = points[ends].mean(axis=1)

    def side_of(first: IntArray, last: IntArray) -> IntArray:
        low, high = np.minimum(number[first], number[last]), np.maximum(number[first], number[last])
        return np.asarray(np.searchsorted(keys, low * len(used) + high), np.int64)

    first, last, middle = mesh.edges.T
    split = halved[middle]
    low, high = mesh.arcs.T
    halfway = 0.5 * (low + high)
    whole, ahead, behind = (first, last), (first, middle), (middle, last)
    pieces = ((whole, (low, high), ~split), (ahead, (low, halfway), split), (behind, (halfway, high), split))
    edges = np.concatenate([np.column_stack(ends)[kept] for ends, _, kept in pieces])
    arcs = np.concatenate([np.column_stack(reach)[kept] for _, reach, kept in pieces])
    owners = np.concatenate([mesh.rings[kept] for _, _, kept in pieces])
    on_edge = side_of(edges[:, 0], edges[:, 1])
    for owner, ring in enumerate(rings):
        is_own = owners == owner
        middles[on_edge[is_own]] = ring.locate(arcs[is_own].mean(axis=1))
    triangles = np.column_stack([number[corners], len(used) + which.reshape(-1, 3)])
    refined = TriangleMesh(
        read_only(np.concatenate([points, middles])),
        triangles,
        np.column_stack([number[edges], len(used) + on_edge]),
        owners,
        read_only(arcs),
    )
    at = np.concatenate([places, 0.5 * (places + np.roll(places, -1, axis=1))], axis=1)
    node_parents, node_places = np.zeros((len(refined.nodes), 6), np.int64), np.zeros_like(refined.nodes)
    node_parents[triangles] = rotated[parents][:, None]
    node_places[triangles] = at
    shares = shape_functions(_places_in(mesh.nodes[node_parents], refined.nodes, node_places))
    return RefinedMesh(refined, used, parents, node_parents, shares)


def _places_in(triangles: FloatArray, nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Return where nodes (n, 2) [m] are in triangles (n, 6, 2) [m], (n, 2), by Newton's method from places nearby.

    Inside triangles with a curved side the new sides are straight: displacements taken from places half way in the
    parent triangle were wrong there by as much as what was missing on the coarser mesh.
    """
    for _ in range(N_NEWTON_STEPS):
        off = nodes - np.einsum("na,nak->nk", shape_functions(places), triangles)
        jacobian = np.einsum("nai,nak->nki", slopes(places), triangles)
        places = places + np.linalg.solve(jacobian, off[:, :, None])[:, :, 0]
    return places

"""A mesh of six-node triangles on the outline of a part, made from its boundary, wanted element sizes and seams.

Boundary nodes are laid along the true edges at the wanted sizes, points inside are thrown on a lattice, thinned to the
wanted density and relaxed as a truss whose bars push [PS]; Delaunay's triangulation joins them. Where a boundary piece
is not among its edges, the piece is halved. Nodes in the middle of boundary edges stand on the true edge.

Reference
---------
[PS] P.-O. Persson, G. Strang, A simple mesh generator in MATLAB, SIAM Review 46 (2004) 329-345.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from cfmkit.arrays import read_only
from cfmkit.errors import GeometryError
from cfmkit.solid.boundary_and_element_sizes import SIZE_GRADING, Ring, Sizes, place_text, sizes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    IntArray = NDArray[np.int64]

N_RELAXATIONS, MOVES_PER_ROUND = 14, 3
"""Of relaxation, and moves in each with the same bars; after 30 to 60 moves the smallest angle stays what it is."""
BAR_LENGTH_FACTOR = 1.2
"""Bars want to be so much longer than the sizes [PS, sec. 4]: under pressure points spread everywhere."""
PUSH_SHARE = 0.2  # of the way that the bars push, a round [PS, sec. 4].
BOUNDARY_CLEARANCE = 0.55
"""Points inside keep so many sizes from the boundary: less makes slivers on it, more leaves long triangles."""
SEAM_CLEARANCE = 0.75
"""Points inside keep so many sizes from those on a seam: the circles over its pieces are empty, so they are edges."""
MAX_HALVINGS = 8  # rounds of halving boundary pieces that are no edges; each mends what it finds, two are usual
MOST_NODES = 400_000  # of a mesh: beyond it the factors alone take more than 2 GB


@dataclass(frozen=True)
class TriangleMesh:
    """A part in six-node triangles."""

    nodes: FloatArray  # (n, 2) [m]; corners of triangles first
    triangles: IntArray  # (m, 6) corners counter-clockwise, then the nodes on the sides 0-1, 1-2, 2-0
    edges: IntArray  # (k, 3) boundary: first corner, last corner, node between; the material is on the left
    rings: IntArray  # (k,) ring of each boundary edge
    arcs: FloatArray  # (k, 2) arc lengths of its ends on that ring, increasing [m]

    @property
    def area(self) -> float:
        """Of the straight-sided triangles and the lunes between their sides and the true edge [m2]."""
        x, y = self.nodes.T
        a, b, m = self.edges.T
        # Simpson's rule on x dy - y dx is exact for a parabola through three nodes
        return float(
            0.5
            * sum(w * (x[p] * y[q] - x[q] * y[p]).sum() for p, q, w in ((a, m, 4 / 3), (m, b, 4 / 3), (a, b, -1 / 3)))
        )


def mesh(
    rings: tuple[Ring, ...],  # boundary: around, and round every hole
    size: float,  # side of an element where nothing asks for smaller ones [m]; single ones are up to 1.7 times as long
    share: float = 0.4,  # the same on a curved edge, in its radii
    across: float = 2.0,  # elements across the thickness at least
    # sequence of (2, 2): ends of lines through the part along which elements meet [m]: where a clamp begins
    seams: Sequence[FloatArray] = (),
    # a node stands where a smooth edge that comes along a seam is farther from it than this [m]
    seam_distance: float = 0.0,
) -> TriangleMesh:
    """Return a mesh of the part within some rings.

    Raises GeometryError if the boundary crosses itself, the part is thinner somewhere than elements can resolve, or the
    mesh would have more than `MOST_NODES`.
    """
    region = _part_polygon(rings)
    if (around := sum(float(ring.places[-1]) for ring in rings)) > size * MOST_NODES:
        raise _too_many_nodes(int(around / size))
    field = sizes(rings, size, share, across)
    laid = [_boundary_nodes(ring, field, _seam_crossings(ring, seams, field, seam_distance)) for ring in rings]
    fixed = np.concatenate([ring.locate(arc) for ring, arc in zip(rings, laid, strict=True)])
    on_seams = [_points_on_seam(region, field, seam) for seam in seams]
    sewn = np.concatenate([np.zeros((0, 2)), *on_seams])
    kept_from = Spacing(field, sewn)
    inside = kept_from(_sample_interior(region, field, np.random.default_rng(0)))
    if 4 * (len(inside) + len(fixed)) > MOST_NODES:  # a node in the middle of each side: three to a corner
        raise _too_many_nodes(4 * (len(inside) + len(fixed)))
    inside = _relax_points(region, kept_from, np.concatenate([fixed, sewn]), inside)
    for _ in range(MAX_HALVINGS):
        fixed = np.concatenate([ring.locate(arc) for ring, arc in zip(rings, laid, strict=True)])
        points = np.concatenate([fixed, *on_seams, inside])
        corners = _triangulate(region, points)
        missing = _missing_pieces(corners, laid)
        crossed = [_crossed_pieces(region, corners, points, seam, seam_distance) for seam in seams]
        if not any(len(pieces) for pieces in (*missing, *crossed)):
            return _six_nodes(points, corners, rings, laid)
        first = next(
            (ring.locate(arc[at[:1]])[0] for ring, arc, at in zip(rings, laid, missing, strict=True) if len(at)),
            next((middles[0] for middles in crossed if len(middles)), np.zeros(2)),
        )
        on_seams = [np.concatenate(pair) for pair in zip(on_seams, crossed, strict=True)]
        laid = [_halve_pieces(ring, arc, at) for ring, arc, at in zip(rings, laid, missing, strict=True)]
    reason = "it touches itself, or is thinner than an element"
    raise GeometryError(f"the outline cannot be meshed at {place_text(first)}: {reason}")


def _part_polygon(rings: tuple[Ring, ...]) -> Any:
    """Return the part as a polygon of shapely, prepared for questions."""
    from shapely import MultiPolygon, Polygon, prepare
    from shapely.geometry.polygon import signed_area

    shells = [Polygon(ring.points) for ring in rings if len(ring.points) > 2]
    if len(shells) < len(rings):
        raise GeometryError("an outline of fewer than three points has nothing inside")
    for shell in shells:
        if not shell.is_valid:
            raise _explain_crossing(shell)
    holes = [shell for shell in shells if signed_area(shell.exterior) < 0]
    for hole in holes:
        if not any(shell.covers(hole) for shell in shells if shell not in holes):
            raise GeometryError(f"the hole round {place_text(hole.centroid.coords[0])} is not inside the outline")
    region = MultiPolygon(
        [
            Polygon(shell.exterior, [hole.exterior for hole in holes if shell.covers(hole)])
            for shell in shells
            if signed_area(shell.exterior) > 0
        ]
    )
    if not region.is_valid:
        raise _explain_crossing(region)
    prepare(region)
    return region


def _explain_crossing(shape: Any) -> GeometryError:
    """Return what is wrong with a polygon that is not valid, and where."""
    from shapely.validation import explain_validity

    what, _, where = explain_validity(shape).rstrip("]").partition("[")
    place = place_text([float(word) for word in where.split()])
    return GeometryError(f"the outline crosses itself or touches itself at {place} ({what.strip().lower()})")


MIN_CROSSING_SINE = 0.5  # sine of the angle at which a seam must cross an edge to begin at a node of it


def _seam_crossings(ring: Ring, seams: Sequence[FloatArray], field: Sizes, tolerance: float) -> FloatArray:
    """Return the arc lengths (k,) [m] at which a ring crosses or leaves seams, but for those next to its corners."""
    along = np.roll(ring.points, -1, axis=0) - ring.points
    crossings = []
    for start, end in seams:
        seam, to_ring = end - start, start - ring.points
        det = along[:, 0] * seam[1] - along[:, 1] * seam[0]
        steep = np.abs(det) > MIN_CROSSING_SINE * ring.lengths * np.hypot(*seam)
        det = np.where(steep, det, 1.0)
        share = (to_ring[:, 0] * seam[1] - to_ring[:, 1] * seam[0]) / det
        on_seam = (to_ring[:, 0] * along[:, 1] - to_ring[:, 1] * along[:, 0]) / det
        slack = max(1e-6, tolerance / float(np.hypot(*seam)))  # ends of seams are on edges as closely as they are drawn
        met = steep & (share >= 0) & (share < 1) & (on_seam >= -slack) & (on_seam <= 1 + slack)
        crossings.append(ring.places[:-1][met] + share[met] * ring.lengths[met])
        crossings.append(ring.places[:-1][_leaves_seam(ring, start, end, tolerance)])
    arcs = np.unique(np.concatenate([np.zeros(0), *crossings]))
    if not len(arcs):
        return arcs
    corners = ring.locate(ring.places[ring.corners]) if len(ring.corners) else np.full((1, 2), np.inf)
    places = ring.locate(arcs)
    away = np.hypot(*(places[:, None] - corners).transpose(2, 0, 1)).min(axis=1)
    apart = np.diff(arcs, prepend=-np.inf) > 0.2 * field(places)
    return np.asarray(arcs[(away > 0.2 * field(places)) & apart])


def _leaves_seam(ring: Ring, start: FloatArray, end: FloatArray, tolerance: float) -> NDArray[np.bool_]:
    """Return at which vertices (n,) of a ring it is within `tolerance` [m] of a seam, but not at one of its neighbours.

    A side of an element across such a place, where a fillet runs out on the face of a clamp, would be held at one end
    and in the middle: the spring of `vcfm_ding2022` with fillets of 1 mm was 1.9e-3 too soft or too stiff by chance.
    """
    from shapely import LineString, distance, points

    close = np.asarray(distance(LineString([start, end]), points(ring.points)) <= tolerance)
    return np.asarray(close & ~(np.roll(close, 1) & np.roll(close, -1)))


def _boundary_nodes(ring: Ring, field: Sizes, crossings: FloatArray) -> FloatArray:
    """Return the arc lengths (k,) [m] of the nodes on a ring: corners, crossings, and between them places by size."""
    stops = np.unique(np.concatenate([ring.places[ring.corners], crossings]))
    stops = np.unique(np.concatenate([stops, _curvature_jumps(ring, stops, field)]))
    stops = stops if len(stops) else np.zeros(1)
    ends = np.append(stops[1:], stops[0] + ring.places[-1])
    places = []
    for low, high in zip(stops, ends, strict=True):
        fine = np.linspace(low, high, max(64, int(8 * (high - low) / field.sizes.min()) + 1))
        density = 1.0 / field(ring.locate(fine))
        count = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
        pieces = max(1 if len(stops) > 2 else 3, round(float(count[-1])))
        places.append(np.interp(np.arange(pieces) * count[-1] / pieces, count, fine))
    return np.concatenate(places)


MAX_CURVATURE_JUMP = 0.05
"""Jump of the curvature, times the size, at which a node stands: a side across the end of a fillet, a parabola, made
the force of a strip 0.8 mm thick 1e-4 too small."""


def _curvature_jumps(ring: Ring, stops: FloatArray, field: Sizes) -> FloatArray:
    """Return the arc lengths (k,) [m] of the ends of arcs, but for those next to other stops (m,) [m]."""
    sizes = field(ring.points)
    jumps = sizes * ring.curvature_jumps
    taken = list(ring.locate(stops))
    places = []
    order = np.argsort(-jumps, kind="stable")
    for vertex in order[jumps[order] > MAX_CURVATURE_JUMP]:
        place = ring.points[vertex]
        if all(np.hypot(*(place - stop)) > MIN_STOP_DISTANCE * sizes[vertex] for stop in taken):
            taken.append(place)
            places.append(ring.places[vertex])
    return np.array(places)


MIN_STOP_DISTANCE = 0.4  # distance between nodes that stand at stops, in sizes, from which on both do


def _sample_interior(region: Any, field: Sizes, random: np.random.Generator) -> FloatArray:
    """Return points inside (k, 2) [m], as dense as the sizes ask: a lattice, thinned by chance [PS, step 2]."""
    from shapely import contains_xy

    least = float(field.sizes.min())
    interior = [np.zeros((0, 2))]
    for size in least * 2.0 ** np.arange(int(np.ceil(np.log2(field.largest / least))) + 1):
        # one lattice for each octave of sizes, so that nothing is thinned to less than a quarter
        points = _lattice_points(region.bounds, field, size)
        points = points[contains_xy(region, points)]
        wanted = field(points)
        kept = (wanted >= size) & (wanted < 2 * size) & (random.random(len(points)) < (size / wanted) ** 2)
        interior.append(points[kept])
        if 4 * sum(map(len, interior)) > MOST_NODES:
            raise _too_many_nodes(4 * sum(map(len, interior)))
    return np.concatenate(interior)


CELL_SIZE = 16  # side of the cells in which lattices are laid, in sizes: cells where no such size is wanted have none


def _lattice_points(bounds: tuple[float, float, float, float], field: Sizes, size: float) -> FloatArray:
    """Return a lattice of some size (k, 2) [m], wherever sizes below twice that may be wanted.

    Its cells are found by halving larger ones, so that one small fillet does not need small cells everywhere.
    """
    x0, y0, x1, y1 = bounds
    side = CELL_SIZE * size
    columns, rows = np.arange(x0, x1, side), np.arange(y0, y1, side)
    times = 2 ** max(0, math.ceil(math.log2(max(len(columns), len(rows)))))
    cells = np.zeros((1, 2), np.int64)
    while True:
        middles = np.array([x0, y0]) + side * (cells + 0.5 * times)
        sizes = field(middles) - SIZE_GRADING * times * side  # sizes change by that within half a diagonal
        cells = cells[sizes < 2 * size]
        if CELL_SIZE**2 * len(cells) > 20 * MOST_NODES:  # of them a few lie in the part
            raise _too_many_nodes(CELL_SIZE**2 * len(cells))
        if times == 1:
            break
        times //= 2
        cells = (cells[:, None] + times * np.array([(0, 0), (1, 0), (0, 1), (1, 1)])).reshape(-1, 2)
        cells = cells[(cells[:, 0] < len(columns)) & (cells[:, 1] < len(rows))]
    cells = cells[np.lexsort(cells.T)]  # row by row: what is thrown does not depend on how cells were found
    corner = np.column_stack([columns[cells[:, 0]], rows[cells[:, 1]]])
    lines = round(CELL_SIZE / np.sqrt(0.75))
    column, row = np.meshgrid(np.arange(CELL_SIZE), np.arange(lines))
    inner = np.column_stack([(column + 0.5 * (row % 2)).ravel() * size, row.ravel() * side / lines])
    return np.asarray((corner[:, None] + inner).reshape(-1, 2))


def _too_many_nodes(nodes: int) -> GeometryError:
    return GeometryError(f"the mesh would have more than {MOST_NODES} nodes ({nodes:.2g}): allow larger elements")


def _points_on_seam(region: Any, field: Sizes, seam: FloatArray) -> FloatArray:
    """Return points (k, 2) [m] by size along a line through the part, none of them close to its boundary.

    An end inside the part is one of them, unless it is that close: the section at a node where beams meet is held over
    its whole length.
    """
    from shapely import contains_xy, distance
    from shapely import points as points_of

    fine = seam[0] + np.linspace(0.0, 1.0, 2000)[:, None] * (seam[1] - seam[0])
    fine = fine[contains_xy(region, fine)]
    step_lengths = np.hypot(*np.diff(fine, axis=0, prepend=fine[:1]).T)
    jumps: list[int] = np.flatnonzero(step_lengths > 1.5 * np.median(step_lengths)).tolist() if len(fine) > 2 else []
    sewn = [np.zeros((0, 2))]
    for piece in np.split(fine, jumps):
        if len(piece) > 2:
            count = np.cumsum(np.hypot(*np.diff(piece, axis=0, prepend=piece[:1]).T) / field(piece))
            places = np.linspace(0.0, count[-1], max(2, round(float(count[-1]))) + 1)
            sewn.append(np.column_stack([np.interp(places, count, piece[:, k]) for k in (0, 1)]))
    points = np.concatenate(sewn)
    # not to the nearest place where sizes are known: those are so far apart that a seam on the edge of small fillets
    # had points on that edge, which could then not be meshed
    clearance = distance(region.boundary, points_of(points))
    return np.asarray(points[clearance > 0.5 * BOUNDARY_CLEARANCE * field(points)])


@dataclass(frozen=True)
class Spacing:
    """Keeps points away from the boundary and from seams."""

    field: Sizes
    sewn: FloatArray  # (k, 2) points on seams [m]

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (k, 2) [m] that are far enough from the boundary and from seams."""
        sizes, clearance = self.field.looked_up(points)
        room = BOUNDARY_CLEARANCE * sizes
        far = clearance > room
        if len(self.sewn):
            # half a size beside a seam's own points is further than that from the line between them
            far &= cKDTree(self.sewn).query(points)[0] > SEAM_CLEARANCE * room / BOUNDARY_CLEARANCE
        return points[far]


def _relax_points(region: Any, room: Spacing, fixed: FloatArray, inside: FloatArray) -> FloatArray:
    """Return the points inside (k, 2) [m] where bars that push each other apart let them rest."""
    from shapely import contains_xy

    field = room.field
    for _ in range(N_RELAXATIONS):
        points = np.concatenate([fixed, inside])
        sides = _triangulate(region, points)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        keys = np.sort(sides.min(axis=1) * len(points) + sides.max(axis=1))
        keys = keys[np.diff(keys, prepend=-1) > 0]  # a fifth of the time of numpy's unique
        bars = np.column_stack([keys // len(points), keys % len(points)])
        sizes = field(0.5 * (points[bars[:, 0]] + points[bars[:, 1]]))
        for _ in range(MOVES_PER_ROUND):
            bar_vectors = points[bars[:, 0]] - points[bars[:, 1]]
            length = np.hypot(*bar_vectors.T)
            wanted = BAR_LENGTH_FACTOR * np.sqrt((length**2).sum() / (sizes**2).sum()) * sizes
            push = (np.maximum(wanted - length, 0.0) / length)[:, None] * bar_vectors
            force = np.column_stack(
                [np.bincount(bars.ravel("F"), np.concatenate([push[:, k], -push[:, k]]), len(points)) for k in (0, 1)]
            )
            points[len(fixed) :] += PUSH_SHARE * force[len(fixed) :]
        inside = points[len(fixed) :]
        inside = room(inside[contains_xy(region, inside)])
    return inside


def _triangulate(region: Any, points: FloatArray) -> IntArray:
    """Return Delaunay's triangles (m, 3) in the part, counter-clockwise."""
    from shapely import contains_xy

    triangles = Delaunay(points).simplices.astype(np.int64)
    triangles = triangles[contains_xy(region, points[triangles].mean(axis=1))]
    a, b, c = points[triangles].swapaxes(0, 1)
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles[twice < 0] = triangles[twice < 0][:, [0, 2, 1]]
    longest = np.max([((b - a) ** 2).sum(1), ((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1)], axis=0)
    flat = np.abs(twice) <= 1e-6 * longest  # along straight edges of the boundary
    return np.asarray(triangles[~flat])


def _boundary_pieces(laid: list[FloatArray]) -> list[IntArray]:
    """Return the boundary pieces of each ring as pairs (k, 2) of points."""
    pieces_by_ring, first = [], 0
    for arc in laid:
        index = first + np.arange(len(arc))
        pieces_by_ring.append(np.column_stack([index, np.roll(index, -1)]))
        first += len(arc)
    return pieces_by_ring


def _missing_pieces(corners: IntArray, laid: list[FloatArray]) -> list[IntArray]:
    """Return, ring by ring, which pieces of the boundary are not the edge of exactly one triangle."""
    sides = corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    size = int(corners.max()) + 1
    keys, back = sides[:, 0] * size + sides[:, 1], sides[:, 1] * size + sides[:, 0]
    wanted = [pieces[:, 0] * size + pieces[:, 1] for pieces in _boundary_pieces(laid)]
    return [np.flatnonzero(~np.isin(key, keys) | np.isin(key, back)) for key in wanted]


def _crossed_pieces(
    region: Any, corners: IntArray, points: FloatArray, seam: FloatArray, tolerance: float
) -> FloatArray:
    """Return the middles (k, 2) [m] of the pieces of a seam that triangles cross.

    Where a fillet runs out on the face of a clamp, seams have few points of their own beside the edge; a clamp whose
    face was not one of sides of elements there was 5e-4 too soft.
    """
    from shapely import contains_xy

    along = seam[1] - seam[0]
    length = float(np.hypot(*along))
    along = along / length
    place = (points - seam[0]) @ along
    off = np.abs((points - seam[0]) @ np.array([-along[1], along[0]]))
    slack = max(SEAM_DISTANCE_TOL, tolerance)
    chosen = np.flatnonzero((off <= slack) & (place >= -slack) & (place <= length + slack))
    chosen = chosen[np.argsort(place[chosen], kind="stable")]
    first, last = chosen[:-1], chosen[1:]
    count = len(points)
    sides = np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    wanted = np.minimum(first, last) * count + np.maximum(first, last)
    is_edge = np.isin(wanted, sides[:, 0] * count + sides[:, 1])
    middles = 0.5 * (points[first] + points[last])[~is_edge]
    return np.asarray(middles[contains_xy(region, middles)])


SEAM_DISTANCE_TOL = 1e-9  # distance from a seam up to which a point is on it [m]


def _halve_pieces(ring: Ring, arc: FloatArray, pieces: IntArray) -> FloatArray:
    """Return the arc lengths [m] of the nodes on a ring, with one more in the middle of some pieces."""
    ends = np.append(arc[1:], arc[0] + ring.places[-1])
    return np.sort(np.concatenate([arc, 0.5 * (arc[pieces] + ends[pieces])]))


def _six_nodes(points: FloatArray, corners: IntArray, rings: tuple[Ring, ...], laid: list[FloatArray]) -> TriangleMesh:
    """Return the mesh with nodes on the sides; those of the boundary stand on the true edge."""
    used, flat = np.unique(corners, return_inverse=True)
    place = np.full(len(points), -1)
    place[used] = np.arange(len(used))
    corners, points = flat.reshape(-1, 3), points[used]
    sides = np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, which = np.unique(sides, axis=0, return_inverse=True)
    middles = points[unique].mean(axis=1)
    edges, owners, reaches = [], [], []
    keys = unique[:, 0] * len(points) + unique[:, 1]
    for number, (ring, arc, pieces) in enumerate(zip(rings, laid, _boundary_pieces(laid), strict=True)):
        ends = np.append(arc[1:], arc[0] + ring.places[-1])
        a, b = place[pieces].T
        side = np.searchsorted(keys, np.minimum(a, b) * len(points) + np.maximum(a, b))
        middles[side] = ring.locate(0.5 * (arc + ends))
        edges.append(np.column_stack([a, b, len(points) + side]))
        owners.append(np.full(len(arc), number))
        reaches.append(np.column_stack([arc, ends]))
    triangles = np.column_stack([corners, len(points) + which.reshape(-1, 3)])
    return TriangleMesh(
        read_only(np.concatenate([points, middles])),
        triangles,
        np.concatenate(edges),
        np.concatenate(owners),
        read_only(np.concatenate(reaches)),
    )

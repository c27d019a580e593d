"""One part from overlapping pieces: exact edges of their union, inside corners rounded by the cutter.

Which piece bounds the part where is decided on fine polygons, on a grid that is tiny beside the part. Every line of
their union is then traced back to the edge that it stands for, and edges are cut where they meet: lines stay lines,
arcs stay arcs, smooth edges keep their points and tangents.

Inside corners are rounded as a cutter does it. Its centre stays a radius away from the part, so it runs along edges
that are moved into the waste by that radius, and along circles about outside corners. Where two of these cross, it
touches the part in two places and leaves an arc between them; places that it does not reach are filled.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.contours import Arc, Contour, Edge, Line, Smooth, signed_area
from cfmkit.export.traced_edges import TracedEdge, pair, xy

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

GRID_DISTANCE = 1e-8  # distance of the points between which the union is computed, in sizes of the thinnest piece
MAX_GRID_DISTANCES = 50.0
"""Places nearer to each other than this are one, in grid distances: rounding moves lines by less than one."""
SAGITTA_RTOL = 1e-3
"""How far the polygons of arcs may be from them while the union is computed, in the same sizes: what crosses is then
found, and where it crosses is computed on the arcs themselves."""
MIN_HOLE_SIDE = 1e-3  # holes and parts smaller than the square of this are rounding, in the same sizes
TANGENT_ANGLE = 1e-6  # where the direction turns by less than this edges are tangent [rad]
MIN_CROSSING_ANGLE = 1e-3
"""Edges that cross at less than this angle [rad] are cut where their polygons cross: where they overlap, anywhere."""
MAX_BAND_TURN = 0.5 * math.pi
"""By how much a band beside an edge may turn in one polygon [rad]: it cannot overlap itself then."""


@dataclass(frozen=True, eq=False)
class OutlinePiece:
    """Piece of a union: an area, and the edges that may bound it."""

    edges: tuple[Edge, ...]  # of its boundary, the material on their left
    # polygons that cover it together [m], whose corners are those of lines and the points of smooth edges; none where
    # its edges are one closed chain that does not cross itself
    areas: tuple[FloatArray, ...] = ()

    @classmethod
    def polygon(cls, corners: FloatArray) -> OutlinePiece:
        """Return a polygon (n, 2) [m], in whichever sense it runs."""
        ring = corners if signed_area(np.asarray(corners)) > 0 else corners[::-1]
        ends = [(float(x), float(y)) for x, y in ring]
        return cls(tuple(Line(a, b) for a, b in zip(ends, [*ends[1:], ends[0]], strict=True) if a != b))

    @classmethod
    def from_convex_hull(cls, points: FloatArray) -> list[OutlinePiece]:
        """Return the convex hull of points (n, 2) [m]; none if they are on one line."""
        from shapely import MultiPoint

        hull = MultiPoint(points).convex_hull
        return [cls.polygon(np.asarray(hull.exterior.coords)[:-1])] if hull.geom_type == "Polygon" else []

    @classmethod
    def disc(cls, center: tuple[float, float], radius: float) -> OutlinePiece:
        """Return a circle [m]."""
        return cls((Arc(center, radius, 0.0, 2.0 * math.pi),))

    @classmethod
    def from_contour(cls, contour: Contour) -> OutlinePiece:
        """Return what is within a closed contour."""
        if _encloses(contour.edges) > 0:
            return cls(contour.edges)
        return cls(tuple(edge.reverse() for edge in reversed(contour.edges)))

    def reverse_edges(self) -> tuple[Edge, ...]:
        """Return its edges as they bound what is left when it is cut out."""
        return tuple(edge.reverse() for edge in reversed(self.edges))

    def to_polygons(self, size: float) -> tuple[FloatArray, ...]:
        """Return its polygons, arcs as fine as a size [m] of the thinnest piece needs them."""
        return self.areas or (_ring_corners(self.edges, size),)


def merge_pieces(
    pieces: Sequence[OutlinePiece],  # they may overlap
    size: float,  # of the thinnest of them: what is much smaller is rounding [m]
    fillet: float = 0.0,  # radius of inside corners [m]: that of the cutter. Gaps narrower than twice of it are filled
    holes: Sequence[OutlinePiece] = (),  # cut out in the end
    layer: str = "cut",  # of the contours
) -> tuple[Contour, ...]:
    """Return the contours of the union of some pieces, with rounded inside corners, less some holes.

    Raises GeometryError if nothing is left.
    """
    tolerance = MAX_GRID_DISTANCES * GRID_DISTANCE * size
    tracks = [TracedEdge.from_edge(edge, SAGITTA_RTOL * size) for piece in pieces for edge in piece.edges]
    whole = _unite([area for piece in pieces for area in piece.to_polygons(size)], size)
    rings = [_recognise_edges(_edges_of_runs(runs, tolerance), tolerance) for runs in _trace_rings(whole, tracks, size)]
    if fillet > 0:
        rings = _round_chains(rings, fillet, size)
    if holes:
        tracks = [TracedEdge.from_edge(edge, SAGITTA_RTOL * size) for ring in rings for edge in ring]
        tracks += [TracedEdge.from_edge(edge, SAGITTA_RTOL * size) for hole in holes for edge in hole.reverse_edges()]
        left = _ring_area(rings, size).difference(
            _unite([area for hole in holes for area in hole.to_polygons(size)], size)
        )
        rings = [_edges_of_runs(runs, tolerance) for runs in _trace_rings(left, tracks, size)]
    if not rings:
        raise GeometryError("the pieces of the part leave nothing to cut")
    return tuple(Contour(tuple(ring), layer, closed=True, hole=_encloses(ring) < 0) for ring in rings)


def _unite(areas: Sequence[FloatArray], size: float, *others: Any) -> Any:
    """Return the union of polygons (n, 2), and of geometries of shapely, on the grid, as one."""
    from shapely import Polygon, is_valid, make_valid, union_all

    shapes = np.array([*map(Polygon, areas), *others])
    wrong = ~is_valid(shapes)
    shapes[wrong] = make_valid(shapes[wrong])
    return union_all(shapes, grid_size=GRID_DISTANCE * size)


def _ring_area(rings: Sequence[Sequence[Edge]], size: float) -> Any:
    """Return the area that closed chains of edges bound, holes left out, as a geometry of shapely."""
    outer = [_ring_corners(ring, size) for ring in rings if _encloses(ring) > 0]
    inner = [_ring_corners(ring, size) for ring in rings if _encloses(ring) < 0]
    whole = _unite(outer, size)
    return whole.difference(_unite(inner, size)) if inner else whole


def _ring_corners(ring: Sequence[Edge], size: float) -> FloatArray:
    return np.concatenate([TracedEdge.from_edge(edge, SAGITTA_RTOL * size).corners[:-1] for edge in ring])


def _encloses(ring: Sequence[Edge]) -> float:
    """Return the area of a closed chain of edges [m2], negative where it runs clockwise; of smooth ones by points."""
    area = 0.0
    for edge in ring:
        z = TracedEdge.from_edge(edge, math.inf).z
        area += 0.5 * float((np.conj(z[:-1]) * z[1:]).imag.sum())
    return area


@dataclass(frozen=True, eq=False)
class _Run:
    """A piece of a track that bounds the part, from one parameter to another."""

    track: TracedEdge
    first: float
    last: float

    @property
    def whole(self) -> Edge:
        """The edge, of a ring that is nothing else."""
        return self.track.part(self.first, self.last, self.track.foot(self.first), self.track.foot(self.last))


def _trace_rings(whole: Any, tracks: Sequence[TracedEdge], size: float) -> Iterator[list[_Run]]:
    """Yield, ring by ring of a geometry of shapely, the runs of tracks that bound it, the material on their left."""
    from shapely import STRtree, linestrings, orient_polygons

    starts, ends = (np.concatenate([track.z[part] for track in tracks]) for part in (slice(-1), slice(1, None)))
    owner = np.repeat(np.arange(len(tracks)), [len(track.z) - 1 for track in tracks])
    number = np.concatenate([np.arange(len(track.z) - 1) for track in tracks])
    lines = np.stack([xy(starts), xy(ends)], axis=1)
    sources = _Sources(
        tracks,
        starts,
        ends - starts,
        owner,
        number,
        STRtree(linestrings(lines)),
        MAX_GRID_DISTANCES * GRID_DISTANCE * size,
    )
    for part in getattr(orient_polygons(whole), "geoms", [orient_polygons(whole)]):
        for ring in (part.exterior, *part.interiors) if part.geom_type == "Polygon" else ():
            corners = _drop_close_corners(np.asarray(ring.coords)[:-1] @ np.array([1, 1j]), sources.reach)
            away = corners - corners[0]
            if 0.5 * abs((np.conj(away) * np.roll(away, -1)).imag.sum()) > (MIN_HOLE_SIDE * size) ** 2:
                yield sources.runs(corners)


def _drop_close_corners(corners: NDArray[np.complex128], tolerance: float) -> NDArray[np.complex128]:
    """Return the corners of a ring without those that are within `tolerance` of the one before."""
    while len(corners) > 2:
        close = np.abs(corners - np.roll(corners, 1)) <= tolerance
        if not close.any():
            break
        close &= ~np.roll(close, 1)  # of several in a row every second one first
        corners = corners[~close] if close.any() else corners[::2]
    return corners


@dataclass(frozen=True, eq=False)
class _Sources:
    """All lines of some tracks: where each begins, its vector, its track and its number on it; a tree of them."""

    tracks: Sequence[TracedEdge]
    starts: NDArray[np.complex128]
    along: NDArray[np.complex128]
    owner: NDArray[np.int64]
    number: NDArray[np.int64]
    tree: Any
    reach: float

    def runs(self, corners: NDArray[np.complex128]) -> list[_Run]:
        """Return the runs along a ring (n,) of corners, in their order."""
        from shapely import points

        a, b = corners, np.roll(corners, -1)
        line, source = self.tree.query(points(xy(0.5 * (a + b))), predicate="dwithin", distance=self.reach)
        first, last = ((end[line] - self.starts[source]) / self.along[source] for end in (a, b))
        length = np.abs(self.along[source])
        off = np.maximum(np.abs(first.imag), np.abs(last.imag)) * length
        slack = self.reach / length
        on = (off <= self.reach) & (first.real < last.real) & (first.real >= -slack) & (last.real <= 1 + slack)
        candidates: dict[int, list[tuple[int, float, float]]] = {}
        for k in np.flatnonzero(on).tolist():
            place = float(self.number[source[k]])
            ends = place + float(first[k].real), place + float(last[k].real)
            candidates.setdefault(int(line[k]), []).append((int(self.owner[source[k]]), *ends))
        return self._join_runs([candidates.get(k) for k in range(len(corners))], a, b)

    def _join_runs(
        self, sources: list[list[tuple[int, float, float]] | None], a: NDArray[Any], b: NDArray[Any]
    ) -> list[_Run]:
        """Return the runs that lines with some possible sources each make: the same track as long as it goes on."""
        runs: list[list[Any]] = []
        for k, candidates in enumerate(sources):
            if candidates is None:  # a line that no edge explains stands for itself
                runs.append([TracedEdge(Line(pair(a[k]), pair(b[k])), np.array([a[k], b[k]])), 0.0, 1.0])
                continue
            same = [candidate for candidate in candidates if runs and self._follows(runs[-1], candidate)]
            owner, first, last = min(same or candidates, key=lambda candidate: (candidate[0], candidate[1]))
            if same:
                runs[-1][2] = last
            else:
                runs.append([self.tracks[owner], first, last])
        if len(runs) > 1 and runs[0][0] is runs[-1][0] and abs(runs[0][1] - runs[-1][2]) < 0.01:
            runs[0][1] = runs.pop()[1]
        return [_Run(*run) for run in runs]

    def _follows(self, run: list[Any], candidate: tuple[int, float, float]) -> bool:
        """Return True if a line goes on where a run ends."""
        return run[0] is self.tracks[candidate[0]] and abs(run[2] - candidate[1]) < 0.01


def _edges_of_runs(runs: Sequence[_Run], tolerance: float) -> list[Edge]:
    """Return runs as edges that meet: each begins where the one before ends."""
    if len(runs) == 1:
        return [runs[0].whole]
    meetings = [_find_meeting(first, second) for first, second in zip(runs, [*runs[1:], runs[0]], strict=True)]
    edges: list[Edge] = []
    for run, before, after in zip(runs, [meetings[-1], *meetings[:-1]], meetings, strict=True):
        if abs(after.at - before.at) > tolerance or abs(after.first - before.last) > 1.0:
            edges.append(run.track.part(before.last, after.first, before.at, after.at))
    return _straighten_chain(edges, tolerance)


@dataclass(frozen=True)
class _Meeting:
    """Meeting of two runs: the place, and the parameters of both there."""

    at: complex
    first: float
    last: float


def _find_meeting(before: _Run, after: _Run) -> _Meeting:
    """Return where the tracks of two runs meet, near the end of the first and the start of the second one.

    Tangent ones stay where the polygons have them; what they have in common is an end of one of them then.
    """
    u, v, a, b = before.last, after.first, before.track, after.track
    step = 1e-4
    crossing = abs((a.ahead(u).conjugate() * b.ahead(v)).imag) > MIN_CROSSING_ANGLE
    for _ in range(30 if crossing else 0):
        gap = b.locate(v) - a.locate(u)
        p, q = ((track.locate(w + step) - track.locate(w - step)) / (2 * step) for track, w in ((a, u), (b, v)))
        cross = (p.conjugate() * q).imag
        if abs(cross) < MIN_CROSSING_ANGLE * abs(p) * abs(q):
            break
        by = (gap.conjugate() * q).imag / cross, (gap.conjugate() * p).imag / cross
        u, v = u + by[0], v + by[1]
        if max(abs(u - before.last), abs(v - after.first)) > 1.5:
            break
        if max(map(abs, by)) < 1e-12:
            return _Meeting(a.locate(u), u, v)
    u, v = before.last, after.first
    ends = [(a, u, float(len(a.z) - 1)), (b, v, 0.0)]
    at = next((track.locate(end) for track, w, end in ends if abs(w - end) < 1e-3), a.locate(u))
    return _Meeting(at, *(end if abs(w - end) < 1e-3 else w for _, w, end in ends))


def _recognise_edges(edges: Sequence[Edge], tolerance: float) -> list[Edge]:
    """Return a closed chain in which smooth edges that are lines or arcs are such."""
    return _straighten_chain(
        [_recognise_edge(edge, tolerance) if isinstance(edge, Smooth) else edge for edge in edges], tolerance
    )


def _recognise_edge(edge: Smooth, tolerance: float) -> Edge:
    """Return a smooth edge as the line or the arc that it is within `tolerance` [m]."""
    z = edge.points @ np.array([1, 1j])
    chord, middle = z[-1] - z[0], z[len(z) // 2]
    if np.abs(((z - z[0]) / chord).imag).max() * abs(chord) <= tolerance:
        return Line(pair(z[0]), pair(z[-1]))
    turns = np.angle(np.diff(z)[1:] / np.diff(z)[:-1])
    if len(z) < 4 or abs(turns.sum()) > 1.9 * math.pi:
        return edge
    chord_to_middle = middle - z[0]  # the centre of the circle through the first, a middle and the last point
    twice = 2.0 * (chord_to_middle.conjugate() * chord).imag
    center = z[0] + 1j * (chord_to_middle * abs(chord) ** 2 - chord * abs(chord_to_middle) ** 2) / twice
    spokes = z - center
    if np.abs(np.abs(spokes) - abs(spokes[0])).max() > tolerance:
        return edge
    start, turn = float(np.angle(spokes[0])), float(np.angle(spokes[1:] / spokes[:-1]).sum())
    return Arc(pair(center), float(np.abs(spokes).mean()), start, start + turn)


def _straighten_chain(edges: Sequence[Edge], tolerance: float) -> list[Edge]:
    """Return a closed chain in which successive edges on one line or one circle are one edge."""
    chain: list[Edge] = []
    for edge in edges:
        merged = _join_two_edges(chain[-1], edge, tolerance) if chain else None
        chain[len(chain) - (merged is not None) :] = [edge if merged is None else merged]
    if len(chain) > 2 and (merged := _join_two_edges(chain[-1], chain[0], tolerance)) is not None:
        chain = [merged, *chain[1:-1]]
    return chain


def _join_two_edges(before: Edge, after: Edge, tolerance: float) -> Edge | None:
    """Return two edges as one; None if there is a corner between them, or they are of two kinds."""
    if isinstance(before, Line) and isinstance(after, Line):
        first, second = (edge.ends[1] - edge.ends[0] for edge in (before, after))
        off = abs(float(np.angle(second / first))) * min(abs(first), abs(second))
        return Line(before.start, after.end) if off <= tolerance else None
    if isinstance(before, Arc) and isinstance(after, Arc) and (before.end > before.start) == (after.end > after.start):
        apart = abs(complex(*before.center) - complex(*after.center)) + abs(before.radius - after.radius)
        turn = before.end - before.start + after.end - after.start
        if apart <= 10 * tolerance and abs(turn) <= 2 * math.pi:
            return Arc(before.center, before.radius, before.start, before.start + turn)
    return None


def _round_chains(rings: Sequence[Sequence[Edge]], radius: float, size: float) -> list[list[Edge]]:
    """Return closed chains of edges with inside corners as a cutter of a radius [m] leaves them."""
    fine = SAGITTA_RTOL * min(size, radius)
    ways: list[TracedEdge] = []
    areas: list[FloatArray] = []
    for ring in rings:
        tracks = [TracedEdge.from_edge(edge, fine) for edge in ring]
        for track, following in zip(tracks, [*tracks[1:], tracks[0]], strict=True):
            beside = track.shift_right(radius)
            ways.append(beside)
            areas += _bands(track.z, beside.z)
            out, turn = -1j * track.tangents[-1], float(np.angle(following.tangents[0] / track.tangents[-1]))
            if turn > TANGENT_ANGLE:  # an outside corner: the cutter turns about it
                start = float(np.angle(out))
                around = TracedEdge.from_edge(Arc(pair(track.z[-1]), radius, start, start + turn), fine)
                ways.append(around)
                areas.append(np.concatenate([xy(track.z[-1:]), around.corners]))
            elif turn < -TANGENT_ANGLE:  # an inside corner: beside edges shorter than the radius only it is near enough
                areas.append(TracedEdge.from_edge(Arc(pair(track.z[-1]), radius, 0.0, 2.0 * math.pi), fine).corners)
    reach = _unite(areas, size, _ring_area(rings, size))
    tolerance = MAX_GRID_DISTANCES * GRID_DISTANCE * size
    touched = (_touch_edges(runs, radius, tolerance) for runs in _trace_rings(reach, ways, size))
    closed = (ring for ring in touched if ring and abs(ring[0].ends[0] - ring[-1].ends[1]) <= tolerance)
    return [ring for ring in closed if abs(_encloses(ring)) > (MIN_HOLE_SIDE * size) ** 2]


def _bands(edge: NDArray[np.complex128], beside: NDArray[np.complex128]) -> Iterator[FloatArray]:
    """Yield polygons that cover what is between two lines (n,) of corners, which may wind."""
    from shapely import MultiPoint, Polygon, is_valid

    along = np.angle(np.diff(edge))
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.angle(np.exp(1j * np.diff(along)))))])
    cuts = [*np.searchsorted(turned, np.arange(0.0, turned[-1] + 1e-9, MAX_BAND_TURN)).tolist(), len(edge) - 1]
    for first, last in itertools.pairwise(dict.fromkeys(cuts)):
        band = np.concatenate([edge[first : last + 1], beside[first : last + 1][::-1]])
        if is_valid(Polygon(xy(band))):
            yield xy(band)
            continue
        for k in range(first, last):  # folded: the edge is curved more tightly than it is far from the other line
            hull = MultiPoint(xy(np.array([edge[k], edge[k + 1], beside[k], beside[k + 1]]))).convex_hull
            if hull.geom_type == "Polygon":
                yield np.asarray(hull.exterior.coords)[:-1]


def _touch_edges(runs: Sequence[_Run], radius: float, tolerance: float) -> list[Edge]:
    """Return the edges that a cutter touches whose centre runs so, and the arcs that it leaves between them."""
    runs = [run for run in runs if run.track.moved or isinstance(run.track.edge, Arc)]
    if len(runs) < 2:
        return [run.whole for run in runs if run.track.moved]
    meetings = [_find_meeting(first, second) for first, second in zip(runs, [*runs[1:], runs[0]], strict=True)]
    edges: list[Edge] = []
    around = zip(runs, [*runs[1:], runs[0]], [meetings[-1], *meetings[:-1]], meetings, strict=True)
    for run, following, before, after in around:
        start, end, beyond = (_touch(run, before.last), _touch(run, after.first), _touch(following, after.last))
        if run.track.moved and (abs(end - start) > tolerance or after.first - before.last > 1.0):
            edges.append(run.track.part(before.last, after.first, start, end))
        if abs(beyond - end) > tolerance:
            center = _center_between(end, beyond, after.at, radius)
            first, turn = float(np.angle(end - center)), float(np.angle((beyond - center) / (end - center)))
            edges.append(Arc(pair(center), radius, first, first - (-turn % (2 * math.pi))))
    return _straighten_chain(edges, tolerance)


def _center_between(start: complex, end: complex, place: complex, radius: float) -> complex:
    """Return the centre of the arc of a radius [m] through two points: that on the side of a place near it.

    Where two ways of the cutter meet at a small angle the place is known less exactly than the points are.
    """
    half = 0.5 * (end - start)
    if not 0 < abs(half) < radius:
        return place
    aside = 1j * half / abs(half) * math.sqrt(radius**2 - abs(half) ** 2)
    middle = 0.5 * (start + end)
    return min(middle + aside, middle - aside, key=lambda center: abs(center - place))


def _touch(run: _Run, u: float) -> complex:
    """Return where a cutter touches the part whose centre is at a parameter of a run."""
    edge = run.track.edge
    return run.track.foot(u) if run.track.moved or not isinstance(edge, Arc) else complex(*edge.center)

"""Check that an outline is the part that was specified: areas, sections of beams, nothing joined away from nodes.

The outline is the union of all strips and blocks. At a node they are meant to be one piece; elsewhere strips that
cross, touch or lie together are joined unasked, and the part is stiffer than its beams. Two places are apart if the way
from one to the other, along strips and through rigid bodies, is long beside the line between them; they are joined if
that line runs through the material.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.contours import SECTION_RTOL, lines_of, signed_area
from cfmkit.export.union import GRID_DISTANCE
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import BeamSection, Contour


MIN_WAY_APART = 6.0
"""Shortest way between places that are apart, in thicknesses with a fillet on either side: beams that leave a node with
less than 19 degrees between them are still one piece that far from it."""
POINTS_PER_THICKNESS = 4.0
"""Points along a strip in each thickness with its fillets: two that touch have points close to the place."""
MAX_STRIP_POINTS = 2000  # points of a strip at most; those of more windings are farther apart
GAP_RTOL = 1e-6  # gaps that are rounding, in thicknesses of the thinnest strip
MAX_TRIED_LINES = 200  # lines between two strips that are looked at, the shortest ones
SAGITTA_RTOL = 1e-3  # how far arcs of the outline may be from their lines, in the same
OUTSIDE_RTOL = 1e-5  # lines run through the material if less than this lies outside, in the same


@dataclass(frozen=True, eq=False)
class DrawnStrip:
    """A beam as it is drawn."""

    name: str
    points: FloatArray  # (n, 2) of its centre line [m]
    thickness: FloatArray  # (n,) there [m]
    ends: tuple[str, str]  # nodes that it joins

    def sample(self, fillet: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points (k, 2), the way to them from the start (k,) and half thicknesses (k,) there, closely [m]."""
        distances = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        step = (float(self.thickness.min()) + 2.0 * fillet) / POINTS_PER_THICKNESS
        places = np.linspace(0.0, distances[-1], min(MAX_STRIP_POINTS, math.ceil(distances[-1] / step) + 1))
        at = np.column_stack([np.interp(places, distances, self.points[:, k]) for k in (0, 1)])
        return at, places, 0.5 * np.interp(places, distances, self.thickness)


@dataclass(frozen=True, eq=False)
class DrawnBlock:
    """A pad, an eye or a bar as it is drawn: rigid beside beams."""

    name: str  # in words, for messages
    nodes: tuple[str, ...]  # those that it holds together, of one rigid body
    shape: FloatArray  # (n, 2) polygon [m]


@dataclass(frozen=True)
class Join:
    """Two parts of a drawing that are one piece."""

    # names
    first: str
    second: str
    at: FloatArray  # (2,) where [m]
    gap: float  # between them before the outline was made [m]; negative where they overlap


@dataclass(frozen=True, eq=False)
class NodesAndBodies:
    """Nodes, and which of them belong to one rigid body."""

    places: Mapping[str, FloatArray]  # nodes [m]
    bodies: Mapping[str, str]  # the body of a node, where it has one

    def ways(self, strips: Sequence[DrawnStrip]) -> tuple[dict[str, int], FloatArray]:
        """Return the number of each node, and the shortest ways between all, (m, m) [m]; inf where there is none."""
        number = {name: k for k, name in enumerate(self.places)}
        at = np.array([self.places[name] for name in number]).reshape(-1, 2)
        ways = np.full((len(number), len(number)), np.inf)
        np.fill_diagonal(ways, 0.0)
        for first, second in itertools.combinations(self.bodies, 2):
            if self.bodies[first] == self.bodies[second]:
                i, j = number[first], number[second]
                ways[i, j] = ways[j, i] = float(np.hypot(*(at[i] - at[j])))
        for strip in strips:
            i, j = (number[end] for end in strip.ends)
            length = float(np.hypot(*np.diff(strip.points, axis=0).T).sum())
            ways[i, j] = ways[j, i] = min(ways[i, j], length)
        for k in range(len(number)):
            ways = np.minimum(ways, ways[:, k, None] + ways[None, k])
        return number, ways


def joined_away_from_nodes(
    strips: Sequence[DrawnStrip],
    blocks: Sequence[DrawnBlock],
    nodes: NodesAndBodies,
    contours: Sequence[Contour],  # what was made of them: closed outlines and holes
    fillet: float,  # radius of inside corners [m]; gaps narrower than twice of it are filled
) -> tuple[Join, ...]:
    """Return which parts of a drawing are joined unasked, each pair once, where they are closest."""
    import shapely

    look = _Look(strips, nodes, fillet)
    candidates = [*look.find_close_strips(), *look.find_strips_close_to_blocks(blocks), *look.find_close_blocks(blocks)]
    if not candidates:
        return ()
    material = _material_shape(contours, look.thinnest)
    shapely.prepare(material)
    joins: dict[tuple[str, str], Join] = {}
    for first, second, starts, ends, gaps in candidates:
        order = np.argsort(gaps, kind="stable")[:MAX_TRIED_LINES]
        lines = shapely.linestrings(np.stack([starts[order], ends[order]], axis=1))
        inside = np.flatnonzero(shapely.covers(material, lines))
        if len(inside) and (first, second) not in joins:
            k = order[inside[0]]
            joins[first, second] = Join(first, second, 0.5 * (starts[k] + ends[k]), float(gaps[k]))
    return tuple(joins.values())


def _material_shape(contours: Sequence[Contour], thinnest: float) -> Any:
    """Return the area within outlines and outside of holes, a little larger for rounding."""
    from shapely import Polygon, union_all

    closed = [contour for contour in contours if contour.closed]
    rings = [(edge.hole, Polygon(edge.points(SAGITTA_RTOL * thinnest)).buffer(0.0)) for edge in closed]
    areas = [union_all([ring for is_hole, ring in rings if is_hole is hole]) for hole in (False, True)]
    return areas[0].difference(areas[1]).buffer(OUTSIDE_RTOL * thinnest)


Candidates = tuple[str, str, "FloatArray", "FloatArray", "FloatArray"]
"""Two names, both ends of lines between their parts (k, 2) each [m], and the gap on each line (k,) [m]."""


class _Look:
    """Places at which parts come so close that they may be joined."""

    def __init__(self, strips: Sequence[DrawnStrip], nodes: NodesAndBodies, fillet: float) -> None:
        self.nodes, self.fillet = nodes, fillet
        self.thinnest = min((float(strip.thickness.min()) for strip in strips), default=1.0)
        self.filled = 2.0 * fillet + GAP_RTOL * self.thinnest
        self.names = [strip.name for strip in strips]
        sampled = [strip.sample(fillet) for strip in strips]
        self.points, self.way, self.half = (
            np.concatenate([sample[k] for sample in sampled]) if sampled else np.zeros((0, 2) if k == 0 else 0)
            for k in range(3)
        )
        self.strip = np.repeat(np.arange(len(strips)), [len(sample[1]) for sample in sampled])
        self.number, self.ways = nodes.ways(strips)
        # how far each point is from both nodes of its strip, and which they are
        length = np.array([sample[1][-1] for sample in sampled])[self.strip]
        self.to_ends = np.stack([self.way, length - self.way])
        self.ends = (
            np.array([[self.number[end] for end in strip.ends] for strip in strips]).reshape(-1, 2)[self.strip].T
        )

    def find_close_strips(self) -> Iterator[Candidates]:
        """Yield strips that come close to each other, or to themselves, although they are apart."""
        from scipy.spatial import cKDTree

        if not len(self.points):
            return
        reach = 2.0 * float(self.half.max()) + self.filled
        first, second = cKDTree(self.points).query_pairs(reach, output_type="ndarray").T
        gap = np.hypot(*(self.points[first] - self.points[second]).T) - self.half[first] - self.half[second]
        is_close = gap < self.filled
        first, second, gap = first[is_close], second[is_close], gap[is_close]
        apart = self._way_between(first, second) > MIN_WAY_APART * (
            self.half[first] + self.half[second] + 2.0 * self.fillet
        )
        first, second, gap = first[apart], second[apart], gap[apart]
        pair = self.strip[first] * len(self.names) + self.strip[second]
        for which in np.unique(pair).tolist():
            a, b = (self.names[k] for k in divmod(which, len(self.names)))
            of_pair = pair == which
            if not _found_in_other_half(a, b):
                yield *_order_names(a, b), self.points[first[of_pair]], self.points[second[of_pair]], gap[of_pair]

    def _way_between(self, first: Any, second: Any) -> FloatArray:
        """Return the shortest way along strips and through bodies between points (k,) [m]."""
        along = np.where(self.strip[first] == self.strip[second], np.abs(self.way[first] - self.way[second]), np.inf)
        for i, j in itertools.product((0, 1), repeat=2):
            through = self.ways[self.ends[i, first], self.ends[j, second]]
            along = np.minimum(along, self.to_ends[i, first] + through + self.to_ends[j, second])
        return np.asarray(along)

    def find_strips_close_to_blocks(self, blocks: Sequence[DrawnBlock]) -> Iterator[Candidates]:
        """Yield strips that come close to a rigid block although they are apart from it."""
        import shapely

        places = shapely.points(self.points)
        for block in blocks:
            to_node = self.ways[:, [self.number[node] for node in block.nodes]].min(axis=1)
            distance = np.minimum(*(self.to_ends[k] + to_node[self.ends[k]] for k in (0, 1)))
            shape = shapely.Polygon(block.shape)
            gap = shapely.distance(places, shape) - self.half
            is_close = (gap < self.filled) & (distance > MIN_WAY_APART * 2.0 * (self.half + self.fillet))
            for which in np.unique(self.strip[is_close]).tolist():
                of_strip = np.flatnonzero(is_close & (self.strip == which))
                if _found_in_other_half(self.names[which], block.name):
                    continue
                ends = shapely.get_coordinates(shapely.shortest_line(places[of_strip], shape)).reshape(-1, 2, 2)
                yield self.names[which], block.name, ends[:, 0], ends[:, 1], gap[of_strip]

    def find_close_blocks(self, blocks: Sequence[DrawnBlock]) -> Iterator[Candidates]:
        """Yield blocks of different bodies that come close to each other."""
        import shapely

        body = {block.name: self.nodes.bodies.get(block.nodes[0], block.nodes[0]) for block in blocks}
        for first, second in itertools.combinations(blocks, 2):
            if body[first.name] == body[second.name] or _found_in_other_half(first.name, second.name):
                continue
            line = shapely.shortest_line(shapely.Polygon(first.shape), shapely.Polygon(second.shape))
            if line.length < self.filled:
                ends = shapely.get_coordinates(line)
                yield *_order_names(first.name, second.name), ends[:1], ends[1:], np.array([line.length])


def _found_in_other_half(first: str, second: str) -> bool:
    """Return True if both are of the mirrored half: what they do, the described half does."""
    return first.endswith("'") and second.endswith("'")


def _order_names(first: str, last: str) -> tuple[str, str]:
    """Return two names in one order, whichever of both is the mirrored one: b1 and b2' as well as b1' and b2."""
    plain, second = sorted((first.rstrip("'"), last.rstrip("'")))
    image = "'" if first.endswith("'") != last.endswith("'") else ""
    return plain, second + image


MEASURING_TOLERANCE = 1e-5
"""How far lines may be from the edges of an outline that is measured, in thicknesses of the thinnest beam."""
MIN_FREE_RADII = 4.0
"""Pieces of a beam that are shorter than this are not measured unless none is longer, in radii of the fillets: those at
both ends may reach its middle."""


@dataclass(frozen=True, eq=False)
class SpecifiedPiece:
    """Piece of what is united to a part, as the specification has it."""

    areas: tuple[FloatArray, ...]  # polygons that cover it together, (n, 2) each [m]
    sections: tuple[BeamSection, ...] = ()  # in the middle of its smooth parts, where it is a beam


def check_outline(
    contours: Sequence[Contour],  # the outline, before any holes are cut that are not of `holes`
    pieces: Sequence[SpecifiedPiece],  # those of a beam follow each other
    thinnest: float,  # thickness of the thinnest beam [m]
    fillet: float,  # radius of inside corners [m]
    holes: Sequence[FloatArray] = (),  # (n, 2) each: what is cut out of the pieces [m]
) -> tuple[BeamSection, ...]:
    """Return the sections between joints of the beams of a part, once its outline has them, and the area of its pieces.

    A section is at a joint where it runs on into a piece that is neither its own nor a neighbour of the same beam.

    Raises GeometryError where the outline differs from the specification.
    """
    from shapely import LineString, STRtree, polygons

    rings = [contour.points(MEASURING_TOLERANCE * thinnest) for contour in contours]
    areas: list[FloatArray] = []
    owner: list[int] = []
    for number, piece in enumerate(pieces):
        areas += piece.areas
        owner += [number] * len(piece.areas)
    starts, ends = lines_of(rings)
    tree, different = STRtree([polygons(area) for area in areas]), []
    for number, section in _measurable_sections(pieces, fillet):
        cut = section.cut(starts, ends)
        if np.isfinite(cut).all():
            met = {owner[k] for k in tree.query(LineString(section.line(cut)), "intersects").tolist()}
            if any(
                abs(k - number) > 1 or all(neighbour.beam != section.beam for neighbour in pieces[k].sections)
                for k in met
            ):
                continue
        smaller = format_short(min(0.5 * section.thickness, 0.125 * section.length, 0.5 * fillet), "length", 2)
        remedy = f"--set 'mechanism.part.fillet={smaller}'" if fillet > 0 else "move its neighbours away"
        section.check(sum(cut), "outline", remedy)
        different.append(section)
    enclosed = sum(
        (-1.0 if contour.hole else 1.0) * abs(signed_area(ring)) for contour, ring in zip(contours, rings, strict=True)
    )
    _check_area(enclosed, *_area_bounds(areas, holes, fillet, GRID_DISTANCE * thinnest))
    return tuple(different)


def _measurable_sections(pieces: Sequence[SpecifiedPiece], fillet: float) -> Iterator[tuple[int, BeamSection]]:
    """Yield the sections that fillets leave free, with the number of their piece: at least the longest of a beam."""
    sections = [(number, section) for number, piece in enumerate(pieces) for section in piece.sections]
    longest: dict[str, float] = {}
    for _, section in sections:
        longest[section.beam] = max(section.length, longest.get(section.beam, 0.0))
    return (
        (number, section)
        for number, section in sections
        if section.length >= min(longest[section.beam], MIN_FREE_RADII * fillet)
    )


def _check_area(measured: float, least: float, largest: float) -> None:
    """Refuse an outline that encloses another area than its pieces do, fillets between them included [m2].

    Raises GeometryError with the areas.
    """
    if least * (1.0 - SECTION_RTOL) <= measured <= largest * (1.0 + SECTION_RTOL):
        return
    raise GeometryError(
        f"the outline encloses {1e6 * measured:.6g} mm2, but its beams and blocks {1e6 * least:.6g} to "
        f"{1e6 * largest:.6g} mm2: beams may lie on each other; move them apart, or use another 'mechanism.part.fillet'"
    )


def _area_bounds(
    pieces: Sequence[FloatArray], holes: Sequence[FloatArray], fillet: float, grid: float
) -> tuple[float, float]:
    """Return the area of the union of polygons less holes [m2]: without fillets, and with all that they may fill.

    Raises GeometryError if the union does not exist in numbers of double precision.
    """
    from shapely import GEOSException, Polygon, union_all

    # without a grid the union of strips that only just overlap may lose one of them
    shapes = ([Polygon(area).buffer(0.0) for area in areas] for areas in (pieces, holes))
    try:
        whole, cut = (union_all(shape, grid_size=grid) for shape in shapes)
    except GEOSException:
        raise GeometryError("the outline has pieces that are too thin to be joined: make its beams thicker") from None
    filled = whole.buffer(fillet, quad_segs=32).buffer(-fillet, quad_segs=32) if fillet > 0 else whole
    return float(whole.difference(cut).area), float(filled.difference(cut).area)

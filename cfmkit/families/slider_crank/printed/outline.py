"""The outline of a printed slider-crank: one piece with flexures or a strip.

Flexures, strip and distances of pins are exact. What is around them is a sensible choice: pads behind the clamped
end and at the slider, links wider than any flexure.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.arc_outlines import check_simple
from cfmkit.export.contours import (
    Contour,
    Curve2D,
    Drawing,
    DrawnDimension,
    Line,
    Region,
    Sheet,
    circle,
    mark,
    polygon,
)
from cfmkit.export.fillets import filleted, sharp_notes
from cfmkit.families.slider_crank.linkage_from_spec import linkage_of, unloaded_angle
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import corners, flexures_of, strip_of, travel_direction
from cfmkit.specs.units import format_short
from cfmkit.stock.material_and_part_spec import PaddedPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Strip
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


PAD = (0.012, 0.010)
"""Length and width of the pads [m]."""

STRAIGHT, MITRE = 1e-9, 2.0
"""Sine of an angle that is no corner; reach of the edges at a sharp corner, in half widths."""

SWEPT = 25
"""Poses at which what moves must be clear of the frame."""

LINK_RATIO = 5.0
"""Width of a rigid link in flexure thicknesses."""


def drawing(spec: SliderCrankSpec) -> Drawing:
    """Return the outline of one leg, with a table of its sections."""
    linkage = linkage_of(spec.mechanism)
    unloaded = unloaded_angle(spec.mechanism, linkage)
    if spec.piece == "beam":
        beam = spec.mechanism.beam
        strip = strip_of(spec.mechanism, linkage, unloaded)
        drawn = _strip(strip, beam.offset if beam else 0, _ends(spec))
        drawn = replace(drawn, sheet=Sheet(beam.width if beam else None))
        return _cut(
            spec, replace(drawn, dimensions=tuple(_dimensions(strip.corners)), facts=tuple(_facts(spec, drawn)))
        )
    parts = flexures_of(spec.mechanism)
    points = corners(spec.mechanism, None, linkage, unloaded)
    thick = [0.5 * one.thickness for one in parts]
    bar = 0.5 * LINK_RATIO * max(2.0 * half for half in thick)
    order = [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    own = [thick[0], thick[0], bar, bar, thick[1], thick[1], bar, bar, thick[2], thick[2]]
    pad = _ends(spec)
    half = np.array([0.5 * pad[2], *own, 0.5 * pad[2]])
    table = {
        "x": (points[:, 0], "length"),
        "y": (points[:, 1], "length"),
        "thickness": (np.repeat([one.thickness for one in parts], 2), "length"),
        "width": (np.repeat([one.width for one in parts], 2), "length"),
    }
    widest = max(one.width for one in parts)
    regions = tuple(
        Region(_around(points[2 * k], points[2 * k + 1], bar), one.width)
        for k, one in enumerate(parts)
        if one.width < widest
    )
    sheet = Sheet(widest, regions)
    drawn = Drawing("slider-crank", _piece(points[order], half, pad), (Curve2D("flexures", table),), (), sheet)
    return _cut(spec, replace(drawn, dimensions=tuple(_dimensions(points)), facts=tuple(_facts(spec, drawn))))


@dataclass(frozen=True)
class SolvedPiece:
    """One leg as it is printed."""

    # contour, holes: the outline with its fillets, thicker than drawn where printing adds to it
    contour: Contour
    holes: tuple[Contour, ...]
    # at the ground and at the slider: the face where the leg begins comes first [m]
    pads: tuple[FloatArray, FloatArray]
    sheet: Sheet  # widths
    thinnest: float  # of flexures or strip [m]
    frame: tuple[FloatArray, ...] = ()  # what stands around it and does not bend [m]
    sharp: tuple[str, ...] = ()  # one line per inside corner that no fillet fits, with its place


def solved_piece(spec: SliderCrankSpec) -> SolvedPiece:
    """Return one leg as it is solved as a solid."""
    beam, part = spec.mechanism.beam, spec.mechanism.part
    drawn = drawing(spec)
    frame: tuple[FloatArray, ...] = ()
    if part is not None and part.frame is not None and part.frame.ground is not None:
        frame = _frame(spec, drawn)
        spec = _without_frame(spec, part, _pads(spec, drawn), frame)
        drawn = drawing(spec)
    if spec.piece == "beam" and beam is not None and beam.offset:
        linkage = linkage_of(spec.mechanism)
        strip = strip_of(spec.mechanism, linkage, unloaded_angle(spec.mechanism, linkage))
        drawn = _cut(spec, replace(_strip(strip, 0.0, _ends(spec)), sheet=Sheet(beam.width)))
    outline, *others = (contour for contour in drawn.contours if contour.layer == "cut")
    thinnest = float(drawn.tables[0].columns["thickness"][0].min())
    return SolvedPiece(outline, tuple(others), _pads(spec, drawn), drawn.sheet, thinnest, frame, drawn.notes)


def _without_frame(
    spec: SliderCrankSpec, part: PaddedPart, pads: tuple[FloatArray, ...], frame: tuple[FloatArray, ...]
) -> SliderCrankSpec:
    """Return what bends: without the frame, which stands, and the holes in it."""
    from cfmkit.export.ground_frame import outside

    kept = outside([one.at for one in part.holes], frame, pads)
    holes = tuple(one for one, keep in zip(part.holes, kept, strict=True) if keep)
    around = part.frame and part.frame.model_copy(update={"ground": None})
    alone = part.model_copy(update={"frame": around, "holes": holes})
    return spec.model_copy(update={"mechanism": spec.mechanism.model_copy(update={"part": alone})})


def _pads(spec: SliderCrankSpec, drawn: Drawing) -> tuple[FloatArray, FloatArray]:
    """Return the pads at the ground and at the slider, the face where the leg begins first, two (4, 2) arrays [m]."""
    table = drawn.tables[0].columns
    points = np.column_stack([table["x"][0], table["y"][0]])
    *depths, breadth = _ends(spec)
    ends = []
    for k, sense, depth in ((0, -1.0, depths[0]), (len(points) - 1, 1.0, depths[1])):
        way = sense * _direction(points, k)
        side = 0.5 * breadth * np.array([-way[1], way[0]])
        out = points[k] + depth * way
        ends.append(np.array([points[k] + side, points[k] - side, out - side, out + side]))
    return ends[0], ends[1]


def pad_of(spec: SliderCrankSpec) -> tuple[float, float]:
    """Return depth and breadth of the pads [m]."""
    part = spec.mechanism.part
    return PAD if part is None or part.pad is None else part.pad


def _ends(spec: SliderCrankSpec) -> tuple[float, float, float]:
    """Return depth of the pad at the ground, of that at the slider, and breadth of both [m]."""
    depth, breadth = pad_of(spec)
    frame = spec.mechanism.part.frame if spec.mechanism.part is not None else None
    return (depth, depth, breadth) if frame is None else (frame.wall or depth, frame.shuttle or depth, breadth)


def _cut(spec: SliderCrankSpec, drawn: Drawing) -> Drawing:
    """Return a drawing with its inside corners rounded, its fixing holes, and the frame around it."""
    from cfmkit.export.union import SAGITTA, OutlinePiece, merged

    part = spec.mechanism.part or PaddedPart()
    outline, *others = drawn.contours
    rounded, sharp = filleted(outline, spec.mechanism.fillet)
    frame = _frame(spec, drawn)
    made: tuple[Contour, ...] = (rounded,)
    if frame:
        thinnest = float(drawn.tables[0].columns["thickness"][0].min())
        check_simple(rounded.points(SAGITTA * thinnest), "the outline of the leg")  # the union would hide it
        made = merged(
            [OutlinePiece.within(rounded), *map(OutlinePiece.polygon, frame)], thinnest, spec.mechanism.fillet
        )
    holes = (circle(one.at, 0.5 * one.diameter, "cut", hole=True) for one in part.holes)
    marks = [mark(pad, driven) for pad, driven in zip(_pads(spec, drawn), (False, True), strict=True)]
    marks += [mark(one, driven=False) for one in frame]
    return replace(drawn, contours=(*made, *holes, *others, *marks), notes=sharp_notes(sharp, spec.mechanism.fillet))


def _frame(spec: SliderCrankSpec, drawn: Drawing) -> tuple[FloatArray, ...]:
    """Return the polygons of the frame around the leg and of the bar to its pad [m]; none if none is requested."""
    from cfmkit.export.ground_frame import ground_frame

    part = spec.mechanism.part
    if part is None or part.frame is None or part.frame.ground is None:
        return ()
    about, (ground, slider) = part.frame, _pads(spec, drawn)
    moving = _swept(spec, drawn, slider)
    return ground_frame({"the ground": ground}, moving, (), part.frame.ground, about.clearance, about.inside).pieces


def _swept(spec: SliderCrankSpec, drawn: Drawing, slider: FloatArray) -> Any:
    """Return all that the leg and the pad at the slider cover at rest and over the travel."""
    from cfmkit.export.ground_frame import swept
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.model import analyze

    table = drawn.tables[0].columns
    lines, shapes = [np.column_stack([table["x"][0], table["y"][0]])], [slider]
    fidelity = {"analysis.fidelity": None} if spec.analysis.fidelity == "solid" else {}
    solution: Any = analyze(spec.replace(fidelity), Run()).state
    links = isinstance(spec.mechanism.beam, type(None))
    half = 0.5 * float(table["thickness"][0].max()) * (LINK_RATIO if links else 1.0)
    if solution is None:
        return swept(lines, half, shapes)
    path = solution.pressed.path
    angle = travel_direction(linkage_of(spec.mechanism))
    way = np.array([np.cos(angle), np.sin(angle)])
    for k in np.unique(np.linspace(0, len(solution.travel) - 1, SWEPT).astype(int)):
        point = int(path.at_requested[k])
        lines.append(np.concatenate([path.shape(name, point) for name in path.network.beams]))
        shapes.append(slider + float(solution.travel[k]) * way)
    return swept(lines, half, shapes)


def _dimensions(points: FloatArray) -> Iterator[DrawnDimension]:
    """Yield how far the ends of the centre line are apart."""
    start, end = ((float(x), float(y)) for x, y in (points[0], points[-1]))
    yield DrawnDimension("ends of the centre line", start, end, "x")
    if abs(end[1] - start[1]) > STRAIGHT:
        yield DrawnDimension("ends of the centre line", start, end, "y")


def _facts(spec: SliderCrankSpec, drawn: Drawing) -> Iterator[tuple[str, str]]:
    """Yield what the piece is made of, and how thick it is along its centre line."""
    if spec.mechanism.material is not None:
        yield "material", spec.mechanism.material.words
    thickness = drawn.tables[0].columns["thickness"][0]
    limits = dict.fromkeys(format_short(float(one), "length") for one in (thickness.min(), thickness.max()))
    yield "thickness", " ... ".join(limits) + " along the centre line"


def _around(start: FloatArray, end: FloatArray, half: float) -> FloatArray:
    """Return the rectangle with a straight line as its middle and a half height [m]."""
    along = (end - start) / np.hypot(*(end - start))
    side = half * np.array([-along[1], along[0]])
    return np.array([start - side, end - side, end + side, start + side])


def _strip(strip: Strip, offset: float, pad: tuple[float, float, float]) -> Drawing:
    """Return a strip as it is drawn: without what printing adds."""
    marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(strip.corners, axis=0).T))])
    fractions = np.unique(np.concatenate([marks / marks[-1], strip.places]))
    points = np.column_stack([np.interp(fractions * marks[-1], marks, strip.corners[:, k]) for k in (0, 1)])
    thickness = np.interp(fractions, strip.places, np.asarray(strip.thickness)) - offset
    half = np.array([0.5 * pad[2], *(0.5 * thickness), 0.5 * pad[2]])
    order = [0, *range(len(points)), len(points) - 1]
    table = {
        "place": (fractions * marks[-1], "length"),
        "x": (points[:, 0], "length"),
        "y": (points[:, 1], "length"),
        "thickness": (thickness, "length"),
    }
    return Drawing("slider-crank", _piece(points[order], half, pad), (Curve2D("strip", table),))


def _piece(points: FloatArray, half: FloatArray, pad: tuple[float, float, float]) -> tuple[Contour, ...]:
    """Return the outline around a chain of points with half widths [m], between two pads, and its centre line."""
    begin, end = _direction(points, 0), _direction(points, len(points) - 1)
    line = np.vstack([points[0] - pad[0] * begin, points, points[-1] + pad[1] * end])
    wide = np.concatenate([[half[0]], half, [half[-1]]])
    around = [(float(x), float(y)) for x, y in (*_edge(line, wide), *reversed(_edge(line, -wide)))]
    kept = [point for point, following in zip(around, [*around[1:], around[0]], strict=True) if point != following]
    centre = [(float(x), float(y)) for x, y in dict.fromkeys(map(tuple, points))]
    path = Contour(tuple(Line(a, b) for a, b in itertools.pairwise(centre)), "path")
    return polygon(kept, "cut"), path


def _direction(points: FloatArray, k: int) -> FloatArray:
    """Return the unit vector along a chain at one of its points, between its distinct neighbours."""
    apart = np.flatnonzero(np.hypot(*(points - points[k]).T) > 0)
    before, after = apart[apart < k], apart[apart > k]
    start = points[before[-1]] if len(before) else points[k]
    stop = points[after[0]] if len(after) else points[k]
    way: FloatArray = (stop - start) / np.hypot(*(stop - start))
    return way


@dataclass(frozen=True)
class _ChainSide:
    """One side of a straight piece of a chain: its last point on the centre line, and both ends of the edge [m]."""

    along: FloatArray
    end: FloatArray
    first: FloatArray
    last: FloatArray


def _edge(line: FloatArray, half: FloatArray) -> list[FloatArray]:
    """Return the corners of the edge to the left of a chain, or to the right where half widths are negative [m].

    Every straight piece has exactly its width up to where its edge meets the next one.
    """
    sides = []
    for k in range(len(line) - 1):
        way = line[k + 1] - line[k]
        if (length := np.hypot(*way)) > 0:
            normal = np.array([-way[1], way[0]]) / length
            sides.append(
                _ChainSide(way / length, line[k + 1], line[k] + half[k] * normal, line[k + 1] + half[k + 1] * normal)
            )
    inner = [corner for one, other in itertools.pairwise(sides) for corner in _corner(one, other)]
    return [sides[0].first, *inner, sides[-1].last]


def _corner(one: _ChainSide, other: _ChainSide) -> list[FloatArray]:
    """Return where two edges meet; where the width steps, both ends on the line that halves the angle."""
    if abs(_cross(one.along, other.along)) < STRAIGHT:
        return [one.last, other.first]
    at, reach = one.end, float(np.hypot(*(one.last - one.end)))
    ways = one.last - one.first, other.last - other.first
    if np.isclose(reach, np.hypot(*(other.first - at)), rtol=1e-9, atol=0.0):
        met = _meeting(one.last, ways[0], other.first, ways[1])
        if np.hypot(*(met - at)) <= MITRE * reach:
            return [met]
        middle = one.last + other.first - 2.0 * at
        return [at + reach * middle / np.hypot(*middle)]
    halving = other.along - one.along
    return [_meeting(one.last, ways[0], at, halving), _meeting(other.first, ways[1], at, halving)]


def _meeting(a: FloatArray, way: FloatArray, b: FloatArray, other: FloatArray) -> FloatArray:
    """Return where the lines through two points along two ways meet."""
    met: FloatArray = a + _cross(b - a, other) / _cross(way, other) * way
    return met


def _cross(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])

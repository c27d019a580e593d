"""Both structures as closed contours that can be cut or printed: the leaves with shuttle and walls, and the spring.

Sizes of shuttle, walls and blocks are those of `mechanism.frame`. The two parts stand apart, the spring below; of eight
folded beams one half is drawn, to be made twice, and an odd number of leaves is made up to whole Vs.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.contours import (
    TOLERANCE,
    Arc,
    Contour,
    Curve2D,
    Drawing,
    DrawnDimension,
    Edge,
    Line,
    Region,
    Sheet,
    Smooth,
    circle,
    mark,
)
from cfmkit.export.fillets import filleted, sharp_notes
from cfmkit.families.findings import mm
from cfmkit.families.vcfm.bought_parts import parts_of
from cfmkit.families.vcfm.cut_and_frame_spec import VcfmPart
from cfmkit.families.vcfm.leaf_laws_from_spec import leaf_law, leaf_spring, strip_of
from cfmkit.families.vcfm.walls_stop_and_seat import FrameSizes, frame_notes, frame_sizes
from cfmkit.specs.units import format_short
from cfmkit.stock.material_and_part_spec import CutPart

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.kinds import LeafLaw, LeafSpring
    from cfmkit.families.vcfm.spec import VcfmSpec

GAP = 0.01
"""Between the two parts of the drawing [m]."""

FINE = 2e-4
"""How far files may be from cosine arches, in thicknesses of the thinnest leaf."""

Point = tuple[float, float]
Item = Point | Arc | Smooth
"""A corner, or an edge that is not straight."""


def drawing(spec: VcfmSpec, tolerance: float = TOLERANCE) -> Drawing:
    """Return the leaves with shuttle and walls and the spring, and a table of the leaves' centre line."""
    sizes = sizes_of_frame(spec)
    leaves, low = leaves_contours(spec)
    bought = spec.mechanism.springs is not None
    places, heights, _ = _leaf(spec).centre_line
    table = Curve2D("leaf", {"x": (places, "length"), "y": (heights, "length")})
    spring = [] if bought else spring_contours(spec, low - GAP)
    dimensions, facts = tuple(_dimensions(spec)), tuple(_facts(spec))
    part = spec.mechanism.part or CutPart()
    rounded = [filleted(contour, spec.mechanism.fillet) for contour in (*leaves, *spring)]
    notes = _sharp(rounded, spec.mechanism.fillet)
    holes = [circle(one.at, 0.5 * one.diameter, "cut", hole=True) for one in part.holes]
    contours = (*(contour for contour, _ in rounded), *holes, *_marks(spec, spring, sizes))
    notes = (*_notes(spec), *frame_notes(spec, sizes), *notes)
    near = min(TOLERANCE, FINE * spec.mechanism.thinnest)
    return Drawing("vcfm", contours, (table,), notes, _sheet(spec, spring), dimensions, facts, tolerance=near)


def sharp_corners(spec: VcfmSpec) -> tuple[str, ...]:
    """Return one line per inside corner of leaves and spring that no fillet fits, with its place."""
    leaves, low = leaves_contours(spec)
    spring = [] if spec.mechanism.springs is not None else spring_contours(spec, low - GAP)
    fillet = spec.mechanism.fillet
    return _sharp([filleted(contour, fillet) for contour in (*leaves, *spring)], fillet)


def _sharp(rounded: Sequence[tuple[Contour, tuple[complex, ...]]], fillet: float) -> tuple[str, ...]:
    return sharp_notes([place for _, sharp in rounded for place in sharp], fillet)


def _marks(spec: VcfmSpec, spring: Sequence[Contour], sizes: FrameSizes) -> Iterator[Contour]:
    """Yield walls, shuttle and blocks of the spring on the layers of what stands and of what is driven.

    Without a seat in the frame the block of the spring that stands is that of the preload, which moves it before use.
    """
    frame, about = spec.mechanism.frame, spec.mechanism.bistable
    half, levels = 0.5 * frame.shuttle_width, -(-about.half_beams // 2)
    strip = strip_of(about, spec.mechanism.material)
    wall = half + float(strip.reach)
    top, bottom = (levels - 1) * frame.spacing + frame.clearance, -frame.clearance
    yield mark(_box(-half, bottom, half, top), driven=True)
    if sizes.stopped:
        yield mark(_box(-sizes.out, sizes.under, sizes.out, sizes.under + sizes.shuttle), driven=True)
    for x in (wall, -sizes.out):
        low = sizes.wall_bottom if sizes.floor is None else sizes.floor
        yield mark(_box(x, low, x + sizes.out - wall, sizes.wall_top), False)
    if sizes.floor is not None:
        yield mark(_box(-sizes.out, sizes.floor - sizes.ground, sizes.out, sizes.floor), False)
    if not spring:
        return
    x0, y0, x1, y1 = spring[0].extents
    half, flexures = 0.5 * frame.block, spec.mechanism.flexures
    yield mark(_box(-half, y0 if flexures.kind.stands_on_ends else y1 - frame.block, half, y1), driven=True)
    if not flexures.kind.stands_on_ends:
        yield mark(_box(-half, y0, half, y0 + frame.block), driven=False)
        return
    for x in (x1 - frame.block, *([x0] if flexures.loaded == "whole" else [])):
        yield mark(_box(x, y1 - 1.5 * frame.block, x + frame.block, y1 - 0.5 * frame.block), driven=False)


def _box(x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _dimensions(spec: VcfmSpec) -> Iterator[DrawnDimension]:
    """Yield the span and the rise of a leaf, the shuttle's width, and how far apart the clamped ends are."""
    about, half = spec.mechanism.bistable, 0.5 * spec.mechanism.frame.shuttle_width
    strip = strip_of(about, spec.mechanism.material)
    reach, rise = float(strip.reach), float(strip.rise)
    yield DrawnDimension("rise h", (half, 0.0), (half + reach, -rise), "y")
    yield DrawnDimension("span of a leaf", (half, 0.0), (half + reach, -rise), "x")
    yield DrawnDimension("shuttle", (-half, 0.0), (half, 0.0), "x")
    yield DrawnDimension("across clamps", (-half - reach, -rise), (half + reach, -rise), "x")
    sizes = sizes_of_frame(spec)
    if sizes.stopped:
        yield DrawnDimension("stop", (sizes.out, sizes.wall_top), (sizes.out, sizes.under), "y")
    given = (spec.mechanism.part or VcfmPart()).frame
    if sizes.floor is not None and given is not None and given.seat is not None:
        face = max(y for _, y in sizes.ledge)
        yield DrawnDimension("seat of the spring", (0.0, face), (0.0, -spec.mechanism.frame.clearance), "y")


def _facts(spec: VcfmSpec) -> Iterator[tuple[str, str]]:
    """Yield what both parts are made of, and their leaves."""
    leaves, spring = spec.mechanism.bistable, spec.mechanism.positive
    yield "material", spec.mechanism.material.words
    for part in parts_of(spec):
        yield "springs", f"{part.count} x {f'{part.name}, ' if part.name else ''}{part.data}"
    for word, one, count in (("leaves", leaves, leaves.half_beams), ("spring", spring, None)):
        if one is None:
            continue
        size = f"{mm(one.length)} long, {mm(one.thickness)} thick, {mm(one.width)} wide"
        angle = f", at {format_short(one.angle, 'angle')}" if one.angle else ""
        yield word, f"{f'{count} {one.structure}' if count else one.structure}: {size}{angle}"


def _sheet(spec: VcfmSpec, spring: Sequence[Contour]) -> Sheet:
    """Return the widths of both parts: that of the leaves, and that of the spring around its outline, if it is cut."""
    if not spring:
        return Sheet(spec.mechanism.bistable.width)
    x0, y0, x1, y1 = spring[0].extents
    around = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) + GAP / 4 * np.array(
        [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    )
    return Sheet(spec.mechanism.bistable.width, (Region(around, spec.mechanism.flexures.width),))


def _notes(spec: VcfmSpec) -> Iterator[str]:
    """Yield what the contours do not show."""
    about, count = spec.mechanism.positive, spec.mechanism.bistable.half_beams
    if about is not None and about.kind.drawing_note and about.loaded == "whole":
        yield about.kind.drawing_note
    if count % 2:
        yield f"leaves are drawn as whole Vs: {count + 1} instead of {count}; leave one off"
    if about is None:
        yield "the springs are bought and not drawn: parts.csv lists them"
        return
    leaves, spring = spec.mechanism.bistable.width, about.width
    if leaves != spring:
        yield f"two sheets: leaves with shuttle and walls are {mm(leaves)} thick, the spring {mm(spring)}"


def _check_levels(spec: VcfmSpec) -> None:
    """Refuse leaves of neighbouring levels that overlap.

    Raises
    ------
    cfmkit.errors.GeometryError
        With the place where they are closest, and the spacing at which they just touch.
    """
    frame, about = spec.mechanism.frame, spec.mechanism.bistable
    law = _leaf(spec)
    x, y, slope = law.centre_line
    steepest = int(np.abs(slope).argmax())
    least = max(law.profile[1]) * float(np.hypot(1.0, slope[steepest]))
    if about.half_beams > 2 and frame.spacing <= least:
        at = (0.5 * frame.shuttle_width + float(x[steepest]), float(y[steepest]) + 0.5 * frame.spacing)
        raise GeometryError(
            f"the leaves of neighbouring Vs overlap, at ({mm(at[0])}, {mm(at[1])}): {mm(frame.spacing)} apart, they "
            f"touch at {mm(least)}; use a larger 'mechanism.frame.spacing'"
        )


def leaves_contours(spec: VcfmSpec) -> tuple[list[Contour], float]:
    """Return the outline of shuttle, leaves and walls with the holes between them, and its lowest point [m].

    Raises
    ------
    cfmkit.errors.GeometryError
        If leaves overlap.
    """
    _check_levels(spec)
    frame, about = spec.mechanism.frame, spec.mechanism.bistable
    levels, sizes = -(-about.half_beams // 2), sizes_of_frame(spec)
    half, bottom, wall, out = 0.5 * frame.shuttle_width, -frame.clearance, sizes.wall, sizes.out
    upper = [_edge(spec, 1.0, (half, level * frame.spacing)) for level in range(levels)]
    lower = [_edge(spec, -1.0, (half, level * frame.spacing)) for level in range(levels)]
    top = (levels - 1) * frame.spacing + frame.clearance
    right: list[Item] = [(0.0, top), (half, top)]
    if sizes.stopped:
        head = sizes.under + sizes.shuttle
        right = [(0.0, head), (out, head), (out, sizes.under), (half, sizes.under)]
    right += [*upper[-1], (wall, sizes.wall_top), (out, sizes.wall_top)]
    contours = []
    if sizes.floor is None:
        right += [(out, sizes.wall_bottom), (wall, sizes.wall_bottom), *_back(lower[0]), (half, bottom), (0.0, bottom)]
        contours = [_whole(right)]
    else:
        right += [(out, sizes.floor - sizes.ground), (0.0, sizes.floor - sizes.ground)]
        inner: list[Item] = [(0.0, bottom), (half, bottom), *lower[0], (wall, sizes.floor), *sizes.ledge]
        contours = [_whole(right), _contour([*inner, *_mirrored(inner)], hole=True)]
    for below, above in pairwise(range(levels)):
        hole = [*lower[above], *_back(upper[below])]
        contours += [_contour(hole, hole=True), _contour(_mirrored(hole), hole=True)]
    low = sizes.wall_bottom if sizes.floor is None else sizes.floor - sizes.ground
    return contours, min(bottom, low)


def sizes_of_frame(spec: VcfmSpec) -> FrameSizes:
    """Return the sizes of what stands around leaves, and holds the spring."""
    frame = spec.mechanism.part.frame if spec.mechanism.part is not None else None
    seated = frame is not None and frame.seat is not None
    return frame_sizes(spec, spring_contours(spec, 0.0)[0].extents if seated else None)


def _leaf(spec: VcfmSpec) -> LeafLaw:
    return leaf_law(spec.mechanism.bistable, spec.mechanism.material)


def _edge(spec: VcfmSpec, side: float, apex: Point) -> list[Item]:
    """Return the upper (1) or lower (-1) edge of a leaf from the shuttle at `apex` to the wall."""
    law = _leaf(spec)
    x, y, slope = law.centre_line
    stretch = np.hypot(1.0, slope)
    if len(x) > 2:
        half = 0.5 * side * law.strip.thickness
        points = np.column_stack([x - half * slope / stretch, y + half / stretch]) + np.array(apex)
        return [Smooth(points, np.column_stack([1.0 / stretch, slope / stretch]))]
    up = 0.5 * side * float(stretch[0])
    return [
        (apex[0] + share * float(x[-1]), apex[1] + share * float(y[-1]) + up * height)
        for share, height in zip(*law.profile, strict=True)
    ]


@dataclass(frozen=True)
class SolvedPiece:
    """As much of a part as symmetry leaves: a closed contour with its fillets, and what of it is rigid."""

    contour: Contour
    # moved, held, (n, 2): polygon, or line of two points, that moves down, and the one that stands [m]
    moved: FloatArray
    held: tuple[FloatArray, ...]
    of_leaf: bool  # whether it is of the leaves, not of the spring
    glides: bool = False  # whether what is held moves across as it likes: the middle of a corner


def solved_leaf(spec: VcfmSpec) -> SolvedPiece:
    """Return one leaf between shuttle and wall; both leaves of a V where the shuttle can turn."""
    law, fillet = _leaf(spec), spec.mechanism.fillet
    strip = law.strip
    half, far = 0.5 * spec.mechanism.frame.shuttle_width, 0.5 * spec.mechanism.frame.shuttle_width + float(strip.reach)
    rise, over = float(strip.rise), 2.0 * (max(law.profile[1]) + fillet)
    upper, lower = (_edge(spec, side, (half, 0.0)) for side in (1.0, -1.0))
    out = far + spec.mechanism.frame.block
    right: list[Item] = [(0.0, over), (half, over), *upper, (far, over - rise), (out, over - rise)]
    right += [(out, -over - rise), (far, -over - rise), *_back(lower), (half, -over), (0.0, -over)]
    wall = np.array([[far, over - rise], [out, over - rise], [out, -over - rise], [far, -over - rise]])
    if spec.mechanism.bistable.guided:
        shuttle = np.array([[0.0, over], [half, over], [half, -over], [0.0, -over]])
        return SolvedPiece(filleted(_contour(right), fillet)[0], shuttle, (wall,), True)
    shuttle = np.array([[-half, over], [half, over], [half, -over], [-half, -over]])
    return SolvedPiece(filleted(_whole(right), fillet)[0], shuttle, (wall, wall * np.array([-1.0, 1.0])), True)


def solved_spring(spec: VcfmSpec) -> SolvedPiece:
    """Return one chain of the spring, of a diamond or folded beams the upper half of it."""
    law, frame, fillet = _spring(spec), spec.mechanism.frame, spec.mechanism.fillet
    half = 0.5 * frame.block
    around, bottom, held, glides = law.solved_piece(law.edges(frame.block, frame.corner, fillet, 0.0), half)
    block = np.array([[0.0, 0.0], [half, 0.0], [half, bottom], [0.0, bottom]])
    contour = _contour([(0.0, 0.0), (half, 0.0), *around])
    return SolvedPiece(filleted(contour, fillet)[0], block, (np.array(held),), False, glides)


def spring_contours(spec: VcfmSpec, top: float) -> list[Contour]:
    """Return the spring with its rigid blocks, its upper end at `top` [m]."""
    frame, half = spec.mechanism.frame, 0.5 * spec.mechanism.frame.block
    outer, inner, low = _spring(spec).edges(frame.block, frame.corner, spec.mechanism.fillet, top)
    if spec.mechanism.flexures.loaded == "half":
        hollow = [(-half, inner[-1][1]), *_back(inner), (-half, inner[0][1])] if inner else []
        return [_contour([(-half, top), (half, top), *outer, (half, low), (-half, low), *hollow])]
    whole = _whole([(0.0, top), (half, top), *outer, (half, low), (0.0, low)])
    return [whole, _contour([*inner, *_mirrored(inner)], hole=True)] if inner else [whole]


def _spring(spec: VcfmSpec) -> LeafSpring:
    return leaf_spring(spec.mechanism.flexures, spec.mechanism.material)


def _whole(right: list[Item]) -> Contour:
    return _contour([*right, *_mirrored(right)])


def _ends(item: Item) -> tuple[Point, Point]:
    if isinstance(item, tuple):
        return item, item
    first, last = item.ends
    return (first.real, first.imag), (last.real, last.imag)


def _back(items: Sequence[Item]) -> list[Item]:
    """Return a chain run the other way."""
    return [item if isinstance(item, tuple) else item.reversed() for item in reversed(items)]


def _mirrored(items: Sequence[Item]) -> list[Item]:
    """Return the mirror image of a chain, run the other way, so that it closes the first."""
    return [(-item[0], item[1]) if isinstance(item, tuple) else item.mirrored() for item in _back(items)]


def _contour(items: Sequence[Item], hole: bool = False) -> Contour:
    """Return a closed contour through corners and edges, straight between them."""
    edges: list[Edge] = []
    for item, following in zip(items, [*items[1:], items[0]], strict=True):
        if not isinstance(item, tuple):
            edges.append(item)
        start, stop = _ends(item)[1], _ends(following)[0]
        if np.hypot(stop[0] - start[0], stop[1] - start[1]) > 1e-12:
            edges.append(Line(start, stop))
    return Contour(tuple(edges), "cut", closed=True, hole=hole)

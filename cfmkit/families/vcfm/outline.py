"""Leaves (with shuttle and walls) and spring of a vcfm as closed contours that can be cut or printed.

Sizes of shuttle, walls and blocks are those of `mechanism.frame`. The two parts stand apart, the spring below; of eight
folded beams one half is drawn, to be made twice, and an odd number of leaves is made up to whole Vs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import (
    OUTLINE_TOLERANCE,
    Contour,
    Curve2D,
    Drawing,
    DrawnDimension,
    Region,
    Sheet,
    circle,
    mark,
)
from cfmkit.export.drawn_as_specified import check_outline
from cfmkit.export.fillets import round_inside_corners, sharp_notes
from cfmkit.export.fixing_holes_and_labels import add_fixing_holes
from cfmkit.export.posed_part import rectangle
from cfmkit.families.findings import mm
from cfmkit.families.vcfm.leaf_laws_from_spec import leaf_law
from cfmkit.families.vcfm.part import leaves_contours, sizes_of_frame, specified_pieces, spring_contours
from cfmkit.families.vcfm.surroundings import FrameSizes, frame_notes, parts_of
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.families.vcfm.spec import VcfmSpec

PART_GAP = 0.01  # between the two parts of the drawing [m]
COSINE_TOLERANCE_RATIO = 2e-4  # how far files may be from cosine arches, in thicknesses of the thinnest leaf


def drawing(spec: VcfmSpec, tolerance: float = OUTLINE_TOLERANCE) -> Drawing:
    """Return the leaves with shuttle and walls and the spring, and a table of the leaves' centre line.

    Raises `GeometryError` if leaves overlap, or if a leaf, or the area of the part, is not that of the specification.
    """
    sizes = sizes_of_frame(spec)
    places, heights, _ = leaf_law(spec.mechanism.bistable, spec.mechanism.material).centre_line
    table = Curve2D("leaf", {"x": (places, "length"), "y": (heights, "length")})
    leaves, spring, top = _contours(spec)
    fillet, thinnest = spec.mechanism.fillet, spec.mechanism.thinnest
    rounded = [round_inside_corners(contour, fillet) for contour in (*leaves, *spring)]
    cut = [contour for contour, _ in rounded]
    sections = check_outline(cut, tuple(specified_pieces(spec, top)), thinnest, fillet)
    part = spec.mechanism.cut_part
    holes = [circle(hole.at, 0.5 * hole.diameter, "cut", hole=True) for hole in part.holes]
    marks = tuple(_marks(spec, spring, sizes))
    contours, bare = add_fixing_holes((*cut, *holes), marks, part.screws)
    return Drawing(
        "vcfm",
        (*contours, *marks),
        (table,),
        (*_notes(spec), *frame_notes(spec, sizes), *_describe_sharp_corners(rounded, fillet), *bare),
        _sheet(spec, spring),
        tuple(_dimensions(spec, sizes)),
        tuple(_title_block_lines(spec)),
        tolerance=min(OUTLINE_TOLERANCE, COSINE_TOLERANCE_RATIO * thinnest),
        sections=sections,
    )


def _contours(spec: VcfmSpec) -> tuple[list[Contour], list[Contour], float]:
    """Return the contours of leaves and spring without fillets, the second ones below, and the spring's upper end."""
    leaves, low = leaves_contours(spec)
    top = low - PART_GAP
    return leaves, [] if spec.mechanism.springs is not None else spring_contours(spec, top), top


def sharp_corners(spec: VcfmSpec) -> tuple[str, ...]:
    """Return one line per inside corner of leaves and spring that no fillet fits, with its place."""
    leaves, spring, _ = _contours(spec)
    fillet = spec.mechanism.fillet
    return _describe_sharp_corners([round_inside_corners(contour, fillet) for contour in (*leaves, *spring)], fillet)


def _describe_sharp_corners(rounded: Sequence[tuple[Contour, tuple[complex, ...]]], fillet: float) -> tuple[str, ...]:
    return sharp_notes([place for _, sharp in rounded for place in sharp], fillet)


def _marks(spec: VcfmSpec, spring: Sequence[Contour], sizes: FrameSizes) -> Iterator[Contour]:
    """Yield walls, shuttle and blocks of the spring on the layers of what stands and of what is driven.

    Without a seat in the frame the block of the spring that stands is that of the preload, which moves it before use.
    """
    for body in sizes.bodies():
        yield mark(body.outline(), body.role == "driven")
    if not spring:
        return
    x0, y0, x1, y1 = spring[0].extents
    block, flexures = spec.mechanism.frame.block, spec.mechanism.flexures
    half = 0.5 * block
    yield mark(rectangle(-half, y0 if flexures.kind.stands_on_ends else y1 - block, half, y1), driven=True)
    if not flexures.kind.stands_on_ends:
        yield mark(rectangle(-half, y0, half, y0 + block), driven=False)
        return
    for x in (x1 - block, *([x0] if flexures.loaded == "whole" else [])):
        yield mark(rectangle(x, y1 - 1.5 * block, x + block, y1 - 0.5 * block), driven=False)


def _dimensions(spec: VcfmSpec, sizes: FrameSizes) -> Iterator[DrawnDimension]:
    """Yield the span and the rise of a leaf, the shuttle's width, and how far apart the clamped ends are."""
    strip = leaf_law(spec.mechanism.bistable, spec.mechanism.material).strip
    half, reach, rise = sizes.half, float(strip.reach), float(strip.rise)
    yield DrawnDimension("rise h", (half, 0.0), (half + reach, -rise), "y")
    yield DrawnDimension("span of a leaf", (half, 0.0), (half + reach, -rise), "x")
    yield DrawnDimension("shuttle", (-half, 0.0), (half, 0.0), "x")
    yield DrawnDimension("across clamps", (-half - reach, -rise), (half + reach, -rise), "x")
    if sizes.stopped:
        yield DrawnDimension("stop", (sizes.out, sizes.wall_top), (sizes.out, sizes.under), "y")
    frame = spec.mechanism.cut_part.frame
    if sizes.floor is not None and frame is not None and frame.seat is not None:
        face = max(y for _, y in sizes.ledge)
        yield DrawnDimension("seat of the spring", (0.0, face), (0.0, -spec.mechanism.frame.clearance), "y")


def _title_block_lines(spec: VcfmSpec) -> Iterator[tuple[str, str]]:
    """Yield what both parts are made of, and their leaves."""
    leaves, spring = spec.mechanism.bistable, spec.mechanism.positive
    yield "material", spec.mechanism.material.words
    for part in (listed for listed in parts_of(spec) if listed.source == "buy"):
        yield "springs", f"{part.count} x {f'{part.name}, ' if part.name else ''}{part.data}"
    for word, strip, count in (("leaves", leaves, leaves.half_beams), ("spring", spring, None)):
        if strip is None:
            continue
        length, thick, width = (
            format_short(size, "length", 7) for size in (strip.length, strip.thickness, strip.width)
        )
        size = f"{length} long, {thick} thick, {width} wide"
        angle = f", at {format_short(strip.angle, 'angle', 6)}" if strip.angle else ""
        yield word, f"{f'{count} {strip.structure}' if count else strip.structure}: {size}{angle}"


def _sheet(spec: VcfmSpec, spring: Sequence[Contour]) -> Sheet:
    """Return the widths of both parts: that of the leaves, and that of the spring around its outline, if it is cut."""
    if not spring:
        return Sheet(spec.mechanism.bistable.width)
    x0, y0, x1, y1 = spring[0].extents
    around = rectangle(x0, y0, x1, y1) + PART_GAP / 4 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
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

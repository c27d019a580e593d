"""Whether an outline is the part that was specified: the area of its pieces, and the sections of its beams."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.beam_sections import SECTION_RTOL, lines_of
from cfmkit.export.contours import signed_area
from cfmkit.export.union import GRID_DISTANCE
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.export.beam_sections import BeamSection
    from cfmkit.export.contours import Contour

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

    rings = [one.points(MEASURING_TOLERANCE * thinnest) for one in contours]
    areas: list[FloatArray] = []
    owner: list[int] = []
    for number, piece in enumerate(pieces):
        areas += piece.areas
        owner += [number] * len(piece.areas)
    starts, ends = lines_of(rings)
    tree, found = STRtree([polygons(area) for area in areas]), []
    for number, section in _measurable(pieces, fillet):
        cut = section.cut(starts, ends)
        if np.isfinite(cut).all():
            met = {owner[k] for k in tree.query(LineString(section.line(cut)), "intersects").tolist()}
            if any(abs(k - number) > 1 or all(other.beam != section.beam for other in pieces[k].sections) for k in met):
                continue
        smaller = format_short(min(0.5 * section.thickness, 0.125 * section.length, 0.5 * fillet), "length", 2)
        remedy = f"--set 'mechanism.part.fillet={smaller}'" if fillet > 0 else "move its neighbours away"
        section.check(sum(cut), "outline", remedy)
        found.append(section)
    enclosed = sum(
        (-1.0 if one.hole else 1.0) * abs(signed_area(ring)) for one, ring in zip(contours, rings, strict=True)
    )
    _check_area(enclosed, *_areas(areas, holes, fillet, GRID_DISTANCE * thinnest))
    return tuple(found)


def _measurable(pieces: Sequence[SpecifiedPiece], fillet: float) -> Iterator[tuple[int, BeamSection]]:
    """Yield the sections that fillets leave free, with the number of their piece: at least the longest of a beam."""
    sections = [(number, one) for number, piece in enumerate(pieces) for one in piece.sections]
    longest: dict[str, float] = {}
    for _, one in sections:
        longest[one.beam] = max(one.length, longest.get(one.beam, 0.0))
    return ((number, one) for number, one in sections if one.length >= min(longest[one.beam], MIN_FREE_RADII * fillet))


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


def _areas(
    pieces: Sequence[FloatArray], holes: Sequence[FloatArray], fillet: float, grid: float
) -> tuple[float, float]:
    """Return the area of the union of polygons less holes [m2]: without fillets, and with all that they may fill.

    Raises GeometryError if the union does not exist in numbers of double precision.
    """
    from shapely import GEOSException, Polygon, union_all

    # without a grid the union of strips that only just overlap may lose one of them
    shapes = ([Polygon(area).buffer(0.0) for area in areas] for areas in (pieces, holes))
    try:
        whole, cut = (union_all(own, grid_size=grid) for own in shapes)
    except GEOSException:
        raise GeometryError("the outline has pieces that are too thin to be joined: make its beams thicker") from None
    filled = whole.buffer(fillet, quad_segs=32).buffer(-fillet, quad_segs=32) if fillet > 0 else whole
    return float(whole.difference(cut).area), float(filled.difference(cut).area)

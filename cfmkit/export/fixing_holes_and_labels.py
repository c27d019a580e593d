"""Additions to a drawn part where nothing bends: holes for screws, and engraved texts.

Holes are in what stands and in what is driven, where heads have room beside all that bends. That begins at the edges of
pads, walls and shuttles: a head that lies within them clears its motion. A text names the specification and the
thickness of the sheet, one for each part, on its largest piece that is held, or else on one that is driven.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import DRIVEN_LAYER, HELD_LAYER, OUTLINE_TOLERANCE, Contour, EngravedText, circle
from cfmkit.specs.block import replace_blocks
from cfmkit.specs.units import format_short
from cfmkit.stock.stock_series import SOCKET_SCREWS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import Drawing, Sheet


NO_HOLES = "no holes there"  # ends the note on pads that are too small
SCREWS_BY_NAME = {screw.name: screw for screw in SOCKET_SCREWS}


def add_fixing_holes(
    contours: Sequence[Contour], marks: Sequence[Contour], screw: str | None
) -> tuple[tuple[Contour, ...], tuple[str, ...]]:
    """Return contours of a part with clearance holes, and a note where pads are too small for a head.

    Parameters
    ----------
    contours, marks : sequence of Contour
        What is cut, and the outlines of what stands and of what is driven.
    screw : str or None
        Name of a screw in `SOCKET_SCREWS`; None for no holes.
    """
    if screw is None:
        return tuple(contours), ()
    size, bare = SCREWS_BY_NAME[screw], 0
    centers: list[FloatArray] = []
    stated = [np.array(contour.extents).reshape(2, 2).mean(axis=0) for contour in contours if contour.hole]
    for outline in (mark for mark in marks if mark.closed):
        places = _places_of_heads(outline.points(OUTLINE_TOLERANCE), size.head)
        bare += not places
        for place in places:
            if all(np.hypot(*(place - center)) >= size.head for center in (*centers, *stated)):
                centers.append(place)
    holes = (circle((float(x), float(y)), 0.5 * size.hole, "cut", hole=True) for x, y in centers)
    note = f"{bare} of the pads and walls are too small for the head of an {screw}: {NO_HOLES}"
    return (*contours, *holes), (note,) if bare else ()


def remove_screws(spec: Any) -> Any:
    """Return a specification without holes for screws: they are in what stands or moves as one, which is not solved."""
    part = spec.mechanism.part
    if part is None or part.screws is None:
        return spec
    return replace_blocks(spec, type(part), lambda block: block.derive(screws=None))


def _places_of_heads(outline: FloatArray, head: float) -> list[FloatArray]:
    """Return where heads of a diameter [m] lie within an outline (n, 2) [m], as far from each other as it is long.

    Two on its longer axis if they have room beside each other, or one in its middle.
    """
    from shapely import LineString, Point, Polygon

    room = Polygon(outline).buffer(-0.5 * head * (1.0 - 1e-9))
    if room.is_empty:
        return []
    middle = np.array(room.centroid.coords[0])
    corners = np.array(Polygon(outline).minimum_rotated_rectangle.exterior.coords)[:3]
    sides = np.diff(corners, axis=0)
    along = sides[int(np.argmax(np.hypot(*sides.T)))]
    crossing = room.intersection(LineString([middle - along, middle + along]))
    ends = np.array([point for line in getattr(crossing, "geoms", [crossing]) for point in line.coords])
    if len(ends) > 1 and np.hypot(*(ends[-1] - ends[0])) >= head:
        return [ends[0], ends[-1]]
    return [middle] if room.buffer(1e-9).contains(Point(middle)) else [ends[0]] if len(ends) else []


MAX_HEIGHT_SHARE, LETTER_BREADTH = 0.6, 0.8
"""Largest height of the text in parts of the piece's shorter side; breadth of a letter in its heights, which no usual
font exceeds."""
MAX_TEXT_HEIGHT = 5e-3  # height of the text at most [m]
MIN_HOLE_AREA = 1e-8  # holes that cover less of a piece than this beside it touch it only [m2]
FLATTENING_TOLERANCE = 5e-6  # outlines of bodies are flattened within this [m]


def engrave_labels(
    drawing: Drawing,  # with marks of what is held and driven
    name: str,  # of the specification
) -> Drawing:
    """Return a drawing with a label on each of its parts that has a held or a driven piece."""
    return replace(drawing, labels=tuple(_make_labels(drawing, name)))


def _make_labels(drawing: Drawing, name: str) -> Iterator[EngravedText]:
    from shapely import Polygon

    cut = [
        (contour, Polygon(contour.points(FLATTENING_TOLERANCE)))
        for contour in drawing.contours
        if contour.layer == "cut" and contour.closed
    ]
    holes = [shape for contour, shape in cut if contour.hole]
    marks = [contour for contour in drawing.contours if contour.layer in (HELD_LAYER, DRIVEN_LAYER) and contour.closed]
    for body in (shape for contour, shape in cut if not contour.hole):
        pads: list[Any] = []
        for layer in (HELD_LAYER, DRIVEN_LAYER):
            marked = [Polygon(mark.points(FLATTENING_TOLERANCE)) for mark in marks if mark.layer == layer]
            pads = pads or [polygon for polygon in marked if body.contains(polygon.centroid)]
        spots = sorted(pads, key=lambda polygon: -polygon.area)
        for spot in spots:
            thick = _thickness_at(drawing.sheet, spot.centroid)
            text = name if thick is None else f"{name}, sheet {format_short(thick, 'length')}"
            if (label := _place_text(text, spot)) is not None and not any(
                spot.intersection(hole).area > MIN_HOLE_AREA for hole in holes
            ):
                yield label
                break


def _thickness_at(sheet: Sheet, at: Any) -> float | None:
    from shapely import Polygon

    thicknesses = [region.thickness for region in sheet.regions if Polygon(region.polygon).contains(at)]
    return max(thicknesses) if thicknesses else sheet.thickness


def _place_text(text: str, spot: Any) -> EngravedText | None:
    """Return a text in the middle of a rectangle, along its longer side and never upside down."""
    corners = np.array(spot.minimum_rotated_rectangle.exterior.coords)
    if len(corners) < 4:
        return None
    sides = np.diff(corners[:3], axis=0)
    lengths = np.hypot(*sides.T)
    longer = int(lengths.argmax())
    angle = float(np.arctan2(*sides[longer][::-1]))
    angle = (angle + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    height = min(
        MAX_HEIGHT_SHARE * float(lengths.min()), float(lengths.max()) / (LETTER_BREADTH * len(text)), MAX_TEXT_HEIGHT
    )
    middle = spot.centroid
    return EngravedText(text, (float(middle.x), float(middle.y)), height, angle)

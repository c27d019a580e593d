"""Texts engraved on parts: the name of the specification and the thickness of the sheet, one text for each part.

It stands on the largest piece that is held, or else on one that is driven, since nothing there bends.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import EngravedText
from cfmkit.export.layers import DRIVEN_LAYER, HELD_LAYER
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.export.contours import Drawing, Sheet

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
    return replace(drawing, labels=tuple(_labels(drawing, name)))


def _labels(drawing: Drawing, name: str) -> Iterator[EngravedText]:
    from shapely import Polygon

    cut = [
        (one, Polygon(one.points(FLATTENING_TOLERANCE)))
        for one in drawing.contours
        if one.layer == "cut" and one.closed
    ]
    holes = [shape for one, shape in cut if one.hole]
    marks = [one for one in drawing.contours if one.layer in (HELD_LAYER, DRIVEN_LAYER) and one.closed]
    for body in (shape for one, shape in cut if not one.hole):
        found: list[Any] = []
        for layer in (HELD_LAYER, DRIVEN_LAYER):
            own = [Polygon(one.points(FLATTENING_TOLERANCE)) for one in marks if one.layer == layer]
            found = found or [one for one in own if body.contains(one.centroid)]
        spots = sorted(found, key=lambda one: -one.area)
        for spot in spots:
            thick = _thickness(drawing.sheet, spot.centroid)
            text = name if thick is None else f"{name}, sheet {format_short(thick, 'length')}"
            if (label := _place_text(text, spot)) is not None and not any(
                spot.intersection(hole).area > MIN_HOLE_AREA for hole in holes
            ):
                yield label
                break


def _thickness(sheet: Sheet, at: Any) -> float | None:
    from shapely import Polygon

    own = [one.thickness for one in sheet.regions if Polygon(one.polygon).contains(at)]
    return max(own) if own else sheet.thickness


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

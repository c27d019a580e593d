"""Holes for screws in what stands and in what is driven, where their heads have room beside all that bends.

What bends begins at the edges of these pads, walls and shuttles: a head that lies within them clears its motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import OUTLINE_TOLERANCE, Contour, circle
from cfmkit.stock.stock_series import SOCKET_SCREWS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray

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
            if all(np.hypot(*(place - other)) >= size.head for other in (*centers, *stated)):
                centers.append(place)
    holes = (circle((float(x), float(y)), 0.5 * size.hole, "cut", hole=True) for x, y in centers)
    note = f"{bare} of the pads and walls are too small for the head of an {screw}: {NO_HOLES}"
    return (*contours, *holes), (note,) if bare else ()


def remove_screws(spec: Any) -> Any:
    """Return a specification without holes for screws: they are in what stands or moves as one, which is not solved."""
    part = spec.mechanism.part
    if part is None or part.screws is None:
        return spec
    plain = spec.mechanism.model_copy(update={"part": part.model_copy(update={"screws": None})})
    return spec.model_copy(update={"mechanism": plain})


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

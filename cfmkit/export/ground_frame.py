"""Frame around a part cut from one piece: a rectangle with bars to everything that is held; areas that bodies sweep.

The frame is a rectangle along the axes of the drawing, outside of all that the part covers at rest and as it moves,
by a clearance. A bar leads from every held pad to that side of the frame to which it is shortest without coming near
to what moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray

ROOT_SIDE = 2e-5  # bars that cover less of a beam at its root than a square of this side stand beside it [m]
BAR_OVERLAP_SHARE = 0.25  # part of the frame's thickness by which bars reach into it


@dataclass(frozen=True)
class GroundFrame:
    """Frame that joins all that is held."""

    sides: tuple[FloatArray, ...]  # bars of the frame, which overlap at its corners [m]
    bars: tuple[FloatArray, ...]  # from pads to the frame [m]

    @property
    def pieces(self) -> tuple[FloatArray, ...]:
        """All of it."""
        return (*self.sides, *self.bars)


def ground_frame(
    pads: Mapping[str, FloatArray],  # (4, 2) each: rectangles that stand, by name [m]
    moving: Any,  # all that anything else covers, at rest and over the travel [m]
    covered: Sequence[FloatArray],  # (n, 2) each: what else the frame goes around: eyes, pads that slide [m]
    thickness: float,  # of the frame, in the plane [m]
    clearance: float,  # between the frame, its bars and what moves [m]
    # corners of its opening [m]; default: as small as the clearance allows
    inside: tuple[tuple[float, float], tuple[float, float]] | None = None,
) -> GroundFrame:
    """Return the frame of a part.

    Raises GeometryError if nothing is held by a pad, if the frame is in the way of what moves, or a pad cannot be
    reached.
    """
    from shapely import Polygon, union_all

    if not pads:
        raise GeometryError("a frame joins held pads, but no node is clamped; leave out 'mechanism.part.frame.ground'")
    low, high = _opening(pads, moving, covered, clearance) if inside is None else np.sort(np.array(inside), axis=0)
    sides = _frame_sides(low, high, thickness)
    ring = union_all([Polygon(side) for side in sides])
    if (common := ring.intersection(moving)).area > ROOT_SIDE**2:
        raise GeometryError(
            f"the frame is in the way of the moving parts at {_place_in_words(common)}; make "
            f"'mechanism.part.frame.inside' larger"
        )
    bars = [_shortest_bar(name, pad, low, high, thickness, moving, clearance) for name, pad in pads.items()]
    return GroundFrame(sides, tuple(bars))


def _place_in_words(shape: Any) -> str:
    at = shape.representative_point()
    return f"({format_short(at.x, 'length')}, {format_short(at.y, 'length')})"


def _opening(
    pads: Mapping[str, FloatArray], moving: Any, covered: Sequence[FloatArray], clearance: float
) -> tuple[FloatArray, FloatArray]:
    """Return the lower left and the upper right corner of the opening: pads may touch the frame, nothing else."""
    x0, y0, x1, y1 = moving.bounds
    loose = np.concatenate([np.array([[x0, y0], [x1, y1]]), *covered])
    points = np.concatenate(list(pads.values()))
    low = np.minimum(loose.min(axis=0) - clearance, points.min(axis=0))
    return low, np.maximum(loose.max(axis=0) + clearance, points.max(axis=0))


def _frame_sides(low: FloatArray, high: FloatArray, thickness: float) -> tuple[FloatArray, ...]:
    (x0, y0), (x1, y1), t = low.tolist(), high.tolist(), thickness
    boxes = (
        (x0 - t, y0 - t, x1 + t, y0),
        (x0 - t, y1, x1 + t, y1 + t),
        (x0 - t, y0 - t, x0, y1 + t),
        (x1, y0 - t, x1 + t, y1 + t),
    )
    return tuple(np.array([[a, b], [c, b], [c, d], [a, d]]) for a, b, c, d in boxes)


def _shortest_bar(
    name: str, pad: FloatArray, low: FloatArray, high: FloatArray, thickness: float, moving: Any, clearance: float
) -> FloatArray:
    """Return the shortest bar from the middle of a pad to the frame that stays clear of what moves.

    It is as broad as the pad where the pad is narrowest, or half of that. Within a clearance of the pad it
    may be beside the beam that ends there, as the pad itself is.
    """
    from shapely import Polygon

    middle = pad.mean(axis=0)
    if (middle < low).any() or (middle > high).any():
        raise GeometryError(f"the pad of {name} is not within 'mechanism.part.frame.inside'")
    sizes = np.hypot(*(pad[1] - pad[0])), np.hypot(*(pad[2] - pad[1]))
    free, forbidden, tried = moving.buffer(clearance * (1 - 1e-6)), Polygon(pad).buffer(clearance), None
    ways = (
        (middle[1] - low[1], (0.0, -1.0)),
        (high[1] - middle[1], (0.0, 1.0)),
        (middle[0] - low[0], (-1.0, 0.0)),
        (high[0] - middle[0], (1.0, 0.0)),
    )
    for length, path in sorted(ways, key=lambda item: item[0]):
        for breadth in sorted({min(sizes), 0.5 * min(sizes)}, reverse=True):
            reach, half = length + BAR_OVERLAP_SHARE * thickness, 0.5 * breadth
            along, across = np.array(path), half * np.array([-path[1], path[0]])
            end = middle + reach * along
            bar = np.array([middle - across, end - across, end + across, middle + across])
            shape = Polygon(bar).difference(Polygon(pad))
            inside_way = shape.intersection(moving)
            beside = shape.difference(forbidden).intersection(free)
            if inside_way.area <= ROOT_SIDE**2 and beside.area <= ROOT_SIDE**2:
                return bar
            tried = tried or _place_in_words(inside_way if inside_way.area > beside.area else beside)
    raise GeometryError(
        f"no bar leads from the pad of {name} to the frame: moving parts are in the way (of the shortest bar, at "
        f"{tried}); leave out 'mechanism.part.frame.ground', or reduce 'mechanism.part.frame.clearance' "
        f"({format_short(clearance, 'length')})"
    )


def find_outside(
    places: Sequence[tuple[float, float]], frame: Sequence[FloatArray], pads: Sequence[FloatArray]
) -> list[bool]:
    """Return which places [m] lie outside a frame; places in a pad count as outside."""
    from shapely import Point, Polygon, union_all

    ground = union_all([Polygon(ring) for ring in frame]).difference(union_all([Polygon(ring) for ring in pads]))
    return [not ground.contains(Point(place)) for place in places]


def move_polygon(shape: FloatArray, by: FloatArray, turn: float = 0.0, about: FloatArray | None = None) -> FloatArray:
    """Return a polygon that is turned by an angle [rad] about a place and shifted [m]."""
    c, s = math.cos(turn), math.sin(turn)
    center = np.zeros(2) if about is None else about
    turned: FloatArray = center + (shape - center) @ np.array([[c, s], [-s, c]]) + by
    return turned

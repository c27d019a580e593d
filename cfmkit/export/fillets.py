"""Inside corners of exact contours, rounded by the cutter: tangent arcs in the place of corners.

A corner is where the direction turns towards the waste: a cutter of that radius cannot reach into it. Where edges
beside a corner are too short for the arc it stays sharp, and its place is reported.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import Arc, Contour, Line, Smooth, signed_area
from cfmkit.export.traced_edges import pair
from cfmkit.numerics.arc_chains import cubic, slope

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.export.contours import Edge

TANGENT_ANGLE = math.radians(0.5)
"""Where the direction turns by less than this the edges are tangent: nothing to round [rad]."""


def round_inside_corners(
    contour: Contour,  # its edges meet; material is within it, or around it where it is a hole
    radius: float,  # of the arcs [m]; 0 leaves all corners
) -> tuple[Contour, tuple[complex, ...]]:
    """Return a closed contour with rounded inside corners, and the places x + iy [m] of corners that no arc fits.

    Corners between lines, and between a line and a smooth edge, are rounded; others count as not fitting.
    """
    if radius <= 0 or len(contour.edges) < 2:
        return contour, ()
    side = 1.0 if (signed_area(contour.points(1e-5)) > 0) != contour.hole else -1.0
    edges = [edge for edge in contour.edges if not _has_no_length(edge)]
    # before any corner is rounded: an arc may use up a whole line, which has no direction then
    turns = [float(np.angle(_direction(edges[k], 0) / _direction(edges[k - 1], -1))) for k in range(len(edges))]
    sharp, arcs = [], {}
    for k, turn in enumerate(turns):
        before, after = edges[k - 1], edges[k]
        if turn * side > -TANGENT_ANGLE:
            continue
        if (corner := _round_corner(before, after, radius, side)) is None:
            sharp.append(after.ends[0])
        else:
            edges[k - 1], arcs[k], edges[k] = corner
    rounded = [piece for k, edge in enumerate(edges) for piece in ((arcs[k], edge) if k in arcs else (edge,))]
    return replace(contour, edges=tuple(edge for edge in rounded if not _has_no_length(edge))), tuple(sharp)


def _has_no_length(edge: Edge) -> bool:
    """Return True if an edge is a line without a length."""
    return isinstance(edge, Line) and abs(edge.ends[1] - edge.ends[0]) <= 1e-12


def _direction(edge: Edge, end: int) -> complex:
    """Return the unit tangent at the first (0) or last (-1) point of an edge."""
    if isinstance(edge, Smooth):
        return complex(*edge.tangents[end])
    if isinstance(edge, Line):
        along = edge.ends[1] - edge.ends[0]
        return along / abs(along)
    angle = edge.start if end == 0 else edge.end
    return complex(-math.sin(angle), math.cos(angle)) * (1 if edge.end > edge.start else -1)


def _round_corner(before: Edge, after: Edge, radius: float, side: float) -> tuple[Edge, Arc, Edge] | None:
    """Return two edges, shortened, and the arc between them; None if it does not fit."""
    if _has_no_length(before) or _has_no_length(after):
        return None
    if isinstance(before, Line) and isinstance(after, Line):
        return _round_between_lines(before, after, radius, side)
    if isinstance(before, Line) and isinstance(after, Smooth):
        return _round_onto_smooth(before, after, radius, side)
    if isinstance(before, Smooth) and isinstance(after, Line):
        # the mirror image of the same, run backwards: the waste is then on the other hand
        if (rounded := _round_onto_smooth(after.reverse(), before.reverse(), radius, -side)) is None:
            return None
        line, arc, smooth = rounded
        return smooth.reverse(), arc.reverse(), line.reverse()
    return None


def _round_between_lines(before: Line, after: Line, radius: float, side: float) -> tuple[Line, Arc, Line] | None:
    incoming, outgoing = _direction(before, -1), _direction(after, 0)
    corner = after.ends[0]
    trim = radius * math.tan(0.5 * abs(float(np.angle(outgoing / incoming))))
    shortest = min(abs(before.ends[1] - before.ends[0]), abs(after.ends[1] - after.ends[0]))
    if trim > shortest * (1 + 1e-9):  # a line as long as the trim is used up, whatever its rounding
        return None
    center = corner - trim * incoming - 1j * side * radius * incoming
    arc = _arc(center, radius, corner - trim * incoming, corner + trim * outgoing, side)
    first, last = arc.ends
    return Line(before.start, pair(first)), arc, Line(pair(last), after.end)


def _round_onto_smooth(line: Line, smooth: Smooth, radius: float, side: float) -> tuple[Line, Arc, Smooth] | None:
    """Return the arc from a line to the smooth edge that begins at its end."""
    heading, start = _direction(line, -1), line.ends[0]
    points, tangents = (np.asarray(values[:, 0] + 1j * values[:, 1]) for values in (smooth.points, smooth.tangents))
    centers = points - 1j * side * radius * tangents  # of arcs that touch the smooth edge
    over = ((centers - start) / heading).imag + side * radius  # how far these are from touching the line
    beyond = np.flatnonzero(over[:-1] * over[1:] <= 0)
    if not len(beyond):
        return None
    k = int(beyond[0])

    def touching(share: float) -> tuple[complex, complex, float]:
        """Return the centre of the arc that touches the edge so far behind a point, the tangent, how far it is over."""
        pair = (points[k], tangents[k], points[k + 1], tangents[k + 1], np.array([share]))
        along = complex(slope(*pair)[0])
        along /= abs(along)
        center = complex(cubic(*pair)[0]) - 1j * side * radius * along
        return center, along, ((center - start) / heading).imag + side * radius

    share = _find_zero(lambda share: touching(share)[2])
    center, tangent, _ = touching(share)
    touch = start + heading * ((center - start) / heading).real
    if ((touch - start) / heading).real < 0:
        return None
    arc = _arc(center, radius, touch, center + 1j * side * radius * tangent, side)
    first, last = arc.ends
    rest = slice(k + 1 if share < 0.999 else k + 2, None)
    kept = np.vstack([pair(last), smooth.points[rest]])
    if len(kept) < 2:
        return None
    return Line(line.start, pair(first)), arc, Smooth(kept, np.vstack([pair(tangent), smooth.tangents[rest]]))


def _find_zero(over: Callable[[float], float]) -> float:
    """Return where a function changes its sign between 0 and 1, by halving.

    A straight line between the points of the edge would leave a corner beside the arc, as high as the chord's sagitta.
    """
    low, high = 0.0, 1.0
    rises = over(high) > over(low)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (over(middle) > 0) == rises else (middle, high)
    return 0.5 * (low + high)


def _arc(center: complex, radius: float, first: complex, last: complex, side: float) -> Arc:
    """Return the arc that turns towards the waste: clockwise where the material is on the left."""
    start, turn = float(np.angle(first - center)), float(np.angle((last - center) / (first - center)))
    return Arc(pair(center), radius, start, start - side * abs(turn))


def sharp_notes(places: Sequence[complex], radius: float) -> tuple[str, ...]:
    """Return one line per corner that no fillet fits, with its place."""
    from cfmkit.export.arc_outlines import place
    from cfmkit.specs.units import format_short

    return tuple(
        f"no fillet of {format_short(radius, 'length')} fits the inside corner at {place(at)}: it stays sharp "
        "('mechanism.part.fillet')"
        for at in places
    )

"""One part from overlapping pieces: merged, inside corners rounded by the cutter, checked for being one piece.

The boundary is a chain of short lines; how far they may be from the true one is an argument.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

from cfmkit.errors import GeometryError
from cfmkit.export.contours import Contour, Line

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray

ROUGH = 1e-6
"""By default contours are no farther from the true ones [m]."""

ROUNDING = 1e-3
"""Gaps of this share of `rough` between pieces are rounding, and are closed."""

_QUARTER, _MOST_PIECES = 32, 10_000  # pieces of a quarter circle


def merged(
    pieces: Sequence[FloatArray],
    fillet: float = 0.0,
    holes: Sequence[FloatArray] = (),
    layer: str = "cut",
    rough: float = ROUGH,
) -> tuple[Contour, ...]:
    """Return the contours of the union of closed polygons, each (n, 2) [m].

    Parameters
    ----------
    pieces : sequence of (n, 2) array
        Corners of each, in order; they may overlap, and touch themselves.
    fillet : float
        Radius of inside corners [m]: that of the cutter. Gaps narrower than twice of it are filled.
    holes : sequence of (n, 2) array
        Polygons that are cut out in the end.
    layer : str
        Of the contours.
    rough : float
        How far the contours may be from those of the union, fillets included [m].

    Raises
    ------
    cfmkit.errors.GeometryError
        If nothing is left.
    """
    from shapely import Polygon, union_all

    # what overlaps by rounding only must still become one piece
    grown = union_all([Polygon(piece).buffer(ROUNDING * rough, join_style="mitre") for piece in pieces])
    whole = grown.buffer(-ROUNDING * rough, join_style="mitre")
    if fillet > 0:
        pieces_of = max(_QUARTER, quarter_pieces(fillet, rough / 4))
        whole = whole.buffer(fillet, quad_segs=pieces_of).buffer(-fillet, quad_segs=pieces_of)
    if holes:
        whole = whole.difference(union_all([Polygon(hole) for hole in holes]))
    whole = whole.simplify(rough / 2)
    parts = [part for part in getattr(whole, "geoms", [whole]) if part.area > rough**2]
    if not parts:
        raise GeometryError("the pieces of the part leave nothing to cut")
    return tuple(contour for part in parts for contour in _contours(part, layer, rough**2))


def quarter_pieces(radius: float, bulge: float) -> int:
    """Return into how many lines a quarter of a circle is cut, so that it bulges out of them by `bulge` [m] at most."""
    return min(_MOST_PIECES, math.ceil(0.25 * math.pi / math.acos(max(1.0 - bulge / radius, 0.0)))) if radius > 0 else 1


def _contours(part: Any, layer: str, speck: float) -> Iterator[Contour]:
    """Yield the outline of a polygon and its holes, without specks."""
    from shapely import Polygon

    for ring, hole in ((part.exterior, False), *((ring, True) for ring in part.interiors)):
        if Polygon(ring).area > speck:
            ends = [(float(x), float(y)) for x, y in ring.coords]
            edges = tuple(Line(a, b) for a, b in itertools.pairwise(ends) if a != b)
            yield Contour(edges, layer, closed=True, hole=hole)

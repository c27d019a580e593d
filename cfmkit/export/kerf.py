"""Compensation for the width of the cut: every cut contour moved into the waste by half the kerf.

Outer contours grow and holes shrink; corners that point into the waste become arcs
about the corner, so that the cut stays half a kerf away from the part everywhere. Arcs
stay arcs. Only where the moved contour has other pieces than the contour itself (a
fillet that is sharper than half the kerf) it becomes a fine polyline.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.arc_outlines import check_outlines, flat_points, place
from cfmkit.numerics.arc_chain import ArcChain
from cfmkit.numerics.parallel_curve import parallel
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.export.arc_outlines import Outline

_ARC_ERROR = 1e-6  # of the distance between contour and cut where arcs stay arcs [m]: that of the flattening
_POLYLINE_ERROR = 4e-6  # of the same where the cut becomes a polyline [m]
_GEOS_ERROR = 0.011  # shapely's buffer smooths inside corners by 1 % of its distance


def with_kerf(outlines: Sequence[Outline], kerf: float) -> tuple[Outline, ...]:
    """Return the outlines with closed contours on layer `cut` moved into the waste by half the kerf.

    Parameters
    ----------
    outlines : sequence of Outline
        A drawing as `cfmkit.export.arc_outlines.outlines` gives it.
    kerf : float
        Width of the cut [m].

    Raises
    ------
    cfmkit.errors.GeometryError
        If the kerf is not above zero, a contour vanishes or falls into pieces, or cuts meet.
    """
    if not (np.isfinite(kerf) and kerf > 0):
        raise GeometryError(f"the kerf must be a length above zero, not {format_short(kerf, 'length')}")
    moved = tuple(
        _moved(outline, kerf / 2, f"contour {number} on layer 'cut'")
        if outline.layer == "cut" and outline.closed
        else outline
        for number, outline in enumerate(outlines, start=1)
    )
    try:
        check_outlines(moved)
    except GeometryError as error:
        raise GeometryError(f"with a kerf of {format_short(kerf, 'length')}, {error}") from error
    return moved


def _moved(outline: Outline, half: float, name: str) -> Outline:
    region = _region(outline, half, name)
    right = half if (outline.chain.area > 0) != outline.hole else -half
    chain = parallel(outline.chain, right)
    if chain is None or not _follows(chain, outline, half, region, _ARC_ERROR):
        corners = np.asarray(region.exterior.coords) @ [1, 1j]
        chain = ArcChain(corners, np.zeros(len(corners) - 1))
        if not _follows(chain, outline, half, region, _POLYLINE_ERROR):
            raise GeometryError(
                f"{name} has inside corners too sharp for a kerf of {format_short(2 * half, 'length')}; round them"
            )
    circle = outline.circle and (outline.circle[0], outline.circle[1] + (-half if outline.hole else half))
    return replace(outline, chain=chain, circle=circle)


def _region(outline: Outline, half: float, name: str) -> Any:
    """Return the part (or the hole) with half a kerf around it (or less), in one piece without gaps."""
    from shapely import Polygon

    part = Polygon(flat_points(outline.chain))
    region = part.buffer(-half if outline.hole else half, quad_segs=64)
    kerf = format_short(2 * half, "length")
    if region.is_empty:
        raise GeometryError(f"{name}, a hole at {place(outline.chain.nodes[0])}, vanishes with a kerf of {kerf}")
    if region.geom_type != "Polygon" or region.interiors:
        kind = "hole" if outline.hole else "contour"
        raise GeometryError(f"{name}: the {kind} falls into pieces where it is narrower than the kerf of {kerf}")
    return region


def _follows(chain: ArcChain, outline: Outline, half: float, region: Any, error: float) -> bool:
    """Whether `chain` runs at distance `half` of the outline, all around it."""
    import shapely

    edge = flat_points(outline.chain)
    track = flat_points(chain)
    source = shapely.LinearRing(edge)
    shapely.prepare(source)
    points = shapely.points(track)
    near = shapely.dwithin(points, source, half - error).any()
    far = not shapely.dwithin(points, source, half + error).all()
    moved = shapely.Polygon(track)
    slack = region.length * (_GEOS_ERROR * half + error)
    return bool(not near and not far and moved.is_valid and abs(moved.area - region.area) < slack)

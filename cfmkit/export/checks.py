"""Is an outline fit to be cut? Crossings are found on a fine flattening, and named with their place."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.export.arcs import Outline
    from cfmkit.numerics.arcchain import ArcChain

SAGITTA = 2e-7  # distance of the flattening from the arcs [m]


def place(point: complex) -> str:
    """Return a point [m] as a reader wants it: ``(12.5, 0) mm``."""
    x, y = (round(float(to_border(value, "length")), 6) + 0.0 for value in (point.real, point.imag))
    return f"({x:g}, {y:g}) mm"


def flat_points(chain: ArcChain) -> Any:
    """Return points (n, 2) on the chain [m], no farther than `SAGITTA` from it in between."""
    points = chain.flattened(SAGITTA)
    return np.column_stack([points.real, points.imag])


def check_outlines(outlines: Sequence[Outline]) -> None:
    """Refuse outlines that cross themselves, and cuts that cross or touch each other or lie outside the part.

    Lines that are neither closed nor cut may cross themselves: nothing follows them.

    Raises
    ------
    cfmkit.errors.GeometryError
        With the place.
    """
    from shapely import LineString, Polygon

    cuts: list[tuple[str, Outline, Any]] = []
    for number, outline in enumerate(outlines, start=1):
        name = f"contour {number} on layer {outline.layer!r}"
        points = flat_points(outline.chain)
        shape = Polygon(points) if outline.closed else LineString(points)
        if outline.closed or outline.layer == "cut":
            _check_simple(shape, name)
        if outline.layer == "cut":
            cuts.append((name, outline, shape))
    _check_apart(cuts)
    _check_holes(cuts)


def _check_simple(shape: Any, name: str) -> None:
    import shapely

    if shape.is_valid and shape.is_simple:
        return
    if shape.geom_type == "Polygon":
        numbers = re.findall(r"-?[\d.]+(?:e[-+]?\d+)?", shapely.is_valid_reason(shape).partition("[")[2])
        where = complex(*map(float, numbers)) if len(numbers) == 2 else complex(*shape.exterior.coords[0])
    else:
        first = shapely.get_parts(shapely.node(shape))[0]
        where = complex(*first.coords[-1])
    raise GeometryError(f"{name} crosses or touches itself at {place(where)}")


def _check_apart(cuts: Sequence[tuple[str, Outline, Any]]) -> None:
    from shapely import STRtree

    lines = [shape.boundary if outline.closed else shape for _, outline, shape in cuts]
    pairs = STRtree(lines).query(lines, predicate="intersects").T if lines else ()
    for i, j in pairs:
        if i < j:
            touch = lines[i].intersection(lines[j]).representative_point()
            raise GeometryError(f"{cuts[i][0]} and {cuts[j][0]} cross or touch at {place(complex(touch.x, touch.y))}")


def _check_holes(cuts: Sequence[tuple[str, Outline, Any]]) -> None:
    solids = [shape for _, outline, shape in cuts if outline.closed and not outline.hole]
    holes = [(name, outline, shape) for name, outline, shape in cuts if outline.hole]
    for name, outline, hole in holes:
        if not any(solid.contains(hole) for solid in solids):
            raise GeometryError(f"{name} is a hole at {place(outline.chain.nodes[0])}, outside every cut contour")
    for (one, _, a), (other, outline, b) in itertools.combinations(holes, 2):
        if a.intersects(b):
            raise GeometryError(
                f"{one} and {other} are holes of which one lies in the other, at {place(outline.chain.nodes[0])}"
            )

"""Outlines of a drawing as chains of arcs, from which every writer starts: closed, and crossing nothing, or refused.

Lines and arcs stay what they are; smooth edges become tangent-continuous arcs within the tolerance of the exact curve.
What comes out is checked: edges meet, closed contours close, and nothing that is to be cut crosses itself or another
cut. Crossings are found on a fine flattening, and named with their place.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.contours import Arc, Contour, Drawing, Edge, Line
from cfmkit.numerics.arc_chains import ArcChain, CoarseDataError, fit_arcs
from cfmkit.specs.units import format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray


_MAX_ARC_ANGLE = 1e-3  # largest angle of the arcs to the exact curve [rad], as far as its points allow; see `outlines`
_POINT_RTOL = 5e-9  # two ends closer than this are one point, in sizes of the contour
_LINE_RISE = 1e-12  # an arc no higher than this over its chord is a line [m]


@dataclass(frozen=True)
class Outline:
    """One contour as a chain of arcs [m]; `circle` is (centre, radius) if it is one whole circle.

    `layer`, `closed` and `hole` are those of the contour.
    """

    chain: ArcChain
    layer: str
    closed: bool = False
    hole: bool = False
    circle: tuple[complex, float] | None = None


def outlines(
    drawing: Drawing,  # what to draw
    # largest distance of the arcs from the exact smooth curves [m]; default: that of the drawing
    tolerance: float | None = None,
) -> tuple[Outline, ...]:
    """Return the contours of a drawing as chains of arcs, checked.

    The arcs' direction is kept within a milliradian too, as far as the points allow: on a
    cam the force follows the slope, and arcs 5 um off the profile can lean by ten times that.

    Raises GeometryError if edges do not meet, a closed contour is open, a smooth edge is given by too few points, or a
    contour that is closed or to be cut crosses itself or another cut.
    """
    if not drawing.contours:
        raise GeometryError(f"the drawing {drawing.name!r} has no contours")
    tolerance = drawing.tolerance if tolerance is None else tolerance
    outlined = tuple(
        _make_outline(contour, number, tolerance) for number, contour in enumerate(drawing.contours, start=1)
    )
    check_outlines(outlined)
    return outlined


def _make_outline(contour: Contour, number: int, tolerance: float) -> Outline:
    name = f"contour {number} on layer {contour.layer!r}"
    if not contour.edges:
        raise GeometryError(f"{name} has no edges")
    x0, y0, x1, y1 = contour.extents
    if not np.isfinite(x0 + y0 + x1 + y1):
        raise GeometryError(f"{name} has a point that is not finite")
    gap = _POINT_RTOL * (x1 - x0 + y1 - y0)
    edges = [edge for edge in contour.edges if isinstance(edge, Arc) or not _is_point(edge, gap)]
    if not edges:
        raise GeometryError(f"{name} has no edges")
    _check_joints(edges, contour.closed, name, gap)
    chains = [_edge_chain(edge, tolerance, f"{name}, edge {index}") for index, edge in enumerate(edges, start=1)]
    nodes = np.concatenate([chains[0].nodes, *(chain.nodes[1:] for chain in chains[1:])])
    bulges = np.concatenate([chain.bulges for chain in chains])
    bulges[np.abs(bulges) * np.abs(np.diff(nodes)) < 2 * _LINE_RISE] = 0.0
    chain = ArcChain(nodes, bulges)
    whole = edges[0] if len(edges) == 1 and isinstance(edges[0], Arc) and edges[0].full else None
    circle = (complex(*whole.center), whole.radius) if whole and contour.closed else None
    return Outline(chain.close() if contour.closed else chain, contour.layer, contour.closed, contour.hole, circle)


def _is_point(edge: Edge, gap: float) -> bool:
    """Whether a line has no length: a dimension that is zero may leave one."""
    return isinstance(edge, Line) and abs(edge.ends[1] - edge.ends[0]) <= gap


def _check_joints(edges: list[Edge], closed: bool, name: str, gap: float) -> None:
    ends = [edge.ends for edge in edges]
    for index, (edge, following) in enumerate(itertools.pairwise(ends), start=1):
        if abs(edge[1] - following[0]) > gap:
            raise GeometryError(
                f"{name}: edge {index + 1} begins at {place(following[0])}, but edge {index} ends at {place(edge[1])}"
            )
    if closed and abs(ends[-1][1] - ends[0][0]) > gap:
        raise GeometryError(f"{name} is not closed: it begins at {place(ends[0][0])} and ends at {place(ends[-1][1])}")


def _edge_chain(edge: Edge, tolerance: float, name: str) -> ArcChain:
    if isinstance(edge, Line):
        return ArcChain(np.array(edge.ends), np.zeros(1))
    if isinstance(edge, Arc):
        return _arc_chain(edge, name)
    try:
        return fit_arcs(edge.points, edge.tangents, tolerance, _MAX_ARC_ANGLE)
    except CoarseDataError as error:
        where = complex(*edge.points[error.index])
        raise GeometryError(
            f"{name}, near {place(where)}: {error} (tolerance {format_short(tolerance, 'length')})"
        ) from error


def _arc_chain(edge: Arc, name: str) -> ArcChain:
    """Return the arc in equal pieces of at most half a turn."""
    turn = edge.end - edge.start
    if not edge.radius > 0 or turn == 0 or (abs(turn) > 2 * np.pi and not edge.full):
        raise GeometryError(f"{name}: an arc needs a radius above zero and a turn of at most 360 deg, other than zero")
    count = int(np.ceil(abs(turn) / np.pi - 1e-9))
    nodes = complex(*edge.center) + edge.radius * np.exp(1j * np.linspace(edge.start, edge.end, count + 1))
    return ArcChain(nodes, np.full(count, np.tan(turn / count / 4)))


SAGITTA_RTOL = 1e-6  # distance of the flattening from the arcs, in sizes of the chain


def place(point: complex) -> str:
    """Return a point [m] as a reader wants it: ``(12.5, 0) mm``."""
    x, y = (round(float(to_border(value, "length")), 6) + 0.0 for value in (point.real, point.imag))
    return f"({x:g}, {y:g}) mm"


def flat_sagitta(chain: ArcChain) -> float:
    """Return how far the lines between `flat_points` are from a chain at most [m]."""
    return SAGITTA_RTOL * float(np.ptp(chain.nodes.real) + np.ptp(chain.nodes.imag))


def flat_points(chain: ArcChain) -> Any:
    """Return points (n, 2) on the chain [m], no farther than `flat_sagitta` from it in between."""
    points = chain.flatten(flat_sagitta(chain))
    return np.column_stack([points.real, points.imag])


def check_outlines(outlines: Sequence[Outline]) -> None:
    """Refuse outlines that cross themselves, and cuts that cross or touch each other or lie outside the part.

    Lines that are neither closed nor cut may cross themselves: nothing follows them.

    Raises GeometryError with the place.
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
    _check_cuts_apart(cuts)
    _check_holes(cuts)


def check_simple(points: FloatArray, name: str) -> None:
    """Refuse a closed outline (n, 2) [m] that crosses or touches itself.

    Raises GeometryError with the place.
    """
    from shapely import Polygon

    _check_simple(Polygon(points), name)


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


def _check_cuts_apart(cuts: Sequence[tuple[str, Outline, Any]]) -> None:
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
    for (first, _, a), (second, outline, b) in itertools.combinations(holes, 2):
        if a.intersects(b):
            raise GeometryError(f"the holes {first} and {second} touch or overlap, at {place(outline.chain.nodes[0])}")

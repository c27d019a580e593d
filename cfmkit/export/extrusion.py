"""Drawings as bodies: outlines extruded by the thickness of the sheet, closed surfaces of triangles.

A body of one thickness is a prism. Where regions are thinner or thicker, it has steps, symmetric about its middle
plane: flexures of another width than their links. Every body stands on z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import FloatArray, read_only
from cfmkit.errors import GeometryError
from cfmkit.export.arc_outlines import outlines
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.export.arc_outlines import Outline
    from cfmkit.export.contours import Drawing, Sheet

MIN_FACE_AREA = 1e-12
"""Faces smaller than this are rounding, where the edge of a region runs along the edge of the part, in squares of its
size."""
POINT_RTOL = 1e-9  # points of outlines and regions that are nearer to each other are one, in sizes of the part


@dataclass(frozen=True)
class Body:
    """A closed surface of triangles."""

    points: FloatArray  # (n, 3) [m]
    triangles: NDArray[np.int64]  # (m, 3) counter-clockwise seen from outside

    @property
    def corners(self) -> FloatArray:
        """Corners of the triangles, (m, 3, 3) [mm]."""
        return np.asarray(to_border(self.points, "length"))[self.triangles]


@dataclass(frozen=True)
class LayeredPolygon:
    """One part seen from above: a polygon of shapely, cut into faces of one thickness each [m]."""

    faces: tuple[tuple[Any, float], ...]


def plates(
    drawn: Sequence[Outline],  # of the drawing
    sheet: Sheet,  # how thick it is
    tolerance: float,  # largest distance of the polygons from the arcs of the outlines [m]
) -> tuple[LayeredPolygon, ...]:
    """Return what a drawing cuts, with the thickness of every face.

    Raises GeometryError if nothing says how thick the parts are, or nothing is to be cut.
    """
    from shapely import Polygon

    if sheet.thickness is None:
        where = f"give {sheet.key!r}, such as 5 mm" if sheet.key else "its family has no such key"
        raise GeometryError(f"nothing says how thick the part is: {where}")
    cut = [one for one in drawn if one.layer == "cut" and one.closed]
    chains = [(one, one.chain.flatten(tolerance)) for one in cut]
    rings = [(one, Polygon(np.column_stack([points.real, points.imag]))) for one, points in chains]
    solids = [ring for one, ring in rings if not one.hole]
    if not solids:
        raise GeometryError("there is nothing to cut, and so no body")
    found = []
    for solid in solids:
        holes = [ring.exterior for one, ring in rings if one.hole and solid.contains(ring)]
        found.append(_faces(Polygon(solid.exterior, holes), sheet))
    return tuple(found)


def volume(drawing: Drawing) -> float:
    """Return the volume of everything that is cut [m^3].

    Raises GeometryError as `plates`.
    """
    result = plates(outlines(drawing, drawing.tolerance), drawing.sheet, drawing.tolerance)
    return float(sum(face.area * thickness for plate in result for face, thickness in plate.faces))


def _faces(part: Any, sheet: Sheet) -> LayeredPolygon:
    """Return a part cut along the edges of the regions that lie in it."""
    from shapely import Polygon, prepare, set_precision, union_all
    from shapely.ops import polygonize

    usual = float(sheet.thickness or 0.0)
    x0, y0, x1, y1 = part.bounds
    size = x1 - x0 + y1 - y0
    part = set_precision(part, POINT_RTOL * size)
    other = [one for one in sheet.regions if one.thickness != usual]
    areas = [(set_precision(Polygon(one.polygon), POINT_RTOL * size), one.thickness) for one in other]
    areas = [(area, thickness) for area, thickness in areas if area.intersection(part).area > MIN_FACE_AREA * size**2]
    if not areas:
        return LayeredPolygon(((part, usual),))
    lines = union_all(
        [part.boundary, *(area.boundary.intersection(part) for area, _ in areas)], grid_size=POINT_RTOL * size
    )
    prepare(part)
    faces = []
    for face in polygonize(lines):
        inside = face.representative_point()
        if part.contains(inside):
            faces.append((face, max((t for area, t in areas if area.contains(inside)), default=usual)))
    return LayeredPolygon(tuple(faces))


def bodies(found: Sequence[LayeredPolygon]) -> tuple[Body, ...]:
    """Return parts as closed surfaces.

    Raises GeometryError if a surface is not closed.
    """
    return tuple(_body(plate) for plate in found)


def _body(plate: LayeredPolygon) -> Body:
    flat, corners, halves = _triangles(plate)
    levels = sorted({level for half in set(halves.tolist()) for level in (-half, half)})
    shell = _Shell(flat, np.array(levels))
    for triangle, half in zip(corners.tolist(), halves.tolist(), strict=True):
        shell.add_lid(triangle, half)
    for start, end, below, above in _steps(corners, halves):
        shell.add_wall(start, end, below, above)
    return shell.build_body()


def _triangles(plate: LayeredPolygon) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """Return points (n, 2) [m], triangles (m, 3) counter-clockwise and half the thickness of each (m,) [m]."""
    from shapely import constrained_delaunay_triangles, get_coordinates

    places, halves = [], []
    for face, thickness in plate.faces:
        found = constrained_delaunay_triangles(face).geoms
        places.append(get_coordinates(list(found)).reshape(-1, 4, 2)[:, :3])
        halves.append(np.full(len(found), 0.5 * thickness))
    points, which = np.unique(np.concatenate(places).reshape(-1, 2), axis=0, return_inverse=True)
    corners = which.reshape(-1, 3)
    a, b, c = points[corners].swapaxes(0, 1)
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    corners[clockwise] = corners[clockwise][:, ::-1]
    return points, corners, np.concatenate(halves)


def _steps(corners: NDArray[np.int64], halves: FloatArray) -> Iterator[tuple[int, int, float, float]]:
    """Yield the edges at which the body steps down to their right: start, end, height there and to the left [m]."""
    height: dict[tuple[int, int], float] = {}
    for (a, b, c), half in zip(corners.tolist(), halves.tolist(), strict=True):
        for edge in ((a, b), (b, c), (c, a)):
            if edge in height:
                raise GeometryError("the outline overlaps itself: its body has no closed surface")
            height[edge] = half
    for (a, b), half in height.items():
        beyond = height.get((b, a), 0.0)
        if beyond < half:
            yield a, b, beyond, half


class _Shell:
    """Collects the triangles of a body; points are those of the plane at every level, those that are used."""

    def __init__(self, flat: FloatArray, levels: FloatArray) -> None:
        self._flat, self._levels = flat, levels
        self._level = {float(level): k for k, level in enumerate(levels)}
        self._triangles: list[tuple[int, int, int]] = []

    def _index_vertex(self, point: int, level: int) -> int:
        return point * len(self._levels) + level

    def add_lid(self, triangle: list[int], half: float) -> None:
        """Add a triangle of the upper and of the lower side."""
        a, b, c = triangle
        top, bottom = self._level[half], self._level[-half]
        self._triangles.append((self._index_vertex(a, top), self._index_vertex(b, top), self._index_vertex(c, top)))
        self._triangles.append(
            (self._index_vertex(a, bottom), self._index_vertex(c, bottom), self._index_vertex(b, bottom))
        )

    def add_wall(self, start: int, end: int, below: float, above: float) -> None:
        """Add what stands on an edge: one wall around the part, two where it steps."""
        spans = ((-above, -below), (below, above)) if below else ((-above, above),)
        for low, high in spans:
            for k in range(self._level[low], self._level[high]):
                a, b = self._index_vertex(start, k), self._index_vertex(end, k)
                self._triangles += [(a, b, b + 1), (a, b + 1, a + 1)]

    def build_body(self) -> Body:
        """Return the body, on z = 0; GeometryError where an edge has no second triangle."""
        triangles = np.array(self._triangles)
        edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        size = len(self._flat) * len(self._levels)
        keys, back = np.sort(edges @ [size, 1]), np.sort(edges @ [1, size])
        if len(np.unique(keys)) != len(keys) or not np.array_equal(keys, back):
            raise GeometryError("the outline has no closed body: it touches itself")
        used, which = np.unique(triangles, return_inverse=True)
        flat, height = self._flat[used // len(self._levels)], self._levels[used % len(self._levels)]
        points = np.column_stack([flat, height - self._levels[0]])
        return Body(read_only(points), which.reshape(-1, 3))

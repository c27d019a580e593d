"""Drawings as bodies of triangles or solids, and their files: STL, 3MF with each body apart [3MF core 1.3], STEP.

Outlines are extruded by the thickness of the sheet to closed surfaces of triangles. A body of one thickness is a prism.
Where regions are thinner or thicker, it has steps, symmetric about its middle plane: flexures of another width than
their links. Every body stands on z = 0. Both files are in millimetres; an STL is in the binary form that every slicer
reads, a 3MF is a ZIP of three short XML files. A STEP is made by build123d (the extra ``step``): sides are planes and
cylinders, lines and arcs of the outlines stay what they are, so that a CAD program can measure the radius of a fillet.

Reference
---------
[3MF core 1.3] 3MF Consortium, 3D Manufacturing Format, Core Specification 1.3.
"""

from __future__ import annotations

import io
import re
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import FloatArray, read_only
from cfmkit.errors import CfmError, GeometryError, OutputError, UsageError
from cfmkit.export.arc_outlines import outlines
from cfmkit.export.contours import check_name
from cfmkit.numerics.arc_chains import points_on
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

    from numpy.typing import NDArray

    from cfmkit.export.arc_outlines import Outline
    from cfmkit.export.contours import Drawing, Region, Sheet


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
    cut = [contour for contour in drawn if contour.layer == "cut" and contour.closed]
    chains = [(contour, contour.chain.flatten(tolerance)) for contour in cut]
    rings = [(contour, Polygon(np.column_stack([points.real, points.imag]))) for contour, points in chains]
    solids = [ring for contour, ring in rings if not contour.hole]
    if not solids:
        raise GeometryError("there is nothing to cut, and so no body")
    layered = []
    for solid in solids:
        holes = [ring.exterior for contour, ring in rings if contour.hole and solid.contains(ring)]
        layered.append(_cut_into_faces(Polygon(solid.exterior, holes), sheet))
    return tuple(layered)


def volume(drawing: Drawing) -> float:
    """Return the volume of everything that is cut [m^3].

    Raises GeometryError as `plates`.
    """
    result = plates(outlines(drawing, drawing.tolerance), drawing.sheet, drawing.tolerance)
    return float(sum(face.area * thickness for plate in result for face, thickness in plate.faces))


def _cut_into_faces(part: Any, sheet: Sheet) -> LayeredPolygon:
    """Return a part cut along the edges of the regions that lie in it."""
    from shapely import Polygon, prepare, set_precision, union_all
    from shapely.ops import polygonize

    usual = float(sheet.thickness or 0.0)
    x0, y0, x1, y1 = part.bounds
    size = x1 - x0 + y1 - y0
    part = set_precision(part, POINT_RTOL * size)
    regions = [region for region in sheet.regions if region.thickness != usual]
    areas = [(set_precision(Polygon(region.polygon), POINT_RTOL * size), region.thickness) for region in regions]
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


def bodies(layered: Sequence[LayeredPolygon]) -> tuple[Body, ...]:
    """Return parts as closed surfaces.

    Raises GeometryError if a surface is not closed.
    """
    return tuple(_make_body(plate) for plate in layered)


def _make_body(plate: LayeredPolygon) -> Body:
    flat, corners, halves = _triangles(plate)
    levels = sorted({level for half in set(halves.tolist()) for level in (-half, half)})
    shell = _Shell(flat, np.array(levels))
    for triangle, half in zip(corners.tolist(), halves.tolist(), strict=True):
        shell.add_lid(triangle, half)
    for start, end, below, above in _step_edges(corners, halves):
        shell.add_wall(start, end, below, above)
    return shell.build_body()


def _triangles(plate: LayeredPolygon) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """Return points (n, 2) [m], triangles (m, 3) counter-clockwise and half the thickness of each (m,) [m]."""
    from shapely import constrained_delaunay_triangles, get_coordinates

    places, halves = [], []
    for face, thickness in plate.faces:
        triangles = constrained_delaunay_triangles(face).geoms
        places.append(get_coordinates(list(triangles)).reshape(-1, 4, 2)[:, :3])
        halves.append(np.full(len(triangles), 0.5 * thickness))
    points, which = np.unique(np.concatenate(places).reshape(-1, 2), axis=0, return_inverse=True)
    corners = which.reshape(-1, 3)
    a, b, c = points[corners].swapaxes(0, 1)
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    corners[clockwise] = corners[clockwise][:, ::-1]
    return points, corners, np.concatenate(halves)


def _step_edges(corners: NDArray[np.int64], halves: FloatArray) -> Iterator[tuple[int, int, float, float]]:
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


_HEADER_BYTES = 80
_TRIANGLE_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl_bytes(name: str, bodies: Sequence[Body]) -> bytes:
    """Return bodies as one STL file; single precision, as the format has it: 7 digits of a millimetre."""
    corners = np.concatenate([body.corners for body in bodies]).astype("<f4")
    records = np.zeros(len(corners), _TRIANGLE_RECORD)
    records["corners"] = corners
    a, b, c = corners.astype(float).swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    records["normal"] = across / np.where(length > 0, length, 1.0)
    # a head that begins with "solid" would be taken for the text form
    head = f"cfmkit {name}, in mm".encode()[:_HEADER_BYTES].ljust(_HEADER_BYTES)
    return head + len(records).to_bytes(4, "little") + records.tobytes()


_XML_HEADER = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CORE_NAMESPACE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE_NAMESPACE = "http://schemas.openxmlformats.org/package/2006"
_CONTENT_TYPES = (
    f'{_XML_HEADER}<Types xmlns="{_PACKAGE_NAMESPACE}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
_PACKAGE_RELATIONS = (
    f'{_XML_HEADER}<Relationships xmlns="{_PACKAGE_NAMESPACE}/relationships"><Relationship '
    f'Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)
_FILE_DATE = (1980, 1, 1, 0, 0, 0)  # of every file in the archive: the same part gives the same bytes


def threemf_bytes(name: str, bodies: Sequence[Body]) -> bytes:
    """Return bodies as a 3MF file."""
    check_name(name, "drawing")
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for path, text in (
            ("[Content_Types].xml", _CONTENT_TYPES),
            ("_rels/.rels", _PACKAGE_RELATIONS),
            ("3D/3dmodel.model", _model_xml(name, bodies)),
        ):
            entry = zipfile.ZipInfo(path, _FILE_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return file.getvalue()


def _model_xml(name: str, bodies: Sequence[Body]) -> str:
    lines = [f'{_XML_HEADER}<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE_NAMESPACE}">', "<resources>"]
    for number, body in enumerate(bodies, start=1):
        lines += [f'<object id="{number}" type="model" name="{name}-{number}"><mesh>', *_mesh(body), "</mesh></object>"]
    items = "".join(f'<item objectid="{number}"/>' for number in range(1, len(bodies) + 1))
    return "\n".join([*lines, "</resources>", f"<build>{items}</build></model>", ""])


def _mesh(body: Body) -> Iterator[str]:
    yield "<vertices>"
    for x, y, z in to_border(body.points, "length").tolist():
        yield f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>'
    yield "</vertices><triangles>"
    for a, b, c in body.triangles.tolist():
        yield f'<triangle v1="{a}" v2="{b}" v3="{c}"/>'
    yield "</triangles>"


LINE_RISE = 1e-6  # arcs that rise less over their chord are lines: less than a CAD kernel can tell [mm]


def step_bytes(name: str, drawn: Sequence[Outline], sheet: Sheet) -> bytes:
    """Return what a drawing cuts as one STEP file (AP214), in millimetres.

    Raises UsageError if build123d is not installed; GeometryError if nothing says how thick the parts are, or the
    kernel cannot make a body of them.
    """
    kernel = _import_build123d()
    if sheet.thickness is None:
        where = f"give {sheet.key!r}, such as 5 mm" if sheet.key else "its family has no such key"
        raise GeometryError(f"nothing says how thick the part is: {where}")
    try:
        return _step_file(
            kernel, name, [contour for contour in drawn if contour.layer == "cut" and contour.closed], sheet
        )
    except CfmError:
        raise
    except Exception as error:  # the kernel has dozens of its own
        reported = " ".join(f"{type(error).__name__}: {error}".split())
        raise GeometryError(f"the CAD kernel cannot make a body from the outline ({reported})") from error


def _step_file(kernel: Any, name: str, cut: Sequence[Outline], sheet: Sheet) -> bytes:
    wires = [(contour, kernel.Wire(_edges(kernel, contour))) for contour in cut]
    faces = [kernel.Face(wire) for contour, wire in wires if not contour.hole]
    holes = [kernel.Face(wire) for contour, wire in wires if contour.hole]
    solids = [_solid_of_face(kernel, face, holes, sheet) for face in faces]
    if not solids or not all(solid.is_valid for solid in solids):
        raise GeometryError("the CAD kernel cannot make a valid body from the outline")
    whole = solids[0] if len(solids) == 1 else kernel.Compound(children=solids)
    whole.label = name
    return _write_step(kernel, whole)


def _import_build123d() -> ModuleType:
    try:
        import build123d
    except ImportError:
        raise UsageError("--format step needs build123d: pip install build123d") from None
    module: ModuleType = build123d
    return module


def _edges(kernel: Any, outline: Outline) -> list[Any]:
    """Return the edges of an outline; a whole circle is one."""
    if outline.circle:
        center, radius = (to_border(value, "length") for value in outline.circle)
        return [kernel.Edge.make_circle(float(radius), kernel.Plane((center.real, center.imag, 0.0)))]
    chain = outline.chain
    nodes = to_border(chain.nodes, "length")
    middles = to_border(
        points_on(chain.nodes[:-1], chain.chords, chain.turns, np.full(len(chain.bulges), 0.5)), "length"
    )
    rise = np.abs(chain.bulges * to_border(chain.chords, "length")) / 2
    shapes = []
    for k in range(len(middles)):
        a, m, b = ((float(z.real), float(z.imag)) for z in (nodes[k], middles[k], nodes[k + 1]))
        straight = rise[k] < LINE_RISE
        shapes.append(kernel.Edge.make_line(a, b) if straight else kernel.Edge.make_three_point_arc(a, m, b))
    return shapes


def _solid_of_face(kernel: Any, face: Any, holes: Sequence[Any], sheet: Sheet) -> Any:
    """Return the body on z = 0 of one outline with its holes."""
    usual, regions = (
        float(sheet.thickness or 0.0),
        [region for region in sheet.regions if region.thickness != sheet.thickness],
    )
    whole = _prism(kernel, face, usual)
    around = whole.bounding_box()
    for hole in holes:
        box = hole.bounding_box()
        if (
            around.min.X < box.min.X
            and box.max.X < around.max.X
            and around.min.Y < box.min.Y
            and box.max.Y < around.max.Y
        ):
            face = face - hole
    whole = body = _prism(kernel, face, usual)
    thickest = usual
    for region in sorted(regions, key=lambda region: region.thickness):
        stencil = _prism(kernel, _region_face(kernel, region), 2 * max(usual, region.thickness))
        if not (whole & stencil):
            continue
        thickest = max(thickest, region.thickness)
        body = (body - stencil) + (_prism(kernel, face, region.thickness) & stencil)
    height = float(body.bounding_box().size.Z) * 1e-3
    lift = 0.5 * to_border(min(thickest, height), "length")
    return body.moved(kernel.Location((0.0, 0.0, float(lift))))


def _prism(kernel: Any, face: Any, thickness: float) -> Any:
    """Return a face extruded to both sides of the plane, by a thickness [m] in all."""
    height = float(to_border(thickness, "length"))
    return kernel.Solid.extrude(face, kernel.Vector(0, 0, height)).moved(kernel.Location((0.0, 0.0, -0.5 * height)))


def _region_face(kernel: Any, region: Region) -> Any:
    points = to_border(np.asarray(region.polygon), "length")
    ends = points[:-1] if np.array_equal(points[0], points[-1]) else points
    return kernel.Face(kernel.Wire.make_polygon([tuple(map(float, point)) for point in ends]))


def _write_step(kernel: Any, whole: Any) -> bytes:
    """Return a STEP file whose head names no date and no folder: the same part gives the same bytes."""
    try:
        with tempfile.TemporaryDirectory(prefix="cfmkit-") as folder:
            path = Path(folder) / "part.step"
            kernel.export_step(whole, str(path))
            text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise OutputError(f"STEP needs a temporary folder for a moment: {error}; set TMPDIR to one") from error
    text = re.sub(r"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\(')\d+'", r"\g<1>1'", text)  # counts what the process has written
    return re.sub(
        r"FILE_NAME\(.*?\);", "FILE_NAME('','',(''),(''),'cfmkit','','');", text, count=1, flags=re.S
    ).encode()

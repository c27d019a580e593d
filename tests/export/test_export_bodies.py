"""Drawings as bodies: closed surfaces with the volume of the drawing, and files that say so."""

import io
import json
import sys
import zipfile
from importlib import import_module
from xml.etree import ElementTree

import numpy as np
import pytest

import cfmkit
from cfmkit.errors import GeometryError, UsageError
from cfmkit.export import files
from cfmkit.export.arc_outlines import outlines
from cfmkit.export.bodies_stl_3mf_step import bodies, plates
from cfmkit.export.contours import Drawing, Region, Sheet, circle, polygon

SQUARE = polygon([(0, 0), (0.04, 0), (0.04, 0.02), (0, 0.02)], "cut")
HOLE = circle((0.03, 0.01), 0.004, "cut", hole=True)
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def made(drawing):
    return bodies(plates(outlines(drawing), drawing.sheet, 1e-6))


def read_stl(data):
    """Return normals and corners of a binary STL file."""
    records = np.frombuffer(data[84:], RECORD)
    assert len(records) == int(np.frombuffer(data[80:84], "<u4")[0])
    return records["normal"].astype(float), records["corners"].astype(float)


def volume(corners):
    a, b, c = corners.swapaxes(0, 1)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def inside(body):
    """Return the volume of a body [m3]."""
    return volume(body.points[body.triangles])


def test_a_plate_with_a_hole_has_its_volume_and_stands_on_the_ground():
    (body,) = made(Drawing("plate", (SQUARE, HOLE), sheet=Sheet(0.005)))
    assert inside(body) == pytest.approx((0.04 * 0.02 - np.pi * 0.004**2) * 0.005, rel=1e-4)
    assert (body.points[:, 2].min(), body.points[:, 2].max()) == (0.0, 0.005)


@pytest.mark.parametrize("thickness", [0.002, 0.008])
def test_a_region_of_another_thickness_makes_steps_symmetric_about_the_middle(thickness):
    region = Region(np.array([[0.01, -0.01], [0.02, -0.01], [0.02, 0.03], [0.01, 0.03]]), thickness)
    (body,) = made(Drawing("plate", (SQUARE,), sheet=Sheet(0.005, (region,))))
    assert inside(body) == pytest.approx(0.03 * 0.02 * 0.005 + 0.01 * 0.02 * thickness, rel=1e-9)
    heights = np.unique(np.round(body.points[:, 2], 9))
    assert heights == pytest.approx(heights[-1] - heights[::-1])


def test_of_regions_that_overlap_the_thicker_one_holds():
    regions = tuple(
        Region(np.array([[x, -0.01], [x + 0.02, -0.01], [x + 0.02, 0.03], [x, 0.03]]), t)
        for x, t in ((0.0, 0.002), (0.01, 0.003))
    )
    (body,) = made(Drawing("plate", (SQUARE,), sheet=Sheet(0.001, regions)))
    assert inside(body) == pytest.approx(0.02 * (0.01 * 0.002 + 0.02 * 0.003 + 0.01 * 0.001), rel=1e-9)


def test_two_parts_are_two_bodies_and_each_has_its_own_holes():
    other = polygon([(0.1, 0), (0.12, 0), (0.12, 0.02), (0.1, 0.02)], "cut")
    found = made(Drawing("plates", (SQUARE, HOLE, other), sheet=Sheet(0.005)))
    assert [round(inside(body) * 1e9) for body in found] == [round((800 - np.pi * 16) * 5), 2000]


def test_without_a_thickness_one_line_says_what_to_give():
    with pytest.raises(GeometryError, match=r"nothing says how thick the part is: give 'a\.b', such as 5 mm"):
        made(Drawing("plate", (SQUARE,), sheet=Sheet(key="a.b")))


@pytest.mark.parametrize("name", ["beam_lan2010", "vcfm_cosine", "slider_crank_lumped", "vcfm_hybrid"])
def test_stl_of_a_published_mechanism_is_closed_and_has_the_volume_of_its_outline(name):
    spec = cfmkit.load(f"configs/{name}.yaml")
    (data,) = cfmkit.export(spec, format="stl").values()
    normals, corners = read_stl(data)
    drawing = cfmkit.api.drawing(spec)
    for share, rel in ((1.0, 1e-5), (0.01, 2e-4)):  # of the tolerance of the file: the same lines, nearly exact ones
        expected = sum(
            face.area * thickness
            for plate in plates(outlines(drawing), drawing.sheet, share * drawing.tolerance)
            for face, thickness in plate.faces
        )
        assert volume(corners) == pytest.approx(1e9 * expected, rel=rel)
    a, b, c = corners.swapaxes(0, 1)
    assert np.einsum("ij,ij->i", normals, np.cross(b - a, c - a)).min() >= 0
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    edges = index.reshape(-1, 3)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there, back = (np.sort(edges @ weights) for weights in ([len(points), 1], [1, len(points)]))
    assert np.array_equal(there, back)


def test_3mf_has_the_triangles_of_the_bodies_in_millimetres():
    drawing = Drawing("plate", (SQUARE, HOLE), sheet=Sheet(0.005))
    (body,) = made(drawing)
    data = files(drawing, tolerance=1e-6, formats=("3mf",))["plate.3mf"]
    assert data == files(drawing, tolerance=1e-6, formats=("3mf",))["plate.3mf"]
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.namelist()[0] == "[Content_Types].xml"
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    space = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    assert model.get("unit") == "millimeter"
    points = np.array([[float(one.get(axis)) for axis in "xyz"] for one in model.iter(f"{space}vertex")])
    corners = np.array([[int(one.get(f"v{k}")) for k in (1, 2, 3)] for one in model.iter(f"{space}triangle")])
    assert volume(points[corners]) == pytest.approx(1e9 * inside(body), rel=1e-8)


def test_step_has_cylinders_where_the_outline_has_arcs(tmp_path):
    build123d = pytest.importorskip("build123d", reason="needs the extra 'step'")
    drawing = Drawing("plate", (SQUARE, HOLE), sheet=Sheet(0.005))
    data = files(drawing, formats=("step",))["plate.step"]
    assert data == files(drawing, formats=("step",))["plate.step"]
    path = tmp_path / "plate.step"
    path.write_bytes(data)
    solid = build123d.import_step(str(path))
    assert solid.volume == pytest.approx((800 - np.pi * 16) * 5, rel=1e-9)
    assert [str(face.geom_type) for face in solid.faces()].count("GeomType.CYLINDER") == 1


def test_without_its_library_step_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "build123d", None)
    with pytest.raises(UsageError, match=r"--format step needs build123d: pip install build123d"):
        cfmkit.export("configs/vcfm_pla.yaml", format="step")


def test_a_format_that_fails_does_not_stop_the_others(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "build123d", None)
    with pytest.warns(UserWarning, match=r"step is not made: --format step needs build123d"):
        found = cfmkit.export("configs/vcfm_pla.yaml", tmp_path, format="step,dxf,stl")
    assert sorted(found) == ["vcfm.dxf", "vcfm.stl"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["manifest.json", "vcfm.dxf", "vcfm.stl"]
    assert json.loads((tmp_path / "manifest.json").read_bytes())["exit_code"] == 6


def test_an_exception_of_the_cad_kernel_is_one_line(monkeypatch):
    class Kernel:
        class Wire:
            def __init__(self, _edges):
                raise RuntimeError("StdFail_NotDone:\nBRep_API")

        def __getattr__(self, _name):
            return lambda *_: self

        make_circle = make_line = make_three_point_arc = Plane = lambda *_: None
        Edge = Vector = Location = None

    Kernel.Edge = Kernel
    monkeypatch.setattr(import_module("cfmkit.export.bodies_stl_3mf_step"), "_import_build123d", Kernel)
    with pytest.raises(
        GeometryError, match=r"cannot make a body from the outline \(RuntimeError: StdFail_NotDone: BRep"
    ):
        cfmkit.export("configs/vcfm_pla.yaml", format="step")


def test_an_unknown_format_is_one_line():
    with pytest.raises(UsageError, match=r"--format: 'stp' is not known; there are dxf, svg, csv, stl, 3mf, step, inp"):
        cfmkit.export("configs/vcfm_pla.yaml", format="stp")

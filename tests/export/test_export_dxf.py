"""The DXF, read back by another program's eyes, is the drawing: true size, closed, exact, the same bytes each time."""

import io
import itertools
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from drawing_files import write_dxf
from scipy.spatial import cKDTree

from cfmkit.errors import GeometryError
from cfmkit.export import files
from cfmkit.export.contours import Arc, Contour, Curve2D, Drawing, Line, Smooth, circle, polygon, reference_square

BRACE, REST, CONSTANT, ROLLER = 0.2, 0.068, 0.015, 0.012


def flank(x, roller):
    """Points and unit tangents [m] of the parallel of y = D^2 / 2A - sqrt(L^2 - x^2), right half."""
    slope = (x - REST) / CONSTANT + x / np.sqrt(BRACE**2 - x**2)
    y = (x - REST) ** 2 / (2 * CONSTANT) - np.sqrt(BRACE**2 - x**2) + np.sqrt(BRACE**2 - REST**2)
    length = np.hypot(1, slope)
    points = np.column_stack([x - roller * slope / length, y + roller / length])
    return points, np.column_stack([1 / length, slope / length])


def plate():
    """A plate with two curved flanks, a straight top and bottom, and two holes; both roller paths beside it."""
    x = REST + 0.08 * np.linspace(0, 1, 1500) ** 2
    right, path = Smooth(*flank(x, ROLLER)), Smooth(*flank(x, 0))
    left = right.mirror().reverse()
    (a, b), (c, d) = right.ends, left.ends
    top, bottom = Line((b.real, b.imag), (c.real, c.imag)), Line((d.real, d.imag), (a.real, a.imag))
    contours = (
        Contour((right, top, left, bottom), "cut", closed=True),
        circle((-0.04, 0.1), 0.003, "cut", hole=True),
        circle((0.04, 0.1), 0.003, "cut", hole=True),
        Contour((path,), "path"),
        Contour((path.mirror(),), "path"),
    )
    columns = {"x": (right.points[:, 0], "length"), "y": (right.points[:, 1], "length")}
    return Drawing("plate", contours, (Curve2D("flank", columns),))


@pytest.fixture(scope="module")
def readback():
    return read(files(plate())["plate.dxf"])


def read(data):
    import ezdxf

    document = ezdxf.read(io.StringIO(data.decode("utf-8")))
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes
    return document


def on_layer(document, layer):
    return [entity for entity in document.modelspace() if entity.dxf.layer == layer]


def traced(entity):
    """Points [mm] along a polyline, by ezdxf's own arcs: within 1e-6 mm of it and at most 1 mm apart."""
    parts = []
    for part in entity.virtual_entities():
        if part.dxftype() == "ARC":
            points = np.array([(v.x, v.y) for v in part.flattening(1e-6)])
        else:
            count = int(np.ceil(part.dxf.start.distance(part.dxf.end))) + 1
            points = np.array([part.dxf.start.lerp(part.dxf.end, f).vec2 for f in np.linspace(0, 1, count)])
        parts.append(points)
    return np.concatenate(parts)


def pieces(polyline):
    """The arcs and lines of a polyline: (start, end, unit tangent at start, at end), as x + iy [mm]."""
    points = list(polyline.get_points("xyb"))
    ends = points[1:] + points[:1] if polyline.closed else points[1:]
    for (x, y, bulge), (u, v, _) in zip(points, ends, strict=False):
        chord = complex(u - x, v - y)
        half = np.exp(2j * np.arctan(bulge)) * chord / abs(chord)
        yield complex(x, y), complex(u, v), np.exp(-4j * np.arctan(bulge)) * half, half


# ---- what a cutter sees first


def test_units_are_millimetres_of_a_recent_release(readback):
    assert readback.header["$INSUNITS"] == 4
    assert readback.header["$MEASUREMENT"] == 1
    assert readback.dxfversion >= "AC1024"


def test_each_layer_has_its_own_colour_and_cut_is_red(readback):
    colours = {name: readback.layers.get(name).color for name in ("cut", "path", "reference")}
    assert colours["cut"] == 1
    assert len(set(colours.values())) == 3


def test_lines_along_which_nothing_is_cut_are_dashed(readback):
    assert readback.layers.get("cut").dxf.linetype == "Continuous"
    assert readback.layers.get("path").dxf.linetype == "path-dashes"
    assert readback.linetypes.has_entry("path-dashes")


def test_every_layer_holds_its_own_contours_and_nothing_else(readback):
    kinds = {layer: sorted(e.dxftype() for e in on_layer(readback, layer)) for layer in ("cut", "path", "reference")}
    assert kinds == {"cut": ["CIRCLE", "CIRCLE", "LWPOLYLINE"], "path": ["LWPOLYLINE"] * 2, "reference": ["LWPOLYLINE"]}
    assert len(readback.modelspace()) == 6


def test_the_reference_square_is_fifty_millimetres_and_clear_of_the_part(readback):
    (square,) = on_layer(readback, "reference")
    corners = np.array(list(square.get_points("xy")))
    assert corners.shape == (4, 2)
    np.testing.assert_allclose(np.ptp(corners, axis=0), 50, rtol=0, atol=1e-9)
    rest = np.concatenate([traced(e) for e in on_layer(readback, "path")])
    assert corners[:, 0].min() > rest[:, 0].max() + 5


def test_the_extents_are_those_of_the_drawing_in_millimetres(readback):
    (outline,) = [e for e in on_layer(readback, "cut") if e.dxftype() == "LWPOLYLINE"]
    points = traced(outline)
    exact = 1e3 * flank(REST + 0.08 * np.linspace(0, 1, 1500) ** 2, ROLLER)[0]
    np.testing.assert_allclose([points[:, 0].min(), points[:, 0].max()], [-exact[-1, 0], exact[-1, 0]], atol=1e-9)
    np.testing.assert_allclose([points[:, 1].min(), points[:, 1].max()], [exact[0, 1], exact[-1, 1]], atol=1e-9)
    paths = np.concatenate([traced(e) for e in on_layer(readback, "path")])
    assert readback.header["$EXTMIN"][:2] == pytest.approx((paths[:, 0].min(), paths[:, 1].min()))
    assert readback.header["$EXTMAX"][1] == pytest.approx(exact[-1, 1])


# ---- closed, smooth, exact


def test_a_closed_contour_is_one_closed_polyline_without_a_double_end(readback):
    (outline,) = [e for e in on_layer(readback, "cut") if e.dxftype() == "LWPOLYLINE"]
    points = np.array(list(outline.get_points("xy")))
    assert outline.closed
    assert np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).min() > 0.05


def test_an_open_contour_is_an_open_polyline(readback):
    assert [entity.closed for entity in on_layer(readback, "path")] == [False, False]


def test_holes_are_circles_of_their_size(readback):
    holes = [e for e in on_layer(readback, "cut") if e.dxftype() == "CIRCLE"]
    assert sorted((e.dxf.center.x, e.dxf.center.y, e.dxf.radius) for e in holes) == [(-40, 100, 3), (40, 100, 3)]


@pytest.mark.parametrize("tolerance", [5e-6, 1e-6])
@pytest.mark.parametrize(("layer", "roller"), [("path", 0.0), ("cut", ROLLER)])
def test_smooth_edges_stay_within_the_tolerance_of_the_exact_curve(layer, roller, tolerance):
    x = REST + 0.08 * np.linspace(0, 1, 200_001) ** 2
    exact, tangents = flank(x, roller)
    exact = 1e3 * exact
    entity = next(e for e in on_layer(read(write_dxf(plate(), tolerance)), layer) if e.dxftype() == "LWPOLYLINE")
    points = traced(entity)
    if layer == "cut":  # the right flank: right of the middle, not on the straight top and bottom
        points = points[(points[:, 0] > 0) & (np.abs(points[:, 1] - exact[[0, -1], 1, None]) > 1e-6).all(axis=0)]
    else:
        points = points * np.sign(points[0, 0])
    assert len(points) > 300
    _, near = cKDTree(exact).query(points)
    gap = points - exact[near]
    across = np.abs(gap[:, 0] * tangents[near, 1] - gap[:, 1] * tangents[near, 0])
    assert across.max() <= 1e3 * tolerance + 1e-5
    assert across.max() > 1e2 * tolerance
    back, _ = cKDTree(points).query(exact[::500])
    assert back.max() < 0.5  # every part of the curve is there


def test_the_arcs_of_a_smooth_edge_meet_without_a_kink(readback):
    for entity in on_layer(readback, "path"):
        found = list(pieces(entity))
        assert len(found) > 10
        for (_, end, _, out), (start, _, into, _) in itertools.pairwise(found):
            assert end == start
            assert abs(np.angle(into / out)) < 1e-7


def test_the_left_flank_is_the_mirror_image_of_the_right_one(readback):
    right, left = (np.array(list(e.get_points("xyb"))) for e in on_layer(readback, "path"))
    np.testing.assert_allclose(left, right * [-1, 1, -1], atol=1e-12)


def test_three_quarters_of_a_circle_come_back_as_that_arc():
    corner = Contour((Arc((0.01, 0.02), 0.005, 0.0, 1.5 * np.pi),), "path")
    (entity,) = on_layer(read(write_dxf(Drawing("arc", (corner,)))), "path")
    points = traced(entity)
    np.testing.assert_allclose(np.linalg.norm(points - [10, 20], axis=1), 5, atol=2e-5)
    assert np.abs(points - [10, 15]).max(axis=1).min() < 1e-9
    assert points.min(axis=0) == pytest.approx([5, 15], abs=1e-5)
    assert points.max(axis=0) == pytest.approx([15, 25], abs=1e-5)


def test_a_reference_of_the_users_own_is_kept():
    drawing = Drawing("part", (polygon([(0, 0), (0.1, 0), (0, 0.1)], "cut"), reference_square(0.02, (0.2, 0))))
    (square,) = on_layer(read(files(drawing)["part.dxf"]), "reference")
    assert np.ptp(np.array(list(square.get_points("xy"))), axis=0) == pytest.approx([20, 20])


def test_other_layers_are_drawn_in_colours_of_their_own():
    lines = [Contour((Line((0, 0.01 * n), (0.1, 0.01 * n)),), layer) for n, layer in enumerate(("fold", "engrave"))]
    document = read(write_dxf(Drawing("sheet", tuple(lines))))
    colours = {layer.dxf.name: layer.color for layer in document.layers if layer.dxf.name not in ("0", "Defpoints")}
    assert set(colours) == {"cut", "path", "reference", "fold", "engrave"}
    assert len(set(colours.values())) == 5


@pytest.mark.parametrize("name", ["../evil", "", "a b", "x" * 101, ".hidden"])
def test_names_that_no_file_should_have_are_refused(name):
    with pytest.raises(GeometryError, match="cannot name a drawing"):
        files(Drawing(name, plate().contours))


# ---- the same bytes, and nothing on the side

SCRIPT = """
import hashlib, sys
sys.path[:0] = [sys.argv[1], sys.argv[1] + '/support', sys.argv[1] + '/../support']
from test_export_dxf import plate
from cfmkit.export import files
for name, data in sorted(files(plate(), kerf=2e-4).items()):
    print(name, hashlib.sha256(data).hexdigest())
"""


def run_elsewhere(home, seed):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("XDG_")}
    environment |= {"HOME": str(home), "PYTHONHASHSEED": str(seed), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", SCRIPT, str(Path(__file__).parent)]
    return subprocess.run(command, env=environment, cwd=home, capture_output=True, text=True, check=True, timeout=120)


def test_two_processes_write_the_same_bytes_and_nothing_beside_them(tmp_path):
    runs = []
    for seed in (1, 2):
        home = tmp_path / str(seed)
        home.mkdir()
        runs.append(run_elsewhere(home, seed))
        assert list(home.iterdir()) == []
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout.splitlines()) == 4
    assert [run.stderr for run in runs] == ["", ""]


def test_writing_leaves_the_options_of_ezdxf_as_they_were():
    import ezdxf

    ezdxf.options.write_fixed_meta_data_for_testing = False
    write_dxf(plate())
    assert ezdxf.options.write_fixed_meta_data_for_testing is False


def test_importing_the_exporter_imports_neither_ezdxf_nor_shapely():
    code = "import sys, cfmkit.export; print([m for m in ('ezdxf', 'shapely', 'matplotlib') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout.strip() == "[]"


def test_a_machine_without_room_for_a_temporary_folder_gets_an_output_error(tmp_path):
    code = """
import sys, tempfile
sys.path[:0] = [sys.argv[1], sys.argv[1] + '/support', sys.argv[1] + '/../support']
from test_export_dxf import plate
from drawing_files import write_dxf
from cfmkit.errors import OutputError
tempfile.tempdir = sys.argv[2]
try:
    write_dxf(plate())
except OutputError as error:
    print(error)
"""
    command = [sys.executable, "-c", code, str(Path(__file__).parent), str(tmp_path / "missing")]
    run = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout.startswith("DXF needs a temporary folder for a moment: ")

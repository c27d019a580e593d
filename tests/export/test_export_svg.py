"""The SVG is the drawing at real size, y up, with the very arcs of the DXF."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from drawing_files import write_svg

from cfmkit.errors import GeometryError
from cfmkit.export import files
from cfmkit.export.arc_outlines import outlines
from cfmkit.export.contours import Arc, Contour, Curve2D, Drawing, Line, Smooth, circle, polygon
from cfmkit.export.dxf_svg_csv import write_points

SVG = "{http://www.w3.org/2000/svg}"


def drawing():
    """A plate with one parabolic side, a three-quarter arc notch and a hole; a path that leaves it."""
    x = np.linspace(0.02, 0.08, 600)
    tangents = np.column_stack([np.ones(600), 10 * x]) / np.hypot(1, 10 * x)[:, None]
    side = Smooth(np.column_stack([x, 5 * x**2]), tangents)
    notch = Arc((0.0, 0.032), 0.01, 0.0, -1.5 * np.pi)
    edges = (
        side,
        Line((0.08, 0.032), (0.01, 0.032)),
        notch,
        Line((0.0, 0.042), (-0.03, 0.042)),
        Line((-0.03, 0.042), (-0.03, 0.002)),
        Line((-0.03, 0.002), (0.02, 0.002)),
    )
    contours = (
        Contour(edges, "cut", closed=True),
        circle((0.03, 0.02), 0.004, "cut", hole=True),
        Contour((Arc((0.02, 0.0), 0.03, 0.5, 2.5),), "path"),
    )
    return Drawing("notched", contours)


@pytest.fixture(scope="module")
def root():
    return ET.fromstring(files(drawing())["notched.svg"])


def group(root, layer):
    return next(node for node in root.iter(f"{SVG}g") if node.get("id") == layer)


def walked(path):
    """(start, end, centre or None, large, sweep) of each command, in the SVG's own axes, by its specification (F.6)."""
    tokens = re.findall(r"[MLAZ]|-?[\d.]+", path.get("d"))
    at = first = None
    while tokens:
        command = tokens.pop(0)
        if command == "Z":
            yield at, first, None, 0, 0
            continue
        numbers = [float(tokens.pop(0)) for _ in range(7 if command == "A" else 2)]
        end = complex(*numbers[-2:])
        if command == "M":
            first = end
        elif command == "L":
            yield at, end, None, 0, 0
        else:
            radius, large, sweep = numbers[0], int(numbers[3]), int(numbers[4])
            chord = end - at
            height = np.sqrt(max(radius**2 - abs(chord / 2) ** 2, 0.0))
            side = 1 if large != sweep else -1
            yield at, end, (at + end) / 2 + side * height * 1j * chord / abs(chord), large, sweep
        at = end


def on_arc(start, end, center, sweep):
    a, b = np.angle(start - center), np.angle(end - center)
    turn = (b - a) % (2 * np.pi) if sweep else -((a - b) % (2 * np.pi))
    return center + abs(start - center) * np.exp(1j * (a + turn * np.linspace(0, 1, 41)))


def test_one_unit_is_one_millimetre_on_paper(root):
    left, top, width, height = map(float, root.get("viewBox").split())
    assert root.get("width") == f"{width:g}mm"
    assert root.get("height") == f"{height:g}mm"
    assert left < -30
    assert left + width > 80
    assert top < -42


def test_there_is_one_group_per_layer_with_visible_lines_of_its_own_colour(root):
    groups = list(root.iter(f"{SVG}g"))
    assert [node.get("id") for node in groups] == ["cut", "path", "reference"]
    assert len({node.get("stroke") for node in groups}) == 3
    assert all(0.1 <= float(node.get("stroke-width")) <= 0.5 and node.get("fill") == "none" for node in groups)


def test_what_is_up_in_the_drawing_is_up_on_the_screen(root):
    hole = group(root, "cut").find(f"{SVG}circle")
    assert (hole.get("cx"), hole.get("cy"), hole.get("r")) == ("30", "-20", "4")


def test_everything_lies_inside_the_picture(root):
    left, top, width, height = map(float, root.get("viewBox").split())
    for layer in ("cut", "path", "reference"):
        for path in group(root, layer).findall(f"{SVG}path"):
            for start, end, center, _, sweep in walked(path):
                points = np.array([start, end]) if center is None else on_arc(start, end, center, sweep)
                assert points.real.min() > left + 1
                assert points.real.max() < left + width - 1
                assert points.imag.min() > top + 1
                assert points.imag.max() < top + height - 1


def test_the_arcs_of_the_svg_run_where_those_of_the_outline_do(root):
    outline = outlines(drawing())[0]
    steps = list(walked(group(root, "cut").find(f"{SVG}path")))
    chain = outline.chain
    middles = chain.nodes[:-1] + chain.chords * 0.5 * (1 - 1j * chain.bulges)
    assert len(steps) == len(middles)
    for (start, end, center, large, sweep), node, middle, bulge in zip(
        steps, chain.nodes, middles, chain.bulges, strict=False
    ):
        assert start.conjugate() == pytest.approx(1e3 * node, abs=1e-6)
        half = (start + end) / 2 if center is None else on_arc(start, end, center, sweep)[20]
        assert half.conjugate() == pytest.approx(1e3 * middle, abs=1e-4)
        assert large == (abs(bulge) > 1)


def test_the_long_way_round_a_notch_is_taken(root):
    xs = [
        on_arc(start, end, center, sweep)
        for start, end, center, _, sweep in walked(group(root, "cut").find(f"{SVG}path"))
        if center is not None and abs(center - (0 - 32j)) < 1e-3
    ]
    points = np.concatenate(xs)
    assert points.real.min() == pytest.approx(-10, abs=1e-2)
    assert points.imag.max() == pytest.approx(-22, abs=1e-2)


def test_closed_contours_are_closed_and_open_ones_are_not(root):
    (cut,), (path,) = (group(root, layer).findall(f"{SVG}path") for layer in ("cut", "path"))
    assert cut.get("d").endswith("Z")
    assert not path.get("d").endswith("Z")


def test_the_same_drawing_gives_the_same_bytes():
    assert write_svg(drawing()) == write_svg(drawing())


def test_a_layer_name_that_would_break_the_file_is_refused():
    with pytest.raises(GeometryError, match="cannot name a layer"):
        write_svg(Drawing("part", (polygon([(0, 0), (1, 0), (0, 1)], 'a"><script'),)))


# ---- the tables of exact points


def test_points_are_written_in_millimetres_with_headers_that_say_so():
    columns = {"x": (np.array([0.0041, 0.07]), "length"), "y": (np.array([-1e-3, 0.0]), "length")}
    columns["slope"] = (np.array([0.5, 2.0]), "ratio")
    table = Curve2D("flank-right", columns)
    found = write_points(Drawing("cam", (), (table,)))
    assert found == {"flank-right.csv": b"x [mm],y [mm],slope [1]\n4.1,-1.0,0.5\n70.0,0.0,2.0\n"}


def test_two_tables_of_one_name_are_refused():
    table = Curve2D("flank", {"x": (np.zeros(2), "length")})
    with pytest.raises(GeometryError, match="two tables named 'flank'"):
        write_points(Drawing("cam", (), (table, table)))


def test_all_files_of_a_drawing_are_named_after_it():
    table = Curve2D("flank", {"x": (np.zeros(2), "length")})
    whole = Drawing("notched", drawing().contours, (table,))
    assert set(files(whole)) == {"notched.dxf", "notched.svg", "flank.csv"}
    assert set(files(whole, kerf=1e-4)) == {"notched.dxf", "notched.svg", "notched-kerf.dxf", "flank.csv"}

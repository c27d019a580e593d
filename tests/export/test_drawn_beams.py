"""The part that is drawn is the part that is specified: area and thickness, measured in the DXF by shapely."""

from __future__ import annotations

import io

import ezdxf
import numpy as np
import pytest
from beam_support import MM, config
from shapely import LineString, Point, Polygon, union_all

import cfmkit
from cfmkit.errors import GeometryError
from cfmkit.export import files
from cfmkit.export.arc_outlines import ArcChain
from cfmkit.export.union import OutlinePiece, merge_pieces


def network(nodes: dict, beams: dict, fillet: str = "0 mm", thickness: str = "1 mm"):
    """Return a network of clamped nodes, given as (x, y) in mm, that the last one of them drives."""
    places = {name: f"{{at: [{float(x)!r} mm, {float(y)!r} mm]}}" for name, (x, y) in nodes.items()}
    text = "\n".join(
        [
            "cfmkit: 1", "family: beam", "name: drawn", "mechanism:", "  material: {youngs_modulus: 70 GPa}",
            "  width: 10 mm", f"  thickness: {thickness}", f"  part: {{fillet: {fillet}}}", "  nodes:",
            *(f"    {name}: {place}" for name, place in places.items()), "  beams:",
            *(f"    {name}: {{{beam}}}" for name, beam in beams.items()),
            f"  drive: {{kind: displacement, node: {list(nodes)[-1]}, direction: 90 deg}}",
            "analysis: {travel: 1 mm}", "",
        ]
    )  # fmt: skip
    return cfmkit.loads(text)


def cut_out(spec) -> Polygon:
    """Return what the DXF cuts [mm]: its closed lines on layer `cut`, their arcs in fine lines."""
    document = ezdxf.read(io.StringIO(files(cfmkit.drawing(spec), formats=("dxf",))["beams.dxf"].decode()))
    rings = []
    for line in document.modelspace().query('LWPOLYLINE[layer=="cut"]'):
        x, y, bulge = np.array(line.get_points("xyb")).T
        nodes = np.append(x, x[0]) + 1j * np.append(y, y[0])
        z = ArcChain(nodes, bulge).flatten(1e-8 * np.ptp(x))
        rings.append(Polygon(np.column_stack([z.real, z.imag])))
    rings.sort(key=lambda ring: -ring.area)
    return rings[0].difference(union_all(rings[1:])) if len(rings) > 1 else rings[0]


def thickness_at(part: Polygon, at, angle: float, reach: float) -> float:
    """Return how thick a part is across a place, along a direction [rad]."""
    way = reach * np.array([-np.sin(angle), np.cos(angle)])
    found = LineString([np.array(at) - way, np.array(at) + way]).intersection(part)
    return sum(one.length for one in getattr(found, "geoms", [found]) if one.distance(Point(at)) < 1e-6 * reach)


@pytest.mark.parametrize("scale", [2.5e-3, 0.1, 1.0, 40.0, 1e3, 1e5])
def test_a_strip_has_its_area_and_thickness_at_every_scale(scale):
    """Before, each was half a micrometre too thick, and one of 0.5 um was drawn as 0.98 um."""
    thin = 0.2 * scale
    spec = network(
        {"a": (0.0, 0.0), "b": (9.0 * scale, 1.0 * scale)}, {"one": "start: a, end: b"}, thickness=f"{thin!r} mm"
    )
    part, length = cut_out(spec), np.hypot(9.0, 1.0) * scale
    assert part.area == pytest.approx(thin * length, rel=1e-6)
    angle = np.arctan2(1.0, 9.0)
    for share in (0.01, 0.5, 0.99):
        at = share * scale * np.array([9.0, 1.0])
        assert thickness_at(part, at, angle, scale) == pytest.approx(thin, rel=1e-6)


def test_nothing_is_added_where_thick_beams_continue_a_thin_one():
    """Before, discs as wide as the thick ones made links of 10 mm with a flexure of 1 x 5 mm 110 times too stiff."""
    nodes = {"a": (0.0, 0.0), "p": (20.0, 0.0), "q": (25.0, 0.0), "e": (45.0, 0.0)}
    beams = {"b1": "start: a, end: p", "f": "start: p, end: q, thickness: 1 mm", "b2": "start: q, end: e"}
    part = cut_out(network(nodes, beams, thickness="10 mm"))
    assert part.area == pytest.approx(405.0, rel=1e-9)
    rounded = cut_out(network(nodes, beams, thickness="10 mm", fillet="0.5 mm"))
    assert rounded.area == pytest.approx(405.0 + 4 * (1 - np.pi / 4) * 0.25, rel=1e-6)
    assert thickness_at(rounded, (22.5, 0.0), 0.0, 20.0) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("thickness", "area"),
    [
        ("[[0, 2 mm], [1, 0.5 mm]]", 50.0),
        ("[[0, 2 mm], [0.5, 2 mm], [0.5, 0.3 mm], [1, 0.3 mm]]", 46.0),
        ("[[0, 9 mm], [0.4, 9 mm], [0.45, 1 mm], [0.5, 0.4 mm], [0.55, 1 mm], [0.6, 9 mm], [1, 9 mm]]", None),
    ],
)
def test_thicknesses_from_station_to_station_are_exact(thickness, area):
    part = cut_out(network({"a": (0.0, 0.0), "b": (40.0, 0.0)}, {"one": f"start: a, end: b, thickness: {thickness}"}))
    given = np.array([[float(w.strip(" [],m")) for w in one.split(",")] for one in thickness[2:-2].split("], [")])
    wanted = 40.0 * np.trapezoid(given[:, 1], given[:, 0])
    assert part.area == pytest.approx(wanted, rel=1e-9)
    assert area in (None, pytest.approx(wanted))
    for share in (0.1, 0.2, 0.42, 0.5, 0.53, 0.7, 0.95):
        there = thickness_at(part, (40 * share, 0.0), 0.0, 50.0)
        if share != 0.5 or area != 46.0:
            assert there == pytest.approx(np.interp(share, *given.T), rel=1e-9)


@pytest.mark.parametrize("sweep", [5.0, -70.0, 170.0, 300.0])
def test_arcs_are_arcs(sweep):
    spec = network(
        {"a": (0.0, 0.0), "b": (40.0, 10.0)}, {"one": f"start: a, end: b, shape: {{kind: arc, sweep: {sweep} deg}}"}
    )
    edges = [edge for one in cfmkit.drawing(spec).contours if one.layer == "cut" for edge in one.edges]
    assert sorted(type(edge).__name__ for edge in edges) == ["Arc", "Arc", "Line", "Line"]
    length = np.radians(abs(sweep)) * np.hypot(40.0, 10.0) / 2 / np.sin(np.radians(abs(sweep)) / 2)
    assert cut_out(spec).area == pytest.approx(length, rel=1e-6)


def test_the_edges_of_a_tapered_curved_beam_are_within_the_tolerance():
    beam = "start: a, end: b, shape: {kind: cosine, rise: 8 mm}, thickness: [[0, 0.5 mm], [1, 1.5 mm]]"
    drawn = cfmkit.drawing(network({"a": (0.0, 0.0), "b": (60.0, 0.0)}, {"one": beam}))
    part = cut_out(network({"a": (0.0, 0.0), "b": (60.0, 0.0)}, {"one": beam}))
    table = {name: values for name, (values, _) in drawn.tables[0].columns.items()}
    for k in range(3, len(table["x"]) - 3, 7):
        at = np.array([table["x"][k], table["y"][k]]) / MM
        there = thickness_at(part, at, float(table["angle"][k]), 5.0)
        assert there == pytest.approx(table["thickness"][k] / MM, abs=2 * 2e-4 * 0.5)


ANGLES = [
    (0.0, 180.0),
    (0.0, 90.0, 180.0),
    (0.0, 90.0),
    (0.0, 120.0, 240.0),
    (10.0, 40.0, 75.0),
    (0.0, 25.0),
    (0.0, 173.0),
]


@pytest.mark.parametrize("sizes", [(1.0, 1.0, 1.0), (3.0, 0.5, 1.0), (0.4, 1.0, 2.0)])
@pytest.mark.parametrize("angles", ANGLES)
def test_joints_are_the_union_of_their_beams_and_the_smallest_piece_that_closes_them(angles, sizes):
    """The corners of the two beams beside an open side of more than half a turn are joined with the node."""
    way = {k: np.exp(1j * np.radians(angle)) for k, angle in enumerate(angles)}
    nodes = {"c": (0.0, 0.0)} | {f"n{k}": (30 * one.real, 30 * one.imag) for k, one in way.items()}
    beams = {f"b{k}": f"start: c, end: n{k}, thickness: {sizes[k]} mm" for k in way}
    half = {k: 0.5j * sizes[k] * one for k, one in way.items()}
    strips = [Polygon([(z.real, z.imag) for z in (-half[k], 30 * one - half[k], 30 * one + half[k], half[k])])
              for k, one in way.items()]  # fmt: skip
    gaps = [(k, (k + 1) % len(angles), (angles[(k + 1) % len(angles)] - angles[k]) % 360) for k in way]
    closed = [Polygon([(z.real, z.imag) for z in (0j, half[k], -half[j])]) for k, j, gap in gaps if gap > 180]
    part, wanted = cut_out(network(nodes, beams)), union_all([*strips, *closed])
    assert part.symmetric_difference(wanted).area < 1e-6 * wanted.area
    rounded = cut_out(network(nodes, beams, fillet="0.2 mm"))
    assert wanted.area <= rounded.area * (1 + 1e-9)
    assert rounded.difference(wanted.buffer(0.21).buffer(-0.21)).area < 1e-3 * wanted.area
    for k, one in way.items():
        at = 28 * one
        assert thickness_at(rounded, (at.real, at.imag), np.angle(one), 3.0) == pytest.approx(sizes[k], rel=1e-6)


def test_pads_and_bars_leave_beams_their_free_length():
    """Beams that leave a held node to two sides keep their thickness from there on: pads lie behind both."""
    text = """
cfmkit: 1
family: beam
name: two-sides
mechanism:
  material: {youngs_modulus: 70 GPa}
  width: 10 mm
  thickness: 1 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    m: {at: [30 mm, 0 mm], support: guided, direction: 90 deg}
    b: {at: [60 mm, 0 mm], support: clamped}
    c: {at: [30 mm, 20 mm]}
    d: {at: [60 mm, 20 mm], support: clamped}
  beams: {one: {start: a, end: m}, two: {start: m, end: b}, three: {start: c, end: d}}
  links: [{master: m, node: c}]
  drive: {kind: displacement, node: m, direction: 90 deg}
  part: {fillet: 0 mm}
analysis: {travel: 1 mm}
"""
    part = cut_out(cfmkit.loads(text))
    for x, y in ((2.5, 0.0), (15.0, 0.0), (45.0, 0.0), (57.5, 0.0), (32.5, 20.0), (45.0, 20.0)):
        assert thickness_at(part, (x, y), 0.0, 3.0) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "fillet"),
    [
        ("beam_lan2010", "0 mm"),
        ("beam_v_bifurcation", "0.3 mm"),
        ("beam_design_arch", "0 mm"),
        ("beam_end_effector", "0 mm"),
    ],
)
def test_shipped_parts_have_sections_between_their_joints(name, fillet):
    """Each beam is judged in its middle; the outline was measured there when it was drawn."""
    spec = config(name, f"mechanism.part.fillet={fillet}")
    judged = {section.beam for section in cfmkit.drawing(spec).sections}
    assert judged == set(spec.mechanism.beams)


def test_a_beam_that_fillets_fill_is_refused_with_the_place_and_a_remedy_that_helps():
    nodes = {"a": (0.0, 0.0), "p": (20.0, 0.0), "q": (25.0, 0.0), "e": (45.0, 0.0)}
    beams = {"b1": "start: a, end: p", "flexure": "start: p, end: q, thickness: 1 mm", "b2": "start: q, end: e"}
    with pytest.raises(GeometryError) as refused:
        cfmkit.drawing(network(nodes, beams, thickness="10 mm", fillet="4 mm"))
    message = str(refused.value)
    assert message.startswith("beam 'flexure' is ")
    assert "at (22.5 mm, 0 mm), but 1 mm in the specification" in message
    smaller = message.partition("fillet=")[2].rstrip("'")
    assert cfmkit.drawing(network(nodes, beams, thickness="10 mm", fillet=smaller)).sections


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e4])
def test_a_cutter_leaves_arcs_between_all_that_it_touches(size):
    """A slot narrower than the cutter is filled; beside an edge too short for an arc it rests on the next corner."""
    comb = np.array([[0, 0], [20, 0], [20, 5], [12, 5], [12, 2], [11.6, 2], [11.6, 5], [6, 5], [6, 4.7], [0, 4.7]])
    (one,) = merge_pieces([OutlinePiece.polygon(size * comb)], size, 0.5 * size)
    radii = [edge.radius / size for edge in one.edges if type(edge).__name__ == "Arc"]
    assert radii == pytest.approx([0.5, 0.5], rel=1e-9)
    low = [edge for edge in one.edges if type(edge).__name__ == "Arc"][1]
    first, last = (np.array([end.real, end.imag]) / size for end in low.ends)
    assert sorted([first.tolist(), last.tolist()]) == [
        pytest.approx([6.0 - np.sqrt(0.25 - 0.04), 4.7]),
        pytest.approx([6.0, 5.0]),
    ]


def test_leaves_and_their_spring_are_measured_in_the_outline():
    """Every piece of a leaf between steps, on the right of each level, and every leaf of the spring."""
    spec = config("vcfm_hybrid")
    judged = [(section.beam, round(section.thickness / MM, 9)) for section in cfmkit.drawing(spec).sections]
    (levels,) = {spec.mechanism.bistable.half_beams // 2}
    assert [one for one in judged if one[0] == "leaf"] == levels * [("leaf", 1.0), ("leaf", 4.0), ("leaf", 1.0)]
    assert [one for one in judged if one[0] == "spring"] == 4 * [("spring", 1.5)]


def test_a_leaf_that_fillets_fill_is_refused_with_a_remedy_that_helps():
    spec = config("vcfm_pla", "mechanism.part.fillet=15 mm")
    with pytest.raises(GeometryError, match=r"beam 'leaf' is 1\.179 mm thick .* but 1\.01 mm .*part\.fillet=0\.51 mm"):
        cfmkit.drawing(spec)
    assert cfmkit.drawing(spec.replace({"mechanism.part.fillet": "0.51 mm"})).sections


def test_flexures_and_strips_of_slider_cranks_are_measured_in_the_outline():
    lumped, strip = (cfmkit.drawing(config(f"slider_crank_{name}")).sections for name in ("lumped", "strip"))
    flexures = config("slider_crank_lumped").mechanism.flexures.all
    assert [one.beam for one in lumped] == ["pivot", "crank_pin", "slider_pin"]
    assert [one.thickness for one in lumped] == [pytest.approx(one.thickness) for one in flexures]
    assert {one.beam for one in strip} == {"strip"}


def test_strips_that_only_just_overlap_are_one_area():
    """The union of these strips lost one of them, and a part that is as specified was refused."""
    thickness = [
        1.0830258843272022, 0.9461045645991758, 2.294927211424994, 1.8403562248599425, 3.102241448824241,
        2.3998682572284775, 2.131509416829178, 1.754170154117468, 2.001168071213906, 1.2489348287665729,
        0.5929737987593309, 2.3626878879347652,
    ]  # fmt: skip
    spec = config("slider_crank_tapered").replace(
        {
            "mechanism.beam.thickness": [MM * one for one in thickness],
            "mechanism.unloaded_angle": 0.40164450983504646,
            "requirements": [],
        }
    )
    assert cfmkit.drawing(spec).sections


def test_thick_leaves_of_a_spring_between_small_blocks_are_on_both_sides():
    keys = ("positive.thickness=4.3 mm", "positive.angle=18 deg", "frame.block=2.3 mm")
    spec = config("vcfm_pla", *(f"mechanism.{key}" for key in keys), "requirements=[]")
    assert [one.beam for one in cfmkit.drawing(spec).sections].count("spring") == 4

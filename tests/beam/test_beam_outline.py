"""The part that is cut: strips of true thickness, merged, rounded, mirrored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_support import CONFIGS, MM, cantilever, config

import cfmkit
from cfmkit.cli import run_command
from cfmkit.export import Drawing, OutlinePiece, files, merge_pieces, outlines
from cfmkit.families import family
from cfmkit.families.beam import strips_and_gaps as strip_module
from cfmkit.families.beam.network_from_spec import Mirror, assemble, is_on_axis
from cfmkit.families.beam.part import strips_of
from cfmkit.families.beam.strips_and_gaps import smallest_gap
from cfmkit.numerics import points_on

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * 10 * MM
TWO = [OutlinePiece.polygon(SQUARE), OutlinePiece.polygon(SQUARE + 5 * MM)]


def cuts(spec, tolerance=None):
    return [one for one in cfmkit.drawing(spec, tolerance).contours if one.layer == "cut"]


def area(contours):
    drawn = outlines(Drawing("area", tuple(contours)), 1e-9)
    return sum(-abs(one.chain.area) if one.hole else abs(one.chain.area) for one in drawn)


def test_overlapping_squares_become_one_contour():
    (one,) = merge_pieces(TWO, 10 * MM)
    assert one.closed
    assert area([one]) == pytest.approx(175e-6, rel=1e-3)


def test_fillets_fill_inside_corners_and_leave_outside_ones():
    """Two inside corners of 90 deg, each filled by r^2 (1 - pi/4)."""
    plain, rounded = area(merge_pieces(TWO, 10 * MM)), area(merge_pieces(TWO, 10 * MM, fillet=1 * MM))
    assert rounded - plain == pytest.approx(2 * (1 - np.pi / 4) * 1e-6, rel=1e-9)


def test_holes_stay_holes():
    contours = merge_pieces(TWO[:1], 10 * MM, holes=[OutlinePiece.polygon(0.2 * SQUARE + 4 * MM)])
    assert [contour.hole for contour in contours] == [False, True]
    assert area(contours) == pytest.approx(96e-6, rel=1e-3)


def test_a_straight_cantilever_has_the_area_of_its_strip_and_its_pad():
    spec = cantilever(("width: 100 mm", "width: 100 mm\n  part: {fillet: 0 mm}"))
    assert area(cuts(spec)) == pytest.approx((400 + 16) * 1e-6, rel=1e-9)


@pytest.mark.parametrize(("curvature", "straight"), [(0.0, True), (2.0, False)])
def test_a_strip_far_from_the_origin_knows_its_corners_and_whether_it_is_straight(curvature, straight):
    s = np.linspace(0, 50 * MM, 11)
    angle = 0.3 + curvature * s
    points = np.array([0.2, -0.1]) + np.column_stack([np.cos(angle), np.sin(angle)]).cumsum(axis=0) * s[1]
    even = np.ones(11)
    strip = strip_module.BeamStrip(points, angle, MM * even, curvature * even, 0 * even)
    assert strip.straight is straight
    _, end, _, start = strip.edges
    left, right = strip.sides
    assert (end.start, end.end) == (tuple(right[-1]), tuple(left[-1]))
    assert (start.start, start.end) == (tuple(left[0]), tuple(right[0]))


def test_the_drawing_says_what_its_beams_are_made_of():
    second = ("end: tip}", "end: tip, material: pom}\n    other: {start: tip, end: far, material: steel-1.4310}")
    far = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm]}\n    far: {at: [500 mm, 0 mm]}")
    one = dict(cfmkit.drawing(cantilever(("end: tip}", "end: tip, material: pom}"))).facts)["material"]
    both = dict(cfmkit.drawing(cantilever(far, second)).facts)["material"]
    assert one.startswith("pom: E 2800 MPa")
    assert both.startswith("pom: E 2800 MPa")
    assert both.endswith(": other")
    assert dict(cfmkit.drawing(cantilever()).facts)["material"] == "E 2400 MPa, yield 50 MPa"


def test_a_tapered_strip_has_its_thickness_everywhere():
    spec = cantilever(("thickness: 1 mm", "thickness: [[0, 2 mm], [1, 1 mm]]"))
    table = next(item for item in cfmkit.drawing(spec).tables if item.name == "beam-beam")
    column = {name: values for name, (values, _) in table.columns.items()}
    np.testing.assert_allclose(column["thickness"], 2 * MM - 1 * MM * column["x"] / 0.4, atol=1e-12)
    across = np.hypot(column["left_x"] - column["right_x"], column["left_y"] - column["right_y"])
    np.testing.assert_allclose(across, column["thickness"], atol=1e-12)


def test_two_halves_are_one_piece_at_the_top_and_symmetric():
    (outline,) = (one for one in cuts(config("beam_lan2010")) if not one.hole)
    x0, _, x1, _ = outline.extents
    assert x0 == pytest.approx(-x1, abs=2e-6)


def test_every_file_is_written_with_kerf_too():
    names = set(files(cfmkit.drawing(config("beam_lan2010")), kerf=0.1 * MM))
    assert {"beams.dxf", "beams-kerf.dxf", "beams.svg", "beam-b1.csv", "beam-b4.csv"} <= names


def test_pinned_supports_become_eyes_with_holes():
    assert sum(one.hole for one in cuts(config("beam_lee_frame"))) == 2


def test_gaps_of_two_parallel_lines():
    line = np.column_stack([np.linspace(0, 1, 30), np.zeros(30)])
    found = smallest_gap({"a": line, "b": line + np.array([0.0, 0.3])}, {"a": 0.05, "b": 0.1})
    assert found.size == pytest.approx(0.15)
    crossing = smallest_gap({"a": line, "b": line[:, ::-1] + np.array([0.5, -0.5])}, {"a": 0.05, "b": 0.1})
    assert crossing.size == pytest.approx(-0.15)


def test_near_a_common_end_there_is_no_gap():
    line = np.column_stack([np.linspace(0, 1, 200), np.zeros(200)])
    found = smallest_gap({"a": line, "b": line[:, ::-1]}, {"a": 0.01, "b": 0.01})
    assert found.size == pytest.approx(np.hypot(0.06, 0.06) - 0.02, abs=0.01)


def test_mirroring_twice_is_nothing():
    points = np.random.default_rng(1).normal(size=(7, 2))
    mirror = Mirror(0.3 + 0.1j, 0.7)
    np.testing.assert_allclose(mirror.reflect(mirror.reflect(points)), points, atol=1e-14)


@pytest.mark.parametrize(("usual", "own", "on"), [(1, 20, True), (20, 1, False)])
def test_what_is_on_the_mirror_axis_depends_on_the_thickness_of_the_beams_there(usual, own, on):
    thick = ("thickness: 1 mm", f"thickness: {usual} mm"), ("end: tip}", f"end: tip, thickness: {own} mm}}")
    spec = cantilever(*thick, ("analysis:", "  copies: {mirror: [405 mm, 0 mm]}\nanalysis:"))
    assert is_on_axis(assemble(spec), "tip") is on


def test_elastica_that_meet_on_the_mirror_axis_are_one_strip_without_a_hole():
    """Williams' toggle: nothing but two pads and 2 x 12.949 in of a beam 0.243 in thick."""
    found = cuts(config("beam_williams_toggle", "mechanism.part.fillet=0 mm"))
    assert [one.hole for one in found] == [False]
    inch = 25.4 * MM
    beams = 2 * np.hypot(12.943, 0.386) * 0.243 * inch**2
    pads = 2 * (4 * 0.243 * inch) ** 2
    assert area(found) == pytest.approx(beams + pads, rel=2e-3)


def test_a_beam_beside_its_node_is_joined_to_it_by_an_arm():
    arm = ("end: tip}", "end: tip, end_offset: [0 mm, 9 mm]}")
    (one,) = cuts(cantilever(arm, ("width: 100 mm", "width: 100 mm\n  part: {fillet: 0 mm}")))
    away = [abs(place - 0.4) for edge in one.edges for place in edge.ends]
    assert min(away) < 3 * MM


def test_two_halves_whose_moving_ends_have_no_pad_are_one_piece_too():
    spec = cantilever(
        ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: roller, direction: 90 deg}"),
        ("analysis:", "  copies: {mirror: [420 mm, 0 mm]}\n  part: {fillet: 0 mm}\nanalysis:"),
    )
    assert sum(not one.hole for one in cuts(spec)) == 1


def test_elastica_shorter_than_they_are_thick_that_meet_at_both_ends_have_no_gap():
    line = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11)])
    assert smallest_gap({"a": line, "b": line + np.array([0.0, 1e-9])}, {"a": 20.0, "b": 20.0}) is None


def test_the_smallest_gap_is_found_without_looking_at_beams_far_away(monkeypatch):
    rng = np.random.default_rng(5)
    lines = {f"b{k}": rng.normal(size=(1, 2)) * 9 + np.cumsum(rng.normal(size=(40, 2)), axis=0) for k in range(12)}
    lines |= {f"{name}'": Mirror(30, np.pi / 2).reflect(line) for name, line in lines.items()}
    halves = {f"b{k}": 0.02 + 0.01 * k for k in range(12)}
    looked, true = [], strip_module._gap
    every = [true(lines, halves, *pair) for pair in strip_module._pairs(lines)]
    monkeypatch.setattr(strip_module, "_gap", lambda *pair: looked.append(pair) or true(*pair))
    assert smallest_gap(lines, halves) == min(every)
    assert len(every) == 12 * 11 / 2 + 12 * 12
    assert len(looked) < len(every) / 2


def test_of_a_hundred_beams_side_by_side_only_neighbours_are_measured(monkeypatch):
    lines = {f"b{k}": np.array([[0.0, k], [1.0, k]]) for k in range(160)}
    looked, true = [], strip_module._gap
    monkeypatch.setattr(strip_module, "_gap", lambda *pair: looked.append(pair) or true(*pair))
    found = smallest_gap(lines, dict.fromkeys(lines, 0.05))
    assert found.size == pytest.approx(0.9)
    assert len(looked) < 2 * len(lines)


TOLERANCES = [50e-6, 5e-6, 0.5e-6, 0.05e-6]


def edge_points(contours, tolerance, per_edge=99):
    """Return places along the edges of contours, the ends of edges among them, (n, 2) [m]."""
    share = np.arange(per_edge)[:, None] / per_edge
    chains = [one.chain for one in outlines(Drawing("edges", tuple(contours)), tolerance)]
    z = [points_on(one.nodes[:-1], one.chords, one.turns, share).ravel() for one in chains]
    return np.column_stack([np.concatenate(z).real, np.concatenate(z).imag])


@pytest.mark.parametrize("sweep", ["170 deg", "-60 deg"])
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_the_edges_of_a_curved_beam_hold_the_tolerance(tolerance, sweep):
    """Of an arc: two circles about its centre, half a thickness inside and outside of its radius."""
    pair = ("end: tip}", f"end: tip, thickness: 8 mm, shape: {{kind: arc, sweep: {sweep}}}}}")
    part = ("width: 100 mm", "width: 100 mm\n  part: {fillet: 2 mm}")
    contours = cuts(cantilever(pair, part), tolerance)
    half = np.radians(float(sweep.split()[0])) / 2
    radius, center = 0.2 / abs(np.sin(half)), np.array([0.2, 0.2 / np.tan(half)])
    away = edge_points(contours, tolerance) - center
    angle = np.abs(np.angle((away @ [1, 1j]) / (-1j * np.sign(half))))
    distance = np.hypot(*away[angle < 0.8 * abs(half)].T) - radius
    assert len(distance) > 100
    assert np.abs(np.abs(distance) - 4 * MM).max() <= tolerance


def test_the_eyes_of_pins_hold_the_tolerance():
    for tolerance in TOLERANCES:
        contours = cuts(config("beam_lee_frame"), tolerance)
        holes = [edge_points([replace(one, hole=False)], tolerance) for one in contours if one.hole]
        assert len(holes) == 2
        for points in holes:
            distance = np.hypot(*(points - points.mean(axis=0)).T)
            assert np.abs(distance - 1.2 * 2 * MM).max() <= tolerance


def test_a_finer_tolerance_gives_another_contour_and_a_coarser_one_the_same_as_ever():
    spec = cantilever(("end: tip}", "end: tip, shape: {kind: cosine, rise: 40 mm}}"))
    drawn = [outlines(cfmkit.drawing(spec, each), each) for each in TOLERANCES]
    count = [sum(len(one.chain.bulges) for one in each) for each in drawn]
    assert count[0] <= count[1] < count[2] < count[3]
    assert files(cfmkit.drawing(spec)) == files(cfmkit.drawing(spec, 2e-4 * MM), tolerance=2e-4 * MM)


@pytest.mark.parametrize("turns", [1.6, 2.6, 10.25])
def test_windings_on_one_circle_become_a_ring(turns):
    radius, thickness = 20 * MM, 2 * MM
    angle = np.linspace(0.0, 2 * np.pi * turns, 1500)
    points = radius * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    full = np.full(len(angle), 1.0)
    strip = strip_module.BeamStrip(points, angle, thickness * full, full / radius, 0.0 * full)
    assert area(merge_pieces([strip.piece], thickness)) == pytest.approx(2 * np.pi * radius * thickness, rel=2e-3)


def test_a_part_that_cannot_be_drawn_within_its_tolerance_is_refused(tmp_path, capsys):
    """Before, it was drawn with as many points as there may be, however far off."""
    source = str(CONFIGS / "beam_lan2010_thin.yaml")
    large = [source, "--set", "mechanism.nodes.n3.at.1=1.877e10 mm", "-q", "-o", str(tmp_path / "out")]
    assert run_command(["export", *large]) == 3
    assert "coarser --tolerance" in capsys.readouterr().err


@pytest.mark.parametrize("end", [0, 1])
def test_a_line_without_its_end_keeps_all_other_points(end):
    line = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [4.0, 2.0]])
    kept = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [3.5, 2.0]] if end else [[0.5, 0.0], *line[1:].tolist()]
    assert strip_module._cut_off(line, end, 0.5).tolist() == kept
    assert len(strip_module._cut_off(line, end, 6.0)) == 0


def test_a_strip_is_as_curved_as_its_beam():
    """An arc of 60 deg over 400 mm: its radius is 400 mm."""
    spec = cantilever(("end: tip}", "end: tip, shape: {kind: arc, sweep: 60 deg}}"))
    (strip,) = strips_of(assemble(spec))["beam"]
    np.testing.assert_allclose(np.abs(strip.curvature), 2.5, rtol=1e-9)
    np.testing.assert_allclose(np.diff(strip.angle).sum(), np.sign(strip.curvature[0]) * np.pi / 3, rtol=1e-9)


def test_what_is_driven_moves_as_the_drive_does():
    result = cfmkit.analyze(config("beam_end_effector", "analysis.points=11"))
    pads = {body.role: body.core.mean(axis=1) for body in family("beam").part(result).bodies if body.name == "pad"}
    assert pads.keys() == {"held", "driven"}
    assert np.hypot(*(pads["driven"][-1] - pads["driven"][0])) == pytest.approx(np.ptp(result.curve.motion), rel=1e-9)

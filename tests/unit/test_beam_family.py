"""The beam family: closures, copies, surfaces, rescaling, findings; limits, symmetries, other networks than Lan's."""

from __future__ import annotations

import functools
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from beam_support import MM, at, cantilever, config, solved, value

import cfmkit
from cfmkit import Run
from cfmkit.cli.main import main
from cfmkit.elastica import Section, Taper
from cfmkit.elastica.mechanics.march import engine
from cfmkit.errors import DataError, InputError, SpecError
from cfmkit.families import family
from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.families.beam.tip_on_uneven_surface import TIP_DEFINITIONS as SURFACE
from cfmkit.results import Status

GUIDED = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: parallel}")


def warned(result):
    return {item.name: item.message for item in result.warnings}


# --- what the general mode can describe -------------------------------------------------------------------


def test_a_small_displacement_needs_three_ei_over_l_cubed():
    result = cfmkit.analyze(cantilever(("travel: 100 mm", "travel: 0.01 mm")))
    assert result.curve.force[-1] == pytest.approx(3 * 0.02 / 0.4**3 * 1e-5, rel=1e-6)


def test_a_parallel_guide_is_four_times_as_stiff():
    result = cfmkit.analyze(cantilever(("travel: 100 mm", "travel: 0.01 mm"), GUIDED))
    assert result.curve.force[-1] == pytest.approx(12 * 0.02 / 0.4**3 * 1e-5, rel=1e-6)


def test_springs_add_their_stiffness():
    spring = ("end: tip}", "end: tip}\n  springs: {s: {kind: slide, node: tip, direction: 90 deg, stiffness: 2 N/m}}")
    plain, sprung = (cfmkit.analyze(cantilever(("travel: 100 mm", "travel: 10 mm"), *more)) for more in ((), (spring,)))
    np.testing.assert_allclose(sprung.curve.force - plain.curve.force, 2 * plain.curve.motion, atol=1e-9)


def test_a_constant_load_shifts_the_force():
    """A dead force along the drive is one that the drive need not exert."""
    load = ("end: tip}", "end: tip}\n  loads: [{kind: point, node: tip, fy: -0.05 N}]")
    plain, loaded = (cfmkit.analyze(cantilever(*more)) for more in ((), (load,)))
    np.testing.assert_allclose(plain.curve.force - loaded.curve.force, 0.05, atol=1e-8)


def test_a_link_moves_its_node_with_the_master():
    """A rigid arm of 50 mm beyond the tip: its end goes down by more than the tip."""
    arm = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm]}\n    arm: {at: [450 mm, 0 mm]}")
    link = ("end: tip}", "end: tip}\n  links: [{master: tip, node: arm}]")
    path = cfmkit.analyze(cantilever(arm, link)).state.path
    turn = path.motion("tip")[-1, 2]
    assert path.motion("arm")[-1, 1] == pytest.approx(path.motion("tip")[-1, 1] + 0.05 * np.sin(turn), rel=1e-9)


def test_a_beam_split_by_a_node_is_the_same_beam():
    halves = ("beam: {start: root, end: tip}", "one: {start: root, end: mid}\n    two: {start: mid, end: tip}")
    node = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm]}\n    mid: {at: [130 mm, 0 mm]}")
    whole, split = cfmkit.analyze(cantilever()), cfmkit.analyze(cantilever(halves, node))
    np.testing.assert_allclose(split.curve.force, whole.curve.force, rtol=1e-6, atol=1e-9)


def test_pins_hang_a_beam_between_two_hinges():
    """A strut between two pins carries no moment at its ends."""
    pins = ("end: tip}", "end: tip, end_joint: pin, shape: {kind: arc, sweep: 90 deg}}")
    held = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: roller, direction: 0 deg}")
    drive = ("direction: -90 deg", "direction: 180 deg")
    result = cfmkit.analyze(
        cantilever(
            pins,
            held,
            drive,
            ("root: {at: [0 mm, 0 mm], support: clamped}", "root: {at: [0 mm, 0 mm], support: pinned}"),
        )
    )
    assert np.abs(result.curve.extra["beam_moment"].values).max() < 1e-9
    assert result.curve.force[-1] > 0


@pytest.mark.parametrize(
    "shape",
    [
        "{kind: arc, sweep: 60 deg}",
        "{kind: cosine, rise: 30 mm}",
        "{kind: cosine, rise: 30 mm, half: true}",
        "{kind: polyline, points: [[0 mm, 0 mm], [1 mm, 0.4 mm], [2 mm, 0 mm]]}",
        "{kind: spline, points: [[0 mm, 0 mm], [1 mm, 0.4 mm], [2 mm, 0 mm]]}",
        "{kind: polynomial, coefficients: [0.5 rad, -1 rad]}",
    ],
)
def test_shapes_start_and_end_at_their_nodes(shape):
    result = cfmkit.analyze(cantilever(("end: tip}", f"end: tip, shape: {shape}}}"), ("points: 21", "points: 5")))
    assert result.status is Status.COMPLETE
    line = result.state.path.shape("beam", 0)
    np.testing.assert_allclose(line[[0, -1]], [[0, 0], [0.4, 0]], atol=1e-8)
    drawn = cfmkit.drawing(result.spec)
    table = next(item for item in drawn.tables if item.name == "beam-beam")
    ends = [[table.columns[axis][0][k] for axis in ("x", "y")] for k in (0, -1)]
    np.testing.assert_allclose(ends, [[0, 0], [0.4, 0]], atol=1e-9)


def test_a_prescribed_displacement_of_a_support_comes_first():
    """The clamp is turned by 2 deg before anything else: the tip stands 2 deg higher, and 400 mm sin(2 deg)."""
    moved = ("support: clamped}", "support: clamped, moved: {rotation: 2 deg}}")
    path = cfmkit.analyze(
        cantilever(moved, ("kind: displacement", "kind: force"), ("travel: 100 mm", "force: 1e-9 N"))
    ).state.path
    assert path.motion("tip")[0, 1] == pytest.approx(0.4 * np.sin(np.radians(2)), rel=1e-9)


def test_rotating_and_mirroring_the_whole_mechanism_changes_nothing():
    turned = cantilever(("[400 mm, 0 mm]", "[0 mm, 400 mm]"), ("direction: -90 deg", "direction: 0 deg"))
    np.testing.assert_allclose(
        cfmkit.analyze(turned).curve.force, cfmkit.analyze(cantilever()).curve.force, rtol=1e-6, atol=1e-9
    )


# --- closures and copies ----------------------------------------------------------------------------------


def test_chain_closure_keeps_shapes_and_lengths_of_the_beams_that_carry_nodes():
    fits = solved("beam_lan2010", "mechanism.closure=chain").state.path.fits
    for name in ("b1", "b3", "b4"):
        assert abs(fits[name].rotation) < 1e-12
        assert fits[name].scale == pytest.approx(1, abs=1e-12)
    assert abs(fits["b2"].rotation) > 1e-5


def test_legs_and_mirrored_halves_multiply_the_force_and_nothing_else():
    one, many = solved("beam_lan2010"), solved("beam_lan2010", "mechanism.copies.legs=3")
    np.testing.assert_allclose(many.curve.force, 3 * one.curve.force, rtol=1e-12)
    np.testing.assert_array_equal(many.curve.extra["max_stress"].values, one.curve.extra["max_stress"].values)


def test_a_force_drive_shares_its_load_among_the_copies():
    """The same curve by force as by displacement, where that rises."""
    text = config("beam_lan2010")
    by_force = cfmkit.dumps(text).replace("kind: displacement", "kind: force").replace("travel: 18 mm", "force: 9 N")
    result = cfmkit.analyze(cfmkit.loads(by_force.split("requirements:")[0].replace("  window: [7 mm, 13.6 mm]\n", "")))
    one = solved("beam_lan2010").curve
    low = result.curve.motion < 6 * MM
    np.testing.assert_allclose(
        np.interp(result.curve.motion[low], one.motion, one.force), result.curve.force[low], atol=2e-3
    )


def test_the_mirror_image_of_a_stack_that_bifurcates_has_its_layers_swapped():
    one, other = solved("beam_two_layers"), solved("beam_two_layers", "analysis.other_side=true")
    np.testing.assert_allclose(one.curve.force, other.curve.force, atol=1e-5)
    first, second = (item.state.path.motion("n5")[item.state.keep, 1][-1] for item in (one, other))
    assert abs(first - second) > 1 * MM


COLUMN = """
cfmkit: 1
family: beam
name: column
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 1 mm
  width: 8 mm
  nodes:
    foot: {at: [0 mm, 0 mm], support: clamped}
    top: {at: [0 mm, 100 mm]}
  beams:
    column: {start: foot, end: top}
"""


def test_a_column_overloaded_from_the_start_is_buckled_and_told_so():
    """The curve begins on the stable branch, and the finding says under which share of the loads it opens."""
    text = (
        COLUMN
        + """\
  loads:
    - {kind: point, node: top, fy: -0.4 N}
  drive: {kind: force, node: top, direction: 0 deg}
analysis: {force: 0.01 N, points: 5}
"""
    )
    one, other = (cfmkit.analyze(cfmkit.loads(text.replace("points: 5", more))) for more in ("points: 5", MIRRORED))
    euler = np.pi**2 * 2e9 * 8e-3 * 1e-9 / 12 / (4 * 0.1**2)
    share = float(re.search(r"under ([\d.]+) % of the constant loads", warned(one)["bifurcation"])[1])
    assert share == pytest.approx(100 * euler / 0.4, abs=0.05)
    assert one.curve.stable.all()
    assert one.curve.motion[0] == pytest.approx(-other.curve.motion[0], rel=1e-3)


MIRRORED = "points: 5, other_side: true"


def test_a_spring_tightened_beyond_a_bifurcation_and_loads_that_follow_are_told():
    """A tendon from the top of a column to its foot buckles it at four times Euler's load."""
    text = (
        COLUMN
        + """\
  springs:
    tendon: {kind: line, start: top, end: foot, stiffness: 100 N/m, free_length: 80 mm}
  drive: {kind: force, node: top, direction: 0 deg, follows: true}
analysis: {force: 0.001 N, points: 5}
"""
    )
    result = cfmkit.analyze(cfmkit.loads(text))
    euler = np.pi**2 * 2e9 * 8e-3 * 1e-9 / 12 / (4 * 0.1**2)
    share = float(re.search(r"under ([\d.]+) % of the prestress", warned(result)["bifurcation"])[1])
    assert share == pytest.approx(100 * 4 * euler / 2.0, abs=0.05)
    assert "covers divergence only" in warned(result)["flutter_not_judged"]
    assert "flutter_not_judged" not in warned(cfmkit.analyze(cfmkit.loads(text.replace(", follows: true", ""))))


def test_a_curve_that_ends_with_a_negative_force_has_no_strict_range():
    text = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 1477 MPa}
  thickness: 0.7 mm
  width: 6 mm
  axial: true
  nodes:
    wall: {at: [-34.659 mm, 0 mm], support: clamped}
    d: {at: [0 mm, 4.871 mm], support: guided, direction: 90 deg}
  beams:
    v: {start: wall, end: d}
  drive: {kind: displacement, node: d, direction: -90 deg}
analysis: {travel: 5.5 mm, points: 51}
"""
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status is Status.COMPLETE
    assert result.curve.force[-1] < 0
    assert result.values["strict_range_fraction"].value is None


# --- what is reported -------------------------------------------------------------------------------------


def test_a_path_that_ends_early_is_partial_and_says_where():
    result = cfmkit.analyze(
        cantilever(("travel: 100 mm", "travel: 401 mm"), ("direction: -90 deg", "direction: 0 deg"))
    )
    assert result.status in (Status.PARTIAL, Status.NO_EQUILIBRIUM)
    assert warned(result)["ends_early"]


def test_shallow_beams_without_stretching_buckle_at_once():
    """As ever thinner ones that stretch do: their force grows with the cube of the thickness."""
    result = solved("beam_williams_toggle", "analysis.fidelity=inextensible")
    assert result.status is Status.COMPLETE
    thin = solved("beam_williams_toggle", "mechanism.thickness=0.00729 in")  # of 0.243 in
    assert thin.status is Status.COMPLETE
    stiffest = np.abs(result.curve.effort).max()
    places = slice(5, 101)  # before the branch ends, where both differ by their stretch
    assert thin.curve.effort[places] / 0.03**3 == pytest.approx(result.curve.effort[places], abs=1e-3 * stiffest)


def test_stress_above_the_allowable_one_is_told_with_its_place():
    reported = warned(solved("beam_lan2010"))["overstressed"]
    assert reported == (
        "the largest stress in the window is 48.22 MPa, at 0.260 of beam b4; the allowable stress is 48.1 MPa"
    )


def test_the_axial_part_is_left_out_where_beams_do_not_stretch_and_reported_beside():
    plain, total = solved("beam_lan2010"), solved("beam_lan2010", "analysis.stress=total")
    assert value(total, "stress_max") > value(plain, "stress_max")
    assert value(plain, "stress_total_max") == pytest.approx(value(total, "stress_max"), rel=1e-12)


def test_gaps_are_between_surfaces_and_shrink_on_the_way():
    result = solved("beam_lan2010")
    thin = solved("beam_lan2010_thin")
    assert value(thin, "gap_min_moving") - value(result, "gap_min_moving") == pytest.approx(0.15 * MM, abs=1e-9)
    assert value(result, "gap_min_moving") < value(result, "gap_min")


@pytest.mark.parametrize("thickness", [(1.0, 2.0, 1.0, 1.0), (1.0, 1.0, 2.0, 1.0)])
def test_a_beam_is_as_thick_as_on_the_thicker_side_of_a_step(thickness):
    section = Section(1e9, 10 * MM, Taper(np.array([0.0, 0.5, 0.5, 1.0]), np.array(thickness) * MM))
    assert thickest_of(section) == 2.0 * MM


@pytest.mark.parametrize("thickness", [(2.0, 1.0, 2.0, 2.0), (2.0, 2.0, 1.0, 2.0)])
def test_a_beam_is_as_thin_as_on_the_thinner_side_of_a_step(thickness):
    section = Section(1e9, 10 * MM, Taper(np.array([0.0, 0.5, 0.5, 1.0]), np.array(thickness) * MM))
    assert section.thinnest == 1.0 * MM


def test_slenderness_is_that_of_the_thickest_place_of_a_taper():
    """Thick ends and a thin middle: three pieces, of which the middle one says nothing of the others."""
    taper = "[[0, 3 mm], [0.2, 1 mm], [0.8, 1 mm], [1, 3 mm]]"
    even = value(solved("beam_cantilever"), "slenderness_min")
    thickness = config("beam_cantilever").mechanism.thickness
    tapered = value(solved("beam_cantilever", f"mechanism.thickness={taper}"), "slenderness_min")
    assert tapered == pytest.approx(even * thickness / (3 * MM))


def test_what_cannot_be_cut_is_told():
    changes = ("mechanism.part.min_gap=5 mm", "mechanism.part.min_feature=1.2 mm")
    reported = warned(solved("beam_lan2010", *changes))
    assert {"gap_small", "feature_small"} <= set(reported)
    assert not {"gap_small", "feature_small"} & set(warned(solved("beam_lan2010")))


def test_an_imperfection_is_named_and_opens_the_bifurcation():
    column = cantilever(
        ("direction: -90 deg", "direction: 180 deg"),
        ("travel: 100 mm", "travel: 4 mm"),
        ("thickness: 1 mm", "thickness: 10 mm"),
        ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: guided, direction: 0 deg}"),
        ("width: 100 mm", "width: 100 mm\n  axial: true"),
        ("points: 21", "points: 21\n  imperfection: 0.1 mm"),
    )
    bent, perfect = cfmkit.analyze(column), cfmkit.analyze(column.replace({"analysis.imperfection": 0}))
    assert "the beams were bent by 0.1 mm of the buckling mode at 0.8242 mm" in warned(bent)["imperfection"]
    assert value(bent, "bifurcation_displacement") is None
    assert value(perfect, "bifurcation_displacement") == pytest.approx(0.8242e-3, abs=5e-8)


# --- a surface --------------------------------------------------------------------------------------------

PROFILE = "analysis.surface.profile"


def test_the_force_along_a_surface_is_that_at_preload_plus_height():
    result = solved("beam_end_effector")
    nominal, along = result.curves
    height = along.extra["surface_height"].values
    np.testing.assert_allclose(height, 1.75 * MM * (1 - np.cos(np.pi * along.motion / (12.3 * MM))), atol=1e-12)
    force = np.interp(1.76 * MM + height, nominal.motion, nominal.force)
    np.testing.assert_allclose(along.effort, force, atol=2e-3)


def test_normal_and_lateral_force_balance_the_axial_one():
    along = solved("beam_end_effector", "analysis.surface.friction=0.3").curves[1]
    height, way = along.extra["surface_height"].values, along.motion
    slope = 1.75 * np.pi / 12.3 * np.sin(np.pi * way / (12.3 * MM))  # of the formula, exactly, at the ends, too
    np.testing.assert_allclose(np.gradient(height, way)[1:-1], slope[1:-1], atol=2e-4)
    for sign, tail in ((1, ""), (-1, "_back")):  # friction is against the motion: on the way back it helps
        angle = sign * np.arctan(slope)
        normal, lateral = (along.extra[f"{name}_force{tail}"].values for name in ("contact", "lateral"))
        np.testing.assert_allclose(normal * (np.cos(angle) - 0.3 * np.sin(angle)), along.effort, rtol=1e-12)
        np.testing.assert_allclose(normal * (np.sin(angle) + 0.3 * np.cos(angle)), lateral, rtol=1e-12)


def test_forces_on_a_surface_are_the_largest_of_both_ways():
    """A wedge that falls all the way: with friction the tip is pressed on harder on the way back, up the slope."""
    result = solved("beam_end_effector", "analysis.surface.friction=0.3", f"{PROFILE}.height=3.5 - x*3.5/12.3")
    force, angle = value(result, "tip_force_max"), np.arctan(3.5 / 12.3)
    up = force / (np.cos(angle) - 0.3 * np.sin(angle))
    assert value(result, "contact_force_max") == pytest.approx(up, rel=1e-9)
    assert value(result, "lateral_force_max") == pytest.approx(up * (np.sin(angle) + 0.3 * np.cos(angle)), rel=1e-9)


@pytest.mark.parametrize("between", ["smooth", "straight"])
def test_a_surface_is_judged_between_its_points(tmp_path, between):
    """Eight points of a hump: its top lies between two of them."""
    from scipy.interpolate import CubicSpline

    x = np.linspace(0, 12.3, 8)
    y = 3.5 * np.sin(np.pi * x / 12.3)
    points = "\n".join(f"{a:.9f},{b:.9f}" for a, b in zip(x, y, strict=True))
    (tmp_path / "hump.csv").write_text(f"x [mm],y [mm]\n{points}\n")
    found = on_file(tmp_path, f"{{kind: file, file: hump.csv, between: {between}}}")
    fine = np.linspace(0, 12.3, 200_001)
    height = (CubicSpline(x, y) if between == "smooth" else lambda at: np.interp(at, x, y))(fine) * MM
    nominal = found.curves[0]
    force = CubicSpline(nominal.motion, nominal.force)(1.76 * MM + height)
    assert value(found, "surface_relief") == pytest.approx(np.ptp(height), rel=1e-9)
    assert value(found, "tip_force_min") == pytest.approx(force.min(), rel=1e-5)
    assert value(found, "tip_force_max") == pytest.approx(force.max(), rel=1e-5)
    stress = CubicSpline(nominal.motion, nominal.extra["max_stress"].values)(1.76 * MM + height.max())
    assert value(found, "surface_stress_max") == pytest.approx(stress, rel=1e-6)


def on_file(folder, profile):
    """The end-effector on a surface from a file."""
    text = cfmkit.dumps(config("beam_end_effector"))
    start, end = text.index("    profile:"), text.index("    preload:")
    (folder / "spec.yaml").write_text(text[:start] + f"    profile: {profile}\n" + text[end:])
    return cfmkit.analyze(cfmkit.load(folder / "spec.yaml"))


def test_forces_along_a_surface_do_not_depend_on_how_many_of_its_points_are_written():
    few, many = (
        solved("beam_end_effector", f"{PROFILE}.points={n}", f"{PROFILE}.height=1.7*(1 - cos(pi*x/6.15))")
        for n in (7, 2000)
    )
    for name in SURFACE:
        assert value(few, name) == pytest.approx(value(many, name), rel=1e-9)


def test_stress_along_a_surface_is_judged_beyond_the_window_too():
    changes = ("mechanism.safety_factor=1.3", "analysis.window=[1.76 mm, 3 mm]")
    result = solved("beam_end_effector", *changes)
    assert {"surface_stress_exceeded"} == {"surface_stress_exceeded", "stress_exceeded"} & warned(result).keys()
    assert value(result, "surface_stress_max") == pytest.approx(66.4e6, abs=5e4)
    assert value(result, "surface_safety_factor") == pytest.approx(76 / 1.3 / 66.4, rel=1e-3)
    missed = [outcome.metric for outcome in result.requirements if not outcome.ok]
    assert missed == ["surface_safety_factor"]


def test_a_tip_that_leaves_the_surface_is_not_out_of_reach():
    """Where the surface falls below the mechanism at rest, and where the mechanism has no force left."""
    falls = solved("beam_end_effector", f"{PROFILE}.height=-x/2")
    assert falls.status is Status.PARTIAL
    assert {"tip_lifts_off"} == {"tip_lifts_off", "surface_out_of_reach"} & warned(falls).keys()
    assert value(falls, "surface_reach") == pytest.approx(2 * 1.76 * MM, rel=1e-8)  # forces hold the tolerance, 1e-6
    assert falls.curves[1].extra["contact_force"].values.min() >= 0
    far = solved("beam_end_effector", "analysis.surface.preload=3 mm")
    assert {"surface_out_of_reach"} == {"tip_lifts_off", "surface_out_of_reach"} & warned(far).keys()
    assert warned(far)["surface_out_of_reach"].endswith("the mechanism is solved for 0 mm to 5.5 mm")


def test_a_surface_that_rises_too_far_is_partial():
    result = solved("beam_end_effector", "analysis.surface.preload=3 mm")
    assert result.status is Status.PARTIAL
    assert "the surface requires a displacement of" in result.message
    assert value(result, "surface_reach") < 12.3 * MM


def test_a_steep_surface_jams():
    reported = warned(
        solved("beam_end_effector", "analysis.surface.friction=1.99", "analysis.surface.profile.length=12.3 mm")
    )
    assert "tip_jams" not in reported
    changes = (
        "analysis.surface.friction=1.99",
        "analysis.surface.profile.length=3 mm",
        "analysis.surface.profile.height=1.75*(1 - cos(pi*x/3))",
    )
    assert "tip_jams" in warned(solved("beam_end_effector", *changes))


def on_measured_surface(folder, places, between="smooth"):
    """Return the specification of the end-effector on the points of its surface at places [mm]."""
    rows = [f"{x:.9f},{1.75 * (1 - np.cos(np.pi * x / 12.3)):.9f}" for x in places]
    (folder / "heights.csv").write_text("x [mm],y [mm]\n" + "\n".join(rows) + "\n")
    text = cfmkit.dumps(config("beam_end_effector"))
    start, end = text.index("    profile:"), text.index("    preload:")
    profile = f"    profile: {{kind: file, file: heights.csv, between: {between}}}\n"
    (folder / "spec.yaml").write_text(text[:start] + profile + text[end:])
    return cfmkit.load(folder / "spec.yaml")


def test_a_hole_in_a_measured_surface_is_not_bridged(tmp_path):
    """From 4 mm to 8 mm there are no points: a spline went through, and its extremes counted as measured."""
    places = np.linspace(0, 12.3, 100)
    holed = places[(places <= 4) | (places >= 8)]
    found = cfmkit.analyze(on_measured_surface(tmp_path, holed))
    assert found.status is Status.PARTIAL
    (reported,) = [one for one in found.warnings if one.name == "surface_hole"]
    assert "no points from 3.976 mm to 8.076 mm" in reported.message
    assert reported.cures == ("analysis.surface.profile.between=straight",)
    assert found.values["tip_force_max"].value is None
    assert "no points" in found.values["tip_force_max"].reason
    along = found.curves[1]
    inside = (along.motion > 3.98 * MM) & (along.motion < 8.07 * MM)
    assert inside.sum() > 20
    assert np.isnan(along.effort[inside]).all()
    assert np.isfinite(along.effort[~inside]).all()
    for points, between in ((places, "smooth"), (holed, "straight")):
        assert cfmkit.analyze(on_measured_surface(tmp_path, points, between)).status is Status.COMPLETE


def test_a_surface_from_a_file(tmp_path):
    found = cfmkit.analyze(on_measured_surface(tmp_path, np.linspace(0, 12.3, 50)))
    for name in ("tip_force_min", "tip_force_max"):
        assert value(found, name) == pytest.approx(value(solved("beam_end_effector"), name), rel=1e-4)
    (tmp_path / "heights.csv").write_text("x [mm],y [mm]\n0,0\n2,1\n1,2\n")
    with pytest.raises(DataError, match="line 4: x must increase"):
        cfmkit.analyze(cfmkit.load(tmp_path / "spec.yaml"))


# --- rescaling --------------------------------------------------------------------------------------------


def test_thinner_beams_for_the_same_force_reach_further_at_the_same_stress():
    """Section 2.3: the travel goes to where the stress reaches the allowable one, c follows."""
    changes = (
        "design.rescale.thickness=0.85 mm",
        "design.rescale.width=16.28 mm",
        "design.rescale.to_allowable_stress=true",
    )
    design = cfmkit.design(config("beam_lan2010", *changes))
    assert design.spec.analysis.travel == pytest.approx(16.82 * MM, abs=1e-9)
    result = cfmkit.analyze(design.spec)
    assert value(result, "safety_factor") == pytest.approx(1, abs=1e-4)
    assert value(result, "safety_factor") >= 1


def test_the_force_wanted_is_reached_with_stretching_too_and_the_error_of_equation_6_is_told():
    changes = ("mechanism.axial=true", "design.rescale.force=12 N", "design.rescale.free=thickness")
    design = family("beam").design.make(config("beam_lan2010", *changes), Run())  # before its digits are rounded
    assert value(cfmkit.analyze(design.spec), "nominal_force") == pytest.approx(12, rel=1e-8)
    assert "off by" in {item.name: item.message for item in design.warnings}["rescale_approximate"]


def test_equation_6_is_not_blamed_for_a_width_and_is_for_a_size():
    """The share of stretching goes with (thickness / size)^2: twice the size has a quarter of it."""
    axial = ("mechanism.axial=true", "design.rescale.force=12 N")
    assert not {item.name for item in cfmkit.design(config("beam_lan2010", *axial)).warnings} & {"rescale_approximate"}
    stiff = value(solved("beam_lan2010"), "nominal_force")
    soft = value(solved("beam_lan2010", "mechanism.axial=true"), "nominal_force")
    error = 100 * (1 + (soft / stiff - 1) / 4) / (soft / stiff) - 100
    for change in ("design.rescale.force=12 N", "design.rescale.free=width"):
        design = cfmkit.design(config("beam_lan2010", "mechanism.axial=true", change, "design.rescale.size=64 mm"))
        reported = {item.name: item.message for item in design.warnings}["rescale_approximate"]
        assert float(reported.split("off by ")[1].split(" %")[0]) == pytest.approx(error, rel=0.1)
        assert reported.endswith("; corrected") == ("force" in change)


def test_a_size_scales_every_length_in_the_plane():
    spec = config("beam_lan2010", "design.rescale.size=64 mm")
    scaled = cfmkit.design(spec).spec
    for node in spec.mechanism.nodes:
        np.testing.assert_allclose(scaled.mechanism.nodes[node].at, 2 * np.array(spec.mechanism.nodes[node].at))
    assert scaled.mechanism.beams["b1"].shape.length == pytest.approx(2 * spec.mechanism.beams["b1"].shape.length)
    assert scaled.mechanism.thickness == spec.mechanism.thickness
    assert scaled.requirements[0].over == pytest.approx((14 * MM, 27.2 * MM))
    big, small = cfmkit.analyze(scaled), solved("beam_lan2010")
    np.testing.assert_allclose(4 * at(big, 2 * small.curve.motion), small.curve.force, rtol=1e-6, atol=1e-6)


RESCALE = "design: {{rescale: {}}}\nanalysis:"
TWO = ("end: tip}", "end: mid}\n    other: {start: mid, end: tip, thickness: 2 mm, width: 200 mm}")
MID = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm]}\n    mid: {at: [200 mm, 0 mm]}")


@pytest.mark.parametrize(
    ("wanted", "thick", "wide"),
    [
        ("{thickness: 2 mm}", (1.0, 2.0), (100.0, 200.0)),
        ("{thickness: 4 mm, width: 100 mm}", (2.0, 4.0), (50.0, 100.0)),
    ],
)
def test_the_largest_thickness_and_width_of_all_beams_are_those_asked_for(wanted, thick, wide):
    changes = (TWO, MID, ("analysis:", RESCALE.format(wanted)))
    about = cfmkit.design(cantilever(*changes)).spec.mechanism
    assert (about.thickness, about.beams["other"].thickness) == pytest.approx([one * MM for one in thick])
    assert (about.width, about.beams["other"].width) == pytest.approx([one * MM for one in wide])


def test_equation_6_compares_the_moduli_of_the_beams():
    own = ("end: tip}", "end: tip, material: {youngs_modulus: 1 GPa}}")
    changes = (own, ("points: 21", "points: 21\n  fidelity: extensible"))
    design = cfmkit.design(cantilever(*changes, ("analysis:", RESCALE.format("{material: {youngs_modulus: 3 GPa}}"))))
    assert design.message == "rescaled: E 1000 MPa -> 3000 MPa"
    assert "rescale_approximate" not in warned(design)


def test_pads_frame_and_holes_keep_their_places_in_a_part_of_another_size():
    """The hole is that of a screw, whatever the size."""
    part = "part: {fillet: 0 mm, pad: [12 mm, 10 mm], holes: [{at: [-6 mm, 0 mm], diameter: 4 mm}], "
    frame = "frame: {ground: 5 mm, clearance: 3 mm, inside: [[-20 mm, -150 mm], [450 mm, 50 mm]]}}"
    large = ("analysis:", RESCALE.format("{size: 800 mm, thickness: 2 mm}"))
    spec = cantilever(("width: 100 mm", f"width: 100 mm\n  {part}{frame}"), large)
    made = cfmkit.design(spec).spec
    small, big = (
        np.array([one.extents for one in cfmkit.drawing(each).contours if one.layer == "cut"]) for each in (spec, made)
    )
    screw = np.array([4, 4, -4, -4]) * 0.5 * MM
    assert len(small) == 3
    np.testing.assert_allclose(big[:2], 2 * small[:2], atol=1e-5)
    np.testing.assert_allclose(big[2], 2 * small[2] + screw, atol=1e-5)
    assert made.mechanism.part.holes[0].at == pytest.approx((-12 * MM, 0.0))
    assert made.mechanism.part.holes[0].diameter == 4 * MM
    assert made.mechanism.part.fillet == 0
    assert not {one.name for one in cfmkit.drawing(made).warnings} - {one.name for one in cfmkit.drawing(spec).warnings}


TO_STRESS = ("analysis:", "design: {rescale: {to_allowable_stress: true}}\nanalysis:")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            (("travel: 100 mm", "travel: 10 mm"),),
            "one, 50 MPa, within a travel of 145.5 mm: state a longer",
        ),
        (
            (
                ("travel: 100 mm", "travel: 700 mm\n  fidelity: extensible"),
                ("50 MPa", "90 GPa"),
                ("thickness: 1 mm", "thickness: 20 mm"),
            ),
            "within a travel of 1094 mm, and a longer one would tear beams",
        ),
        ((("50 MPa", "90 GPa"),), "before the path ends: the beams are taut at 400 mm"),
    ],
)
def test_a_stress_that_is_not_reached_gives_no_travel(changes, words):
    """It gave the last travel that was looked at, 14.6 times the one of the specification."""
    design = cfmkit.design(cantilever(TO_STRESS, *changes))
    assert design.status is Status.INFEASIBLE
    assert design.spec is None
    assert words in design.message


def test_a_stress_may_be_reached_on_a_travel_longer_than_the_one_given_whatever_its_window():
    window = ("travel: 100 mm", "travel: 40 mm\n  window: [5 mm, 500 mm]")
    design = cfmkit.design(cantilever(TO_STRESS, window, ("50 MPa", "5 MPa")))
    end = design.spec.analysis.travel
    assert 145 * MM < end < 200 * MM
    assert value(cfmkit.analyze(design.spec), "safety_factor") == pytest.approx(1, abs=1e-3)
    assert design.spec.analysis.window[1] == end


def test_a_design_without_a_task_says_what_to_add():
    design = cfmkit.design(config("beam_lan2010"))
    assert design.status is Status.INVALID
    assert "rescale" in design.message


def test_places_of_the_drive_are_told_with_units_and_for_all_copies():
    changes = ("analysis.through_folds=false", "analysis.force=5 N", "mechanism.copies={legs: 2}")
    lee = cfmkit.analyze(config("beam_lee_frame", *changes))
    assert "cannot go on at 3.71" in lee.message
    assert " N: a limit point" in lee.message
    stack = solved("beam_two_layers")
    assert set(stack.curve.extra["path"].values) == {"primary", "bifurcated at 22.07 mm, sign +1"}
    bent = cfmkit.analyze(config("beam_two_layers", "analysis.imperfection=0.01 mm"))
    assert warned(bent)["imperfection"] == "the beams were bent by 0.01 mm of the buckling mode at 22.07 mm"


def test_a_window_that_is_wider_than_the_curve_is_told():
    wide = cfmkit.analyze(cantilever(("points: 21", "points: 21\n  window: [50 mm, 120 mm]")))
    assert "50 ... 120 mm is not within the curve, 0 ... 100 mm" in warned(wide)["window_outside"]
    exact = cfmkit.analyze(cantilever(("points: 21", "points: 21\n  window: [0 mm, 100 mm]")))
    assert "window_outside" not in warned(exact)


def test_a_travel_that_only_beams_of_several_times_their_length_could_follow_is_refused():
    """It took minutes, for a force of beams that are 200 times as long as they were made."""
    with pytest.raises(
        InputError, match=r"to more than twice their length: from 'eye' .* 35.26 mm .* at most 105.8 mm is possible"
    ):
        solved("beam_v_bifurcation", "analysis.travel=8600 mm")
    near = solved("beam_v_bifurcation", "analysis.travel=40 mm", "analysis.modes=1", "analysis.points=5")
    assert near.status is Status.COMPLETE


def test_a_network_without_any_equilibrium_cannot_be_rescaled():
    design = cfmkit.design(config("beam_rescaled", "mechanism.nodes.n4.at=[12.44 mm, 2.4e10 mm]"))
    assert design.status in (Status.NO_EQUILIBRIUM, Status.INFEASIBLE)
    assert design.spec is None


def test_the_last_point_of_a_drive_to_the_negative_side_counts():
    result = cfmkit.analyze(cantilever(("travel: 100 mm", "travel: -300 mm"), ("50 MPa", "1 MPa")))
    largest = result.curve.extra["max_stress"].values.max()
    assert value(result, "stress_max") == pytest.approx(largest)
    assert f"is {largest / 1e6:.4g} MPa" in warned(result)["overstressed"]


LOADED = (
    (
        "  drive:",
        "  loads:\n    - {kind: point, node: tip, fx: 0.02 N, fy: -0.05 N}\n"
        "    - {kind: line, beam: beam, wy: -0.1 N/m}\n  drive:",
    ),
)


@pytest.mark.parametrize(
    "drive",
    [
        (),
        (
            ("{kind: displacement, node: tip, direction: -90 deg}", "{kind: force, node: tip, direction: -90 deg}"),
            ("travel: 100 mm", "force: 0.08 N"),
        ),
        (
            ("{kind: displacement, node: tip, direction: -90 deg}", "{kind: rotation, node: tip}"),
            ("travel: 100 mm", "travel: 40 deg"),
        ),
    ],
    ids=["displacement", "force", "rotation"],
)
def test_loads_that_grow_with_the_drive_are_whole_at_its_end_and_zero_at_rest(drive):
    drive = tuple((old, new) for old, new in drive)
    first, grown = (
        cfmkit.analyze(cantilever(*LOADED, *drive, ("points: 21", f"points: 21\n  loads_first: {when}")))
        for when in ("true", "false")
    )
    assert first.status is grown.status is Status.COMPLETE
    assert grown.curve.motion[0] == 0
    assert abs(grown.curve.effort[0]) < 1e-9
    assert grown.curve.motion[-1] == pytest.approx(first.curve.motion[-1], rel=1e-6)
    assert grown.curve.effort[-1] == pytest.approx(first.curve.effort[-1], rel=1e-6)
    halfway = grown.spec.replace({"mechanism.loads": [{"kind": "point", "node": "tip", "fx": 0.01, "fy": -0.025},
        {"kind": "line", "beam": "beam", "wy": -0.05}], "analysis.loads_first": True})  # fmt: skip
    half = cfmkit.analyze(halfway)
    assert grown.curve.effort[10] == pytest.approx(half.curve.effort[10], rel=1e-6)
    assert grown.curve.motion[10] == pytest.approx(half.curve.motion[10], rel=1e-6)


def test_a_node_that_is_driven_holds_the_loads_that_come_first():
    held = cfmkit.analyze(cantilever(*LOADED))
    assert held.curve.effort[0] == pytest.approx(-0.05 - 0.1 * 0.4 * 3 / 8, rel=1e-2)  # a propped cantilever


TAUT = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 0.5 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: pinned}
    b: {at: [60 mm, 0 mm], support: roller, direction: 0 deg}
  beams:
    s: {start: a, end: b, shape: {kind: arc, sweep: 60 deg}}
  drive: {kind: displacement, node: b, direction: 0 deg}
analysis:
  travel: 8 mm
  points: 61
"""


def test_reactions_are_what_holds_a_node_and_a_force_that_drives_is_a_load():
    """At the same pose: the root bears the force either way, the driven node's column has it under a displacement."""
    moved = TAUT.replace("travel: 8 mm", "travel: 1 mm\n  outputs: {reactions: [a, b]}")
    by_motion = cfmkit.analyze(cfmkit.loads(moved)).curve
    force = float(by_motion.force[-1])
    loaded = moved.replace("kind: displacement", "kind: force").replace("travel: 1 mm", f"force: {force!r} N")
    by_force = cfmkit.analyze(cfmkit.loads(loaded)).curve
    assert by_force.motion[-1] == pytest.approx(1 * MM, rel=1e-5)
    for curve in (by_motion, by_force):
        assert curve.extra["a_fx"].values[-1] == pytest.approx(-force, rel=1e-5)
    assert by_motion.extra["b_fx"].values[-1] == pytest.approx(force, rel=1e-9)
    assert abs(by_force.extra["b_fx"].values).max() < 1e-9 * force


@pytest.mark.parametrize("support", ["pinned", "clamped"])
def test_elastica_that_are_pulled_taut_have_no_limit_point(support):
    result = cfmkit.analyze(cfmkit.loads(TAUT.replace("support: pinned", f"support: {support}")))
    assert result.status is Status.PARTIAL
    assert "the beams are taut at 2." in result.message
    assert "allow stretching ('mechanism.axial: true')" in result.message
    assert "limit point" not in result.message
    (early,) = (item for item in result.warnings if item.name == "ends_early")
    assert early.cures == ("analysis.fidelity=extensible",)
    freed = cfmkit.analyze(result.spec.replace({"analysis.fidelity": "extensible", "mechanism.axial": True}))
    assert freed.curve.motion[-1] == pytest.approx(8 * MM)


def test_elastica_that_are_pulled_taut_after_the_last_point_of_a_coarse_curve_are_said_to_be():
    result = cfmkit.analyze(cfmkit.loads(TAUT.replace("points: 61", "points: 5")))
    assert result.message.startswith("the beams are taut at 2.")
    assert "limit point" not in result.message


def test_straight_beams_on_a_pin_that_are_pulled_into_one_line_are_said_to_be_taut():
    """They bear nothing before: 2 hypot(30, 20) = 72.11 mm is as far as they reach."""
    text = TAUT.replace(
        "s: {start: a, end: b, shape: {kind: arc, sweep: 60 deg}}", "s: {start: a, end: k, end_joint: pin}"
    )
    text = text.replace("  drive:", "    t: {start: k, end: b}\n  drive:").replace("travel: 8 mm", "travel: 25 mm")
    text = text.replace("  beams:", "    k: {at: [30 mm, 20 mm]}\n  beams:")
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status is Status.PARTIAL
    assert re.match(r"the beams are taut at 12\.[01]\d* mm \(a to b: 72\.[01]\d* mm of 72\.11 mm\)", result.message)
    pushed = cfmkit.analyze(cfmkit.loads(text.replace("direction: 0 deg}\nanalysis", "direction: 180 deg}\nanalysis")))
    assert "taut" not in pushed.message


def test_elastica_that_a_force_pulls_taut_move_as_far_as_they_are_long():
    drive = (("kind: displacement", "kind: force"), ("travel: 8 mm", "force: 1e6 N"))
    result = cfmkit.analyze(cfmkit.loads(functools.reduce(lambda text, change: text.replace(*change), drive, TAUT)))
    assert result.status is Status.COMPLETE
    assert result.curve.motion[-1] == pytest.approx((20 * np.pi - 60) * MM, rel=1e-5)  # the arc drawn straight


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        (
            (("support: clamped}",
              "support: clamped}\n    end: {at: [400 mm, 9 mm], support: clamped, moved: {along: 9 m}}"),
             ("{start: root, end: tip}", "{start: root, end: tip}\n    more: {start: tip, end: end}")),
            ("mechanism.nodes.end.moved", "mechanism.axial"),
        ),
        (
            (("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: guided, direction: 0 deg}"),
             ("direction: -90 deg", "direction: 0 deg")),
            ("mechanism.drive", "mechanism.nodes.tip.support", "mechanism.axial"),
        ),
    ],
    ids=["moved", "rigid"],
)  # fmt: skip
def test_without_a_first_pose_the_keys_that_may_be_in_the_way_are_named(changes, keys):
    result = cfmkit.analyze(cantilever(*changes))
    assert result.status is Status.NO_EQUILIBRIUM
    assert all(key in result.message for key in keys), result.message
    assert " at 0 m" not in result.message  # a share of the loads is no place of the drive


HELD = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 0.5 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [60 mm, 0 mm], support: clamped, moved: MOVED}
    c: {at: [60 mm, 30 mm], support: guided, direction: 90 deg}
  beams:
    straight: {start: a, end: b}
    curved: {start: b, end: c, shape: {kind: arc, sweep: 60 deg}}
  drive: {kind: displacement, node: c, direction: -90 deg}
analysis:
  travel: 3 mm
  points: 11
"""


@pytest.mark.parametrize(
    "moved",
    ["{along: -3 mm, across: 2 mm, rotation: 20 deg}", "{along: -6 mm, across: 2 mm}", "{along: -3 mm}"],
)
def test_an_end_of_a_straight_beam_whose_motions_are_all_prescribed_has_a_start(moved):
    """Without stretching the rotations grow with the root of the motion: there is no path to follow from rest."""
    stiff, soft = (
        cfmkit.analyze(cfmkit.loads(HELD.replace("MOVED", moved) + f"  fidelity: {fidelity}\n"))
        for fidelity in ("inextensible", "extensible")
    )
    assert stiff.status is Status.COMPLETE
    assert stiff.curve.stable.all()
    for name in ("straight_force_x", "curved_force_y"):
        np.testing.assert_allclose(stiff.curve.extra[name].values, soft.curve.extra[name].values, rtol=0.02, atol=5e-3)


def test_an_end_that_would_have_to_stretch_its_beam_has_no_start():
    result = cfmkit.analyze(cfmkit.loads(HELD.replace("MOVED", "{along: 2 mm}")))
    assert result.status is Status.NO_EQUILIBRIUM
    assert "mechanism.nodes.b.moved" in result.message


def test_nodes_and_reactions_are_reported_where_they_are_requested():
    """Of one of the two halves: the reactions balance, the driven node goes as it is driven."""
    outputs = "analysis.outputs={nodes: [n3, n5], reactions: [n1, n2, n5]}"
    result = solved("beam_lan2010", outputs, "analysis.points=11")
    extra = result.curve.extra
    for component in ("fx", "fy"):
        total = sum(extra[f"{node}_{component}"].values for node in ("n1", "n2", "n5"))
        np.testing.assert_allclose(total, 0.0, atol=1e-9 * np.abs(extra["n1_fx"].values).max())
    np.testing.assert_allclose(extra["n5_y"].values, -result.curve.motion, atol=1e-12)
    np.testing.assert_allclose(-extra["n5_fy"].values * 2, result.curve.force, atol=1e-7)
    assert abs(extra["n3_rotation"].values[-1]) > 0.1
    assert value(result, "parasitic_motion") == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("outputs", "place", "reported"),
    [
        ("{nodes: [n9]}", "analysis.outputs.nodes.0", "there is no node 'n9'"),
        ("{reactions: [n1, n3]}", "analysis.outputs.reactions.1", "nothing holds 'n3'"),
    ],
)
def test_what_cannot_be_reported_is_refused_at_its_place(outputs, place, reported):
    with pytest.raises(SpecError) as caught:
        solved("beam_lan2010", f"analysis.outputs={outputs}")
    assert place in str(caught.value)
    assert reported in str(caught.value)


def test_a_guided_node_where_the_part_buckles_has_no_least_stiffness_across_the_drive():
    """Before, the number was as large as a point was close to the bifurcation at 22.07 mm."""
    assert value(solved("beam_two_layers"), "cross_stiffness") is None
    assert value(solved("beam_two_layers", "analysis.window=[1 mm, 15 mm]"), "cross_stiffness") > 0


@pytest.mark.parametrize("window", ["14 mm", "22.0701434087 mm"])
def test_a_peak_at_a_bifurcation_is_there_however_many_points_and_if_one_is_on_it(window):
    """Cubics went across the kink: with 31 points the peak was 1.3e-2 off, the place of a stress 7.5e-4.

    Before the bifurcation the force is level: to 1e-12 of itself over 0.01 um.
    """
    found = []
    for count in (31, 90):
        changes = {"analysis.points": count, "analysis.window": [window, "27.2 mm"]}
        result = cfmkit.analyze(cfmkit.load("configs/beam_two_layers.yaml").replace(changes))
        found.append(cfmkit.evaluate(result, ("peak_displacement", "peak_force", "stress_limit_displacement")))
        assert found[-1]["peak_displacement"].value == pytest.approx(
            result.values["bifurcation_displacement"].value, rel=1e-6
        )
    few, many = found
    assert few["peak_force"].value == pytest.approx(many["peak_force"].value, rel=1e-8)  # the path: 5e-8
    assert few["stress_limit_displacement"].value == pytest.approx(many["stress_limit_displacement"].value, rel=1e-5)


BRACE = """\
cfmkit: 1
family: beam
name: brace
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 1 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [30 mm, 0 mm]}
    c: {at: [60 mm, 5 mm], support: clamped}
  beams: {left: {start: a, end: b}, right: {start: b, end: c}}
  drive: {kind: displacement, node: b, direction: 90 deg}
analysis: {travel: 3 mm, points: 21, fidelity: inextensible}
"""


def test_beams_that_buckle_as_soon_as_they_bear_have_their_peak_where_they_buckle(tmp_path):
    """The place just behind rest was no corner of the curve: a cubic across it had a peak of 604 kN."""
    (tmp_path / "brace.yaml").write_text(BRACE, encoding="utf-8")
    result = cfmkit.analyze(tmp_path / "brace.yaml")
    curve, peak = result.curve, result.values["peak_force"].value
    at_rest = float(np.polyval(np.polyfit(curve.displacement[1:4], curve.force[1:4], 2), 0.0))  # of the buckled beams
    assert peak == pytest.approx(at_rest, rel=5e-3)
    assert 0.0 < result.values["peak_displacement"].value < 1e-6 * MM


@pytest.mark.parametrize("name", ["beam_lan2010", "beam_two_layers", "beam_design_arch"])
def test_equilibria_between_points_are_those_of_a_path_through_them(name):
    """On the branch that the path took, too: the layers of one of them have buckled."""
    spec = cfmkit.load(f"configs/{name}.yaml")
    coarse = cfmkit.analyze(spec.replace({"analysis.points": 40})).closed
    fine = cfmkit.analyze(spec.replace({"analysis.points": 118}))
    there = coarse.solve_at(fine.curve.motion)
    assert there.accurate.mean() > 0.98
    solved = there.accurate
    largest = np.abs(fine.curve.effort).max()
    assert np.abs(coarse.effort("load", fine.curve.motion) - fine.curve.effort)[solved].max() < 1e-7 * largest
    if name != "beam_two_layers":  # there the stress has corners, as at every bifurcation
        stress = fine.curve.extra["max_stress"].values
        assert np.abs(coarse.stress("load", fine.curve.motion) - stress).max() < 1e-4 * stress.max()


@pytest.mark.slow
def test_a_coil_of_many_turns_is_analysed_without_dense_matrices():
    """With 10 500 unknowns one such matrix takes 0.9 GB: it was one for each of 137 points."""
    spec = cfmkit.load(Path(__file__).parents[2] / "configs" / "beam_two_layers.yaml")
    coiled = spec.replace({"mechanism.beams.b1.shape.coefficients.1": 1309.2})
    tracemalloc.start()
    try:
        result = cfmkit.analyze(coiled)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert result.values["gap_min"].value is not None
    assert peak < 8e8


@pytest.mark.skipif(engine() != "C", reason="the numpy engine needs scipy")
def test_a_short_run_loads_neither_the_compiler_nor_masked_arrays():
    """Both cost more than the solver does: numpy.ma, which np.unique loads, 20 ms."""
    code = (
        "import sys, cfmkit; cfmkit.analyze(cfmkit.load(sys.argv[1])); "
        "sys.exit(any(name in sys.modules for name in ('scipy', 'numpy.ma')))"
    )
    command = [sys.executable, "-P", "-c", code, str(Path(__file__).parents[2] / "configs" / "beam_lan2010.yaml")]
    codes = (subprocess.run(command, check=False).returncode for _ in range(2))
    assert 0 in codes  # the first one may compile


def test_a_straight_strip_pulled_along_itself_names_the_strip_and_a_cure_and_a_pressed_one_buckles():
    text = TAUT.replace(", shape: {kind: arc, sweep: 60 deg}", "").replace("support: pinned", "support: clamped")
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status.exit_code == 4
    assert "inextensible beams lie straight along the drive (s)" in result.message
    assert "\n" not in result.message
    (early,) = (item for item in result.warnings if item.name == "ends_early")
    assert early.cures == ("analysis.fidelity=extensible",)
    pressed = cfmkit.analyze(cfmkit.loads(text.replace("direction: 0 deg}\nanalysis", "direction: 180 deg}\nanalysis")))
    assert pressed.status is Status.COMPLETE
    assert "bifurcation" in {item.name for item in pressed.warnings}
    buckled = cfmkit.analyze(pressed.spec.replace({"analysis.fidelity": "extensible", "mechanism.axial": True}))
    assert pressed.curve.effort[-1] == pytest.approx(buckled.curve.effort[-1], rel=1e-2)


TIED = """\
cfmkit: 1
family: beam
name: tied
mechanism:
  material: {youngs_modulus: 2300 MPa}
  thickness: 1 mm
  width: 5 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    m: {at: [30 mm, 20 mm]}
    b: {at: [60 mm, 0 mm], support: pinned}
    t: {at: [90 mm, 10 mm], support: clamped}
  beams:
    left: {start: a, end: m, shape: {kind: cosine, rise: 1 mm}}
    right: {start: m, end: b}
    EXTRA: {start: t, end: b, end_joint: pin}
  drive: {kind: rotation, node: m}
analysis: {travel: 10 deg, points: 5}
"""


def test_a_straight_beam_between_held_places_changes_nothing(tmp_path):
    """Its force was undetermined, and the whole network was called rigid."""
    text = TIED.replace("EXTRA", "spare")
    (tmp_path / "with.yaml").write_text(text, encoding="utf-8")
    alone = re.sub(r"    (spare|t): .*\n", "", text)
    (tmp_path / "without.yaml").write_text(alone, encoding="utf-8")
    one, other = (cfmkit.analyze(cfmkit.load(tmp_path / f"{name}.yaml")).curve for name in ("with", "without"))
    np.testing.assert_allclose(one.torque, other.torque, rtol=1e-9, atol=1e-12)
    assert np.abs(one.extra["spare_force_x"].values).max() < 1e-6


def test_beams_that_over_determine_a_network_are_named(tmp_path, monkeypatch, capsys):
    text = TIED.replace(", shape: {kind: cosine, rise: 1 mm}", "").replace("EXTRA", "spare")
    text = text.replace("kind: rotation, node: m", "kind: displacement, node: m").replace("10 deg", "1 mm")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tied.yaml").write_text(text, encoding="utf-8")
    assert main(["analyze", "tied.yaml", "--no-plots", "--set", "mechanism.drive.direction=90 deg"]) == 4
    page = " ".join(capsys.readouterr().out.split())
    assert "inextensible beams between places that do not move (left, right) hold the network rigid" in page


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("mechanism.nodes={m: {at: [0 mm, 74 mm]}}", "a beam joins two nodes, and there is one: add another"),
        ("mechanism.nodes.m.support=clamped", "'m' cannot turn: its support is 'clamped'; 'pinned' lets it turn"),
        (
            "mechanism.drive={kind: displacement, node: b, direction: 0 deg}",
            "'b' cannot move: its support is 'pinned'; 'guided' with 'direction: 0 deg' or 'free' lets it",
        ),
    ],
)
def test_what_stands_in_the_way_of_a_network_is_said_with_its_cure(tmp_path, capsys, change, said):
    (tmp_path / "tied.yaml").write_text(TIED.replace("EXTRA", "spare"), encoding="utf-8")
    assert main(["check", str(tmp_path / "tied.yaml"), "--set", change]) == 3
    captured = capsys.readouterr()
    assert said in captured.out + captured.err

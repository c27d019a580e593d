"""The tip of a mechanism of beams along an uneven surface: forces, friction, reach, and surfaces from files."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import MM, config, solved, value, warned

import cfmkit
from cfmkit.errors import DataError
from cfmkit.families.beam.tip_on_uneven_surface import TIP_DEFINITIONS as SURFACE
from cfmkit.results import Status

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
    found = cfmkit.analyze(on_measured_surface(tmp_path, x, y, between))
    fine = np.linspace(0, 12.3, 200_001)
    height = (CubicSpline(x, y) if between == "smooth" else lambda at: np.interp(at, x, y))(fine) * MM
    nominal = found.curves[0]
    force = CubicSpline(nominal.motion, nominal.force)(1.76 * MM + height)
    assert value(found, "surface_relief") == pytest.approx(np.ptp(height), rel=1e-9)
    assert value(found, "tip_force_min") == pytest.approx(force.min(), rel=1e-5)
    assert value(found, "tip_force_max") == pytest.approx(force.max(), rel=1e-5)
    stress = CubicSpline(nominal.motion, nominal.extra["max_stress"].values)(1.76 * MM + height.max())
    assert value(found, "surface_stress_max") == pytest.approx(stress, rel=1e-6)


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
    assert far.status is Status.PARTIAL
    assert "the surface requires a displacement of" in far.message
    assert value(far, "surface_reach") < 12.3 * MM


@pytest.mark.parametrize(("length", "jams"), [("12.3", False), ("3", True)])
def test_a_steep_surface_jams(length, jams):
    changes = (f"{PROFILE}.length={length} mm", f"{PROFILE}.height=1.75*(1 - cos(pi*x/{length}))")
    reported = warned(solved("beam_end_effector", "analysis.surface.friction=1.99", *changes))
    assert ("tip_jams" in reported) is jams


def on_measured_surface(folder, places, heights=None, between="smooth"):
    """Return the specification of the end-effector on measured heights [mm], else those of its surface, at places."""
    heights = 1.75 * (1 - np.cos(np.pi * places / 12.3)) if heights is None else heights
    rows = [f"{x:.9f},{y:.9f}" for x, y in zip(places, heights, strict=True)]
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
        assert cfmkit.analyze(on_measured_surface(tmp_path, points, between=between)).status is Status.COMPLETE


def test_a_surface_from_a_file(tmp_path):
    found = cfmkit.analyze(on_measured_surface(tmp_path, np.linspace(0, 12.3, 50)))
    for name in ("tip_force_min", "tip_force_max"):
        assert value(found, name) == pytest.approx(value(solved("beam_end_effector"), name), rel=1e-4)
    (tmp_path / "heights.csv").write_text("x [mm],y [mm]\n0,0\n2,1\n1,2\n")
    with pytest.raises(DataError, match="line 4: x must increase"):
        cfmkit.analyze(cfmkit.load(tmp_path / "spec.yaml"))

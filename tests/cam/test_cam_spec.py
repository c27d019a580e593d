"""What a cam specification may say, what follows from what is left out, and the scalar results."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cam_support import MM, analyze, at, cam, fixed

from cfmkit.errors import SpecError
from cfmkit.families.cam.mechanism_from_spec import resolve
from cfmkit.stock import material

FITS = {"roller_radius": "10 mm"}


@pytest.mark.parametrize(
    ("springs", "total"),
    [
        ({"stiffness": "0.69 N/mm"}, 690),
        ({"stiffness": "0.69 N/mm", "count": 6}, 4140),
        ({"stiffness": ("0.683 N/mm", "0.682 N/mm")}, 1365),
        ({"stiffness": ("0.683 N/mm", "0.682 N/mm"), "count": 2}, 1365),
        (("0.683 N/mm", "0.682 N/mm", "0.681 N/mm"), 2046),
    ],
)
def test_springs_in_parallel_add_up(springs, total):
    assert cam(springs=springs).mechanism.springs.total == pytest.approx(total)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"springs": {"stiffness": ("0.7 N/mm", "0.7 N/mm"), "count": 3}}, "'count' is 3 but 'stiffness' lists 2"),
        ({"springs": {"stiffness": ()}}, "at least one"),
        ({"contact": {"width": "10 mm", "material": "cheese"}}, "cheese"),
        ({"masses": None, "analysis__gravity": True}, "mechanism.masses"),
        ({"rolling_friction": 1}, "< 1"),
        ({"rolling_friction": -0.1}, ">= 0"),
        ({"profile__friction": -1}, "> -1"),
        ({"profile__slope_factor": 0}, "> 0"),
        ({"brace_length": "0 mm"}, "> 0"),
        ({"analysis__points": 4}, "5"),
    ],
)
def test_what_makes_no_sense_is_refused(changes, words):
    with pytest.raises(SpecError, match=words):
        cam(**changes)


def test_what_a_profile_leaves_out_follows_the_mechanism():
    spec = resolve(cam())
    profile = spec.mechanism.profile
    assert (profile.brace_length, profile.rest_half_width, profile.roller_radius) == (0.2, 0.068, 0.016)
    assert resolve(cam(brace_length="210 mm")).mechanism.profile.brace_length == 0.21
    assert resolve(spec) == spec


def test_a_profile_written_out_is_a_fixed_part():
    spec = resolve(cam(**FITS))
    assert np.ptp(at(spec, [0.01, 0.2]).force) < 1e-9
    assert np.ptp(at(spec.replace({"mechanism.brace_length": "210 mm"}), [0.01, 0.2]).force) > 0.1


def test_without_a_stroke_the_cam_reaches_as_far_as_asked():
    spec = cam(profile__stroke=None, **FITS)
    assert resolve(spec.replace({"analysis.travel": "77 mm"})).mechanism.profile.stroke == 0.077
    wanted = spec.replace({"design": {"force": "50 N", "stroke": "88 mm"}})
    assert resolve(wanted).mechanism.profile.stroke == 0.088
    assert resolve(spec).mechanism.profile.stroke == 0.1


@pytest.mark.parametrize(
    ("analysis", "wanted", "gravity"),
    [(None, None, False), (None, True, True), (None, False, False), (True, False, True), (False, True, False)],
)
def test_weight_acts_where_the_analysis_says_so_else_where_the_design_does(analysis, wanted, gravity):
    spec = cam(analysis__gravity=analysis)
    if wanted is not None:
        spec = spec.replace({"design": {"force": "60 N", "stroke": "240 mm", "gravity": wanted}})
    assert spec.gravity is gravity


def test_the_masses_hang_half_a_brace_at_each_end():
    """Where the slider has a long lever (a steep path) the weight on it is nearly all that gravity adds."""
    spec, loaded = cam(**FITS), cam(analysis__gravity=True, **FITS)
    masses = spec.mechanism.masses
    plain, heavy = at(spec, 0.24), at(loaded, 0.24)
    tangent = math.tan(math.asin(plain.x[0] / 0.2))
    rise = plain.slope[0] / (plain.slope[0] - tangent)  # of the rollers per rise of the slider
    weight = masses.slider + 2 * masses.roller * rise + masses.brace * (1 + rise)
    assert heavy.force[0] - plain.force[0] == pytest.approx(9.80665 * weight, rel=1e-9)


# --- scalar results -----------------------------------------------------------------------------------------


def values(spec):
    return {name: value.value for name, value in analyze(spec).values.items()}


def test_the_values_are_those_of_the_curve():
    spec = cam(rolling_friction=0.002)
    result = analyze(spec)
    found, curve, half = values(spec), result.curve, len(result.curve) // 2
    flank = curve.extra["contact"].values[:half] == "flank"
    assert found["force_constant"] == pytest.approx(9.058 * MM)
    assert found["spring_stiffness"] == pytest.approx(1365)
    assert found["spring_elongation_max"] == curve.extra["spring_elongation"].values.max()
    assert found["contact_force_max"] == curve.extra["contact_force"].values.max()
    # largest where the roller leaves the corner, between two points of the curve
    assert found["pressure_angle_max"] > curve.extra["pressure_angle"].values[:half][flank].max()
    for points in (31, 3001):
        assert values(cam(rolling_friction=0.002, analysis__points=points))["pressure_angle_max"] == pytest.approx(
            found["pressure_angle_max"], rel=1e-12
        )
    assert found["brace_angle_max"] == pytest.approx(math.asin(curve.extra["roller_x"].values.max() / 0.2))
    up, down = curve.force[:half][flank], curve.force[half:][::-1][flank]
    assert found["friction_half_gap_max"] == pytest.approx(((up - down) / (up + down)).max())
    assert found["corner_force_max"] > curve.force[:half][~flank].max()
    assert found["undercut_travel"] == pytest.approx(1.13969652 * MM)


def test_the_pressure_angle_is_that_between_brace_and_motion():
    found = at(cam(**FITS), 0.1)
    result = analyze(cam(analysis__points=241, **FITS))
    direction = np.array([1, found.slope[0]]) / np.hypot(1, found.slope[0])
    brace = np.array([-found.x[0], np.sqrt(0.2**2 - found.x[0] ** 2)]) / 0.2
    angle = result.curve.extra["pressure_angle"].values[100]
    assert math.cos(angle) == pytest.approx(float(direction @ brace), abs=1e-12)


def test_the_peak_on_the_corner_does_not_depend_on_the_points():
    found = [values(cam(analysis__points=points))["corner_force_max"] for points in (5, 481, 20_001)]
    np.testing.assert_allclose(found, 1.063265 * 4 * 1365 * 9.058e-3, rtol=1e-6)
    half_way = values(cam(analysis__travel="0.3 mm"))["corner_force_max"]
    assert half_way == pytest.approx(at(cam(), 0.0003).force[0], rel=1e-6)


def test_a_finished_cam_states_the_theory_of_the_parts_that_it_was_cut_for():
    other = fixed(cam(), brace_length="210 mm")
    assert values(other)["theoretical_force"] == pytest.approx(4 * 1365 * 9.058e-3)
    assert values(other)["roller_radius_max"] == pytest.approx(10.32836569 * MM)


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
def test_the_pressure_is_hertzs_for_the_flank_with_its_offset(offset):
    contact = {"width": "10 mm", "material": "steel-s235"}
    result = analyze(fixed(cam(contact=contact, **FITS), profile__offset=offset * MM))
    states, force = result.state.states, result.state.up.contact
    path_radius = result.state.assembly.profile.path.law.curvature_radius(states.parameter)
    curvature = 1 / (10 * MM) + 1 / (path_radius - 10 * MM + offset * MM)
    solid = material("steel-s235")
    modulus = solid.youngs_modulus / 2 / (1 - solid.poisson_ratio**2)
    expected = np.sqrt(force * modulus * curvature / (np.pi * 10 * MM))
    flank = ~states.on_corner
    pressed = result.state.contact_pressure(result.state.up)
    np.testing.assert_allclose(pressed[flank], expected[flank], rtol=1e-12)
    assert np.isnan(pressed[~flank]).all()
    largest = values(result.spec)["contact_pressure_max"]
    if flank.all():
        assert largest == pytest.approx(expected.max())
    else:  # it is largest where the roller leaves the corner, between two points
        assert largest > expected[flank].max()
        closer = values(result.spec.replace({"analysis.points": 20_001}))["contact_pressure_max"]
        assert largest == pytest.approx(closer, rel=1e-12)

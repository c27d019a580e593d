"""The prototype in motion: two formulations that agree, balances that close, limits, symmetry, failure modes."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, replace

import numpy as np
import pytest
from cam_motion import moving, response
from cam_support import analyze, cam, names
from plot_support import picture

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families.cam.dynamics.axis_springs import AxisSprings
from cfmkit.families.cam.dynamics.force_of_given_motion import inverse_history, multibody_history
from cfmkit.families.cam.dynamics.inverse import respond, statics
from cfmkit.families.cam.dynamics.machine_from_spec import build
from cfmkit.families.cam.dynamics.nine_coordinate_multibody import CornerContact, NineCoordinates, Scheme
from cfmkit.families.cam.mechanism_from_spec import assemble
from cfmkit.families.cam.statics import forces
from cfmkit.metrics import Window, evaluate
from cfmkit.results import Status

UNLIKE = {
    "left": {
        "brace_length": "190 mm",
        "profile": {"force_constant": "10 mm", "friction": 0.003, "stroke": "200 mm"},
        "masses": {"roller": "0.5 kg", "brace": "0.1 kg", "roller_inertia": "30 kg*mm^2"},
    },
    "errors": {"slider_deviation": "1.5 deg", "flank_angle": "-0.3 deg"},
    "analysis__dynamics": {"slider_position": "235 mm", "stroke": "80 mm", "time": "0.15 s", "origin": "cam-start"},
}
CASES = {
    "prototype": {},
    "slow": {"analysis__dynamics__time": "10 s"},
    "downwards": {"analysis__dynamics__slider_position": "320 mm", "analysis__dynamics__stroke": "-100 mm"},
    "deviating": {"errors__slider_deviation": "5 deg", "analysis__dynamics__slider_position": "212 mm"},
    "badly cut": {"errors__flank_angle": "-0.4 deg"},
    "material left": {"profile__offset": "0.2 mm"},
    "cut for friction": {"profile__friction": 0.004},
    "unlike sides": UNLIKE,
}


def both(changes, points=101, scheme=None):
    parts = build(moving(**changes))
    path = NineCoordinates(parts.machine).run(parts.motion, points, scheme)
    return path, respond(parts.machine, parts.motion.evaluate(path.times))


def relative(a, b):
    return float(np.abs(a - b).max() / np.abs(b).max())


@pytest.mark.parametrize("changes", CASES.values(), ids=CASES)
def test_the_two_formulations_agree_in_every_force_and_speed(changes):
    parts = build(moving(**changes))
    scheme = Scheme(steps=8)
    exact = inverse_history(parts.machine, parts.motion, parts.motion.times(101))
    other = multibody_history(parts.machine, parts.motion, 101, scheme)
    for name in ("force", "contact", "spin", "brace", "pin", "elongation", "center"):
        assert relative(getattr(other, name), getattr(exact, name)) < 1e-9, name
    assert np.abs(other.traction - exact.traction).max() < 1e-9 * exact.contact.max()
    if "left" in changes:
        assert relative(exact.contact[1], exact.contact[0]) > 0.1


@dataclass(frozen=True)
class DampedSprings(AxisSprings):
    """Springs with a damper beside them [N s/m]."""

    damping: float = 30.0

    def force(self, gap):
        along = gap.vector / np.abs(gap.vector)
        return super().force(gap) - self.damping * (gap.velocity * along.conj()).real * along


@pytest.mark.parametrize("changes", [{}, UNLIKE], ids=["prototype", "unlike sides"])
def test_a_damper_between_the_axes_takes_its_power_from_the_slider_in_both_formulations(changes):
    parts = build(moving(**changes))
    damped = replace(parts.machine, springs=DampedSprings(**asdict(parts.machine.springs)))
    times = parts.motion.times(101)
    response, without = (respond(machine, parts.motion.evaluate(times)) for machine in (damped, parts.machine))
    other = multibody_history(damped, parts.motion, 101, Scheme(steps=8))
    assert relative(other.force, response.force) < 1e-9
    assert relative(other.contact, response.contact) < 1e-9
    lengthening = (response.axis_distance[2:] - response.axis_distance[:-2]) / (times[2:] - times[:-2])
    power = (response.force - without.force) * response.slider.speed
    np.testing.assert_allclose(power[1:-1], 30.0 * lengthening**2, rtol=0, atol=2e-3 * power.max())


def test_the_integration_converges_with_the_fourth_order():
    errors = []
    for steps in (1, 2, 4):
        path, exact = both({}, 51, Scheme(steps))
        errors.append(np.abs(path.force - exact.force).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.3)


def test_without_stabilisation_the_constraints_drift_no_further_than_the_step_allows():
    path, exact = both({"analysis__dynamics__time": "10 s"}, 101, Scheme(steps=4, stabilisation=0.0))
    assert path.residual < 1e-11
    assert relative(path.force, exact.force) < 1e-9


@pytest.mark.parametrize("changes", [{}, UNLIKE], ids=["prototype", "unlike sides"])
def test_jacobian_and_second_time_derivative_of_the_constraints_match_differences(changes):
    parts = build(moving(**changes))
    model = NineCoordinates(parts.machine)
    path = model.run(parts.motion, 5)
    x, guess = path.coordinates[2], [p.flank.parameter[2] for p in path.postures]

    def difference(function, direction):
        ends = [function(x + sign * 1e-6 * direction, guess) for sign in (1, -1)]
        return (ends[0] - ends[1]) / 2e-6

    jacobian = model.jacobian(model.postures(x, guess))
    for column, direction in enumerate(np.eye(9)):
        expected = difference(lambda at, near: model.residual(at, model.postures(at, near)), direction)
        np.testing.assert_allclose(jacobian[:6, column], expected[:6], rtol=0, atol=1e-8)
    velocity = np.array([1.3, -2.0, 40.0, -35.0, 1.1, 2.5, 30.0, -44.0, 0.9])
    expected = difference(lambda at, near: model.jacobian(model.postures(at, near)) @ velocity, velocity)
    found = model.quadratic(model.postures(x, guess), velocity)
    np.testing.assert_allclose(found[:8], expected[:8], rtol=1e-7, atol=1e-5)


@pytest.mark.parametrize("changes", CASES.values(), ids=CASES)
def test_the_force_does_the_work_that_becomes_energy(changes):
    """Between any two times; Gauss-Legendre panels integrate the power to rounding."""
    parts = build(moving(**changes))
    edges = parts.motion.times(41)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(edges)
    found = respond(
        parts.machine, parts.motion.evaluate((0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * nodes).ravel())
    )
    power = (found.force * found.slider.speed).reshape(-1, 8)
    energy = respond(parts.machine, parts.motion.evaluate(edges)).energy
    np.testing.assert_allclose(np.diff(energy), (power @ weights) * half, rtol=0, atol=1e-9 * np.ptp(energy))


@pytest.mark.parametrize("upward", [True, False], ids=["up", "down"])
@pytest.mark.parametrize("changes", [{}, {"profile__friction": 0.004}, {"profile__offset": 0.0003}])
def test_at_rest_with_rolling_resistance_it_is_the_quasi_static_model(upward, changes):
    spec = moving(rolling_friction=0.003, **changes)
    parts, assembly = build(spec), assemble(spec)
    position = np.linspace(assembly.track.start, assembly.track.end, 200)[1:-1]
    states = assembly.track.states(position)
    expected = forces(states, assembly.loads, 0.003 if upward else -0.003)
    found = statics(parts.machine, position, upward)
    np.testing.assert_allclose(found.at.center[0], states.x + 1j * states.y, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found.on_corner, states.on_corner)
    np.testing.assert_allclose(found.force, expected.slider, rtol=1e-9)
    np.testing.assert_allclose(found.contact[1], expected.contact, rtol=1e-9)


@pytest.mark.parametrize(("position", "stroke"), [("220 mm", "100 mm"), ("320 mm", "-100 mm")], ids=["up", "down"])
def test_the_force_of_a_slow_motion_is_that_at_rest_on_the_same_way(position, stroke):
    motion = {"analysis__dynamics__slider_position": position, "analysis__dynamics__stroke": stroke}
    curve = analyze(moving(rolling_friction=0.01, analysis__dynamics__time="1000 s", **motion)).curve
    np.testing.assert_allclose(curve.force, curve.extra["static_force"].values, rtol=1e-6)


def test_rolling_resistance_costs_the_power_of_force_times_speed_of_the_rollers():
    free, held = response(moving(), 101), response(moving(rolling_friction=0.002), 101)
    lost = 0.002 * (held.contact * held.at.arc_slope).sum(axis=0)
    np.testing.assert_allclose(held.force - free.force, lost, rtol=1e-9)


def test_sides_with_their_parts_exchanged_give_the_same_force():
    parts = build(moving(**UNLIKE))
    mirrored = replace(parts.machine, right=parts.machine.left, left=parts.machine.right)
    slider = parts.motion.evaluate(parts.motion.times(51))
    one, other = respond(parts.machine, slider), respond(mirrored, slider)
    np.testing.assert_allclose(other.force, one.force, rtol=1e-13)
    np.testing.assert_allclose(other.contact, one.contact[::-1], rtol=1e-13)
    np.testing.assert_allclose(other.guide, -one.guide, rtol=1e-9, atol=1e-12)


def test_a_left_side_that_repeats_the_right_one_changes_nothing():
    same = {"brace_length": "200 mm", "roller_radius": "16 mm", "masses": {"roller": "0.38 kg"}}
    np.testing.assert_allclose(response(moving(left=same), 51).force, response(moving(), 51).force, rtol=1e-13)


LIFTS_OFF = {"analysis__dynamics__time": "0.05 s", "masses__roller": "1 kg", "masses__roller_inertia": None}


def test_a_motion_ends_where_a_roller_leaves_the_cam_whatever_the_number_of_points():
    results = [analyze(moving(**LIFTS_OFF, analysis__dynamics__points=points)) for points in (31, 201, 3001)]
    for result in results:
        assert result.status is Status.PARTIAL
        assert names(result)[0] == "lift_off"
        assert "a roller leaves the cam at" in result.message
        contact = result.curve.extra["contact_force_right"].values
        assert (contact > 0).all()
        assert contact[-1] < 1e-9 * contact.max()
    last = [result.curve.displacement[-1] for result in results]
    np.testing.assert_allclose(last, last[0], rtol=1e-12)
    found = {item.name: item.message for item in results[1].warnings}
    assert " s (" in found["slack_cable"]
    measured = evaluate(results[1], ["force_max"], Window(0.04, 0.12))["force_max"].value
    inside = results[1].curve.displacement >= 0.04
    assert measured == pytest.approx(results[1].curve.force[inside].max(), rel=1e-2)


def test_the_nine_coordinates_end_at_the_same_place():
    direct, other = (
        analyze(moving(**LIFTS_OFF, analysis__dynamics__method=method)) for method in ("inverse", "multibody")
    )
    assert other.status is Status.PARTIAL
    assert len(other.curve) == len(direct.curve) - 1
    np.testing.assert_allclose(other.curve.force, direct.curve.force[:-1], rtol=1e-6)


def test_a_motion_down_ends_where_the_springs_go_slack():
    down = {"analysis__dynamics__slider_position": "300 mm", "analysis__dynamics__stroke": "-100 mm"}
    part = {"profile__rest_half_width": "68 mm", "rest_half_width": "90 mm"}
    result = analyze(moving(**down, **part, analysis__dynamics__time="10 s"))
    assert result.status is Status.PARTIAL
    assert names(result)[0] in ("spring_slack", "lift_off")
    assert result.curve.extra["spring_elongation"].values.min() >= 0
    assert result.curve.extra["spring_elongation"].values[-1] == pytest.approx(0, abs=1e-9)


def test_a_motion_that_starts_with_overlapping_rollers_is_refused_and_one_that_ends_so_is_partial():
    low = {"rest_half_width": "12 mm", "profile__roller_radius": "5 mm", "roller_radius": "16 mm"}
    low |= {"analysis__dynamics__time": "10 s"}
    start, _ = build(moving(**low)).machine.span

    def moved(position, stroke):
        return analyze(moving(**low, analysis__dynamics__slider_position=position, analysis__dynamics__stroke=stroke))

    up, down = moved(start + 1e-5, 0.05), moved(start + 0.05, -0.05 + 1e-5)
    assert up.status is Status.NO_EQUILIBRIUM
    assert names(up) == ["rollers_collide"]
    assert down.status is Status.PARTIAL
    assert names(down)[0] == "rollers_collide"
    x = down.state.history.center.real
    assert x[:, -1] == pytest.approx([16e-3, 16e-3], abs=1e-9)


def test_a_motion_that_leaves_the_profile_is_partial():
    result = analyze(moving(analysis__dynamics__slider_position="360 mm"))
    assert result.status is Status.PARTIAL
    assert names(result)[0] == "outside_profile"
    assert result.curve.displacement[-1] <= 0.240
    assert len(result.curve) < 201


def test_the_nine_coordinates_go_as_far_as_the_profile_does():
    high = {"analysis__dynamics__slider_position": "360 mm"}
    one, other = (analyze(moving(**high, analysis__dynamics__method=name)) for name in ("inverse", "multibody"))
    assert other.status is Status.PARTIAL
    assert names(other)[0] == "outside_profile"
    np.testing.assert_array_equal(other.curve.displacement, one.curve.displacement)
    # next to the profile's end they differ by what Runge-Kutta's method leaves
    np.testing.assert_allclose(other.curve.force, one.curve.force, rtol=1e-6)


@pytest.mark.parametrize("method", ["inverse", "multibody"])
def test_a_motion_that_starts_outside_the_profile_has_no_first_pose(method):
    """Where it would come in the force is unbounded: the curve began with what was left of a division by nothing."""
    down = {"slider_position": "480 mm", "stroke": "-150 mm", "method": method}
    result = analyze(moving(**{f"analysis__dynamics__{name}": value for name, value in down.items()}))
    assert result.status is Status.NO_EQUILIBRIUM
    assert "from 330 mm to 480 mm" in result.message


def test_on_the_corner_the_closed_method_works_and_the_other_says_why_not():
    low = {"analysis__dynamics__slider_position": "188.2 mm", "analysis__dynamics__stroke": "20 mm"}
    direct = analyze(moving(**low))
    assert direct.status is Status.COMPLETE
    assert "undercut" in names(direct)
    assert set(direct.curve.extra["contact"].values) == {"corner", "flank"}
    other = analyze(moving(**low, analysis__dynamics__method="multibody"))
    assert other.status is Status.NO_EQUILIBRIUM
    assert "189.2 mm" in other.message
    parts = build(moving(**low))
    with pytest.raises(CornerContact):
        NineCoordinates(parts.machine).run(parts.motion, 11)


def test_the_method_is_a_value_of_the_specification():
    direct, other = (analyze(moving(analysis__dynamics__method=name)) for name in ("inverse", "multibody"))
    np.testing.assert_allclose(other.curve.force, direct.curve.force, rtol=1e-9)
    for name, column in direct.curve.extra.items():
        if column.dimension != "text":
            values = other.curve.extra[name].values
            scale = direct.curve.extra["contact_force_right"].values if "traction" in name else column.values
            assert np.abs(values - column.values).max() <= 1e-9 * np.abs(scale).max(), name


def test_the_multibody_method_says_that_it_leaves_rolling_resistance_out():
    result = analyze(moving(rolling_friction=0.002, analysis__dynamics__method="multibody"))
    smooth = analyze(moving())
    assert "friction_left_out" in names(result)
    np.testing.assert_allclose(result.curve.force, smooth.curve.force, rtol=1e-9)
    for name in ("force_peak_over_slow", "force_peak_over_static"):  # compared with forces without friction, too
        assert result.values[name].value == pytest.approx(smooth.values[name].value, rel=1e-9), name


def test_the_quasi_static_model_says_that_it_is_symmetric():
    assert "symmetric_model" in names(analyze(cam(errors__slider_deviation="1 deg")))
    accepted = {"analysis__fidelity": "quasi-static"}
    assert "symmetric_model" in names(analyze(cam(left__roller_radius="15 mm", **accepted)))
    assert "symmetric_model" not in names(analyze(cam(errors__slider_deviation="0 deg")))


@pytest.mark.parametrize(
    "change",
    [
        {"left__roller_radius": "15 mm"},
        {"left__brace_length": "190 mm"},
        {"left__profile": {"force_constant": "11 mm"}},
    ],
)
def test_the_force_of_unlike_sides_is_not_stated_as_that_of_two_right_ones(change):
    with pytest.raises(SpecError, match=r"mechanism\.left: the quasi-static model is symmetric"):
        analyze(cam(**change))


def test_displacements_of_both_models_are_the_same():
    dynamic = analyze(moving(analysis__dynamics__time="100 s"))
    static = analyze(moving(analysis__fidelity="quasi-static", analysis__points=2001)).curve.select_branch("load")
    there = np.interp(dynamic.curve.displacement, static.displacement, static.force)
    np.testing.assert_allclose(dynamic.curve.force, there, rtol=2e-4)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"masses__roller_inertia": 0.24 * 0.38 * 0.016**2 / 2}, True),
        ({"masses__roller_inertia": 0.26 * 0.38 * 0.016**2 / 2}, False),
        ({"masses__roller_inertia": 1.99 * 0.38 * 0.016**2 / 2}, False),
        ({"masses__roller_inertia": 2.01 * 0.38 * 0.016**2 / 2}, True),
        ({"masses__roller_inertia": None}, False),
        ({"masses__roller_inertia": None, "masses__brace_inertia": 1e-3}, True),
        ({"masses__roller_inertia": None, "left": {"masses": {"roller_inertia": 1e-6}}}, True),
    ],
)
def test_moments_of_inertia_are_compared_with_mass_and_size(changes, found):
    assert ("inertia_mismatch" in names(analyze(moving(**changes)))) is found


def test_rollers_roll_without_slip():
    """Their turn is the length of the centre's path over the radius."""
    found = response(moving(), 20001)
    length = np.abs(np.diff(found.at.center[0])).sum()
    assert np.trapezoid(found.spin[0], np.linspace(0.0, 0.125, 20001)) * 0.016 == pytest.approx(length, rel=1e-7)


def test_the_curve_says_everything_over_time():
    curve = analyze(moving()).curve
    assert curve.branches == ("load",)
    dimensions = {name: column.dimension for name, column in curve.extra.items()}
    assert dimensions["time"] == "time"
    assert dimensions["roller_speed_left"] == "angular_velocity"
    assert curve.extra["time"].values[-1] == pytest.approx(0.125)
    for name in ("contact_force", "traction", "brace_force", "slider_pin_force", "roller_speed"):
        assert {f"{name}_right", f"{name}_left"} <= set(dimensions)
    slow = response(moving(analysis__dynamics__time="1 s"), len(curve)).force
    np.testing.assert_allclose(curve.extra["force_over_slow"].values, curve.force / slow, rtol=1e-12)
    down = analyze(moving(analysis__dynamics__slider_position=0.32, analysis__dynamics__stroke=-0.1)).curve
    assert down.branches == ("unload",)
    np.testing.assert_allclose(down.displacement, 2 * 0.22 + 0.1 - 2 * brace_height() - curve.displacement, atol=1e-12)


def brace_height():
    return np.sqrt(0.2**2 - 0.068**2)


def test_what_was_used_is_written_out():
    used = analyze(moving(masses__roller_inertia=None, masses__brace_inertia=None)).spec
    assert used.analysis.fidelity == "dynamic"
    assert used.mechanism.masses.roller_inertia == pytest.approx(0.38 * 0.016**2 / 2, rel=1e-15)
    assert used.mechanism.masses.brace_inertia == pytest.approx(0.077 * 0.2**2 / 12, rel=1e-15)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"analysis__dynamics__stroke": 0.0}, "must not be 0"),
        ({"analysis__dynamics": None, "analysis__fidelity": "dynamic"}, "add 'analysis.dynamics'"),
        ({"masses": None, "analysis__gravity": False}, "add 'mechanism.masses'"),
        ({"errors__flank_angle": "50 deg"}, "<= 45 deg"),
    ],
)
def test_a_motion_that_cannot_be_is_refused_with_the_cure(changes, said):
    with pytest.raises(SpecError, match=re.escape(said)):
        moving(**changes)


def test_friction_that_holds_a_roller_leaves_gaps_and_says_so():
    """Without a corner the slider has no leverage on the rollers at the start; friction holds them a little longer."""
    low = {"slider_position": brace_height() + 1e-6, "stroke": "1 mm", "time": "10 s"}
    result = analyze(
        moving(profile__roller_radius="10 mm", roller_radius="10 mm", rolling_friction=0.05, analysis__dynamics=low)
    )
    assert result.status is Status.PARTIAL
    assert "up_jam" in names(result)
    held = np.isnan(result.curve.force)
    assert held[0]
    assert not held[-1]
    assert np.nanmax(result.curve.displacement[held]) == pytest.approx(0.0151e-3, abs=0.002e-3)


@pytest.mark.parametrize("changes", [{}, UNLIKE], ids=["prototype", "unlike sides"])
def test_every_picture_is_drawn_twice_with_the_same_bytes(changes):
    result = analyze(moving(**changes))

    def drawn():
        return {name: picture(draw()) for name, draw in cfmkit.figures(result).items()}

    assert set(drawn()) == {"motion", "motion_force", "motion_contact", "motion_rollers"}
    assert drawn() == drawn()


def test_the_old_word_for_inverse_dynamics_is_refused_with_those_of_today():
    with pytest.raises(SpecError, match="'direct' is not one of inverse, multibody"):
        moving(analysis__dynamics__method="direct")

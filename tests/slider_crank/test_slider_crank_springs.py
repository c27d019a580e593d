"""Identities, limits and symmetries of the slider-crank with springs, and its design."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from slider_crank import DEG, LI, START, config

import cfmkit
from cfmkit import api
from cfmkit.families.slider_crank.linkage import Linkage
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal, choose_preferred, minimax, ranges
from cfmkit.families.slider_crank.springs.sprung_linkage import assemble, reactions
from cfmkit.families.slider_crank.unit_springs import (
    JOINT_NAMES,
    crank_efforts,
    curves_along_crank,
    curves_along_slider,
)

rng = np.random.default_rng(20)


def mechanisms(count):
    """Yield linkages of both branches with an unloaded angle and a crank angle that they reach."""
    made = 0
    while made < count:
        r1, r2 = rng.uniform(0.3, 3.0, 2)
        link = Linkage(r1, r2, rng.uniform(-0.9, 0.9) * (r1 + r2), int(rng.choice([-1, 1])))
        start, place = rng.uniform(-math.pi, math.pi, 2)
        low, high = link.arc(start) if link.reaches(start) else (0.0, 0.0)
        room = 0.05 * min(high - low, 2 * math.pi)
        if high - low < 0.3 or not low + room < start < high - room or not low + room < place < high - room:
            continue
        made += 1
        yield link, start, place


@pytest.mark.parametrize(("link", "start", "place"), list(mechanisms(40)))
def test_effort_and_stiffness_are_derivatives_of_the_energy(link, start, place):
    """Central differences over 1e-4 rad of q^2/2 of each joint."""
    step = 1e-4
    before, here, after = (curves_along_crank(link, start, np.array([place + k * step])) for k in (-1, 0, 1))
    scale = np.array([1.0, 1.0, 1.0, (link.crank + link.coupler) ** 2])[:, None]
    pairs = (
        ((after.turn**2 - before.turn**2) / (4 * step), here.effort),
        ((after.effort - before.effort) / (2 * step), here.stiffness),
    )
    for difference, exact in pairs:
        np.testing.assert_allclose(difference / scale, exact / scale, rtol=2e-4, atol=2e-4)
    np.testing.assert_array_equal(crank_efforts(link, start, np.array([place])), here.effort)


@pytest.mark.parametrize(("link", "start", "place"), list(mechanisms(40)))
def test_a_linkage_and_its_mirror_image_have_the_same_springs(link, start, place):
    one = curves_along_crank(link, start, np.array([place]))
    other = curves_along_crank(link.mirror(), math.pi - start, np.array([math.pi - place]))
    np.testing.assert_allclose(other.effort, -one.effort, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.stiffness, one.stiffness, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(("link", "start", "_place"), list(mechanisms(25)))
def test_the_force_is_the_torque_over_the_velocity_ratio(link, start, _place):
    """Both drives of one mechanism, on either side of the stretched position, at the same places."""
    way = link.branch * float(link.slider_position(np.array(start)))
    low, high = link.find_path_ends(start)
    reach = way - high, way - low
    travel = reach[0] + (reach[1] - reach[0]) * np.array([0.2, 0.5, 0.8])
    for side in (1, -1):
        force = curves_along_slider(link, start, side, travel)
        torque = curves_along_crank(link, start, force.angle)
        # beyond a dead point of the coupler the same place belongs to the other branch
        same = np.abs(torque.position - force.position) < 1e-9 * (link.crank + link.coupler)
        step = 1e-6
        ahead, behind = (curves_along_crank(link, start, force.angle + sign * step).position for sign in (1, -1))
        speed = (ahead - behind) / (2 * step)
        wanted = -link.branch * torque.effort / speed
        for row in (0, 3):
            turns = np.abs(torque.turn[0] - force.turn[0]) < 1e-6
            good = same & (turns if row == 0 else True) & (np.abs(speed) > 1e-3)
            np.testing.assert_allclose(force.effort[row][good], wanted[row][good], rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("unloaded", [0.542, 0.45, math.atan(0.6)])
def test_stiffness_of_a_force_is_its_derivative(side, unloaded):
    link = Linkage(54.0, math.hypot(100, 60) - 54.0, 60.0)
    travel, step = np.array([0.5, 5.0, 30.0, 60.0]), 1e-4
    before, here, after = (curves_along_slider(link, unloaded, side, travel + k * step) for k in (-1, 0, 1))
    np.testing.assert_allclose((after.effort - before.effort) / (2 * step), here.stiffness, rtol=1e-5, atol=1e-9)
    energy = (after.turn**2 - before.turn**2) / (4 * step)
    np.testing.assert_allclose(energy, here.effort, rtol=1e-6, atol=1e-9)


def test_small_rotations_keep_their_digits():
    """One nanoradian from the unloaded position the torque still has 12 digits."""
    torque = curves_along_crank(LI, START, np.array([START + 1e-9])).effort[:, 0]
    slope = curves_along_crank(LI, START, np.array([START])).stiffness[:, 0]
    np.testing.assert_allclose(torque, slope * ((START + 1e-9) - START), rtol=1e-7)


def test_the_force_at_the_stretched_start_is_continuous():
    link = Linkage(54.0, math.hypot(100, 60) - 54.0, 60.0)
    force = curves_along_slider(link, link.stretched_angle, 1, np.array([0.0, 1e-14, 1e-12, 1e-10])).effort[:3]
    np.testing.assert_allclose(force[:, 1:], np.repeat(force[:, :1], 3, axis=1), rtol=3e-5)


@pytest.mark.parametrize(
    ("lengths", "arcs"),
    [
        ((50, 30, 10), [(-23.57818, 53.13010), (126.86990, 203.57818)]),
        ((30, 30, 10), [(-41.81031, 221.81031)]),
    ],
)
def test_arcs_of_linkages_that_cannot_turn(lengths, arcs):
    link = Linkage(*map(float, lengths))
    for low, high in arcs:
        found = link.arc(0.5 * (low + high) * DEG)
        assert [end / DEG for end in found] == [pytest.approx(low, abs=5e-6), pytest.approx(high, abs=5e-6)]
    assert not link.turns_fully
    assert Linkage(30.0, 50.0, 10.0).turns_fully


def test_forces_inside_balance_the_crank():
    """Moments about the pivot: torque, its spring, the crank pin's spring and the coupler's force add up to zero."""
    spec = config("li2019", mechanism__springs={"pivot": 2.0, "crank_pin": 3.0, "slider_pin": 4.0, "slider": 500.0})
    assembly = assemble(spec)
    units = assembly.units(np.radians([-4.0, 1.0, 10.0, 60.0]))
    coupler, guide = reactions(assembly, units, np.zeros(4))
    beta = assembly.linkage.coupler_angle(units.angle)
    along = -assembly.rates[3] * units.turn[3]
    pull = np.stack([along, -guide])  # of the slider on the coupler, so of the coupler on the crank
    lever = assembly.linkage.crank * (np.cos(units.angle) * pull[1] - np.sin(units.angle) * pull[0])
    springs = -assembly.rates[0] * units.turn[0] + assembly.rates[1] * units.turn[1]
    np.testing.assert_allclose(assembly.rates @ units.effort + springs + lever, 0.0, atol=1e-12)
    np.testing.assert_allclose(coupler, pull[0] * np.cos(beta) + pull[1] * np.sin(beta), atol=1e-12)


def test_both_branches_through_the_specification():
    right = cfmkit.analyze(config("li2019"))
    left = cfmkit.analyze(
        config(
            "li2019",
            mechanism__branch="left",
            mechanism__unloaded_angle="185 deg",
            analysis__angle=("166 deg", "185 deg"),
        )
    )
    np.testing.assert_allclose(left.curve.torque[::-1], -right.curve.torque, atol=1e-15)
    assert left.values["stiffness_class"] == right.values["stiffness_class"]
    assert left.values["constant_angle"].value == pytest.approx(right.values["constant_angle"].value, rel=1e-9)


def test_legs_in_parallel_add_up():
    one, three = cfmkit.analyze(config("li2019")), cfmkit.analyze(config("li2019", mechanism__legs=3))
    np.testing.assert_allclose(three.curve.torque, 3 * one.curve.torque, rtol=1e-12)
    np.testing.assert_allclose(
        three.curve.extra["coupler_force"].values, one.curve.extra["coupler_force"].values, rtol=1e-9, atol=1e-15
    )


def test_the_shares_of_the_springs_add_up_to_the_torque():
    curve = cfmkit.analyze(config("li2019_prototype")).curve
    shares = sum(curve.extra[f"torque_{name}"].values for name in ("pivot", "crank_pin", "slider_pin", "slider"))
    np.testing.assert_allclose(shares, curve.torque, rtol=1e-12)


def test_rates_per_degree_and_per_radian_are_told_apart():
    degree = config("li2019", mechanism__springs__slider_pin="1 N*mm/deg").mechanism.springs.slider_pin
    radian = config("li2019", mechanism__springs__slider_pin="1 N*mm/rad").mechanism.springs.slider_pin
    assert degree / radian == pytest.approx(180 / math.pi)
    with pytest.raises(cfmkit.SpecError, match=r"N\*mm/rad"):
        config("li2019", mechanism__springs__slider_pin="1 N*mm")


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"mechanism__springs__slider": "-1 N/mm"}, "must be >= 0"),
        ({"mechanism__stretched_position": "500 mm"}, "either 'coupler_length' or 'stretched_position'"),
        ({"mechanism__unloaded_offset": "1 deg"}, "either 'unloaded_angle' or 'unloaded_offset'"),
        ({"analysis__angle": ("5 deg", "-5 deg")}, "'angle' must be increasing"),
        ({"design": {"tolerance": "1 %"}}, "state 'torque' or 'force', which is kept constant, or 'target'"),
        ({"design": {"torque": "1 N*mm"}}, "give a window"),
        ({"design": {"force": "1 N", "angle": ("0 deg", "1 deg")}}, "belong to 'torque'"),
        ({"design": {"torque": "1 N*mm", "tolerance": "1 %", "hold_stiffness": True}}, "needs the 'stiffness'"),
        (
            {"design": {"torque": "1 N*mm", "tolerance": "1 %", "unloaded_offset": ("-1 deg", "1 deg")}},
            "must have one sign",
        ),
    ],
)
def test_contradictions_are_refused(changes, reported):
    with pytest.raises(cfmkit.SpecError, match=reported):
        config("li2019", **changes)


FINDINGS = {
    "not_assemblable": ("li2019", {"mechanism__offset": "700 mm"}),
    "coupler_dead_point": ("li2019", {"mechanism__coupler_length": "50 mm", "analysis__angle": ("-5 deg", "90 deg")}),
    "no_full_turn": ("li2019", {"mechanism__coupler_length": "120 mm", "analysis__angle": ("-5 deg", "355 deg")}),
    "out_of_reach": ("bilancia2019", {"analysis__travel": ("0 mm", "210 mm")}),
    "no_spring": ("li2019", {"mechanism__springs": {}}),
    "spring_winds_up": (
        "li2019_full_turn",
        {"mechanism__springs__pivot": "1 N*mm/rad"},
    ),
    "quartic_minimum": (
        "li2019_from_singularity",
        {"mechanism__springs": {"slider": "1 N/cm"}, "analysis__angle": ("0 deg", "40 deg")},
    ),
    "second_stable_outside": ("li2019_bistable", {"analysis__angle": ("-5 deg", "9 deg")}),
    "class_boundary": (
        "li2019",
        {"mechanism__springs": {"slider_pin": "0.1489334776 N*cm/deg", "slider": "1 N/cm"}},
    ),
    "same_position_twice": ("li2019_full_turn", {}),
    "reference_zero": ("li2019_bistable", {}),
    "reference_outside": ("li2019", {"analysis__reference_angle": "40 deg"}),
    "stretched_outside_window": ("li2019", {"analysis__window": ("4 deg", "6 deg")}),
    "force_unbounded": (
        "bilancia2019",
        {"mechanism__unloaded_angle": "40 deg", "analysis__travel": ("-3 mm", "30 mm"), "analysis__window": None},
    ),
    "stretched_start": ("bilancia2019", {"mechanism__unloaded_angle": None, "mechanism__unloaded_offset": 0.0}),
    "two_positions": ("bilancia2019", {"mechanism__unloaded_angle": None, "mechanism__unloaded_offset": 0.0}),
    "run_in": ("bilancia2019", {}),
    "effort_changes_sign": ("li2019_bistable", {"analysis__window": ("0 deg", "10 deg")}),
    "joint_overrotated": ("li2019", {"mechanism__limits": {"crank_pin": "20 deg"}}),
}
"""What gives each finding of an analysis."""


@pytest.mark.parametrize("name", FINDINGS)
def test_what_is_wrong_is_told_by_name(name):
    base, changes = FINDINGS[name]
    changed = cfmkit.analyze(config(base, **changes))
    found = {item.name: item.message for item in changed.warnings}
    assert name in found
    assert len(found[name]) > 40
    if changes:
        assert name not in {item.name for item in cfmkit.analyze(config("li2019")).warnings}


@pytest.mark.parametrize(("name", "end", "low", "high"), [
    ("coupler_dead_point", "last", "-5 deg", "90 deg"), ("coupler_dead_point", "first", "-90 deg", "5 deg"),
    ("out_of_reach", "last", "10 mm", "210 mm"), ("out_of_reach", "first", "-120 mm", "30 mm"),
])  # fmt: skip
def test_a_motion_beyond_one_end_is_followed_up_to_there_and_to_its_other_end(name, end, low, high):
    if name == "out_of_reach":
        spec = config("bilancia2019", analysis__travel=(low, high), analysis__window=None)
        requested = spec.analysis.travel
    else:
        spec = config("li2019", mechanism__coupler_length="50 mm", analysis__angle=(low, high))
        requested = spec.analysis.angle
    result = cfmkit.analyze(spec)
    assert name in {item.name for item in result.warnings}
    first, last = result.curve.motion[[0, -1]]
    assert (first > requested[0], last < requested[1]) == (end == "first", end == "last")


DESIGNS = {
    "infeasible_targets": {"torque": "2 N*mm", "angle": ("0 deg", "8 deg"), "tolerance": "0.5 %"},
    "no_zero_stiffness": {
        "torque": "2 N*mm", "angle": ("0 deg", "5 deg"), "stiffness": 0.0, "hold_stiffness": True,
        "springs": ("pivot", "crank_pin", "slider_pin"),
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "start"),
    [("infeasible_targets", "-5 deg"), ("no_zero_stiffness", "-5 deg"), ("no_zero_stiffness", "3 deg")],
)
def test_a_design_that_does_not_exist_says_why(name, start):
    """Of springs that are relaxed beyond the stretched position all have positive slopes."""
    design = DESIGNS[name] | ({"angle": ("4 deg", "6 deg"), "springs": JOINT_NAMES} if start == "3 deg" else {})
    found = cfmkit.design(config("li2019", design=design, mechanism__unloaded_angle=start))
    assert found.spec is None
    assert found.status.key == "infeasible"
    assert [item.name for item in found.warnings] == [name]


def test_what_would_be_feasible_is_feasible():
    spec = config("li2019", design=DESIGNS["infeasible_targets"])
    nearest = cfmkit.design(spec).nearest_feasible
    allowed = float(nearest["design.tolerance"].removesuffix(" %")) * 1.001
    assert cfmkit.design(spec.replace({"design.tolerance": f"{allowed} %"})).spec is not None


def test_caps_on_rates_and_springs_that_are_not_needed_are_told():
    design = {"torque": "2 N*mm", "angle": ("0.866 deg", "4.866 deg"), "max_rates": {"slider": "0.1 N/mm"}}
    found = cfmkit.design(config("li2019", design=design))
    assert "design.max_rates.slider" in found.active_bounds
    names = {item.name for item in found.warnings}
    assert {"spring_at_bound", "spring_dropped"} <= names


def test_slack_lets_other_requests_decide():
    window = {"torque": "2 N*mm", "angle": ("0.866 deg", "4.866 deg")}
    best = cfmkit.design(config("li2019", design=window))
    even = cfmkit.design(config("li2019", design=window | {"slack": "0.05 %", "prefer": "even-rates"})).spec
    rates = [getattr(even.mechanism.springs, name) for name in ("pivot", "crank_pin", "slider_pin")]
    assert "near_optima" in {item.name for item in best.warnings}
    assert rates[0] == pytest.approx(rates[1], rel=1e-6) == pytest.approx(rates[2], rel=1e-6)
    soft = cfmkit.design(config("li2019", design=window | {"slack": "0.05 %", "prefer": "soft-springs"})).spec
    assert soft.mechanism.springs.slider < best.spec.mechanism.springs.slider


@pytest.mark.slow  # a search of lengths
def test_limits_of_the_joints_bound_the_window():
    design = {"torque": "2 N*mm", "tolerance": "0.5 %", "unloaded_offset": ("-48 deg", "-8 deg")}
    free = cfmkit.design(config("li2019", design=design, analysis__angle=None)).spec
    bound = cfmkit.design(
        config("li2019", design=design, mechanism__limits={"crank_pin": "25 deg"}, analysis__angle=None)
    ).spec
    widths = [cfmkit.analyze(spec).values["constant_angle"].value / DEG for spec in (free, bound)]
    assert free.mechanism.unloaded_offset == pytest.approx(-48 * DEG)
    assert -18 * DEG < bound.mechanism.unloaded_offset < -8 * DEG
    assert widths[0] > 29 > 11 > widths[1] > 6


def test_the_widest_force_window_is_found():
    design = {"force": "1.5 N", "tolerance": "0.1 %", "springs": ("pivot", "crank_pin", "slider_pin")}
    spec = config("bilancia2019", mechanism__unloaded_angle=None, mechanism__unloaded_offset=0.0, design=design)
    result = cfmkit.analyze(cfmkit.design(spec).spec.replace({"analysis.tolerance": 0.001}))
    assert result.values["constant_travel"].value > 0.035


def test_no_rates_do_better_than_the_linear_programme():
    """Random rates around the optimum, none negative, deviate more; and its residual alternates five times."""
    angle = np.linspace(1.0, 5.0, 301) * DEG
    goal = RateGoal(curves_along_crank(LI, START, angle).effort.T, np.ones(301), np.full(4, np.inf))
    best = minimax(goal)
    worst = goal.deviation(best)
    others = np.maximum(best * (1 + 0.05 * rng.normal(size=(2000, 4))) + 0.01 * rng.normal(size=(2000, 4)), 0.0)
    assert min(goal.deviation(rates) for rates in others) >= worst
    residual = goal.residual(best)
    touching = np.flatnonzero(np.abs(residual) > worst * (1 - 1e-6))
    turns = sum(residual[a] * residual[b] < 0 for a, b in pairwise(touching))
    assert turns >= (best > 0).sum()
    spans = ranges(goal.select_rows(range(0, 301, 5)), 1.1 * worst)
    assert (spans[:, 0] <= best + 1e-9).all()
    assert (spans[:, 1] >= best - 1e-9).all()
    assert goal.deviation(choose_preferred(goal, 1.2 * worst, "even-rates")) <= 1.2 * worst * (1 + 1e-9)


RATES = [f"mechanism.springs.{joint}" for joint in ("pivot", "crank_pin", "slider_pin")]


@pytest.mark.parametrize("name", ["li2019_prototype", "bilancia2019"])
def test_gradients_are_those_of_differences(name):
    spec = config(name)
    paths = [*RATES, "mechanism.springs.slider"]
    found = api.family("slider-crank").gradient(spec, [*paths, "mechanism.offset"])
    assert len(found) > 6
    for path in paths:
        rate = spec.get_value(path)
        step = 1e-4 * (rate or (1.0 if path.endswith("slider") else 1e-3))
        low = max(rate - step, 0.0)
        ends = [
            cfmkit.evaluate(cfmkit.analyze(spec.replace({path: value})), list(found)) for value in (low, rate + step)
        ]
        for metric, by_path in found.items():
            difference = (ends[1][metric].value - ends[0][metric].value) / (rate + step - low)
            assert by_path[path] == pytest.approx(difference, rel=2e-3, abs=1e-9), (metric, path)


@pytest.mark.parametrize("name", ["bought", "bilancia2019_optimum"])
def test_derivatives_of_extremes_are_those_at_their_places(name):
    gradient = api.family("slider-crank").gradient
    few, many = (gradient(config(name, f"analysis.points={count}"), RATES) for count in (11, 301))
    for metric in ("force_max", "force_min", "force_ripple", "half_band", "energy_max"):
        for path in RATES:
            assert few[metric][path] == pytest.approx(many[metric][path], rel=1e-9), (metric, path)


def test_a_point_that_is_the_end_of_a_window_but_for_rounding_counts_once_in_sweeps_too():
    spec = config("bilancia2019_optimum", "analysis.points=301")
    single = cfmkit.analyze(spec)
    assert np.abs(single.curve.motion - 0.35e-3).min() < 1e-18  # it is there, and not equal
    swept = cfmkit.sweep(spec, vary={RATES[0]: spec.get_value(RATES[0]) * np.array([1.0, 1.1])})
    for metric in ("force_mean", "force_max", "force_min"):
        assert swept.table[metric][0] == pytest.approx(single.metrics[metric].value, rel=1e-13), metric
    slopes = api.family("slider-crank").gradient(spec, RATES)["force_mean"]
    assert sum(slopes[path] * spec.get_value(path) for path in RATES) == pytest.approx(
        single.metrics["force_mean"].value, rel=1e-12
    )


def test_a_mechanism_without_a_curve_misses_requirements_in_degrees():
    found = cfmkit.analyze(config("li2019", mechanism__offset="700 mm"))
    assert found.status.exit_code == 4
    missed = next(outcome for outcome in found.requirements if not outcome.ok)
    assert missed.dimension == "angle"
    assert "no value" in missed.sentence


def test_whatever_the_linkage_the_curve_is_finite_or_a_finding_says_why():
    """Random lengths, offsets beyond reach, starts at and near the stretched position, both drives and branches."""
    from cfmkit.families.slider_crank.spec import SliderCrankSpec

    random = np.random.default_rng(7)
    for _ in range(80):
        crank, coupler = random.uniform(0.005, 0.1, 2).tolist()
        springs = {name: float(random.choice([0, 1]) * 10 ** random.uniform(-3, 1)) for name in ("pivot", "crank_pin")}
        mechanism = {
            "crank_length": crank,
            "coupler_length": coupler,
            "offset": float(random.uniform(-1.1, 1.1) * (crank + coupler)),
            "branch": str(random.choice(["right", "left"])),
            "springs": springs | {"slider": float(10 ** random.uniform(0, 4))},
            "unloaded_offset": float(random.choice([0.0, 1e-9, 1e-4, -1e-13, 0.01, -0.3, 0.5])),
        }
        low, start = float(random.uniform(-3, 3)), float(random.uniform(-0.05, 0.05))
        analysis = {
            "drive": str(random.choice(["torque", "force"])),
            "points": 20,
            "angle": (low, low + float(10 ** random.uniform(-4, 1))),
            "travel": (start, start + float(10 ** random.uniform(-6, -1))),
        }
        about = {"family": "slider-crank", "mechanism": mechanism, "analysis": analysis}
        result = cfmkit.analyze(SliderCrankSpec.model_validate(about))
        assert result.curves or result.warnings
        for curve in result.curves:
            assert np.isfinite(curve.effort).all()
            assert np.isfinite([item.value for item in result.values.values() if item.value is not None]).all()


EXTREMES = ("energy_max", "pivot_rotation_max", "crank_pin_rotation_max", "slider_pin_rotation_max",
            "slider_travel_max", "coupler_compression_max", "guide_force_max")  # fmt: skip


@pytest.mark.parametrize("name", ["bilancia2019", "li2019_bistable", "li2019_full_turn", "friction"])
def test_extremes_do_not_depend_on_the_points_of_the_curve(name):
    few, many = (cfmkit.analyze(config(name, analysis__points=points, requirements=())) for points in (31, 20001))
    assert {key: few.values[key].value for key in EXTREMES} == {key: many.values[key].value for key in EXTREMES}
    curve = many.curve.extra
    seen = {
        "energy_max": curve["energy"].values.max(),
        "coupler_compression_max": -curve["coupler_force"].values.min(),
        "guide_force_max": np.abs(curve["guide_force"].values).max(),
        "pivot_rotation_max": np.abs(curve["pivot_rotation"].values).max(),
    }
    for key, value in seen.items():
        assert value * (1 - 1e-12) <= few.values[key].value <= value * (1 + 1e-6), key


def test_the_ends_of_a_band_are_where_the_force_leaves_it():
    result = cfmkit.analyze(config("bilancia2019", analysis__points=41, analysis__tolerance=0.005))
    width = cfmkit.evaluate(result, ["band_range_05pct"])["band_range_05pct"].value
    effort = result.state.assembly.efforts
    level = effort(np.array([result.reference]))[0]
    low, high = (float(end[0]) for end in result.state.band)
    ends = np.array([place for place in (low, high) if 0.0 < place < 0.035])
    assert len(ends)
    assert np.abs(effort(ends) / level - 1) == pytest.approx([0.005] * len(ends), rel=1e-6)
    assert width == pytest.approx(high - low, rel=1e-7)


def test_no_band_is_told_around_a_reference_without_effort():
    """Whatever the rounding of the effort there: 1e-17 of the peak gave a band of 2e-9 deg beside `reference_zero`."""
    result = cfmkit.analyze(config("li2019_bistable"))
    zero = min(item.motion for item in result.state.equilibria if not item.stable)
    for reference in (result.reference, zero):
        again = cfmkit.analyze(config("li2019_bistable", analysis__reference_angle=reference + 1e-14))
        assert "reference_zero" in {item.name for item in again.warnings}
        for name in ("band_range_05pct", "band_range_1pct", "band_range_5pct"):
            item = cfmkit.evaluate(again, [name])[name]
            assert item.value is None
            assert "zero" in item.reason


def test_scalar_results_and_findings_are_computed_when_they_are_read():
    """Yields of hundreds of parts had computed every scalar result of each, which took nine tenths of the time."""
    result = api.family("slider-crank").analyze(config("bilancia2019", requirements=()), cfmkit.Run())
    assert cfmkit.evaluate(result, ["force_min"])["force_min"].value > 0
    assert not {"extremes", "stability_classes", "band"} & set(vars(result.state))
    assert result.values["energy_max"].value > 0
    assert "extremes" in vars(result.state)
    assert not {"stability_classes", "band"} & set(vars(result.state))
    assert {item.name for item in result.warnings} == {"run_in"}
    assert "stability_classes" in vars(result.state)

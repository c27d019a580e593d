"""Slider-cranks at the ends of what they can do: equal links, folded starts, many turns, windows elsewhere."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from slider_crank import DEG, config, force_of_energy

import cfmkit
from cfmkit.families.slider_crank.linkage import Linkage
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.figures import figures
from cfmkit.families.slider_crank.springs.rate_fit_task import task_of
from cfmkit.families.slider_crank.springs.sprung_linkage import assemble, reactions
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, curves_along_slider

EQUAL = {
    "mechanism": {
        "crank_length": "100 mm", "coupler_length": "100 mm", "unloaded_offset": 0.0,
        "springs": {"pivot": "10 N*mm/rad"},
    },
    "analysis": {"drive": "force", "side": "beyond"},
}  # fmt: skip


def test_equal_links_in_line_with_the_pivot_fold_there():
    """Both links turn by t with x = 2 r cos t, so the force is K t/(2 r sin t); the slider's way ends at the pivot."""
    result = cfmkit.analyze(config("li2019", **EQUAL))
    turned = np.arccos(1 - result.curve.displacement[1:] / 0.2)
    assert result.curve.force[0] == pytest.approx(0.01 / 0.2)
    assert result.curve.force[1:] == pytest.approx(0.01 * turned / (0.2 * np.sin(turned)), rel=1e-9)
    assert 0.199 < result.curve.displacement[-1] < 0.2
    assert result.values["stiffness_class"].word == "positive"
    beyond = cfmkit.analyze(config("li2019", **EQUAL, analysis__travel=("0 mm", "250 mm")))
    assert beyond.status.key == "partial"
    assert "out_of_reach" in {item.name for item in beyond.warnings}


def test_springs_relaxed_folded_can_only_be_pulled():
    folded = math.pi + math.asin(30 / 400)
    about = {"analysis": {"drive": "force"}, "mechanism__unloaded_angle": folded}
    result = cfmkit.analyze(config("li2019", **about))
    assert result.curve.displacement[-1] == 0.0
    assert result.curve.displacement[0] == pytest.approx(-200e-3, rel=0.01)
    assert (result.curve.force[:-1] < 0).all()


@pytest.mark.parametrize(("share", "kept"), [(2e-6, True), (5e-7, False)])
def test_a_motion_is_cut_short_only_where_it_comes_next_to_a_pole(share, kept):
    """By a thousandth of the way from the unloaded position; whichever end it is."""
    assembly = assemble(config("bilancia2019", mechanism__unloaded_angle=0.8))
    assert assembly.poles == (True, True)
    (first, last), way = assembly.reach, np.abs(np.array(assembly.reach) - assembly.start)
    asked = first + share * way[0], last - share * way[1]
    cut = first + 1e-3 * way[0], last - 1e-3 * way[1]
    assert assembly.clip_motion(*asked) == pytest.approx(asked if kept else cut, rel=1e-9)


def test_positions_are_the_same_after_each_turn():
    turns = config("li2019_full_turn", analysis__angle=(-5 * DEG, -5 * DEG + 6 * math.pi))
    result = cfmkit.analyze(turns)
    reported = {item.name: item.message for item in result.warnings}["same_position_twice"]
    assert result.values["stable_positions"].value == 7
    assert "has 2 different stable positions" in reported


def test_a_window_outside_the_motion_is_no_trouble():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = cfmkit.analyze(config("li2019", analysis__window=("60 deg", "70 deg")))
    assert "stretched_outside_window" in {item.name for item in result.warnings}


@pytest.mark.parametrize(("start", "side"), [(-30.0, "beyond"), (0.542 / DEG, "before")])
def test_on_the_other_side_the_springs_are_nowhere_relaxed(start, side):
    base = "li2019" if start < 0 else "bilancia2019"
    changes = {"mechanism__unloaded_angle": f"{start} deg", "analysis__travel": ("0 mm", "20 mm")}
    spec = config(base, **changes, analysis__drive="force", analysis__side=side, analysis__window=None)
    result = cfmkit.analyze(spec)
    assert abs(result.curve.force).min() > 0.05
    assert result.values["stable_positions"].value == 0
    assert "run_in" not in {item.name for item in result.warnings}
    if base == "bilancia2019":
        assert "force_unbounded" in {item.name for item in result.warnings}


@pytest.mark.parametrize("branch", ["right", "left"])
def test_an_unloaded_slider_past_the_pivots_foot_has_the_force_of_its_energy(branch):
    """Bilancia's lengths with the crank at 165 deg: the slider is 9.7 mm past the foot, and goes on from there."""
    angle = {"right": "165 deg", "left": "15 deg"}[branch]
    about = {"mechanism__branch": branch, "mechanism__unloaded_angle": angle, "analysis__window": None}
    result = cfmkit.analyze(config("bilancia2019", **about, analysis__travel=("0 mm", "10 mm")))
    assembly = result.state.assembly
    wanted = force_of_energy(
        assembly.linkage, assembly.unloaded, assembly.rates, assembly.side, result.curve.displacement
    )
    np.testing.assert_allclose(result.curve.force, wanted, rtol=1e-6, atol=1e-7)
    assert result.curve.force[-1] == pytest.approx(0.15839, abs=5e-6)


def test_forces_have_those_of_the_energy_whatever_the_lengths_and_the_side_of_the_foot():
    """Random lengths, branches, sides; slider past the foot in a quarter of them, crank past its dead point in some."""
    random, past = np.random.default_rng(11), 0
    for _ in range(150):
        r1, r2 = random.uniform(20.0, 100.0, 2)
        link = Linkage(r1, r2, random.uniform(-0.9, 0.9) * (r1 + r2), int(random.choice([-1, 1])))
        start, side = random.uniform(-math.pi, math.pi), int(random.choice([-1, 1]))
        if not link.reaches(start):
            continue
        place = link.branch * float(link.slider_position(np.array(start)))
        low, high = link.find_path_ends(start)
        past += place < 0.0
        travel = place - high + (high - low) * np.array([0.1, 0.35, 0.6, 0.9])
        rates = random.uniform(0.0, 1.0, 4)
        found = rates @ curves_along_slider(link, start, side, travel).effort
        wanted = force_of_energy(link, start, rates, side, travel)
        np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-6 * np.abs(wanted).max())
    assert past > 8


def test_forces_inside_balance_the_crank_past_the_dead_point_of_the_coupler():
    """No torque acts on a crank that the slider drives: its springs and the coupler's force balance."""
    springs = {"pivot": 2.0, "crank_pin": 3.0, "slider_pin": 4.0, "slider": 500.0}
    spec = config("bilancia2019", mechanism__springs=springs, mechanism__unloaded_angle="40 deg")
    assembly = assemble(spec)
    units = assembly.units(np.array([0.01, 0.06, 0.12, 0.165]))
    link, force = assembly.linkage, assembly.rates @ units.effort
    pin = link.crank * np.array([np.cos(units.angle), np.sin(units.angle)])
    assert len(set(np.sign(units.position - pin[0]))) == 2  # the coupler points to either side
    coupler, guide = reactions(assembly, units, force)
    pull = np.stack([-assembly.rates[3] * units.turn[3] - force, -guide])
    way = np.stack([units.position, np.full(4, link.offset)]) - pin
    np.testing.assert_allclose(coupler, (pull * way).sum(axis=0) / link.coupler, rtol=1e-9)
    lever = pin[0] * pull[1] - pin[1] * pull[0]
    balance = -assembly.rates[0] * units.turn[0] + assembly.rates[1] * units.turn[1] + lever
    np.testing.assert_allclose(balance, 0.0, atol=1e-9 * np.abs(lever).max())


def test_springs_relaxed_folded_have_the_limit_of_their_force_there():
    folded = math.pi + math.asin(30 / 400)
    about = {"analysis": {"drive": "force"}, "mechanism__unloaded_angle": folded}
    for side in ("before", "beyond"):
        result = cfmkit.analyze(config("li2019", **about, analysis__side=side, analysis__travel=("-1e-6 mm", "0 mm")))
        assert result.status.key == "complete"
        assert result.curve.force[-1] == pytest.approx(result.curve.force[0], rel=1e-4)
        assert result.curve.force[-1] < 0.0


POLES = {
    "stretched": ("bilancia2019", {"analysis__travel": ("-1 mm", "35 mm")}),
    "stretched far": ("bilancia2019", {"mechanism__unloaded_angle": "40 deg", "analysis__travel": ("-5 mm", "5 mm")}),
    "the other side": (
        "bilancia2019",
        {"mechanism__unloaded_angle": "40 deg", "analysis__side": "before", "analysis__travel": ("-5 mm", "5 mm")},
    ),
    "stretched past the foot": ("bilancia2019", {"analysis__travel": ("150 mm", "230 mm")}),
    "folded": ("li2019", {"analysis": {"drive": "force", "travel": ("0 mm", "250 mm")}, "requirements": ()}),
    "dead point": ("li2019", {"mechanism__coupler_length": "50 mm", "analysis__angle": ("-5 deg", "90 deg")}),
}


@pytest.mark.parametrize("name", POLES)
def test_a_curve_ends_before_the_effort_grows_without_bound(name):
    base, changes = POLES[name]
    spec = config(base, **changes, analysis__window=None)
    result = cfmkit.analyze(spec)
    assert result.status.key == "partial"
    reported = {item.name: item.message for item in result.warnings}
    assert "coupler_dead_point" in reported if name == "dead point" else "force_unbounded" in reported
    middle = np.median(np.abs(result.curve.effort))
    assert np.abs(result.curve.effort).max() < 200.0 * middle  # the pole itself gave 1e5 times as much
    assert len(result.curve.effort) == spec.analysis.points
    for draw in figures(result).values():
        draw()


@pytest.mark.parametrize("name", POLES)
def test_sweeps_end_where_single_runs_do(name):
    base, changes = POLES[name]
    spec = config(base, **changes, analysis__window=None, analysis__points=21)
    drive = spec.analysis.drive
    swept = cfmkit.sweep(
        spec, vary={"mechanism.springs.pivot": ["10 N*mm/rad", "20 N*mm/rad"]}, metrics=[f"{drive}_max"]
    )
    table = swept.table.as_dict()
    column = next(values for name, values in table.items() if name.startswith(f"{drive}_max"))
    for status, largest, rate in zip(table["status"], column, (0.01, 0.02), strict=True):
        single = cfmkit.analyze(spec.replace({"mechanism.springs.pivot": rate}))
        assert status == single.status.key == "partial"
        metrics = cfmkit.evaluate(single)  # the maximum between the points of the curve, too
        own = next(metrics[key].value for key in metrics if key.startswith(f"{drive}_max"))
        assert largest == pytest.approx(own * (1e3 if drive == "torque" else 1.0), rel=1e-12)


@pytest.mark.parametrize("lead", [1e-3, 1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("offset", [0.0, 12.0, -90.0])
@pytest.mark.parametrize("folded", [True, False])
def test_next_to_a_dead_point_the_force_is_that_at_the_same_share_of_the_way(lead, offset, folded):
    """Springs relaxed just before it: the end of the curve has digits of its own, not those of two places' difference.

    Along u = (distance from the dead point)/(that of the unloaded position) the force is F(u) = c (1 - 1/sqrt(u)).
    """
    link = Linkage(0.0951, 0.2362, 1e-3 * offset)
    dead = link.folded_angle if folded else link.stretched_angle
    mechanism = {
        "crank_length": link.crank, "coupler_length": link.coupler, "offset": link.offset,
        "unloaded_angle": dead + lead, "springs": {"pivot": 0.07, "crank_pin": 0.05, "slider_pin": 0.02},
    }  # fmt: skip
    ends = (-1e-3, 0.0) if not folded else (0.0, 1e-3)
    about = {"family": "slider-crank", "mechanism": mechanism, "analysis": {"drive": "force", "travel": ends}}
    result = cfmkit.analyze(SliderCrankSpec.model_validate(about))
    assert "force_unbounded" in {item.name for item in result.warnings}
    pole = result.state.assembly.reach[1 if folded else 0]
    share = 1.0 - result.curve.displacement / pole
    assert share.min() == pytest.approx(1e-3, rel=1e-9)
    force = result.curve.force[share <= 0.25]
    law = 1.0 - 1.0 / np.sqrt(share[share <= 0.25])
    # the knee angle is known to 1e-16 rad, and a thousandth of the way is half of its square
    tolerance = 20.0 * lead + 1e-12 / lead
    np.testing.assert_allclose(force / force[0], law / law[0], rtol=tolerance)


def test_relaxed_next_to_folded_and_driven_on_the_other_side_the_curve_ends_before_it():
    """The crank pin is turned by a whole turn at the folded position: no finite force leads there."""
    about = {
        "analysis": {"drive": "force", "side": "before"},
        "analysis__travel": ("-2 mm", "0 mm"),
        "requirements": (),
    }
    folded = math.pi + math.asin(30 / 400)
    result = cfmkit.analyze(config("li2019", **about, mechanism__unloaded_angle=folded - 1e-6))
    assert result.status.key == "partial"
    assert "force_unbounded" in {item.name for item in result.warnings}
    assert np.abs(result.curve.force).max() < 200.0 * np.median(np.abs(result.curve.force))


def test_no_random_force_curve_holds_a_number_made_of_rounding():
    """Travel from -5 to 5 mm whatever the lengths: half of these pass the stretched or the folded position."""
    random, cut = np.random.default_rng(60), 0
    for _ in range(60):
        r1, r2 = random.uniform(0.005, 0.1, 2)
        link = Linkage(r1, r2, random.uniform(-0.95, 0.95) * (r1 + r2), int(random.choice([-1, 1])))
        start = random.uniform(-math.pi, math.pi)
        if not link.reaches(start):
            continue
        mechanism = {
            "crank_length": r1, "coupler_length": r2, "offset": link.offset, "unloaded_angle": start,
            "branch": "right" if link.branch > 0 else "left",
            "springs": dict(zip(JOINT_NAMES, random.uniform(0.01, 1.0, 4).tolist(), strict=True)),
        }  # fmt: skip
        analysis = {"drive": "force", "travel": (-0.005, 0.005), "points": 41}
        about = {"family": "slider-crank", "mechanism": mechanism, "analysis": analysis}
        result = cfmkit.analyze(SliderCrankSpec.model_validate(about))
        assembly, travel = result.state.assembly, result.curve.displacement
        whole = travel[0] == -0.005 and travel[-1] == 0.005
        assert (result.status.key == "complete") == whole
        assert whole or "force_unbounded" in {item.name for item in result.warnings}
        cut += not whole
        inside = travel[2:-2]
        wanted = force_of_energy(link, start, assembly.rates, assembly.side, inside)
        np.testing.assert_allclose(result.curve.force[2:-2], wanted, rtol=1e-4, atol=1e-6 * np.abs(wanted).max())
        ends = np.abs(result.curve.force[[0, -1]])
        assert ends.max() < 1e3 * np.abs(wanted).max()
    assert cut > 8


def test_places_even_in_the_crank_angle_follow_the_crank_past_its_dead_point():
    """The crank turns back there: on one side of it places are even, and over it the design says why they cannot be."""
    base = {"mechanism__unloaded_angle": "40 deg", "design__spacing": "crank", "design__tolerance": None}
    task = task_of(config("bilancia2019", **base))
    places = task.places((0.155, 0.17), 11)
    assert places[0] == pytest.approx(0.155)
    assert places[-1] == pytest.approx(0.17)
    steps = np.diff(task.assembly.units(places).angle)
    np.testing.assert_allclose(steps, steps.mean(), rtol=1e-9)
    over = cfmkit.design(config("bilancia2019", **base, design__travel=("1 mm", "165 mm")))
    assert over.spec is None
    assert "design.spacing" in over.message


def test_flexures_on_the_left_bend_to_the_side_that_their_springs_take():
    left = {"mechanism__branch": "left", "mechanism__unloaded_angle": math.pi - 0.542, "analysis__window": None}
    for side in ("before", "beyond"):
        about = {"analysis__side": side, "analysis__travel": ("0 mm", "4 mm"), "analysis__points": 5}
        springs, flexures = (
            cfmkit.analyze(config("lumped", **left, **about, analysis__fidelity=name)) for name in ("prb", "lumped")
        )
        assert flexures.curve.force[-1] == pytest.approx(springs.curve.force[-1], rel=3e-3)


def test_places_of_all_metrics_are_solved_for_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Calls of the model are what a sweep's points cost: the ends of all bands take the seven rounds of one."""
    result = cfmkit.analyze(cfmkit.load("configs/slider_crank_bilancia2019.yaml"))
    assert result.closed is not None
    places, effort = [], type(result.closed).effort

    def counted(self: object, branch: str, at: np.ndarray) -> np.ndarray:
        places.append(np.shape(at))
        return effort(self, branch, at)

    monkeypatch.setattr(type(result.closed), "effort", counted)
    metrics = cfmkit.evaluate(result)
    assert metrics["band_range_1pct"].value is not None
    assert metrics["usable_stroke"].value is not None
    assert len(places) <= 3 * 7 + 8


def test_a_travel_up_to_the_stretched_position_tells_what_the_angle_does_where_springs_are():
    """Springs that are not there have an unbounded effort at the end of the reach: numpy warned, no value was told."""
    given = {
        "mechanism": {
            "crank_length": "52 mm", "coupler_length": "95 mm", "offset": "-82 mm", "branch": "left",
            "unloaded_angle": "-148 deg", "springs": {"slider": "0.12 N/mm"},
        },
        "analysis": {"drive": "force", "travel": ("-5 mm", "5 mm")},
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = cfmkit.analyze(config("li2019", **given)).values["force_per_degree"].value
    assert found is not None
    assert math.isfinite(found)

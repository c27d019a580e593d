"""Flexures and strips of slider-cranks: identities, limits, and everything that can go wrong, by its name."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from corotational import recheck
from flexure_support import (
    ABS,
    LINKAGE,
    MM,
    RATES,
    TABLE_2,
    THICKNESS,
    UNLOADED,
    WIDTH,
    corners,
    lumped_chain,
    strip_chain,
)
from slider_crank import CONFIGS, config

import cfmkit
from cfmkit import Run, api
from cfmkit.errors import GeometryError
from cfmkit.families import family
from cfmkit.families.slider_crank.printed import equilibrium_path, strip_thickness_search
from cfmkit.families.slider_crank.printed.equilibrium_path import PressingEnd
from cfmkit.families.slider_crank.printed.flexure_sizing import rotations, size_flexure
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import (
    Elasticity,
    Flexure,
    stations,
)
from cfmkit.families.slider_crank.printed.part import Leg
from cfmkit.families.slider_crank.printed.solution import first_at
from cfmkit.families.slider_crank.printed.sqp_program import Form, StripProgram, StripTask
from cfmkit.results import Status

if TYPE_CHECKING:
    from pathlib import Path

    from cfmkit.results import Result

TRAVEL = np.array([0.1, 1.0, 5.0, 18.0]) * MM


def names(result: Result) -> set[str]:
    return {item.name for item in result.warnings}


# --- closed forms ---------------------------------------------------------------------------------------------


def test_sized_flexures_have_the_rate_and_the_stress() -> None:
    one = size_flexure(0.0354, 10.8 * MM, 1.8e9, 42.5e6, 0.53)
    assert one.rate(1.8e9) == pytest.approx(0.0354)
    assert one.rotation(1.8e9, 42.5e6) == pytest.approx(0.53)
    volume = one.length * one.thickness * one.width  # the same for any length
    assert volume == pytest.approx(3 * 1.8e9 * 0.0354 * 0.53**2 / 42.5e6**2)


@pytest.mark.parametrize(
    ("stroke", "thickness", "width"), [(4, 1.055, 2.17), (10, 0.666, 8.61), (18, 0.497, 20.75), (35, 0.359, 55.1)]
)
def test_flexures_at_the_crank_pin_grow_wide_with_the_stroke(stroke: float, thickness: float, width: float) -> None:
    """Width with the third power of the rotation: small flexures cannot have a long stroke."""
    turn = float(abs(rotations(LINKAGE, UNLOADED, np.array([stroke * MM]))[1, 0]))
    one = size_flexure(float(RATES[1]), 10.8 * MM, 1.8e9, 42.5e6, turn)
    assert one.thickness / MM == pytest.approx(thickness, abs=6e-4)
    assert one.width / MM == pytest.approx(width, rel=2e-3)


def test_a_short_flexure_is_the_spring_it_stands_for() -> None:
    """The correction goes to one with the length."""
    from cfmkit.families.slider_crank.unit_springs import curves_along_slider

    parts = []
    for rate in RATES:
        thickness = (12 * rate * 0.3 * MM / (1.8e9 * 2.73)) ** 0.25
        parts.append(Flexure(0.3 * MM, thickness, 2.73 * thickness))
    springs = RATES @ curves_along_slider(LINKAGE, 0.56, 1, np.array([5 * MM])).effort[:3]
    assert lumped_chain(0.56, parts).press(np.array([5 * MM])).force[0] == pytest.approx(springs[0], rel=4e-3)


# --- chains and branches ------------------------------------------------------------------------------------


def test_places_at_the_corners_are_those_of_the_corners() -> None:
    line = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 14.0]])
    np.testing.assert_allclose(stations(line, [[0.5], [0.1, 0.9]]), [0, 1 / 6, 0.4, 14 / 15, 1], atol=1e-15)


def test_force_is_proportional_to_width_and_modulus_and_the_stress_does_not_know_the_width() -> None:
    one, two = (strip_chain(width=w).press(TRAVEL) for w in (WIDTH, 2 * WIDTH))
    np.testing.assert_allclose(two.force, 2 * one.force, rtol=1e-8)
    hard = strip_chain(material=Elasticity(3 * ABS.youngs_modulus, 0.35)).press(TRAVEL)
    np.testing.assert_allclose(hard.force, 3 * one.force, rtol=1e-8)
    np.testing.assert_allclose(two.path.peak_stress().value, one.path.peak_stress().value, rtol=1e-8)


@pytest.mark.parametrize("unloaded", [LINKAGE.stretched_angle, LINKAGE.stretched_angle + 1e-7, UNLOADED, 0.53])
def test_both_sides_are_found_stable_and_on_the_side_asked_for(unloaded: float) -> None:
    """Straight, nearly straight, kinked either way; the energy is at a minimum by independent elements, too."""
    for side in (1, -1):
        found = strip_chain(0.977 * MM, unloaded=unloaded).press(np.array([2.0, 10.0]) * MM, side)
        assert found.ending is PressingEnd.COMPLETE
        assert found.side == side
        assert recheck(found.path, elements=24).stable.all()


def test_the_branch_found_is_the_lowest() -> None:
    """The next buckling mode would need many times the force: the first is the one that a column of pins has."""
    straight = strip_chain(0.977 * MM, unloaded=LINKAGE.stretched_angle)
    forces = [straight.press(np.array([0.2 * MM]), side).force[0] for side in (1, -1)]
    rigidity, length = 1.8e9 * WIDTH * (0.977 * MM) ** 3 / 12, 127.42 * MM
    first = 4 * np.pi**2 * rigidity / length**2  # clamped at both ends, the slider held across its way
    along = np.cos(LINKAGE.stretched_angle)
    np.testing.assert_allclose(forces, first * along, rtol=0.02)


def test_a_chain_that_begins_late_on_its_other_side_says_from_where() -> None:
    """With a large kink the other branch begins with a snap."""
    found = strip_chain(0.977 * MM, unloaded=0.60).press(np.linspace(0.0, 20.0, 41) * MM, -1)
    assert found.ending is PressingEnd.STARTS_LATE
    assert "has an equilibrium only from" in found.message
    assert found.travel[0] > 0


@pytest.mark.parametrize(
    ("name", "unloaded", "begins"),
    [("strip", "0.542 rad", 0.03745), ("strip", "0.6 rad", 0.30468), ("tapered", "0.55 rad", 0.05605)],
)
def test_a_branch_that_begins_late_begins_at_its_limit_point_whatever_the_points(
    name: str, unloaded: str, begins: float
) -> None:
    """The strip was said to begin at 0.85 mm with 41 points, at 0.07 mm with 481."""
    found = []
    for points in (41, 301):
        changes = ("analysis.side=before", f"mechanism.unloaded_angle={unloaded}", f"analysis.points={points}")
        one = api.analyze(config(name, *changes))
        travel = one.curve.motion
        assert travel[0] == pytest.approx(begins * MM, rel=1e-4)
        assert np.diff(travel)[1:] == pytest.approx(travel[-1] / (points - 1))  # none behind the limit point is missing
        metrics = api.evaluate(one, ("usable_stroke", "force_max", "force_min", "stress_max"))
        found.append([metric.value for metric in metrics.values()])
    assert found[0] == pytest.approx(found[1], rel=1e-6)


LONG_WAYS = {
    "right": ("56.9 mm", "-30.2 mm", "110.5 mm", "5.48 deg", "131.6 mm"),
    "left": ("69.4 mm", "-41.1 mm", "110.4 mm", "-0.87 deg", "115.5 mm"),
}


@pytest.mark.parametrize("branch", LONG_WAYS)
def test_a_chain_that_turns_with_its_slider_keeps_its_side(branch: str) -> None:
    """The crank pin comes back past where the line to the slider had been, but never crosses the line as it is."""
    crank, offset, stretched, lead, travel = LONG_WAYS[branch]
    lengths = [
        f"crank_length={crank}",
        f"offset={offset}",
        f"stretched_position={stretched}",
        f"unloaded_offset={lead}",
    ]
    changes = [f"mechanism.{item}" for item in (*lengths, "unloaded_angle=null", f"branch={branch}")]
    about = [
        f"analysis.travel=[0 mm, {travel}]",
        "analysis.points=31",
        "analysis.window=null",
    ]
    result = api.analyze(config("lumped", *changes, *about))
    assert result.status is Status.COMPLETE, result.message
    springs = api.analyze(config("lumped", *changes, *about, "analysis.fidelity=prb"))
    # no closer: flexures of 10.8 mm are stiffer than springs, and turn by more than a right angle here
    np.testing.assert_allclose(result.curve.force[1:], springs.curve.force[1:], rtol=0.35)


def test_a_chain_that_goes_over_to_the_other_side_has_a_curve_up_to_there() -> None:
    """The crank pin of a real chain, but for a jump beyond 6 mm that stands for going over."""
    chain = lumped_chain()
    travel = np.linspace(0.0, 10.0, 11) * MM

    def knee(path: Any, index: int) -> np.ndarray:
        place = chain.knee(path, index)
        return place if path.drive[index] < 6.5 * MM else place + np.array([0.0, -40.0 * MM])

    found = replace(chain, knee=knee).press(travel)
    assert found.ending is PressingEnd.CROSSES
    assert "between 6 and 7 mm" in found.message
    np.testing.assert_allclose(found.travel, travel[:7])
    np.testing.assert_allclose(found.force, chain.press(travel).force[:7])


def test_a_chain_that_loses_its_stability_says_from_where_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A real chain, but for counts of unstable directions beyond 6 mm that stand for a path that went on there."""
    trace = equilibrium_path._trace

    def lose_stability(*arguments: Any) -> Any:
        path = trace(*arguments)
        return replace(path, unstable=np.where(path.drive > 6.5 * MM, 1, path.unstable))

    monkeypatch.setattr(equilibrium_path, "_trace", lose_stability)
    found = lumped_chain().press(np.linspace(0.0, 10.0, 11) * MM)
    assert found.ending is PressingEnd.UNSTABLE
    assert found.message == "unstable from 7 mm on"


CROSSING = """
cfmkit: 1
family: slider-crank
name: crosses-at-its-end
mechanism:
  crank_length: 54 mm
  stretched_position: 27.7 mm
  offset: 76.3 mm
  unloaded_angle: 1.209 rad
  material: {youngs_modulus: 1800 MPa, poisson_ratio: 0.35, yield_strength: 42.5 MPa}
  flexures:
    pivot: {length: 13.6 mm, thickness: 0.6 mm, width: 2.478 mm}
    crank_pin: {length: 7.2 mm, thickness: 1.17 mm, width: 2.621 mm}
    slider_pin: {length: 10.1 mm, thickness: 1.1 mm, width: 2.621 mm}
analysis: {drive: force, travel: [0 mm, 30.5 mm], points: 31}
"""


def test_long_flexures_that_bend_over_beyond_the_pivots_foot_have_a_curve_up_to_there(tmp_path: Path) -> None:
    """The slider comes back to its first distance from the pivot; the crank pin is on the other side then."""
    (path := tmp_path / "crosses.yaml").write_text(CROSSING, encoding="utf-8")
    found = cfmkit.analyze(cfmkit.load(path))
    assert found.status is Status.PARTIAL
    assert names(found) >= {"wrong_branch"}
    assert found.message == "between 28.47 and 29.48 mm the chain crosses to the side opposite to the requested one"
    assert found.curve.motion == pytest.approx(np.linspace(0.0, 30.5, 31)[:29] * MM)
    before = cfmkit.analyze(cfmkit.load(path, ["analysis.travel=[0 mm, 28 mm]", "analysis.points=29"]))
    assert before.status is Status.COMPLETE
    there = found.closed.effort("load", before.curve.motion)
    assert there == pytest.approx(before.curve.force, abs=1e-7 * before.curve.force.max())
    assert found.curve.stable.all()


# --- the program ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("goal", ["stroke", "ripple", "rms"])
@pytest.mark.parametrize("moving", [False, True])
def test_slopes_of_the_program_are_those_of_differences(goal: Any, moving: bool) -> None:
    shares = ((0.285, 0.803), (0.582, 0.851), (0.245, 0.842), (0.578, 0.798), (0.231, 0.765))
    form = Form(12, (2,) * 5) if moving else Form(4, width=WIDTH)
    x = np.concatenate([THICKNESS / MM, np.concatenate(shares), [5.1]]) if moving else np.array([0.95, 1.02, 0.9, 0.99])
    program = StripProgram(StripTask(corners(), np.pi, ABS, 1.5, MM, 21 * MM, 0.01, goal), form)
    z = np.append(x, 2.1) if program.extra else x
    answer = program.slopes(z)
    assert answer is not None
    for k in {0, 3, form.size - 1, len(z) - 1} | ({13} if moving else set()):
        sides = []
        for step in (-1e-4, 1e-4):
            moved = z.copy()
            moved[k] += step
            value = program.values(moved)
            assert value is not None
            sides.append(np.append(value[1], value[0]))
        slope = (sides[1] - sides[0]) / 2e-4
        exact = np.append(answer[1][:, k], answer[0][k])
        np.testing.assert_allclose(exact, slope, atol=2e-5 * np.abs(slope).max() + 1e-9)


def test_a_strip_that_is_pulled_to_many_times_its_length_has_no_answer_or_one_far_beyond_its_limits() -> None:
    program = StripProgram(StripTask(corners(), np.pi, ABS, 1.5, MM, 20 * MM, 0.01), Form(3, width=WIDTH))
    answer = program.values(np.array([1.0, 1.0, 1.0, 1000.0]))  # [mm]; the strip is 125 mm long, and stretches
    assert answer is None or answer[1].min() < -1000.0


def test_first_at_is_the_first_crossing_and_none_where_there_is_none() -> None:
    x, y = np.arange(4.0), np.array([0.0, 2.0, 1.0, 3.0])
    assert first_at(x, y, 1.5) == pytest.approx(0.75)
    assert first_at(x, y, 9.0) is None
    assert first_at(x, y + 5.0, 1.0) == 0.0


# --- findings ---------------------------------------------------------------------------------------------------

CASES = {
    "straight_start": ("strip", ["mechanism.unloaded_angle=30.963756532073525 deg"]),
    "kink_too_small": ("strip", []),
    "long_run_in": ("strip", ["mechanism.unloaded_angle=0.58 rad"]),
    "overstressed": ("strip", ["analysis.travel=[0 mm, 37 mm]"]),
    "too_thin": ("strip", ["mechanism.part.process.least_feature=1.2 mm"]),
    "lateral_buckling": ("strip", ["mechanism.beam.width=1.5 mm"]),
    "side_force": ("strip", []),
    "pulled": ("strip", ["analysis.travel=[-1 mm, 5 mm]"]),
    "force_negative": ("strip", ["analysis.travel=[0 mm, 150 mm]"]),
    "wrong_branch": ("strip", ["mechanism.beam.centreline=[[0 mm,0 mm],[10 mm,7.5 mm],[50 mm,29 mm],[100 mm,60 mm]]"]),
    "branch_begins_late": ("strip", ["mechanism.unloaded_angle=0.60 rad", "analysis.side=before"]),
}


@pytest.mark.parametrize("name", CASES)
def test_what_can_go_wrong_is_found_by_name(name: str) -> None:
    file, changes = CASES[name]
    result = api.analyze(config(file, "analysis.points=61", *changes))
    assert name in names(result), result.message
    if name in ("pulled", "wrong_branch"):
        assert result.status is Status.NO_EQUILIBRIUM
        assert not result.curves


def test_a_travel_beyond_all_reason_is_never_a_complete_curve() -> None:
    result = api.analyze(config("strip", "analysis.points=21", "analysis.travel=[0 mm, 300 mm]"))
    assert result.status in (Status.PARTIAL, Status.NO_EQUILIBRIUM)
    assert names(result) & {"limit_point", "unstable", "not_converged"}


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("strip", ()),
        ("strip", ("mechanism.wide_beams=true", "mechanism.beam.width=30 mm")),  # as narrow ones 10 % softer
        ("tapered", ()),
        ("lumped", ()),
        pytest.param("taper_design", (), marks=pytest.mark.slow),
    ],
)
def test_corotational_elements_have_the_force_and_the_stress_of_printed_chains(name: str, changes: Any) -> None:
    result = api.analyze(config(name, "analysis.points=5", *changes))
    path = result.state.pressed.path
    chosen = path.at_requested[1:]
    other = recheck(path, chosen)
    np.testing.assert_allclose(other.effort, path.effort[chosen], rtol=2e-5)
    np.testing.assert_allclose(other.stress, path.peak_stress().value[chosen], rtol=2e-3)
    assert other.stable.all()


@pytest.mark.parametrize(
    ("setting", "reported"),
    [
        ("recheck=true", r"the key 'recheck' was removed; .*'fidelity: solid'"),
        ("accuracy=1e-9", r"accuracy.*forces are always solved to 1e-7: delete the line"),
    ],
)
def test_removed_keys_say_what_to_write(setting: str, reported: str) -> None:
    with pytest.raises(cfmkit.SpecError, match=reported):
        config("strip", f"analysis.{setting}")


def test_a_strip_is_on_its_side_from_the_first_micrometre() -> None:
    """Its centre line passes the kink on a chord, farther off the crank pin than it has moved by then."""
    result = api.analyze(config("strip", "analysis.travel=[0 mm, 1 um]", "analysis.window=[0 mm, 1 um]"))
    assert result.status is Status.COMPLETE
    assert result.curve.effort[-1] == pytest.approx(0.0517, abs=1e-3)


def test_the_kink_of_a_line_of_its_own_is_that_of_the_line() -> None:
    points = ["analysis.points=21"]
    line = "mechanism.beam.centreline=[[0 mm, 0 mm], [50 mm, {} mm], [100 mm, 60 mm]]"
    right = api.analyze(config("strip", line.format(29), *points))
    assert right.values["kink"].value == pytest.approx(-np.cos(np.arctan(0.6)) * MM)
    assert right.status is Status.COMPLETE
    assert "straight_start" in names(api.analyze(config("strip", line.format(30), *points)))


def test_flexures_longer_than_their_links_are_refused() -> None:
    """A line that runs back on itself would have an equilibrium, too."""
    for changes in (("strip", "mechanism.beam.flexure_length=80 mm"), ("lumped", "design.flexures.length=80 mm")):
        result = (api.analyze if changes[0] == "strip" else api.design)(config(*changes))
        assert result.status is Status.INVALID
        assert "take 80 mm of the crank" in result.message
    with pytest.raises(cfmkit.SpecError, match="same corner twice"):
        config("strip", "mechanism.beam.centreline=[[0 mm, 0 mm], [0 mm, 0 mm], [1 mm, 0 mm]]")


@pytest.mark.parametrize("model", ["strip", "lumped"])
def test_a_chain_is_not_pressed_through_its_own_anchor(model: str) -> None:
    """Without an offset the slider runs onto the anchor; lines without thickness would let it pass."""
    lengths = ["mechanism.offset=0 mm", "mechanism.unloaded_angle=null", "mechanism.unloaded_offset=1 deg"]
    about = ["analysis.travel=[0 mm, 150 mm]", "analysis.points=61"]
    result = api.analyze(config(model, *lengths, *about))
    assert result.status is Status.PARTIAL
    assert result.warnings[0].name == "meets_itself"
    assert 0.07 < result.curve.displacement[-1] < 0.105
    beside = api.analyze(config(model, *about))  # 60 mm beside the anchor there is room
    assert "meets_itself" not in names(beside)


def test_flexures_longer_than_their_link_are_refused_at_their_place(tmp_path: Path) -> None:
    text = (CONFIGS / "slider_crank_lumped.yaml").read_text()
    for joint, line in (("pivot", 15), ("slider_pin", 17)):
        path = tmp_path / f"{joint}.yaml"
        path.write_text(text.replace(f"{joint}: {{length: 10.8 mm", f"{joint}: {{length: 200 mm"))
        with pytest.raises(cfmkit.SpecError, match="make them shorter") as caught:
            cfmkit.load(path)
        problem = caught.value.problems[0]
        assert (problem.path, problem.line) == (f"mechanism.flexures.{joint}.length", line)


def test_the_run_in_is_solved_for_and_not_read_off_the_points() -> None:
    """Points 1.1 mm apart gave 1.09 mm where 0.076 mm are right; what is left is their mean force."""
    few, many = (api.analyze(config("strip", f"analysis.points={n}")) for n in (31, 301))
    assert few.values["run_in_95"].value == pytest.approx(many.values["run_in_95"].value, rel=0.02)
    assert many.values["run_in_95"].value == pytest.approx(0.0758 * MM, rel=0.01)


@pytest.mark.parametrize(
    ("name", "setting", "reported"),
    [
        ("lumped", "analysis.fidelity=beam", r"mechanism\.beam"),
        ("strip", "analysis.fidelity=prb", "springs"),
        ("strip", "analysis.drive=torque", "drive: force"),
        ("strip", "mechanism.beam.shares=[[0.2, 0.8], [], [], [], []]", "gives the positions of 2 thicknesses"),
    ],
)
def test_contradictions_are_refused_with_their_names(name: str, setting: str, reported: str) -> None:
    with pytest.raises(cfmkit.SpecError, match=reported):
        config(name, setting)


def test_shares_of_another_number_of_pieces_are_refused() -> None:
    result = api.analyze(config("tapered", "mechanism.beam.centreline=[[0 mm, 0 mm], [105 mm, 63 mm]]"))
    assert result.status is Status.INVALID
    assert "5 pieces" in result.message


EXCHANGED = (
    "mechanism.beam={width: 5 mm, thickness: [1 mm, 1 mm, 1 mm, 1 mm], shares: [[0.3, 0.7], []], "
    "centreline: [[0 mm, 0 mm], [49 mm, 31 mm], [100 mm, 60 mm]]}",
    "design.beam={shape: shares, shares: [[0.3, 0.7], [0.2, 0.6]], width: 5 mm}",
)


@pytest.mark.parametrize(
    ("settings", "reported"),
    [
        (("design.travel=[1 mm, 20 mm]",), "design.tolerance"),
        (("design.beam.goal=ripple",), "design.travel"),
        (("design.beam.longest=0.5 mm",), "design.beam.longest"),
        (EXCHANGED, "middles of the ranges in 'design.beam.shares' must increase"),
    ],
)
def test_designs_that_contradict_themselves_are_refused(settings: tuple[str, ...], reported: str) -> None:
    refused = api.design(config("taper_design", *settings))
    assert refused.status is Status.INVALID
    assert reported in refused.message


# --- designs ----------------------------------------------------------------------------------------------------


def test_flexures_designed_for_springs_have_their_force_and_the_stress_allowed() -> None:
    wanted = config("lumped")
    found = api.design(wanted)
    assert found.status is Status.COMPLETE
    result = api.analyze(found.spec)
    assert result.curve.extra["max_stress"].values.max() == pytest.approx(42.5e6, rel=1e-4)
    springs = api.analyze(wanted.replace({"analysis.fidelity": "prb"})).curve
    both = [np.interp(np.linspace(0.4, 4, 40) * MM, c.motion, c.effort).mean() for c in (result.curve, springs)]
    assert both[0] == pytest.approx(both[1], rel=1e-3)
    widths = {found.spec.get_value(f"mechanism.flexures.{name}.width") for name in ("pivot", "crank_pin", "slider_pin")}
    assert len(widths) == 1


def test_uncorrected_flexures_push_a_tenth_too_hard() -> None:
    found = api.design(config("lumped", "design.flexures.exact=false"))
    assert "flexures push 9.99" in found.message
    level = api.analyze(found.spec).values["kink"].value
    assert level == pytest.approx(0.0853e-3, abs=1e-6)


def test_a_strip_too_wide_for_its_range_is_infeasible_and_says_what_would_do() -> None:
    found = api.design(config("strip", "design.force=5 N"))
    assert found.status is Status.INFEASIBLE
    assert {item.name for item in found.warnings} == {"target_unreachable"}
    assert set(found.nearest_feasible) == {"design.force", "design.beam.width"}
    wider = config("strip", "design.force=5 N", "design.beam.width=[5 mm, 30 mm]")
    assert api.design(wider).status is Status.COMPLETE


@pytest.mark.parametrize(("force", "limit"), [(5.0, 10.0), (0.1, 5.0)])
def test_a_strip_at_the_nearest_of_its_widths_has_a_force_in_proportion(force: float, limit: float) -> None:
    refused = api.design(config("strip", "design.beam.width=[5 mm, 10 mm]", f"design.force={force} N"))
    assert "'design.beam.width', 5 mm to 10 mm" in refused.message
    reached, width = (float(refused.nearest_feasible[f"design.{key}"].split()[0]) for key in ("force", "beam.width"))
    assert reached / force == pytest.approx(limit / width, rel=2e-3)


def test_a_design_tells_what_holds_it() -> None:
    found = api.design(config("taper_design"))
    text = " | ".join(found.active_bounds)
    assert "upper edge of the band" in text
    assert "lower edge of the band" in text
    assert "stress 42.5 MPa at the end" in text
    assert "converged to a local optimum" in found.message


def test_a_thickness_at_its_bound_is_told() -> None:
    found = api.design(config("taper_design", "design.beam.thickness=[0.5 mm, 1.5 mm]"))
    assert any("mechanism.beam.thickness.6 at its largest, 1.5 mm" in item for item in found.active_bounds)


@pytest.mark.parametrize("force", ["1.5e-9 N", pytest.param("1.1 N", marks=pytest.mark.slow), "15 N"])
def test_a_force_out_of_reach_is_refused_after_a_few_evaluations(monkeypatch: pytest.MonkeyPatch, force: str) -> None:
    """Two to four seconds each: every derivative is one by 23 numbers."""
    asked, states = [], StripProgram.state

    def counted(program: StripProgram, z: Any) -> Any:
        asked.append(z.copy())
        return states(program, z)

    monkeypatch.setattr(StripProgram, "state", counted)
    found = api.design(config("paper_ranges", f"design.force={force}"))
    assert found.status is Status.INFEASIBLE
    assert len(np.unique([str(z) for z in asked])) < 100


def test_what_would_be_feasible_is_said_with_its_number() -> None:
    found = api.design(config("taper_design", "design.force=100 N", "design.beam.nodes=3"))
    assert found.status is Status.INFEASIBLE
    nearest = found.nearest_feasible["design.force"]
    assert (
        api.design(config("taper_design", f"design.force={nearest}", "design.beam.nodes=3")).status is Status.COMPLETE
    )


def test_a_given_travel_keeps_the_stress_at_its_exact_peak() -> None:
    """Between the samples of the search the stress is higher: it is then searched again."""
    wanted = ["design={force: 1.5 N, travel: [1 mm, 60 mm], beam: {goal: ripple, nodes: 5}}"]
    result = api.analyze(api.design(config("taper_design", *wanted)).spec)
    assert result.curve.extra["max_stress"].values.max() <= 42.5e6
    assert "overstressed" not in names(result)


def test_an_optimiser_that_stops_is_told() -> None:
    """The root mean square of 25 mm has a flat valley: the steps allowed do not reach its end."""
    wanted = "design={force: 1.5 N, travel: [1 mm, 25 mm], beam: {goal: rms, nodes: 5}}"
    found = api.design(config("taper_design", wanted))
    assert "optimum" not in found.message
    assert "optimizer_stopped" in {item.name for item in found.warnings}


def test_random_starts_repeat_with_their_seed() -> None:
    wanted = config("taper_design", "design.beam.seeds=2", "design.beam.nodes=5")
    one, two = (api.design(wanted, Run(seed=3)) for _ in range(2))
    assert one.spec == two.spec


def test_finished_starts_are_noted_and_a_second_run_begins_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """The noted starts give the same strip to the last digit; what is searched again is the uniform strip alone."""
    notes: dict[str, Any] = {}

    class Recorder:
        def find(self, key: str) -> Any:
            return json.loads(notes[key]) if key in notes else None

        def add(self, key: str, record: Any) -> None:
            notes[key] = json.dumps(record)

    task = StripTask(corners(), np.pi, ABS, 1.5, 1 * MM, 15 * MM, 0.05, "stroke", 15 * MM)
    wanted = task, Form(2, width=WIDTH), np.tile([0.5, 2.0], (2, 1)), 2, Run(notes=Recorder()), "x"
    first = strip_thickness_search.search(*wanted)
    assert len(notes) == 2
    monkeypatch.setattr(strip_thickness_search.StripSearch, "climb", None)
    again = strip_thickness_search.search(*wanted)
    assert isinstance(first, strip_thickness_search.FoundStrip)
    assert isinstance(again, strip_thickness_search.FoundStrip)
    np.testing.assert_array_equal(again.descent.z, first.descent.z)
    assert again.descent.evaluations == first.descent.evaluations


def test_no_time_is_told_as_such() -> None:
    found = api.design(config("taper_design"), Run(time_budget=0.0))
    assert found.status is Status.INFEASIBLE
    assert "the time budget ended before any start" in found.message


@pytest.mark.parametrize(("name", "end", "stroke"), [("tapered", 18, 16.01), ("strip", 40, 34.01)])
def test_the_travel_up_to_the_allowable_stress_is_found_within_a_longer_travel(
    name: str, end: int, stroke: float
) -> None:
    """The strokes that the strips reach, not the travel at which the configurations end."""
    changes = f"analysis.travel=[0 mm, {end} mm]", "analysis.points=161"
    found = api.analyze(config(name, *changes)).values["stress_stroke"].value
    assert found == pytest.approx(stroke * MM, abs=0.01 * MM)


SHARP = "mechanism.part.fillet=0 mm"


# --- outline ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("changes", [(), ("mechanism.unloaded_angle=60 deg",)])
@pytest.mark.parametrize("name", ["lumped", "strip", "tapered"])
def test_every_straight_piece_has_its_thickness_up_to_its_corners(name: str, changes: tuple[str, ...]) -> None:
    """The distance from the centre line of every piece to the edge is half its thickness there, also beside corners."""
    drawn = api.drawing(config(name, SHARP, *changes), 1e-9)
    cut = next(contour for contour in drawn.contours if contour.layer == "cut")
    edges = [(complex(*edge.start), complex(*edge.end)) for edge in cut.edges]  # type: ignore[union-attr]
    table = {key: values for key, (values, _) in drawn.tables[0].columns.items()}
    points = table["x"] + 1j * table["y"]
    pieces = range(0, len(points) - 1, 2) if name == "lumped" else range(len(points) - 1)
    for k in pieces:  # a lumped chain has links between its flexures
        along = points[k + 1] - points[k]
        for share in (0.3, 0.5, 0.7):
            half = 0.5 * (table["thickness"][k] * (1 - share) + table["thickness"][k + 1] * share)
            at, normal = points[k] + share * along, 1j * along / abs(along)
            for side in (1, -1):
                reach = [hit for edge in edges if (hit := _ray(at, side * normal, *edge)) is not None]
                assert min(reach) == pytest.approx(half, abs=1e-9)


def _ray(at: complex, way: complex, start: complex, end: complex) -> float | None:
    """Return how far a ray goes to an edge [m]; None where it misses it."""
    edge, off = (end - start) / way, (start - at) / way
    if edge.imag == 0:
        return None
    share = -off.imag / edge.imag
    reach = off.real + share * edge.real
    return reach if 0 <= share <= 1 and reach > 0 else None


@pytest.mark.parametrize(
    ("name", "change"), [("lumped", "flexures.pivot.thickness=0.5 mm"), ("strip", "beam.offset=0.5 mm")]
)
def test_a_leg_that_is_not_drawn_as_specified_is_refused(name: str, change: str, monkeypatch: Any) -> None:
    drawn, other = Leg.contours.fget, config(name, f"mechanism.{change}")  # type: ignore[attr-defined]
    monkeypatch.setattr(Leg, "contours", property(lambda _: drawn(Leg.from_spec(other, as_printed=True))))
    with pytest.raises(GeometryError, match="thick in the outline"):
        api.drawing(config(name))


@pytest.mark.parametrize(("change", "allowed"), [("0.0099 mm", False), ("0.0101 mm", True), ("1e-9 mm", False)])
def test_a_strip_with_a_place_a_hundred_times_thinner_is_a_hinge_and_refused(change: str, allowed: bool) -> None:
    values = f"mechanism.beam.thickness=[1 mm, 0.8 mm, {change}, 1 mm]"
    if allowed:
        assert min(config("strip", values).mechanism.beam.values) == pytest.approx(1.01e-5)
        return
    with pytest.raises(cfmkit.SpecError, match=r"over 100 times the smallest.* is a hinge"):
        config("strip", values)


def test_the_side_of_a_strip_is_found_without_its_stresses(monkeypatch: pytest.MonkeyPatch) -> None:
    """They were computed along the whole strip at every point, for each point anew."""
    calls: list[int] = []
    monkeypatch.setattr("cfmkit.elastica.results.path.EquilibriumPath.sections", lambda *_: calls.append(1))
    assert api.analyze(config("strip", "analysis.points=7")).status.usable
    assert not calls


@pytest.mark.parametrize(("name", "thickness"), [("lumped", [0.908, 0.960, 0.960]), ("strip", [0.97721])])
def test_what_bends_is_in_every_pose_as_thick_as_specified(name: str, thickness: list[float]) -> None:
    bodies = family("slider-crank").part(cfmkit.analyze(config(name, "analysis.points=11"))).bodies
    halves = [np.unique(body.half_thickness) for body in bodies if body.name == "flexure"]
    np.testing.assert_allclose(halves, 0.5 * MM * np.array(thickness)[:, None])


@pytest.mark.parametrize("name", ["strip", "tapered", "lumped"])
def test_the_section_at_the_place_of_the_largest_stress_has_it(name: str) -> None:
    """Places along the whole part: one beam from end to end, or flexures with links between them."""
    solution = api.analyze(config(name, "analysis.points=7")).state
    path, lengths = solution.pressed.path, np.hypot(*np.diff(solution.chain.points, axis=0).T)
    starts = np.cumsum([0.0, *lengths])
    beams = list(path.network.beams)
    ends = [(0.0, starts[-1])] if len(beams) == 1 else list(zip(starts[::2], starts[1::2], strict=True))
    for k, point in enumerate(path.at_requested[1:], 1):
        places, stresses = [], []
        for beam, (start, end) in zip(beams, ends, strict=True):
            sections = path.sections(beam)
            places.extend(start + (end - start) * np.broadcast_to(sections.place, sections.moment.shape)[point])
            stresses.extend(sections.stress()[point])
        assert np.interp(solution.place[k], places, stresses) == pytest.approx(solution.stress[k], rel=2e-3)


@pytest.mark.parametrize("name", ["strip", "lumped"])
def test_forces_are_within_their_stated_error(name: str) -> None:
    solution = api.analyze(config(name, "analysis.points=7")).state
    fine = solution.chain.press(solution.travel, solution.side, tolerance=1e-10)
    assert np.abs(solution.leg_force - solution.legs * fine.force).max() < solution.effort_error < 1e-8


def test_printing_allowance_is_not_drawn() -> None:
    thin = api.drawing(config("strip", "mechanism.beam.offset=0.1 mm")).tables[0].columns["thickness"][0]
    np.testing.assert_allclose(thin, 0.97721 * MM)


def test_two_links_with_pins_are_drawn_for_springs() -> None:
    drawn = api.drawing(config("bilancia2019"))
    holes = [contour for contour in drawn.contours if contour.hole]
    apart = holes[1].edges[0].center[0] - holes[0].edges[0].center[0]  # type: ignore[union-attr]
    assert apart == pytest.approx(54 * MM)
    assert TABLE_2[0].length == pytest.approx(54 * MM / 5)


# --- places ---------------------------------------------------------------------------------------------------

PLACES = ("usable_stroke", "usable_start", "usable_end", "range_95", "band_range_05pct", "band_range_1pct")
PLACES += ("band_range_5pct", "run_in_95", "run_in_98")


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("lumped", ()),
        ("strip", ()),
        ("tapered", ()),
        ("tapered", ("analysis.fidelity=lumped",)),
        ("strip", ("mechanism.unloaded_angle=0.5404195002705842 rad",)),  # a corner, where the straight strip buckles
        ("strip", ("analysis.side=before",)),  # this branch begins with a limit point
        ("strip", ("analysis.side=beyond", "mechanism.material.yield_strength=30 MPa")),
        ("strip", ("analysis.travel=[5 mm, 30 mm]", "analysis.window=[6 mm, 29 mm]")),
    ],
)
def test_places_do_not_depend_on_the_number_of_points(name: str, changes: tuple[str, ...]) -> None:
    found = []
    for points in (21, 301):
        one = config(name, *changes, f"analysis.points={points}")
        metrics = api.evaluate(api.analyze(one))
        found.append([metrics[each].value for each in PLACES])
        found[-1].append(metrics["stress_stroke"].value or 0.0)
    assert one.analysis.travel is not None
    assert None not in found[0]
    assert found[0] == pytest.approx(found[1], rel=0, abs=1e-7 * one.analysis.travel[1])


def test_the_course_between_the_points_is_that_of_the_chain_pressed_there() -> None:
    one = api.analyze(config("tapered", "analysis.points=11"))
    travel = np.sort(np.random.default_rng(3).uniform(1e-7, 16 * MM, 40))
    again = one.state.chain.press(travel)
    np.testing.assert_allclose(one.closed.effort("load", travel), again.force, rtol=1e-8)
    np.testing.assert_allclose(
        one.closed.stress("load", travel), again.path.peak_stress().value[again.path.at_requested], 1e-6
    )


def test_the_stress_stroke_is_where_the_pressed_chain_has_the_allowable_stress() -> None:
    one = api.analyze(config("tapered", "analysis.fidelity=lumped", "analysis.points=11"))
    place = one.values["stress_stroke"].value
    path = one.state.chain.press(np.array([place])).path
    assert path.peak_stress().value[path.at_requested[0]] == pytest.approx(42.5e6, rel=1e-6)


@pytest.mark.parametrize("name", ["lumped", "strip"])
def test_friction_that_a_part_of_one_piece_leaves_out_is_said(name: str) -> None:
    spec = cfmkit.load(CONFIGS / f"slider_crank_{name}.yaml").replace({"mechanism.guide": {"friction": 0.1}})
    found = {warning.name: warning.message for warning in cfmkit.analyze(spec).warnings}
    assert "'mechanism.guide' applies only to the model with springs" in found["friction_left_out"]


@pytest.mark.parametrize("strength", [50.0, 500.0])
def test_rubber_that_bears_any_curvature_has_no_thickness_from_the_stress(strength: float) -> None:
    rubber = {"youngs_modulus": 26e6, "poisson_ratio": 0.45, "yield_strength": strength * 1e6}
    strip = config("strip").replace({"mechanism.material": rubber})
    design = family("slider-crank").design.make(strip, Run())
    assert design.status is Status.INFEASIBLE
    assert "far thicker than 'design.beam.thickness', 0.5 mm to 2 mm" in design.message


def test_flexures_of_almost_no_force_are_refused() -> None:
    rates = ", ".join(f"{joint}: 1e-9 N*mm/rad" for joint in ("pivot", "crank_pin", "slider_pin"))
    found = api.design(config("lumped", f"mechanism.springs={{{rates}}}"))
    assert found.spec is None
    assert "stress and force allow flexures of" in found.message

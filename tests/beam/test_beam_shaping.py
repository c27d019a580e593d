"""Shape optimisation of beam networks: variables, limits with their derivatives, starts, audit, notes."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from journal_support import NotesInMemory

from cfmkit import Run, analyze, dumps, evaluate, load, loads
from cfmkit.designing import Clock
from cfmkit.elastica import Polynomial, fit, trace
from cfmkit.families.beam.shaping import multistart, search
from cfmkit.families.beam.shaping.design import find_blocking, missed_by, optimise_shape, task_of
from cfmkit.families.beam.shaping.limits import half_band
from cfmkit.families.beam.shaping.multistart import (
    audit_design,
    band_and_range,
    explore,
    lines_cross,
    scatter_within_tolerances,
)
from cfmkit.families.beam.shaping.report import judge_design, write_design
from cfmkit.families.beam.shaping.response import view_closely
from cfmkit.families.beam.shaping.search import (
    ShapeCandidate,
    StartBudget,
    evaluate_in_model,
    flatten,
    search_start,
    verify,
)
from cfmkit.families.beam.shaping.spec import Tolerances
from cfmkit.families.beam.shaping.sqp_program import Flattest, ForceRatio, Shaping, Widest
from cfmkit.families.beam.shaping.task_and_variables import (
    STRESS_MARGIN,
    Task,
    TaskLimits,
    Variables,
    candidates,
    lengths,
    sound,
)
from cfmkit.numerics import ThroughPoints
from cfmkit.results import Status
from cfmkit.specs import TargetCurve

TABLE_3 = np.array([0.0, 30.5, 18.77, 12.44, 24.0, 1.3092, -1.5707, -0.7560, 1.5707, 0.3013, 1.5707, 0.226, -1.148])


@cache
def lan(objective: str = "ripple", compared: tuple[float, float] | None = None) -> Task:
    """The problem of Tables 1 and 2 of Lan, Wang, Chen (2010), as the config has it."""
    spec = load("configs/beam_design_lan.yaml", ["analysis.fidelity=inextensible"])
    task = task_of(spec, spec.design.optimise)
    return replace(task, orders=(2,), objective=objective, compared=compared)


def table_3(task: Task) -> np.ndarray:
    """Their result as design variables."""
    x = TABLE_3.copy()
    x[:5] *= 1e-3 / task.size
    return x


def found_of(task: Task, x: np.ndarray, start: float = 6.8e-3) -> ShapeCandidate:
    return ShapeCandidate(x, 2, start, 0.03, 0.003, "", 0)


ALL = TaskLimits(
    stress=48e6,
    envelope=(2.5e-3, 34.5e-3, 0.0, 40e-3),
    deformed_envelope=(0.0, 40e-3, -1e-3, 41e-3),
    clearance=0.5e-3,
    radius=4e-3,
    force_min=5.0,
    force_target=9.0,
)


@pytest.mark.parametrize("fidelity", ["inextensible", "reissner"])
@pytest.mark.parametrize("goal", [Flattest(), Widest(13.6e-3, 0.025), ForceRatio()])
def test_derivatives_of_objective_and_all_limits_are_those_of_differences(goal: Any, fidelity: str) -> None:
    """Derivatives of the limits by the start of the window are left out on purpose: it is held here."""
    spec = load("configs/beam_design_lan.yaml", [f"analysis.fidelity={fidelity}"])
    task = replace(task_of(spec, spec.design.optimise), orders=(2,), compared=(8.8e-3, 4e-3), limits=ALL)
    program = Shaping(Variables(task, 2), 6.8e-3, goal)
    z = program.begin(table_3(task))
    assert z is not None
    objective, rows = program.slopes(z)
    names = [one.name for one in program.view(z[:13]).list_limits() for _ in one.values]
    assert {"stress", "envelope", "clearance", "min_radius", "force"} <= set(names)
    rng = np.random.default_rng(0)
    for _ in range(2):
        way, step = rng.standard_normal(len(z)), 2e-6
        if isinstance(goal, Widest):
            way[-1] = 0.0
        (up, above), (down, below) = program.values(z + step * way), program.values(z - step * way)
        assert objective @ way == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-7)
        np.testing.assert_allclose(rows @ way, (above - below) / (2 * step), rtol=2e-4, atol=2e-4)


def test_only_rows_that_hold_by_far_go_without_derivatives() -> None:
    spec = load("configs/beam_design_lan.yaml", ["analysis.fidelity=reissner"])
    task = replace(task_of(spec, spec.design.optimise), limits=ALL)
    all_of, near = (Shaping(Variables(task, 2), 6.8e-3, Flattest(), slopes_below=most) for most in (np.inf, 0.5))
    z = all_of.begin(table_3(task))
    values, whole, some = all_of.values(z)[1], all_of.slopes(z)[1], near.slopes(z)[1]
    np.testing.assert_array_equal(near.values(z)[1], values)
    left_out = (whole != some).any(axis=1)
    assert values[left_out].min() >= 0.5
    assert left_out.sum() > 50
    np.testing.assert_allclose(some[~left_out], whole[~left_out], rtol=1e-12)
    assert not some[left_out].any()
    none = Shaping(Variables(task, 2), 6.8e-3, Flattest(), slopes_below=-10.0).slopes(z)[1]
    assert none.shape == whole.shape


def test_the_widest_window_has_the_derivative_of_the_force_by_its_start() -> None:
    task = lan()
    program = Shaping(Variables(task, 2), 6.8e-3, Widest(13.6e-3, 0.025))
    z = program.begin(table_3(task))
    _, rows = program.slopes(z)
    step = np.zeros_like(z)
    step[-1] = 1e-5
    band = slice(0, 98)
    slope = (program.values(z + step)[1] - program.values(z - step)[1])[band] / 2e-5
    np.testing.assert_allclose(rows[band, -1], slope, atol=1e-4)


def test_table_3_has_the_half_band_that_its_range_says() -> None:
    """Computed by two other solvers, with stretching and shear, too."""
    task = lan()
    found = found_of(task, table_3(task))
    assert audit_design(task, found).sound
    design = judge_design(load("configs/beam_design_lan.yaml", ["analysis.fidelity=inextensible"]), task, found)
    assert design.half_band == pytest.approx(0.0309, abs=1e-4)
    assert metric(design.spec, "strict_range_fraction") == pytest.approx(0.479, abs=1e-3)
    assert metric(design.spec.replace({"analysis.fidelity": "reissner"}), "half_band") == pytest.approx(
        0.0344, abs=2e-4
    )
    assert metric(design.spec, "stress_max") == pytest.approx(48.31e6, rel=3e-3)
    assert (scatter_within_tolerances(task, found, Tolerances(samples=4)).bands > 0.02).all()


def test_a_design_of_another_model_is_ranked_as_its_analysis_in_this_one() -> None:
    """Without any extent beams have no shape: nothing is worse."""
    task = lan()
    found = replace(found_of(task, table_3(task)), objective=0.0, violation=0.0)
    again = evaluate_in_model(task, found)
    judged = judge_design(load("configs/beam_design_lan.yaml", ["analysis.fidelity=inextensible"]), task, found)
    assert again.objective == pytest.approx(judged.half_band, rel=0.02)
    assert again.violation > 0.0  # its stress is 48.3 MPa, 48 are allowed
    collapsed = replace(found, x=0.0 * found.x)
    assert evaluate_in_model(task, collapsed).violation == np.inf


def metric(spec: Any, name: str) -> float | None:
    """A metric of the analysis over the window of the specification."""
    return evaluate(analyze(spec), [name])[name].value


def seen_at(points: int) -> tuple[Task, ShapeCandidate]:
    """Table 3 from 9 mm on as a search with so many poses in the window sees it."""
    task = replace(lan(), points=points)
    found = found_of(task, table_3(task), 9e-3)
    view = found.view(task)
    return task, replace(found, objective=half_band(view.response.force[view.poses.window]), violation=0.0)


def test_a_design_is_ranked_by_its_force_between_the_poses_too() -> None:
    task, found = seen_at(2)
    kept = verify(replace(task, limits=TaskLimits()), found, StartBudget(), lambda _, design: design)
    view = view_closely(task, kept.network(task))
    assert view is not None
    assert kept.objective == view.half_band(found.start)
    assert kept.objective > 1.5 * found.objective  # the largest force lies between the two


def test_a_design_that_is_to_follow_a_curve_is_ranked_by_how_well_it_does() -> None:
    task, found = seen_at(33)
    plain = view_closely(task, found.network(task))
    assert plain is not None
    own = ThroughPoints(tuple(plain.at.tolist()), tuple(plain.force.tolist()))  # what it does is what it is to do
    task = replace(task, limits=TaskLimits(), shape=TargetCurve(own, "force"))
    kept = verify(task, replace(found, objective=0.0), StartBudget(), lambda _, design: design)
    assert plain.half_band(found.start) > 0.004
    assert kept.objective < 1e-5


def test_where_the_poses_do_not_show_the_force_the_search_goes_on_with_more_of_them() -> None:
    task, found = seen_at(2)
    tried: list[int] = []

    def again(finer: Task, design: ShapeCandidate) -> ShapeCandidate:
        tried.append(finer.points)
        return replace(design, objective=1.0 if finer.points > 33 else design.objective)

    kept = verify(replace(task, limits=TaskLimits()), found, StartBudget(), again)
    assert tried == [33, 65]
    assert kept.points == 65


def test_a_window_that_is_not_kept_between_the_poses_is_cut_to_where_it_is() -> None:
    task, found = seen_at(17)
    task = replace(task, limits=TaskLimits(), objective="range", half_band=0.05)
    kept = verify(task, replace(found, start=3e-3, objective=0.05), StartBudget(), lambda _, design: design)
    assert 3e-3 < kept.start <= task.window[0]
    assert kept.objective <= 0.05
    wider = view_closely(task, kept.network(task))
    assert wider is not None
    assert wider.half_band(kept.start - 2e-5) > 0.05


def test_a_widened_window_goes_as_far_as_the_force_keeps_the_band() -> None:
    task, found = seen_at(17)
    task = replace(task, limits=TaskLimits(), objective="range", half_band=0.05)
    kept = verify(task, replace(found, start=6.7e-3, objective=0.04), StartBudget(), lambda _, design: design)
    assert kept.start < 6.7e-3
    assert 0.0495 < kept.objective <= 0.05
    mean = 9.6  # of the force from 6.7 mm on; it is less over a wider window
    kept = verify(
        replace(task, limits=TaskLimits(force_min=mean)),
        replace(found, start=6.7e-3, objective=0.04),
        StartBudget(),
        lambda _, design: design,
    )
    assert kept.start == 6.7e-3


def test_stress_that_is_missed_at_few_poses_is_a_limit_that_is_missed() -> None:
    task, found = seen_at(17)
    task = replace(task, limits=TaskLimits(stress=40e6))
    kept = verify(task, found, StartBudget(), lambda _, design: design)
    assert kept.violation == pytest.approx(48.2187e6 / task.allowable_stress - 1, abs=1e-3)  # Table 3 at 13.6 mm
    assert not kept.feasible


def test_the_search_limits_the_stress_that_the_analysis_judges() -> None:
    spec = load("configs/beam_design_lan.yaml", ["analysis.fidelity=reissner"])
    task = replace(task_of(spec, spec.design.optimise), orders=(2,))
    assert task.total_stress
    program = Shaping(Variables(task, 2), 6.8e-3, Flattest())
    view = program.view(table_3(task))
    rows = [one for one in view.list_limits() if one.name == "stress"]
    worst = max(float((1 - one.values).max()) for one in rows) * task.limits.stress
    path = view.response.path
    assert worst == pytest.approx(float(path.peak_stress(axial=True).value.max()), rel=STRESS_MARGIN)
    assert worst > 1.01 * float(path.peak_stress(axial=False).value.max())


@pytest.mark.parametrize("change", ["analysis.fidelity=inextensible", "analysis.fidelity=reissner"])
def test_a_design_says_of_itself_what_its_analysis_says(change: str) -> None:
    """About 5 s: two starts of one beam."""
    spec = load(
        "configs/beam_design_arch.yaml",
        [change, "design.optimise.objective=range", "design.optimise.half_band=1.5 %", "design.optimise.orders=[1, 2]"],
    )
    design = optimise_shape(spec, spec.design.optimise, Run())
    assert design.status is Status.COMPLETE
    written_again = loads(dumps(design.spec))
    result = analyze(written_again)
    band = evaluate(result, ["half_band"])["half_band"].value
    start, end = written_again.analysis.window
    assert band <= 0.015
    assert start < 6e-3
    reported = re.search(r"force within ± (\S+) % over (\S+) % of the travel", design.message)
    shares = [float(share) for share in reported.groups()]
    assert shares == pytest.approx([100 * band, 100 * (1 - start / end)], rel=5e-3)
    other = evaluate(analyze(written_again.replace({"analysis.fidelity": "reissner"})), ["half_band"])["half_band"]
    known = design.search.get("audit_half_band_reissner")
    assert known is None if "reissner" in change else known.quantity.value == other.value
    assert not set(design.search) & set(evaluate(result))


def test_lengths_and_chords_are_those_of_the_fitted_beams() -> None:
    task = lan()
    variables = Variables(task, 2)
    x = table_3(task)
    network = variables.build(x)
    for name, one in lengths(variables, x, variables.build(x)).items():
        beam = network.beams[name]
        a, b = network.nodes[beam.start], network.nodes[beam.end]
        fitted = fit(beam, (b.x - a.x, b.y - a.y))
        assert one.length == pytest.approx(float(fitted.length), rel=1e-10)
        assert one.straightness == pytest.approx(np.hypot(b.x - a.x, b.y - a.y) / float(fitted.length), rel=1e-10)


def test_raising_the_order_keeps_the_shape() -> None:
    task = lan()
    low, x = Variables(task, 2).change_order(table_3(task), 1)
    high, y = low.change_order(x, 3)
    assert (low.count, high.count) == (9, 17)
    assert high.build(y).beams["b3"].shape == Polynomial((0.0, 0.3013, 0.0, 0.0))
    assert low.build(x).nodes["n3"] == high.build(y).nodes["n3"]


def test_random_starts_are_straight_inside_uncrossed_and_repeatable() -> None:
    variables = Variables(lan(), 0)
    first, again = (candidates(variables, np.random.default_rng([3, 1])) for _ in range(2))
    for _ in range(20):
        x = next(first)
        np.testing.assert_array_equal(x, next(again))
        assert sound(variables, x)
        assert ((x >= variables.bounds[:, 0]) & (x <= variables.bounds[:, 1])).all()
    crossed = np.array([0.0, 30.0, 20.0, 10.0, 5.0]) * 1e-3 / variables.task.size
    assert not sound(variables, crossed)


def test_the_written_design_is_the_one_that_was_found() -> None:
    task = lan()
    spec = load("configs/beam_design_lan.yaml", ["analysis.fidelity=inextensible"])
    new = write_design(spec, task, found_of(task, table_3(task), 7e-3))
    assert new.analysis.window == (pytest.approx(7e-3, abs=1e-6), 13.6e-3)
    from cfmkit.families.beam.network_from_spec import assemble

    drive = replace(assemble(new).drive(), points=np.array([13.6e-3]))
    path = trace(assemble(new).network, drive)
    assert 2 * path.effort[-1] == pytest.approx(9.739693, rel=1e-6)  # F_d of Table 3, closed by turning and scaling
    assert max(one.gap for one in path.fits.values()) < 1e-12


def test_flat_ranges_are_measured_from_the_end() -> None:
    at = np.linspace(0.0, 10.0, 61)
    assert band_and_range(at, np.minimum(at / 4, 1.0) + 1e-9, 2.0)[1] == pytest.approx(0.62, abs=0.01)
    assert band_and_range(at, 1 + 0.02 * np.sin(at), 2.0)[0] == pytest.approx(0.02, abs=1e-4)


def test_lines_cross_but_not_in_the_joint_where_they_end() -> None:
    one = np.array([[0.0, 0.0], [1.0, 0.1], [2.0, 0.0]])
    off = np.array([[2.0 + 1e-7, 1e-7], [1.5, 1.0], [0.0, 2.0]])  # joined to within the error of a path
    over = np.array([[1.5, -1.0], [1.4, 1.0], [0.0, 2.0]])
    assert not lines_cross(one, off, True)
    assert lines_cross(one, over, False)
    assert not lines_cross(one, one, True)


def test_the_objective_of_the_paper_falls_without_the_force_getting_flatter() -> None:
    """[Lan, eq. 1] is F(a)/F(b) - 1: nothing keeps it from going below zero, where the force falls from b to a."""
    task = lan("paper", (8.8e-3, 4e-3))
    program = Shaping(Variables(task, 2), 6.8e-3, ForceRatio())
    assert program.values(program.begin(table_3(task)))[0] == pytest.approx(0.30214615, abs=2e-5)
    # a search from their result itself may end in a local optimum: from shapes that are bent 1 % less, or more
    shapes = np.arange(len(table_3(task))) >= len(task.coordinates)
    begun = [found_of(task, table_3(task) * (1 + off * shapes)) for off in (-0.01, 0.01)]
    ended = min((flatten(task, one, StartBudget(flattening=15)) for one in begun), key=lambda one: one.objective)
    view = program.view(ended.x)
    force = view.response.force[view.poses.window]
    assert ended.objective < 0.15
    assert np.ptp(force) / (force.max() + force.min()) > 0.04


def test_a_force_out_of_reach_is_named_with_the_nearest_one() -> None:
    task = replace(lan(), limits=replace(lan().limits, force_min=200.0))
    start = found_of(task, table_3(task))
    assert next(iter(missed_by(task, start))) == "force"
    found = find_blocking(task, [start], StartBudget(meeting=4))
    assert found.freed is None
    assert "force" in found.missed
    text = found.nearest.get("design.optimise.force.min", "at most 0 N")
    assert float(text.split()[2]) < 200.0


def test_finished_starts_are_noted_and_used_again() -> None:
    task, notes = lan(), NotesInMemory()
    plan = StartBudget(drawn=3, tries=1, meeting=1, flattening=1)
    first = explore(task, plan, (2, 1), "x", Run(notes=notes))
    again = explore(task, plan, (3, 1), "x", Run(notes=notes))
    other = explore(task, plan, (2, 1), "y", Run(seed=1, notes=notes))
    assert (first.reused, again.reused, other.reused) == (0, 2, 0)
    for index in (0, 1):
        if first.designs[index] is not None:
            np.testing.assert_array_equal(first.designs[index].x, again.designs[index].x)


def test_the_widest_designs_are_widened_again_in_finer_orders_and_none_gets_narrower(monkeypatch) -> None:
    task = replace(lan("range"), orders=(1, 3, 4, 5))
    started = [one.started.orders for one in (task, lan(), replace(task, orders=(4, 5)))]
    assert started == [(1, 3), (2,), (4, 5)]
    gain = {4: 0.5e-3, 5: -0.5e-3}
    for name, step in {
        "_minimise_objective": lambda _task, found, order, _plan, _steps: replace(found, order=order),
        "widen": lambda _task, found, _plan: replace(found, start=found.start - gain[found.order]),
    }.items():
        monkeypatch.setattr(search, name, step)
    begun = ShapeCandidate(np.zeros(17), 3, 4e-3, 0.02, 0.0, "", 0)
    ended = search.refine(task, begun, StartBudget())
    assert (ended.start, ended.order) == (3.5e-3, 4)
    assert search.refine(task, replace(begun, objective=0.5), StartBudget()).start == 4e-3


def test_the_progress_of_a_search_never_goes_back_and_ends_at_one(monkeypatch) -> None:
    """It had gone from 1 to 0.75 where the widest designs are refined."""
    flat = ShapeCandidate(np.zeros(17), 3, 6.8e-3, 0.02, 0.0, "", 0)
    for name in ("search_start", "search_far"):
        monkeypatch.setattr(multistart, name, lambda _task, _seed, _index, plan: flat)
    for name in ("widen", "search_nearer", "refine"):
        monkeypatch.setattr(multistart, name, lambda _task, found, _plan: found)
    monkeypatch.setattr(multistart, "audit_design", lambda _variables, _found: None)
    told: list[float] = []
    for orders in ((1, 3), (1, 3, 4)):
        told.clear()
        task = replace(lan("range"), orders=orders)
        explore(task, StartBudget(), (4, 2), "x", Run(progress=lambda share, _text: told.append(share)))
        assert told == sorted(told)
        assert told[-1] == pytest.approx(1.0)
        assert len(set(told)) > 8


def test_of_two_designs_of_a_start_the_wider_one_is_kept(monkeypatch) -> None:
    """One is of the requested window, one of a window that begins farther; the three flattest of these are led on."""
    near, far = (ShapeCandidate(np.zeros(17), 3, start, 0.02, 0.0, "", 0) for start in (4e-3, 3.4e-3))
    bands = {0: 0.05, 1: 0.024, 2: 0.04, 3: 0.03, 4: 0.06}
    led = {0.05: 5e-3, 0.024: 3.8e-3, 0.04: 4.5e-3, 0.03: 3.9e-3, 0.06: 1e-3}

    for name, step in {
        "search_start": lambda _task, _seed, _index, plan: near,
        "widen": lambda _task, found, _plan: found,
        "audit_design": lambda _task, _found: None,
        "search_far": lambda _task, _seed, index, plan: replace(far, objective=bands[index]),
        "search_nearer": lambda _task, found, _plan: replace(found, start=led[found.objective], objective=0.02),
    }.items():
        monkeypatch.setattr(multistart, name, step)
    ended = explore(replace(lan("range"), orders=(1, 3)), StartBudget(), (5, 5), "x", Run())
    assert [ended.designs[index].start for index in range(5)] == [4e-3, 3.8e-3, 4e-3, 3.9e-3, 4e-3]


def test_a_widening_that_more_poses_refute_keeps_the_window_that_they_confirm(monkeypatch) -> None:
    """Of one whose repair fails all was given up, though what they refuted kept the band over nearly its window."""
    task = lan("range")
    good = ShapeCandidate(np.zeros(17), 3, 6.8e-3, 0.02, 0.0, "", 0)
    wide = replace(good, start=3.4e-3, objective=task.half_band)
    for name, step in {
        "_widest": lambda _task, _found, _plan: wide,
        "_repair": lambda _task, _wide, kept, _plan: kept,
        "round_design": lambda _task, found: found,
        "view_closely": lambda _task, _network: object(),
        "_shows_all": lambda _task, found, _view: found.start == good.start,
        "_as_seen": lambda _task, found, _view: replace(found, start=3.6e-3) if found.start < 4e-3 else found,
    }.items():
        monkeypatch.setattr(search, name, step)
    ended = search.widen(task, good, StartBudget())
    assert (ended.start, ended.feasible) == (3.6e-3, True)


def test_no_time_means_no_start_and_nothing_noted() -> None:
    notes = NotesInMemory()
    late = StartBudget(clock=Clock(0.0))
    result = explore(lan(), late, (2, 1), "x", Run(notes=notes))
    assert (result.designs, result.missing, notes.keys) == ({}, 2, {})
    assert search_start(lan(), 0, 0, late) is None


@pytest.mark.parametrize("steps", [0, 1, 3])
def test_a_search_that_pushes_two_joined_nodes_into_one_place_has_no_answer_there(steps: int) -> None:
    task = replace(lan(), limits=ALL)
    x = table_3(task)
    x[3], x[4] = x[1] + steps * np.spacing(x[1]), x[2]  # n4 on n3 but for rounding: nothing is left of b3
    program = Shaping(Variables(task, 2), 6.8e-3, Flattest())
    assert program.begin(x) is None
    assert program.view(x) is None


def test_a_design_takes_the_place_of_another_only_if_it_meets_its_limits_and_is_better():
    task, better = SimpleNamespace(objective="stress"), multistart._better
    designs = (SimpleNamespace(feasible=fits, objective=own) for fits, own in ((True, 1), (True, 2), (False, 0)))
    best, good, missed = designs
    assert better(task, best, good)
    assert better(task, good, missed)
    assert better(task, good, None)
    assert not any(better(task, *pair) for pair in ((good, best), (missed, None), (missed, good), (None, None)))

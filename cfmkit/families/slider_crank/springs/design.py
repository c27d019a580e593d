"""Springs, and free lengths, for a torque or force in a given window, or in the widest that keeps a tolerance.

It reports which other designs are as good.

The effort is linear in the springs' rates: with the lengths given, the best rates are the solution of a linear
programme or of a least-squares problem. Lengths are searched outside of that, on a grid
and then inside its best cell, the unloaded position's lead on a logarithmic scale.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 6.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.1.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import CannotBuild, Infeasible, no_design, refusals_answered
from cfmkit.families.rows import with_values
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage import resolve
from cfmkit.families.slider_crank.springs.bought_springs import choose, least_deviation, next_sets
from cfmkit.families.slider_crank.springs.design_outcome import (
    ChosenSprings,
    active_bounds,
    audit,
    check_reach,
    describe_springs,
    explain_hopeless,
    explain_impossible_slope,
    explain_no_window,
    explain_too_wide,
    message,
    search_of,
    warn_not_proven,
)
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import choose_preferred, least_squares, minimax, ranges
from cfmkit.families.slider_crank.springs.rate_fit_task import FREE_LENGTH_KEYS, N_WINDOW_PLACES, task_of, with_lengths
from cfmkit.families.slider_crank.springs.rates_for_widest_window import widest, widest_of_all
from cfmkit.families.slider_crank.springs.solution import BAND_EDGE_FACTOR
from cfmkit.families.slider_crank.springs.sprung_linkage import FULL_TURN
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.numerics.box_search import BoxAxis, Lowest, lowest
from cfmkit.results import Design, Status
from cfmkit.specs.units import Place, format_short

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.spec import CrankDesign, SliderCrankSpec
    from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal
    from cfmkit.families.slider_crank.springs.rate_fit_task import SpringTask
    from cfmkit.results import Finding


MAX_DEVIATION = 0.5  # springs that miss the target by more are no design, even where no tolerance is stated
N_NEXT_SETS = 4  # sets of bought springs that are tried where the best one does not have the yield
GRID_SIZES = {"least-squares": (13, 20), "minimax": (11, 14), "widest": (5, 10)}
"""Values of each free length on the grid, and around its best: a least-squares problem costs the least."""


@refusals_answered
def design(spec: SliderCrankSpec, run: Run) -> Design:
    """Return a complete specification with the springs, and the lengths left free, that meet the `design` block best.

    INFEASIBLE, with the reason and what would be feasible, if nothing keeps the tolerance.
    """
    wanted = spec.design
    if wanted is None:
        return Design(None, Status.INVALID, "this spec has no 'design' block: add 'torque' or 'force', and a window")
    solved, search = _search_lengths(spec, wanted, run)
    solved = _compensate_friction(solved)
    design = _make_design(solved, search)
    others = range(N_NEXT_SETS if solved.bought else 0)
    return replace(design, next_best=tuple(partial(_design_next_set, solved, rank) for rank in others))


@refusals_answered
def _design_next_set(solved: ChosenSprings, rank: int) -> Design:
    """Return the design with springs that are not the best of the catalogue, with the same lengths."""
    goal = solved.task.goal(solved.window, _places(solved.task.wanted))
    sets = [] if goal is None else next_sets(solved.task, goal, solved.window, N_NEXT_SETS)
    if goal is None or rank >= len(sets):
        return no_design(finding("no_spring_fits", "no other springs of the catalogue hold the target"))
    chosen = sets[rank]
    rms = goal.rms(chosen.rates)
    bought = replace(
        solved, rates=chosen.rates, deviation=chosen.deviation, rms=rms, bought=chosen.options, exact=False
    )
    return _make_design(bought, None)


def _make_design(solved: ChosenSprings, search: Lowest | None) -> Design:
    """Return what was found as a design, audited."""
    wanted = solved.task.wanted
    solved = _keep_if_audited(audit(solved, _write_springs(solved)))
    warnings = (*describe_springs(solved), *alternatives(solved, search))
    if wanted.window is None and (search is not None or not solved.proven):
        warnings = (*warnings, warn_not_proven(solved, search is not None))
    return Design(
        _write_springs(solved),
        Status.COMPLETE,
        message(solved),
        active_bounds(solved, wanted),
        warnings=warnings,
        search=search_of(solved),
    )


MAX_ROUNDS = 40  # rounds in which springs and the friction that they cause are fitted to each other; some 10 are enough


def _compensate_friction(solved: ChosenSprings) -> ChosenSprings:
    """Return springs that hold the target with the friction that they cause, on the way that the design names."""
    task = solved.task
    if task.wanted.branch is None or not task.assembly.rubbing.is_present:
        return solved
    for _ in range(MAX_ROUNDS):
        again = solve(replace(task, rates=solved.rates))
        change = np.abs(again.rates - solved.rates).max()
        solved = again
        if change <= 1e-12 * np.abs(again.rates).max():
            break
    return solved


def _keep_if_audited(solved: ChosenSprings) -> ChosenSprings:
    """Return a design that keeps its tolerance where it was audited.

    A widest window whose springs are farther off between the places that the search looked at than its reserve allows
    is looked for again, by as much stricter.

    Raises Infeasible if a given window does not allow it.
    """
    tolerance = solved.task.wanted.tolerance
    if tolerance is None or not solved.exact or solved.deviation <= tolerance * BAND_EDGE_FACTOR:
        return solved
    if solved.task.wanted.window is None:
        again = solve(solved.task, tolerance * tolerance / solved.deviation)
        again = audit(again, _write_springs(again))
        if again.deviation <= tolerance * BAND_EDGE_FACTOR:
            return again
    raise Infeasible(*explain_too_wide(solved.task, solved.deviation))


def _search_lengths(spec: SliderCrankSpec, wanted: CrankDesign, run: Run) -> tuple[ChosenSprings, Lowest | None]:
    """Return the best design, and the search that led to its lengths."""
    ranges = {name: ends for name in FREE_LENGTH_KEYS if (ends := getattr(wanted, name)) is not None}
    axes = {name: BoxAxis(low, high, log=name != "offset") for name, (low, high) in ranges.items()}
    if not axes:
        return solve(task_of(spec)), None

    count, best = 0, math.inf

    def height(place: tuple[float, ...]) -> float:
        nonlocal count, best
        count += 1
        run.progress(1.0 - 1.0 / (1.0 + count / 200.0), f"{count} choices of lengths")
        value = _score_lengths(spec, dict(zip(axes, place, strict=True)), best)
        best = min(best, value)
        return value

    grid, fine = GRID_SIZES["widest" if wanted.window is None else wanted.objective]
    best_lengths = lowest(height, tuple(axes.values()), grid if len(axes) < 3 else min(grid, 7), fine)
    if not math.isfinite(best_lengths.value):
        names = " or ".join(f"'design.{name}'" for name in axes)
        text = f"no lengths in the ranges given reach the window within the limits of the joints; widen {names}"
        raise finding.infeasible("infeasible_targets", text)
    place = even_best(spec, tuple(axes), best_lengths) if wanted.slack else best_lengths.place
    return solve(task_of(with_lengths(spec, dict(zip(axes, place, strict=True))))), best_lengths


def _score_lengths(spec: SliderCrankSpec, lengths: dict[str, float], best: float) -> float:
    """Return what a choice of lengths is judged by: the deviation, or the width of the window with a minus.

    Lengths whose deviation with springs of any rate is above the `best` so far need no look at a catalogue.
    """
    try:
        task = task_of(with_lengths(spec, lengths))
    except CannotBuild:
        return math.inf
    wanted = task.wanted
    if wanted.window is None:
        window = widest(task, wanted.tolerance or 0.0)
        return math.inf if window is None else -window.width
    first, last = task.allowed
    if wanted.window[0] < first - 1e-9 or wanted.window[1] > last + 1e-9:
        return math.inf
    try:
        fitted = _fit_rates(task, wanted.window)
    except Infeasible:
        fitted = None
    if fitted is None:
        return math.inf
    goal, rates = fitted
    deviation = goal.rms(rates) if wanted.objective == "least-squares" else goal.deviation(rates)
    if wanted.catalogue and deviation < best:
        return least_deviation(task, goal, wanted.window)
    return deviation


def _places(wanted: CrankDesign) -> int | None:
    """Return at how many places of the window springs are chosen; None: as many as a search takes."""
    return None if wanted.objective == "least-squares" else N_WINDOW_PLACES


def solve(task: SpringTask, tolerance: float | None = None) -> ChosenSprings:
    """Return the best springs for given lengths, for the design's tolerance or another one.

    Raises Infeasible if nothing keeps the tolerance, or the window cannot be reached.
    """
    wanted, proven = task.wanted, True
    if wanted.window is None:
        fitted, proven = widest_of_all(task, tolerance or wanted.tolerance or 0.0)
        if fitted is None:
            raise Infeasible(explain_no_window(task))
        window = fitted.low, fitted.high
    else:
        window = wanted.window
        check_reach(task, window)
    goal = task.goal(window, _places(wanted))
    if goal is None:
        text = "in the window the force or torque is unbounded: it contains a dead point or the stretched position"
        text += f"; change 'design.{task.assembly.motion_name}'"
        raise finding.infeasible("infeasible_targets", text)
    if wanted.catalogue:
        picked = choose(task, goal, window)
        if picked.deviation > MAX_DEVIATION and wanted.tolerance is None:
            raise Infeasible(explain_hopeless(task, picked.deviation))
        rms, places = goal.rms(picked.rates), len(goal.wanted)
        return ChosenSprings(task, window, picked.rates, picked.deviation, rms, proven, places, bought=picked.options)
    rates = _best_rates(goal, wanted)
    if rates is None:
        raise Infeasible(explain_impossible_slope(task))
    if not rates.any():
        raise Infeasible(explain_impossible_slope(task) if wanted.hold_stiffness else explain_no_window(task))
    if wanted.slack:
        rates = chosen_rates(goal, rates, wanted, tolerance or wanted.tolerance)
    deviation = goal.deviation(rates)
    if deviation > MAX_DEVIATION and wanted.tolerance is None:
        raise Infeasible(explain_hopeless(task, deviation))
    if wanted.window is not None and wanted.tolerance is not None and deviation > wanted.tolerance:
        raise Infeasible(*explain_too_wide(task, deviation))
    return ChosenSprings(task, window, rates, deviation, goal.rms(rates), proven, len(goal.wanted))


def _write_springs(solved: ChosenSprings) -> SliderCrankSpec:
    """Return the spec with springs and lengths written in, and an analysis that looks where the design did."""
    spec, wanted = resolve(solved.task.spec), solved.task.wanted
    rates = dict(zip(JOINT_NAMES, solved.rates.tolist(), strict=True))
    anchor = {"anchor": spec.mechanism.springs.anchor or 0.0} if wanted.anchor_travel is not None else {}
    bought = {"bought": tuple(option.written for option in solved.bought)}
    springs = spec.mechanism.springs.model_copy(update=rates | anchor | bought)
    mechanism = spec.mechanism.model_copy(update={"springs": springs})
    if wanted.target is not None:
        reported = wanted.target.written_out(wanted.torque or wanted.force)
        spec = with_values(spec, {"design.target": reported, "design.torque": None, "design.force": None})
    if any(getattr(wanted, name) is not None for name in ("crank_length", "offset")):
        mechanism = solved.task.spec.mechanism.model_copy(update={"springs": springs})
    assembly = solved.task.assembly
    written: dict[str, object] = {"drive": assembly.drive, f"reference_{assembly.motion_name}": _reference(solved)}
    if wanted.window is None or spec.analysis.window is None:
        written["window"] = tuple(Place(end, assembly.dimension) for end in solved.window)
    written |= _motion_to_show(solved)
    analysis = spec.analysis.model_copy(update=written)
    return spec.model_copy(update={"mechanism": mechanism, "analysis": analysis})


def _motion_to_show(solved: ChosenSprings) -> dict[str, tuple[float, float]]:
    """Return the motion of the analysis, if it has to be another one to show all of the window, and nothing forbidden.

    Where none is requested, the joints' limits are those of the motion, too.
    """
    name = solved.task.assembly.motion_name
    asked: tuple[float, float] | None = getattr(solved.task.spec.analysis, name)
    if asked is None and solved.task.spec.mechanism.limits is not None:
        return {name: solved.task.allowed}
    low, high = asked or solved.task.assembly.default_motion()
    if low <= solved.window[0] and solved.window[1] <= high:
        return {}
    if asked is None and high - low >= FULL_TURN and solved.window[1] <= low:
        return {name: (low - FULL_TURN, low)}
    return {name: (min(low, solved.window[0]), max(high, solved.window[1]))}


def _reference(solved: ChosenSprings) -> float:
    """Return the place nearest to the middle of the window at which the effort is exactly the target."""
    from cfmkit.numerics.roots import bracketed_root

    low, high = solved.window
    places = np.linspace(low, high, N_WINDOW_PLACES)
    if solved.task.wanted.curve is not None:
        return 0.5 * (low + high)
    legs, target = solved.task.spec.mechanism.sets, solved.task.wanted.size
    unit = solved.task.assembly
    offset = solved.rates @ unit.units(places).effort * legs - target
    change = np.flatnonzero(np.isfinite(offset[:-1]) & (offset[:-1] * offset[1:] <= 0.0))
    if not len(change):
        return 0.5 * (low + high)
    at = int(change[np.argmin(np.abs(places[change] - 0.5 * (low + high)))])

    def measure_error(motion: float) -> float:
        return float(solved.rates @ unit.units(np.array([motion])).effort[:, 0]) * legs - target

    return bracketed_root(measure_error, float(places[at]), float(places[at + 1]))


DEVIATION_TOL = 5e-4
"""More deviation, as a fraction of the target, that nobody would notice: such designs are reported as equals."""
TOLERANCE_RESERVE = 1e-3
"""Share of the tolerance that preferred rates keep in reserve: between the places of the search they deviate more, by
some 1e-5 of the tolerance."""
N_PROGRAMME_PLACES = 60  # places of the window for the programmes that say how far the rates may move


def chosen_rates(goal: RateGoal, best: FloatArray, wanted: CrankDesign, tolerance: float | None) -> FloatArray:
    """Return the rates preferred among those whose deviation is worse than the best by no more than the slack.

    Where a tolerance is stated, the slack ends there: a design that keeps it is not given up for a preference.
    """
    if wanted.prefer == "small-rotation":  # a matter of lengths only
        return best
    least, most = goal.deviation(best), math.inf if tolerance is None else tolerance
    preferred = choose_preferred(
        goal, min(least + wanted.slack, max(least, most * (1.0 - TOLERANCE_RESERVE))), wanted.prefer
    )
    return best if preferred is None or goal.deviation(preferred) > max(least, most) else preferred


def even_best(spec: SliderCrankSpec, names: tuple[str, ...], search: Lowest) -> tuple[float, ...]:
    """Return the lengths preferred among those on the search's first axis that are worse by no more than the slack.

    Where a tolerance is stated, they keep it.
    """
    wanted = spec.design
    if wanted is None or wanted.window is None or wanted.prefer != "small-rotation":
        return search.place
    good = [place for place, value in search.profile if value <= search.value + wanted.slack]
    window, tolerance = wanted.window, wanted.tolerance

    def task(place: tuple[float, ...]) -> SpringTask:
        return task_of(with_lengths(spec, dict(zip(names, place, strict=True))))

    if tolerance is not None:
        fits, most = [_fit_rates(task(place), window) for place in good], tolerance * (1.0 - TOLERANCE_RESERVE)
        good = [place for place, fit in zip(good, fits, strict=True) if fit and fit[0].deviation(fit[1]) <= most]
    return min([search.place, *good], key=lambda place: task(place).rotation(window))


def _fit_rates(task: SpringTask, window: tuple[float, float]) -> tuple[RateGoal, FloatArray] | None:
    """Return the goal over a window, and the best rates by the objective of the design; None if there are none."""
    goal = task.goal(window)
    rates = None if goal is None else _best_rates(goal, task.wanted)
    return None if goal is None or rates is None else (goal, rates)


def _best_rates(goal: RateGoal, wanted: CrankDesign) -> FloatArray | None:
    """Return the best rates by the objective of a design; None if there are none."""
    return least_squares(goal) if wanted.objective == "least-squares" else minimax(goal)


def alternatives(solved: ChosenSprings, search: Lowest | None) -> tuple[Finding, ...]:
    """Return how far rates and lengths may move without harm, if they may move far."""
    if solved.bought:
        return ()
    reported = [text for text in (_find_length_range(solved, search), _find_rate_ranges(solved)) if text]
    if not reported:
        return ()
    wanted = solved.task.wanted
    extra = max(wanted.slack, DEVIATION_TOL)
    cure = "" if wanted.slack else "; 'design.slack' and 'design.prefer' choose among them"
    text = f"many designs deviate by at most another {100 * extra:.2g} % of the target: {'; '.join(reported)}{cure}"
    return (finding("near_optima", text),)


def _find_rate_ranges(solved: ChosenSprings) -> str:
    """Return the range of each rate with nearly the same deviation; empty if all are well determined."""
    goal = solved.task.goal(solved.window, N_PROGRAMME_PLACES)
    if goal is None:
        return ""
    span = ranges(goal, goal.deviation(solved.rates) + max(solved.task.wanted.slack, DEVIATION_TOL))
    if np.isnan(span).any():
        return ""
    wide = span[:, 1] - span[:, 0] > 0.2 * np.maximum(solved.rates, 1e-300)
    reported = []
    for k, name in enumerate(JOINT_NAMES):
        if name in solved.task.wanted.springs and wide[k] and math.isfinite(span[k, 1]):
            low, high = (format_short(float(end), JOINTS_BY_NAME[name].rate) for end in span[k])
            reported.append(f"{JOINTS_BY_NAME[name].words} {low} to {high}")
    return ", ".join(reported) if len(reported) > 1 else ""


def _find_length_range(solved: ChosenSprings, search: Lowest | None) -> str:
    """Return the range of the first free length with nearly the same deviation; empty if it is well determined."""
    wanted = solved.task.wanted
    if search is None or wanted.window is None:
        return ""
    good = [place[0] for place, value in search.profile if value <= search.value + max(wanted.slack, DEVIATION_TOL)]
    if len(good) < 2:
        return ""
    name = next(name for name in FREE_LENGTH_KEYS if getattr(wanted, name) is not None)
    dimension = "angle" if name == "unloaded_offset" else "length"
    low, high = (format_short(end, dimension) for end in (min(good), max(good)))
    return f"{name.replace('_', ' ')} {low} to {high}"

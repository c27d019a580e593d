"""Designs with margins: values of a designed specification moved until enough of its made parts are good.

What may move is what `design.free` names, or what the family says that its design may choose; what errors there are
say `design.tolerances`; what must hold say the requirements. Requirements on forces and stresses become rows of the
force and the stress at a few poses, which are smooth where the metrics, largest and smallest values, are not:
(max - min)/(max + min) <= b holds if (1 + b) F_j - (1 - b) F_i >= 0 for every pair of poses. Any other metric is a
number of its own. How limits are drawn in is `designing.robust_design`'s; the yield is judged afterwards, on parts
drawn anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.reported_values_of_finished_design import searched
from cfmkit.designing.robust_design import (
    NoPart,
    PartSlopes,
    RobustProblem,
    RobustResult,
    costliest,
    drawn,
    with_margins,
)
from cfmkit.designing.run_many_starts import Clock
from cfmkit.errors import CfmError, SolutionError, SpecError
from cfmkit.errors import Problem as Fault
from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.families.run_control import Run
from cfmkit.results import Design, Status
from cfmkit.studies.requirement_constraints import (
    RequirementRows,
    numbers_in,
    numbers_of,
    places_of,
    rows_of,
    sampled_of,
    stated_places,
)
from cfmkit.studies.sensitivity.inverse import LimitsAlong
from cfmkit.studies.sensitivity.probability_confidence_intervals import clopper_pearson
from cfmkit.studies.stated_or_assumed_tolerances import NO_TOLERANCE, tolerances_of
from cfmkit.studies.variable_paths import CannotVary, leaf

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.sensitivity.parameters import Parameter
    from cfmkit.studies.stated_or_assumed_tolerances import DesignTolerances


ESTIMATED = 4000
"""Parts whose yield is estimated to first order: one standard deviation of the estimate is 0.5 % at 90 %."""

SEARCH_SEED = 7919
"""Added to the seed: the parts that a search looks at are not those that it is judged by."""

CHECKED, ROUNDS, MOST_ASKED = 400, 4, 0.9975
"""Parts that are solved to see whether the estimate holds, how often more is then requested, and for how much."""

OTHER_SPRINGS = 4
"""Choices of bought springs that are tried where the best one misses the yield."""

LOWER = 4
"""How often less is requested where a yield is not reached: the largest is then known to a sixteenth of what lacks."""

DRAWN = 48
"""Parts that `design.robust` solves at each step: of Lan's shape 96 % are good after it, after 24 of them 93 %."""

LOOKED_AT = np.array([-2.5, -1.7, -0.85, 0.85, 1.7, 2.5])
"""Errors at which limits are looked at, in standard deviations; 1.7 is just within the ends of a range."""

NOTHING_FREE = "this design has no values that may change ('design.free')"

DIGITS = 6
"""Decimals of a value that is written, as a share of its range."""


@dataclass
class Sight:
    """Requirement values of one manufactured part: `cfmkit.designing.robust_design.SeenPart`."""

    spec: Spec  # the design that the search began with
    free: tuple[str, ...]  # paths of the values that may move
    made: DesignTolerances  # what errors there are
    rows: RequirementRows  # what is looked at
    run: Run  # seed

    def variant(self, x: FloatArray, errors: FloatArray) -> Spec:
        """Return the specification of a part."""
        changes = dict(zip(self.free, x.tolist(), strict=True))
        for path, error, at in zip(self.made.paths, errors.tolist(), self.made.nominal.tolist(), strict=True):
            if error:
                changes[path] = changes.get(path, at) + error
        return self.spec.replace(changes, as_made=bool(errors.any()))

    def __call__(self, x: FloatArray, errors: FloatArray) -> FloatArray | None:
        """Return the numbers of a part; None if it has none."""
        try:
            return numbers_of(self.variant(x, errors), self.rows, self.run)
        except CfmError:
            return None

    def is_good(self, x: FloatArray, errors: FloatArray) -> bool:
        """Return whether a part keeps every row, over all of the windows."""
        try:
            numbers = numbers_of(self.variant(x, errors), self.rows, self.run, stated_places(self.spec))
        except CfmError:
            return False
        return numbers is not None and bool((self.rows.matrix @ numbers + self.rows.constant >= 0).all())

    def slopes(self, x: FloatArray, errors: FloatArray) -> PartSlopes | None:
        """Return the exact derivatives of the numbers of a part, as far as its family knows them; None of none."""
        quick = family(self.spec.family).sampled_slopes
        # metrics are extremes of a whole analysis: nobody has their derivatives
        if quick is None or self.rows.metrics:
            return None
        try:
            part = self.variant(x, errors)
            found = function_named(quick)(part, self.rows.places, tuple({*self.free, *self.made.paths}))
        except CfmError:
            return None
        if found is None:
            return None
        unknown = np.full(len(self.rows.matrix.T), np.nan)
        by = {path: numbers_in(one) for path, one in found.by.items()}
        return PartSlopes(
            np.array([by.get(path, unknown) for path in self.free]).T,
            np.array([by.get(path, unknown) for path in self.made.paths]).T,
        )


def rows_along_errors(
    spec: Spec, nominal: Result, parameters: tuple[Parameter, ...], factors: FloatArray
) -> tuple[FloatArray, tuple[LimitsAlong, ...]]:
    """Return the rows of a specification's requirements (m,), and how they move with the error of each parameter.

    Parameters
    ----------
    spec, nominal : Spec and Result
        The perfect part.
    parameters : tuple of Parameter
        What errs.
    factors : (d,) array
        On the stated tolerances: errors are looked at as far as such tolerances go.

    Raises
    ------
    cfmkit.errors.SolutionError
        If it, or a part near it, cannot be followed at a few poses.
    """
    run, places = Run(), places_of(nominal)
    first = sampled_of(spec, places, run)
    rows = None if first is None else rows_of(nominal, first, places)
    middle = None if rows is None else numbers_of(spec, rows, run)
    if rows is None or middle is None:
        raise SolutionError("the specification cannot be followed at a few poses: no tolerance can be stated")
    found = []
    for one, factor in zip(parameters, factors.tolist(), strict=True):
        known = {}
        for offset in (factor * LOOKED_AT * deviation_of(one)).tolist():
            there = one.spread.nominal + offset
            if offset and one.spread.tightened(factor).low <= there <= one.spread.tightened(factor).high:
                try:
                    known[offset] = numbers_of(spec.replace({one.path: there}), rows, run)
                except CfmError:
                    continue
        moved = {offset: numbers - middle for offset, numbers in sorted(known.items()) if numbers is not None}
        if not moved:
            raise SolutionError(
                f"parts with an error of {one.path} cannot be followed: state a smaller tolerance for it"
            )
        offsets, at = np.array(list(moved)), int(np.searchsorted(list(moved), 0.0))
        changes = np.array(list(moved.values())) @ rows.matrix.T
        found.append(LimitsAlong(np.insert(offsets, at, 0.0), np.insert(changes, at, 0.0, axis=0)))
    return rows.matrix @ middle + rows.constant, tuple(found)


def deviation_of(one: Parameter) -> float:
    """Return the standard deviation of a parameter [SI]."""
    return one.spread.standard_deviation


def free_of(given: Spec, designed: Spec) -> dict[str, tuple[float, float]]:
    """Return which values may move, and in which ranges [SI]: those of `design.free`, else those of the family.

    Raises
    ------
    cfmkit.errors.SpecError
        If a path of `design.free` is not in the design, or its value is not in the range.
    """
    block = getattr(given, "design", None)
    stated = getattr(block, "free", None)
    if stated:
        found, faults = {}, []
        for path, ends in stated.items():
            try:
                found[path] = _range_of(designed, path, ends)
            except CannotVary as problem:
                faults.append(Fault("", 0, 0, f"design.free.{path}", str(problem)))
        if faults:
            raise SpecError(faults)
        return found
    record = family(designed.family)
    return dict(function_named(record.free)(given, designed)) if record.free is not None else {}


def _range_of(spec: Spec, path: str, ends: tuple[str, str]) -> tuple[float, float]:
    one = leaf(type(spec), path)
    low, high = (float(one.read(_plain(one.kind, end))[0]) for end in ends)
    if not low < high:
        raise CannotVary(f"[{ends[0]}, {ends[1]}] is not a range: the first must be smaller than the second")
    try:
        value = spec.at(path)
    except KeyError:
        value = None
    if not isinstance(value, int | float):
        raise CannotVary(f"{path!r} has no value in the design; give it one, or name its items")
    return low, high


def _plain(kind: str, text: str) -> Any:
    from cfmkit.specs.units import read_number

    return read_number(text) if kind == "number" else text


def with_design_margins(given: Spec, design: Design, run: Run) -> Design:
    """Return a design whose made parts are good as often as `design.yield` asks, moved from one that was found.

    Where none is, the next springs of a catalogue are tried.

    Parameters
    ----------
    given : Spec
        With `design.tolerances` and `design.yield`.
    design : Design
        What the family made of it; returned as it is where nothing may move or nothing is asked.
    run : Run
        Seed, progress, time budget.
    """
    others, clock = design.next_best[:OTHER_SPRINGS], Clock.of(run.time_budget)
    good, found = _moved(given, design, run, clock, not others)
    if not others or design.spec is None or found.spec is not None:
        return found
    tried = [(good, design)]
    for make in others:
        if clock.late():
            break
        other = make()
        if other.spec is None:
            continue
        good, found = _moved(given, other, run, clock, False)
        if found.spec is not None and good:  # without a part that was solved nothing is known of its yield
            reported = f"{len(tried)} with a smaller deviation miss the yield that is requested"
            return replace(found, notes=(*found.notes, ("springs", f"other springs of the catalogue: {reported}")))
        tried.append((good, other))
    _, found = _moved(given, max(tried, key=lambda one: one[0])[1], run, clock, True)
    reported = f"the best {len(tried)} choices of the catalogue's springs were tried"
    return replace(found, message=f"{found.message}; {reported}") if len(tried) > 1 else found


def _moved(given: Spec, design: Design, run: Run, clock: Clock, largest: bool) -> tuple[int, Design]:
    """Return how many of `CHECKED` parts are good, where some were solved, and the design moved for its yield.

    `largest`: whether the largest yield is looked for where the requested one is not found.
    """
    block = getattr(given, "design", None)
    wanted = getattr(block, "yield", None)
    if design.spec is None or block is None or wanted is None:
        return 0, design
    free = free_of(given, design.spec)
    nominal = family(given.family).analyze(design.spec, run)
    made = tolerances_of(design.spec, block, run.seed)
    if made is None:
        return 0, replace(design, notes=(*design.notes, ("margins", f"none: {NO_TOLERANCE}")))
    if nominal.status is not Status.COMPLETE:
        return 0, design
    places = places_of(nominal)
    first = sampled_of(design.spec, places, run)
    if first is None:
        return 0, replace(design, notes=(*design.notes, ("margins", "the design cannot be followed: no margins")))
    sight = Sight(design.spec, tuple(free), made, rows_of(nominal, first, places), run)
    problem = problem_of(sight, free, wanted, clock)
    start = np.array([float(design.spec.at(path)) for path in free])
    try:
        found, good = _held(problem, sight, start, largest)
        if block.robust is not None and free:
            again = drawn(problem, found, DRAWN, block.robust == "worst")
            better = checked(sight, again.x)
            found, good = (again, better) if better >= good else (found, good)
    except NoPart:
        return 0, replace(
            design, notes=(*design.notes, ("margins", "a neighbour of the design has no curve: no margins"))
        )
    return good, _designed(design, sight, found, good, problem)


def _held(problem: RobustProblem, sight: Sight, start: FloatArray, largest: bool = True) -> tuple[RobustResult, int]:
    """Return the design with margins and how many of `CHECKED` parts are good; more is requested until enough are."""
    best: tuple[RobustResult, int] | None = None
    asked, x, began = problem.share, start, None
    for _ in range(ROUNDS):
        found = with_margins(replace(problem, share=asked), x)
        began = found.began if began is None else began
        good = checked(sight, found.x)
        if best is None or good > best[1]:
            best = replace(found, began=began), good
        short = problem.share - good / CHECKED
        if short <= 0 or not found.reached or asked >= MOST_ASKED or problem.late():
            break
        asked, x = min(MOST_ASKED, max(found.share, asked) + 0.5 * short), found.x
    assert best is not None
    return _largest(problem, sight, start, best) if largest and _misses(best[1], problem) else best


def _misses(good: int, problem: RobustProblem) -> bool:
    """Return whether so many of `CHECKED` parts exclude that the requested share is good, with 95 % confidence."""
    return clopper_pearson(good, CHECKED)[1] < problem.share


def _largest(
    problem: RobustProblem, sight: Sight, start: FloatArray, best: tuple[RobustResult, int]
) -> tuple[RobustResult, int]:
    """Return the design with the largest yield that is found where the requested one is not.

    What makes the worst few parts less bad need not make more parts good: less is requested, between what is known to
    be reached and what is not.
    """
    low, high = best[1] / CHECKED, problem.share
    for _ in range(LOWER if len(start) else 0):
        asked = 0.5 * (low + high)
        if problem.late():
            break
        found = with_margins(replace(problem, share=asked), start)
        good = checked(sight, found.x)
        if good > best[1]:
            best = replace(found, reached=False), good
        low, high = (max(asked, best[1] / CHECKED), high) if good >= CHECKED * asked else (best[1] / CHECKED, asked)
        if low >= high:
            break
    return best


def checked(sight: Sight, x: FloatArray) -> int:
    """Return how many of `CHECKED` parts keep every row; each is solved, and none was seen by the search."""
    return sum(sight.is_good(x, one) for one in _errors(sight))


def _ends_early(sight: Sight, x: FloatArray) -> int:
    """Return how many of the parts that are solved have numbers, but not over all of the stated windows."""
    stated = stated_places(sight.spec)
    if not stated:
        return 0
    places, run, short = sight.rows.places, sight.run, 0
    for one in _errors(sight):
        try:
            part = sight.variant(x, one)
            short += sampled_of(part, places, run, stated) is None and sampled_of(part, places, run) is not None
        except CfmError:
            continue
    return short


def _errors(sight: Sight) -> FloatArray:
    """Return the errors of the parts that are solved, (n, d)."""
    return np.asarray(sight.made.drawn(CHECKED, sight.made.seed + SEARCH_SEED + 1) - sight.made.nominal)


def problem_of(sight: Sight, free: Mapping[str, tuple[float, float]], wanted: float, clock: Clock) -> RobustProblem:
    """Return how values with ranges `free` [SI] are to move until a share `wanted` of parts is good, or time ends."""
    made, run = sight.made, sight.run
    values = made.drawn(ESTIMATED, made.seed + SEARCH_SEED)
    errors = values - made.nominal
    sigma = np.array([one.spread.standard_deviation for one in made.parameters])

    def tell(share: float, steps: int) -> None:
        run.progress(min(0.99, steps / 20.0), f"step {steps}: about {100.0 * share:.3g} % of parts good")

    return RobustProblem(
        sight,
        np.array(list(free.values())).reshape(-1, 2),
        errors,
        sigma,
        sight.rows.matrix,
        sight.rows.constant,
        np.array(sight.rows.about),
        wanted,
        clock.late,
        tell,
        sight.slopes,
    )


def written(sight: Sight, found: RobustResult, problem: RobustProblem) -> Spec:
    """Return the design with its values moved, as few digits of them as matter."""
    steps = 10.0**-DIGITS * problem.reach
    x = np.clip(np.round(found.x / steps) * steps, *problem.bounds.T)
    return sight.variant(np.array([float(f"{value:.9g}") for value in x]), problem.perfect)


def costliest_path(sight: Sight, found: RobustResult, problem: RobustProblem) -> str:
    """Return which value it is whose tolerance costs most; several that err as one are joined by commas."""
    groups = sight.made.joined()
    return ", ".join(sight.made.paths[k] for k in groups[costliest(found, problem, groups)])


def _designed(design: Design, sight: Sight, found: RobustResult, good: int, problem: RobustProblem) -> Design:
    """Return the design with its values moved, or why there is none, and what the search says of it."""
    x, spec, worst = found.x, written(sight, found, problem), costliest_path(sight, found, problem)
    if _misses(good, problem):
        return _impossible(design, sight, good, worst, problem)
    solved = f"of {CHECKED} parts that were solved {good} are good; the tolerance that costs most is that of {worst}"
    reported = (
        f"{len(x)} values moved in {found.steps} steps: to first order about {100 * found.began:.3g} % of parts were "
        f"good before and {100 * found.share:.3g} % are now; {solved}"
        if len(x)
        else f"{NOTHING_FREE}; {solved}"
    )
    numbers: dict[str, tuple[float | None, str, str]] = {
        "margins_steps": (float(found.steps), "count", "steps towards the requested yield"),
        "margins_first_order": (found.share, "ratio", "share of good parts, estimated to first order"),
        "margins_solved": (good / CHECKED, "ratio", f"share of {CHECKED} parts that were solved at a few poses"),
    }
    places = sight.rows.places
    motion = sight.spec.motion
    about = searched(numbers, sight.spec.fidelity or "model", (float(places[0]), float(places[-1])), motion)
    return replace(design, spec=spec, search={**design.search, **about}, notes=(*design.notes, ("margins", reported)))


def _impossible(design: Design, sight: Sight, good: int, worst: str, problem: RobustProblem) -> Design:
    """Return why no design was found: the largest yield, and what stands in its way."""
    value = 100.0 * good / CHECKED
    wanted = f"{100 * problem.share:.4g} % of parts are good"
    reported, cure = f"no values in the ranges were found with which {wanted}", "widen the ranges (design.free)"
    if not len(problem.bounds):
        reported, cure = f"{NOTHING_FREE} until {wanted}", "name such values"
    reported += (
        f": {value:.3g} % at most, of {CHECKED} that were solved; the tolerance that costs most is that of {worst}: "
        f"make it tighter, {cure} or require less"
    )
    if short := _ends_early(sight, np.array([float(sight.spec.at(path)) for path in sight.free])):
        reported += (
            f". {short} of {CHECKED} parts end before the windows of the requirements do: state windows as shares of "
            "the travel, such as [1 %, 100 %], which then follow the travel of each part"
        )
    if problem.late():
        reported += "; the time budget ended the search"
    nearest = {"design.yield": f"{np.floor(value):.0f} %"}
    return Design(
        None, Status.INFEASIBLE, reported, nearest_feasible=nearest, search=design.search, tables=design.tables
    )

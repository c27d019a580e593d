"""Designs with margins: values of a designed specification moved until enough of its made parts are good.

What may move is what `design.free` names, or what the family says that its design may choose; what errors there are say
`design.tolerances`; what must hold say the requirements. Requirements on forces and stresses become rows of the force
and the stress at a few poses, which are smooth where the metrics, largest and smallest values, are not: (max -
min)/(max + min) <= b holds if (1 + b) F_j - (1 - b) F_i >= 0 for every pair of poses. Any other metric is a number of
its own. How limits are drawn in is `designing.robust_design`'s; the yield is judged afterwards, on parts drawn anew.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.robust_design import (
    NoPart,
    PartSlopes,
    RobustProblem,
    RobustResult,
    costliest,
    optimise_on_samples,
    with_margins,
)
from cfmkit.designing.rounded_and_reported_values import search_values
from cfmkit.designing.run_many_starts import Clock
from cfmkit.errors import CfmError, SpecError
from cfmkit.errors import Problem as Fault
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.results import Design, Status
from cfmkit.studies.parts.parts import NO_TOLERANCE, Parts
from cfmkit.studies.parts.requirement_rows import (
    RequirementRows,
    exact_derivatives,
    numbers_in,
    numbers_of,
    numbers_of_parts,
    requirement_rows,
    sample_part,
    stated_places,
)
from cfmkit.studies.parts.share import Share
from cfmkit.studies.variations import CannotVary, leaf

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.specs.spec import Spec


N_ESTIMATED_PARTS = 4000
"""Parts whose yield is by linear estimate: one standard deviation of the estimate is 0.5 % at 90 %."""
SEARCH_SEED = 7919  # added to the seed: the parts that a search looks at are not those that it is judged by
N_CHECKED_PARTS, MAX_CHECK_ROUNDS, MOST_ASKED = 400, 4, 0.9975
"""Parts that are solved to see whether the estimate holds, how often more is then requested, and for how much."""
OTHER_SPRINGS = 4  # choices of bought springs that are tried where the best one misses the yield
N_LOWER_YIELDS = 4
"""How often less is requested where a yield is not reached: the largest is then known to a sixteenth of what lacks."""
N_DRAWN_PARTS = 48
"""Parts that `design.robust` solves at each step: of Lan's shape 96 % are good after it, after 24 of them 93 %."""
NOTHING_FREE = "this design has no values that may change ('design.free')"
VALUE_DECIMALS = 6  # decimals of a value that is written, as a share of its range


@dataclass(frozen=True)
class PartNumbers:
    """Numbers of one manufactured part: `cfmkit.designing.robust_design.SeenPart`."""

    parts: Parts  # of the design that the search began with
    free: tuple[str, ...]  # paths of the values that may move
    rows: RequirementRows  # what the numbers are
    run: Run = field(default_factory=Run)  # seed

    @property
    def start(self) -> FloatArray:
        """The values that may move, where the search began, (n,) [SI]."""
        return np.array([float(self.parts.spec.get_value(path)) for path in self.free])

    def variant(self, x: FloatArray, errors: FloatArray) -> Spec:
        """Return the specification of a part."""
        parts, changes = self.parts, dict(zip(self.free, x.tolist(), strict=True))
        for path, error, at in zip(parts.paths, errors.tolist(), parts.nominal.tolist(), strict=True):
            if error:
                changes[path] = changes.get(path, at) + error
        return parts.spec.replace(changes, as_made=bool(errors.any()))

    def __call__(self, x: FloatArray, errors: FloatArray) -> FloatArray | None:
        """Return the numbers of a part; None if it has none."""
        try:
            return numbers_of(self.variant(x, errors), self.rows, self.run)
        except CfmError:
            return None

    def are_good(self, x: FloatArray, errors: FloatArray) -> NDArray[np.bool_]:
        """Return which parts with errors (k, d) keep every row, over all of the windows, (k,); each is solved."""
        design = self.variant(x, np.zeros(errors.shape[1]))
        middle = np.array([float(design.get_value(path)) for path in self.parts.paths])
        values = dict(zip(self.parts.paths, (middle + errors).T, strict=True))
        numbers = numbers_of_parts(design, values, self.rows, self.run, stated_places(self.parts.spec))
        return np.array([row is not None and (self.rows.limits(row) >= 0).all() for row in numbers], dtype=bool)

    def slopes(self, x: FloatArray, errors: FloatArray) -> PartSlopes | None:
        """Return the exact derivatives of the numbers of a part, as far as its family knows them; None of none."""
        if self.rows.metrics:  # extremes of a whole analysis: nobody has their derivatives
            return None
        paths = self.parts.paths
        try:
            derivatives = exact_derivatives(self.variant(x, errors), self.rows.places, tuple({*self.free, *paths}))
        except CfmError:
            return None
        unknown = np.full(len(self.rows.matrix.T), np.nan)
        by = {path: numbers_in(derivative) for path, derivative in derivatives.items()}
        by_x, by_error = (np.array([by.get(path, unknown) for path in names]).T for names in (self.free, paths))
        return PartSlopes(by_x, by_error) if by else None

    def count_good_parts(self, x: FloatArray) -> int:
        """Return how many of `N_CHECKED_PARTS` parts keep every row; each is solved, none was seen by the search."""
        return int(self.are_good(x, self._fresh_errors).sum())

    @cached_property
    def _fresh_errors(self) -> FloatArray:
        """Errors of the parts that are solved, (n, d)."""
        return np.asarray(self.parts.draw(N_CHECKED_PARTS, self.parts.seed + SEARCH_SEED + 1) - self.parts.nominal)

    def count_early_ends(self) -> int:
        """Return how many of `N_CHECKED_PARTS` drawn parts have a curve, but not over all of the stated windows."""
        stated, x = stated_places(self.parts.spec), self.start
        if not stated:
            return 0
        return sum(self._follows(x, error, ()) and not self._follows(x, error, stated) for error in self._fresh_errors)

    def _follows(self, x: FloatArray, errors: FloatArray, reached: tuple[float, ...]) -> bool:
        try:
            return sample_part(self.variant(x, errors), self.rows.places, self.run, reached) is not None
        except CfmError:
            return False

    def problem(self, free: Mapping[str, tuple[float, float]], wanted: float, clock: Clock) -> RobustProblem:
        """Return how values with ranges `free` [SI] are to move until a share of parts is good, or time ends."""
        parts, rows = self.parts, self.rows

        def tell(share: float, steps: int) -> None:
            reported = f"step {steps}: about {100.0 * share:.3g} % of parts good"
            self.run.progress(min(0.99, steps / 20.0), reported)

        return RobustProblem(
            self,
            np.array(list(free.values())).reshape(-1, 2),
            parts.draw(N_ESTIMATED_PARTS, parts.seed + SEARCH_SEED) - parts.nominal,
            parts.deviations,
            rows.matrix,
            rows.constant,
            np.array(rows.about),
            wanted,
            clock.late,
            tell,
            self.slopes,
        )

    def build_spec(self, design: RobustResult, problem: RobustProblem) -> Spec:
        """Return the design with its values moved, as few digits of them as matter."""
        steps = 10.0**-VALUE_DECIMALS * problem.reach
        x = np.clip(np.round(design.x / steps) * steps, *problem.bounds.T)
        return self.variant(np.array([float(f"{value:.9g}") for value in x]), problem.perfect)

    def costliest(self, design: RobustResult, problem: RobustProblem) -> str:
        """Return the value whose tolerance costs most; several that err as one are joined by commas."""
        groups = self.parts.joined
        return ", ".join(self.parts.paths[k] for k in groups[costliest(design, problem, groups)])


def free_of(requested: Spec, designed: Spec) -> dict[str, tuple[float, float]]:
    """Return which values may move, and in which ranges [SI]: those of `design.free`, else those of the family.

    Raises SpecError if a path of `design.free` is not in the design, or its value is not in the range.
    """
    block = getattr(requested, "design", None)
    stated = getattr(block, "free", None)
    if stated:
        ranges, faults = {}, []
        for path, ends in stated.items():
            try:
                ranges[path] = _range_of(designed, path, ends)
            except CannotVary as problem:
                faults.append(Fault("", 0, 0, f"design.free.{path}", str(problem)))
        if faults:
            raise SpecError(faults)
        return ranges
    return dict(family(designed.family).free(requested, designed))


def _range_of(spec: Spec, path: str, ends: tuple[str, str]) -> tuple[float, float]:
    key = leaf(type(spec), path)
    low, high = (float(key.read(_read_bound(key.kind, end))[0]) for end in ends)
    if not low < high:
        raise CannotVary(f"[{ends[0]}, {ends[1]}] is not a range: the first must be smaller than the second")
    try:
        value = spec.get_value(path)
    except KeyError:
        value = None
    if not isinstance(value, int | float):
        raise CannotVary(f"{path!r} has no value in the design; give it one, or name its items")
    return low, high


def _read_bound(kind: str, text: str) -> Any:
    from cfmkit.specs.units import read_number

    return read_number(text) if kind == "number" else text


def with_design_margins(
    stated: Spec,  # with `design.tolerances` and `design.yield`
    design: Design,  # what the family made of it; returned as it is where nothing may move or nothing is asked
    run: Run,  # seed, progress, time budget
) -> Design:
    """Return a design whose made parts are good as often as `design.yield` asks, moved from one that was found.

    Where none is, the next springs of a catalogue are tried.
    """
    others, clock = design.next_best[:OTHER_SPRINGS], Clock.from_budgets(run.time_budget)
    good, moved = _move_design(stated, design, run, clock, not others)
    if not others or design.spec is None or moved.spec is not None:
        return moved
    tried = [(good, design)]
    for make in others:
        if clock.late():
            break
        alternative = make()
        if alternative.spec is None:
            continue
        good, moved = _move_design(stated, alternative, run, clock, False)
        if moved.spec is not None and good:  # without a part that was solved nothing is known of its yield
            reported = f"{len(tried)} with a smaller deviation miss the yield that is requested"
            return replace(moved, notes=(*moved.notes, ("springs", f"other springs of the catalogue: {reported}")))
        tried.append((good, alternative))
    _, moved = _move_design(stated, max(tried, key=lambda pair: pair[0])[1], run, clock, True)
    reported = f"the best {len(tried)} choices of the catalogue's springs were tried"
    return replace(moved, message=f"{moved.message}; {reported}") if len(tried) > 1 else moved


def _move_design(stated: Spec, design: Design, run: Run, clock: Clock, largest: bool) -> tuple[int, Design]:
    """Return how many of `N_CHECKED_PARTS` parts are good, where some were solved, and the design moved for its yield.

    `largest`: whether the largest yield is looked for where the requested one is not found.
    """
    block = getattr(stated, "design", None)
    wanted = getattr(block, "yield", None)
    if design.spec is None or block is None or wanted is None:
        return 0, design
    free = free_of(stated, design.spec)
    nominal = family(stated.family).analyze(design.spec, run)
    parts = Parts.from_design(design.spec, block, run.seed)
    if parts is None:
        return 0, replace(design, notes=(*design.notes, ("margins", f"none: {NO_TOLERANCE}")))
    if nominal.status is not Status.COMPLETE:
        return 0, design
    rows = requirement_rows(nominal, design.spec, run)
    if rows is None:
        return 0, replace(design, notes=(*design.notes, ("margins", "the design cannot be followed: no margins")))
    numbers = PartNumbers(parts, tuple(free), rows, run)
    problem = numbers.problem(free, wanted, clock)
    try:
        moved, good = _with_margins(problem, numbers, numbers.start, largest)
        if block.robust is not None and free:
            again = optimise_on_samples(problem, moved, N_DRAWN_PARTS, block.robust == "worst")
            better = numbers.count_good_parts(again.x)
            moved, good = (again, better) if better >= good else (moved, good)
    except NoPart:
        return 0, replace(
            design, notes=(*design.notes, ("margins", "a neighbour of the design has no curve: no margins"))
        )
    return good, _finish_design(design, numbers, moved, good, problem)


def _with_margins(
    problem: RobustProblem, numbers: PartNumbers, start: FloatArray, largest: bool = True
) -> tuple[RobustResult, int]:
    """Return the design with margins, and how many of `N_CHECKED_PARTS` are good; it is repeated until enough are."""
    best: tuple[RobustResult, int] | None = None
    asked, x, began = problem.share, start, None
    for _ in range(MAX_CHECK_ROUNDS):
        moved = with_margins(replace(problem, share=asked), x)
        began = moved.began if began is None else began
        good = numbers.count_good_parts(moved.x)
        if best is None or good > best[1]:
            best = replace(moved, began=began), good
        short = problem.share - good / N_CHECKED_PARTS
        if short <= 0 or not moved.reached or asked >= MOST_ASKED or problem.late():
            break
        asked, x = min(MOST_ASKED, max(moved.share, asked) + 0.5 * short), moved.x
    assert best is not None
    return _find_largest_yield(problem, numbers, start, best) if largest and _misses(best[1], problem) else best


def _misses(good: int, problem: RobustProblem) -> bool:
    """Return whether so many of `N_CHECKED_PARTS` parts exclude the requested share, with 95 % confidence."""
    return Share(good, 0, N_CHECKED_PARTS).excludes(problem.share)


def _find_largest_yield(
    problem: RobustProblem, numbers: PartNumbers, start: FloatArray, best: tuple[RobustResult, int]
) -> tuple[RobustResult, int]:
    """Return the design with the largest yield that is found where the requested one is not.

    What makes the worst few parts less bad need not make more parts good: less is requested, between what is known to
    be reached and what is not.
    """
    low, high = best[1] / N_CHECKED_PARTS, problem.share
    for _ in range(N_LOWER_YIELDS if len(start) else 0):
        asked = 0.5 * (low + high)
        if problem.late():
            break
        moved = with_margins(replace(problem, share=asked), start)
        good = numbers.count_good_parts(moved.x)
        if good > best[1]:
            best = replace(moved, reached=False), good
        low, high = (
            (max(asked, best[1] / N_CHECKED_PARTS), high)
            if good >= N_CHECKED_PARTS * asked
            else (best[1] / N_CHECKED_PARTS, asked)
        )
        if low >= high:
            break
    return best


def _finish_design(design: Design, part: PartNumbers, moved: RobustResult, good: int, problem: RobustProblem) -> Design:
    """Return the design with its values moved, or why there is none, and what the search says of it."""
    x, spec, worst = moved.x, part.build_spec(moved, problem), part.costliest(moved, problem)
    if _misses(good, problem):
        return _explain_no_design(design, part, good, worst, problem)
    solved = f"{good} of {N_CHECKED_PARTS} solved parts meet them; largest contributor: {worst}"
    reported = (
        f"{len(x)} values moved in {moved.steps} steps: yield about {100 * moved.began:.3g} % before, "
        f"{100 * moved.share:.3g} % now (linear estimate); {solved}"
        if len(x)
        else f"{NOTHING_FREE}; {solved}"
    )
    numbers: dict[str, tuple[float | None, str, str]] = {
        "margins_steps": (float(moved.steps), "count", "steps towards the requested yield"),
        "margins_first_order": (moved.share, "ratio", "yield, linear estimate"),
        "margins_solved": (
            good / N_CHECKED_PARTS,
            "ratio",
            f"share of {N_CHECKED_PARTS} parts that were solved at a few poses",
        ),
    }
    places = part.rows.places
    motion = part.parts.spec.motion
    about = search_values(numbers, part.parts.spec.fidelity or "model", (float(places[0]), float(places[-1])), motion)
    return replace(design, spec=spec, search={**design.search, **about}, notes=(*design.notes, ("margins", reported)))


def _explain_no_design(design: Design, part: PartNumbers, good: int, worst: str, problem: RobustProblem) -> Design:
    """Return why no design was found: the largest yield, and what stands in its way."""
    value = 100.0 * good / N_CHECKED_PARTS
    wanted = f"{100 * problem.share:.4g} % of parts are good"
    reported, cure = f"no values in the ranges were found with which {wanted}", "widen the ranges (design.free)"
    if not len(problem.bounds):
        reported, cure = f"{NOTHING_FREE} until {wanted}", "name such values"
    reported += (
        f": {value:.3g} % at most, of {N_CHECKED_PARTS} that were solved; largest contributor: {worst}: "
        f"make its tolerance tighter, {cure} or require less"
    )
    if short := part.count_early_ends():
        reported += (
            f". {short} of {N_CHECKED_PARTS} parts end before the windows of the requirements do: state "
            f"windows as shares of "
            "the travel, such as [1 %, 100 %], which then follow the travel of each part"
        )
    if problem.late():
        reported += "; the time budget ended the search"
    nearest = {"design.yield": f"{np.floor(value):.0f} %"}
    return Design(
        None, Status.INFEASIBLE, reported, nearest_feasible=nearest, search=design.search, tables=design.tables
    )

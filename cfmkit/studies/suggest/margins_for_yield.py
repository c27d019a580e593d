"""A proposal whose made parts miss the wished yield alone is designed again: with margins, as by `design.yield`.

What may move is what the design of the family chooses, in the same ranges, under the tolerances that the file of the
proposal states. To first order the search takes a moment; whether its estimate holds, parts say which are drawn of the
new design as of any other proposal. Where it does not, more is requested.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.bounds_and_rounding import around
from cfmkit.designing.robust_design import NoPart, with_margins
from cfmkit.designing.run_many_starts import Clock
from cfmkit.families import family
from cfmkit.families.base import Run, function_named
from cfmkit.results import Status
from cfmkit.studies.redesign_for_yield import Sight, costliest_path, problem_of, written
from cfmkit.studies.requirement_constraints import places_of, rows_of, sampled_of
from cfmkit.studies.sensitivity.parameters import parameters_of
from cfmkit.studies.stated_or_assumed_tolerances import DesignTolerances
from cfmkit.studies.suggest.yield_of_proposal import PARTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.wishes import Candidate, Wish
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal


TRIES = 3
"""How often more is requested than what drawn parts did not have."""

STEPS = 15
"""Steps of one search, which is ended by them and not by a clock: what can be reached is nearly reached in ten."""

MOST_ASKED = 0.9975
"""For a larger share the drawn parts of the search are too few."""


@dataclass(frozen=True)
class Moved:
    """A mechanism whose values were moved for a yield.

    Attributes
    ----------
    spec : Spec
        With the values moved.
    began, share : float
        Of good parts to first order, before and after.
    costliest : str
        The value whose tolerance costs most.
    """

    spec: Spec
    began: float
    share: float
    costliest: str


def redesigned(
    near: Proposal, candidate: Candidate, wish: Wish, run: Run, judge: Callable[[Spec], Proposal]
) -> Proposal:
    """Return a proposal whose made parts are good as often as wished, else the best found, with what is missing of it.

    Parameters
    ----------
    near : Proposal
        Which misses the yield alone.
    candidate : Candidate
        What it was made of.
    wish : Wish
        With a share of good parts.
    run : Run
        Seed, and how long it may take.
    judge : callable
        Analyses and judges a specification, drawn parts included.
    """
    clock = Clock.of(run.time_budget)
    wanted = asked = float(wish.good_parts or 0.0)
    best, spec, last, obstacle = near, near.spec, None, ""
    for _ in range(TRIES):
        left = None if clock.deadline is None else clock.deadline - time.time()
        moved = None if clock.late() else moved_for_yield(candidate, spec, wish, asked, replace(run, time_budget=left))
        if moved is None:
            break
        last, there = moved, judge(moved.spec)
        if there.good:
            return replace(there, notes=(_note(moved), *there.notes))
        if not there.movable:
            obstacle = "; ".join(there.missed) or there.message
            break
        share = float(there.numbers["yield"] or 0.0)
        if share > float(best.numbers["yield"] or 0.0):
            best = there
        if moved.share < asked or asked >= MOST_ASKED:
            break
        asked, spec = min(MOST_ASKED, max(moved.share, asked) + 0.5 * (wanted - share)), there.spec
    return replace(best, missed=(f"{best.missed[0]}; {_tried(last, obstacle)}",), movable=False)


def _note(moved: Moved) -> str:
    shares = f"{100.0 * moved.began:.3g} % of parts were good before and {100.0 * moved.share:.3g} % are now"
    return f"designed with margins for the yield: to first order {shares}"


def _tried(moved: Moved | None, obstacle: str) -> str:
    """Return why margins did not help."""
    if moved is None:
        return "no value may move for it"
    reported = f"margins reach no more, and the tolerance of {moved.costliest} costs most"
    return f"{reported}; moved farther, the mechanism misses more: {obstacle}" if obstacle else reported


def moved_for_yield(candidate: Candidate, spec: Spec, wish: Wish, asked: float, run: Run) -> Moved | None:
    """Return a proposal with the largest share of good parts that is found to first order, up to what is asked.

    Parameters
    ----------
    candidate : Candidate
        What it was made of: its block `design` says what may move.
    spec : Spec
        The proposal as it stands in its file, with requirements and the block `sensitivity`.
    wish : Wish
        Its thinnest leaf and its depth limit what moves.
    asked : float
        Share of good parts.
    run : Run
        Seed, and how long it may search.

    Returns
    -------
    Moved or None
        None where nothing may move, or the proposal cannot be followed at a few poses.
    """
    block = spec.sensitivity
    free = _free(candidate, spec, wish)
    nominal = family(spec.family).analyze(spec, Run())
    if not free or block is None or nominal.status is not Status.COMPLETE:
        return None
    places = places_of(nominal)
    first = sampled_of(spec, places, run)
    if first is None:
        return None
    made = DesignTolerances(spec, block, parameters_of(spec, block), block.samples or PARTS, run.seed)
    sight = Sight(spec, tuple(free), made, rows_of(nominal, first, places), run)
    problem = problem_of(sight, free, asked, run)
    try:
        found = with_margins(problem, np.array([float(spec.at(path)) for path in free]), STEPS)
    except NoPart:
        return None
    return Moved(written(sight, found, problem), found.began, found.share, costliest_path(sight, found, problem))


def _free(candidate: Candidate, spec: Spec, wish: Wish) -> dict[str, tuple[float, float]]:
    """Return what may move, and in which ranges [SI]."""
    choose = family(spec.family).free
    given = candidate.spec
    found: dict[str, tuple[float, float]] = {}
    if candidate.design and choose is not None:
        found |= function_named(choose)(given, spec)
    for path in candidate.free:
        value: Any = spec.at(path)
        if isinstance(value, float):
            thin = path.endswith("thickness")
            found[path] = around(value, low=wish.thinnest if thin else None, high=None if thin else wish.depth)
    # a value at the end of its range, as a leaf as thin as can be made, may still move away from it
    at = {path: float(spec.at(path)) for path in found}
    inside = {path: (min(low, at[path]), max(high, at[path])) for path, (low, high) in found.items()}
    return {path: ends for path, ends in inside.items() if ends[0] < ends[1]}

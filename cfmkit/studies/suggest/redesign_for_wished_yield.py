"""A proposal whose made parts miss the wished yield alone is designed again: with margins, as by `design.yield`.

What may move is what the design of the family chooses, in the same ranges, under the tolerances that the file of the
proposal states. To first order the search takes a moment; whether its estimate holds, parts say which are drawn of the
new design as of any other proposal. Where it does not, more is requested.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.bounds_and_rounding import around
from cfmkit.designing.robust_design import NoPart, with_margins
from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.families.run_control import Run
from cfmkit.results import Status
from cfmkit.studies.redesign_for_yield import Sight, costliest_path, problem_of, written
from cfmkit.studies.requirement_constraints import places_of, rows_of, sampled_of
from cfmkit.studies.sensitivity.parameters import parameters_of
from cfmkit.studies.stated_or_assumed_tolerances import DesignTolerances
from cfmkit.studies.suggest.yield_of_proposal import PARTS

if TYPE_CHECKING:
    from cfmkit.families.wishes import Candidate, Wish
    from cfmkit.specs.spec import Spec


STEPS = 15
"""Steps of one search, which is ended by them and not by a clock: what can be reached is nearly reached in ten."""


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

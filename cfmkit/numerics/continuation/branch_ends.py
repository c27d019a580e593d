"""End of a branch: it joins a path that becomes stable there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.events import locate_stability_change
from cfmkit.numerics.continuation.path import PathEvent
from cfmkit.numerics.continuation.problem import largest_motion

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.events import Located
    from cfmkit.numerics.continuation.path import Walk
    from cfmkit.numerics.continuation.problem import ContinuationProblem, PathEquilibrium

LOOK_AHEAD = 1e-5, 1e-4, 1e-3, 1e-2, 1e-6, 1e-7
"""Shares of the range behind a fold at which a path is looked for that the branch may have joined."""
LOOK_BACK = 1.0, 3.0, 10.0, 30.0, 100.0  # times these, before the fold, at which that path must be less stable
SAME_PLACE = 1e-7  # motion, with a share of the step
SHORT_STEP = 1e-6  # share of the range: after so short steps on a branch it is asked whether it has ended
IN_DOUBT = 0.05, 0.02
"""Motions of a step that are halved if going back fails, or comes to a path that is no less stable."""


def find_passed_end(walk: Walk, new: PathEquilibrium) -> PathEvent | Literal["unsure"] | None:
    """Return the event at the end of a branch that a step has passed, None if the step stayed on the branch.

    Who goes back from the new equilibrium along its own path comes to where the step began, or else to the path
    that the branch has joined, before its end.
    """
    problem, here = walk.problem, walk.here
    back = correct(problem, new.x + (here.drive - new.drive) * new.rate, here.drive)
    moved = walk.measure_motion(new)
    if back is None:
        return "unsure" if moved > IN_DOUBT[0] else None
    if walk.measure_motion(back) < SAME_PLACE + 1e-3 * moved:
        return _find_end_at(walk, new)
    if back.unstable <= new.unstable:
        return "unsure" if moved > IN_DOUBT[1] else None
    found = locate_stability_change(problem, back, new)
    if found is None:
        return "unsure"
    return PathEvent("bifurcation", found.drive, back.unstable, new.unstable, found.near, within=found.within)


def _find_end_at(walk: Walk, new: PathEquilibrium) -> PathEvent | None:
    """Return the event at the end of a branch if the last step came to just behind it: the next ones are short then."""
    problem, here = walk.problem, walk.here
    if abs(new.drive - here.drive) > SHORT_STEP * walk.options.span:
        return None
    for share in LOOK_AHEAD:
        prior = _least_stable_before(walk, here.drive, new, walk.sense * share * walk.options.span)
        found = None if prior is None else locate_stability_change(problem, prior, new)
        if prior is not None and found is not None:
            return PathEvent("bifurcation", found.drive, prior.unstable, new.unstable, found.near, within=found.within)
    return None


def primary_slope(problem: ContinuationProblem, at: PathEquilibrium, modes: FloatArray) -> FloatArray:
    """Return the slope of the path through a pitchfork: that of the equilibrium, less the critical modes."""
    rows = problem.motions
    amounts = np.linalg.lstsq(modes[rows], at.rate[rows], rcond=None)[0]
    return np.asarray(at.rate - modes @ amounts)


def find_joined_path(walk: Walk, fold: Located, unstable: int) -> tuple[PathEquilibrium, PathEvent] | None:
    """Return the first equilibrium behind the end of a branch on the path that it joins, and its event.

    None if the fold is none: no path as stable goes on there that was less stable before.
    """
    problem, span, sense = walk.problem, walk.options.span, walk.sense
    _, modes = problem.modes(fold.near, 1)
    slope = primary_slope(problem, fold.near, modes)
    for share in LOOK_AHEAD:
        ahead = sense * share * span
        guess = fold.x + ahead * slope
        beyond = correct(problem, guess, fold.drive + ahead)
        if beyond is None or beyond.unstable > unstable:
            continue
        if largest_motion(problem, beyond.x - guess) > 0.05 + 2 * abs(ahead) * largest_motion(problem, slope):
            continue
        before = _least_stable_before(walk, fold.drive, beyond, ahead)
        if before is not None:
            within = before, beyond
            event = PathEvent("bifurcation", fold.drive, before.unstable, beyond.unstable, fold.near, modes, within)
            return beyond, event
    return None


def _least_stable_before(walk: Walk, drive: float, beyond: PathEquilibrium, ahead: float) -> PathEquilibrium | None:
    """Return an equilibrium a little before a drive on the path through `beyond`, as far as it is less stable there."""
    at, least = beyond, None
    for factor in LOOK_BACK:
        if least is not None and least.unstable - beyond.unstable >= walk.modes:
            break
        goal = drive - factor * ahead
        prior = correct(walk.problem, at.x + (goal - at.drive) * at.rate, goal)
        if prior is not None and prior.unstable > beyond.unstable:
            least = prior if least is None or prior.unstable > least.unstable else least
            at = prior
    return least

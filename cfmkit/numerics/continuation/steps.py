"""One step by the drive: predicted by a cubic, corrected, and accepted only if it stays on its path."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.problem import force_change, largest_motion

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.path import Walk
    from cfmkit.numerics.continuation.problem import PathEquilibrium

FORCE_SHARE = 0.5  # of a force by which a step may change it, besides `Options.largest_force` units
MISSED_SHARE = 0.4  # of a step's motion by which its prediction may miss
CHORD_COSINE = 0.5  # between a step and the slopes at both its ends: at least
CHORD_MISFIT = 0.25  # of a step, to the mean of these slopes
MOTION_ROUNDING = 1e-7  # motions that small say nothing


class Trial(NamedTuple):
    """A step that was tried."""

    new: PathEquilibrium | None  # None if it is rejected
    misfit: float = np.inf  # error of the prediction as a share of the step
    excess: float = 0.0  # by how much a rejected step changes forces too much, if that is all


def hermite(a: PathEquilibrium, b: PathEquilibrium, drive: float) -> FloatArray:
    """Return the cubic through two equilibria with their slopes at a drive."""
    width = b.drive - a.drive
    if width == 0:
        return a.x
    s = (drive - a.drive) / width
    values = (1 + 2 * s) * (1 - s) ** 2 * a.x + s * s * (3 - 2 * s) * b.x
    return values + width * (s * (1 - s) ** 2 * a.rate + s * s * (s - 1) * b.rate)


def predict(walk: Walk, goal: float) -> FloatArray:
    """Return the predicted unknowns at a drive: by the last two equilibria, or by the last one's slope.

    A problem may have a method `predict(here, goal)` that knows better, and returns None if it does not.
    """
    here, before = walk.here, walk.before
    own = getattr(walk.problem, "predict", None)
    guess: FloatArray | None = None if own is None else own(here, goal)
    if guess is not None:
        return guess
    if before is None or before.drive == here.drive:
        return here.x + (goal - here.drive) * here.rate
    return hermite(before, here, goal)


def advance(walk: Walk, goal: float) -> Trial:
    """Try a step by the drive to a goal."""
    problem, here, options = walk.problem, walk.here, walk.options
    guess = predict(walk, goal)
    new = correct(problem, guess, goal)
    if new is None:
        return Trial(None)
    moved, missed = walk.measure_motion(new), largest_motion(problem, new.x - guess)
    if moved > options.largest_motion:
        return Trial(None)
    excess = force_change(problem, here.x, new.x, options.largest_force, FORCE_SHARE)
    if excess > 1:
        return Trial(None, excess=excess)
    if missed > MISSED_SHARE * moved + MOTION_ROUNDING or not _keeps_direction(walk, new, moved):
        return Trial(None)
    return Trial(new, missed / (moved + 1e-8))


def _keeps_direction(walk: Walk, new: PathEquilibrium, moved: float) -> bool:
    """Return True if the chord of a step agrees with the slopes at its ends, in direction and length.

    Without the second a step hops from the end of a branch onto the path that it joins, unnoticed.
    """
    here, motions = walk.here, walk.problem.motions
    if moved <= MOTION_ROUNDING or new.unstable != here.unstable:
        return True
    change = new.drive - here.drive
    chord, slopes = (new.x - here.x)[motions], (here.rate[motions], new.rate[motions])
    size, sense = math.sqrt(chord @ chord), math.copysign(1.0, change)
    if any(sense * (chord @ slope) < CHORD_COSINE * size * math.sqrt(slope @ slope) for slope in slopes):
        return False
    misfit = np.abs(chord - 0.5 * change * (slopes[0] + slopes[1])).max()
    return bool(misfit <= CHORD_MISFIT * moved + MOTION_ROUNDING)

"""Newton's method from a guess to a point of a path, and one step by the drive: predicted by a cubic, and judged.

Either the drive is given, or a border: a linear condition between the unknowns and the drive, as across an arc [Ke]. A
step is accepted only if it stays on its path.

Reference
---------
[Ke] H. B. Keller, in: Applications of Bifurcation Theory, Academic Press, 1977, 359.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.numerics.continuation.problem import Border, PathEquilibrium, force_change, largest_motion

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.path import Walk
    from cfmkit.numerics.continuation.problem import ContinuationProblem, ScaledUnknowns


STEP_TOLERANCE = 1e-10  # of a step: of motions, and of forces over their size or ten units
MAX_ITERATIONS = 14
MAX_MOTION = 50.0  # in one iteration: what moves further is lost
MAX_FORCE = 1e8  # units: what bears more is locked
FLOOR_OF_MOTION, FLOOR_OF_FORCE = 1e-7, 2e-5
"""Steps below which rounding is accepted where it keeps Newton's method from converging further."""
STAGNATION_RATIO = 0.3  # of a step as a share of the one before
FORCE_UNITS = 10.0  # forces are compared with themselves, at least with so many units


def correct(
    problem: ContinuationProblem,
    x: FloatArray,
    drive: float,
    border: Border | None = None,
    iterations: int = MAX_ITERATIONS,
) -> PathEquilibrium | None:
    """Return the equilibrium near a guess, at its drive or where the border's condition holds; None if none is near.

    A problem that has a method `solve(x, drive, border)` of its own, compiled, say, is asked instead.

    The bordered system is solved by elimination with the factors of the tangent alone: at limit points and
    bifurcations these are nearly singular, and the iteration makes good what rounding spoils.
    """
    solve = getattr(problem, "solve", None)
    if solve is not None:
        return solve(x, drive, border)  # type: ignore[no-any-return]
    last = np.inf
    with np.errstate(all="ignore"):
        for iteration in range(iterations):
            linear = problem.linearise(x, drive)
            columns = linear.solve(np.column_stack([-linear.residual, -linear.rate]))
            if columns is None or not np.isfinite(columns).all():
                return None
            step, rate = columns.T
            change = 0.0 if border is None else border.find_drive_change(x + step, drive, rate)
            step = step + change * rate
            motion = largest_motion(problem, step)
            force = np.abs(step) / np.maximum(FORCE_UNITS * problem.unit, np.abs(x))
            largest = max(motion, float(force[~problem.motions].max(initial=0.0)))
            if not (np.isfinite(largest) and np.isfinite(change)) or motion > MAX_MOTION:
                return None
            x, drive = x + step, drive + change
            if float((np.abs(x) / problem.unit)[~problem.motions].max(initial=0.0)) > MAX_FORCE:
                return None
            stagnant = motion < FLOOR_OF_MOTION and largest < FLOOR_OF_FORCE and largest > STAGNATION_RATIO * last
            converged = largest < STEP_TOLERANCE * (1 + largest_motion(problem, x)) or stagnant
            if converged and (iteration > 0 or border is None):  # a first step may have changed the drive alone
                return PathEquilibrium(x, float(drive), rate, linear.unstable)
            last = largest
    return None


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
    motion: float = 0.0  # largest one


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

    A problem may have a method `predict(at, goal)` that knows better, and returns None if it does not.
    """
    current, before = walk.current, walk.before
    predict_unknowns = getattr(walk.problem, "predict", None)
    guess: FloatArray | None = None if predict_unknowns is None else predict_unknowns(current, goal)
    if guess is not None:
        return guess
    if before is None or before.drive == current.drive:
        return current.extrapolate(goal)
    return hermite(before, current, goal)


def advance(walk: Walk, goal: float) -> Trial:
    """Try a step by the drive to a goal."""
    guess, options = predict(walk, goal), walk.options
    new = correct(walk.problem, guess, goal)
    return judge(walk.problem, walk.current, new, guess, (options.largest_motion, options.largest_force))


def judge(
    problem: ScaledUnknowns,
    start: PathEquilibrium,
    new: PathEquilibrium | None,
    guess: FloatArray,
    limits: tuple[float, float],  # largest motion, and largest change of a force, in its unit besides half of it
) -> Trial:
    """Return a step between two equilibria as a trial: accepted or not, with what its guess missed."""
    if new is None:
        return Trial(None)
    moved, missed = (largest_motion(problem, new.x - reference) for reference in (start.x, guess))
    if moved > limits[0]:
        return Trial(None)
    excess = force_change(problem, start.x, new.x, limits[1], FORCE_SHARE)
    if excess > 1:
        return Trial(None, excess=excess)
    if missed > MISSED_SHARE * moved + MOTION_ROUNDING or not _keeps_direction(problem, start, new, moved):
        return Trial(None)
    return Trial(new, missed / (moved + 1e-8), motion=moved)


def _keeps_direction(problem: ScaledUnknowns, start: PathEquilibrium, new: PathEquilibrium, moved: float) -> bool:
    """Return True if the chord of a step agrees with the slopes at its ends, in direction and length.

    Without the second a step hops from the end of a branch onto the path that it joins, unnoticed.
    """
    motions = problem.motions
    if moved <= MOTION_ROUNDING or new.unstable != start.unstable:
        return True
    change = new.drive - start.drive
    chord, slopes = (new.x - start.x)[motions], (start.rate[motions], new.rate[motions])
    size, sense = math.sqrt(chord @ chord), math.copysign(1.0, change)
    if any(sense * (chord @ slope) < CHORD_COSINE * size * math.sqrt(slope @ slope) for slope in slopes):
        return False
    misfit = np.abs(chord - 0.5 * change * (slopes[0] + slopes[1])).max()
    return bool(misfit <= CHORD_MISFIT * moved + MOTION_ROUNDING)

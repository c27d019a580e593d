"""Newton's method from a guess to a point of a path.

Either the drive is given, or a border: a linear condition between the unknowns and the drive, as across an arc [Ke].

Reference
---------
[Ke] H. B. Keller, in: Applications of Bifurcation Theory, Academic Press, 1977, 359.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.problem import Border, PathEquilibrium, largest_motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.problem import ContinuationProblem

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
    own = getattr(problem, "solve", None)
    if own is not None:
        return own(x, drive, border)  # type: ignore[no-any-return]
    last = np.inf
    with np.errstate(all="ignore"):
        for iteration in range(iterations):
            here = problem.linearise(x, drive)
            columns = here.solve(np.column_stack([-here.residual, -here.rate]))
            if columns is None or not np.isfinite(columns).all():
                return None
            step, rate = columns.T
            change = 0.0 if border is None else _drive_change(border, x + step, drive, rate)
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
                return PathEquilibrium(x, float(drive), rate, here.unstable)
            last = largest
    return None


def correct_each(
    problem: ContinuationProblem, guesses: Sequence[FloatArray], drives: Sequence[float]
) -> list[PathEquilibrium | None]:
    """Return the equilibria near guesses at their drives; a problem may have a method `solve_each` for that."""
    own = getattr(problem, "solve_each", None)
    if own is not None and len(drives) > 1:
        return own(guesses, drives)  # type: ignore[no-any-return]
    return [correct(problem, *pair) for pair in zip(guesses, drives, strict=True)]


def _drive_change(border: Border, x: FloatArray, drive: float, rate: FloatArray) -> float:
    row = border.row
    return float((border.level - row[:-1] @ x - row[-1] * drive) / (row[-1] + row[:-1] @ rate))

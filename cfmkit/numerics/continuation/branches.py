"""Stable branches that begin where a path loses its stability: entered along one mode, or past several at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.problem import Border, keep_motions, largest_motion

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.path import Walk
    from cfmkit.numerics.continuation.problem import ContinuationProblem, PathEquilibrium

MODE_AMPLITUDES, LAST_AMPLITUDES = (0.06, 0.02), (0.006, 0.002)
"""Largest motion of the mode with which a branch is entered."""
FIRST_REACH, LONGEST_REACH = 1e-3, 0.05  # of steps down from a saddle
MAX_STEPS_DOWN = 100
NEWTON_STEP_TOL = 1e-6  # step from which Newton's method reaches an equilibrium
SADDLE_DISTANCE = 0.5  # motion behind which an equilibrium is no more near a saddle
AMPLITUDE_SLACK = 0.3  # of the amplitude expected: how far an equilibrium on a branch may be off
BESIDE_TOLERANCE = 1e-12  # of the drive, as a share of the way to where the branch was entered
SMALLEST_AMPLITUDE = 1e-6  # as a share of that where the branch was entered: less is the singular point itself


def enter_branch(
    walk: Walk, x: FloatArray, drive: float, mode: FloatArray, amplitudes: tuple[float, ...]
) -> PathEquilibrium | None:
    """Return an equilibrium on the branch that crosses at (x, drive) along a mode, no less stable than the path was.

    The drive must have gone forward there; of two mirror images it is the one of `Options.sign` if it does so.
    """
    problem, sense = walk.problem, walk.sense
    room = abs(float(walk.targets[-1]) - drive) + walk.options.span
    mode = mode / largest_motion(problem, mode)
    for sign in (walk.options.sign, -walk.options.sign):
        for amplitude in amplitudes:
            kick = sign * amplitude * mode
            row = keep_motions(problem, kick)
            row /= np.linalg.norm(row)
            near = correct(problem, x + kick, drive, Border(np.append(row, 0.0), float(row @ (x + kick))))
            if near is None or largest_motion(problem, near.x - x - kick) > 0.5 * amplitude:
                continue
            if (near.drive - drive) * sense <= 0:
                break  # backwards: not this side
            if near.unstable <= walk.here.unstable and abs(near.drive - drive) < room:
                return near
    return None


def descend(problem: ContinuationProblem, saddle: PathEquilibrium, sign: int) -> PathEquilibrium | None:
    """Return a stable equilibrium below an unstable one at the same drive, or None if the way down leads far away.

    Newton's steps, but away from where the energy is highest along falling modes. The saddle is left to the side that
    `sign` names, along all of its falling modes.
    """
    x, reach = saddle.x, FIRST_REACH
    for _ in range(MAX_STEPS_DOWN):
        here = problem.linearise(x, saddle.drive)
        newton = here.solve(-here.residual[:, None])
        if newton is None or not np.isfinite(newton).all():
            return None
        values, modes = problem.modes(saddle._replace(x=x), len(x))
        falling = modes[:, values < 0]
        step = newton[:, 0] - 2 * falling @ (falling[problem.motions].T @ newton[problem.motions, 0])
        if largest_motion(problem, step) < NEWTON_STEP_TOL:
            if not falling.shape[1]:
                return correct(problem, x, saddle.drive)
            step = sign * FIRST_REACH * problem.orient(falling)
        x = x + step * min(1.0, reach / largest_motion(problem, step))
        reach = min(2 * reach, LONGEST_REACH)
        if largest_motion(problem, x - saddle.x) > SADDLE_DISTANCE:
            return None
    return None


def opens_at(problem: ContinuationProblem, x: FloatArray, drive: float, entered: PathEquilibrium) -> bool:
    """Return True if an equilibrium is on a branch that opens at (x, drive), like the root of the distance."""
    guess, goal = x + 0.5 * (entered.x - x), drive + 0.25 * (entered.drive - drive)
    near = correct(problem, guess, goal)
    if near is None or near.unstable != entered.unstable:
        return False
    return 0.3 < largest_motion(problem, near.x - x) / largest_motion(problem, entered.x - x) < 0.7


def find_beside(
    problem: ContinuationProblem, x: FloatArray, drive: float, entered: PathEquilibrium, goal: float, unstable: int
) -> PathEquilibrium:
    """Return the equilibrium at a drive between a singular point (x, drive) and another one on the branch from there.

    The branch opens like a root: the equilibrium is found by its amplitude, along which nothing is singular, until its
    drive fits.
    """
    part = (goal - drive) / (entered.drive - drive) if entered.drive != drive else 0.0
    chord = entered.x - x
    # where no forces are unknowns a straight guess would stretch the structure as it moves sideways
    curved = 2 * (entered.drive - drive) * entered.rate - chord if problem.motions.all() else np.zeros_like(x)
    direction, tolerance = keep_motions(problem, chord), getattr(problem, "drive_tolerance", BESIDE_TOLERANCE)
    row = direction / (np.linalg.norm(direction) or 1.0)
    share = float(np.sqrt(max(part, 0.0)))
    at = correct(problem, x + share * chord - share * (1 - share) * curved, goal)
    slack = getattr(problem, "amplitude_slack", AMPLITUDE_SLACK) * share
    if at is not None and at.unstable <= unstable and abs(row @ (at.x - x) / (row @ direction) - share) < slack:
        return at
    for _ in range(8 if share > SMALLEST_AMPLITUDE else 1):
        level = float(row @ (x + share * direction))
        at = correct(
            problem, x + share * chord - share * (1 - share) * curved, goal, Border(np.append(row, 0.0), level)
        )
        if at is None or abs(at.drive - goal) <= tolerance * abs(entered.drive - drive):
            break
        reached = (at.drive - drive) / (entered.drive - drive)
        if share <= SMALLEST_AMPLITUDE or reached <= 0:
            break
        share *= float(np.sqrt(part / reached))
    if at is None:
        return entered._replace(x=x, drive=goal, unstable=unstable, effort=math.nan)
    return at._replace(drive=goal, unstable=min(at.unstable, unstable), effort=math.nan)

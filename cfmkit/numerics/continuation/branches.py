"""Stable branches from where a path loses its stability: entered, past several bifurcations at once, and their ends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.numerics.continuation.events import locate_stability_change
from cfmkit.numerics.continuation.problem import Border, keep_motions, largest_motion
from cfmkit.numerics.continuation.steps import correct

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.events import Located
    from cfmkit.numerics.continuation.path import PathEvent, Walk
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
            entered = correct(problem, x + kick, drive, Border(np.append(row, 0.0), float(row @ (x + kick))))
            if entered is None or largest_motion(problem, entered.x - x - kick) > 0.5 * amplitude:
                continue
            if (entered.drive - drive) * sense <= 0:
                break  # backwards: not this side
            if entered.unstable <= walk.current.unstable and abs(entered.drive - drive) < room:
                return entered
    return None


def descend(problem: ContinuationProblem, saddle: PathEquilibrium, sign: int) -> PathEquilibrium | None:
    """Return a stable equilibrium below an unstable one at the same drive, or None if the way down leads far away.

    Newton's steps, but away from where the energy is highest along falling modes. The saddle is left to the side that
    `sign` names, along all of its falling modes.
    """
    x, reach = saddle.x, FIRST_REACH
    for _ in range(MAX_STEPS_DOWN):
        linear = problem.linearise(x, saddle.drive)
        newton = linear.solve(-linear.residual[:, None])
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
    between = correct(problem, guess, goal)
    if between is None or between.unstable != entered.unstable:
        return False
    return 0.3 < largest_motion(problem, between.x - x) / largest_motion(problem, entered.x - x) < 0.7


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

    def guess(share: float) -> FloatArray:
        return np.asarray(x + share * chord - share * (1 - share) * curved)

    share = float(np.sqrt(max(part, 0.0)))
    at = correct(problem, guess(share), goal)
    slack = getattr(problem, "amplitude_slack", AMPLITUDE_SLACK) * share
    if at is not None and at.unstable <= unstable and abs(row @ (at.x - x) / (row @ direction) - share) < slack:
        return at
    for _ in range(8 if share > SMALLEST_AMPLITUDE else 1):
        border = Border(np.append(row, 0.0), float(row @ (x + share * direction)))
        at = correct(problem, guess(share), goal, border)
        if at is None or abs(at.drive - goal) <= tolerance * abs(entered.drive - drive):
            break
        reached = (at.drive - drive) / (entered.drive - drive)
        if share <= SMALLEST_AMPLITUDE or reached <= 0:
            break
        share *= float(np.sqrt(part / reached))
    if at is None:
        return entered._replace(x=x, drive=goal, unstable=unstable, effort=math.nan)
    return at._replace(drive=goal, unstable=min(at.unstable, unstable), effort=math.nan)


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
    problem, current = walk.problem, walk.current
    back = correct(problem, new.extrapolate(current.drive), current.drive)
    moved = walk.measure_motion(new)
    if back is None:
        return "unsure" if moved > IN_DOUBT[0] else None
    if walk.measure_motion(back) < SAME_PLACE + 1e-3 * moved:
        return _find_end_at(walk, new)
    if back.unstable <= new.unstable:
        return "unsure" if moved > IN_DOUBT[1] else None
    located = locate_stability_change(problem, back, new)
    return "unsure" if located is None else located.as_bifurcation(back.unstable, new.unstable)


def _find_end_at(walk: Walk, new: PathEquilibrium) -> PathEvent | None:
    """Return the event at the end of a branch if the last step came to just behind it: the next ones are short then."""
    problem, current = walk.problem, walk.current
    if abs(new.drive - current.drive) > SHORT_STEP * walk.options.span:
        return None
    for share in LOOK_AHEAD:
        prior = _least_stable_before(walk, current.drive, new, walk.sense * share * walk.options.span)
        located = None if prior is None else locate_stability_change(problem, prior, new)
        if prior is not None and located is not None:
            return located.as_bifurcation(prior.unstable, new.unstable)
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
    _, modes = problem.modes(fold.nearest, 1)
    slope = primary_slope(problem, fold.nearest, modes)
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
            end = fold._replace(within=(before, beyond))
            return beyond, end.as_bifurcation(before.unstable, beyond.unstable, modes)
    return None


def _least_stable_before(walk: Walk, drive: float, beyond: PathEquilibrium, ahead: float) -> PathEquilibrium | None:
    """Return an equilibrium a little before a drive on the path through `beyond`, as far as it is less stable there."""
    at, least = beyond, None
    for factor in LOOK_BACK:
        if least is not None and least.unstable - beyond.unstable >= walk.modes:
            break
        goal = drive - factor * ahead
        prior = correct(walk.problem, at.extrapolate(goal), goal)
        if prior is not None and prior.unstable > beyond.unstable:
            least = prior if least is None or prior.unstable > least.unstable else least
            at = prior
    return least

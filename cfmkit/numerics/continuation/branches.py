"""Stable branches that begin where a path loses its stability: entered along one mode, or past several at once."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.path import Options, Walk
from cfmkit.numerics.continuation.problem import Border, Pushed, keep_motions, largest_motion
from cfmkit.numerics.continuation.steps import advance

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.problem import Equilibrium, Problem

AMPLITUDES = 0.06, 0.02
"""Largest motion of the mode with which a branch is entered."""
LAST_AMPLITUDES = 0.006, 0.002
"""The same where nothing else leads on."""
PUSHES = 3e-3, 3e-2, 3e-1
"""Forces along several modes under which a path leads past their bifurcations, EI / L^2."""
RELEASES = 0.0, 0.3, 0.7, 0.9
"""Factors by which such a force is taken away, the first that keeps to the path."""
MAX_REJECTIONS = 60
BESIDE_TOLERANCE = 1e-12  # of the drive, as a share of the way to where the branch was entered
SMALLEST_AMPLITUDE = 1e-6  # as a share of that where the branch was entered: less is the singular point itself


def enter_branch(
    walk: Walk, x: FloatArray, drive: float, mode: FloatArray, amplitudes: tuple[float, ...]
) -> Equilibrium | None:
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


def lead_around(walk: Walk, start: Equilibrium, drive: float, modes: FloatArray, width: float) -> Equilibrium | None:
    """Return a stable equilibrium behind bifurcations of several modes around a drive.

    The path is followed from `start` under a small force along one combination of the modes, which rounds all of the
    corners, and the force is then taken away.
    """
    problem = walk.problem
    push = keep_motions(problem, problem.orient(modes))
    push *= walk.options.sign / np.abs(push).max()
    goal = drive + walk.sense * 3 * width * walk.options.span
    for size in PUSHES:
        near = _follow_pushed(walk, start, drive, goal, size * push)
        if near is not None:
            near = _release(walk, near, size * push)
        if near is not None:
            return near
    return None


def _follow_pushed(walk: Walk, start: Equilibrium, drive: float, goal: float, force: FloatArray) -> Equilibrium | None:
    """Return the equilibrium at a drive under a small force, followed from a start without it."""
    pushed = Pushed(walk.problem, force)
    begin = correct(pushed, start.x, start.drive)
    if begin is None:
        return None
    options = Options(walk.options.span, largest_motion=0.15)
    aside = Walk(pushed, options, np.array([goal]), begin, 0.2 * abs(drive - start.drive), trail=(begin,))
    rejections = 0
    while (goal - aside.here.drive) * walk.sense > 0:
        step = min(aside.step, abs(goal - aside.here.drive))
        trial = advance(aside, aside.here.drive + walk.sense * step)
        if trial.new is None or trial.new.unstable > walk.here.unstable:
            aside, rejections = replace(aside, step=0.5 * step, before=None), rejections + 1
            if rejections == MAX_REJECTIONS:
                return None
            continue
        aside = replace(aside.move(trial.new), step=aside.step * (1.4 if trial.misfit < 0.1 else 1.0))
    return aside.here


def _release(walk: Walk, near: Equilibrium, force: FloatArray) -> Equilibrium | None:
    """Return the equilibrium to which one leads when its force is taken away by steps."""
    part = 1.0
    while part > 0:
        for factor in RELEASES:
            fewer = correct(Pushed(walk.problem, factor * part * force), near.x, near.drive)
            if (
                fewer is not None
                and fewer.unstable <= walk.here.unstable
                and largest_motion(walk.problem, fewer.x - near.x) < 0.1
            ):
                near, part = fewer, factor * part
                break
        else:
            return None
    return near


def find_beside(
    problem: Problem, x: FloatArray, drive: float, entered: Equilibrium, goal: float, unstable: int
) -> Equilibrium:
    """Return the equilibrium at a drive between a singular point (x, drive) and another one on the branch from there.

    The branch opens like a root: the equilibrium is found by its amplitude, along which nothing is singular, until its
    drive fits.
    """
    part = (goal - drive) / (entered.drive - drive) if entered.drive != drive else 0.0
    direction = keep_motions(problem, entered.x - x)
    row = direction / (np.linalg.norm(direction) or 1.0)
    share = float(np.sqrt(max(part, 0.0)))
    at = correct(problem, x + share * (entered.x - x), goal)
    if at is not None and at.unstable <= unstable and abs(row @ (at.x - x) / (row @ direction) - share) < 0.3 * share:
        return at
    for _ in range(8 if share > SMALLEST_AMPLITUDE else 1):
        level = float(row @ (x + share * direction))
        at = correct(problem, x + share * (entered.x - x), goal, Border(np.append(row, 0.0), level))
        if at is None or abs(at.drive - goal) <= BESIDE_TOLERANCE * abs(entered.drive - drive):
            break
        reached = (at.drive - drive) / (entered.drive - drive)
        if share <= SMALLEST_AMPLITUDE or reached <= 0:
            break
        share *= float(np.sqrt(part / reached))
    if at is None:
        return replace(entered, x=x, drive=goal, unstable=unstable)
    return replace(at, drive=goal, unstable=min(at.unstable, unstable))

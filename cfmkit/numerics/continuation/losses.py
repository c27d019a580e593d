"""Policy at a loss of stability, also at the start: locate it, yield it, go on along a stable branch if possible."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.arc import step_along
from cfmkit.numerics.continuation.branches import (
    LAST_AMPLITUDES,
    MODE_AMPLITUDES,
    descend,
    enter_branch,
    find_beside,
    opens_at,
    primary_slope,
)
from cfmkit.numerics.continuation.corners import corner_between
from cfmkit.numerics.continuation.events import locate_loss
from cfmkit.numerics.continuation.path import PathBranch, PathEvent, PathStop, Point, Walk, WhyStopped
from cfmkit.numerics.continuation.problem import PathEquilibrium, arc_weights, largest_motion
from cfmkit.numerics.continuation.steps import advance, correct

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.events import Located

Items = Generator[Point | PathEvent, None, Walk | PathStop | None]
"""Items of a policy, which returns the walk to go on with, the ending of the path, or None if it does not apply."""

FARTHER_BACK = 1e-3  # share of the piece's length by which the slope before a bifurcation is taken from before it
NEAR_CLUSTERS, WIDE_CLUSTERS = (0.1,), (1.0, 10.0)
"""Times `Options.cluster`: ranges within which bifurcations are passed together: at once, or if nothing else helps."""
RIGID_CLUSTERS, NEARLY_RIGID = (0.5, 2.0, 8.0, 32.0), 1e-6
"""Ways to the first within which nearly rigid structures pass several together; that way, as a share of the range."""
NEAR_SHARE = 1e-3  # of the way to the first of them: the other modes of a slender column are not together with it
ON_PATH = 1e-3  # motion by which an equilibrium may be off the path's secant just before a bifurcation
LOOK_PAST_FROM = 2e-3  # share of the range behind here where a slope is taken
LOOK_PAST_BY = 2e-3, 2e-2  # shares of the range ahead of here and of the goal at which the path may be less stable
LOOK_PAST_MISS = 0.02  # motion
CRITICAL_STIFFNESS = 1e-6  # stiffness of a mode in EI / L, say, below which a start is critical
FIRST_AMPLITUDE, MAX_HALVINGS = 0.02, 30  # arc length of the first step from there
BESIDE_CORNER = 1 / 16  # share of the way onto a branch at which its stiffness is taken
DRIVE_RTOL = 1e-13  # share of the range: less is rounding
FIRST_STEP_BELOW = 0.01  # share of the range, from a stable equilibrium below an unstable start


def lose_stability(walk: Walk, new: PathEquilibrium) -> Items:
    """Go on behind a loss of stability between here and a new equilibrium of the same path; None if it is another."""
    problem, options, current = walk.problem, walk.options, walk.current
    loss = locate_loss(walk, new)
    if loss is None:
        return None
    far = _well_before(walk, loss.drive, FARTHER_BACK * abs(loss.drive - walk.origin.drive)) or current
    slope = (loss.x - far.x) / (loss.drive - far.drive) if loss.drive != far.drive else current.rate
    modes, after = problem.modes(loss.nearest, 1)[1], current.unstable + 1
    if options.branch == "primary":
        modes = problem.modes(loss.nearest, max(1, new.unstable - current.unstable))[1]
        yield loss.as_bifurcation(current.unstable, new.unstable, modes)
        walk = yield from _reach_bifurcation(walk, loss, far, slope)

        def solve_behind(goal: float) -> PathEquilibrium:  # just behind it their count is rounding
            guess = loss.x + (goal - loss.drive) / (new.drive - loss.drive) * (new.x - loss.x)
            at = correct(problem, guess, goal) or PathEquilibrium(guess, goal, new.rate, new.unstable)
            return at._replace(unstable=new.unstable)

        walk = (yield from walk.deliver_values(new.drive, solve_behind)) or walk
        return walk.restart(new, 0.5 * abs(new.drive - loss.drive), same_piece=True)
    if options.branch == "stop":
        yield from _reach_bifurcation(walk, loss, far, slope)
        yield Point(new, -1, walk.branch)
        return PathStop(WhyStopped.JUMPS, loss.drive, "stability is lost at {place}: the path ends there")
    onto, mode = None, problem.orient(modes)
    for widths, amplitudes in _cluster_widths(walk, loss):
        several = _pass_together(walk, new, loss, slope, widths)
        if several is not None:
            onto, modes, after = several
        onto = onto or enter_branch(walk, loss.x, loss.drive, mode, amplitudes)
        if onto is not None:
            break
    corner = _find_rounded_corner(walk, loss, onto) if loss.rounded and onto is not None else None
    yield replace(corner, after=after, modes=modes) if corner else loss.as_bifurcation(current.unstable, after, modes)
    walk = yield from _reach_bifurcation(walk, loss, far, slope)
    if onto is None and options.through_folds:
        return walk._replace(options=options._replace(branch="primary")).restart(new, walk.step, same_piece=True)
    if onto is None:
        return PathStop(
            WhyStopped.JUMPS, loss.drive, "no stable equilibrium near {place}: it jumps to a distant one there"
        )
    return (yield from _begin_branch(walk, loss, onto, after))


def _find_rounded_corner(walk: Walk, loss: Located, onto: PathEquilibrium) -> PathEvent | None:
    """Return the bifurcation that an imperfection rounds, by the curve well before it and on the branch."""
    problem, width = walk.problem, walk.sense * walk.options.corner * walk.options.span
    first, drive = _well_before(walk, loss.drive, abs(width)) or walk.origin, loss.drive - width
    if (drive - first.drive) * width > 0:
        before = correct(problem, first.extrapolate(drive), drive)
        first = first if before is None or before.unstable > walk.current.unstable else before
    distance = onto.drive - loss.drive
    goal = loss.drive + min(max(BESIDE_CORNER * distance, width, key=abs), distance, key=abs)
    beside = find_beside(problem, loss.x, loss.drive, onto, goal, walk.current.unstable)
    last = beside if np.isfinite(beside.effort) else correct(problem, beside.x, goal)
    return None if last is None else corner_between(first, last)


def _well_before(walk: Walk, drive: float, distance: float) -> PathEquilibrium | None:
    """Return the last equilibrium of this piece that is farther than a distance from a drive."""
    return next((e for e in walk.look_back() if abs(e.drive - drive) > distance), None)


def _cluster_widths(walk: Walk, loss: Located) -> Iterator[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Yield ranges of the drive within which bifurcations are passed together, with amplitudes along the first mode.

    Nearly rigid structures reach many critical loads at once, measured by the drive's range, and not at all so measured
    by the way to the first.
    """
    width, distance = walk.options.cluster * walk.options.span, abs(loss.drive - walk.origin.drive)
    yield (
        tuple(min(factor * width, NEAR_SHARE * distance) for factor in NEAR_CLUSTERS),
        MODE_AMPLITUDES + LAST_AMPLITUDES,
    )
    if distance < NEARLY_RIGID * walk.options.span:
        yield tuple(factor * distance for factor in RIGID_CLUSTERS), ()
    yield tuple(factor * width for factor in WIDE_CLUSTERS), ()


def _pass_together(
    walk: Walk, new: PathEquilibrium, loss: Located, slope: FloatArray, widths: tuple[float, ...]
) -> tuple[PathEquilibrium, FloatArray, int] | None:
    """Return an equilibrium behind several bifurcations, their modes, and how many directions are unstable there."""
    problem, current = walk.problem, walk.current
    for width in widths:
        ahead = walk.sense * width
        saddle = correct(problem, loss.x + ahead * slope, loss.drive + ahead)
        if saddle is None or saddle.unstable < max(current.unstable + 2, new.unstable):
            continue
        onto = descend(problem, saddle, walk.options.sign)
        if onto is None or onto.unstable > current.unstable or not opens_at(problem, loss.x, loss.drive, onto):
            continue
        return onto, problem.modes(loss.nearest, saddle.unstable - current.unstable)[1], saddle.unstable
    return None


def _reach_bifurcation(
    walk: Walk, loss: Located, far: PathEquilibrium, slope: FloatArray
) -> Generator[Point, None, Walk]:
    """Yield the requested values before a bifurcation, on the path itself; return the walk with the next one."""
    problem, unstable = walk.problem, walk.current.unstable

    def solve_before(goal: float) -> PathEquilibrium:
        guess = loss.x + (goal - loss.drive) * slope
        at = advance(walk, goal).new
        if at is None or at.unstable > unstable:
            at = correct(problem, guess, goal)
        if at is None or at.unstable > unstable or largest_motion(problem, at.x - guess) > ON_PATH:
            at = PathEquilibrium(guess, goal, far.rate, unstable)  # at the singular point itself
        return at

    return (yield from walk.deliver_values(loss.drive, solve_before)) or walk


def _begin_branch(walk: Walk, loss: Located, onto: PathEquilibrium, after: int) -> Generator[Point, None, Walk]:
    """Yield the first points of a branch; return the walk on it."""
    problem, unstable = walk.problem, walk.current.unstable
    walk = walk._replace(branch=PathBranch(loss.drive, walk.options.sign), modes=after - unstable)

    def solve_beside(goal: float) -> PathEquilibrium:
        return find_beside(problem, loss.x, loss.drive, onto, goal, unstable)

    walk = (yield from walk.deliver_values(onto.drive, solve_beside)) or walk
    yield Point(onto, -1, walk.branch)
    return walk.restart(onto, 0.5 * abs(onto.drive - loss.drive))


def look_past(walk: Walk, goal: float) -> Items:
    """Go on behind a bifurcation that lies at here or at the goal, where no step succeeds; None if there is none."""
    problem, span, current = walk.problem, walk.options.span, walk.current
    far, primary = (
        _well_before(walk, current.drive, LOOK_PAST_FROM * span) or walk.origin,
        walk.options.branch == "primary",
    )
    for share in LOOK_PAST_BY:
        for origin in (current.drive, goal):
            drive = origin + walk.sense * share * span
            guess = far.extrapolate(drive)
            past = correct(problem, guess, drive)
            if (
                past is not None
                and (past.unstable > current.unstable or (primary and past.unstable != current.unstable))
                and largest_motion(problem, past.x - guess) < LOOK_PAST_MISS
            ):
                return (yield from lose_stability(walk._replace(current=far), past))
    return None


def start_critical(walk: Walk) -> Walk | None:
    """Return the walk a little behind a start at which a mode is just critical, or None if none is.

    What the drive does there may grow with its cube root: the mode leads, to the side on which the drive goes forward.
    If it does so to none, the drive relieves the structure: the path goes on along the slope without the mode. How many
    directions are unstable at the start is rounding.
    """
    problem, start = walk.problem, walk.current
    is_stiff = getattr(problem, "is_stiff", None)
    if is_stiff is not None and is_stiff(start, CRITICAL_STIFFNESS):
        return None
    values, modes = problem.modes(start, 1)
    if abs(values[0]) > CRITICAL_STIFFNESS:
        return None
    tangent = np.append(problem.orient(modes), 0.0)
    tangent /= np.sqrt(arc_weights(problem, walk.options.span) @ tangent**2)
    for halvings in range(MAX_HALVINGS):
        for sign in (walk.options.sign, -walk.options.sign):
            step = step_along(problem, start, sign * tangent, FIRST_AMPLITUDE * 0.5**halvings, walk.options.span)
            forward = 0.0 if step is None else (step.new.drive - start.drive) * walk.sense
            if step is None or step.new.unstable or forward <= DRIVE_RTOL * walk.options.span:
                continue
            if not walk.targets_up_to(step.new.drive):
                return walk.restart(step.new, abs(step.new.drive - start.drive))
    relieved = start._replace(rate=primary_slope(problem, start, modes), unstable=start.unstable - int(values[0] < 0))
    return walk._replace(current=relieved, trail=(relieved,))


def start_unstable(walk: Walk) -> Walk | None:
    """Return the walk at a stable equilibrium below an unstable start, or None."""
    onto = descend(walk.problem, walk.current, walk.options.sign)
    return None if onto is None else walk.restart(onto, FIRST_STEP_BELOW * walk.options.span)

"""A stretch followed by the arc length, where steps by the drive fail: until it leads again, or the path ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.arc import ArcMove, follow_arc, unit_tangent
from cfmkit.numerics.continuation.branch_ends import find_joined_path
from cfmkit.numerics.continuation.branches import find_beside
from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.events import locate_fold
from cfmkit.numerics.continuation.folds import pass_fold
from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point, Walk, WhyStopped
from cfmkit.numerics.continuation.problem import PathEquilibrium, largest_motion

if TYPE_CHECKING:
    from collections.abc import Generator

    from cfmkit.numerics.continuation.events import Located
    from cfmkit.numerics.continuation.losses import Items
    from cfmkit.numerics.continuation.problem import ContinuationProblem

LIMIT_POINT = "the drive cannot go on at {place}: a limit point; follow the path by its arc length (through_folds)"
TOO_SHARP = "the drive cannot go on at {place}: it locks, or turns too sharply to follow"
FIRST_LENGTH = 0.02  # where no step before says better
FIRST_STEP_LENGTHS = 1e-6, 0.05  # shortest and longest first step
STEADY_STEPS = 3  # in which the drive leads, until it does so again
STEADY_SHARE = 2.0  # motion by the slope over that of the step, up to which the drive leads
STEADY_STEP = 1e-3  # share of the range that such a step must bring
LOCKED_STEPS, LOCKED_SHARE = 60, 0.03
"""A drive that so many steps bring on by less than that share of the range is locked."""
MAX_STEPS = 300
FINEST_RETRY = 1e-4  # of the first step, where a fold is none


def follow_by_arc(walk: Walk, fineness: float = 1.0) -> Items:
    """Follow a path by its arc length from here; None if that leads nowhere."""
    problem, options, begin = walk.problem, walk.options, walk.here
    if not np.isfinite(begin.rate).all():
        return None
    along = np.append(begin.rate, 1.0) * walk.sense
    moved = walk.measure_motion(walk.before) if walk.before is not None else FIRST_LENGTH
    length = float(np.clip(fineness * moved, *FIRST_STEP_LENGTHS))
    tangent = unit_tangent(problem, begin, along, options.span)
    steady = 0
    for count, move in enumerate(follow_arc(problem, begin, tangent, length, options), 1):
        if move.folds:
            fold = locate_fold(problem, move, options.span)
            if fold is not None:
                return (yield from _end_at_fold(walk, begin, move, *fold, fineness))
        if move.new.unstable > move.old.unstable:  # a bifurcation: by the drive it is located
            step = 0.5 * abs(move.new.drive - move.old.drive)
            return walk.restart(move.old, step, same_piece=True) if count > 1 else None
        passed = yield from _pass_targets(walk, move)
        if passed is None:
            return None
        yield Point(move.new, -1, walk.branch)
        sense, drive_step = walk.sense, abs(move.new.drive - move.old.drive)
        walk = passed.move(move.new)._replace(step=drive_step)
        leads = largest_motion(problem, move.new.rate) * drive_step < STEADY_SHARE * largest_motion(
            problem, move.new.x - move.old.x
        )
        steady = steady + 1 if leads else 0
        if walk.done or (walk.targets[walk.number] - move.new.drive) * sense < 0:
            return _natural(walk)
        if steady >= STEADY_STEPS and count >= STEADY_STEPS and drive_step > STEADY_STEP * options.span:
            return _natural(walk)
        if count > LOCKED_STEPS and abs(move.new.drive - begin.drive) < LOCKED_SHARE * options.span:
            return PathStop(
                WhyStopped.LIMIT_POINT,
                move.new.drive,
                TOO_SHARP,
            )
        if count > MAX_STEPS:
            return None
    return None


def _natural(walk: Walk) -> Walk:
    return walk._replace(rejections=0)


def _pass_targets(walk: Walk, move: ArcMove) -> Generator[Point, None, Walk | None]:
    """Yield the requested values within a step; return the walk with the next one, or None if one is not found."""
    for number in walk.targets_up_to(move.new.drive):
        goal = float(walk.targets[number])
        at = correct(walk.problem, move.interpolate(goal), goal)
        if at is None:
            return None
        yield Point(at, number, walk.branch)
        walk = walk._replace(number=number + 1)
    return walk


def _end_at_fold(
    walk: Walk, begin: PathEquilibrium, move: ArcMove, fold: Located, after: int, fineness: float
) -> Items:
    """Go on where the drive turns back: at a limit point, or behind the end of a branch."""
    branch_ends = walk.branch is not None or not walk.options.corner
    joined = find_joined_path(walk, fold, begin.unstable) if branch_ends else None
    loses_one = after == begin.unstable + 1
    if joined is None and loses_one and walk.options.through_folds:
        return (yield from pass_fold(walk, move, fold, after))
    if joined is None and loses_one:
        return (yield from _stop_at_limit_point(walk, begin, fold))
    if joined is None and fineness > FINEST_RETRY:  # the step came to another path, or a sharp corner lies in it
        again = walk.restart(move.old, walk.step, same_piece=True)
        return (yield from follow_by_arc(again, 0.1 * fineness))
    for number in walk.targets_up_to(fold.drive):
        goal, turns = float(walk.targets[number]), walk.turns_at(fold.drive)
        beside = find_beside(walk.problem, fold.x, fold.drive, move.old, goal, begin.unstable)
        yield Point(beside, number, walk.branch)
        walk = walk._replace(number=number + 1)
        if turns:
            yield _nothing_lost(fold, begin)
            return walk.restart(move.old, abs(move.new.drive - move.old.drive), same_piece=True)
    if walk.turns_at(fold.drive):
        goal = float(walk.targets[walk.number])
        yield Point(fold.near._replace(drive=goal, unstable=begin.unstable), walk.number, walk.branch)
        yield _nothing_lost(fold, begin)
        walk = walk._replace(number=walk.number + 1)
        return walk.restart(move.old, abs(move.new.drive - move.old.drive), same_piece=True)
    if joined is None:
        return PathStop(WhyStopped.LOST, fold.drive, "the end of a branch at {place} leads nowhere")
    beyond, event = joined
    yield event
    walk = walk._replace(branch=None)
    if walk.done:
        return walk
    for number in walk.targets_up_to(beyond.drive):
        goal = float(walk.targets[number])
        guess = beyond.x + (goal - beyond.drive) * beyond.rate
        at = correct(walk.problem, guess, goal) or PathEquilibrium(guess, goal, beyond.rate, beyond.unstable)
        yield Point(at, number, walk.branch)
        walk = walk._replace(number=number + 1)
    yield Point(beyond, -1, walk.branch)
    span = walk.options.span
    return walk.restart(beyond, min(0.02 * span, max(abs(beyond.drive - fold.drive), 1e-3 * span)))


def _nothing_lost(fold: Located, begin: PathEquilibrium) -> PathEvent:
    """Return the event at a bifurcation where the drive turns back: stability is neither lost nor gained."""
    return PathEvent("bifurcation", fold.drive, begin.unstable, begin.unstable, fold.near)


def _stop_at_limit_point(walk: Walk, begin: PathEquilibrium, fold: Located) -> Items:
    """Yield what is left before a limit point of the drive, where the path ends."""
    problem, sense = walk.problem, walk.sense
    last = _last_before(problem, begin, fold, sense)
    for number in walk.targets_up_to(fold.drive):
        goal = float(walk.targets[number])
        share = (goal - begin.drive) / (last.drive - begin.drive)
        at = correct(problem, begin.x + share * (last.x - begin.x), goal) or correct(problem, last.x, goal)
        if at is None or at.unstable > begin.unstable:
            break
        yield Point(at, number, walk.branch)
    if (last.drive - begin.drive) * sense > 0:
        yield Point(last, -1, walk.branch)
    return PathStop(WhyStopped.LIMIT_POINT, fold.drive, LIMIT_POINT)


def _last_before(problem: ContinuationProblem, begin: PathEquilibrium, fold: Located, sense: float) -> PathEquilibrium:
    """Return the equilibrium nearest to a limit point, on the side that the path comes from.

    A location may close in from behind: then it is the other one at that drive.
    """
    near: PathEquilibrium | None = fold.near
    if fold.near.unstable > begin.unstable:
        near = correct(problem, 2 * fold.x - fold.near.x, fold.near.drive)
    known = near is not None and near.unstable == begin.unstable and (near.drive - fold.before.drive) * sense > 0
    return near if near is not None and known else fold.before

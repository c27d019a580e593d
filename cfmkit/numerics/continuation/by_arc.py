"""A stretch of a path followed by the arc length, from where steps by the drive fail to where it leads again."""

from __future__ import annotations

import itertools
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.arc import ArcMove, follow_arc, unit_tangent
from cfmkit.numerics.continuation.branches import find_beside, find_joined_path
from cfmkit.numerics.continuation.events import locate_fold, locate_stability_change_on_arc
from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point, Walk, WhyStopped
from cfmkit.numerics.continuation.problem import PathEquilibrium, largest_motion
from cfmkit.numerics.continuation.steps import correct

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.events import Located
    from cfmkit.numerics.continuation.losses import Items
    from cfmkit.numerics.continuation.problem import ContinuationProblem


MAX_OVERSHOOT_SHARE = 0.5  # share of the range by which a path may leave it
SHORTEST_RETRY = 1e-4  # of the first step, where a step ends on another path
STEADY_STEPS = 3  # in which the drive leads, until it does so again
STEADY_SHARE_BEHIND_LIMIT = 1.5  # motion by the slope over that of the step, up to which the drive leads


def pass_fold(walk: Walk, move: ArcMove, fold: Located | None = None, after: int = 0) -> Items:
    """Follow a path through a limit point of the drive that lies within a step; return where the drive leads again.

    Requested values are delivered every time they are passed: those of the present run, which go one way. It ends
    where the last of them is passed first. Without a `fold` the step is the first one behind a corner of the path.
    """
    problem, options, begin, sense = walk.problem, walk.options, move.old, walk.sense
    run, steady, limits, shortest = _run_of_targets(walk), 0, _drive_limits(walk), SHORTEST_RETRY * move.length
    arc: Iterator[ArcMove] = itertools.chain((move,), follow_arc(problem, move.new, move.tangent, move.length, options))
    while (step := next(arc, None)) is not None:
        passed_fold: Located | None = None
        if step.folds:
            located = (fold, after) if fold and step is move else locate_fold(problem, step, options.span)
            if located is not None and located[1] != step.new.unstable and step.length > shortest:
                # it has come to another path behind the fold, over a sharp corner
                arc = follow_arc(problem, step.old, step.tangent_before, 0.2 * step.length, options)
                continue
            if located is not None:
                passed_fold = located[0]
                yield PathEvent("limit point", passed_fold.drive, step.old.unstable, located[1], passed_fold.nearest)
        elif step.new.unstable != step.old.unstable:
            spot = locate_stability_change_on_arc(problem, step, options.span)
            if spot is None and step.length > shortest:
                arc = follow_arc(problem, step.old, step.tangent_before, 0.2 * step.length, options)
                continue
            drive = spot.drive if spot else step.new.drive
            yield PathEvent("bifurcation", drive, step.old.unstable, step.new.unstable, spot.nearest if spot else None)
        point: Point | None = None
        for point in _pass_values(walk, run, step, passed_fold):
            yield point
            walk = walk._replace(number=max(walk.number, point.target + 1))
        if point is not None and point.target == run[-1]:
            return walk.restart(point.at, walk.step)
        if not limits[0] <= step.new.drive <= limits[1]:
            yield Point(step.new, -1, walk.branch)
            return PathStop(WhyStopped.OUTSIDE, step.new.drive, "the drive left its range at {place}")
        yield Point(step.new, -1, walk.branch)
        change = abs(step.new.drive - step.old.drive)
        moved = largest_motion(problem, step.new.x - step.old.x)
        leads = step.tangent[-1] * sense > 0 and (
            largest_motion(problem, step.new.rate) * change < STEADY_SHARE_BEHIND_LIMIT * moved
        )
        steady = steady + 1 if leads and not step.folds else 0
        if steady >= STEADY_STEPS and step.new.unstable <= begin.unstable:
            ahead = next(number for number in run if (walk.targets[number] - step.new.drive) * sense > 0)
            return walk._replace(number=ahead).restart(step.new, change)
    return PathStop(WhyStopped.LOST, walk.current.drive, "the path was lost along its arc at {place}")


def _run_of_targets(walk: Walk) -> range:
    """Return the numbers of the requested values around the next one that go one way."""
    targets, sense = np.insert(walk.targets, 0, 0.0), walk.sense
    first = last = walk.number
    while first > 0 and (targets[first + 1] - targets[first]) * sense > 0:
        first -= 1
    while last + 1 < len(walk.targets) and (walk.targets[last + 1] - walk.targets[last]) * sense > 0:
        last += 1
    return range(first, last + 1)


def _drive_limits(walk: Walk) -> tuple[float, float]:
    beyond = MAX_OVERSHOOT_SHARE * walk.options.span
    return min(0.0, float(walk.targets.min())) - beyond, max(0.0, float(walk.targets.max())) + beyond


def _guess_near_fold(step: ArcMove, fold: Located | None, side: int, goal: float) -> FloatArray:
    """Return the unknowns at a drive within a step, before (0) or behind (1) a fold, where they go like a root."""
    if fold is None:
        return step.interpolate(goal)
    end = step.new if side else step.old
    share = np.sqrt(abs((goal - fold.drive) / (end.drive - fold.drive)))
    return np.asarray(fold.x + share * (end.x - fold.x))


def _pass_values(walk: Walk, run: range, step: ArcMove, fold: Located | None) -> Iterator[Point]:
    """Yield requested values within a step, on both sides of a fold in it, up to the last of a run."""
    turns = [step.old.drive, *([fold.drive] if fold else []), step.new.drive]
    room, targets = largest_motion(walk.problem, step.new.x - step.old.x), walk.targets[run.start : run.stop]
    for side, (low, high) in enumerate(itertools.pairwise(turns)):
        inside = np.flatnonzero(((targets - low) * (targets - high) <= 0) & (targets != low))
        inside = inside[np.abs(targets[inside] - low).argsort(kind="stable")]
        for number, goal in zip((run.start + inside).tolist(), targets[inside].tolist(), strict=True):
            guess = _guess_near_fold(step, fold, side, goal)
            at = correct(walk.problem, guess, goal)
            if at is not None and largest_motion(walk.problem, at.x - guess) <= room:
                yield Point(at, number, walk.branch)
                if number == run[-1]:
                    return


LIMIT_POINT = "the drive cannot go on at {place}: a limit point; follow the path by its arc length (through_folds)"
TOO_SHARP = "the drive cannot go on at {place}: it locks, or turns too sharply to follow"
FIRST_LENGTH = 0.02  # where no step before says better
FIRST_STEP_LENGTHS = 1e-6, 0.05  # shortest and longest first step
STEADY_SHARE = 2.0  # motion by the slope over that of the step, up to which the drive leads
STEADY_STEP = 1e-3  # share of the range that such a step must bring
LOCKED_STEPS, LOCKED_SHARE = 60, 0.03
"""A drive that so many steps bring on by less than that share of the range is locked."""
MAX_STEPS = 300
FINEST_RETRY = 1e-4  # of the first step, where a fold is none


def follow_by_arc(walk: Walk, fineness: float = 1.0) -> Items:
    """Follow a path by its arc length from here; None if that leads nowhere."""
    problem, options, begin = walk.problem, walk.options, walk.current
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
            if fineness > FINEST_RETRY and walk.branch is not None:  # it has passed the end of a branch, unseen
                again = walk.restart(move.old, walk.step, same_piece=True)
                return (yield from follow_by_arc(again, 0.1 * fineness))
        if move.new.unstable > move.old.unstable:  # a bifurcation: by the drive it is located
            step = 0.5 * abs(move.new.drive - move.old.drive)
            return walk.restart(move.old, step, same_piece=True) if count > 1 else None
        passed = yield from walk.deliver_values(move.new.drive, partial(_solve_within, problem, move))
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
            return walk._replace(rejections=0)
        if steady >= STEADY_STEPS and count >= STEADY_STEPS and drive_step > STEADY_STEP * options.span:
            return walk._replace(rejections=0)
        if count > LOCKED_STEPS and abs(move.new.drive - begin.drive) < LOCKED_SHARE * options.span:
            return PathStop(WhyStopped.LIMIT_POINT, move.new.drive, TOO_SHARP)
        if count > MAX_STEPS:
            return None
    return None


def _solve_within(problem: ContinuationProblem, move: ArcMove, goal: float) -> PathEquilibrium | None:
    return correct(problem, move.interpolate(goal), goal)


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
        yield Point(fold.nearest._replace(drive=goal, unstable=begin.unstable), walk.number, walk.branch)
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

    def solve_joined(goal: float) -> PathEquilibrium:
        guess = beyond.extrapolate(goal)
        return correct(walk.problem, guess, goal) or PathEquilibrium(guess, goal, beyond.rate, beyond.unstable)

    walk = (yield from walk.deliver_values(beyond.drive, solve_joined)) or walk
    yield Point(beyond, -1, walk.branch)
    span = walk.options.span
    return walk.restart(beyond, min(0.02 * span, max(abs(beyond.drive - fold.drive), 1e-3 * span)))


def _nothing_lost(fold: Located, begin: PathEquilibrium) -> PathEvent:
    """Return the event at a bifurcation where the drive turns back: stability is neither lost nor gained."""
    return PathEvent("bifurcation", fold.drive, begin.unstable, begin.unstable, fold.nearest)


def _stop_at_limit_point(walk: Walk, begin: PathEquilibrium, fold: Located) -> Items:
    """Yield what is left before a limit point of the drive, where the path ends."""
    problem, sense = walk.problem, walk.sense
    last = _last_before(problem, begin, fold, sense)

    def solve_before(goal: float) -> PathEquilibrium | None:
        share = (goal - begin.drive) / (last.drive - begin.drive)
        at = correct(problem, begin.x + share * (last.x - begin.x), goal) or correct(problem, last.x, goal)
        return None if at is None or at.unstable > begin.unstable else at

    yield from walk.deliver_values(fold.drive, solve_before)
    if (last.drive - begin.drive) * sense > 0:
        yield Point(last, -1, walk.branch)
    return PathStop(WhyStopped.LIMIT_POINT, fold.drive, LIMIT_POINT)


def _last_before(problem: ContinuationProblem, begin: PathEquilibrium, fold: Located, sense: float) -> PathEquilibrium:
    """Return the equilibrium nearest to a limit point, on the side that the path comes from.

    A location may close in from behind: then it is the other one at that drive.
    """
    last: PathEquilibrium | None = fold.nearest
    if fold.nearest.unstable > begin.unstable:
        last = correct(problem, 2 * fold.x - fold.nearest.x, fold.nearest.drive)
    valid = last is not None and last.unstable == begin.unstable and (last.drive - fold.before.drive) * sense > 0
    return last if last is not None and valid else fold.before

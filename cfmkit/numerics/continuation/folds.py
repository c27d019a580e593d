"""A stretch behind a limit point of the drive: followed by its arc length until the drive leads on again."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.arc import ArcMove, follow_arc
from cfmkit.numerics.continuation.correct import correct_each
from cfmkit.numerics.continuation.events import locate_fold, locate_stability_change_on_arc
from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point, Walk, WhyStopped
from cfmkit.numerics.continuation.problem import largest_motion

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.events import Located
    from cfmkit.numerics.continuation.losses import Items

MAX_OVERSHOOT_SHARE = 0.5  # share of the range by which a path may leave it
SHORTEST_RETRY = 1e-4  # of the first step, where a step ends on another path
STEADY_STEPS = 3  # in which the drive leads, until it does so again
STEADY_SHARE = 1.5  # motion by the slope over that of the step, up to which the drive leads


def pass_fold(walk: Walk, move: ArcMove, fold: Located | None = None, after: int = 0) -> Items:
    """Follow a path through a limit point of the drive that lies within a step; return where the drive leads again.

    Requested values are delivered every time they are passed: those of the present run, which go one way. It ends
    where the last of them is passed first. Without a `fold` the step is the first one behind a corner of the path.
    """
    problem, options, begin, sense = walk.problem, walk.options, move.old, walk.sense
    run, steady, limits, shortest = _run(walk), 0, _limits(walk), SHORTEST_RETRY * move.length
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
                yield PathEvent("limit point", passed_fold.drive, step.old.unstable, located[1], passed_fold.near)
        elif step.new.unstable != step.old.unstable:
            found = locate_stability_change_on_arc(problem, step, options.span)
            if found is None and step.length > shortest:
                arc = follow_arc(problem, step.old, step.tangent_before, 0.2 * step.length, options)
                continue
            drive = found.drive if found else step.new.drive
            yield PathEvent("bifurcation", drive, step.old.unstable, step.new.unstable, found.near if found else None)
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
            largest_motion(problem, step.new.rate) * change < STEADY_SHARE * moved
        )
        steady = steady + 1 if leads and not step.folds else 0
        if steady >= STEADY_STEPS and step.new.unstable <= begin.unstable:
            ahead = next(number for number in run if (walk.targets[number] - step.new.drive) * sense > 0)
            return walk._replace(number=ahead).restart(step.new, change)
    return PathStop(WhyStopped.LOST, walk.here.drive, "the path was lost along its arc at {place}")


def _run(walk: Walk) -> range:
    """Return the numbers of the requested values around the next one that go one way."""
    targets, sense = np.insert(walk.targets, 0, 0.0), walk.sense
    first = last = walk.number
    while first > 0 and (targets[first + 1] - targets[first]) * sense > 0:
        first -= 1
    while last + 1 < len(walk.targets) and (walk.targets[last + 1] - walk.targets[last]) * sense > 0:
        last += 1
    return range(first, last + 1)


def _limits(walk: Walk) -> tuple[float, float]:
    beyond = MAX_OVERSHOOT_SHARE * walk.options.span
    return min(0.0, float(walk.targets.min())) - beyond, max(0.0, float(walk.targets.max())) + beyond


def _guess(step: ArcMove, fold: Located | None, side: int, goal: float) -> FloatArray:
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
        goals = targets[inside].tolist()
        guesses = [_guess(step, fold, side, goal) for goal in goals]
        found = zip((run.start + inside).tolist(), correct_each(walk.problem, guesses, goals), guesses, strict=True)
        for number, at, guess in found:
            if at is not None and largest_motion(walk.problem, at.x - guess) <= room:
                yield Point(at, number, walk.branch)
                if number == run[-1]:
                    return

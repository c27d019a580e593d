"""A path followed by its arc length all along: through limit points, past bifurcations, up to the last value."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.continuation.arc import follow_arc, unit_tangent
from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.events import locate_fold, locate_stability_change_on_arc
from cfmkit.numerics.continuation.path import End, Ending, Event, Point

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.numerics.continuation.arc import ArcMove
    from cfmkit.numerics.continuation.events import Located
    from cfmkit.numerics.continuation.path import Walk

FIRST_LENGTH = 0.02
BEYOND = 0.5  # share of the range by which a path may leave it


def follow_through_folds(walk: Walk) -> Iterator[Point | Event | Ending]:
    """Yield points, events and the ending of a path by its arc length; requested values every time they are passed."""
    problem, options, begin = walk.problem, walk.options, walk.here
    along = np.append(begin.rate, 1.0) * walk.sense
    tangent = unit_tangent(problem, begin, along, options.span)
    last, limits = begin, _limits(walk)
    for move in follow_arc(problem, begin, tangent, FIRST_LENGTH, options):
        fold = locate_fold(problem, move, options.span) if move.folds else None
        if fold is not None:
            yield Event("limit point", fold[0].drive, move.old.unstable, move.new.unstable, fold[0].near)
        elif move.new.unstable != move.old.unstable:
            found = locate_stability_change_on_arc(problem, move, options.span)
            drive = found.drive if found else move.new.drive
            yield Event("bifurcation", drive, move.old.unstable, move.new.unstable, found.near if found else None)
        for point in _passed(walk, move, fold[0] if fold else None):
            yield point
            if point.target == len(walk.targets) - 1:
                yield Ending(End.COMPLETE, point.at.drive)
                return
        if not limits[0] <= move.new.drive <= limits[1]:
            yield Ending(End.OUTSIDE, move.new.drive, "the drive left its range")
            return
        yield Point(move.new, -1, walk.branch)
        last = move.new
    yield Ending(End.LOST, last.drive, "the path was lost along its arc")


def _limits(walk: Walk) -> tuple[float, float]:
    beyond = BEYOND * walk.options.span
    return min(0.0, float(walk.targets.min())) - beyond, max(0.0, float(walk.targets.max())) + beyond


def _passed(walk: Walk, move: ArcMove, fold: Located | None) -> Iterator[Point]:
    """Yield requested values within a step along the arc, on both sides of a fold in it."""
    turns = [move.old.drive, *([fold.drive] if fold else []), move.new.drive]
    for low, high in itertools.pairwise(turns):
        inside = [j for j, value in enumerate(walk.targets) if (value - low) * (value - high) <= 0 and value != low]
        for number in sorted(inside, key=lambda j: abs(walk.targets[j] - low)):
            anchor, goal = (move.old if low == move.old.drive else move.new), float(walk.targets[number])
            at = correct(walk.problem, anchor.x + (goal - anchor.drive) * anchor.rate, goal)
            if at is not None:
                yield Point(at, number, walk.branch)

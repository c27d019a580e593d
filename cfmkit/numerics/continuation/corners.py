"""Corners of the curve of effort over drive that a small imperfection rounds, marked as bifurcations.

Only for problems whose equilibria have a stiffness, and only if `Options.corner` is set.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cfmkit.numerics.continuation.path import Options, Walk
    from cfmkit.numerics.continuation.problem import PathEquilibrium

MIN_CHANGE, MIN_CHANGE_OF_LARGEST = 0.3, 0.05
"""Change of the stiffness, as shares of the larger one and of the largest so far, that is a bend."""
MIN_SHARPNESS = 2.0  # of a bend, in those of the curve before and behind it, from which on it is a corner


def is_bent(first: PathEquilibrium, last: PathEquilibrium, steepest: float) -> bool:
    """Return True if the stiffness differs between two equilibria, seen against the largest, too."""
    change = abs(last.stiffness - first.stiffness)
    return (
        change > MIN_CHANGE * max(abs(first.stiffness), abs(last.stiffness))
        and change > MIN_CHANGE_OF_LARGEST * steepest
    )


def crosses_bend(walk: Walk, new: PathEquilibrium) -> bool:
    """Return True if a step leads over a bend and is too long to tell a corner from a smooth curve."""
    longest, current = walk.options.longest_bend, walk.current
    if not longest or new.unstable != current.unstable or abs(new.drive - current.drive) <= longest:
        return False
    return is_bent(current, new, walk.steepest)


def mark_corners(
    items: Iterable[Point | PathEvent | PathStop], options: Options
) -> Iterator[Point | PathEvent | PathStop]:
    """Yield the items of a path, and bifurcations where the curve bends within `Options.corner`, and not beside that.

    Such a bifurcation lies where the tangents of the curve before and behind it meet. Stability is neither lost nor
    gained there, and it comes after some points behind it.
    """
    width, steepest = options.corner * options.span, 0.0
    passed: list[PathEquilibrium] = []  # since the last event
    first: int | None = None  # of those passed: where a bend begins
    for item in items:
        if isinstance(item, Point):
            at = item.at
            steepest = max(steepest, abs(at.stiffness))
            if first is None:
                nearby = [k for k, earlier in enumerate(passed) if abs(at.drive - earlier.drive) <= width]
                first = next((k for k in nearby if is_bent(passed[k], at, steepest)), None)
            passed.append(at)
            yield item
            if first is None or abs(at.drive - passed[first].drive) <= 2.0 * width:
                continue
        event = None if first is None else _corner_at(passed, first, width, steepest)
        if event is not None:
            yield event
        if event is not None or not isinstance(item, Point):
            passed = passed[-1:] if isinstance(item, Point) else []
        first = None
        if not isinstance(item, Point):
            yield item


def _corner_at(passed: list[PathEquilibrium], number: int, width: float, steepest: float) -> PathEvent | None:
    """Return the bifurcation on a bend that begins at an equilibrium; None if the curve is as bent beside it."""
    first, after = passed[number], passed[-1]
    last = next((at for at in passed[number:] if abs(at.drive - first.drive) >= width), after)
    before = next((at for at in passed[number::-1] if abs(at.drive - first.drive) >= width), None)
    if before is None or not is_bent(first, last, steepest):
        return None
    if _bend_rate(first, last) <= MIN_SHARPNESS * max(_bend_rate(before, first), _bend_rate(last, after)):
        return None
    return corner_between(first, last)


def _bend_rate(first: PathEquilibrium, last: PathEquilibrium) -> float:
    """Return the change of the stiffness by the drive; 0 at one place."""
    distance = abs(last.drive - first.drive)
    return abs(last.stiffness - first.stiffness) / distance if distance else 0.0


def corner_between(first: PathEquilibrium, last: PathEquilibrium) -> PathEvent | None:
    """Return the bifurcation between two equilibria beside it; None if the tangents of the curve do not meet there."""
    distance = last.drive - first.drive
    share = (last.effort - first.effort - last.stiffness * distance) / (distance * (first.stiffness - last.stiffness))
    if not 0.0 < share < 1.0:
        return None
    drive = first.drive + share * distance
    return PathEvent("bifurcation", drive, first.unstable, last.unstable, within=(first, last))

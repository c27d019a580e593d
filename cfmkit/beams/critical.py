"""Starts that are critical: prestress, loads or displacements end just where stability is lost.

There the tangent is singular, or so nearly that no step of the drive is short enough: a force across a column under its
critical load bends it like the cube root. The path is entered as a branch is, along the null vector, to the one side
that the drive leads to; or a little ahead, where the drive leads to neither.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.curvature import Curvature
from cfmkit.beams.discretise import LOADS
from cfmkit.beams.events import Singular, entered
from cfmkit.beams.path import Event
from cfmkit.beams.solver import Spot

if TYPE_CHECKING:
    from cfmkit.beams.run import Run

_JUST = 1e-10  # share of the prestress or the constant loads that the start is just critical at
_NEAR = 1e-4  # share of the drive's range in which there is nothing but the start
_SIZES = (0.06 * 0.25 ** np.arange(4)).tolist()  # how far from the start the path is entered [rad]
_BEFORE = 0.9  # share of the way to the first point asked for up to which it is
_STRAIGHT = 1e-3  # share of the way to the first point asked for after which a path that goes straight on is met


def left(run: Run, spot: Spot) -> Spot | None:
    """Leave a critical start, near `spot`, that no march got away from; return where to go on, or None."""
    if not _done_before(run) or 0.0 in run.pinned or np.abs(run.points.drive).max(initial=0.0) > _NEAR * run.span:
        return None
    start = run.spot(0) if len(run.points) else replace(spot, drive=0.0)
    goal = next(float(value) for value in run.targets if value)
    found = _sides(run, start, goal)
    wide = found[0] or found[1]
    if wide is None or (all(found) and run.control.branch != "stable"):
        wide = run.fine.solve(run.fine.expand(start.y), _STRAIGHT * goal)
    if wide is None or (wide.unstable > 0 and run.control.branch != "primary"):
        return None
    near = run.settled(run.fine.reduce(wide))
    if near is None:
        return None
    if run.branch != "primary" and wide is not found[0]:
        run.events.append(Event("unresolved", 0.0, start.unstable, near.unstable))
        run.branch = "primary"
    _begin(run, replace(start, unstable=min(start.unstable, near.unstable)))
    run.append(run.as_points(near, -1))
    run.entry, run.closed = 0.5 * abs(near.drive), True
    return near


def begun_again(run: Run) -> Spot | None:
    """Leave a critical start from which a march went straight on, unstable; return where to go on, or None."""
    if run.control.branch != "stable" or run.control.through_folds or not len(run.points) or not run.events:
        return None
    before = run.events[-1]
    just = before.after > before.before and abs(before.drive - 1.0) <= _JUST and " under " in before.kind
    if not just or run.points.info[0, 0] == 0:
        return None
    points, names = run.points, list(run.branches)
    run.points, run.branches = points.take(slice(0, 1)), names[:1]
    away = left(run, run.spot(0))
    if away is None:
        run.points, run.branches = points, names
    return away


def _done_before(run: Run) -> bool:
    """Tell whether anything was done before the run began: a network that is critical at rest is rigid, or loose."""
    network = run.layout.network
    if run.ramped:
        return run.ramped == LOADS and bool(network.springs)
    return bool(network.springs or network.loads or run.layout.held)


def _sides(run: Run, start: Spot, goal: float) -> list[Spot | None]:
    """Return equilibria on both sides of the start, before the first point asked for, where the drive leads there.

    Both are equally far from it, as far as possible. The side that the control asks for comes first.
    """
    fine, y, most = run.fine, run.fine.expand(start.y), start.unstable if run.control.branch == "primary" else 0
    curvature = Curvature(fine, y, 0.0)
    null = curvature.null(np.abs(curvature.values).argsort()[:1])
    at = Singular(Spot(y, 0.0, fine.unit), null, False, most, most)
    senses = (run.control.sign, -run.control.sign)
    for size in _SIZES:
        found = [entered(fine, at, sense * at.null, float(np.sign(goal)), (size,)) for sense in senses]
        found = [one if one is not None and abs(one.drive) < _BEFORE * abs(goal) else None for one in found]
        if any(found):
            return found
    return [None, None]


def _begin(run: Run, start: Spot) -> None:
    """Make the start the only point of the path so far: no mesh is near another there."""
    while len(run.points):
        run.drop_last()
    run.append(run.as_points(start, 0 if run.targets[0] == 0.0 else -1))
    run.pinned.append(0.0)

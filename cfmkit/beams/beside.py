"""Points asked for at a bifurcation, or so near to it that a march cannot tell on which side they are.

There the tangent is singular, and the error of integration moves an equilibrium by its cube root. Such points are not
marched to: they follow from the bifurcation, which is located on the fine mesh, and from the paths that meet there. A
branch opens like the square root of the distance, the path itself runs straight through.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.events import locate
from cfmkit.beams.solver import Spot

if TYPE_CHECKING:
    from cfmkit.beams.branch_ends import BranchEnd
    from cfmkit.beams.events import Singular
    from cfmkit.beams.run import Run
    from cfmkit.curves import FloatArray

BESIDE = 1e-5  # share of the drive's range
_AT = 3e-11  # and within which a point is at the bifurcation, whose place is known to about 1e-11
_SIDES = 4.0  # units of the tolerance, as a share of the range, from which it is sure on which side a point lies
_LOOSEST = 1e-4  # tolerance to which a bifurcation is located: a point asked for near it would be in doubt
_OFF, _LEAST = 0.3, 1e-6  # how far the solution may be from where it is foretold: as a share of its change, at least


def located(run: Run, one: Spot, other: Spot, fold: bool = False, vector: bool = True) -> Singular | None:
    """Return the singular point between two equilibria: as exactly as the tolerance asks, or a point asked for.

    Or more modes than one, whose null vectors are to span the right space.
    """
    if one.unstable == other.unstable:
        return None
    several = abs(other.unstable - one.unstable) > 1
    tolerance = 0.0 if run.to_first or several or fold else min(run.control.tolerance, _LOOSEST)
    found = locate(run.fine, one, other, run.natural, tolerance, fold, vector)
    if found is None or np.abs(run.targets - found.spot.drive).min() > _SIDES * tolerance * run.span:
        return found
    return locate(run.fine, one, other, run.natural, 0.0, fold, vector)


def count(run: Run, place: float, start: float) -> int:
    """Return how many of the points still asked for, one after the other, lie between a start and a bifurcation.

    Or at it: a little behind it counts as well.
    """
    sense = 1.0 if place > start else -1.0
    left = run.targets[run.asked() :]
    outside = ((left - place) * sense > BESIDE * run.span) | ((left - start) * sense < 0)
    return int(outside.argmax()) if outside.any() else len(outside)


def behind(run: Run, goal: float) -> bool:
    """Add a point behind a bifurcation at the drive `goal`, to which no step led; False where there is none.

    The path is foretold from its last two points, on the fine mesh, and compared as far behind that drive as they are
    before it.
    """
    wide, early = (run.fine_spot(k) if len(run.points) > 1 else None for k in (-1, -2))
    if wide is None or early is None or wide.unstable != int(run.points.info[-1, 0]) or wide.drive == early.drive:
        return False
    away = np.abs(run.targets - goal)[(run.targets - goal) * (goal - wide.drive) > 0]
    gap = 0.5 * float(away[away > BESIDE * run.span].min(initial=np.inf))
    place = goal + float(np.sign(goal - wide.drive)) * min(abs(goal - wide.drive), gap)
    guess = wide.y + (wide.y - early.y) * ((place - wide.drive) / (wide.drive - early.drive))
    found = run.fine.solve(guess, place)
    if found is None or found.unstable == wide.unstable:
        return False
    reduced = run.fine.reduce(found)
    if run.fine.pose_change(found.y, guess) > run.reach(abs(place - wide.drive)):
        return False
    run.append(run.as_points(run.settled(reduced) or replace(reduced, tangent=run.solver.unit.copy()), -1))
    return True


def opening(run: Run, found: Singular, one: Spot, wide: Spot | None, name: str) -> None:
    """Add the points asked for up to a bifurcation on the path, and at it, behind it, on the branch.

    `one` is on the path before it, `wide` on the branch, both on the fine mesh; without a branch the path goes on.
    `name` is the branch's.
    """
    reduce, place = run.fine.reduce, found.spot.drive
    start, before = reduce(found.spot).y, reduce(one).y
    for _ in range(count(run, place, one.drive)):
        value = float(run.targets[run.asked()])
        behind = (value - place) * (place - one.drive) > 0 and abs(value - place) > _AT * run.span
        if behind and wide is not None:
            run.branch = name
            share = np.sqrt((value - place) / (wide.drive - place))
            _add(run, start, share * (reduce(wide).y - start), value, wide.unstable)
        else:
            share = 0.0 if abs(value - place) <= _AT * run.span else (value - place) / (one.drive - place)
            _add(run, start, share * (before - start), value, found.after if behind else found.before)


def closing(run: Run, end: BranchEnd, spot: Spot) -> None:
    """Add the points asked for where a branch ends: on it up to there, behind it on the path that it joins."""
    for _ in range(count(run, end.drive, spot.drive)):
        value = float(run.targets[run.asked()])
        if (value - end.drive) * (end.beyond.drive - end.drive) > 0:
            run.branch, share = end.onto, (value - end.drive) / (end.beyond.drive - end.drive)
            _add(run, end.y, share * (end.beyond.y - end.y), value, end.after)
        else:
            share = np.sqrt((value - end.drive) / (spot.drive - end.drive))
            _add(run, end.y, share * (spot.y - end.y), value, spot.unstable)


def _add(run: Run, start: FloatArray, change: FloatArray, value: float, unstable: int) -> None:
    """Add the next point asked for, solved on the fine mesh if that leads where it is foretold."""
    y = start + change
    wide = run.fine.solve(run.fine.expand(y), value) if change.any() else None  # at a bifurcation it is what it is
    near = None if wide is None or wide.unstable != unstable else run.fine.reduce(wide)
    limit = _OFF * run.solver.pose_change(y, start) + _LEAST
    if near is None or run.solver.pose_change(near.y, y) > limit:
        near = Spot(y, value, run.solver.unit, unstable)
    run.append(run.as_points(replace(near, tangent=run.solver.unit.copy()), run.asked()))
    run.pinned.append(value)

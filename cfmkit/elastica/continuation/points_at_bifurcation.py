"""Requested points at a bifurcation, or so close to it that path following cannot resolve on which side they lie.

There the tangent is singular, and the error of integration moves an equilibrium by its cube root. Such points are not
marched to: they follow from the bifurcation, which is located on the fine mesh, and from the paths that meet there. A
branch opens like the square root of the distance, the path itself runs straight through.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.critical_points import locate
from cfmkit.elastica.continuation.path_and_moves import fine_spot
from cfmkit.elastica.equilibrium.network_solver import Spot

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import BranchEnd, PathProblem, Trail

NEAR_BIFURCATION = 1e-5  # share of the drive's range
_AT = 3e-11  # and within which a point is at the bifurcation, whose place is known to about 1e-11
_SIDES = 4.0  # units of the tolerance, as a share of the range, from which it is sure on which side a point lies
_LOOSEST = 1e-4  # tolerance to which a bifurcation is located: a requested point near it would be in doubt
_OFF, _LEAST = 0.3, 1e-6  # how far the solution may be from where it is predicted: as a share of its change, at least


def located(
    problem: PathProblem, trail: Trail, one: Spot, other: Spot, fold: bool = False, vector: bool = True
) -> Singular | None:
    """Return the singular point between two equilibria: as exactly as the tolerance asks, or a requested point.

    Or more modes than one, whose null vectors are to span the right space.
    """
    if one.unstable == other.unstable:
        return None
    several = abs(other.unstable - one.unstable) > 1
    tolerance = 0.0 if problem.first_only or several or fold else min(problem.control.tolerance, _LOOSEST)
    natural, targets = trail.stretch.natural, trail.stretch.targets
    found = locate(problem.fine, one, other, natural, tolerance, fold, vector)
    if found is None or problem.nearest_target(targets, found.spot.drive) > _SIDES * tolerance * problem.span:
        return found
    return locate(problem.fine, one, other, natural, 0.0, fold, vector)


def count(problem: PathProblem, trail: Trail, place: float, start: float) -> int:
    """Return how many of the points still requested, one after the other, lie between a start and a bifurcation.

    Or at it: a little behind it counts as well.
    """
    sense = 1.0 if place > start else -1.0
    left = trail.ahead
    outside = ((left - place) * sense > NEAR_BIFURCATION * problem.span) | ((left - start) * sense < 0)
    return int(outside.argmax()) if outside.any() else len(outside)


def passed(problem: PathProblem, trail: Trail, goal: float) -> Trail | None:
    """Return the path with a point behind a bifurcation at the drive `goal`, to which no step led; None without one.

    The path is predicted from its last two points, on the fine mesh, and compared as far behind that drive as they are
    before it.
    """
    fine, targets = problem.fine, trail.stretch.targets
    wide, early = (fine_spot(problem, trail, k) if len(trail.points) > 1 else None for k in (-1, -2))
    if wide is None or early is None or wide.unstable != trail.unstable(-1) or wide.drive == early.drive:
        return None
    away = np.abs(targets - goal)[(targets - goal) * (goal - wide.drive) > 0]
    gap = 0.5 * float(away[away > NEAR_BIFURCATION * problem.span].min(initial=np.inf))
    place = goal + float(np.sign(goal - wide.drive)) * min(abs(goal - wide.drive), gap)
    guess = wide.y + (wide.y - early.y) * ((place - wide.drive) / (wide.drive - early.drive))
    found = fine.solve(guess, place)
    if found is None or found.unstable == wide.unstable:
        return None
    if fine.pose_change(found.y, guess) > problem.reach(abs(place - wide.drive)):
        return None
    return trail.with_spot(trail.settled_or_given(fine.reduce(found)), -1)


def opening(problem: PathProblem, trail: Trail, found: Singular, one: Spot, wide: Spot | None, name: str) -> Trail:
    """Return the path with the requested points up to a bifurcation on it, and at it, behind it, on the branch.

    `one` is on the path before it, `wide` on the branch, both on the fine mesh; without a branch the path goes on.
    `name` is the branch's.
    """
    reduce, place, at = problem.fine.reduce, found.spot.drive, _AT * problem.span
    left = count(problem, trail, place, one.drive)
    if not left:
        return trail
    start, before = reduce(found.spot).y, reduce(one).y
    for _ in range(left):
        value = float(trail.ahead[0])
        behind = (value - place) * (place - one.drive) > 0 and abs(value - place) > at
        if behind and wide is not None:
            share = np.sqrt((value - place) / (wide.drive - place))
            there = trail.changed(branch=name), start, share * (reduce(wide).y - start), value, wide.unstable
        else:
            share = 0.0 if abs(value - place) <= at else (value - place) / (one.drive - place)
            there = trail, start, share * (before - start), value, found.after if behind else found.before
        trail = _with_requested(problem, *there)
    return trail


def closing(problem: PathProblem, trail: Trail, end: BranchEnd, spot: Spot) -> Trail:
    """Return the path with the requested points where a branch ends: on it up to there, behind it where it leads."""
    for _ in range(count(problem, trail, end.drive, spot.drive)):
        value = float(trail.ahead[0])
        if (value - end.drive) * (end.beyond.drive - end.drive) > 0:
            share = (value - end.drive) / (end.beyond.drive - end.drive)
            there = trail.changed(branch=end.onto), end.y, share * (end.beyond.y - end.y), value, end.after
        else:
            share = np.sqrt((value - end.drive) / (spot.drive - end.drive))
            there = trail, end.y, share * (spot.y - end.y), value, spot.unstable
        trail = _with_requested(problem, *there)
    return trail


def _with_requested(
    problem: PathProblem, trail: Trail, start: FloatArray, change: FloatArray, value: float, unstable: int
) -> Trail:
    """Return the path with the next requested point, solved on the fine mesh if that leads where it is predicted."""
    y, solver, fine = start + change, trail.solver, problem.fine
    wide = fine.solve(fine.expand(y), value) if change.any() else None  # at a bifurcation it is what it is
    near = None if wide is None or wide.unstable != unstable else fine.reduce(wide)
    limit = _OFF * solver.pose_change(y, start) + _LEAST
    if near is None or solver.pose_change(near.y, y) > limit:
        near = Spot(y, value, solver.unit, unstable)
    added = trail.with_spot(replace(near, tangent=solver.unit.copy()), trail.requested)
    return added.changed(pinned=(*trail.pinned, value))

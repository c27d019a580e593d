"""Corners of a path at a bifurcation that two meshes put on different sides of a point: too sharp to be followed.

A column of pieces with a requested point at its critical load is led past it, unstable, and stalls: the path is taken
back to well before, where both meshes agree, and led across.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation import at_bifurcation
from cfmkit.elastica.continuation.bifurcation import crossed
from cfmkit.elastica.continuation.state import Resume, fine_spot

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.state import Move, Problem, Trail
    from cfmkit.elastica.equilibrium.solver import Spot

_WELL = 3e-3  # share of the drive's range that is well before a corner
_BACK = 30  # points looked at before the place where a march stalled
_NEAR = 1e-4  # share of the drive's range from which the next requested point is solved for on the fine mesh


def past(problem: Problem, trail: Trail, spot: Spot, requested: int) -> tuple[Trail, Move | None]:
    """Go past a bifurcation where the march along the primary path stalled; None where there is none.

    On the fine mesh the path is followed up to a requested point just before the bifurcation, then across it.
    """
    goal, span, stays = float(trail.stretch.targets[requested]), problem.span, problem.control.branch == "stop"
    trail = trail.come_by(spot.drive)
    if abs(goal - spot.drive) <= _NEAR * span:
        there = _on_fine(problem, trail, spot, goal)
        if there is not None and there.unstable == spot.unstable:
            return trail, Resume(trail.with_spot(there, requested), there)
    before = None if stays else _before(problem, trail)
    if before is not None:
        trail, start = before
        forward = float(np.sign(goal - start.drive))
        for power in range(-6, -2):
            near = _on_fine(problem, trail, start, spot.drive + forward * 10.0**power * span)
            if near is not None and near.unstable > start.unstable:
                move = crossed(problem, trail.with_spot(near, -1))
                events = move.trail.events
                if len(events) > len(trail.events) and events[-1].kind == "unresolved":
                    trail = replace(move.trail.up_to(-1), events=events[:-1])
                    break
                return trail, move
    back = None if stays or trail.stuck(problem) else _taken_back(problem, trail, spot.drive)
    return trail, None if back is None else crossed(problem, back)


def _taken_back(problem: Problem, trail: Trail, place: float) -> Trail | None:
    """Return the path up to well before a place, and a point behind it, if there is a bifurcation between."""
    points, names = trail.points, trail.branches
    last = len(names) - 1
    while last > trail.stretch.begun + 1 and abs(float(points.drive[last]) - place) < _WELL * problem.span:
        if names[last - 1] != names[-1]:
            break
        last -= 1
    behind = at_bifurcation.passed(problem, trail.up_to(last + 1), place)
    if behind is None:
        return None
    far, here = behind.points.drive[[-1, last]] * problem.unit
    events = behind.events
    while events and min(far, here) < events[-1].drive <= max(far, here):  # it is passed again
        events = events[:-1]
    return replace(behind, events=events)


def _before(problem: Problem, trail: Trail) -> tuple[Trail, Spot] | None:
    """Return the path up to the last point that is before the bifurcation on the fine mesh too, and that point."""
    for back in range(1, min(len(trail.points) - trail.stretch.begun, _BACK) + 1):
        if trail.points.unstable[-back] != trail.points.unstable[-1]:
            return None
        wide = fine_spot(problem, trail, -back)
        if wide is not None and wide.unstable == trail.unstable(-back):
            kept = trail.up_to(len(trail.points) - back + 1)
            return kept, kept.spot(-1)
        if trail.points.requested[-back] >= 0:
            return None
    return None


def _on_fine(problem: Problem, trail: Trail, spot: Spot, drive: float) -> Spot | None:
    """Return the equilibrium of the fine mesh at a drive, if it is near, solved on this mesh if that is possible."""
    fine = problem.fine
    wide = fine.solve(fine.expand(spot.y), drive)
    if wide is None:
        return None
    reduced = fine.reduce(wide)
    if trail.solver.pose_change(reduced.y, spot.y) > problem.reach(abs(drive - spot.drive)):
        return None
    return trail.settled_or_given(reduced)

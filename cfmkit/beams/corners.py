"""Corners of a path at its bifurcations: the error of integration rounds them off, too sharply to be followed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams import beside
from cfmkit.beams.branches import cross

if TYPE_CHECKING:
    from cfmkit.beams.run import Run
    from cfmkit.beams.solver import Spot

_WELL = 3e-3  # share of the drive's range that is well before a corner
_BACK = 30  # points looked at before the place where a march stalled
_NEAR = 1e-4  # share of the drive's range from which the next point asked for is solved for on the fine mesh


def past(run: Run, spot: Spot, asked: int) -> Spot | None:
    """Go past a bifurcation where the march along the primary path stalled; None where there is none, or it ends there.

    On the fine mesh the path is followed up to a point asked for just before the bifurcation, then across it.
    """
    goal = float(run.targets[asked])
    run.come_by(spot.drive)
    if abs(goal - spot.drive) <= _NEAR * run.span:
        there = _beside(run, spot, goal)
        if there is not None and there.unstable == spot.unstable:
            run.append(run.as_points(there, asked))
            return there
    start = _before(run) if run.control.branch != "stop" else None
    if start is not None:
        forward = float(np.sign(goal - start.drive))
        for power in range(-6, -2):
            near = _beside(run, start, spot.drive + forward * 10.0**power * run.span)
            if near is not None and near.unstable > start.unstable:
                run.append(run.as_points(near, -1))
                told = len(run.events)
                following = cross(run)
                if run.events[told:] and run.events[-1].kind == "unresolved":
                    run.events.pop()
                    run.drop_last()
                    break
                return following
    if run.control.branch != "stop" and not run.stuck and _taken_back(run, spot.drive):
        return cross(run)
    return None


def _taken_back(run: Run, place: float) -> bool:
    """Take the path back to well before a place, and add a point behind it, if there is a bifurcation between."""
    points, names = run.points, list(run.branches)
    last = len(names) - 1
    while last > run.begun + 1 and abs(float(points.drive[last]) - place) < _WELL * run.span:
        if names[last - 1] != names[-1]:
            break
        last -= 1
    run.points, run.branches = points.take(slice(0, last + 1)), names[: last + 1]
    if beside.behind(run, place):
        far, here = points.drive[[-1, last]] * run.unit
        while run.events and min(far, here) < run.events[-1].drive <= max(far, here):  # it is passed again
            run.events.pop()
        return True
    run.points, run.branches = points, names
    return False


def _before(run: Run) -> Spot | None:
    """Return the last point that is before the bifurcation on the fine mesh too; those after it are taken back."""
    for back in range(1, min(len(run.points) - run.begun, _BACK) + 1):
        if run.points.info[-back, 0] != run.points.info[-1, 0]:
            return None
        wide = run.fine_spot(-back)
        if wide is not None and wide.unstable == int(run.points.info[-back, 0]):
            for _ in range(back - 1):
                run.drop_last()
            return run.spot(-1)
        if run.points.info[-back, 1] >= 0:
            return None
    return None


def _beside(run: Run, spot: Spot, drive: float) -> Spot | None:
    """Return the equilibrium of the fine mesh at a drive, if it is near, solved on this mesh if that is possible."""
    wide = run.fine.solve(run.fine.expand(spot.y), drive)
    if wide is None:
        return None
    reduced = run.fine.reduce(wide)
    if run.solver.pose_change(reduced.y, spot.y) > run.reach(abs(drive - spot.drive)):
        return None
    return run.settled(reduced) or replace(reduced, tangent=run.solver.unit.copy())

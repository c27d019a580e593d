"""A part under a force or a moment that grows: its pose at the load, read off its path under a growing travel.

On a path that is followed by its travel the effort is known everywhere, so the travel at a load is where the effort
first reaches it. Up to there the effort rises: from its first maximum on the part would jump. The pose at the end is
solved for, between poses efforts are those of the path's cubics, whose error is known (`meshed_part.refine_path`).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.solid.path_following import PathEnd, follow, pose_between

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.meshed_part import Meshed, MeshSolution
    from cfmkit.solid.path_following import PosePath

TRAVEL_RANGES = (1.25, 2.5, 5.0, 10.0)  # travels in which a load is looked for, in those that the beams need for it
TRAVEL_MARGIN = 1.05
"""Travel of the finer mesh, in that of a coarse one: their forces differ by up to a few thousandths, the travels by a
few per cent where the curve is flat."""
MAX_NEWTON_STEPS = 4  # of Newton's method for the travel at the load: two are usual, as the cubic is close
LOAD_RTOL, MISSED_LOAD_RTOL = 1e-9, 1e-6
"""Differences from the load, in parts of it, at which it is found, and at which it is not missed: in long thin strips
efforts are known to 1e-7 only."""
MAX_HALVINGS = 60  # of an interval between two poses: beyond them a travel has no more digits


class LoadEnd(enum.Enum):
    """Extent of a path under a load."""

    REACHED = "the load is reached"
    MAXIMUM = "the load has a maximum before: the part jumps there"
    SHORT = "the path ends before"


@dataclass(frozen=True)
class LoadPath:
    """Answer of a path about a load."""

    end: float  # travel at the load, at its first maximum, or at the end of the path [m or rad]
    effort: float  # the effort there [N or N m]
    how: LoadEnd

    @classmethod
    def from_course(cls, course: PosePath, load: float, through_maxima: bool) -> LoadPath:
        """Return what a path says of a load of either sign [N or N m]; it may pass maxima if that is allowed."""
        sense = float(np.sign(load))
        law = course.law(sense)
        last = float(law.x[-1] if through_maxima else first_maximum(course, sense))
        roots = law.solve(abs(load), extrapolate=False)
        roots = roots[np.isfinite(roots) & (roots > 0.0) & (roots <= last)]
        if len(roots):
            return cls(sense * float(roots.min()), load, LoadEnd.REACHED)
        how = LoadEnd.MAXIMUM if last < law.x[-1] else LoadEnd.SHORT
        return cls(sense * last, sense * float(law(last)), how)


def first_maximum(course: PosePath, sense: float) -> float:
    """Return up to which travel, times the sign of its direction, the effort rises: its end if it always does."""
    law = course.law(sense)
    flat = law.derivative().roots(extrapolate=False)
    return float(flat[np.isfinite(flat) & (flat > 0.0)].min(initial=law.x[-1]))


def travel_for(
    meshed: Meshed,  # the part, coarsely
    load: float,  # [N or N m]
    guess: float,  # travel at which it may be [m or rad]
    poses: int,  # solved for in the first range that is looked at
    through_maxima: bool,  # whether maxima of the effort are passed
    report: Callable[[float], None],  # is given the share that is done
) -> float:
    """Return the travel within which a part reaches a load, or a maximum before it, with a margin [m or rad]."""
    travel, sense = guess, np.sign(load)
    for times in TRAVEL_RANGES:
        stops = np.linspace(0.0, times * guess, poses).tolist()
        course = follow(meshed.problem, stops, report, lambda effort: sense * effort >= abs(load))
        if len(course.poses) < 2:
            break
        path = LoadPath.from_course(course, load, through_maxima)
        travel = path.end
        if path.how is not LoadEnd.SHORT or course.ended:
            break
    return TRAVEL_MARGIN * travel


def follow_to_load(solved: MeshSolution, load: float, through_maxima: bool) -> tuple[MeshSolution, LoadPath]:
    """Return the part's path up to a load [N or N m] or to where it ends before, and how it ended."""
    course = solved.course
    path = LoadPath.from_course(course, load, through_maxima)
    if path.how is LoadEnd.SHORT:
        return solved, path
    poses = [pose for pose in course.poses if abs(pose.travel) < abs(path.end) * (1 - 1e-12)]
    beyond = course.poses[len(poses)]
    last, travel = None, path.end
    for _ in range(MAX_NEWTON_STEPS):
        last = pose_between(solved.problem, poses[-1], beyond, travel)
        if last is None or path.how is LoadEnd.MAXIMUM or abs(last.effort - load) <= LOAD_RTOL * abs(load):
            break
        travel += (load - last.effort) / last.stiffness
    if last is None:
        ended = replace(course, poses=tuple(poses), ending=PathEnd.LOST)
        return replace(solved, course=ended), LoadPath(poses[-1].travel, poses[-1].effort, LoadEnd.SHORT)
    ended = replace(course, poses=(*poses, last), ending=PathEnd.COMPLETE, touching=None)
    return replace(solved, course=ended), LoadPath(last.travel, last.effort, path.how)


def with_poses(solved: MeshSolution, travels: Iterable[float]) -> MeshSolution:
    """Return the part's path with further poses at some travels [m or rad], as far as they are found."""
    poses = list(solved.course.poses)
    slack = 1e-9 * abs(poses[-1].travel)
    for travel in travels:
        after = next((k for k, pose in enumerate(poses) if abs(pose.travel) > abs(travel) - slack), 0)
        if after and abs(poses[after].travel - travel) > slack:
            reached = pose_between(solved.problem, poses[after - 1], poses[after], travel)
            poses[after:after] = [] if reached is None else [reached]
    return replace(solved, course=replace(solved.course, poses=tuple(poses)))


def travels_at(course: PosePath, loads: FloatArray) -> FloatArray:
    """Return where a path that rises has some efforts (n,) of one sign [m or rad], as far as it has them."""
    sense = float(np.sign(loads[-1]))
    law = course.law(sense)
    wanted = np.abs(loads)
    wanted = wanted[wanted <= abs(course.poses[-1].effort) * (1 + MISSED_LOAD_RTOL)]
    at = np.clip(np.searchsorted(law(law.x), wanted), 1, len(law.x) - 1)
    low, high = law.x[at - 1], law.x[at]
    for _ in range(MAX_HALVINGS):
        middle = 0.5 * (low + high)
        below = law(middle) < wanted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return read_only(sense * np.where(wanted == 0.0, 0.0, high))

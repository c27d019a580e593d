"""Poses of a part along its path: with corners at bifurcations, up to its end or to where it touches something.

Where stability is lost the path goes on along another branch, and the curve of effort over travel has a corner: two
poses, one with the stiffness before it and one with that behind it. A mesh is an imperfection: where the path goes
round a corner within a small part of the travel, that is a bifurcation, too (`Options.corner`); its poses are kept.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import Polynomial

from cfmkit.numerics.continuation.branches import find_beside
from cfmkit.numerics.continuation.follow import follow as follow_path
from cfmkit.numerics.continuation.path import Options, PathEvent, PathStop, Point, WhyStopped
from cfmkit.numerics.continuation.steps import hermite
from cfmkit.solid.equilibrium import Balance
from cfmkit.solid.followed_part import FollowedPart

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scipy.interpolate import CubicHermiteSpline

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.problem import PathEquilibrium
    from cfmkit.solid.equilibrium import SolidProblem
    from cfmkit.solid.followed_part import PathGuide

FINEST_STEP = 2.0**-16  # share of the travel below which no step is tried
STEP_GROWTH = 2.0  # of a step after one that was easy
MAX_CORNER_SHARE = 2.0**-9  # share of the travel over which a mesh may round a bifurcation
CORNER_WIDTH = 1e-9  # share of the travel between the two poses at a corner
BESIDE_CORNER = 1.0 / 16.0
"""Share of the way from a bifurcation to the next pose of its branch at which the branch's stiffness is taken."""
CONTACT_WIDTH = 1e-3  # share of the travel within which it is found where a part touches itself
LARGEST_MISS, SMALL_MISS = 0.5, 1e-3
"""Correction of a pose between two others, in parts of the way between these and of the part's size: at most both."""
LOAD_STEP, FINEST_LOAD_STEP = 0.25, 2.0**-6  # first and smallest share by which constant loads grow


class PathEnd(enum.Enum):
    """Why a path ended."""

    COMPLETE = ""
    LIMIT_POINT = "the part snaps: the travel has a limit point"
    UNSTABLE = "the part loses its stability, and no stable branch was found"
    LOST = "no equilibrium was found within the smallest step"
    NO_START = "the part has no equilibrium at rest"
    OVERLOADED = "the part has no stable equilibrium under its constant loads"
    CONTACT = "the part touches itself"


PATH_ENDS = {
    WhyStopped.COMPLETE: PathEnd.COMPLETE,
    WhyStopped.LIMIT_POINT: PathEnd.LIMIT_POINT,
    WhyStopped.JUMPS: PathEnd.UNSTABLE,
}


@dataclass(frozen=True)
class PosePath:
    """Poses of a part in order of travel."""

    # the requested ones as far as they were reached, and those on the way where steps were cut; without factors
    poses: tuple[Balance, ...]
    ending: PathEnd
    bifurcations: tuple[float, ...] = ()  # travels at which another branch was taken [m or rad]
    # (2,) where the part touches itself just beyond the last pose, on the part as it is then [m]
    touching: FloatArray | None = None

    @property
    def ended(self) -> str:
        """Why it ended early, with the place where it touches itself; empty if it did not."""
        if self.touching is None:
            return self.ending.value
        x, y = (1e3 * self.touching).tolist()
        return f"{self.ending.value} at ({x:.4g} mm, {y:.4g} mm)"

    @property
    def travel(self) -> FloatArray:
        """Of the poses, (k,) [m or rad]."""
        return np.array([pose.travel for pose in self.poses])

    @property
    def solved_travel(self) -> FloatArray:
        """Of the poses that are solved, not put together, (j,) [m or rad]."""
        return np.array([pose.travel for pose in self.poses if pose.solved])

    def law(
        self,
        sense: float = 1.0,  # 1 or -1: that of a travel to the negative side makes it increase along the path
    ) -> CubicHermiteSpline:
        """Return the cubics through the efforts and stiffnesses of the poses, of travel and effort times a sign."""
        from scipy.interpolate import CubicHermiteSpline

        rising = sorted(self.poses, key=lambda pose: sense * pose.travel)
        places, efforts, slopes = np.array([(pose.travel, pose.effort, pose.stiffness) for pose in rising]).T
        return CubicHermiteSpline(sense * places, sense * efforts, slopes)

    def effort(self, travel: FloatArray) -> FloatArray:
        """Return the effort at travels (m,) [N or N m]: cubics with the efforts and stiffnesses of the poses."""
        return np.asarray(self.law()(travel))


def follow(
    problem: SolidProblem,  # the part and its supports
    stops: Sequence[float],  # travels, from rest on in one direction [m or rad]
    report: Callable[[float], None] = lambda _share: None,  # is given the share of the travel that is done
    # is given the effort of a pose [N or N m], and tells whether it is the last
    enough: Callable[[float], bool] = lambda _effort: False,
    guide: PathGuide | None = None,  # predicts the unknowns
) -> PosePath:
    """Return the poses of a part at some travels, on its stable branch."""
    part = FollowedPart(problem, guide=guide)
    start = _first_equilibrium(part, stops[0])
    if start is None:
        return PosePath((), PathEnd.OVERLOADED if problem.supports.loaded else PathEnd.NO_START)
    span = abs(stops[-1] - stops[0])
    first_step = 1.0 if guide else float(np.abs(np.diff(stops)).max()) / span
    options = Options(span, first_step=first_step, growth=STEP_GROWTH, corner=MAX_CORNER_SHARE, finest_step=FINEST_STEP)
    path = PosePath((), PathEnd.COMPLETE)
    event: PathEvent | None = None  # a bifurcation behind the last pose
    for item in follow_path(part, start, np.array(stops[1:]), options):
        if isinstance(item, PathEvent):
            if item.before == item.after:
                path = replace(path, bifurcations=(*path.bifurcations, _meet(part, path, item, path.poses[-1])[0]))
            else:
                event = item
            continue
        if isinstance(item, PathStop):
            return _with_ending(part, path, item, event)
        passed = abs(path.poses[-1].travel - stops[0]) if path.poses else -1.0
        if not passed < abs(item.at.drive - stops[0]) <= span * (1.0 + 1e-12):  # behind the last stop a branch begins
            continue
        pose = part.pose(item.at)
        if event is not None and abs(pose.travel - stops[0]) > abs(event.drive - stops[0]):
            path, event = _add_corner(part, path, event, pose), None
        spot = touching(problem, pose)
        if spot is not None and path.poses:
            return _end_at_contact(problem, path, pose, spot, CONTACT_WIDTH * span)
        path = replace(path, poses=(*path.poses, pose))
        report(abs(pose.travel - stops[0]) / span)
        if enough(pose.effort):
            break
    return path


def _first_equilibrium(part: FollowedPart, travel: float) -> PathEquilibrium | None:
    """Return the first equilibrium, under the constant loads; None if they are too large.

    They grow from nothing: from afar Newton's method may come to a form that the part snaps into later, if at all.
    """
    rest, loaded = np.zeros(part.problem.supports.size), part.problem.supports.loaded
    ramp = FollowedPart(part.problem, held_at=travel) if loaded else part
    start = ramp.solve(rest, 0.0 if loaded else travel)
    if start is None:
        return None
    part.rest_stiffness = ramp.rest_stiffness = ramp.softest(start)[0]
    if not loaded:
        return start
    options = Options(1.0, branch="stop", first_step=LOAD_STEP, finest_step=FINEST_LOAD_STEP)
    for item in follow_path(ramp, start, np.ones(1), options):
        if isinstance(item, Point) and item.at.drive == 1.0 and not item.at.unstable:
            return part.solve(item.at.x, travel)
    return None


def _with_ending(part: FollowedPart, path: PosePath, stop: PathStop, event: PathEvent | None) -> PosePath:
    """Return a path with its ending, up to where stability is lost if it is."""
    ending = PATH_ENDS.get(stop.end, PathEnd.LOST)
    if ending is PathEnd.UNSTABLE and event is not None and event.within is not None and len(path.poses) > 1:
        first, beyond = path.poses[-1], part.pose(event.within[1])
        back = FINEST_STEP * (stop.drive - path.poses[0].travel)
        last = pose_between(part.problem, first, beyond, stop.drive - back)
        if last is not None and abs(last.travel - path.poses[0].travel) > abs(first.travel - path.poses[0].travel):
            path = replace(path, poses=(*path.poses, last))
    if ending is PathEnd.LIMIT_POINT and len(path.poses) > 2 and _is_steep(*path.poses[-2:]):
        path = replace(path, poses=path.poses[:-1])
    return replace(path, ending=ending)


def _is_steep(first: Balance, last: Balance) -> bool:
    """Return True if the cubic between two poses may overshoot, as before a limit point [Fritsch, Carlson, 1980]."""
    chord = (last.effort - first.effort) / (last.travel - first.travel)
    return abs(last.stiffness) > 3.0 * abs(chord)


def _end_at_contact(problem: SolidProblem, path: PosePath, pose: Balance, spot: FloatArray, width: float) -> PosePath:
    """Return a path up to just before a part touches itself, as it does at a pose."""
    poses = list(path.poses)
    while abs(pose.travel - poses[-1].travel) > width:
        middle = pose_between(problem, poses[-1], pose, 0.5 * (poses[-1].travel + pose.travel))
        if middle is None:
            break
        if (met := touching(problem, middle)) is None:
            poses.append(middle)
        else:
            pose, spot = middle, met
    return replace(path, poses=tuple(poses), ending=PathEnd.CONTACT, touching=spot)


def pose_between(problem: SolidProblem, first: Balance, last: Balance, travel: float) -> Balance | None:
    """Return the pose at a travel between two of one branch; None if none is as stable near their cubic."""
    part = FollowedPart(problem)
    ends = part.equilibrium(first), part.equilibrium(last)
    guess = hermite(*ends, travel)
    at = part.solve(guess, travel)
    if at is None or at.unstable > first.unstable:
        return None
    moves = slice(len(problem.supports.loose))  # behind them are turns
    allowed = LARGEST_MISS * np.abs((ends[1].x - ends[0].x)[moves]).max() + SMALL_MISS
    return part.pose(at) if np.abs((at.x - guess)[moves]).max() <= allowed else None


def _add_corner(part: FollowedPart, path: PosePath, event: PathEvent, pose: Balance) -> PosePath:
    """Return a path with the corner of a bifurcation that lies between its last pose and another.

    Beside the corner stand a pose before it and one behind it: at one of them, or both, its stiffness is known.
    """
    assert event.within is not None
    place, width = event.drive, CORNER_WIDTH * (pose.travel - path.poses[0].travel)
    first, last = (part.pose(at) for at in event.within)
    if event.nearest is None:  # the mesh rounds it
        place, effort, before, behind = _meet(part, path, event, pose)
        unknowns = first.unknowns + (place - first.travel) * first.slope
    else:
        corner, onto = part.pose(event.nearest), event.before < event.after
        pose_near, far = (
            (first, pose) if onto else (last, path.poses[-1])
        )  # on the path that crosses, and on the branch
        goal = place + BESIDE_CORNER * (far.travel - place)
        far = part.pose(find_beside(part, event.nearest.x, place, part.equilibrium(far), goal, far.unstable))
        effort, unknowns = corner.effort + (place - corner.travel) * pose_near.stiffness, corner.unknowns
        opening = 2 * (effort - far.effort) / (place - far.travel) - far.stiffness  # of a parabola
        before, behind = (pose_near.stiffness, opening) if onto else (opening, pose_near.stiffness)
        first, last = (pose_near, far) if onto else (far, pose_near)
    path = replace(path, bifurcations=(*path.bifurcations, place))
    if min(abs(place - first.travel), abs(place - last.travel)) < 2.0 * abs(width):
        return path
    poses = [item for item in path.poses if (item.travel - first.travel) * width < 0.0]
    for end, travel, stiffness in ((first, place, before), (last, place + width, behind)):
        slope = (end.unknowns - unknowns) / (end.travel - place)
        poses.append(Balance(travel, unknowns, effort, stiffness, pose.unstable, slope, None))
    poses.insert(-2, first)
    if (pose.travel - last.travel) * width > 0.0:
        poses.append(last)
    return replace(path, poses=tuple(poses))


def _meet(part: FollowedPart, path: PosePath, event: PathEvent, later: Balance) -> tuple[float, float, float, float]:
    """Return travel and effort where the curves before and behind a rounded corner meet, and their stiffnesses."""
    assert event.within is not None
    first, last = (part.pose(at) for at in event.within)
    place, sense = event.drive, np.sign(last.travel - first.travel)
    earlier = next((item for item in path.poses[::-1] if (item.travel - first.travel) * sense < 0.0), first)
    curves = _curve_beside(first, earlier, place), _curve_beside(last, later, place)
    roots = np.asarray((curves[0] - curves[1]).roots(), complex)
    inside = (roots.imag == 0.0) & ((roots.real > first.travel - place) != (roots.real > last.travel - place))
    offset = min(roots.real[inside].tolist(), key=abs, default=0.0)
    before, behind = (float(curve.deriv()(offset)) for curve in curves)
    return place + offset, float(curves[0](offset)), before, behind


def _curve_beside(pose: Balance, neighbour: Balance, place: float) -> Polynomial:
    """Return the effort near a pose and another by a cubic, over the travel behind a place."""
    distance = neighbour.travel - pose.travel
    cubic = Polynomial([pose.effort, pose.stiffness])
    if distance:
        gap, change = neighbour.effort - float(cubic(distance)), neighbour.stiffness - pose.stiffness
        cubic += Polynomial(
            [0.0, 0.0, (3 * gap - distance * change) / distance**2, (distance * change - 2 * gap) / distance**3]
        )
    return cubic(Polynomial([place - pose.travel, 1.0]))


def touching(problem: SolidProblem, pose: Balance) -> FloatArray | None:
    """Return where the boundary crosses itself or a frame at a pose (2,) [m]; None if it does not.

    What moves as one rigid piece cannot cross itself. Edges are lines between nodes: two that touch overlap by their
    sagitta at most.
    """
    from shapely import STRtree, crosses, linestrings

    elements, supports = problem.elements, problem.supports
    edges = elements.mesh.edges
    places = elements.mesh.nodes + supports.evaluate_displacements(pose.unknowns, pose.travel)
    pieces = np.concatenate([edges[:, [0, 2]], edges[:, [2, 1]]])
    rigid = -np.ones(len(places), int)
    for number, group in enumerate(supports.groups):
        rigid[group.nodes] = number
    of = np.where(rigid[pieces[:, 0]] == rigid[pieces[:, 1]], rigid[pieces[:, 0]], -1)
    lines = linestrings(places[pieces])
    if (spot := _find_obstacle(problem, pieces, lines)) is not None:
        return spot
    first, others = STRtree(lines).query(lines)
    apart = (first < others) & ((of[first] < 0) | (of[first] != of[others]))
    first, others = first[apart], others[apart]
    apart = (pieces[first][:, :, None] != pieces[others][:, None, :]).all(axis=(1, 2))  # neighbours share a node
    first, others = first[apart], others[apart]
    met = np.flatnonzero(crosses(lines[first], lines[others]))
    if not len(met):
        return None
    return np.asarray(lines[first[met[0]]].intersection(lines[others[met[0]]]).coords[0])


def _find_obstacle(problem: SolidProblem, pieces: Any, lines: Any) -> FloatArray | None:
    """Return where a piece of the boundary, of two nodes each, is in a frame that it was not in at rest [m]."""
    if not problem.obstacles:
        return None
    from shapely import Polygon, intersects, linestrings, union_all

    stands = union_all([Polygon(ring) for ring in problem.obstacles])
    entered = intersects(lines, stands)
    entered[entered] = ~intersects(linestrings(problem.elements.mesh.nodes[pieces[entered]]), stands)
    if not entered.any():
        return None
    common = lines[np.flatnonzero(entered)[0]].intersection(stands)
    return np.asarray(common.representative_point().coords[0])

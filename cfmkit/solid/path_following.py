"""Following a part's equilibria over its travel: step control, loss of stability, branch switching.

Each pose is predicted along the tangent of the path and corrected by Newton's method. A step is halved where Newton
fails, where the correction is not small beside the step (it has come to another branch), and where a direction has
become unstable. When the step is at its smallest and the next pose is still unstable, the path has passed a
bifurcation: from a little beyond it the part is pushed along its softest mode until a stable pose is found.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scipy.interpolate import CubicHermiteSpline

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.equilibrium import Balance, SolidProblem

SMALLEST = 2.0**-12
"""Smallest step, in parts of the whole travel: a bifurcation's place is then known to 2.5e-4 of the travel."""
STRAY = 0.5
"""Largest correction, in parts of the step: on one branch it shrinks with the step's square."""
SOFTLY = 1e-3
"""Corrections below this part of the part's size count as small: next to a bifurcation rounding is amplified along the
soft mode beyond any short step."""
FARTHEST = 2.5
"""Step, in those of the last one, up to which a cubic is a better prediction than a tangent."""
GROWTH = 2.0
"""Of the step after one that was easy."""
CORNER, SEEN = 0.3, 0.05
"""Change of the stiffness, in parts of the larger one and of the largest so far, for which steps are cut: that of a
smooth curve gets smaller and smaller, one that does not has a corner, as at a bifurcation."""
ROUNDED = 8.0
"""Smallest steps over which a corner may be rounded: where a branch ends, a mesh is an imperfection."""
CORNERS_APART = 2.0**-6
"""Distance between corners, in parts of the whole travel: a corner is seen by its neighbours, too."""
CORNER_WIDTH = 1e-9
"""Distance between the two poses at a corner, one with the stiffness before it and one with that behind it, in parts of
the whole travel."""
PUSHES = np.geomspace(1e-4, 0.1, 13)
"""Amplitudes along the softest mode, in parts of the part's size: a branch leaves its bifurcation like a root."""
NEAR = 1e-3
"""How closely the travel is found at which a part touches itself, in parts of the whole travel."""
BEYOND = (2.0, 8.0, 32.0)
"""How far beyond a bifurcation its branch is looked for, in smallest steps."""
MODE_ROUNDS = 30
"""Of inverse iteration: next to a bifurcation the lowest eigenvalue is hundreds of times smaller than the second."""
LOAD_STEP, SMALLEST_LOAD_STEP = 0.25, 2.0**-6
"""First and smallest step in which constant loads are put on, in parts of them."""
SOFT = 30.0
"""The path has a limit point where it ends while its tangent has grown by so much against the travel's first pose."""


class PathEnd(enum.Enum):
    """Why a path ended."""

    COMPLETE = ""
    LIMIT_POINT = "the part snaps: the travel has a limit point"
    UNSTABLE = "the part loses its stability, and no stable branch was found"
    LOST = "no equilibrium was found within the smallest step"
    NO_START = "the part has no equilibrium at rest"
    OVERLOADED = "the part has no stable equilibrium under its constant loads"
    CONTACT = "the part touches itself"


@dataclass(frozen=True)
class PosePath:
    """Poses of a part in order of travel.

    Attributes
    ----------
    poses : tuple of Balance
        The requested ones as far as they were reached, and those on the way where steps were cut; without factors.
    ending : PathEnd
    bifurcations : tuple of float
        Travels at which another branch was taken [m or rad].
    touching : (2,) array or None
        Where the part touches itself just beyond the last pose, on the part as it is then [m].
    """

    poses: tuple[Balance, ...]
    ending: PathEnd
    bifurcations: tuple[float, ...] = ()
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

    def law(self, sense: float = 1.0) -> CubicHermiteSpline:
        """Return the cubics through the efforts and stiffnesses of the poses, of travel and effort times a sign.

        Parameters
        ----------
        sense : float
            1 or -1: that of a travel to the negative side makes it increase along the path.
        """
        from scipy.interpolate import CubicHermiteSpline

        rising = sorted(self.poses, key=lambda pose: sense * pose.travel)
        places, efforts, slopes = np.array([(pose.travel, pose.effort, pose.stiffness) for pose in rising]).T
        return CubicHermiteSpline(sense * places, sense * efforts, slopes)

    def effort(self, travel: FloatArray) -> FloatArray:
        """Return the effort at travels (m,) [N or N m]: cubics with the efforts and stiffnesses of the poses."""
        return np.asarray(self.law()(travel))


def follow(
    problem: SolidProblem,
    stops: Sequence[float],
    report: Callable[[float], None] = lambda _share: None,
    enough: Callable[[float], bool] = lambda _effort: False,
    guide: Callable[[float], FloatArray | None] = lambda _travel: None,
) -> PosePath:
    """Return the poses of a part at some travels, on its stable branch.

    Parameters
    ----------
    problem : SolidProblem
        The part and its supports.
    stops : sequence of float
        Travels, from rest on in one direction [m or rad].
    report : callable
        Is given the share of the travel that is done.
    enough : callable
        Is given the effort of a pose [N or N m], and tells whether it is the last.
    guide : callable
        Predicts the unknowns (q,) at a travel; None if it cannot.
    """
    start = _start(problem, stops[0])
    if start is None:
        return PosePath((), PathEnd.OVERLOADED if problem.supports.loaded else PathEnd.NO_START)
    span = stops[-1] - stops[0]
    course, state, step = PosePath((start.kept(),), PathEnd.COMPLETE), start, stops[1] - stops[0]
    smooth: list[Balance] = []  # earlier poses from the last corner on
    for stop in stops[1:]:
        while state.travel != stop:
            ahead = stop if abs(stop - state.travel) <= abs(step) * (1 + 1e-9) else state.travel + step
            guided = _guided(problem, state, ahead, guide)
            found = advanced(problem, state, ahead, _base(smooth, state, ahead)) if guided is None else guided
            steepest = max(abs(pose.stiffness) for pose in course.poses)
            spot = None if found is None else touching(problem, found)
            if spot is not None:
                if abs(ahead - state.travel) <= NEAR * abs(span):
                    return replace(course, ending=PathEnd.CONTACT, touching=spot)
                step = 0.5 * (ahead - state.travel)
                continue
            if found is not None and found.unstable <= state.unstable:
                if bends(state, found, steepest) and abs(ahead - state.travel) > SMALLEST * abs(span):
                    step = 0.5 * (ahead - state.travel)  # between poses the curve is a cubic: none has a corner
                    continue
                step = max(step, GROWTH * (ahead - state.travel), key=abs)  # a stop close by makes no step shorter
            elif abs(ahead - state.travel) > SMALLEST * abs(span):
                step = 0.5 * (ahead - state.travel)
                continue
            else:
                beyond = found
                found = None if beyond is None else switched(problem, state, SMALLEST * span, stop)
                step = SMALLEST * span
                if found is None:
                    return replace(course, ending=_ending(start, state, beyond))
            smooth.append(state.kept())
            if found is guided and float((found.unknowns - state.unknowns) @ state.slope) * (ahead - state.travel) < 0:
                smooth = []  # a guide on the other side of a branch: no cubic leads there
            before, upto = state, len(course.poses)
            if not bends(state, found, steepest):
                upto = _rounded_from(course, found, ROUNDED * SMALLEST * abs(span))
                before = course.poses[upto - 1]
            if bends(before, found, steepest):
                smooth = []  # no cubic leads round a corner
                last = course.bifurcations[-1] if course.bifurcations else math.inf
                if abs(before.travel - last) > CORNERS_APART * abs(span):
                    corner = _corner(problem, before, found, CORNER_WIDTH * span)
                    place = corner[0].travel if corner else state.travel
                    poses = (*course.poses[: upto if corner else None], *(pose.kept() for pose in corner))
                    course = replace(course, poses=poses, bifurcations=(*course.bifurcations, place))
            course, state = replace(course, poses=(*course.poses, found.kept())), found
            report((state.travel - stops[0]) / span)
            if enough(state.effort):
                return course
    return course


def _start(problem: SolidProblem, travel: float) -> Balance | None:
    """Return the first pose, under the constant loads, which grow from nothing; None where they grow too large.

    They are put on by steps: from afar Newton's method may come to a form that the part snaps into later, if at all.
    """
    unknowns = np.zeros(problem.supports.size)
    if not problem.supports.loaded:
        return problem.solve(unknowns, travel)
    found, share, step = None, 0.0, LOAD_STEP
    while share < 1.0:
        ahead = min(1.0, share + step)
        part = problem if ahead == 1.0 else replace(problem, supports=problem.supports.under(ahead))
        found = part.solve(unknowns, travel)
        if found is not None and found.unstable == 0:
            share, unknowns = ahead, found.unknowns
        elif step > SMALLEST_LOAD_STEP:
            step *= 0.5
        else:
            return None
    return found


def touching(problem: SolidProblem, pose: Balance) -> FloatArray | None:
    """Return where the boundary crosses itself or a frame at a pose (2,) [m]; None where it does not.

    What moves as one rigid piece cannot cross itself. Edges are lines between nodes: two that touch overlap by their
    sagitta at most.
    """
    from shapely import STRtree, crosses, linestrings

    elements, supports = problem.elements, problem.supports
    edges = elements.mesh.edges
    places = elements.mesh.nodes + supports.displaced(pose.unknowns, pose.travel)
    pieces = np.concatenate([edges[:, [0, 2]], edges[:, [2, 1]]])
    rigid = -np.ones(len(places), int)
    for number, group in enumerate(supports.groups):
        rigid[group.nodes] = number
    of = np.where(rigid[pieces[:, 0]] == rigid[pieces[:, 1]], rigid[pieces[:, 0]], -1)
    lines = linestrings(places[pieces])
    if (spot := _at_obstacle(problem, pieces, lines)) is not None:
        return spot
    own, others = STRtree(lines).query(lines)
    apart = (own < others) & ((of[own] < 0) | (of[own] != of[others]))
    own, others = own[apart], others[apart]
    apart = (pieces[own][:, :, None] != pieces[others][:, None, :]).all(axis=(1, 2))  # neighbours share a node
    own, others = own[apart], others[apart]
    met = np.flatnonzero(crosses(lines[own], lines[others]))
    if not len(met):
        return None
    return np.asarray(lines[own[met[0]]].intersection(lines[others[met[0]]]).coords[0])


def _at_obstacle(problem: SolidProblem, pieces: Any, lines: Any) -> FloatArray | None:
    """Return where a piece of the boundary, of two nodes each, is in a frame that it was not in at rest [m]."""
    if not problem.obstacles:
        return None
    from shapely import Polygon, intersects, linestrings, union_all

    stands = union_all([Polygon(one) for one in problem.obstacles])
    entered = intersects(lines, stands)
    entered[entered] = ~intersects(linestrings(problem.elements.mesh.nodes[pieces[entered]]), stands)
    if not entered.any():
        return None
    common = lines[np.flatnonzero(entered)[0]].intersection(stands)
    return np.asarray(common.representative_point().coords[0])


def bends(state: Balance, found: Balance, steepest: float) -> bool:
    """Tell whether the curve may have a corner between two poses: another stiffness, seen against the steepest, too."""
    change = abs(found.stiffness - state.stiffness)
    return change > CORNER * max(abs(state.stiffness), abs(found.stiffness)) and change > SEEN * steepest


def advanced(problem: SolidProblem, state: Balance, travel: float, before: Balance | None = None) -> Balance | None:
    """Return the pose at a travel that continues the path from a pose; None where there is none in reach.

    With a pose before it, on the same branch, the prediction is the cubic through both with their slopes.
    """
    predicted = state.slope * (travel - state.travel)
    if before is not None and abs(travel - state.travel) <= FARTHEST * abs(state.travel - before.travel):
        predicted = predicted + _bending(before, state, travel)
    found = problem.solve(state.unknowns + predicted, travel)
    if found is None:
        return None
    size = float(np.ptp(problem.elements.mesh.nodes, axis=0).max())
    moves = len(problem.supports.loose)  # behind them are turns, whose radians are no metres
    correction = float(np.abs((found.unknowns - state.unknowns - predicted)[:moves]).max())
    return found if correction <= STRAY * float(np.abs(predicted[:moves]).max()) + SOFTLY * size else None


def _rounded_from(course: PosePath, found: Balance, width: float) -> int:
    """Return how many poses of a course lead to where a corner before a new pose begins, of a width at most."""
    last = course.bifurcations[-1] if course.bifurcations else math.inf
    near = [abs(found.travel - pose.travel) <= width and abs(pose.travel - last) > width for pose in course.poses[:-1]]
    return near.index(True) + 1 if True in near else len(course.poses)


def _corner(problem: SolidProblem, state: Balance, found: Balance, width: float) -> tuple[Balance, ...]:
    """Return the poses just before and behind a corner between two poses, where their tangents meet; none if elsewhere.

    The branch beyond is looked for some steps behind its bifurcation, so that its tangent is taken closer to it.
    """
    place = _where_tangents_meet(state, found)
    if place is not None and abs(found.travel - place) > 2.0 * abs(place - state.travel):
        closer = advanced(problem, found, place + 0.25 * (found.travel - place))
        if closer is not None and closer.unstable <= found.unstable and _where_tangents_meet(state, closer) is not None:
            place, found = _where_tangents_meet(state, closer), closer
    if place is None or min(abs(place - state.travel), abs(found.travel - place)) < 2.0 * abs(width):
        return ()
    way = place - state.travel
    effort = state.effort + way * state.stiffness
    unknowns = state.unknowns + way * state.slope
    before = replace(state, travel=place, effort=effort, unknowns=unknowns)
    ahead = found.travel - place
    behind = replace(
        before,
        travel=place + width,
        effort=effort + width * found.stiffness,
        stiffness=found.stiffness,
        slope=(found.unknowns - unknowns) / ahead,
    )
    return before, behind


def _where_tangents_meet(state: Balance, found: Balance) -> float | None:
    """Return the travel between two poses at which the tangents of the curve meet; None if they do not."""
    way = found.travel - state.travel
    if state.stiffness == found.stiffness:
        return None
    share = (found.effort - state.effort - found.stiffness * way) / (way * (state.stiffness - found.stiffness))
    return state.travel + share * way if 0.0 < share < 1.0 else None


def _guided(
    problem: SolidProblem, state: Balance, travel: float, guide: Callable[[float], FloatArray | None]
) -> Balance | None:
    """Return the stable pose near that of a guide at a travel; None if there is none, or no such guide."""
    here, there = guide(state.travel), guide(travel)
    if there is None:
        return None
    size = float(np.ptp(problem.elements.mesh.nodes, axis=0).max())
    moves = len(problem.supports.loose)
    for guess in (there,) if here is None else (state.unknowns + there - here, there):
        found = problem.solve(guess, travel)
        if found is not None and found.unstable <= state.unstable:
            step = float(np.abs((guess - state.unknowns)[:moves]).max())
            if float(np.abs((found.unknowns - guess)[:moves]).max()) <= STRAY * step + SOFTLY * size:
                return found
    return None


def _base(smooth: Sequence[Balance], state: Balance, travel: float) -> Balance | None:
    """Return the last of some poses before a pose from which a cubic reaches to a travel beyond it."""
    reach = abs(travel - state.travel) / FARTHEST
    return next((pose for pose in reversed(smooth) if abs(state.travel - pose.travel) >= reach), None)


def _bending(before: Balance, state: Balance, travel: float) -> FloatArray:
    """Return by how much the cubic through two poses departs from the tangent at the second, at a travel."""
    way, ahead = state.travel - before.travel, (travel - state.travel) / (state.travel - before.travel)
    # in s = (t - t2)/way: u = u2 + s way u2' + s^2 a + s^3 b, with u and u' of the first pose at s = -1
    gap = before.unknowns - state.unknowns + way * state.slope
    drop = way * (before.slope - state.slope)
    return np.asarray(ahead**2 * (3 * gap + drop) + ahead**3 * (2 * gap + drop))


def softest(problem: SolidProblem, state: Balance) -> FloatArray:
    """Return the softest mode (q,), by inverse iteration; its largest displacement is 1 m."""
    assert state.factors is not None  # poses on the way have theirs
    mode = np.random.default_rng(0).standard_normal(problem.supports.size)
    for _ in range(MODE_ROUNDS):
        mode = state.factors.solve(mode / np.linalg.norm(mode))
    loose = np.abs(mode[: len(problem.supports.loose)]).max()
    return np.asarray(mode / loose)


def switched(problem: SolidProblem, state: Balance, least: float, stop: float) -> Balance | None:
    """Return the nearest stable pose beyond a bifurcation; None where pushing along the softest mode finds none.

    Parameters
    ----------
    problem : SolidProblem
    state : Balance
        The last stable pose before it.
    least : float
        Smallest step, with the sign of the travel's direction [m or rad].
    stop : float
        Travel that must not be passed [m or rad].
    """
    mode = softest(problem, state)
    size = float(np.ptp(problem.elements.mesh.nodes, axis=0).max())
    for travel in (state.travel + times * least for times in BEYOND):
        if abs(travel - state.travel) > abs(stop - state.travel):
            travel = stop
        base = state.unknowns + state.slope * (travel - state.travel)
        for push in PUSHES * size:
            for sign in (1.0, -1.0):
                found = problem.solve(base + sign * push * mode, travel)
                if found is not None and found.unstable <= state.unstable:
                    return found
    return None


def _ending(start: Balance, state: Balance, beyond: Balance | None) -> PathEnd:
    """Return why a path cannot go on from a pose."""
    if beyond is not None:
        return PathEnd.UNSTABLE
    grown = float(np.linalg.norm(state.slope) / np.linalg.norm(start.slope))
    return PathEnd.LIMIT_POINT if grown > SOFT else PathEnd.LOST

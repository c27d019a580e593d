"""Where a branch ends: back on the path that it left, found from ahead, by a step across, or by going back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import distinct
from cfmkit.elastica.continuation import points_at_bifurcation
from cfmkit.elastica.continuation.path_and_moves import PRIMARY, BranchEnd, Resume, Stop
from cfmkit.elastica.equilibrium.network_solver import Points
from cfmkit.elastica.kernels.status_codes import DONE, INERTIA
from cfmkit.elastica.outcome.path import Event, PathStatus

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import Move, PathProblem, Trail
    from cfmkit.elastica.equilibrium.network_solver import Spot

BEFORE_END = 1e-4  # share of the drive's range by which the end of a branch is passed over
_LEGS = 60  # changes of stability ahead that are looked through, as many as decisions on a path
_MARKS = 25  # places at most where the path that was left is looked at
_BACK = 0.01  # share of the range in one step where the end of a branch is looked for backwards
_CLEAR = 0.01  # share of the drive's range behind the end of a branch where nothing leads back onto it
_ROUNDING = 1e-9  # share of the drive's range by which a point at the end of a branch may seem to lie behind it
_SHORT_OF = 0.2  # share of the way to the end of a branch that is left where the way is short
_SAME = 1e-6  # largest difference of poses of two solutions that are one


def predicted_end(
    problem: PathProblem, trail: Trail, other: Spot, before: int, sense: float, onto: str
) -> tuple[BranchEnd | None, bool]:
    """Return where the path that was left becomes stable again and the branch may rejoin it, or None.

    With None, also whether it is known that there is no such place before the last requested point. `other` is on that
    path, `before` the number of its unstable directions before it was left, `sense` that in which the drive goes on,
    `onto` its name.
    """
    start, span = other, problem.span
    for _ in range(_LEGS):
        ahead = sense * distinct(sense * trail.ahead)  # the drive may turn
        ahead = ahead[(ahead - start.drive) * sense > 1e-9 * span]
        if not len(ahead):
            return None, True
        margin = 2.0 * max(
            points_at_bifurcation.NEAR_BIFURCATION, min(problem.control.tolerance, _CLEAR)
        )  # it may lie behind here
        step, behind = 0.02 * sense * span, ahead[-1] + margin * sense * span
        wide = np.abs(np.diff(ahead)) > margin * span  # requested points, even several, may lie at the end
        between = (0.5 * (ahead[1:] + ahead[:-1]))[wide]
        marks = np.append(between[:: 1 + len(between) // _MARKS], behind)
        options = problem.options(trail, start, step)
        code, points = trail.solver.march(start, marks, options, problem.control.most_points + len(marks))
        if code != INERTIA:
            return None, code == DONE
        earlier = Points.of(start, -1).joined(points).take(slice(0, -1))
        start = trail.last_of(points)
        if start.unstable <= before:
            break
    one, beyond = _fine_before(problem, earlier), _fine_before(problem, points.take([-1]))
    closing = None if one is None or beyond is None else _place(problem, trail, one, beyond)
    if closing is None or beyond is None:
        return None, trail.closed
    return end_at(problem, closing, beyond, onto), trail.closed


def end_at(problem: PathProblem, place: Singular, beyond: Spot, onto: str) -> BranchEnd:
    """Return the end of a branch at a singular point of the path that it joins; spots are of the fine mesh."""
    reduced = problem.fine.reduce
    return BranchEnd(place.spot.drive, reduced(place.spot).y, reduced(beyond), place.before, place.after, onto)


def _fine_before(problem: PathProblem, points: Points) -> Spot | None:
    """Return the last of some points that is as stable on the fine mesh: near a bifurcation it may not be."""
    fine = problem.fine
    for k in reversed(range(len(points))):
        wide = fine.solve(fine.expand(points.y[k]), float(points.drive[k]))
        if wide is not None and wide.unstable == int(points.unstable[k]):
            return wide
    return None


def _place(problem: PathProblem, trail: Trail, one: Spot, other: Spot) -> Singular | None:
    """Return the singular point between two equilibria, without its null vector."""
    return points_at_bifurcation.located(problem, trail, one, other, vector=False)


def _room(problem: PathProblem, trail: Trail, place: float, sense: float) -> float:
    """Return how far from a bifurcation to go on, in one sense: not beyond the next requested point away from it."""
    ahead, span = (trail.stretch.targets - place) * sense, problem.span
    nearest = ahead[ahead > points_at_bifurcation.NEAR_BIFURCATION * span].min(initial=np.inf)
    return 0.5 * float(min(2.0 * BEFORE_END * span, nearest))


def up_to_ends(
    problem: PathProblem, trail: Trail, spot: Spot, left: FloatArray, numbers: Any
) -> tuple[FloatArray, Any, BranchEnd | None]:
    """Return the values still to be reached and their numbers, on a branch up to just before an end that is known.

    That end comes third.
    """
    toward = None
    for end in trail.ends:
        sense = np.sign(end.drive - spot.drive)
        before = min(_room(problem, trail, end.drive, -sense), _SHORT_OF * abs(end.drive - spot.drive))
        last = end.drive - sense * before
        beyond = np.flatnonzero((left - last) * sense >= 0)
        if len(beyond):
            left, numbers = np.append(left[: beyond[0]], last), np.append(numbers[: beyond[0]], -1)
            toward = end
    return left, numbers, toward


def rejoined(problem: PathProblem, trail: Trail, spot: Spot, end: BranchEnd | None) -> Move:
    """Go back to the path that the branch left, if the branch has come close to it; else go on along the branch.

    A drive that turns back there stays on the branch.
    """
    if end is None:
        return Stop(trail.stopped(PathStatus.LOST, "the path was lost"))
    solver, span = trail.solver, problem.span
    apart = max(solver.pose_change(y, end.y) for y in trail.points.y[-8:])
    if solver.pose_change(spot.y, end.y) > 0.5 * apart:
        return Resume(trail.changed(ends=tuple(one for one in trail.ends if one is not end)), spot)
    sense = float(np.sign(end.drive - spot.drive))
    near = points_at_bifurcation.count(problem, trail, end.drive, spot.drive)
    turn = trail.ahead[: near + 1]
    if near < len(turn) and ((turn - end.drive) * sense <= _ROUNDING * span).all():
        return Resume(points_at_bifurcation.closing(problem, trail, end, spot).changed(branch=trail.branch), spot)
    trail = trail.changed(closed=True, ends=())
    start = solver.solve(end.beyond.y, end.drive + sense * _room(problem, trail, end.drive, sense))
    if start is None or start.unstable > end.after:
        start = trail.settled_or_given(end.beyond)
    trail = trail.with_event(Event("bifurcation", end.drive * problem.unit, end.before, end.after))
    trail = points_at_bifurcation.closing(problem, trail, end, spot).changed(branch=end.onto)
    return Resume(trail.with_spot(start, -1), start)


def stepped_over(problem: PathProblem, trail: Trail, spot: Spot, requested: int) -> Move | None:
    """Step over the end of a branch onto the path that it joins there: a small change for a small advance; or None."""
    span, fine = problem.span, problem.fine
    end = next((end for end in trail.ends if abs(end.drive - spot.drive) <= BEFORE_END * span), None)
    if end is not None:
        return rejoined(problem, trail, spot, end)
    forward = float(np.sign(trail.stretch.targets[requested] - spot.drive))
    for power in range(-6, -1):
        advance = 10.0**power * span
        wide = fine.solve(fine.expand(spot.y), spot.drive + forward * advance)
        if wide is None or wide.unstable > spot.unstable:
            continue
        near = trail.settled(fine.reduce(wide))
        if near is None or trail.solver.pose_change(near.y, spot.y) > problem.reach(advance):
            continue
        back = fine.solve(wide.y, spot.drive - forward * advance)
        found = None if back is None or back.unstable == wide.unstable else _place(problem, trail, wide, back)
        place, before = (spot.drive, near.unstable) if found is None else (found.spot.drive, found.after)
        kind = "unresolved" if found is None else "bifurcation"
        trail = trail.with_event(Event(kind, place * problem.unit, before, near.unstable))
        trail = trail.changed(branch=PRIMARY)
        near = _clear(problem, trail, wide, forward * advance) or near
        return Resume(trail.with_spot(near, -1), near)
    return None


def _clear(problem: PathProblem, trail: Trail, wide: Spot, advance: float) -> Spot | None:
    """Return a point further along the path of the fine mesh: near the end of a branch steps lead back onto it."""
    fine, room = problem.fine, 0.5 * problem.nearest_target(trail.ahead, wide.drive)
    away = float(np.sign(advance)) * min(_CLEAR * problem.span, room)
    second = fine.solve(wide.y, wide.drive + advance)
    if second is None or advance == 0.0 or abs(away) < 2 * abs(advance):
        return None
    third = fine.solve(wide.y + (second.y - wide.y) * (away / advance), wide.drive + away)
    if third is None or third.unstable != wide.unstable:
        return None
    moved = trail.solver.pose_change(fine.reduce(third).y, fine.reduce(wide).y)
    return trail.settled(fine.reduce(third)) if moved <= problem.reach(abs(away)) else None


def closed_behind(problem: PathProblem, trail: Trail) -> Trail | None:
    """Return the path with the end of its last branch, found by going back along the path that it joined.

    Coming forward nothing changes there: branch and path are both stable. Going back the path loses its stability; a
    branch that has not ended is stable back to where it opens. None where that is not settled.
    """
    name = next(name for name in reversed(trail.branches) if name != PRIMARY)
    first = trail.branches.index(name, trail.stretch.begun)
    begin, spot, solver = float(trail.points.drive[first]), trail.spot(-1), trail.solver
    sense = float(np.sign(begin - spot.drive))
    step = _BACK * problem.span
    options = problem.options(trail, spot, sense * step, longest=step)
    code, points = solver.march(spot, np.array([begin]), options, problem.control.most_points + 2)
    if code == DONE and solver.pose_change(points.y[-1], trail.points.y[first]) <= _SAME:
        return trail
    if code != INERTIA or len(points) < 2:
        return None
    fine = problem.fine
    one, beyond = (fine.solve(fine.expand(points.y[k]), float(points.drive[k])) for k in (-2, -1))
    found = None if one is None or beyond is None else _place(problem, trail, one, beyond)
    if found is None or found.after <= found.before:
        return None
    closing = Event("bifurcation", found.spot.drive * problem.unit, found.after, found.before)
    events = trail.events
    for last in events[-1:]:  # by `stepped_over`
        same = abs(last.drive - closing.drive) < BEFORE_END * problem.span * problem.unit
        same = same and last.after == closing.after
        if last.kind == "unresolved" or (same and last.before == closing.before):
            events = events[:-1]
    branches = list(trail.branches)
    for index in range(first, len(branches)):
        if (float(trail.points.drive[index]) - found.spot.drive) * sense < 0:
            branches[index] = PRIMARY
        elif branches[index] == PRIMARY:
            branches[index] = name
    return trail.changed(branches=tuple(branches), events=(*events, closing))


def relabelled(problem: PathProblem, trail: Trail, primary: Trail) -> Trail:
    """Return the path with the points of a branch that lie on the primary path named so: its end was stepped over.

    `primary` is the same network followed without leaving the primary path. Where exactly the branch ended is not
    known then: the event says so.
    """
    places = {int(number): k for k, number in enumerate(primary.points.requested) if number >= 0}
    last = max(k for k, name in enumerate(trail.branches) if name != PRIMARY)
    first = last + 1
    for index in range(last, trail.stretch.begun, -1):
        number = int(trail.points.requested[index])
        if number < 0:
            continue
        if number not in places or trail.branches[index] == PRIMARY:
            break
        if trail.solver.pose_change(trail.points.y[index], primary.points.y[places[number]]) > _SAME:
            break
        first = index
    if first > last:
        return trail
    until = places[int(trail.points.requested[first])]
    if not primary.points.unstable[:until].any():  # it was led onto the branch, which does not end
        return trail
    before, after = trail.unstable(first - 1), trail.unstable(first)
    events = trail.events[:-1] if last + 1 < len(trail.branches) else trail.events  # the step over it came too late
    event = Event("unresolved", float(trail.points.drive[first]) * problem.unit, before, after)
    names = trail.branches[:first] + (PRIMARY,) * (len(trail.points) - first)
    return trail.changed(branches=names, events=(*events, event))

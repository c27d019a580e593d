"""Where a branch ends: back on the path that it left, found from ahead, by a step across, or by going back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams import beside
from cfmkit.beams.kernels.codes import DONE, INERTIA
from cfmkit.beams.path import Event, PathStatus
from cfmkit.beams.solver import LONGEST

if TYPE_CHECKING:
    from cfmkit.beams.events import Singular
    from cfmkit.beams.run import Run
    from cfmkit.beams.solver import Points, Spot
    from cfmkit.curves import FloatArray

BEFORE_END = 1e-4  # share of the drive's range by which the end of a branch is passed over
_LEGS = 60
_MARKS = 25  # places at most where the path that was left is looked at
_BACK = 0.01  # share of the range in one step where the end of a branch is looked for backwards
_CLEAR = 0.01  # share of the drive's range behind the end of a branch where nothing leads back onto it
_ROUNDING = 1e-9  # share of the drive's range by which a point at the end of a branch may seem to lie behind it
_SHORT_OF = 0.2  # share of the way to the end of a branch that is left where the way is short
_SAME = 1e-6  # largest difference of poses of two solutions that are one


@dataclass(frozen=True)
class BranchEnd:
    """Where a branch joins the path that was left for it: at its begin, or where that path becomes stable again.

    Drive and state, an equilibrium of that path beyond, its inertia on this side and beyond, its name.
    """

    drive: float
    y: FloatArray
    beyond: Spot
    before: int
    after: int
    onto: str


def end_of_branch(run: Run, other: Spot, before: int, sense: float, onto: str) -> BranchEnd | None:
    """Return where the path that was left becomes stable again: there the branch may rejoin it.

    `other` is on that path, `before` the number of its unstable directions before it was left, `sense` that in which
    the drive goes on, `onto` its name.
    """
    start = other
    for _ in range(_LEGS):
        ahead = sense * np.unique(sense * run.targets[run.asked() :])  # the drive may turn
        ahead = ahead[(ahead - start.drive) * sense > 1e-9 * run.span]
        if not len(ahead):
            run.closed = True
            return None
        margin = 2.0 * max(beside.BESIDE, min(run.control.tolerance, _CLEAR))  # on this mesh the end may lie behind
        step, behind = 0.02 * sense * run.span, ahead[-1] + margin * sense * run.span
        wide = np.abs(np.diff(ahead)) > margin * run.span  # points asked for, even several, may lie at the end
        between = (0.5 * (ahead[1:] + ahead[:-1]))[wide]
        marks = np.append(between[:: 1 + len(between) // _MARKS], behind)
        options = run.options(start, step)
        code, points = run.solver.march(start, marks, options, run.control.most_points + len(marks))
        if code != INERTIA:
            run.closed = code == DONE
            return None
        earlier = run.as_points(start, -1).joined(points).take(slice(0, -1))
        start = run.last(points)
        if start.unstable <= before:
            break
    one, beyond = _fine_before(run, earlier), _fine_before(run, points.take([-1]))
    closing = None if one is None or beyond is None else _place(run, one, beyond)
    if closing is None or beyond is None:
        return None
    return end_at(run, closing, beyond, onto)


def end_at(run: Run, place: Singular, beyond: Spot, onto: str) -> BranchEnd:
    """Return the end of a branch at a singular point of the path that it joins; spots are of the fine mesh."""
    reduced = run.fine.reduce
    return BranchEnd(place.spot.drive, reduced(place.spot).y, reduced(beyond), place.before, place.after, onto)


def _fine_before(run: Run, points: Points) -> Spot | None:
    """Return the last of some points that is as stable on the fine mesh: beside a bifurcation it may not be."""
    for k in reversed(range(len(points))):
        wide = run.fine.solve(run.fine.expand(points.y[k]), float(points.drive[k]))
        if wide is not None and wide.unstable == int(points.info[k, 0]):
            return wide
    return None


def _place(run: Run, one: Spot, other: Spot) -> Singular | None:
    """Return the singular point between two equilibria, without its null vector."""
    return beside.located(run, one, other, vector=False)


def room(run: Run, place: float, sense: float) -> float:
    """Return how far from a bifurcation to go on, in one sense: not beyond the next point asked for away from it."""
    ahead = (run.targets - place) * sense
    return 0.5 * float(min(2.0 * BEFORE_END * run.span, ahead[ahead > beside.BESIDE * run.span].min(initial=np.inf)))


def left(run: Run, spot: Spot, asked: int) -> tuple[FloatArray, FloatArray | None]:
    """Return the values of the drive still to be reached and their numbers among those asked for.

    No numbers where these are all that were asked for. A branch is followed to just before an end that is known.
    The last number stands for no number.
    """
    run.toward = None
    if asked == 0 and not run.ends:
        return run.targets, None
    first = asked if run.natural else run.first_asked
    left, numbers = run.targets[first:], np.arange(first, len(run.targets))
    if not run.natural:
        return left, np.append(numbers, -1)
    for end in run.ends:
        sense = np.sign(end.drive - spot.drive)
        before = min(room(run, end.drive, -sense), _SHORT_OF * abs(end.drive - spot.drive))
        last = end.drive - sense * before
        beyond = np.flatnonzero((left - last) * sense >= 0)
        if len(beyond):
            left, numbers = np.append(left[: beyond[0]], last), np.append(numbers[: beyond[0]], -1)
            run.toward = end
    return left, np.append(numbers, -1)


def rejoin(run: Run, spot: Spot) -> Spot | None:
    """Go back to the path that the branch left, if the branch has come close to it; else go on along the branch.

    A drive that turns back there stays on the branch.
    """
    end, run.toward = run.toward, None
    if end is None:
        run.status, run.message = PathStatus.LOST, "the path was lost"
        return None
    apart = max(run.solver.pose_change(y, end.y) for y in run.points.y[-8:])
    if run.solver.pose_change(spot.y, end.y) > 0.5 * apart:
        run.ends = tuple(one for one in run.ends if one is not end)
        return spot
    sense = float(np.sign(end.drive - spot.drive))
    near = beside.count(run, end.drive, spot.drive)
    turn = run.targets[run.asked() :][: near + 1]
    if near < len(turn) and ((turn - end.drive) * sense <= _ROUNDING * run.span).all():
        name = run.branch
        beside.closing(run, end, spot)
        run.branch = name
        return spot
    run.closed, run.ends = True, ()
    start = run.solver.solve(end.beyond.y, end.drive + sense * room(run, end.drive, sense))
    if start is None or start.unstable > end.after:
        start = run.settled(end.beyond) or replace(end.beyond, tangent=run.solver.unit.copy())
    run.events.append(Event("bifurcation", end.drive * run.unit, end.before, end.after))
    beside.closing(run, end, spot)
    run.branch = end.onto
    run.append(run.as_points(start, -1))
    return start


def hop(run: Run, spot: Spot, asked: int) -> Spot | None:
    """Step over the end of a branch onto the path that it joins there: a small change for a small advance; or None."""
    run.toward = next((end for end in run.ends if abs(end.drive - spot.drive) <= BEFORE_END * run.span), None)
    if run.toward is not None:
        return rejoin(run, spot)
    forward = float(np.sign(run.targets[asked] - spot.drive))
    for power in range(-6, -1):
        ahead = 10.0**power * run.span
        wide = run.fine.solve(run.fine.expand(spot.y), spot.drive + forward * ahead)
        if wide is None or wide.unstable > spot.unstable:
            continue
        near = run.settled(run.fine.reduce(wide))
        if near is None or run.solver.pose_change(near.y, spot.y) > run.reach(ahead):
            continue
        back = run.fine.solve(wide.y, spot.drive - forward * ahead)
        found = None if back is None or back.unstable == wide.unstable else _place(run, wide, back)
        place, before = (spot.drive, near.unstable) if found is None else (found.spot.drive, found.after)
        kind = "unresolved" if found is None else "bifurcation"
        run.events.append(Event(kind, place * run.unit, before, near.unstable))
        run.branch = "primary"
        near = _clear(run, wide, forward * ahead) or near
        run.append(run.as_points(near, -1))
        return near
    return None


def _clear(run: Run, wide: Spot, ahead: float) -> Spot | None:
    """Return a point further along the path of the fine mesh: beside the end of a branch steps lead back onto it."""
    left = np.abs(run.targets[run.asked() :] - wide.drive)
    away = float(np.sign(ahead)) * min(_CLEAR * run.span, 0.5 * float(left.min(initial=np.inf)))
    second = run.fine.solve(wide.y, wide.drive + ahead)
    if second is None or ahead == 0.0 or abs(away) < 2 * abs(ahead):
        return None
    third = run.fine.solve(wide.y + (second.y - wide.y) * (away / ahead), wide.drive + away)
    if third is None or third.unstable != wide.unstable:
        return None
    moved = run.solver.pose_change(run.fine.reduce(third).y, run.fine.reduce(wide).y)
    return run.settled(run.fine.reduce(third)) if moved <= run.reach(abs(away)) else None


def close_behind(run: Run) -> bool:
    """Find the end of the last branch by going back along the path that it joined; tell whether that is settled.

    Coming forward nothing changes there: branch and path are both stable. Going back the path loses its stability; a
    branch that has not ended is stable back to where it opens.
    """
    name = next(name for name in reversed(run.branches) if name != "primary")
    first = run.branches.index(name, run.begun)
    opening, spot = float(run.points.drive[first]), run.spot(-1)
    sense = float(np.sign(opening - spot.drive))
    options = run.options(spot, sense * _BACK * run.span)
    options[LONGEST] = _BACK * run.span
    code, points = run.solver.march(spot, np.array([opening]), options, run.control.most_points + 2)
    if code == DONE and run.solver.pose_change(points.y[-1], run.points.y[first]) <= _SAME:
        return True
    if code != INERTIA or len(points) < 2:
        return False
    one, beyond = (run.fine.solve(run.fine.expand(points.y[k]), float(points.drive[k])) for k in (-2, -1))
    found = None if one is None or beyond is None else _place(run, one, beyond)
    if found is None or found.after <= found.before:
        return False
    closing = Event("bifurcation", found.spot.drive * run.unit, found.after, found.before)
    for told in run.events[-1:]:  # by `hop`
        same = abs(told.drive - closing.drive) < BEFORE_END * run.span * run.unit and told.after == closing.after
        if told.kind == "unresolved" or (same and told.before == closing.before):
            run.events.pop()
    run.events.append(closing)
    for index in range(first, len(run.branches)):
        if (float(run.points.drive[index]) - found.spot.drive) * sense < 0:
            run.branches[index] = "primary"
        elif run.branches[index] == "primary":
            run.branches[index] = name
    return True


def relabel(run: Run, primary: Run) -> None:
    """Give the points of a branch that lie on the primary path its name: the end of the branch was stepped over.

    `primary` is the same network followed without leaving the primary path. Where exactly the branch ended is not
    known then: the event says so.
    """
    places = {int(number): k for k, number in enumerate(primary.points.info[:, 1]) if number >= 0}
    last = max(k for k, name in enumerate(run.branches) if name != "primary")
    first = last + 1
    for index in range(last, run.begun, -1):
        number = int(run.points.info[index, 1])
        if number < 0:
            continue
        if number not in places or run.branches[index] == "primary":
            break
        if run.solver.pose_change(run.points.y[index], primary.points.y[places[number]]) > _SAME:
            break
        first = index
    if first > last:
        return
    until = places[int(run.points.info[first, 1])]
    if not primary.points.info[:until, 0].any():  # it was led onto the branch, which does not end
        return
    before, after = (int(run.points.info[k, 0]) for k in (first - 1, first))
    if last + 1 < len(run.branches):  # the hop onto the primary path came too late
        run.events.pop()
    run.events.append(Event("unresolved", float(run.points.drive[first]) * run.unit, before, after))
    run.branches[first:] = ["primary"] * (len(run.points) - first)

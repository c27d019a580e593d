"""Decisions: where a path goes on after a march that ended before all was done, or that it ends.

Where stability changes, the path is followed on, or left for a stable branch. A corner of a path at a bifurcation that
two meshes put on different sides of a point is too sharp to be followed. A column of pieces with a point requested at
its critical load is led past it, unstable, and stalls: the path is taken back to well before, where both meshes agree,
and led across.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation import (
    branch_rejoins_path,
    critical_start,
    ending_messages,
    nearly_rigid_start,
    passing_limit_points,
    points_at_bifurcation,
)
from cfmkit.elastica.continuation.branch_rejoins_path import end_at, predicted_end
from cfmkit.elastica.continuation.path_and_moves import MOST_SEGMENTS, PRIMARY, Leg, Resume, Stop, fine_spot
from cfmkit.elastica.continuation.points_at_bifurcation import NEAR_BIFURCATION
from cfmkit.elastica.continuation.switch_to_uncondensed_solver import uncondensed
from cfmkit.elastica.continuation.switching import before_last_of_several, first_of_several, switched, well_before
from cfmkit.elastica.equilibrium.network_solver import FORCE_WEIGHT
from cfmkit.elastica.kernels.status_codes import DENIED, DONE, INERTIA, NO_START, STALLED
from cfmkit.elastica.outcome.path import Event, PathStatus

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import Move, PathProblem, Trail
    from cfmkit.elastica.equilibrium.network_solver import Spot


_NEARBY = 0.01  # share of the drive's range within which a march stalls at the same place again
_CLEAR = 0.01  # share of the drive's range from a bifurcation at which the paths there are told apart
_SAME_PLACE = 1e-4  # share of the drive's range within which two searches found one bifurcation
_TIMES = 12  # that one point may be taken back
_SLIGHT = 1e-3  # share of a determinant that is hardly any
_ASIDE = 1e-3  # share of the ways to the points on both sides of a bifurcation at which the path is looked at
_STRAIGHT = 10.0  # largest change of a pose between those places, in that share of the whole change
_ROUNDING = 1e-7  # change of a pose there that is rounding
_FINEST = 1e-8  # share of the range below which a change of stability is not looked into with shorter steps
_WELL = 3e-3  # share of the drive's range that is well before a corner
_FURTHER = 4  # solutions on the way on
_SAME_POSE = 1e-3  # change of a pose there that is none: branches are 1e-2 away and more
_BACK = 30  # points looked at before the place where a march stalled
_NEAR = 1e-4  # share of the drive's range from which the next requested point is solved for on the fine mesh
_SHORTER = 0.25  # of a step that passed what was not resolved, for the next


def decided(problem: PathProblem, leg: Leg, fresh: bool) -> Move:
    """Return where to go on after a march, or that the path ends."""
    trail, requested = leg.trail, leg.trail.requested
    if problem.mesh.segments > MOST_SEGMENTS and leg.code in (INERTIA, NO_START, STALLED, DENIED):
        return ending_messages.too_long_to_look_into(trail, problem.unit)
    away = critical_start.left_again(problem, trail) if fresh else None
    if away is not None:
        return away
    if leg.code == DONE and requested == len(trail.stretch.targets):
        if requested == len(problem.values):
            return Resume(trail, leg.spot)
        return passing_limit_points.by_the_drive(problem, trail, requested)
    move = _after(problem, leg, requested)
    return Stop(move.trail) if problem.first_only and move.trail.first is not None else move


def _after(problem: PathProblem, leg: Leg, requested: int) -> Move:
    """Return where to go on after a march that ended early, or on a branch."""
    trail, spot, code, control = leg.trail, leg.spot, leg.code, problem.control
    regained = code == INERTIA and bool(trail.points.unstable[-1] < trail.points.unstable[-2])
    if code in (NO_START, STALLED) or (regained and control.branch == "stable"):
        away = critical_start.left(problem, trail, spot) or nearly_rigid_start.left(problem, trail, spot)
        if away is not None or code == NO_START:
            return away or Stop(trail)
    if code == INERTIA and control.branch == "stop":
        message = f"stability is lost at {trail.drive * problem.unit:.6g}: the path ends there"
        return Stop(trail.stopped(PathStatus.JUMPS, message))
    if code == INERTIA:
        return passing_limit_points.back_to_the_drive(problem, crossed(problem, trail))
    if code == DONE:
        return branch_rejoins_path.rejoined(problem, trail, spot, leg.toward)
    if code == DENIED:
        behind = points_at_bifurcation.passed(problem, trail, float(trail.stretch.targets[requested]))
        return Resume(trail, spot, patient=True) if behind is None else crossed(problem, behind)
    if code == STALLED and trail.stretch.natural and len(trail.points):
        return _got_over(problem, trail, spot, requested)
    return ending_messages.stop(problem, trail, code)


def _got_over(problem: PathProblem, trail: Trail, spot: Spot, requested: int) -> Move:
    """Return where to go on after a march by the drive that stalled."""
    fold = passing_limit_points.is_near(problem, trail)
    if fold and abs(spot.drive - trail.fold_at) <= _NEARBY * problem.span:
        return passing_limit_points.around(problem, trail)
    trail = trail.changed(fold_at=spot.drive if fold else np.nan)
    if not fold and (again := uncondensed(problem, trail)) is not None:
        return again
    move: Move | None = None
    if any(name != PRIMARY for name in trail.branches):
        move = branch_rejoins_path.stepped_over(problem, trail, spot, requested)
    if move is None:
        trail, move = past_corner(problem, trail, spot, requested)
    if move is not None:
        return move
    if problem.control.through_folds:
        return passing_limit_points.around(problem, trail)
    return ending_messages.stop(problem, trail, STALLED)


def crossed(problem: PathProblem, trail: Trail) -> Move:
    """Handle a change of inertia between the last two points."""
    natural = trail.stretch.natural
    begun = -2 if natural else _last_step_before(trail)
    if natural:
        one, beyond = fine_spot(problem, trail, -2), fine_spot(problem, trail, -1)
    else:
        one, beyond = passing_limit_points.fine_spots(problem, trail, begun)
    if natural and len(trail.points) > 2 and _at_it(problem, trail, -2, one, beyond):
        back = _without_last_but_one(trail)
        if back is not None:
            trail, one = back, fine_spot(problem, back, -2)
    if natural and _at_it(problem, trail, -1, beyond, one):
        behind = points_at_bifurcation.passed(problem, trail.up_to(-1), trail.drive)
        trail, beyond = (trail, None) if behind is None else (behind, fine_spot(problem, behind, -1))
        again = None if beyond is not None else uncondensed(problem, trail, 1)
        if again is not None:
            return again
    other = _along(trail, trail.spot(-1))
    senses = np.sign(trail.points.drive_rate[[begun, -1]])
    fold = not natural and bool(senses[0] != senses[1])
    found = None
    if one is not None and beyond is not None:
        found = points_at_bifurcation.located(problem, trail, one, beyond, fold)
        if found is not None and natural and _may_be_shorter(problem, trail):
            found = found if _on_one_path(problem, found, one, beyond) else None
    if found is None or one is None:
        return _unresolved(problem, trail, other)
    if natural and found.after - found.before > 1:
        trail, found = first_of_several(problem, trail, found, one)
        other = trail.spot(-1)
    if natural and found.before - found.after > 1:
        earlier = before_last_of_several(problem, trail, found, one)
        if earlier is not None:
            return crossed(problem, earlier)
    kind = "limit point" if found.fold else "bifurcation"
    unreported = trail
    trail = trail.with_event(Event(kind, found.spot.drive * problem.unit, found.before, found.after))
    if trail.first is None and not found.fold and found.after > found.before:
        trail = trail.changed(first=found)
    return _parted(problem, trail, found, one, other, unreported) if natural else Resume(trail, other)


def _unresolved(problem: PathProblem, trail: Trail, other: Spot) -> Move:
    """Look again with a shorter step at what changed the inertia, or tell that it is not known."""
    before, after = trail.unstable(-2), trail.unstable(-1)
    if after > before and _may_be_shorter(problem, trail) and not trail.stuck(problem):
        return _again(trail)
    event = Event("unresolved", other.drive * problem.unit, before, after)
    known = before == after or event in trail.events
    if min(before, after) >= 0 and not known:  # a count below zero is that of rounding
        trail = trail.with_event(event)
    return Resume(trail, other)


def _on_one_path(problem: PathProblem, found: Singular, one: Spot, beyond: Spot) -> bool:
    """Tell whether a path goes straight on through a singular point that was found between two of its points.

    A slightly imperfect part has a sharp corner there instead, and behind it a path of its own that is unstable.
    """
    fine = problem.fine
    whole = fine.pose_change(one.y, beyond.y)
    ends = []
    for end in (one, beyond):
        share = _ASIDE * (end.drive - found.spot.drive)
        ends.append(fine.solve(found.spot.y + _ASIDE * (end.y - found.spot.y), found.spot.drive + share))
    near, far = ends
    if near is None or far is None or near.unstable > one.unstable:
        return False
    if beyond.unstable > one.unstable and far.unstable <= near.unstable:  # interpolated between two paths
        return False
    if not fine.pose_change(near.y, far.y) <= _STRAIGHT * _ASIDE * whole + _ROUNDING:
        return False
    return problem.control.branch != "primary" or _leads_to(problem, near, far, beyond)


def _leads_to(problem: PathProblem, near: Spot, far: Spot, beyond: Spot) -> bool:
    """Tell whether a path that goes on from two equilibria beside a bifurcation comes to a point beyond it."""
    before, here = near, far
    for place in np.linspace(far.drive, beyond.drive, _FURTHER + 1)[1:].tolist():
        rate = (place - here.drive) / (here.drive - before.drive)
        there = problem.fine.solve(here.y + rate * (here.y - before.y), place)
        if there is None:
            return True  # not known
        before, here = here, there
    return problem.fine.pose_change(here.y, beyond.y) <= _SAME_POSE


def _last_step_before(trail: Trail) -> int:
    """Return the index of the point that the last step began at: along the arc there are requested points between."""
    index = -2
    while -index < len(trail.points) and trail.points.reached[index] == -1.0:
        index -= 1
    return index


def _at_it(problem: PathProblem, trail: Trail, index: int, spot: Spot | None, other: Spot | None) -> bool:
    """Tell whether one of the last two points lies at the bifurcation between them, for the fine mesh.

    It has another inertia there than on this mesh, or hardly any determinant compared with the other one.
    """
    if spot is None or spot.unstable != trail.unstable(index):
        return True
    if other is None:
        return False
    share = min(0.5 * NEAR_BIFURCATION * problem.span / abs(other.drive - spot.drive), _SLIGHT)
    return not spot.log_size - other.log_size > np.log(share)


def _without_last_but_one(trail: Trail) -> Trail | None:
    """Take back a point near a bifurcation, where meshes differ in what is stable.

    None where that was done several times before, or where anything happened before it.
    """
    if trail.points.unstable[-3] != trail.points.unstable[-2]:
        return None
    place = (float(trail.points.drive[-2]), np.inf)
    times = trail.visited.get(place, 0) + 1
    if times > _TIMES:
        return None
    last, name, back = trail.points.take([-1]), trail.branches[-1], trail.up_to(-2)
    if last.requested[0] > back.requested:
        last.requested[0] = -1.0  # the point taken back is to be done first
    return back.with_last(last, name).changed(visited={**trail.visited, place: times})


def _parted(problem: PathProblem, trail: Trail, found: Singular, one: Spot, other: Spot, unreported: Trail) -> Move:
    """Go on behind a bifurcation between `one` and the last point `other`, where the control says.

    `unreported` is the path without the word of it, for where it is to be looked at again.
    """
    control = problem.control
    unstable_anyway = control.through_folds and found.before > 0
    if found.after <= found.before or control.branch == "primary" or unstable_anyway:
        return _past(problem, trail, found, one, _clear_of(problem, trail, found, one, other))
    forward, onto = float(np.sign(other.drive - one.drive)), trail.branch
    found, wide = switched(problem, trail, found, one, forward)
    left = None if wide is None else trail.settled(problem.fine.reduce(wide))
    if left is None and _may_be_shorter(problem, trail) and not _sure(problem, trail, one, other, found):
        return _again(unreported.changed(without_branch=found))
    if left is None:
        if control.through_folds:
            return _past(problem, trail, found, one, _clear_of(problem, trail, found, one, other))
        return _no_branch(problem, trail, found)
    clear = _clear_of(problem, trail, found, one, other)
    trail = trail.up_to(-1)
    trail = trail.changed(events=(*trail.events[:-1], replace(trail.events[-1], after=found.after)))
    name = f"bifurcated at {found.spot.drive * problem.unit:.6g}, sign {control.sign:+d}"
    trail = points_at_bifurcation.opening(problem, trail, found, one, wide, name)
    left = _not_beyond(problem, trail, found, left, forward)
    trail = trail.changed(branch=name, closed=False).with_spot(left, -1)
    ending, closed = predicted_end(problem, trail, clear, found.before, forward, onto)
    begin = end_at(problem, found._replace(before=found.after, after=found.before), one, onto)
    trail = trail.changed(ends=(begin, *([ending] if ending else [])), closed=closed)
    return Resume(trail, left, 0.5 * abs(left.drive - found.spot.drive))


def _past(problem: PathProblem, trail: Trail, found: Singular, one: Spot, clear: Spot) -> Resume:
    """Stay on the path behind a bifurcation between `one` and the last point; go on from `clear`, there or beyond."""
    last = trail.points.take([-1])
    trail = points_at_bifurcation.opening(problem, trail.up_to(-1), found, one, None, trail.branch)
    if last.requested[0] < trail.requested:
        last.requested[0] = -1.0  # it has just been added
    trail = trail.with_points(last)
    if clear.drive != last.drive[0]:
        trail = trail.with_spot(clear, -1)
    if problem.control.branch != "primary":
        return Resume(trail, clear)
    # longer first steps have led to branches that are as unstable as the path
    return Resume(trail, clear, abs(clear.drive - found.spot.drive) or np.inf)


def _clear_of(problem: PathProblem, trail: Trail, found: Singular, one: Spot, other: Spot) -> Spot:
    """Return a point behind a bifurcation from which the path can be followed on: `other` if it is far enough.

    Near a bifurcation the error of integration may lead to the path that crosses; on the fine mesh it does not. A guess
    far ahead may lead to another branch there, too.
    """
    place = found.spot.drive
    room = min(_CLEAR * problem.span, 0.5 * problem.nearest_target(trail.ahead, other.drive))
    if abs(other.drive - place) >= room:
        return other
    early = well_before(problem, trail, found, 0.1 * room) or one  # from nearer the prediction would be bad
    before = place - early.drive
    if before == 0.0:
        return other
    there = other.drive + float(np.sign(other.drive - one.drive)) * room
    guess = found.spot.y + (found.spot.y - early.y) * ((there - place) / before)
    wide = problem.fine.solve(guess, there)
    if wide is None or wide.unstable != found.after:
        return other
    if problem.control.branch == "primary":
        here = problem.fine.solve(problem.fine.expand(other.y), other.drive)
        if here is None or not _leads_to(problem, found.spot, here, wide):
            return other
    near = trail.settled(problem.fine.reduce(wide))
    return other if near is None else near


def _sure(problem: PathProblem, trail: Trail, one: Spot, other: Spot, found: Singular) -> bool:
    """Tell whether a bifurcation was found before and now between points so near that its branch would be found too.

    Or as near as steps lead.
    """
    known, near = trail.without_branch, _SAME_PLACE * problem.span
    close = trail.stuck(problem) or abs(other.drive - one.drive) <= near
    return close and known is not None and abs(known.spot.drive - found.spot.drive) <= near


def _not_beyond(problem: PathProblem, trail: Trail, found: Singular, left: Spot, forward: float) -> Spot:
    """Return the entry of a branch, moved back before the next requested point where it lies beyond that.

    Away from a bifurcation a branch opens like the square root of the distance.
    """
    place, solver = found.spot.drive, trail.solver
    ahead = (trail.ahead[:1] - place) * forward
    reach, nearest = (left.drive - place) * forward, 0.5 * ahead[ahead > 0].min(initial=np.inf)
    if not 2.0 * nearest < reach:
        return left
    start = problem.fine.reduce(found.spot).y
    guess = start + np.sqrt(nearest / reach) * (left.y - start)
    near = solver.solve(guess, place + forward * nearest)
    if near is None or near.unstable > left.unstable:
        return left
    return near if solver.pose_change(near.y, start) > 0.3 * solver.pose_change(guess, start) else left


def _may_be_shorter(problem: PathProblem, trail: Trail) -> bool:
    """Tell whether the last step may have passed a sharp corner, and ended on another path."""
    return trail.stretch.natural and trail.last_step > _FINEST * problem.span


def _again(trail: Trail) -> Resume:
    """Take the last point back, and go on from the one before in shorter steps."""
    before, last = trail.points.drive[-2:].tolist()
    back = trail.come_by(before, last).up_to(-1)
    return Resume(back, back.spot(-1), _SHORTER * trail.last_step)


def _no_branch(problem: PathProblem, trail: Trail, found: Singular) -> Stop:
    """End at a bifurcation without a stable branch nearby: the mechanism jumps there."""
    place = found.spot.drive * problem.unit
    message = f"no stable equilibrium near {place:.6g}: it jumps to a distant one there"
    return Stop(trail.up_to(-1).stopped(PathStatus.JUMPS, message))


def _along(trail: Trail, spot: Spot) -> Spot:
    """Return the last point with its tangent the way the path came: after a limit point the drive goes back."""
    n, points = trail.solver.n, trail.points
    came = np.append(points.y[-1, :n] - points.y[-2, :n], points.drive[-1] - points.drive[-2])
    weights = np.append(np.where(np.arange(n) < trail.solver.n_free, 1.0, FORCE_WEIGHT), 1.0)
    return replace(spot, tangent=-spot.tangent) if float((weights * came) @ spot.tangent) < 0 else spot


def past_corner(problem: PathProblem, trail: Trail, spot: Spot, requested: int) -> tuple[Trail, Move | None]:
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
                    trail = move.trail.up_to(-1).changed(events=events[:-1])
                    break
                return trail, move
    back = None if stays or trail.stuck(problem) else _taken_back(problem, trail, spot.drive)
    return trail, None if back is None else crossed(problem, back)


def _taken_back(problem: PathProblem, trail: Trail, place: float) -> Trail | None:
    """Return the path up to well before a place, and a point behind it, if there is a bifurcation between."""
    points, names = trail.points, trail.branches
    last = len(names) - 1
    while last > trail.stretch.begun + 1 and abs(float(points.drive[last]) - place) < _WELL * problem.span:
        if names[last - 1] != names[-1]:
            break
        last -= 1
    behind = points_at_bifurcation.passed(problem, trail.up_to(last + 1), place)
    if behind is None:
        return None
    far, here = behind.points.drive[[-1, last]] * problem.unit
    events = behind.events
    while events and min(far, here) < events[-1].drive <= max(far, here):  # it is passed again
        events = events[:-1]
    return behind.changed(events=events)


def _before(problem: PathProblem, trail: Trail) -> tuple[Trail, Spot] | None:
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


def _on_fine(problem: PathProblem, trail: Trail, spot: Spot, drive: float) -> Spot | None:
    """Return the equilibrium of the fine mesh at a drive, if it is near, solved on this mesh if that is possible."""
    fine = problem.fine
    wide = fine.solve(fine.expand(spot.y), drive)
    if wide is None:
        return None
    reduced = fine.reduce(wide)
    if trail.solver.pose_change(reduced.y, spot.y) > problem.reach(abs(drive - spot.drive)):
        return None
    return trail.settled_or_given(reduced)

"""Decisions where stability changes: stay on the path, or leave it for a stable branch; `branch_ends` has the rest."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams import beside, folds
from cfmkit.beams.beside import BESIDE
from cfmkit.beams.branch_ends import end_at, end_of_branch
from cfmkit.beams.descent import alone, left_behind, well_before
from cfmkit.beams.path import Event, PathStatus
from cfmkit.beams.solver import FORCE_WEIGHT, Spot
from cfmkit.beams.steady import steadier

if TYPE_CHECKING:
    from cfmkit.beams.events import Singular
    from cfmkit.beams.run import Run

_CLEAR = 0.01  # share of the drive's range from a bifurcation at which the paths there are told apart
_SAME_PLACE = 1e-4  # share of the drive's range within which two searches found one bifurcation
_TIMES = 12  # that one point may be taken back
_SLIGHT = 1e-3  # share of a determinant that is hardly any
_ASIDE = 1e-3  # share of the ways to the points on both sides of a bifurcation at which the path is looked at,
_STRAIGHT, _ROUNDING = 10.0, 1e-7  # largest change of a pose between, in that share of the whole one; what is rounding
_FINEST = 1e-8  # share of the range below which a change of stability is not looked into with shorter steps


def cross(run: Run) -> Spot | None:
    """Handle a change of inertia between the last two points; return where to go on, None to stop."""
    begun = -2 if run.natural else _last_step_before(run)
    if run.natural:
        one, beyond = run.fine_spot(-2), run.fine_spot(-1)
    else:
        one, beyond = folds.fine_spots(run, begun)
    if run.natural and len(run.points) > 2 and _beside(run, -2, one, beyond) and _may_be_taken_back(run):
        one = _without_last_but_one(run)
    if run.natural and _beside(run, -1, beyond, one):
        beyond = _behind_the_last(run)
        if beyond is None and steadier(run, 1):
            return run.spot(-1)
    other = run.spot(-1)
    _point_along(run, other)
    senses = np.sign(run.points.info[[begun, -1], 4])
    fold = not run.natural and bool(senses[0] != senses[1])
    found = None if one is None or beyond is None else beside.located(run, one, beyond, fold)
    if found is not None and run.natural and _too_far(run) and not _on_one_path(run, found, one, beyond):
        found = None
    if found is None or one is None:
        before, after = (int(run.points.info[k, 0]) for k in (-2, -1))
        if after > before and _too_far(run) and not run.stuck:
            return _again(run)
        found = _found_before(run, other, before, after)
        if found is None:
            event = Event("unresolved", other.drive * run.unit, before, after)
            told = before == after or event in run.events
            if min(before, after) >= 0 and not told:  # a count below zero is that of rounding
                run.events.append(event)
            return other
        run.events.append(Event("bifurcation", found.spot.drive * run.unit, before, after))
        return _no_branch(run, found, other)
    if run.natural and found.after - found.before > 1:
        found = alone(run, found, one)
        other = run.spot(-1)
    kind = "limit point" if found.fold else "bifurcation"
    run.events.append(Event(kind, found.spot.drive * run.unit, found.before, found.after))
    if run.first is None and not found.fold and found.after > found.before:
        run.first = found
    return _parted(run, found, one, other) if run.natural else other


def _on_one_path(run: Run, found: Singular, one: Spot | None, beyond: Spot | None) -> bool:
    """Tell whether a path goes straight on through a singular point that was found between two of its points.

    A slightly imperfect part has a sharp corner there instead, and behind it a path of its own that is unstable.
    """
    if one is None or beyond is None:
        return False
    whole = run.fine.pose_change(one.y, beyond.y)
    ends = []
    for end in (one, beyond):
        share = _ASIDE * (end.drive - found.spot.drive)
        ends.append(run.fine.solve(found.spot.y + _ASIDE * (end.y - found.spot.y), found.spot.drive + share))
    near, far = ends
    if near is None or far is None or near.unstable > one.unstable:
        return False
    return run.fine.pose_change(near.y, far.y) <= _STRAIGHT * _ASIDE * whole + _ROUNDING


def _last_step_before(run: Run) -> int:
    """Return the index of the point that the last step began at: along the arc there are points asked for between."""
    index = -2
    while -index < len(run.points) and run.points.info[index, 2] == -1.0:
        index -= 1
    return index


def _may_be_taken_back(run: Run) -> bool:
    """Tell whether the last point but one was not taken back several times before, nor anything happened before it."""
    if run.points.info[-3, 0] != run.points.info[-2, 0]:
        return False
    place = (float(run.points.drive[-2]), np.inf)
    run.visited[place] += 1
    return run.visited[place] <= _TIMES


def _beside(run: Run, index: int, spot: Spot | None, other: Spot | None) -> bool:
    """Tell whether one of the last two points lies at the bifurcation between them, for the fine mesh.

    It has another inertia there than on this mesh, or hardly any determinant compared with the other one.
    """
    if spot is None or spot.unstable != int(run.points.info[index, 0]):
        return True
    if other is None:
        return False
    share = min(0.5 * BESIDE * run.span / abs(other.drive - spot.drive), _SLIGHT)
    return not spot.log_size - other.log_size > np.log(share)


def _without_last_but_one(run: Run) -> Spot | None:
    """Take back a point beside a bifurcation, where meshes differ in what is stable; return the one before it."""
    last, name = run.points.take([-1]), run.branches[-1]
    run.drop_last()
    run.drop_last()
    if last.info[0, 1] > run.asked():
        last.info[0, 1] = -1.0  # the point taken back is to be done first
    before = run.fine_spot(-1)
    run.append(last)
    run.branches[-1] = name
    return before


def _behind_the_last(run: Run) -> Spot | None:
    """Replace the last point, beside a bifurcation, by one behind it if there is one; return it on the fine mesh."""
    last, name = run.points.take([-1]), run.branches[-1]
    run.drop_last()
    if beside.behind(run, float(last.drive[0])):
        return run.fine_spot(-1)
    run.append(last)
    run.branches[-1] = name
    return None


def _parted(run: Run, found: Singular, one: Spot, other: Spot) -> Spot | None:
    """Go on behind a bifurcation between `one` and the last point `other`, where the control says; None to stop."""
    unstable_anyway = run.control.through_folds and found.before > 0
    if found.after <= found.before or run.control.branch == "primary" or unstable_anyway:
        return _past(run, found, one, _clear_of(run, found, one, other))
    forward, onto = float(np.sign(other.drive - one.drive)), run.branch
    found, wide = left_behind(run, found, one, forward)
    left = None if wide is None else run.settled(run.fine.reduce(wide))
    if left is None and _too_far(run) and not _sure(run, one, other, found):
        run.events.pop()
        run.first = None if run.first is found else run.first
        run.without_branch = found
        return _again(run)
    if left is None:
        if run.control.through_folds:
            return _past(run, found, one, _clear_of(run, found, one, other))
        return _no_branch(run, found, other)
    clear = _clear_of(run, found, one, other)
    run.drop_last()
    run.events[-1] = replace(run.events[-1], after=found.after)
    name = f"bifurcated at {found.spot.drive * run.unit:.6g}, sign {run.control.sign:+d}"
    beside.opening(run, found, one, wide, name)
    left = _not_beyond(run, found, left, forward)
    run.branch = name
    run.append(run.as_points(left, -1))
    run.entry = 0.5 * abs(left.drive - found.spot.drive)
    run.closed = False
    ending = end_of_branch(run, clear, found.before, forward, onto)
    run.ends = (
        end_at(run, replace(found, before=found.after, after=found.before), one, onto),
        *([ending] if ending else []),
    )
    return left


def _past(run: Run, found: Singular, one: Spot, clear: Spot) -> Spot:
    """Stay on the path behind a bifurcation between `one` and the last point; go on from `clear`, there or beyond."""
    last = run.points.take([-1])
    run.drop_last()
    beside.opening(run, found, one, None, run.branch)
    if last.info[0, 1] < run.asked():
        last.info[0, 1] = -1.0  # it has just been added
    run.append(last)
    if clear.drive != last.drive[0]:
        run.append(run.as_points(clear, -1))
    return clear


def _clear_of(run: Run, found: Singular, one: Spot, other: Spot) -> Spot:
    """Return a point behind a bifurcation from which the path can be followed on: `other` if it is far enough.

    Beside a bifurcation the error of integration may lead to the path that crosses; on the fine mesh it does not.
    """
    ahead = np.abs(run.targets[run.asked() :] - other.drive)
    room = min(_CLEAR * run.span, 0.5 * float(ahead.min(initial=np.inf)))
    if abs(other.drive - found.spot.drive) >= room:
        return other
    early = well_before(run, found, 0.1 * room) or one  # from nearer the path would be foretold badly
    before = found.spot.drive - early.drive
    if before == 0.0:
        return other
    place = other.drive + float(np.sign(other.drive - one.drive)) * room
    guess = found.spot.y + (found.spot.y - early.y) * ((place - found.spot.drive) / before)
    wide = run.fine.solve(guess, place)
    near = None if wide is None or wide.unstable != found.after else run.settled(run.fine.reduce(wide))
    return other if near is None else near


def _found_before(run: Run, other: Spot, before: int, after: int) -> Singular | None:
    """Return the bifurcation that longer steps found here, without a stable branch; of short ones it may lie outside.

    The fine mesh puts it beside where this one has it, by the error of integration.
    """
    known = run.without_branch
    if known is None or not _known(run, other.drive, _CLEAR):
        return None
    return known if (known.before, known.after) == (before, after) else None


def _known(run: Run, place: float, share: float = _SAME_PLACE) -> bool:
    """Tell whether a bifurcation without a stable branch was found before near a drive, within a share of its range."""
    known = run.without_branch
    return known is not None and abs(known.spot.drive - place) <= share * run.span


def _sure(run: Run, one: Spot, other: Spot, found: Singular) -> bool:
    """Tell whether a bifurcation was found before and now between points so near that its branch would be found too.

    Or as near as steps lead.
    """
    near = run.stuck or abs(other.drive - one.drive) <= _SAME_PLACE * run.span
    return near and _known(run, found.spot.drive)


def _not_beyond(run: Run, found: Singular, left: Spot, forward: float) -> Spot:
    """Return the entry of a branch, moved back before the next point asked for where it lies beyond that.

    Away from a bifurcation a branch opens like the square root of the distance.
    """
    ahead = (run.targets[run.asked() :][:1] - found.spot.drive) * forward
    reach, nearest = (left.drive - found.spot.drive) * forward, 0.5 * ahead[ahead > 0].min(initial=np.inf)
    if not 2.0 * nearest < reach:
        return left
    start = run.fine.reduce(found.spot).y
    guess = start + np.sqrt(nearest / reach) * (left.y - start)
    near = run.solver.solve(guess, found.spot.drive + forward * nearest)
    if near is None or near.unstable > left.unstable:
        return left
    return near if run.solver.pose_change(near.y, start) > 0.3 * run.solver.pose_change(guess, start) else left


def _too_far(run: Run) -> bool:
    """Tell whether the last step may have passed a sharp corner, and ended on another path."""
    return run.natural and abs(float(run.points.drive[-1] - run.points.drive[-2])) > _FINEST * run.span


def _again(run: Run) -> Spot:
    """Take the last point back; return the one before, to go on from there in shorter steps."""
    run.entry = 0.25 * abs(float(run.points.drive[-1] - run.points.drive[-2]))
    run.come_by(float(run.points.drive[-2]), float(run.points.drive[-1]))
    run.drop_last()
    return run.spot(-1)


def _no_branch(run: Run, found: Singular, other: Spot) -> Spot | None:
    """Handle a bifurcation without a stable branch nearby: the mechanism jumps there."""
    if run.control.through_folds:
        return other
    run.drop_last()
    run.status = PathStatus.JUMPS
    run.message = f"no stable equilibrium near {found.spot.drive * run.unit:.6g}: it jumps to a distant one there"
    return None


def _point_along(run: Run, spot: Spot) -> None:
    """Turn the tangent of the last point the way the path came: after a limit point the drive goes back."""
    n = run.solver.n
    came = np.append(run.points.y[-1, :n] - run.points.y[-2, :n], run.points.drive[-1] - run.points.drive[-2])
    weights = np.append(np.where(np.arange(n) < run.solver.n_free, 1.0, FORCE_WEIGHT), 1.0)
    if float((weights * came) @ spot.tangent) < 0:
        spot.tangent *= -1.0

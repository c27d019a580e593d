"""The iterator of a path's points and events: predict, correct, accept; policies take over where a step fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.numerics.continuation.branches import find_passed_end, primary_slope
from cfmkit.numerics.continuation.by_arc import follow_by_arc
from cfmkit.numerics.continuation.corners import crosses_bend, mark_corners
from cfmkit.numerics.continuation.events import locate_loss
from cfmkit.numerics.continuation.losses import (
    CRITICAL_STIFFNESS,
    look_past,
    lose_stability,
    start_critical,
    start_unstable,
)
from cfmkit.numerics.continuation.path import (
    AT_EVENT,
    MarchedSteps,
    PathEvent,
    PathStop,
    Point,
    Walk,
    WhyStopped,
)
from cfmkit.numerics.continuation.problem import largest_motion
from cfmkit.numerics.continuation.steps import advance

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.losses import Items
    from cfmkit.numerics.continuation.path import Options, PathBranch
    from cfmkit.numerics.continuation.problem import ContinuationProblem, PathEquilibrium
    from cfmkit.numerics.continuation.steps import Trial

Item = Point | PathEvent | PathStop

NEARLY_CRITICAL = 1e-5  # stiffness of a mode; one a hundred times as large says that no bifurcation is very near
LANDING_STRETCH = 1.3  # steps by which a step may be stretched to land on a requested value
GOOD_MISFIT = 0.1  # of predictions after which the step grows
STEP_SHRINK, POOR_MISFIT = 0.8, 0.25
FORCE_MARGIN = 0.7  # of the allowed change of forces that a shortened step aims at
ARC_AFTER = 7  # rejections, two each less one for an accepted step, above which the arc length leads
ARC_ANYWAY = 24  # rejections above which it leads even where the slope is not steep
STEEP_SLOPE = 0.5  # motion over the drive's range, by the slope
MAX_REJECTIONS = 90
SHORT_STEP = 1e-9  # share of the range: shorter steps count as rejections
LOCKED_MESSAGE = "the drive cannot go on at {place}: the structure locks, a force grows beyond all bounds"
LOCKED_FORCE, LOCKED_STEP = 1e5, 1e-6
"""Force, in its unit, and step as a share of the range, from which on a structure is locked: pulled straight, say."""


def follow(
    problem: ContinuationProblem,
    start: PathEquilibrium,
    targets: FloatArray,
    options: Options,
    branch: PathBranch | None = None,
) -> Iterator[Point | PathEvent | PathStop]:
    """Yield the points of a path from a start, at requested values of the drive (k,) and between, and its events.

    Values may turn back. At last comes a `PathStop`, which says why if the path ends early. If a problem has a method
    `march`, of a `Walk`, to `MarchedSteps`, it takes steps by itself where nothing happens, in compiled code, say; if
    it has `march_whole`, too, all of them where nothing happens at all.
    """
    items = each_point(follow_together(problem, start, targets, options, branch))
    return mark_corners(items, options) if options.corner else items


def each_point(items: Iterable[Any]) -> Iterator[Any]:
    """Yield items of a path, the points of marches one by one."""
    for item in items:
        yield from item.each_point() if isinstance(item, MarchedSteps) else (item,)


def follow_together(
    problem: ContinuationProblem,
    start: PathEquilibrium,
    targets: FloatArray,
    options: Options,
    branch: PathBranch | None = None,
) -> Iterator[Item | MarchedSteps]:
    """Yield the items of `follow` with the points of every march in one item, and without rounded corners."""
    at_first = int(len(targets) > 0 and targets[0] == start.drive)
    step, steepest = options.first_step * options.span, max(0.0, abs(start.stiffness))
    walk = Walk(problem, options, targets, start, step, at_first, trail=(start,), branch=branch, steepest=steepest)
    return limit_points(_follow_from_start(walk), options.most_points)


def limit_points(items: Iterable[Any], most: int) -> Iterator[Any]:
    """Yield the items of a path, at most `most` points besides those requested."""
    for item in items:
        if isinstance(item, MarchedSteps) and (between := int(np.count_nonzero(item.target < 0))) <= most:
            yield item
            most -= between
            continue
        for single in item.each_point() if isinstance(item, MarchedSteps) else (item,):
            yield single
            most -= isinstance(single, Point) and single.target < 0
            if most < 0:
                yield PathStop(WhyStopped.FULL, single.at.drive, "more points than allowed at {place}")
                return


def _follow_from_start(walk: Walk) -> Iterator[Item | MarchedSteps]:
    """Yield the items of a path: one march if nothing happens, else from a start that may be critical or unstable."""
    problem, options, start = walk.problem, walk.options, walk.current
    march_whole = getattr(problem, "march_whole", None)
    if march_whole is not None and not walk.done and not start.unstable:
        marched = march_whole(walk, (CRITICAL_STIFFNESS, NEARLY_CRITICAL))
        if marched is not None:
            yield Point(start, walk.number - 1, walk.branch)
            yield marched
            yield PathStop(WhyStopped.COMPLETE, float(marched.drive[-1]))
            return
    beyond = None if walk.done or options.branch == "primary" else start_critical(walk)
    # at a critical start it is rounding how many directions are unstable
    yield Point(
        start if beyond is None else start._replace(unstable=beyond.current.unstable), walk.number - 1, walk.branch
    )
    walk = beyond or walk
    if walk.current.drive != start.drive:
        yield Point(walk.current, -1, walk.branch)
    elif walk.current.unstable and options.branch != "primary" and not walk.done:
        moved = None if options.branch == "stop" else start_unstable(walk)
        if moved is None:
            yield PathStop(WhyStopped.JUMPS, start.drive, "no stable equilibrium at the start, {place}")
            return
        walk = moved
    yield from follow_on(walk)


def follow_on(walk: Walk) -> Iterator[Item | MarchedSteps]:
    """Yield the points and events of a path from a state of its follower on, and its ending at last."""
    outcome = yield from _walk_on(walk)
    if isinstance(outcome, PathStop):
        yield outcome
        return
    yield from _look_ahead(outcome)
    yield PathStop(WhyStopped.COMPLETE, outcome.current.drive)


def _walk_on(walk: Walk) -> Generator[Point | PathEvent | MarchedSteps, None, Walk | PathStop]:
    """Yield the points and events up to the last requested value; return the walk there, or why it ended before."""
    march = getattr(walk.problem, "march", None)
    while not walk.done:
        if march is not None and walk.rejections == 0:
            walk = yield from _take_march(walk, march)
            if walk.done:
                break
        outcome = yield from _step(walk)
        if outcome is None or isinstance(outcome, PathStop):
            return outcome or PathStop(WhyStopped.LOST, walk.current.drive, "no step converged at {place}")
        walk = outcome
    return walk


def _look_ahead(walk: Walk) -> Iterator[PathEvent]:
    """Yield a bifurcation that the last requested value is at: it may be found only from a little further on."""
    current, problem = walk.current, walk.problem
    is_stiff = getattr(problem, "is_stiff", None)
    if walk.before is None or (is_stiff is not None and is_stiff(current, NEARLY_CRITICAL)):
        return
    sense = 1.0 if current.drive >= walk.before.drive else -1.0
    beyond = np.append(walk.targets, current.drive + sense * AT_EVENT * walk.options.span)
    for item in _walk_on(walk._replace(targets=beyond, rejections=0)):
        if isinstance(item, PathEvent) and item.kind == "bifurcation":
            yield item


def _take_march(walk: Walk, march: Callable[[Walk], MarchedSteps]) -> Generator[MarchedSteps, None, Walk]:
    """Yield the points of steps that a problem takes by itself, as far as nothing happens; return the walk there."""
    marched = march(walk)
    if len(marched.drive):
        yield marched
        last = marched.point_at(-2) if len(marched.drive) > 1 else walk.current
        number = walk.number + int(np.count_nonzero(marched.target >= 0))
        walk = walk._replace(before=last, current=marched.point_at(-1), trail=(*walk.trail, marched), number=number)
    return walk._replace(step=marched.step, rejections=ARC_AFTER if marched.stuck else 1)


def _step(walk: Walk) -> Items:
    """Take one step by the drive, or whatever is done instead."""
    current, sense = walk.current, walk.sense
    if _is_locked(walk):
        return PathStop(WhyStopped.LIMIT_POINT, current.drive, LOCKED_MESSAGE)
    if walk.before is not None and (current.drive - walk.before.drive) * sense < 0:  # the drive turns back
        walk = walk._replace(before=None)
    target = float(walk.targets[walk.number])
    lands = abs(target - current.drive) <= LANDING_STRETCH * walk.step
    goal = target if lands else current.drive + sense * walk.step
    trial = advance(walk, goal)
    if trial.excess > 1:
        return _shorten_for_forces(walk, goal, trial.excess)
    if trial.new is None or _skips(walk, trial.new):
        return (yield from _reject(walk, goal))
    walk = walk._replace(rejections=max(0, walk.rejections - 1))
    if crosses_bend(walk, trial.new):
        return walk.shorten(0.5 * abs(goal - current.drive), penalty=0)
    if trial.new.unstable > current.unstable and walk.options.branch != "primary":
        outcome = yield from lose_stability(walk, trial.new)
        return outcome if outcome is not None else walk.shorten(0.25 * abs(goal - current.drive))._replace(before=None)
    return (yield from _accept(walk, trial, goal, lands))


def _is_locked(walk: Walk) -> bool:
    if walk.step > LOCKED_STEP * walk.options.span:
        return False
    forces = (np.abs(walk.current.x) / walk.problem.unit)[~walk.problem.motions]
    return bool(forces.max(initial=0.0) > LOCKED_FORCE)


def _skips(walk: Walk, new: PathEquilibrium) -> bool:
    """Return True if a long step has passed several bifurcations: they are passed one by one."""
    passed = new.unstable - walk.current.unstable
    several = abs(passed) > 1 if walk.options.branch == "primary" else passed > 1
    return several and abs(new.drive - walk.current.drive) > walk.options.cluster * walk.options.span


def _accept(walk: Walk, trial: Trial, goal: float, lands: bool) -> Items:
    """Yield a step's point and what has happened on it; return the walk there."""
    current, new = walk.current, trial.new
    assert new is not None
    step = abs(goal - current.drive)
    if new.unstable != current.unstable:
        location, lost = locate_loss(walk, new), new.unstable - current.unstable
        modes = walk.problem.modes(location.nearest, lost)[1] if location and lost > 0 else None
        event = PathEvent("bifurcation", new.drive, current.unstable, new.unstable)
        event = location.as_bifurcation(current.unstable, new.unstable, modes) if location else event
        yield event
        if abs(new.drive - event.drive) <= AT_EVENT * walk.options.span:  # the slope there is that of a mode
            _, critical = walk.problem.modes(new, abs(lost))
            new = new._replace(rate=primary_slope(walk.problem, new, critical))
    elif walk.branch is not None and not walk.options.corner:  # else it is the end of a branch that bends the curve
        end = find_passed_end(walk, new)
        if end == "unsure":
            return walk.shorten(0.5 * step)._replace(before=None)
        if end is not None and lands and walk.turns_at(end.drive):
            yield Point(new, walk.number, walk.branch)
            yield PathEvent("bifurcation", end.drive, new.unstable, new.unstable, end.nearest)
            return walk._replace(number=walk.number + 1, before=None)
        if end is not None:
            yield end
            walk = walk._replace(branch=None)
            walk = walk.move(new, int(lands))._replace(before=None)
            yield Point(new, walk.number - 1 if lands else -1, walk.branch)
            return walk._replace(step=_next_step(walk, trial.misfit, step, lands))
    yield Point(new, walk.number if lands else -1, walk.branch)
    return walk.move(new, int(lands))._replace(step=_next_step(walk, trial.misfit, step, lands))


def _next_step(walk: Walk, misfit: float, step: float, landed: bool) -> float:
    if misfit < GOOD_MISFIT:
        return min(walk.options.span, walk.options.growth * (walk.step if landed else max(walk.step, step)))
    return STEP_SHRINK * step if misfit > POOR_MISFIT else walk.step


def _shorten_for_forces(walk: Walk, goal: float, excess: float) -> Walk:
    """Return the walk with a step that changes forces less: that is no rejection.

    Counted as one it would send slender columns into the arc length at rest, over a sharp corner.
    """
    step = abs(goal - walk.current.drive) * max(FORCE_MARGIN / excess, 1e-4)
    short = step < SHORT_STEP * walk.options.span
    return walk._replace(step=step, before=None, rejections=walk.rejections + short)


def _reject(walk: Walk, goal: float) -> Items:
    """Go on after a step that failed: behind a bifurcation that is here, by a shorter step, by the arc length."""
    options, current = walk.options, walk.current
    if walk.rejections >= 2 and walk.searched is not current and not options.corner:  # else steps are cut at a bend
        walk = walk._replace(searched=current)
        outcome = yield from look_past(walk, goal)
        if outcome is not None:
            return outcome
    walk = walk.shorten(0.5 * abs(goal - current.drive))
    if walk.rejections > ARC_AFTER:
        steep = largest_motion(walk.problem, current.rate) * options.span > STEEP_SLOPE
        if steep or walk.rejections > ARC_ANYWAY:
            outcome = yield from follow_by_arc(walk)
            if outcome is not None:
                return outcome
    if walk.step < options.finest_step * options.span or walk.rejections > MAX_REJECTIONS:
        return PathStop(WhyStopped.LOST, current.drive, "no step converged at {place}")
    return walk

"""Following a path: marches, joined where the path needs a decision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation import (
    at_bifurcation,
    bifurcation,
    branch_end,
    corner,
    critical_start,
    ending,
    limit_point,
    start,
)
from cfmkit.elastica.continuation.state import PRIMARY, Leg, Resume, Stop, Trail
from cfmkit.elastica.continuation.uncondensed import uncondensed
from cfmkit.elastica.kernels.codes import DENIED, DONE, INERTIA, LONG, NO_START, STALLED
from cfmkit.elastica.outcome.path import PathStatus

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.singular import Singular
    from cfmkit.elastica.continuation.state import Move, Problem
    from cfmkit.elastica.equilibrium.solver import Spot

_HOPS = 60  # decisions on one path
_LANDINGS = 6  # tries to land on a point asked for before a bifurcation is looked for there
_FIRST = 0.05  # first step as a share of the drive's range, unless points asked for are nearer
_NEARBY = 0.01  # share of the drive's range within which a march stalls at the same place again


@dataclass(frozen=True, eq=False)
class Followed:
    """A path as far as it was followed.

    Attributes
    ----------
    share : float
        Of the constant loads and displacements that was reached.
    first : (Problem, Singular) or None
        The first bifurcation at which stability is lost, and the problem that it is one of: the drive's, or that of
        the way to the prestress or the constant loads.
    """

    trail: Trail
    share: float
    first: tuple[Problem, Singular] | None


def follow(problem: Problem) -> Followed:
    """Follow a path from rest to the last point asked for, or to where it ends, and name the branches."""
    begun = start.started(problem, Trail.begun(problem), _way)
    trail = _named(problem, _followed(problem, begun))
    first = begun.ramp or (None if trail.first is None else (problem, trail.first))
    return Followed(trail, begun.share, first)


def _way(problem: Problem, branch: str) -> Trail:
    """Follow a path that begins on a branch."""
    return _named(problem, _followed(problem, start.started(problem, Trail.begun(problem, branch), _way)))


def _followed(problem: Problem, begun: start.Start) -> Trail:
    """Return the path from where it starts: the loop that applies the moves that decisions come to."""
    trail = begun.trail
    if begun.spot is None:
        if begun.code == DONE:
            return trail
        long = replace(trail.ending, too_long=begun.code == LONG)
        return ending.without_start(problem, replace(trail, ending=long), begun.share)
    if trail.branch != PRIMARY:
        trail = start.ends_of_branch(problem, trail, _way)
    move: Move = Resume(trail, begun.spot, fresh=True)
    for _ in range(_HOPS):
        if isinstance(move, Stop) or _complete(problem, move):
            break
        move = decided(problem, march(problem, move), move.fresh)
    trail = move.trail
    if isinstance(move, Resume) and not _complete(problem, move):
        message = f"the path turned back and forth at {trail.drive * problem.unit:.6g}"
        return trail.stopped(PathStatus.LOST, message)
    if not len(trail.points):
        return ending.without_start(problem, trail, begun.share)
    if isinstance(move, Resume):
        while trail.stretch.natural and trail.points.asked[-1] < 0.0:
            trail = trail.up_to(-1)
    return trail


def _complete(problem: Problem, move: Resume) -> bool:
    """Tell whether all points of the stretch are done that is being followed."""
    return not move.fresh and move.trail.asked >= len(move.trail.stretch.targets)


def _named(problem: Problem, trail: Trail) -> Trail:
    """Return a path with the end of its last branch, where it was stepped over or is known from behind only."""
    if trail.closed or trail.ending.too_long or not trail.stretch.natural or set(trail.branches) <= {PRIMARY}:
        return trail
    closed = branch_end.closed_behind(problem, trail)
    if closed is not None:
        return closed
    primary = problem.on_primary()
    return branch_end.relabelled(problem, trail, _way(primary, PRIMARY))


def march(problem: Problem, move: Resume) -> Leg:
    """March once: predictor and corrector, in compiled code, up to where a decision is needed."""
    trail, spot, stretch, control = move.trail, move.spot, move.trail.stretch, problem.control
    asked = int(stretch.targets[0] == 0.0) if move.fresh else trail.asked
    left, numbers, toward = branch_end.ahead(problem, trail, spot, asked)
    patient = move.patient or not stretch.natural or control.branch == "stop"
    options = problem.options(trail, spot, _first_step(problem, move, asked))._replace(
        landings=np.inf if patient else _LANDINGS,
        sense=float(np.sign(next(value for value in stretch.targets if value))) if move.fresh else 0.0,
    )
    room = max(len(left) + 3, control.most_points + len(stretch.targets) - len(trail.points))
    code, points = trail.solver.march(spot, left, options, room)
    if numbers is not None:
        points.asked[:] = numbers[points.asked.astype(int)]
    if move.fresh and asked:
        points.asked[:1] = 0
    trail = trail.with_points(points)
    if len(points):
        spot = trail.spot(-1) if code == STALLED else trail.last_of(points)
    return Leg(code, trail, spot, toward)


def _first_step(problem: Problem, move: Resume, asked: int) -> float:
    """Return the first step of a march, with the sign of the way to go if it is by the drive."""
    stretch, first = move.trail.stretch, problem.control.first_step
    along = float(stretch.targets[asked] - move.spot.drive)
    if first is not None:
        step = min(first * problem.span, move.step)
        return float(np.copysign(step, along)) if stretch.natural else step
    if not stretch.natural:
        return min(limit_point.first_step(problem), move.step)
    return float(np.sign(along)) * min(abs(along), _FIRST * problem.span, move.step)


def decided(problem: Problem, leg: Leg, fresh: bool) -> Move:
    """Return where to go on after a march, or that the path ends."""
    trail, asked = leg.trail, leg.trail.asked
    away = critical_start.left_again(problem, trail) if fresh else None
    if away is not None:
        return away
    if leg.code == DONE and asked == len(trail.stretch.targets):
        if asked == len(problem.values):
            return Resume(trail, leg.spot)
        return limit_point.by_the_drive(problem, trail, asked)
    move = _after(problem, leg, asked)
    return Stop(move.trail) if problem.first_only and move.trail.first is not None else move


def _after(problem: Problem, leg: Leg, asked: int) -> Move:
    """Return where to go on after a march that ended early, or on a branch."""
    trail, spot, code, control = leg.trail, leg.spot, leg.code, problem.control
    steadies = code == INERTIA and bool(trail.points.unstable[-1] < trail.points.unstable[-2])
    if code in (NO_START, STALLED) or (steadies and control.branch == "stable"):
        away = critical_start.left(problem, trail, spot)
        if away is not None or code == NO_START:
            return away or Stop(trail)
    if code == INERTIA and control.branch == "stop":
        message = f"stability is lost at {trail.drive * problem.unit:.6g}: the path ends there"
        return Stop(trail.stopped(PathStatus.JUMPS, message))
    if code == INERTIA:
        return limit_point.back_to_the_drive(problem, bifurcation.crossed(problem, trail))
    if code == DONE:
        return branch_end.rejoined(problem, trail, spot, leg.toward)
    if code == DENIED:
        behind = at_bifurcation.passed(problem, trail, float(trail.stretch.targets[asked]))
        return Resume(trail, spot, patient=True) if behind is None else bifurcation.crossed(problem, behind)
    if code == STALLED and trail.stretch.natural and len(trail.points):
        return _got_over(problem, trail, spot, asked)
    return ending.stop(problem, trail, code)


def _got_over(problem: Problem, trail: Trail, spot: Spot, asked: int) -> Move:
    """Return where to go on after a march by the drive that stalled."""
    fold = limit_point.is_near(problem, trail)
    if fold and abs(spot.drive - trail.fold_at) <= _NEARBY * problem.span:
        return limit_point.around(problem, trail)
    trail = replace(trail, fold_at=spot.drive if fold else np.nan)
    if not fold and (again := uncondensed(problem, trail)) is not None:
        return again
    move: Move | None = None
    if any(name != PRIMARY for name in trail.branches):
        move = branch_end.stepped_over(problem, trail, spot, asked)
    if move is None:
        trail, move = corner.past(problem, trail, spot, asked)
    if move is not None:
        return move
    if problem.control.through_folds:
        return limit_point.around(problem, trail)
    return ending.stop(problem, trail, STALLED)

"""Decisions: where a path goes on after a march that ended before all was done, or that it ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation import (
    branch_rejoins_path,
    critical_start,
    decisions_at_bifurcation,
    ending_messages,
    passing_limit_points,
    points_at_bifurcation,
)
from cfmkit.elastica.continuation.path_and_moves import PRIMARY, Leg, Resume, Stop
from cfmkit.elastica.continuation.uncondensed import uncondensed
from cfmkit.elastica.kernels.status_codes import DENIED, DONE, INERTIA, NO_START, STALLED
from cfmkit.elastica.outcome.path import PathStatus

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.path_and_moves import Move, PathProblem, Trail
    from cfmkit.elastica.equilibrium.network_solver import Spot

_NEARBY = 0.01  # share of the drive's range within which a march stalls at the same place again


def decided(problem: PathProblem, leg: Leg, fresh: bool) -> Move:
    """Return where to go on after a march, or that the path ends."""
    trail, requested = leg.trail, leg.trail.requested
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
        away = critical_start.left(problem, trail, spot)
        if away is not None or code == NO_START:
            return away or Stop(trail)
    if code == INERTIA and control.branch == "stop":
        message = f"stability is lost at {trail.drive * problem.unit:.6g}: the path ends there"
        return Stop(trail.stopped(PathStatus.JUMPS, message))
    if code == INERTIA:
        return passing_limit_points.back_to_the_drive(problem, decisions_at_bifurcation.crossed(problem, trail))
    if code == DONE:
        return branch_rejoins_path.rejoined(problem, trail, spot, leg.toward)
    if code == DENIED:
        behind = points_at_bifurcation.passed(problem, trail, float(trail.stretch.targets[requested]))
        return (
            Resume(trail, spot, patient=True) if behind is None else decisions_at_bifurcation.crossed(problem, behind)
        )
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
        trail, move = decisions_at_bifurcation.past_corner(problem, trail, spot, requested)
    if move is not None:
        return move
    if problem.control.through_folds:
        return passing_limit_points.around(problem, trail)
    return ending_messages.stop(problem, trail, STALLED)

"""Following a path: marches, joined where the path needs a decision."""

from __future__ import annotations

from math import copysign
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.continuation import ending_messages, start
from cfmkit.elastica.continuation.path_and_moves import PRIMARY, Leg, Resume, Stop, Trail
from cfmkit.elastica.kernels.status_codes import DONE, LONG, STALLED
from cfmkit.elastica.outcome.path import PathStatus

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import BranchEnd, Move, PathProblem
    from cfmkit.elastica.equilibrium.network_solver import Spot

PASSES = 5  # how often a path that folds may pass a requested load without using up the points of its own

_HOPS = 60  # decisions on one path
_LANDINGS = 6  # tries to land on a requested point before a bifurcation is looked for there
_FIRST = 0.05  # first step as a share of the drive's range, unless requested points are nearer


class Followed(NamedTuple):
    """A path as far as it was followed.

    Attributes
    ----------
    trail : Trail
        Its points and how it ended.
    share : float
        Of the constant loads and displacements that was reached.
    first : (PathProblem, Singular) or None
        The first bifurcation at which stability is lost, and the problem that it is one of: the drive's, or that of
        the way to the prestress or the constant loads.
    """

    trail: Trail
    share: float
    first: tuple[PathProblem, Singular] | None


def follow(problem: PathProblem) -> Followed:
    """Follow a path from rest to the last requested point, or to where it ends, and name the branches."""
    begun = start.started(problem, Trail.begun(problem), _way)
    trail = _named(problem, _followed(problem, begun))
    first = begun.ramp or (None if trail.first is None else (problem, trail.first))
    return Followed(trail, begun.share, first)


def _way(problem: PathProblem, branch: str) -> Trail:
    """Follow a path that begins on a branch."""
    return _named(problem, _followed(problem, start.started(problem, Trail.begun(problem, branch), _way)))


def _followed(problem: PathProblem, begun: start.Start) -> Trail:
    """Return the path from where it starts: the loop that applies the moves that decisions come to."""
    trail = begun.trail
    if begun.spot is None:
        if begun.code == DONE:
            return trail
        long = trail.ending._replace(too_long=begun.code == LONG)
        return ending_messages.without_start(problem, trail.changed(ending=long), begun.share)
    if trail.branch != PRIMARY:
        trail = start.ends_of_branch(problem, trail, _way)
    move: Move = Resume(trail, begun.spot, fresh=True)
    for _ in range(_HOPS):
        if isinstance(move, Stop) or _complete(problem, move):
            break
        move = _next(problem, march(problem, move), move.fresh)
    trail = move.trail
    if isinstance(move, Resume) and not _complete(problem, move):
        message = f"the path turned back and forth at {trail.drive * problem.unit:.6g}"
        return trail.stopped(PathStatus.LOST, message)
    if not len(trail.points):
        return ending_messages.without_start(problem, trail, begun.share)
    if isinstance(move, Resume):
        while trail.stretch.natural and trail.points.requested[-1] < 0.0:
            trail = trail.up_to(-1)
    return trail


def _complete(problem: PathProblem, move: Resume) -> bool:
    """Tell whether all points of the stretch are done that is being followed."""
    return not move.fresh and move.trail.requested >= len(move.trail.stretch.targets)


def _named(problem: PathProblem, trail: Trail) -> Trail:
    """Return a path with the end of its last branch, where it was stepped over or is known from behind only."""
    if trail.closed or trail.ending.too_long or not trail.stretch.natural or set(trail.branches) <= {PRIMARY}:
        return trail
    from cfmkit.elastica.continuation import branch_rejoins_path

    closed = branch_rejoins_path.closed_behind(problem, trail)
    if closed is not None:
        return closed
    primary = problem.on_primary()
    return branch_rejoins_path.relabelled(problem, trail, _way(primary, PRIMARY))


def march(problem: PathProblem, move: Resume) -> Leg:
    """March once: predictor and corrector, in compiled code, up to where a decision is needed."""
    trail, spot, stretch, control = move.trail, move.spot, move.trail.stretch, problem.control
    requested = int(stretch.targets[0] == 0.0) if move.fresh else trail.requested
    left, numbers, toward = ahead(problem, trail, spot, requested)
    patient = move.patient or not stretch.natural or control.branch == "stop"
    landings, sense = np.inf if patient else _LANDINGS, problem.sense if move.fresh else 0.0
    options = problem.options(trail, spot, _first_step(problem, move, requested), landings=landings, sense=sense)
    passes = PASSES if control.through_folds else 1
    room = max(len(left) + 3, control.most_points + passes * len(stretch.targets) - len(trail.points))
    code, points = trail.solver.march(spot, left, options, room)
    if numbers is not None:
        points.requested[:] = numbers[points.requested.astype(int)]
    if move.fresh and requested:
        points.requested[:1] = 0
    trail = trail.with_points(points)
    if len(points):
        spot = trail.spot(-1) if code == STALLED else trail.last_of(points)
    return Leg(code, trail, spot, toward)


def ahead(
    problem: PathProblem, trail: Trail, spot: Spot, requested: int
) -> tuple[FloatArray, FloatArray | None, BranchEnd | None]:
    """Return the values of the drive still to be reached and their numbers among those requested, and a branch's end.

    No numbers where these are all that were requested; the last number stands for no number. A branch is followed to
    just before an end that is known.
    """
    targets, natural = trail.stretch.targets, trail.stretch.natural
    if requested == 0 and not trail.ends:
        return targets, None, None
    first = requested if natural else trail.stretch.first_requested
    numbers: Any = np.arange(first, len(targets))
    left, toward = targets[first:], None
    if natural and trail.ends:
        from cfmkit.elastica.continuation import branch_rejoins_path

        left, numbers, toward = branch_rejoins_path.up_to_ends(problem, trail, spot, left, numbers)
    return left, np.append(numbers, -1), toward


def _first_step(problem: PathProblem, move: Resume, requested: int) -> float:
    """Return the first step of a march, with the sign of the way to go if it is by the drive."""
    stretch, first = move.trail.stretch, problem.control.first_step
    along = float(stretch.targets[requested]) - move.spot.drive
    if first is not None:
        step = min(first * problem.span, move.step)
        return copysign(step, along) if stretch.natural else step
    if not stretch.natural:
        from cfmkit.elastica.continuation import passing_limit_points

        return min(passing_limit_points.first_step(problem), move.step)
    return copysign(min(abs(along), _FIRST * problem.span, move.step), along)


def _next(problem: PathProblem, leg: Leg, fresh: bool) -> Move:
    """Return where to go on after a march, or that the path ends."""
    trail = leg.trail
    if leg.code == DONE and trail.requested == len(problem.values) and not (fresh and trail.events):
        return Resume(trail, leg.spot)
    # most paths end with their first march: what decides on the others takes a tenth of a run to load
    from cfmkit.elastica.continuation.decisions_after_march import decided

    return decided(problem, leg, fresh)

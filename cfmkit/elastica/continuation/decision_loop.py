"""Following a path: marches, joined where the path needs a decision; and its start.

Springs are tightened, then everything constant is applied, along a stable branch if possible. Prestress and constant
loads may lie beyond a bifurcation. The path to them is then followed as any other is, with a share of them in the
place of the drive; what happens on it is reported as happening "under prestress" or "under constant loads", with that
share.
"""

from __future__ import annotations

from dataclasses import replace
from math import copysign
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.continuation import ending_messages
from cfmkit.elastica.continuation.path_and_moves import PRIMARY, Leg, PathProblem, Resume, Stop, Trail
from cfmkit.elastica.equilibrium.mesh import LOADS, PRESTRESS, assemble_model
from cfmkit.elastica.equilibrium.network_solver import MarchOptions, Solver, Spot
from cfmkit.elastica.kernels.status_codes import DONE, LONG, SHORT, STALLED
from cfmkit.elastica.model.network import Network
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.outcome.path import Event, PathStatus

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import BranchEnd, Move

PASSES = 5  # how often a path that folds may pass a requested load without using up the points of its own

_HOPS = 60  # decisions on one path
_LANDINGS = 6  # tries to land on a requested point before a bifurcation is looked for there
_FIRST = 0.05  # first step as a share of the drive's range, unless requested points are nearer

_ROOM = 400  # points on the way to the constant loads
_SOFTER = (3.0, 1.0, 0.3, 0.1)  # times as thick, with the same bending stiffness
_ENOUGH = 16  # segments of a beam with which such a way is found
_STEP, _TURN = 0.25, 0.35  # first step to the constant loads, as a share of them; largest change of a pose in a step


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


class Start(NamedTuple):
    """Where a path starts.

    Attributes
    ----------
    trail : Trail
        With what happened on the way there; without a point.
    spot : Spot or None
        A place near the equilibrium. None with the code DONE: the path ends before it begins, as the trail says.
    share : float
        Of the constant loads and displacements that was reached.
    code : int
        That of a march.
    ramp : (PathProblem, Singular) or None
        The way to the prestress or the constant loads and the first bifurcation on it, if only that was looked for.
    """

    trail: Trail
    spot: Spot | None
    share: float
    code: int
    ramp: tuple[PathProblem, Singular] | None = None


def follow(problem: PathProblem) -> Followed:
    """Follow a path from rest to the last requested point, or to where it ends, and name the branches."""
    begun = _started(problem, Trail.begun(problem))
    trail = _named(problem, _followed(problem, begun))
    first = begun.ramp or (None if trail.first is None else (problem, trail.first))
    return Followed(trail, begun.share, first)


def _way(problem: PathProblem, branch: str) -> Trail:
    """Follow a path that begins on a branch."""
    return _named(problem, _followed(problem, _started(problem, Trail.begun(problem, branch))))


def _started(problem: PathProblem, trail: Trail) -> Start:
    """Return where a path starts."""
    if problem.begin is not None:
        return Start(trail, problem.begin, 1.0, DONE)
    network = problem.layout.network
    indifferent = problem.control.branch == "primary" and not problem.first_only
    spot = problem.solver.tightened()
    if spot is not None and spot.shortness < SHORT:
        return Start(trail, None, 0.0, LONG)
    if (spot is None or spot.unstable > 0) and not indifferent:
        found = _along(problem, trail, PRESTRESS, problem.solver.rest())
        if found is not None and found.spot is None:
            return found
        if found is not None:
            trail, spot = found.trail, found.spot
    if spot is None or not (network.loads or problem.layout.held):
        return Start(trail, spot, float(spot is not None), DONE if spot is not None else STALLED)
    loaded = _loaded(problem, trail, spot, indifferent)
    stretches = all(beam.section.axial for beam in network.beams.values())
    if loaded.spot is not None or loaded.code in (DONE, LONG) or stretches:
        return loaded
    near = _by_stretching(problem)
    if near is not None:
        return Start(trail, near, 1.0, DONE)
    coarse = problem.mesh.segments < _ENOUGH  # coarse segments hide the way
    return loaded._replace(code=LONG) if coarse else loaded


def _by_stretching(problem: PathProblem) -> Spot | None:
    """Return a stable equilibrium under the constant loads and displacements near that of beams that stretch; or None.

    A straight beam that does not stretch has no way to where both of its ends are held closer together: its rotations
    would have to grow with the root of what is applied. One that stretches has, and then stretches less and less.
    """
    network, drive = problem.layout.network, problem.layout.drive
    control = replace(problem.control, branch="stable")
    soft = PathProblem(Layout(_softer(network, _SOFTER[0]), drive), problem.mesh, control)
    spot = _started(soft, Trail.begun(soft)).spot
    for factor in _SOFTER[1:]:
        if spot is None:
            return None
        spot = Solver(Layout(_softer(network, factor), drive), problem.mesh).solve(spot.y, 0.0)
    near = None if spot is None else problem.solver.solve(spot.y, 0.0)
    return near if near is not None and near.unstable <= 0 else None


def _softer(network: Network, factor: float) -> Network:
    """Return the network with beams that stretch, by the square of a factor more than theirs, and bend as they do."""
    beams = {}
    for name, beam in network.beams.items():
        section = beam.section
        thick = section.thickness
        wider = replace(thick, values=factor * thick.values) if isinstance(thick, Taper) else factor * thick
        soft = replace(section, youngs_modulus=section.youngs_modulus / factor**3, thickness=wider, axial=True)
        beams[name] = replace(beam, section=soft)
    return Network(network.nodes, beams, network.links, network.springs, network.loads)


def _loaded(problem: PathProblem, trail: Trail, spot: Spot, indifferent: bool) -> Start:
    """Apply the constant loads and displacements to a network at rest, its springs tight."""
    solver = problem.solver
    model = assemble_model(problem.layout, solver.cut, solver.table, LOADS)
    for watch in (None,) if indifferent else (0, None):
        options = MarchOptions(solver.tolerance, _STEP, _TURN, inertia=watch, sense=1.0)
        code, points = solver.march(spot, np.array([1.0]), options, _ROOM, model)
        if code in (DONE, LONG) or (watch is None and not indifferent):
            break
        found = _along(problem, trail, LOADS, spot)
        if found is not None:
            return found
    if code != DONE:
        return Start(trail, None, float(points.drive[-1]) if len(points) else 0.0, code)
    return Start(trail, Spot(points.y[-1], 0.0, spot.tangent), 1.0, DONE)


def _along(problem: PathProblem, trail: Trail, what: str, begin: Spot) -> Start | None:
    """Follow the path to the prestress or the loads through its bifurcations; None where that leads nowhere."""
    control = replace(problem.control, through_folds=False, first_step=None)
    ramp = PathProblem(problem.layout, problem.mesh, control, problem.first_only, what, begin)
    way = _way(ramp, trail.branch)
    ending = way.ending
    if ending.too_long:
        return Start(trail, None, 0.0, LONG)
    reported = (Event(f"{one.kind} under {what}", one.drive, one.before, one.after) for one in way.events)
    trail = trail.changed(events=(*trail.events, *reported))
    if problem.first_only and way.first is not None:
        return Start(trail, None, 1.0, DONE, (ramp, way.first))
    through_folds, sign = problem.control.through_folds, problem.control.sign
    if ending.status is PathStatus.JUMPS and not through_folds:
        stop, share = problem.control.branch == "stop", way.drive
        lost = f"stability is lost {'before' if stop else 'under'} {100 * share:.3g} % of the {what}"
        message = f"{lost}: {'the path ends there' if stop else 'it jumps there, as no stable equilibrium is near'}"
        return Start(trail.stopped(PathStatus.JUMPS, message), None, share, DONE)
    if ending.status is not PathStatus.COMPLETE:
        ended = way.branch != PRIMARY and not through_folds
        return Start(trail, None, way.drive, STALLED) if ended else None
    name = way.branches[-1]
    if name != PRIMARY and name != trail.branch:
        share = next((one.drive for one in reversed(way.events) if one.after > one.before), 1.0)
        name = f"bifurcated under {100 * share:.4g} % of the {what}, sign {sign:+d}"
    trail = trail.changed(branch=name, closed=name == PRIMARY)
    return Start(trail, Spot(way.points.y[-1], 0.0, problem.solver.unit.copy()), 1.0, DONE)


def _ends_of_branch(problem: PathProblem, trail: Trail) -> Trail:
    """Return the path with the end of the branch that it starts on: where the straight way becomes stable again."""
    primary = PathProblem(problem.layout, problem.mesh, replace(problem.control, branch="primary"))
    spot = problem.solver.tightened() if problem.ramp else _started(primary, Trail.begun(primary)).spot
    other = None if spot is None else problem.solver.solve(spot.y, 0.0)
    sense = problem.sense
    if other is None or other.unstable == 0:
        return trail
    from cfmkit.elastica.continuation import branch_rejoins_path

    end, closed = branch_rejoins_path.predicted_end(problem, trail, other, 0, sense, PRIMARY)
    return trail.changed(ends=(end,) if end else (), closed=closed)


def _followed(problem: PathProblem, begun: Start) -> Trail:
    """Return the path from where it starts: the loop that applies the moves that decisions come to."""
    trail = begun.trail
    if begun.spot is None:
        if begun.code == DONE:
            return trail
        long = trail.ending._replace(too_long=begun.code == LONG)
        return ending_messages.without_start(problem, trail.changed(ending=long), begun.share)
    if trail.branch != PRIMARY:
        trail = _ends_of_branch(problem, trail)
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

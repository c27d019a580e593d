"""The start of a path: springs are tightened, then everything constant is applied, along a stable branch if possible.

Prestress and constant loads may lie beyond a bifurcation. The path to them is then followed as any other is, with a
share of them in the place of the drive; what happens on it is reported as happening "under prestress" or "under
constant loads", with that share.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.elastica.continuation.path_and_moves import PRIMARY, PathProblem, Trail
from cfmkit.elastica.equilibrium.mesh import LOADS, PRESTRESS, assemble_model
from cfmkit.elastica.equilibrium.network_solver import MarchOptions, Solver, Spot
from cfmkit.elastica.kernels.status_codes import DONE, LONG, SHORT, STALLED
from cfmkit.elastica.model.network import Network
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.outcome.path import Event, PathStatus

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.critical_points import Singular

_ROOM = 400  # points on the way to the constant loads
_SOFTER = (3.0, 1.0, 0.3, 0.1)  # times as thick, with the same bending stiffness
_ENOUGH = 16  # segments of a beam with which such a way is found
_STEP, _TURN = 0.25, 0.35  # first step, as a share of them; largest change of a pose in a step

Follow = Callable[[PathProblem, str], Trail]
"""Follows a problem from rest, on a branch: `cfmkit.elastica.continuation.decision_loop.follow`."""


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


def started(problem: PathProblem, trail: Trail, follow: Follow) -> Start:
    """Return where a path starts."""
    if problem.begin is not None:
        return Start(trail, problem.begin, 1.0, DONE)
    network = problem.layout.network
    indifferent = problem.control.branch == "primary" and not problem.first_only
    spot = problem.solver.tightened()
    if spot is not None and spot.shortness < SHORT:
        return Start(trail, None, 0.0, LONG)
    if (spot is None or spot.unstable > 0) and not indifferent:
        found = _along(problem, trail, PRESTRESS, problem.solver.rest(), follow)
        if found is not None and found.spot is None:
            return found
        if found is not None:
            trail, spot = found.trail, found.spot
    if spot is None or not (network.loads or problem.layout.held):
        return Start(trail, spot, float(spot is not None), DONE if spot is not None else STALLED)
    loaded = _loaded(problem, trail, spot, indifferent, follow)
    stretches = all(beam.section.axial for beam in network.beams.values())
    if loaded.spot is not None or loaded.code in (DONE, LONG) or stretches:
        return loaded
    near = _by_stretching(problem, follow)
    if near is not None:
        return Start(trail, near, 1.0, DONE)
    coarse = problem.mesh.segments < _ENOUGH  # coarse segments hide the way
    return loaded._replace(code=LONG) if coarse else loaded


def _by_stretching(problem: PathProblem, follow: Follow) -> Spot | None:
    """Return a stable equilibrium under the constant loads and displacements near that of beams that stretch; or None.

    A straight beam that does not stretch has no way to where both of its ends are held closer together: its rotations
    would have to grow with the root of what is applied. One that stretches has, and then stretches less and less.
    """
    network, drive = problem.layout.network, problem.layout.drive
    control = replace(problem.control, branch="stable")
    soft = PathProblem(Layout(_softer(network, _SOFTER[0]), drive), problem.mesh, control)
    spot = started(soft, Trail.begun(soft), follow).spot
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


def _loaded(problem: PathProblem, trail: Trail, spot: Spot, indifferent: bool, follow: Follow) -> Start:
    """Apply the constant loads and displacements to a network at rest, its springs tight."""
    solver = problem.solver
    model = assemble_model(problem.layout, solver.cut, solver.table, LOADS)
    for watch in (None,) if indifferent else (0, None):
        options = MarchOptions(solver.tolerance, _STEP, _TURN, inertia=watch, sense=1.0)
        code, points = solver.march(spot, np.array([1.0]), options, _ROOM, model)
        if code in (DONE, LONG) or (watch is None and not indifferent):
            break
        found = _along(problem, trail, LOADS, spot, follow)
        if found is not None:
            return found
    if code != DONE:
        return Start(trail, None, float(points.drive[-1]) if len(points) else 0.0, code)
    return Start(trail, Spot(points.y[-1], 0.0, spot.tangent), 1.0, DONE)


def _along(problem: PathProblem, trail: Trail, what: str, begin: Spot, follow: Follow) -> Start | None:
    """Follow the path to the prestress or the loads through its bifurcations; None where that leads nowhere."""
    control = replace(problem.control, through_folds=False, first_step=None)
    ramp = PathProblem(problem.layout, problem.mesh, control, problem.first_only, what, begin)
    way = follow(ramp, trail.branch)
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
        message = f"{lost}: {'the path ends there' if stop else 'it jumps there, no stable equilibrium is near'}"
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


def ends_of_branch(problem: PathProblem, trail: Trail, follow: Follow) -> Trail:
    """Return the path with the end of the branch that it starts on: where the straight way becomes stable again."""
    primary = PathProblem(problem.layout, problem.mesh, replace(problem.control, branch="primary"))
    spot = problem.solver.tightened() if problem.ramp else started(primary, Trail.begun(primary), follow).spot
    other = None if spot is None else problem.solver.solve(spot.y, 0.0)
    sense = problem.sense
    if other is None or other.unstable == 0:
        return trail
    from cfmkit.elastica.continuation import branch_rejoins_path

    end, closed = branch_rejoins_path.predicted_end(problem, trail, other, 0, sense, PRIMARY)
    return trail.changed(ends=(end,) if end else (), closed=closed)

"""The start of a path: springs are tightened, then everything constant is applied, along a stable branch if possible.

Prestress and constant loads may lie beyond a bifurcation. The path to them is then followed as any other is, with a
share of them in the place of the drive; what happens on it is told as happening "under prestress" or "under constant
loads", with that share.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams import branch_ends
from cfmkit.beams.discretise import LOADS, PRESTRESS, assemble_model
from cfmkit.beams.kernels.codes import DONE, LONG, SHORT, STALLED
from cfmkit.beams.layout import Layout
from cfmkit.beams.network import Network
from cfmkit.beams.path import Event, PathStatus
from cfmkit.beams.section import Taper
from cfmkit.beams.solver import Spot, march_options

if TYPE_CHECKING:
    from cfmkit.beams.branch_ends import BranchEnd
    from cfmkit.beams.run import Run

_ROOM = 400  # points on the way to the constant loads
_SOFTER = (3.0, 1.0, 0.3, 0.1)  # times as thick, with the same bending stiffness
_ENOUGH = 16  # segments of a beam with which such a way is found
_STEP, _TURN = 0.25, 0.35  # first step, as a share of them; largest change of a pose in a step


def start(run: Run) -> tuple[Spot | None, float, int]:
    """Return a place near the equilibrium that the drive starts from, or None; the share of the preload; a code.

    The code is that of a march. None with the code DONE: the path ends before it begins, as the run then says.
    """
    if run.begin is not None:
        return run.begin, 1.0, DONE
    network, indifferent = run.layout.network, run.control.branch == "primary" and not run.to_first
    spot = run.solver.tightened()
    if spot is not None and spot.shortness < SHORT:
        return None, 0.0, LONG
    if (spot is None or spot.unstable > 0) and not indifferent:
        found = _along(run, PRESTRESS, run.solver.rest())
        if found is not None and found[0] is None:
            return found
        spot = spot if found is None else found[0]
    if spot is None or not (network.loads or run.layout.held):
        return spot, float(spot is not None), DONE if spot is not None else STALLED
    found = _loaded(run, spot, indifferent)
    if found[0] is not None or found[2] in (DONE, LONG) or _stretches(run):
        return found
    near = _by_stretching(run)
    if near is not None:
        return near, 1.0, DONE
    return (None, found[1], LONG) if run.mesh.segments < _ENOUGH else found  # coarse segments hide the way


def _stretches(run: Run) -> bool:
    return all(beam.section.axial for beam in run.layout.network.beams.values())


def _by_stretching(run: Run) -> Spot | None:
    """Return a stable equilibrium under the constant loads and displacements near that of beams that stretch; or None.

    A straight beam that does not stretch has no way to where both of its ends are held closer together: its rotations
    would have to grow with the root of what is applied. One that stretches has, and then stretches less and less.
    """
    control = replace(run.control, branch="stable")
    soft = type(run)(Layout(_softer(run.layout.network, _SOFTER[0]), run.layout.drive), run.mesh, control)
    spot = start(soft)[0]
    for factor in _SOFTER[1:]:
        if spot is None:
            return None
        solver = type(run.solver)(Layout(_softer(run.layout.network, factor), run.layout.drive), run.mesh)
        spot = solver.solve(spot.y, 0.0)
    near = None if spot is None else run.solver.solve(spot.y, 0.0)
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


def _loaded(run: Run, spot: Spot, indifferent: bool) -> tuple[Spot | None, float, int]:
    """Apply the constant loads and displacements to a network at rest, its springs tight; see `start`."""
    solver = run.solver
    model = assemble_model(run.layout, solver.cut, solver.table, LOADS)
    for watch in (None,) if indifferent else (0, None):
        options = march_options(solver.tolerance, _STEP, _TURN, watch=watch, sense=1.0)
        code, points = solver.march(spot, np.array([1.0]), options, _ROOM, model)
        if code in (DONE, LONG) or (watch is None and not indifferent):
            break
        found = _along(run, LOADS, spot)
        if found is not None:
            return found
    if code != DONE:
        return None, float(points.drive[-1]) if len(points) else 0.0, code
    return Spot(points.y[-1], 0.0, spot.tangent), 1.0, DONE


def _along(run: Run, what: str, begin: Spot) -> tuple[Spot | None, float, int] | None:
    """Follow the path to the prestress or the loads through its bifurcations; None where that leads nowhere."""
    control = replace(run.control, through_folds=False, first_step=None)
    ramp = type(run)(run.layout, run.mesh, control, run.to_first, what, begin, branch=run.branch)
    ramp.closed = run.branch == "primary"
    ramp.follow()
    if ramp.too_long:
        return None, 0.0, LONG
    run.events += [Event(f"{one.kind} under {what}", one.drive, one.before, one.after) for one in ramp.events]
    if run.to_first and ramp.first is not None:
        run.ramp = ramp
        return None, 1.0, DONE
    if ramp.status is PathStatus.JUMPS and not run.control.through_folds:
        run.status, share = PathStatus.JUMPS, float(ramp.points.drive[-1])
        stop = run.control.branch == "stop"
        lost = f"stability is lost {'before' if stop else 'under'} {100 * share:.3g} % of the {what}"
        run.message = f"{lost}: {'the path ends there' if stop else 'it jumps there, no stable equilibrium is near'}"
        return None, share, DONE
    if ramp.status is not PathStatus.COMPLETE:
        ended = ramp.branch != "primary" and not run.control.through_folds
        return (None, float(ramp.points.drive[-1]), STALLED) if ended else None
    name = ramp.branches[-1]
    if name == "primary":
        run.branch = name
    elif name != run.branch:
        share = next((one.drive for one in reversed(ramp.events) if one.after > one.before), 1.0)
        run.branch = f"bifurcated under {100 * share:.4g} % of the {what}, sign {run.control.sign:+d}"
    run.closed = run.branch == "primary"
    return Spot(ramp.points.y[-1], 0.0, run.solver.unit.copy()), 1.0, DONE


def end_of_branch(run: Run) -> BranchEnd | None:
    """Return where the branch ends on which a path starts: where the straight way there becomes stable again."""
    primary = type(run)(run.layout, run.mesh, replace(run.control, branch="primary"))
    spot = run.solver.tightened() if run.ramped else start(primary)[0]
    other = None if spot is None else run.solver.solve(spot.y, 0.0)
    sense = float(np.sign(next(value for value in run.targets if value)))
    if other is None or other.unstable == 0:
        return None
    return branch_ends.end_of_branch(run, other, 0, sense, "primary")

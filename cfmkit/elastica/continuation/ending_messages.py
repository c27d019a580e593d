"""How a path ends that does not reach all requested points, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.path_and_moves import Stop
from cfmkit.elastica.kernels.status_codes import FULL, LONG, OUTSIDE
from cfmkit.elastica.outcome.path import PathStatus

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.path_and_moves import PathProblem, Trail

_NO_START = (
    "no equilibrium to start from: lost at {:.3g} of the constant loads and displacements; "
    "or nothing holds the network, the drive cannot move it, or its springs are prestressed too far"
)
_RIGID = "the drive cannot move the network from rest: it is rigid, or nothing holds the network"
_CRITICAL = (
    "no equilibrium to start from: the constant loads and displacements are just critical, or too large for the mesh; "
    "or nothing holds the network, or its springs are prestressed too far"
)
_SINGULAR = 1e10  # condition of a tangent that is singular but for rounding


def without_start(problem: PathProblem, trail: Trail, share: float) -> Trail:
    """Return a path without any point, and why; `share` of the constant loads was reached."""
    text = _CRITICAL if share == 1.0 else _NO_START.format(share)
    return trail.stopped(PathStatus.NO_START, text if _loaded(problem) else _RIGID, trail.ending.too_long)


def _loaded(problem: PathProblem) -> bool:
    """Tell whether anything is done to a network before the drive begins."""
    network = problem.layout.network
    return bool(network.loads or problem.layout.held or network.springs)


def stop(problem: PathProblem, trail: Trail, code: int) -> Stop:
    """Stop where a march ended early."""
    return Stop(_stopped(problem, trail, code))


def too_long_to_look_into(trail: Trail, unit: float) -> Stop:
    """Stop where stability is lost, or no step leads on, and the beams have too many segments to see what it is."""
    where = f"at {trail.drive * unit:.6g}" if len(trail.points) else "at rest"
    message = (
        f"the tension in a beam is so high {where} that the kind of instability cannot be determined: the beam is too "
        "slender"
    )
    return Stop(trail.stopped(PathStatus.LOST, message))


def _stopped(problem: PathProblem, trail: Trail, code: int) -> Trail:
    where = f"at {trail.drive * problem.unit:.6g}" if len(trail.points) else "at rest"
    if code == LONG:
        return trail.stopped(PathStatus.LOST, f"a segment is too long for its load {where}", too_long=True)
    if code == FULL:
        return trail.stopped(PathStatus.FULL, f"stopped after {len(trail.points)} points {where}")
    if code == OUTSIDE:
        return trail.stopped(PathStatus.OUTSIDE, f"the drive left its range {where}")
    if len(trail.points) == 1 and _rigid(trail):
        text = _CRITICAL if _loaded(problem) else _RIGID
        return trail.up_to(-1).stopped(PathStatus.NO_START, text)
    if not trail.stretch.natural:
        return trail.stopped(PathStatus.LOST, f"no step converged {where}")
    message = f"the drive cannot go on {where}: a limit point, or a turn too sharp to follow"
    if not problem.control.through_folds:
        message += "; follow the path by its arc length (through_folds)"
    return trail.stopped(PathStatus.LIMIT_POINT, message)


def _rigid(trail: Trail) -> bool:
    """Tell whether the only point, where the path starts, has a singular tangent."""
    tangent, _ = trail.solver.tangent_at(trail.points.y[0], trail.drive)
    return not np.linalg.cond(tangent) < _SINGULAR


def inaccurate(problem: PathProblem, trail: Trail, error: float, count: int) -> Trail:
    """Return the path with a word about its error; its status stays if that says already why the path ended."""
    share = f"{count} of {len(trail.points)} points"
    text = f"the tolerance of {problem.control.tolerance:.3g} was not reached: error {error:.3g}, {share}"
    if trail.ending.status is PathStatus.COMPLETE:
        return trail.stopped(PathStatus.INACCURATE, text)
    return trail.changed(ending=trail.ending._replace(message=f"{trail.ending.message}; {text}"))

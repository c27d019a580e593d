"""How a path ends that does not reach all points asked for, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.kernels.codes import FULL, LONG, OUTSIDE
from cfmkit.beams.path import PathStatus

if TYPE_CHECKING:
    from cfmkit.beams.run import Run

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


def no_start(run: Run, share: float) -> None:
    """Set the status of a path without any point; `share` of the constant loads was reached."""
    text = _CRITICAL if share == 1.0 else _NO_START.format(share)
    run.status, run.message = PathStatus.NO_START, text if _loaded(run) else _RIGID


def _loaded(run: Run) -> bool:
    """Tell whether anything is done to a network before the drive begins."""
    network = run.layout.network
    return bool(network.loads or run.layout.held or network.springs)


def stop(run: Run, code: int) -> None:
    """Set the status of a march that ended early."""
    where = f"at {float(run.points.drive[-1]) * run.unit:.6g}" if len(run.points) else "at rest"
    if code == LONG:
        run.too_long = True
        run.status, run.message = PathStatus.LOST, f"a segment is too long for its load {where}"
    elif code == FULL:
        run.status, run.message = PathStatus.FULL, f"stopped after {len(run.points)} points {where}"
    elif code == OUTSIDE:
        run.status, run.message = PathStatus.OUTSIDE, f"the drive left its range {where}"
    elif len(run.points) == 1 and _rigid(run):
        run.drop_last()
        run.status, run.message = PathStatus.NO_START, _CRITICAL if _loaded(run) else _RIGID
    elif run.natural:
        run.status = PathStatus.LIMIT_POINT
        run.message = f"the drive cannot go on {where}: a limit point, or a turn too sharp to follow"
        if not run.control.through_folds:
            run.message += "; follow the path by its arc length (through_folds)"
    else:
        run.status, run.message = PathStatus.LOST, f"no step converged {where}"


def _rigid(run: Run) -> bool:
    """Tell whether the only point, where the path starts, has a singular tangent."""
    tangent, _ = run.solver.tangent_at(run.points.y[0], float(run.points.drive[0]))
    return not np.linalg.cond(tangent) < _SINGULAR


def inaccurate(run: Run, count: int) -> None:
    """Say so in the message, and in the status unless that already says why the path ended."""
    limit = run.control.tolerance
    share = f"{count} of {len(run.points)} points"
    text = f"the tolerance of {limit:.3g} was not reached: error {run.error:.3g}, {share}"
    if run.status is PathStatus.COMPLETE:
        run.status, run.message = PathStatus.INACCURATE, text
    else:
        run.message = f"{run.message}; {text}"

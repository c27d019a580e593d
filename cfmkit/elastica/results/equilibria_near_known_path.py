"""Equilibria of a network that differs little from one with a known path: each is solved from the known equilibrium.

For the next design of an optimiser, and for branches that cannot be reached from rest. A point that moved too far, or
is less stable than the known one, counts as not found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.discretise import discretise, make_inextensible
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.results.path import EquilibriumPath, PathStatus
from cfmkit.errors import InputError
from cfmkit.numerics.dual_array import COMPLEX_STEP

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network


def solve_near_known_path(
    path: EquilibriumPath, network: Network, drive: Drive, largest_turn: float = 0.5
) -> EquilibriumPath:
    """Return the equilibria of `network` nearest to those of a path, on its elements, one for each point of the drive.

    The path is of a network with the same nodes, beams, corners and stations; its requested points are those of the
    drive, one by one. A rotation changes by at most `largest_turn` [rad], a position by as many mean beam lengths. The
    status is LOST, with the first place, if any is missing. Raises InputError if the networks are not of one kind, or
    the numbers of points differ.
    """
    known_points, mesh = path.at_requested, path.mesh
    arrays = discretise(network, drive, mesh.degree, mesh.pieces, mesh.tension, mesh.scales)
    arrays = make_inextensible(arrays, np.flatnonzero(arrays.floored & ~mesh.floored))
    if not np.array_equal(arrays.free, path.mesh.free) or len(known_points) != len(drive.points):
        raise InputError("neighbouring equilibria need networks of the same kind and as many points as were reached")
    system, moves = equations(arrays), arrays.free < arrays.n_motions
    guesses, wanted = path.free[known_points], drive.points / arrays.scales.drive
    kept, states = [], []
    for number, (guess, wanted_drive) in enumerate(zip(guesses, wanted.tolist(), strict=True)):
        state = system.solve(guess, wanted_drive)
        if state is None or state.unstable > int(path.unstable[known_points[number]]):
            continue
        if float(np.abs((state.x - guess)[moves]).max(initial=0.0)) <= largest_turn:
            kept.append(number)
            states.append(state.x)
    status, message = PathStatus.COMPLETE, PathStatus.COMPLETE.value
    missing = sorted({*range(len(wanted))} - {*kept})
    if missing:
        status, message = PathStatus.LOST, f"no equilibrium near the known one at {drive.points[missing[0]]:.6g}"
    z: Any = arrays.base + wanted[kept, None] * arrays.rate
    z[:, arrays.free] = np.array(states).reshape(len(kept), len(arrays.free))
    return EquilibriumPath(
        network, drive, Equilibria(arrays, z, wanted[kept]),
        unstable=read_only(path.unstable[known_points[kept]], np.int64),
        requested=read_only(kept, np.int64),
        branch=read_only(np.repeat("neighbour", len(kept)), np.str_),
        status=status, message=message, events=(), error=path.error,
        accurate=read_only(np.ones(len(kept), dtype=bool), np.bool_),
    )  # fmt: skip


def drive_slope(
    path: EquilibriumPath,  # under a displacement or rotation of a node
    indices: Any = None,  # points; all those requested by default
) -> FloatArray:
    """Return the derivative of the effort by the drive at points of a path [N/m, or N m/rad].

    Raises InputError if loads drive, or a point is not an equilibrium.
    """
    if isinstance(path.load_case, Loading):
        raise InputError("the slope of the effort needs a displacement or a rotation as the drive")
    mesh, slopes = path.mesh, []
    system, unit = equations(mesh), mesh.scales.moment / mesh.scales.drive**2
    for index in (path.at_requested if indices is None else np.asarray(indices)).tolist():
        drive = float(path.at.drive[index])
        state = system.solve(path.free[index], drive)
        if state is None:
            raise InputError("the slope of the effort needs converged points")
        moved = state.x + 1j * COMPLEX_STEP * state.rate
        slopes.append(float(system.gradient(moved, drive + 1j * COMPLEX_STEP).imag @ mesh.rate) / COMPLEX_STEP)
    return read_only(np.array(slopes) * unit)

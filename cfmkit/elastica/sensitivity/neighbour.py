"""Equilibria of a network that differs little from one whose path is known: solved from there, not from rest.

An optimiser's next design, or a branch that cannot be reached from rest, is found this way. Every point is judged by
itself: what moved too far, or is less stable, counts as not found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.equilibrium.network_solver import Points, Solver
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.elastica.outcome.path import Path, PathStatus
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.model.network_under_drive import Scales


def neighbouring(path: Path, network: Network, drive: Drive, largest_turn: float = 0.5) -> Path:
    """Return the equilibria of `network` nearest to those of a path, one for each point of the drive.

    Parameters
    ----------
    path : Path
        Of a network with the same nodes, beams, corners and stations; its requested points correspond to those of
        the drive, one by one.
    network : Network
        The other network.
    drive : Displacement, Rotation or Loading
        As many points as were requested and reached.
    largest_turn : float
        Largest change of a rotation, or of a position in mean beam lengths, from the known point [rad].

    Returns
    -------
    Path
        The points found, on the mesh of the known path. LOST, with the first place, if any is missing.

    Raises
    ------
    cfmkit.errors.InputError
        If the two networks are not of one kind, or the numbers of points differ.
    """
    solver = Solver(Layout(network, drive), path.solver.mesh, path.solver.tolerance)
    known, wanted = path.at_requested, drive.points
    if solver.size != path.solver.size or len(known) != len(wanted):
        raise InputError("neighbouring equilibria need networks of the same kind and as many points as were reached")
    factors = _factors(path.solver, path.layout.scales, solver.layout.scales)
    rows: list[Points] = []
    missing: list[float] = []
    for number, (index, value) in enumerate(zip(known.tolist(), wanted.tolist(), strict=True)):
        guess = path.points.y[index] * factors
        spot = solver.solve(guess.copy(), value / solver.layout.scales.drive)
        near = spot is not None and solver.pose_change(spot.y, guess) <= largest_turn
        # a segment beyond its own critical length (shortness below zero) counts its unstable directions wrongly
        if spot is None or not near or not spot.shortness > 0 or spot.unstable > int(path.points.unstable[index]):
            missing.append(value)
            continue
        rows.append(Points.of(spot, number))
    return _path(solver, rows, missing, path)


def drive_slope(path: Path, indices: Any = None) -> FloatArray:
    """Return the derivative of the effort by the drive at points of a path [N/m, or N m/rad].

    Parameters
    ----------
    path : Path
        Under a displacement or rotation of a node that carries only far ends of beams.
    indices : sequence of int, optional
        Points; all those requested by default.

    Raises
    ------
    cfmkit.errors.InputError
        If anything but far ends of beams is joined to the driven node.
    """
    solver, layout = path.solver, path.layout
    if layout.driven is None:
        raise InputError("the slope of the effort needs a displacement or a rotation as the drive")
    dof, sense = layout.driven
    beams = _ends_at(path, dof)
    frame, local = layout.direction[layout.drive.node], dof % 3  # type: ignore[union-attr]
    c, s = np.cos(frame), np.sin(frame)
    pick = np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)][local])
    unit = (layout.scales.moment if local == 2 else layout.scales.force) / layout.scales.drive
    chosen = path.at_requested if indices is None else np.asarray(indices)
    slopes = []
    for index in chosen.tolist():
        spot = solver.solve(path.points.y[index], float(path.points.drive[index]))
        if spot is None:
            raise InputError("the slope of the effort needs converged points")
        z = spot.tangent[solver.n_free : solver.n].reshape(-1, 3)
        slopes.append(sense * unit * float(sum(pick @ z[beam] for beam in beams)))
    return read_only(slopes)


def _ends_at(path: Path, dof: int) -> list[int]:
    """Return the beams whose last end is the driven node; nothing else may hang on it."""
    layout = path.layout
    found = []
    for number, (first, last) in enumerate(layout.beam_end.tolist()):
        if dof in layout.places.dof[first]:
            raise InputError("the slope of the effort needs the beam to end, not to begin, at the driven node")
        if dof in layout.places.dof[last]:
            found.append(number)
    if layout.spring_rows or any(np.any(np.real(layout.places.arm[int(layout.beam_end[k, 1])])) for k in found):
        raise InputError("the slope of the effort is not available with springs, or with arms at the driven node")
    return found


def _factors(solver: Solver, old: Scales, new: Scales) -> FloatArray:
    """Return what the dimensionless unknowns of one network are multiplied with for another."""
    length, force, moment = old.length / new.length, old.force / new.force, old.moment / new.moment
    factors = np.ones(solver.size)
    slots = solver.model.slot
    for first in range(0, 3 * len(solver.layout.masters), 3):
        for dof in (first, first + 1):
            if slots[dof] >= 0:
                factors[slots[dof]] = length
    factors[solver.n_free : solver.n] = np.tile([force, force, moment], solver.n_beams)
    factors[solver.n :] = np.tile([length, length, 1.0, force, force, moment], solver.n_segments)
    return factors


def _path(solver: Solver, rows: list[Points], missing: list[float], known: Path) -> Path:
    """Return the points as a path."""
    points = Points.none(solver.size).joined(*rows)
    status, message = PathStatus.COMPLETE, PathStatus.COMPLETE.value
    if missing:
        status, message = PathStatus.LOST, f"no equilibrium near the known one at {missing[0]:.6g}"
    return Path(
        solver=solver,
        points=points,
        branch=np.array(["neighbour"] * len(rows), dtype=np.str_),
        status=status,
        message=message,
        events=(),
        error=known.error,
        accurate=read_only(np.ones(len(rows), dtype=bool), np.bool_),
    )

"""The error of a path on its functional: the same equilibria with a higher degree."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.elastica.mechanics.refine import embed, n_end_motions
from cfmkit.elastica.results.path import largest_force, work_with_drive
from cfmkit.numerics.continuation.problem import PathEquilibrium

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.results.path import Path

DEGREES_MORE = 4
MAX_POINTS = 6  # at which the degree is raised
BESIDE_EVENT = 5e-3  # share of the range around an event within which everything is a root
ERROR_SAFETY = 1.5
ROUNDING_ERROR = 1e-13
ROUNDING = float(np.finfo(float).eps)
ROUNDED_PLACES = 4.0  # roundings of a place by which a nearly rigid network's effort is uncertain
CRITICAL_STIFFNESS = 1e-6  # stiffness of a mode, EI / L, below which rounding decides whether it is stable
NEXT_CORRECTION = 1e-10  # square of a correction on the finer mesh from which on it is the last
SAME_POINT = 1e-3  # motion by which a point may be improved
MAX_CHANGE = 0.3  # of a motion: beyond it is another equilibrium
NO_FORCE = 1e-6  # largest force, EI/L^2, over the largest motion, that is none; effort, over both
SMALL_MOTION = 1e-3  # largest motion up to which errors of motions are relative to this


def point_errors(path: Path, finer: Discretisation, indices: Sequence[int]) -> FloatArray:
    """Return the estimated errors of efforts, reactions and motions of nodes at points, relative to the largest ones.

    `finer` is the path's network with a degree that is `DEGREES_MORE` higher. Infinite where it has no equilibrium
    nearby, or one of another stability.
    """
    if not len(path) or not len(indices):
        return np.zeros(len(indices))
    chosen, own, mesh = list(indices), path.at, path.mesh
    problem, z, drives = NetworkProblem(finer), own.z[chosen], own.drive[chosen]
    n_bodies, guesses = n_end_motions(mesh), embed(mesh, finer, z)
    solved = problem.equations.solve_each(guesses[:, finer.free], drives, NEXT_CORRECTION, quick=True)
    states = guesses.copy()
    states[:, finer.free] = np.where(solved.converged[:, None], solved.free, guesses[:, finer.free])
    moved = np.abs(states[:, : finer.n_motions] - guesses[:, : finer.n_motions]).max(axis=1)
    known = solved.converged & (moved <= MAX_CHANGE)
    for row in np.flatnonzero(known & (solved.unstable != path.unstable[chosen])):
        at = PathEquilibrium(solved.free[row], float(drives[row]), solved.rate[row], int(solved.unstable[row]))
        known[row] = abs(float(problem.modes(at, 1)[0][0])) < CRITICAL_STIFFNESS
    fine, coarse = Equilibria(finer, states, drives), Equilibria(mesh, z, drives)
    efforts: Any = np.abs(work_with_drive(fine, path.load_case) - path.effort[chosen])
    forces: Any = np.abs(fine.residual[:, :n_bodies] - coarse.residual[:, :n_bodies]).max(axis=1)
    moves: Any = np.abs(states[:, :n_bodies] - z[:, :n_bodies]).max(axis=1)
    reach = float(np.abs(own.z[:, :n_bodies]).max())
    load = max(largest_force(fine), NO_FORCE * reach, ROUNDING_ERROR)
    size = max(float(np.abs(path.effort).max()), NO_FORCE * max(load, reach) * mesh.scales.moment / mesh.scales.drive)
    reach = max(reach, SMALL_MOTION)
    bearing = np.maximum(efforts / size, forces / load) - ROUNDED_PLACES * _rises(path)[chosen] / size
    relative = np.maximum(bearing, moves / reach)
    return np.where(known, ERROR_SAFETY * relative + ROUNDING_ERROR, np.inf)


def _rises(path: Path) -> FloatArray:
    """Return by how much the effort changes at every point while the drive does by one rounding of a length of one."""
    drive, effort, slope = path.at.drive, path.effort, np.zeros(len(path) + 1)
    change = np.abs(drive[1:] - drive[:-1])
    np.divide(np.abs(effort[1:] - effort[:-1]), change, out=slope[1:-1], where=change > 0)
    return np.maximum(slope[1:], slope[:-1]) * ROUNDING


def polish(path: Path) -> Path:
    """Return the path with Newton's method repeated at every point.

    A march leaves it when the next correction would be small if it converged quadratically: beside a bifurcation it
    does not.
    """
    mesh, z = path.mesh, path.at.z.copy()
    own = z[:, mesh.free]
    solved = NetworkProblem(mesh).equations.solve_each(own, path.at.drive)
    count = int((mesh.free < mesh.n_motions).sum())
    near = solved.converged & (np.abs(solved.free[:, :count] - own[:, :count]).max(axis=1, initial=0.0) < SAME_POINT)
    z[:, mesh.free] = np.where(near[:, None], solved.free, own)
    return replace(path, at=replace(path.at, z=z))


def pick_points(path: Path, places: Sequence[float]) -> list[int]:
    """Return the indices of the points at which the error of a path is estimated, none at events at these drives."""
    if not len(path):
        return []
    at = path.at_requested if len(path.at_requested) else np.arange(len(path))
    chosen = {int(at[np.abs(path.effort[at]).argmax()]), int(at[-1])}
    if len(at) <= MAX_POINTS:
        chosen.update(at.tolist())
    else:
        highest = path.at.z[at][:, path.mesh.elements.unknowns[:, -4:-2].ravel()]
        left = np.abs(highest).max(axis=1)  # what the last polynomials say: the next may be as large
        bounds = [len(at) * k // (MAX_POINTS - 2) for k in range(MAX_POINTS - 1)]
        chosen.update(int(at[a + left[a:b].argmax()]) for a, b in itertools.pairwise(bounds))
    if not places:
        return sorted(chosen)
    width = BESIDE_EVENT * float(np.ptp(np.append(path.drive, 0.0)))
    return sorted(k for k in chosen if all(abs(path.drive[k] - place) >= width for place in places))

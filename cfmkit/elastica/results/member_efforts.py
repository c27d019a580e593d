"""Numerical error of the effort of a drive, and the contributions of single beams and springs to it along a path.

The nodes do work on a member while the path goes on: on a beam with the forces on its two ends, on a spring by the
change of its energy. Per unit of the drive's motion that is the member's effort; those of all members together, less
what the loads do, are the effort of the drive.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.moving_elements import with_places
from cfmkit.elastica.mechanics.terms import ENERGY_TERMS
from cfmkit.elastica.results.path import largest_force
from cfmkit.results import ROUND_OFF

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.path import EquilibriumPath

DIFFERENCE_STEP = 1e-6  # of the largest unknown along the path, to either side: the motion's difference is off by 1e-10
PLACE_ROUNDING = 30 * np.finfo(float).eps  # of the length of a network, with room


def effort_error(
    path: EquilibriumPath,  # with points
    tolerance: float,  # that its accurate points reach, relative to the largest force [1]
) -> float:
    """Return the numerical error of a path's effort [N or N m] under a drive by a motion.

    That is the estimated error of the forces, or `ROUND_OFF` of the largest force in the network, and what rounding of
    places makes of the effort. A gap at an end of an element changes the effort as the drive changes the force on that
    end (both are a second derivative of the energy). The mean of that along the path counts, at least a unit.
    """
    scales = path.mesh.scales
    error = max(min(path.error, tolerance), ROUND_OFF) * largest_force(path.at)
    error += PLACE_ROUNDING * max(1.0, _mean_force_rate(path))
    return error * scales.moment / scales.drive


def _mean_force_rate(path: EquilibriumPath) -> float:
    """Return the largest mean change of the force on an end of an element per motion of the drive, dimensionless."""
    forces, motion = path.at.z[:, path.mesh.elements.unknowns[:, -2:]], np.abs(np.diff(path.at.drive)).sum()
    return float(np.abs(np.diff(forces, axis=0)).sum(axis=0).max(initial=0.0) / motion) if motion > 0 else 0.0


def largest_member_efforts(
    path: EquilibriumPath,  # the equilibria
    points: Any,  # (k,) int: indices of points
    # returns the motion of the drive at the points of a path, (k,) [m or rad]
    motion: Callable[[EquilibriumPath], FloatArray],
) -> FloatArray:
    """Return the largest effort of one beam or spring at points of a path, (k,) [N or N m]."""
    chosen_path = path.take(points)
    free, drive = _ways(chosen_path)
    ahead, behind = (
        chosen_path.with_states(
            np.arange(len(chosen_path)), chosen_path.free + step * free, chosen_path.at.drive + step * drive
        )
        for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP)
    )
    with np.errstate(all="ignore"):
        efforts = _member_works(chosen_path, free, drive) / ((motion(ahead) - motion(behind)) / (2 * DIFFERENCE_STEP))
    sizes = np.abs(efforts)
    return np.asarray(sizes.max(axis=0, initial=0.0, where=np.isfinite(sizes)))


def _ways(path: EquilibriumPath) -> tuple[FloatArray, FloatArray]:
    """Return the directions of a path at its points, (n, free) and (n,): their largest motion or drive is one."""
    system, moves = equations(path.mesh), path.mesh.free < path.mesh.n_motions
    solved = system.solve_each(path.free, path.at.drive, quick=True)
    rates = solved.rate.copy()
    for k in np.flatnonzero(~solved.converged):  # at a bifurcation, or where a force is open
        equation = system.linearise(path.free[k], float(path.at.drive[k]))
        rates[k] = np.linalg.lstsq(equation.tangent, -equation.change)[0]
    size = np.maximum(1.0, np.abs(rates[:, moves]).max(axis=1, initial=0.0))
    return rates / size[:, None], 1.0 / size


def _member_works(path: EquilibriumPath, free: FloatArray, drive: FloatArray) -> FloatArray:
    """Return the work done on each beam, then on each spring, for a unit step of the way, (members, points) [J].

    The gradient of a member's own energy times the motion of its ends: inside a beam it is in equilibrium.
    """
    mesh, names = path.mesh, list(path.network.beams)
    z = drive[:, None] * mesh.rate
    z[:, mesh.free] = free
    works = np.zeros((len(names) + len(mesh.springs), len(path)))
    beam = np.array([names.index(name) for name in mesh.elements.beam])
    for k, (state, at) in enumerate(zip(path.at.z, path.at.drive.tolist(), strict=True)):
        gradients, _ = energy.element_gradients(with_places(mesh, state), state, at, 1.0)
        np.add.at(works[:, k], beam, (gradients * z[k][mesh.elements.unknowns]).sum(axis=1))
        for number, spring in enumerate(mesh.springs):
            part = ENERGY_TERMS[type(spring.item)](mesh, spring, state, 1.0, at)
            works[len(names) + number, k] = part.gradient @ z[k][part.unknowns]
    return works * mesh.scales.moment

"""The error of a path on its functional: the same equilibria with a higher degree."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.elastica.mechanics.refine import embed
from cfmkit.elastica.results.path import largest_force
from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.problem import largest_motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.results.path import Path

DEGREES_MORE = 4
MAX_POINTS = 10  # at which the degree is raised
BESIDE_EVENT = 5e-3  # share of the range around an event within which everything is a root
SAFETY = 1.5
ROUNDING = 1e-13
CRITICAL = 1e-6  # stiffness of a mode, EI / L, below which rounding decides whether it is stable
SAME_POINT = 1e-3  # motion by which a point may be improved
MAX_CHANGE = 0.3  # of a motion: beyond it is another equilibrium
NO_FORCE, NO_EFFORT = 1e-12, 1e-6  # largest force, and effort as a share of it, that are none; dimensionless
SMALL_MOTION = 1e-3  # largest motion up to which errors of motions are relative to this


def point_errors(path: Path, finer: Discretisation, indices: Sequence[int]) -> FloatArray:
    """Return the estimated errors of efforts, reactions and motions of nodes at points, relative to the largest ones.

    `finer` is the path's network with a degree that is `DEGREES_MORE` higher. Infinite where it has no equilibrium
    nearby, or one of another stability.
    """
    if not len(path) or not len(indices):
        return np.zeros(len(indices))
    problem, scales = NetworkProblem(finer), path.network.scales
    n_bodies = int(path.network.elements.unknowns[:, 8].min())
    guesses = embed(path.network, finer, path.at.z[list(indices)])
    states, known = guesses.copy(), np.ones(len(indices), bool)
    for row, index in enumerate(indices):
        guess, drive = guesses[row, finer.free], float(path.at.drive[index])
        near = correct(problem, guess, drive)
        if near is None or largest_motion(problem, near.x - guess) > MAX_CHANGE:
            known[row] = False
            continue
        states[row, finer.free] = near.x
        if near.unstable != path.unstable[index]:
            known[row] = abs(float(problem.modes(near, 1)[0][0])) < CRITICAL
    at = Equilibria(finer, states, path.at.drive[list(indices)])
    fine = replace(path, at=at)
    efforts: Any = np.abs(fine.effort - path.effort[list(indices)])
    forces: Any = np.abs(fine.residual[:, :n_bodies] - path.residual[list(indices), :n_bodies]).max(axis=1)
    moves: Any = np.abs(states[:, :n_bodies] - path.at.z[list(indices), :n_bodies]).max(axis=1)
    load = max(largest_force(path.at), NO_FORCE)
    size = max(float(np.abs(path.effort).max()), NO_EFFORT * load * scales.moment / scales.drive)
    reach = max(float(np.abs(path.at.z[:, :n_bodies]).max()), SMALL_MOTION)
    relative = np.max([efforts / size, moves / reach, forces / load], axis=0)
    return np.where(known, SAFETY * relative + ROUNDING, np.inf)


def polish(path: Path) -> Path:
    """Return the path with Newton's method repeated at every point.

    A march leaves it when the next correction would be small if it converged quadratically: beside a bifurcation it
    does not.
    """
    problem, z = NetworkProblem(path.network), path.at.z.copy()
    free = path.network.free
    for row, drive in zip(z, path.at.drive, strict=True):
        near = correct(problem, row[free], float(drive))
        if near is not None and largest_motion(problem, near.x - row[free]) < SAME_POINT:
            row[free] = near.x
    return replace(path, at=replace(path.at, z=z))


def pick_points(path: Path) -> list[int]:
    """Return the indices of the points at which the error of a path is estimated, none beside an event."""
    if not len(path):
        return []
    at = path.at_requested if len(path.at_requested) else np.arange(len(path))
    chosen = {*at[np.linspace(0, len(at) - 1, min(len(at), MAX_POINTS - 1)).astype(int)].tolist()}
    chosen.add(int(at[np.abs(path.effort[at]).argmax()]))
    width = BESIDE_EVENT * float(np.ptp(np.append(path.drive, 0.0)))
    places = [event.drive for event in path.events]
    return sorted(k for k in chosen if all(abs(path.drive[k] - place) >= width for place in places))

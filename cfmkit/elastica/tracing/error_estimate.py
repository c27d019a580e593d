"""The error of a path on its functional: the same equilibria with a higher degree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.effort import effort
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.problem import largest_motion

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.tracing.record import TracedPath

DEGREES_MORE = 4
MAX_POINTS = 10  # at which the degree is raised
BESIDE_EVENT = 5e-3  # share of the range around an event within which everything is a root
SAFETY = 1.5
ROUNDING = 1e-13
MAX_CHANGE = 0.3  # of a motion: beyond it is another equilibrium
NO_EFFORT, NO_MOTION = 1e-12, 1e-6  # efforts and motions that are none, dimensionless


def estimate_error(path: TracedPath, finer: Discretisation) -> float:
    """Return the estimated error of efforts and motions of nodes, relative to the largest of the path.

    `finer` is the path's network with a degree that is `DEGREES_MORE` higher.
    """
    if not len(path):
        return float("nan")
    problem, coarse = NetworkProblem(finer), path.problem.network
    n_bodies = int(coarse.elements.unknowns[:, 8].min())
    largest_effort = largest_change = 0.0
    for index in _pick(path):
        point = path.points[index].at
        guess = raise_degree(coarse, finer, path.z[index])[finer.free]
        near = correct(problem, guess, point.drive)
        if near is None or largest_motion(problem, near.x - guess) > MAX_CHANGE or near.unstable != point.unstable:
            return float("inf")
        z = problem.values(near.x, near.drive)
        largest_effort = max(largest_effort, abs(effort(finer, z, near.drive) - float(path.effort[index])))
        largest_change = max(largest_change, float(np.abs(z[:n_bodies] - path.z[index, :n_bodies]).max()))
    scales = coarse.scales
    size = max(float(np.abs(path.effort).max()), NO_EFFORT * scales.moment / scales.drive)
    reach = max(float(np.abs(path.z[:, :n_bodies]).max()), NO_MOTION)
    return SAFETY * max(largest_effort / size, largest_change / reach) + ROUNDING


def raise_degree(coarse: Discretisation, fine: Discretisation, z: FloatArray) -> FloatArray:
    """Return all unknowns of a state on the same elements with a higher degree, (size,)."""
    n_bodies = int(coarse.elements.unknowns[:, 8].min())
    raised: Any = np.zeros(fine.size)
    raised[:n_bodies] = z[:n_bodies]
    old, new = coarse.elements.unknowns, fine.elements.unknowns
    raised[new[:, 8 : coarse.degree + 7]] = z[old[:, 8 : coarse.degree + 7]]
    raised[new[:, -2:]] = z[old[:, -2:]]
    return np.asarray(raised)


def _pick(path: TracedPath) -> list[int]:
    """Return the indices of the points whose error is estimated, none beside an event."""
    at = path.at_requested if len(path.at_requested) else np.arange(len(path))
    chosen = {*at[np.linspace(0, len(at) - 1, min(len(at), MAX_POINTS - 1)).astype(int)].tolist()}
    chosen.add(int(at[np.abs(path.effort[at]).argmax()]))
    width = BESIDE_EVENT * float(np.ptp(np.append(path.drive, 0.0)))
    places = [event.drive for event in path.events]
    return sorted(k for k in chosen if all(abs(path.drive[k] - place) >= width for place in places))

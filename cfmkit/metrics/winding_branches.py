"""A branch whose motion turns back, known at every place of its way: mean, extremes, and where it breaks a limit.

Between two neighbouring places of `WindingPath.ways` neither motion nor effort turns, so that each is passed once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import polynomial

from cfmkit.arrays import distinct
from cfmkit.numerics.where_condition_ends import last_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.results import WindingPath

    Interval = tuple[float, float]


_LOBATTO_NODE = 1.0 / np.sqrt(5.0)
_LOBATTO_NODES = np.array([-1.0, -_LOBATTO_NODE, _LOBATTO_NODE, 1.0])
_LOBATTO_WEIGHTS = np.array([1.0, 5.0, 5.0, 1.0]) / 6.0
"""Lobatto's rule on each step of the way: its ends are known already."""
_SLOPE_COEFFICIENTS = polynomial.polyder(np.linalg.inv(np.vander(_LOBATTO_NODES, increasing=True)), axis=0)
_NODE_DERIVATIVES = np.vander(_LOBATTO_NODES, 3, increasing=True) @ _SLOPE_COEFFICIENTS
"""Derivatives at the nodes of the cubic through values there, (node, value)."""


def reach(path: WindingPath) -> Interval:
    """Return the smallest and the largest motion."""
    motion = path.states(path.ways)[0]
    return float(motion.min()), float(motion.max())


def places_inside(path: WindingPath, low: float, high: float) -> FloatArray:
    """Return the places `ways` of a path with those where its motion enters and leaves a window, increasing."""
    ways = path.ways
    motion, ways_of_pieces = path.states(ways)[0], [ways]
    for level in (low, high):
        at = np.flatnonzero((motion[1:] - level) * (motion[:-1] - level) < 0)
        sense = np.sign(motion[at + 1] - motion[at])[:, None]

        def measure_excess(
            places: FloatArray, ends: NDArray[np.intp], sense: FloatArray = sense, level: float = level
        ) -> FloatArray:
            return np.asarray(sense[ends] * (path.states(places)[0] - level) / (high - low))

        ways_of_pieces.append(last_places(measure_excess, ways[at][:, None], ways[at + 1][:, None]).ravel())
    return distinct(np.concatenate(ways_of_pieces))


def mean(path: WindingPath, low: float, high: float) -> float:
    """Return the mean effort over the way in a window, each bit of motion counted in whichever direction it goes."""
    ways = places_inside(path, low, high)
    middle, half = 0.5 * (ways[1:] + ways[:-1]), 0.5 * (ways[1:] - ways[:-1])
    motion, effort = path.states(middle[:, None] + half[:, None] * _LOBATTO_NODES)
    centre = 0.5 * (motion[:, 0] + motion[:, -1])
    within = (centre > low) & (centre < high)
    moved = np.abs(motion @ _NODE_DERIVATIVES.T)[within] * _LOBATTO_WEIGHTS
    return float((effort[within] * moved).sum() / moved.sum())


def extremes(path: WindingPath, low: float, high: float) -> tuple[float, float]:
    """Return the largest and the smallest effort in a window."""
    return _largest_and_smallest(path, low, high, path.states(places_inside(path, low, high))[1])


def stress_extremes(path: WindingPath, low: float, high: float) -> tuple[float, float]:
    """Return the largest and the smallest stress in a window [Pa]."""
    return _largest_and_smallest(path, low, high, path.stress(places_inside(path, low, high)))


def _largest_and_smallest(path: WindingPath, low: float, high: float, values: FloatArray) -> tuple[float, float]:
    motion = path.states(places_inside(path, low, high))[0]
    slack = 1e-9 * float(np.ptp(motion))
    kept = values[(motion >= low - slack) & (motion <= high + slack)]
    return float(kept.max()), float(kept.min())


def list_broken_intervals(path: WindingPath, height: Callable[[FloatArray], FloatArray]) -> list[Interval]:
    """Return the intervals of the motion over which a height, of places of the way, is positive or no number."""
    ways = path.ways
    bad = ~(height(ways) <= 0)
    if not bad.any():
        return []
    edges = np.flatnonzero(bad[1:] != bad[:-1])
    good, spoilt = edges + bad[edges], edges + ~bad[edges]
    ends = last_places(lambda at, _ends: height(at), ways[good][:, None], ways[spoilt][:, None]).ravel()
    motion, of_ends = path.states(ways)[0], path.states(ends)[0]
    numbers = np.arange(len(edges))
    branches = []
    for number, run in enumerate(np.split(np.arange(len(ways)), edges + 1)):
        if bad[run[0]]:
            around = [of_ends[k] for k in (number - 1, number) if k in numbers]
            motions = [*motion[run].tolist(), *around]
            branches.append((float(min(motions)), float(max(motions))))
    return branches

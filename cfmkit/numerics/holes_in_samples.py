"""Holes in measured samples, and the length that each sample represents in an average over the travel.

Samples are spaced as machine and clock put them, so each must be weighted by the length that it represents. A hole is a
step to the next sample that is far longer than is usual there: nothing is known of what lies in it. For recordings,
measured profiles and surfaces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

MAX_HOLE_SHARE = 0.02  # largest hole, as a share of the window, with which a value over the window is still known
HOLE_STEP_RATIO = 3.0
"""Longest step that is no hole, in usual steps: one or two outliers that were removed do not leave a hole."""
N_NEIGHBOUR_STEPS = 10
"""Steps to either side of one from which the usual step there is taken, since recorders may change their step."""
STEP_PERCENTILE = 80.0  # percentile of those that is the usual step: up to four long ones among 21 do not raise it


def usual_steps(places: FloatArray) -> FloatArray:
    """Return the usual step around each step, (n - 1,), between (n,) places in increasing order [m or rad]."""
    from scipy.ndimage import percentile_filter

    steps = np.diff(places)
    if len(steps) <= 2 * N_NEIGHBOUR_STEPS:
        return np.full(len(steps), np.percentile(steps, STEP_PERCENTILE) if len(steps) else 0.0)
    return np.asarray(percentile_filter(steps, STEP_PERCENTILE, 2 * N_NEIGHBOUR_STEPS + 1, mode="reflect"))


def is_hole_after(places: FloatArray) -> NDArray[np.bool_]:
    """Return after which of (n,) places in increasing order there is a hole, (n - 1,)."""
    distinct, last = np.unique(places[::-1], return_index=True)
    is_hole = np.zeros(max(len(places) - 1, 0), dtype=bool)
    steps = np.diff(distinct)
    is_hole[len(places) - 1 - last[:-1]] = steps > HOLE_STEP_RATIO * usual_steps(distinct)
    return is_hole


def holes_between(places: FloatArray, low: float, high: float) -> list[tuple[float, float]]:
    """Return the holes between places in increasing order, cut to low..high; none outside of the places."""
    after = np.flatnonzero(is_hole_after(places))
    ends = zip(places[after].tolist(), places[after + 1].tolist(), strict=True)
    inside = [(max(start, low), min(stop, high)) for start, stop in ends]
    return [(start, stop) for start, stop in inside if start < stop]


def sample_weights(
    places: FloatArray,  # (n,): in increasing order [m or rad]
) -> FloatArray:
    """Return the length that each sample represents, half of each step beside it, (n,); holes count as usual steps."""
    steps = np.diff(places)
    weights = np.zeros(len(places))
    if len(steps):
        steps = np.where(is_hole_after(places), np.minimum(steps, usual_steps(places)), steps)
        weights[1:] += 0.5 * steps
        weights[:-1] += 0.5 * steps
    return weights

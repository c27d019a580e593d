"""Holes in samples along a way, and the way that each sample stands for.

Samples stand where machine and clock put them. A mean over them is a mean over the way only if each counts for the way
that it stands for. Where the way to the next sample is far longer than is usual there, nothing is known of what lies
between: a hole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

LARGEST_HOLE = 0.02
"""Part of the window: with a larger hole in it no number over the window can be known."""

HOLE_STEP_RATIO = 3.0
"""Samples that are farther apart than so many usual steps leave a hole: a spike or two that are left out do not."""

N_NEIGHBOUR_STEPS = 10
"""Steps to either side of one that say what is usual there: recorders change their step on the way."""

STEP_PERCENTILE = 80.0
"""Percentile of those: of 21 steps four may be larger, as where single samples stand in a hole."""


def usual_steps(places: FloatArray) -> FloatArray:
    """Return what is usual around each step, (n - 1,), between (n,) places in increasing order [m or rad]."""
    from scipy.ndimage import percentile_filter

    steps = np.diff(places)
    if len(steps) <= 2 * N_NEIGHBOUR_STEPS:
        return np.full(len(steps), np.percentile(steps, STEP_PERCENTILE) if len(steps) else 0.0)
    found: FloatArray = percentile_filter(steps, STEP_PERCENTILE, 2 * N_NEIGHBOUR_STEPS + 1, mode="reflect")
    return found


def is_hole_after(places: FloatArray) -> NDArray[np.bool_]:
    """Return after which of (n,) places in increasing order there is a hole, (n - 1,)."""
    distinct, last = np.unique(places[::-1], return_index=True)
    found = np.zeros(max(len(places) - 1, 0), dtype=bool)
    steps = np.diff(distinct)
    found[len(places) - 1 - last[:-1]] = steps > HOLE_STEP_RATIO * usual_steps(distinct)
    return found


def holes_between(places: FloatArray, low: float, high: float) -> list[tuple[float, float]]:
    """Return the holes between places in increasing order, as far as they are between two ends."""
    after = np.flatnonzero(is_hole_after(places))
    ends = zip(places[after].tolist(), places[after + 1].tolist(), strict=True)
    inside = [(max(start, low), min(stop, high)) for start, stop in ends]
    return [(start, stop) for start, stop in inside if start < stop]


def weights(places: FloatArray) -> FloatArray:
    """Return the way that each sample stands for, half of that to each neighbour, (n,); holes count as usual steps.

    Parameters
    ----------
    places : (n,) array
        In increasing order [m or rad].
    """
    steps = np.diff(places)
    found = np.zeros(len(places))
    if len(steps):
        steps = np.where(is_hole_after(places), np.minimum(steps, usual_steps(places)), steps)
        found[1:] += 0.5 * steps
        found[:-1] += 0.5 * steps
    return found

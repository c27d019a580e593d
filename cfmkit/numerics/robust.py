"""Robust statistics: scales and weights that a few outliers do not move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.curves import FloatArray

TUKEY = 4.685
"""Where Tukey's weight falls to zero, in standard deviations: 95 % efficient for normal values."""

MAD = 1.4826
"""Standard deviation of normal values over their median absolute deviation."""


def robust_scale(values: FloatArray) -> float:
    """Return 1.4826 times the median absolute deviation from the median: the SD of normal values."""
    return MAD * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def tukey(values: FloatArray, scale: float) -> FloatArray:
    """Return Tukey's weights of values with a robust standard deviation."""
    if scale == 0:
        return np.ones_like(values)
    share = values / (TUKEY * scale)
    weights: FloatArray = np.where(np.abs(share) < 1, (1 - share**2) ** 2, 0.0)
    return weights


def neighbour_noise(places: FloatArray, values: FloatArray) -> float:
    """Return the standard deviation of noise, robustly, from each point's distance to the line through its neighbours.

    Parameters
    ----------
    places, values : (n,) array
        In any order; points at one place are left out but for the first.
    """
    places, first = np.unique(places, return_index=True)
    values = values[first]
    if len(places) < 5:
        return 0.0
    share = (places[1:-1] - places[:-2]) / (places[2:] - places[:-2])
    gaps = values[1:-1] - (1.0 - share) * values[:-2] - share * values[2:]
    return robust_scale(gaps / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2))

"""Robust statistics: scales, weights, noise and spikes of samples, which a few outliers do not move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

TUKEY_CUTOFF = 4.685  # where Tukey's weight falls to zero, in standard deviations: 95 % efficient for normal values
MAD_FACTOR = 1.4826  # standard deviation of normal values over their median absolute deviation
SPIKE_DEVIATIONS = 8.0
"""A sample is a spike where it is off the median of its neighbours by so many standard deviations of the noise."""
_MEDIAN_REACH = 3  # samples on either side that the median is of: spikes of up to three samples are seen
_MAX_SPIKE_SHARE = 0.05  # where more than this part of the samples look like spikes, that is how the signal is


def robust_scale(values: FloatArray) -> float:
    """Return 1.4826 times the median absolute deviation from the median: the SD of normal values."""
    return MAD_FACTOR * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def tukey(values: FloatArray, scale: float) -> FloatArray:
    """Return Tukey's weights of values with a robust standard deviation."""
    if scale == 0:
        return np.ones_like(values)
    share = values / (TUKEY_CUTOFF * scale)
    return np.where(np.abs(share) < 1, (1 - share**2) ** 2, 0.0)


def neighbour_noise(
    # (n,) each, in any order; of points at one place the first counts
    places: FloatArray,
    values: FloatArray,
) -> float:
    """Return the standard deviation of noise, robustly, from distances of points to the lines through neighbours."""
    places, first = np.unique(places, return_index=True)
    values = values[first]
    if len(places) < 5:
        return 0.0
    share = (places[1:-1] - places[:-2]) / (places[2:] - places[:-2])
    gaps = values[1:-1] - (1.0 - share) * values[:-2] - share * values[2:]
    return robust_scale(gaps / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2))


def spikes(
    values: FloatArray,  # (n,): in the order of time
) -> FloatArray:
    """Return how far samples stand off their neighbours as neither noise nor a smooth signal does; 0 for all others.

    A running median (Hampel's filter, seven samples) follows steps and slopes; what is off it by more
    than noise, usual steps and rounding explain is a spike. Spikes may be up to three samples long;
    the first and the last sample, which have neighbours on one side only, are none.

    References
    ----------
    F. R. Hampel, J. Am. Stat. Assoc. 69 (1974) 383-393.

    Examples
    --------
    >>> values = np.arange(30.0)
    >>> values[4] = 90.0
    >>> np.flatnonzero(spikes(values)).tolist()
    [4]
    """
    from scipy.ndimage import median_filter

    height = values - median_filter(values, 2 * _MEDIAN_REACH + 1, mode="nearest")
    off = np.abs(height)
    steps = np.abs(np.diff(values))
    low, high = np.percentile(values, (5, 95))
    limit = max(
        SPIKE_DEVIATIONS * MAD_FACTOR * float(np.median(off)),
        5.0 * float(np.percentile(off, 90)),
        # Where a smooth signal turns or jumps the median is as many steps off as there are neighbours on a side.
        2.0 * _MEDIAN_REACH * float(np.percentile(steps, 75)),
        0.005 * float(high - low),
    )
    is_spike = off > max(limit, 1e-9 * float(np.abs(values).max()))
    return np.where(is_spike & (is_spike.sum() <= _MAX_SPIKE_SHARE * len(values)), height, 0.0)

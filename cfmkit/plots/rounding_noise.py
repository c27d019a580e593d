"""Removal of rounding noise from drawings: a value that does not vary is level, a force that is not there is zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

NOISE_SHARE = 1e-9
"""Share of the size of values below which a difference of them, or one of them, is rounding: far above what
sums of a thousand terms lose (1e-13), and far below what a picture shows."""


def is_level(values: FloatArray) -> bool:
    """Return whether the finite ones of some values differ by rounding only, or there are none."""
    known = values[np.isfinite(values)]
    return not len(known) or bool(np.ptp(known) <= NOISE_SHARE * np.abs(known).max())


def remove_rounding(values: FloatArray) -> FloatArray:
    """Return values; those that differ by rounding only are all the same.

    Examples
    --------
    >>> remove_rounding(np.array([0.3, np.nan, 0.1 + 0.2])).tolist()
    [0.3, nan, 0.3]
    >>> remove_rounding(np.array([0.3, 0.31])).tolist()
    [0.3, 0.31]
    """
    if not is_level(values):
        return values
    known = np.isfinite(values)
    return np.where(known, values[known][0], values) if known.any() else values


def zero_rounding(values: FloatArray, size: float) -> FloatArray:
    """Return values, zero where they are rounding of something of that size.

    Examples
    --------
    >>> zero_rounding(np.array([1e-12, -2.0]), 5.0).tolist()
    [0.0, -2.0]
    """
    return np.where(np.abs(values) <= NOISE_SHARE * size, 0.0, values)

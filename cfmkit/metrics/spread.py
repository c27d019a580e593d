"""Mean and extremes of efforts in windows, (d,) each.

An effort whose mean is negative is judged in its own direction: the opposite sign convention gives the same ripple.
Where the mean is zero, as over a full turn, the larger extreme says the direction; a mean of rounding alone is zero.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


MEAN_RTOL = 1e-13
"""A mean that is smaller than this part of the largest effort is rounding: sums of 10 000 points stay below it."""


class Spread(NamedTuple):
    """Mean and extremes of the effort over the points in a window, times `sign` so that the mean is not negative."""

    # mean, max, min: in the effort's own direction [N or N m]
    mean: FloatArray
    max: FloatArray
    min: FloatArray
    sign: FloatArray  # 1 or -1

    @classmethod
    def from_extremes(cls, mean: FloatArray, largest: FloatArray, smallest: FloatArray, error: FloatArray) -> Spread:
        """Return the spread of efforts with this mean, these extremes and this numerical error."""
        rounding = np.maximum(MEAN_RTOL * np.maximum(np.abs(largest), np.abs(smallest)), error)
        mean = np.where(np.abs(mean) <= rounding, 0.0, mean)
        down = np.where(mean == 0, largest + smallest, mean) < 0
        high, low = np.where(down, -smallest, largest), np.where(down, -largest, smallest)
        return cls(np.abs(mean), high, low, np.where(down, -1.0, 1.0))

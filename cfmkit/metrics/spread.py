"""Mean and extremes of an effort in a window, and the metrics that follow from them: of one curve, or of many at once.

The numbers of a `Spread` are floats for one curve and (d,) arrays for many; every metric is written once, for both.
An effort whose mean is negative is judged in its own direction: the opposite sign convention gives the same ripple.
Where the mean is zero, as over a full turn, the larger extreme says the direction; a mean of rounding alone is zero.
A share of something that is not above the numerical error of the effort is NaN: rounding over rounding says nothing.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Number = Any  # a float or a (d,) array: what goes in comes out
    Pair = tuple[FloatArray, FloatArray]


MEAN_RTOL = 1e-13
"""A mean that is smaller than this part of the largest effort is rounding: sums of 10 000 points stay below it."""
EXTREME_RTOL = 1e-7
"""A sum of both extremes that is smaller than this part of their distance is what their search leaves, with room."""


class Spread(NamedTuple):
    """Mean and extremes of the effort over the points in a window, times `sign` so that the mean is not negative."""

    # mean, max, min: in the effort's own direction [N or N m]
    mean: Number
    max: Number
    min: Number
    sign: Number  # 1 or -1
    error: Number = 0.0  # numerical error of the effort [N or N m]: what is not above it is no reference

    @classmethod
    def from_extremes(cls, mean: Number, largest: Number, smallest: Number, error: Number = 0.0) -> Spread:
        """Return the spread of efforts with this mean, these extremes and this numerical error."""
        if isinstance(mean, float):
            mean = 0.0 if abs(mean) <= max(MEAN_RTOL * max(abs(largest), abs(smallest)), error) else mean
            down = (mean or largest + smallest) < 0
            high, low = (-smallest, -largest) if down else (largest, smallest)
            return cls(abs(mean), high, low, -1.0 if down else 1.0, error)
        rounding = np.maximum(MEAN_RTOL * np.maximum(np.abs(largest), np.abs(smallest)), error)
        mean = np.where(np.abs(mean) <= rounding, 0.0, mean)
        down = np.where(mean == 0, largest + smallest, mean) < 0
        high, low = np.where(down, -smallest, largest), np.where(down, -largest, smallest)
        return cls(np.abs(mean), high, low, np.where(down, -1.0, 1.0), error)


def level(summary: Spread) -> Number:
    """Return the mean effort."""
    return summary.sign * summary.mean + 0.0  # no minus before a zero


def largest(summary: Spread) -> Number:
    """Return the largest effort."""
    return _either(summary.sign > 0, summary.max, -summary.min)


def smallest(summary: Spread) -> Number:
    """Return the smallest effort."""
    return _either(summary.sign > 0, summary.min, -summary.max)


def ripple(summary: Spread) -> Number:
    """Return (max - min) / max."""
    return _share(summary.max - summary.min, summary.max, summary.error)


def half_band(summary: Spread) -> Number:
    """Return (max - min) / (max + min)."""
    width = summary.max - summary.min
    return _share(width, summary.max + summary.min, _larger(EXTREME_RTOL * width, summary.error))


def deviation_from_mean(summary: Spread) -> Number:
    """Return the largest ``|F - mean| / mean``."""
    return _share(_larger(summary.max - summary.mean, summary.mean - summary.min), summary.mean, summary.error)


def deviation_from_target(summary: Spread, target: Number) -> Number:
    """Return the largest ``|F - target| / |target|``; NaN where the target is zero."""
    away = _larger(abs(largest(summary) - target), abs(smallest(summary) - target))
    return _share(away, abs(target), summary.error)


def static_balance(summary: Spread, part: Number) -> Number:
    """Return the largest effort over the largest of one spring or member, `part`, whatever their signs."""
    return _share(_larger(abs(summary.max), abs(summary.min)), part, summary.error)


def deviation(effort: FloatArray, mean: Number) -> Number:
    """Return the sample standard deviation (n - 1) of efforts, (n,) or (d, n), about their mean."""
    offset = effort - np.asarray(mean)[..., None]
    return np.sqrt(np.einsum("...j,...j->...", offset, offset) / (effort.shape[-1] - 1))


def _either(which: Number, first: Number, second: Number) -> Number:
    if isinstance(first, float):
        return first if which else second
    return np.where(which, first, second)


def _larger(first: Number, second: Number) -> Number:
    return max(first, second) if isinstance(first, float) and isinstance(second, float) else np.maximum(first, second)


def _share(part: Number, whole: Number, error: Number) -> Number:
    if isinstance(part, float):
        return part / whole if whole > error else np.nan
    is_known = whole > error
    return np.where(is_known, part / np.where(is_known, whole, 1.0), np.nan)


class ManyWindows:
    """The efforts of one branch of many curves in a window, one row each.

    Parameters
    ----------
    motion : (n,) or (d, n) array
        Where they are [m or rad].
    effort : (d, n) array
        [N or N m].
    extremes : callable
        Returns their largest and smallest values, (d,) each, next to the samples as well; called when they are needed.
    error : (d,) array, optional
        Numerical error of the efforts [N or N m].
    points : (d,) array, optional
        How many of the efforts are of each curve; those behind repeat the last.
    """

    def __init__(
        self,
        motion: FloatArray,
        effort: FloatArray,
        extremes: Callable[[FloatArray, FloatArray], Pair],
        error: FloatArray | float = 0.0,
        points: NDArray[np.intp] | None = None,
    ):
        """Keep the efforts."""
        self.motion, self.effort, self._extremes_of, self.error = motion, effort, extremes, error
        self.points = points

    @cached_property
    def mean(self) -> FloatArray:
        """Mean effort of each curve, (d,)."""
        if self.points is None:
            return np.asarray(self.effort.mean(axis=1))
        return np.asarray(np.where(self._own, self.effort, 0.0).sum(axis=1) / self.points)

    @property
    def _own(self) -> NDArray[np.bool_]:
        """Which efforts are not repeated last ones, (d, n)."""
        return np.asarray(np.arange(self.effort.shape[1]) < np.reshape(np.asarray(self.points), (-1, 1)))

    @cached_property
    def extremes(self) -> Pair:
        """Largest and smallest effort of each curve, (d,) each."""
        return self._extremes_of(self.motion, self.effort)

    @cached_property
    def spread(self) -> Spread:
        """Mean and extremes of each curve."""
        return Spread.from_extremes(self.mean, *self.extremes, self.error)

    @property
    def deviation(self) -> FloatArray:
        """Sample standard deviation (n - 1) of each curve, (d,)."""
        if self.points is None:
            return np.asarray(deviation(self.effort, self.mean))
        offset = np.where(self._own, self.effort - self.mean[:, None], 0.0)
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / (self.points - 1)))

    @property
    def work(self) -> FloatArray:
        """Integral of the effort over the motion, (d,) [J]."""
        steps = np.diff(np.broadcast_to(self.motion, self.effort.shape), axis=1)
        return np.asarray(np.einsum("ij,ij->i", steps, 0.5 * (self.effort[:, 1:] + self.effort[:, :-1])))


STATIC_BALANCE = "static_balance"

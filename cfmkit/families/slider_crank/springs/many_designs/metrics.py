"""Flatness of many curves at once: the metrics of one curve, row by row.

A curve whose mean is negative is judged in its own direction, as everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class Spread:
    """Efforts in a window with their mean and extremes in their own direction."""

    effort: FloatArray
    mean: FloatArray
    high: FloatArray
    low: FloatArray
    sign: FloatArray


def _over(part: FloatArray, whole: FloatArray) -> FloatArray:
    return np.where(whole > 0.0, part / np.where(whole > 0.0, whole, 1.0), np.nan)


def _deviation(found: Spread) -> FloatArray:
    return _over(np.maximum(found.high - found.mean, found.mean - found.low), found.mean)


CURVE: dict[str, Callable[[Spread], FloatArray]] = {
    "mean": lambda found: found.sign * found.mean,
    "sd": lambda found: found.effort.std(axis=1, ddof=1),
    "max": lambda found: np.where(found.sign > 0, found.high, -found.low),
    "min": lambda found: np.where(found.sign > 0, found.low, -found.high),
    "ripple": lambda found: _over(found.high - found.low, found.high),
}

PLAIN: dict[str, Callable[[Spread], FloatArray]] = {
    "half_band": lambda found: _over(found.high - found.low, found.high + found.low),
    "deviation_from_mean": _deviation,
}


def of_curve(name: str, effort: FloatArray, ends: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return a metric of each row of efforts in its window, by its name with ``force_`` or ``torque_``.

    `ends` are the largest and the smallest effort of each row, (m,) each.
    """
    mean = effort.mean(axis=1)
    sign = np.where(mean < 0.0, -1.0, 1.0)
    top, bottom = ends
    high, low = np.where(sign < 0.0, -bottom, top), np.where(sign < 0.0, -top, bottom)
    function = PLAIN[name] if name in PLAIN else CURVE[name.partition("_")[2]]
    with np.errstate(divide="ignore", invalid="ignore"):
        return function(Spread(effort, np.abs(mean), high, low, sign))

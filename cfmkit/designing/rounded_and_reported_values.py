"""Values of a finished design: rounded within bounds, at a bound or not, ranges about them, metrics as analysed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics import Window, evaluate
from cfmkit.results import Quantity, Searched

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.results import Result


def round_within_bounds(values: FloatArray, bounds: FloatArray, digits: int, unit: float = 1.0) -> FloatArray:
    """Return numbers rounded to `digits` decimals of a unit, kept within their bounds (n, 2).

    Examples
    --------
    >>> round_within_bounds(np.array([0.12345, 0.98765]), np.array([[0.0, 1.0], [0.0, 0.98]]), 2)
    array([0.12, 0.98])
    """
    whole = np.round(values, digits) if unit == 1.0 else np.round(values * unit, digits) / unit
    return np.clip(whole, *bounds.T)


def find_active_bounds(
    values: FloatArray,  # (n,): the numbers
    bounds: FloatArray,  # (n, 2): lowest and highest values
    close: float,  # so near to a bound a number is at it
    share: float = 0.0,  # the same as a share of the bound, in addition
) -> NDArray[np.int_]:
    """Return at which end of its bounds each number is: -1 at the lowest, 1 at the highest, 0 between.

    Examples
    --------
    >>> find_active_bounds(np.array([0.5, 1.2, 2.0]), np.array([[0.5, 2.0]] * 3), 1e-6)
    array([-1,  0,  1])
    """
    low, high = bounds.T
    lowest, highest = (abs(values - end) <= close + share * abs(end) for end in (low, high))
    return np.where(lowest, -1, np.where(highest, 1, 0))


MAX_RELATIVE_MOVE = 0.25
"""How far a value may move from that of a design, as a share of it: twice as far one mechanism becomes another."""


def range_about(value: float, low: float | None = None, high: float | None = None) -> tuple[float, float]:
    """Return the range about the value of a design in which it may move, cut where limits are given.

    Examples
    --------
    >>> range_about(4.0), range_about(4.0, low=3.5, high=4.0)
    ((3.0, 5.0), (3.5, 4.0))
    """
    reach = MAX_RELATIVE_MOVE * abs(value)
    least, most = value - reach, value + reach
    return (least if low is None else max(least, low)), (most if high is None else min(most, high))


def measure_metrics(result: Result, window: tuple[float, float], *names: str) -> list[float | None]:
    """Return metrics [SI] that the analysis of a design measures over a window [m or rad]; None if it cannot."""
    if not result.curves:
        return [None] * len(names)
    quantities = evaluate(result, names, Window(*window))
    return [quantities[name].value for name in names]


def search_values(
    numbers: Mapping[str, tuple[float | None, str, str]],
    model: str,
    window: tuple[float, float],
    motion: str = "length",
) -> dict[str, Searched]:
    """Return what only a search knows, (value, dimension, definition) by name, with the model and window it is of."""
    return {name: Searched(Quantity(*about), model, window, motion) for name, about in numbers.items()}

"""The largest values of curves, and of what lies next to their samples: of one mechanism, or of many as rows."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.continuous_means_and_extremes import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray


def extreme_next_to(
    function: Callable[[FloatArray], FloatArray], travel: FloatArray, values: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return the largest value next to the samples that are finite, and the travel of the largest of these, (m, 1)."""
    travel, values = (np.broadcast_to(one, (count, values.shape[-1])) for one in (travel, values))
    known = np.isfinite(values)
    number = known.sum(axis=1)
    order = np.argsort(~known, axis=1, kind="stable")
    order = np.take_along_axis(order, np.minimum(np.arange(order.shape[1]), np.maximum(number - 1, 0)[:, None]), axis=1)
    travel, values = (np.take_along_axis(one, order, axis=1) for one in (travel, values))
    top, _ = extremes(function, travel, values, uneven=True, last=np.maximum(number - 1, 0))
    highest = np.argmax(np.where(np.isfinite(values), values, -np.inf), axis=1)[:, None]
    return np.where(number > 0, top, np.nan)[:, None], np.take_along_axis(travel, highest, axis=1)


def _largest(values: FloatArray) -> FloatArray:
    most = np.fmax.reduce(values, axis=-1, keepdims=True, initial=-np.inf)
    if np.isposinf(most).any():
        most = np.where(np.isfinite(values), values, -np.inf).max(axis=-1, keepdims=True, initial=-np.inf)
    return np.asarray(most)


def largest_of_each(*arrays: FloatArray) -> FloatArray:
    """Return the largest finite value of each row of all arrays, (..., 1); NaN where there is none."""
    found = reduce(np.maximum, map(_largest, arrays))
    return np.where(np.isfinite(found), found, np.nan)

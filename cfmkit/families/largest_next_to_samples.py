"""Largest values of sampled curves, also between the samples: of one mechanism, or of many, one in each row."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.continuous_means_and_extremes import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray


def extreme_next_to(
    function: Callable[[FloatArray], FloatArray], travel: FloatArray, values: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return the largest value next to the samples that are finite, and the travel of the largest of these, (m, 1)."""
    values = np.broadcast_to(values, (count, values.shape[-1]))
    travel, values, last = finite_samples(travel, values, values.shape[1] - 1)
    top, _ = extremes(function, travel, values, uneven=True, last=np.maximum(last, 0))
    highest = np.argmax(np.where(np.isfinite(values), values, -np.inf), axis=1)[:, None]
    return np.where(last >= 0, top, np.nan)[:, None], np.take_along_axis(travel, highest, axis=1)


def finite_samples(
    places: FloatArray, values: FloatArray, last: NDArray[np.intp] | int
) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
    """Return the samples of each row whose values are finite, up to its last one, and the index of the last of these.

    What follows repeats that sample; a row without any has NaN.
    """
    places = np.broadcast_to(places, values.shape)
    count = np.arange(values.shape[1])
    good = np.isfinite(values) & (count <= np.reshape(last, (-1, 1)))
    end = good.sum(axis=1) - 1
    if good.all():
        return places, values, end
    order = np.argsort(~good, axis=1, kind="stable")
    order = np.take_along_axis(order, np.minimum(count, np.maximum(end, 0)[:, None]), 1)
    places, values = (np.take_along_axis(item, order, 1) for item in (places, values))
    return places, np.where((end >= 0)[:, None], values, np.nan), end


def _largest(values: FloatArray) -> FloatArray:
    most = np.fmax.reduce(values, axis=-1, keepdims=True, initial=-np.inf)
    if np.isposinf(most).any():
        most = np.where(np.isfinite(values), values, -np.inf).max(axis=-1, keepdims=True, initial=-np.inf)
    return np.asarray(most)


def largest_of_each(*arrays: FloatArray) -> FloatArray:
    """Return the largest finite value of each row of all arrays, (..., 1); NaN where there is none."""
    largest = reduce(np.maximum, map(_largest, arrays))
    return np.where(np.isfinite(largest), largest, np.nan)

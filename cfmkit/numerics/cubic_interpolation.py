"""Between the samples of a smooth function: the cubic through the four nearest of them.

Error: the fourth power of the spacing. The first argument increases; nothing here sorts or bridges a fold.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import distinct

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray

_N_HALVINGS = 60


def value_at(x: FloatArray, y: FloatArray, place: float) -> float:
    """Return the cubic's value at one place between the first and the last sample.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 3.0, 4.0, 6.0])
    >>> round(value_at(x, x**3, 2.0), 12)
    8.0
    """
    count = min(4, len(x))
    first = min(max(int(np.searchsorted(x, place)) - 2, 0), len(x) - count)
    near, values = x[first : first + count].tolist(), y[first : first + count].tolist()
    total = 0.0
    for i in range(count):
        weight = 1.0
        for j in range(count):
            if j != i:
                weight *= (float(place) - near[j]) / (near[i] - near[j])
        total += weight * values[i]
    return total


def values_at(x: FloatArray, y: FloatArray, places: FloatArray) -> FloatArray:
    """Return the cubic's values at many places, (n,) or of samples (m, k) all columns, (n, k); see `value_at`."""
    count = min(4, len(x))
    first = np.clip(np.searchsorted(x, places) - 2, 0, len(x) - count)
    nodes = first[:, None] + np.arange(count)
    return _cubics(x[nodes], y[nodes], places)


EXTREME_RTOL = 1e-10
"""Height of an extreme over the samples around it, in parts of the largest, below which it is rounding."""


def inner_extremes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return where the cubics between samples rise above or fall below both samples around them, increasing.

    Examples
    --------
    >>> x = np.array([-1.5, -0.6, 0.5, 1.0, 2.0])
    >>> inner_extremes(x, x**2).round(12).tolist()
    [0.0]
    """
    return inner_extremes_of_rows([(x, y)])[0]


def inner_extremes_of_rows(rows: Sequence[tuple[FloatArray, FloatArray]]) -> list[FloatArray]:
    """Return `inner_extremes` of several functions, each with samples of its own."""
    long = [(x, y) for x, y in rows if len(x) >= 4]
    if not long:
        return [np.zeros(0) for _ in rows]
    counts = np.array([len(x) for x, _ in long])
    ends = np.cumsum(counts)
    x, y = (np.concatenate(column) for column in zip(*long, strict=True))
    row = np.repeat(np.arange(len(long)), counts - 1)
    left = np.arange(len(row)) + row  # the last sample of a row begins no step
    first = np.clip(left - 1, (ends - counts)[row], ends[row] - 4)[:, None] + np.arange(4)
    near, values = x[first], y[first]
    t = near - x[left][:, None]
    one = np.diff(values, axis=1) / np.diff(t, axis=1)
    two = np.diff(one, axis=1) / (t[:, 2:] - t[:, :-2])
    three = (two[:, 1] - two[:, 0]) / (t[:, 3] - t[:, 0])
    # Newton's form as powers of t: the slope is c + 2 b t + 3 a t^2
    a, b = three, two[:, 0] - three * t[:, :3].sum(axis=1)
    c = one[:, 0] - two[:, 0] * (t[:, 0] + t[:, 1])
    c += three * (t[:, 0] * t[:, 1] + t[:, 0] * t[:, 2] + t[:, 1] * t[:, 2])
    width = x[left + 1] - x[left]
    with np.errstate(invalid="ignore", divide="ignore"):
        root = -(b + np.copysign(np.sqrt(b * b - 3.0 * a * c), b))
        places = np.stack([root / (3.0 * a), c / root], axis=1)
        inside = (places > 0.0) & (places < width[:, None])
    step, which = np.nonzero(inside)
    found = x[left[step]] + places[step, which]
    heights = _cubics(near[step], values[step], found)
    least = (EXTREME_RTOL * np.maximum.reduceat(np.abs(y), ends - counts))[row[step]]
    before, behind = y[left[step]], y[left[step] + 1]
    turns = (heights > np.maximum(before, behind) + least) | (heights < np.minimum(before, behind) - least)
    found, row = found[turns], row[step][turns]
    each = iter([distinct(found[row == k]) for k in range(len(long))])
    return [next(each) if len(x) >= 4 else np.zeros(0) for x, _ in rows]


def _cubics(near: FloatArray, values: FloatArray, places: FloatArray) -> FloatArray:
    """Return the polynomials through some samples each, (n, k), at one place each, (n,)."""
    total, count = np.zeros((len(places), *values.shape[2:])), near.shape[1]
    for i in range(count):
        weight = np.ones(len(places))
        for j in range(count):
            if j != i:
                weight *= (places - near[:, j]) / (near[:, i] - near[:, j])
        total += weight.reshape(-1, *[1] * (values.ndim - 2)) * values[:, i]
    return total


def crossing(x: FloatArray, y: FloatArray, level: float) -> float | None:
    """Return where the function first reaches a level from below; None if it never does."""
    reached = np.flatnonzero(y >= level)
    if not len(reached):
        return None
    index = int(reached[0])
    if index == 0:
        return float(x[0])
    return bisect(lambda place: value_at(x, y, place) >= level, float(x[index - 1]), float(x[index]))


def crossings(x: FloatArray, y: FloatArray, level: float) -> list[float]:
    """Return where the function passes a level between two samples, in either direction, increasing.

    Examples
    --------
    >>> x = np.array([-3.0, -1.0, 1.0, 3.0, 4.0])
    >>> np.round(crossings(x, x**2, 4.0), 12).tolist()
    [-2.0, 2.0]
    """
    above = y >= level

    def has_passed(place: float, up: bool) -> bool:
        return (value_at(x, y, place) >= level) == up

    steps = np.flatnonzero(above[1:] != above[:-1])
    return [bisect(partial(has_passed, up=bool(above[k + 1])), float(x[k]), float(x[k + 1])) for k in steps.tolist()]


def bisect(holds: Callable[[float], bool], low: float, high: float) -> float:
    """Return the place between `low`, where a condition fails, and `high`, where it holds, from which on it holds."""
    for _ in range(_N_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def first_extreme(
    x: FloatArray, y: FloatArray, sign: int = 1, after: float = -np.inf, corners: FloatArray | None = None
) -> tuple[float, float] | None:
    """Return place and value of the first inner maximum (sign 1) or minimum (-1) after a place; None without one.

    An extreme of the samples that is one of some corners is the extreme: no cubic goes across it.
    """
    z = sign * y
    top = (z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:]) & (x[1:-1] > after)
    if not top.any():
        return None
    index = int(np.argmax(top)) + 1
    if corners is not None and x[index] in corners:
        return float(x[index]), float(y[index])
    low, high = float(x[index - 1]), float(x[index + 1])
    ratio = 0.5 * (np.sqrt(5.0) - 1)
    for _ in range(_N_HALVINGS):
        one, other = high - ratio * (high - low), low + ratio * (high - low)
        if sign * value_at(x, y, one) > sign * value_at(x, y, other):
            high = other
        else:
            low = one
    place = 0.5 * (low + high)
    return place, value_at(x, y, place)

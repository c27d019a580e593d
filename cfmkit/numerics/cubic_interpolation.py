"""Between the samples of a smooth function: the cubic through the four nearest of them.

Error: the fourth power of the spacing. The first argument increases; nothing here sorts or bridges a fold.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import distinct

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

_HALVINGS = 60


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
    near = x[first[:, None] + np.arange(count)]
    total = np.zeros((len(places), *y.shape[1:]))
    for i in range(count):
        weight = np.ones(len(places))
        for j in range(count):
            if j != i:
                weight *= (places - near[:, j]) / (near[:, i] - near[:, j])
        total += weight.reshape(-1, *[1] * (y.ndim - 1)) * y[first + i]
    return total


BESIDE = 1e-10
"""Height of an extreme over the samples around it, in parts of the largest, below which it is rounding."""


def inner_extremes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return where the cubics between samples rise above or fall below both samples around them, increasing.

    Examples
    --------
    >>> x = np.array([-1.5, -0.6, 0.5, 1.0, 2.0])
    >>> inner_extremes(x, x**2).round(12).tolist()
    [0.0]
    """
    if len(x) < 4:
        return np.zeros(0)
    left = np.arange(len(x) - 1)
    first = np.clip(left - 1, 0, len(x) - 4)
    t = x[first[:, None] + np.arange(4)] - x[left][:, None]
    one = np.diff(y[first[:, None] + np.arange(4)], axis=1) / np.diff(t, axis=1)
    two = np.diff(one, axis=1) / (t[:, 2:] - t[:, :-2])
    three = (two[:, 1] - two[:, 0]) / (t[:, 3] - t[:, 0])
    # Newton's form as powers of t: the slope is c + 2 b t + 3 a t^2
    a, b = three, two[:, 0] - three * t[:, :3].sum(axis=1)
    c = one[:, 0] - two[:, 0] * (t[:, 0] + t[:, 1])
    c += three * (t[:, 0] * t[:, 1] + t[:, 0] * t[:, 2] + t[:, 1] * t[:, 2])
    width, least = np.diff(x), BESIDE * float(np.abs(y).max())
    with np.errstate(invalid="ignore", divide="ignore"):
        root = -(b + np.copysign(np.sqrt(b * b - 3.0 * a * c), b))
        places = np.stack([root / (3.0 * a), c / root], axis=1)
        inside = (places > 0.0) & (places < width[:, None])
    found = x[left][:, None] + np.where(inside, places, 0.0)
    heights = values_at(x, y, found.ravel()).reshape(found.shape)
    high, low = np.maximum(y[:-1], y[1:])[:, None], np.minimum(y[:-1], y[1:])[:, None]
    return distinct(found[inside & ((heights > high + least) | (heights < low - least))])


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

    def passed(place: float, up: bool) -> bool:
        return (value_at(x, y, place) >= level) == up

    steps = np.flatnonzero(above[1:] != above[:-1])
    return [bisect(partial(passed, up=bool(above[k + 1])), float(x[k]), float(x[k + 1])) for k in steps.tolist()]


def bisect(holds: Callable[[float], bool], low: float, high: float) -> float:
    """Return the place between `low`, where a condition fails, and `high`, where it holds, from which on it holds."""
    for _ in range(_HALVINGS):
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
    for _ in range(_HALVINGS):
        one, other = high - ratio * (high - low), low + ratio * (high - low)
        if sign * value_at(x, y, one) > sign * value_at(x, y, other):
            high = other
        else:
            low = one
    place = 0.5 * (low + high)
    return place, value_at(x, y, place)

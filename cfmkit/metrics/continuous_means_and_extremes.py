"""Mean, largest and smallest value of an effort over a window, for metrics: of one curve, or of many at once.

They need a model that gives the effort at every place, so that they do not depend on how densely a curve is sampled. An
extreme lies between the neighbours of the largest or smallest sample: the model is evaluated at the vertex of the
parabola through these three and on either side of it, then again between the neighbours of the best; the largest value
found counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)
"""Gauss points in each step between two places: polynomials of degree seven are integrated exactly."""
FEW_SAMPLES = 100  # samples below which a parabola through three of them is no more than a first guess
N_PARABOLAS, VERTEX_OFFSETS = 3, np.array([-0.08, 0.0, 0.08])
"""Parabolas for few samples, and where the model is asked next to the vertex, as shares of the way between the outer
points. Vertices alone draw nearer from one side only, slowly where a curve is skew; with a place on either side the
way is a sixth as long after each round: of a cam at 31 points the last extreme is right to 2e-8 of the force.
"""
EXTREME_SIGNS = np.array([1.0, -1.0])
"""By which values are multiplied of which the largest is wanted: for the largest and for the smallest one."""


def mean(function: Callable[[FloatArray], FloatArray], places: FloatArray, low: float, high: float) -> float:
    """Return the mean of a function over a window: its integral by Gauss' rule between places, over the width.

    Examples
    --------
    >>> round(mean(np.exp, np.linspace(0.0, 1.0, 9), 0.0, 1.0), 12)
    1.718281828459
    """
    return float(mean_of_rows(function, places[None, :], np.array([low]), np.array([high]))[0])


def mean_of_rows(
    function: Callable[[FloatArray], FloatArray], places: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return `mean` of each row, (d,): of functions (d, m) -> (d, m) with places (d, n) and windows (d,)."""
    ends = np.hstack([low[:, None], np.clip(places, low[:, None], high[:, None]), high[:, None]])
    middle, half = 0.5 * (ends[:, 1:] + ends[:, :-1]), 0.5 * (ends[:, 1:] - ends[:, :-1])
    at = (middle[..., None] + half[..., None] * _GAUSS_NODES).reshape(len(low), -1)
    values = np.where(half > 0, function(at).reshape(*half.shape, -1) @ _GAUSS_WEIGHTS, 0.0)
    return np.asarray((half * values).sum(axis=1) / (high - low))


def extremes(
    # values at any places of each row, (d, m) -> (d, m); where it is not a number, it does not count
    function: Callable[[FloatArray], FloatArray],
    # motion, effort: (d, n): samples, monotonic in the motion; their values
    motion: FloatArray,
    effort: FloatArray,
    # bool or (d,): whether samples stand closer in some places than in others: then their number does not tell how
    # close
    uneven: bool | NDArray[np.bool_] = False,
    last: NDArray[np.intp] | None = None,  # (d,): index of the last sample of each row; what follows repeats it
) -> tuple[FloatArray, FloatArray]:
    """Return the largest and the smallest value of each row next to its samples, (d,) each.

    Examples
    --------
    >>> x = np.linspace(0.0, 3.0, 7)[None, :]
    >>> high, low = extremes(np.sin, x, np.sin(x))
    >>> float(high[0].round(6)), float(low[0])
    (1.0, 0.0)
    """
    end = np.full(len(effort), effort.shape[1] - 1) if last is None else last
    highest = np.stack([effort.argmax(axis=1), effort.argmin(axis=1)], axis=1)
    middle = np.maximum(np.minimum(highest, end[:, None] - 1), 1)
    neighbours = np.minimum(middle[..., None] + np.arange(-1, 2), effort.shape[1] - 1)
    rows = np.arange(len(effort))[:, None, None]
    x, y = np.broadcast_to(motion, effort.shape)[rows, neighbours], EXTREME_SIGNS[:, None] * effort[rows, neighbours]
    return _refine_extremes(function, x, y, EXTREME_SIGNS * effort[rows[..., 0], highest], end, uneven)


def extremes_of_all(
    # function, uneven: as there
    function: Callable[[FloatArray], FloatArray],
    # (d, n), (d, n), (d,) of int: motion, increasing, values, and the index of the last of each row
    samples: tuple[FloatArray, FloatArray, NDArray[np.intp]],
    # places, values: (d, k): others, in order, between the ends of a row; those that are at a sample or at each other
    # count once
    places: FloatArray,
    values: FloatArray,
    uneven: bool | NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Return `extremes` of samples and other places in one order, without sorting all of them."""
    motion, effort, last = samples
    motion, rows = np.broadcast_to(motion, effort.shape), np.arange(len(effort))[:, None]
    highest = np.stack([effort.argmax(axis=1), effort.argmin(axis=1)], axis=1)
    other_places = np.stack([values.argmax(axis=1), values.argmin(axis=1)], axis=1)
    own_x, other_x = motion[rows, highest], places[rows, other_places]
    first_values, second_values = EXTREME_SIGNS * effort[rows, highest], EXTREME_SIGNS * values[rows, other_places]
    is_other = (second_values > first_values) | ((second_values == first_values) & (other_x < own_x))
    some, _ = np.nonzero(is_other)
    highest[is_other] = (motion[some] < other_x[is_other][:, None]).sum(axis=1)
    neighbours = np.clip(highest[..., None] + np.arange(-2, 3), 0, last[:, None, None])
    beside = _find_neighbours(places, np.where(is_other, other_x, own_x))
    rows = rows[..., None]
    x = np.concatenate([motion[rows, neighbours], places[rows, beside]], axis=2)
    y = EXTREME_SIGNS[:, None] * np.concatenate([effort[rows, neighbours], values[rows, beside]], axis=2)
    order = np.argsort(x, axis=2, kind="stable")
    x, y = np.take_along_axis(x, order, 2), np.take_along_axis(y, order, 2)
    double = np.zeros(x.shape, dtype=bool)
    double[..., 1:] = x[..., 1:] == x[..., :-1]
    order = np.argsort(double, axis=2, kind="stable")  # doubles behind all others
    x, y = np.take_along_axis(x, order, 2), np.take_along_axis(np.where(double, -np.inf, y), order, 2)
    count = x.shape[2] - double.sum(axis=2)
    middle = np.maximum(np.minimum(y.argmax(axis=2), count - 2), 1)
    neighbours = np.minimum(middle[..., None] + np.arange(-1, 2), count[..., None] - 1)
    x, y = np.take_along_axis(x, neighbours, 2), np.take_along_axis(y, neighbours, 2)
    ends = _count_distinct(motion, last, places) - 1
    return _refine_extremes(function, x, y, np.maximum(first_values, second_values), ends, uneven)


def _find_neighbours(places: FloatArray, x: FloatArray) -> NDArray[np.intp]:
    """Return indices of the two places before each x (d, 2), of the one at it, and of the two behind it, (d, 2, 5)."""
    rows, last = np.arange(len(places))[:, None], places.shape[1] - 1

    def count_below(at: FloatArray) -> NDArray[np.intp]:
        return np.asarray(np.stack([(places < at[:, [k]]).sum(axis=1) for k in range(2)], axis=1))

    def count_up_to(at: FloatArray) -> NDArray[np.intp]:
        return np.asarray(np.stack([(places <= at[:, [k]]).sum(axis=1) for k in range(2)], axis=1))

    below, behind = count_below(x), count_up_to(x)
    second = count_below(places[rows, np.maximum(below - 1, 0)]), count_up_to(places[rows, np.minimum(behind, last)])
    return np.clip(np.stack([second[0] - 1, below - 1, below, behind, second[1]], axis=2), 0, last)


def _count_distinct(motion: FloatArray, last: NDArray[np.intp], places: FloatArray) -> NDArray[np.intp]:
    """Return how many different places samples and others have, (d,); exact where it matters: of few."""
    count = last + 1 + places.shape[1]
    for row in np.flatnonzero((last < 2) | ((last < FEW_SAMPLES) & (count > FEW_SAMPLES))):
        count[row] = len(np.unique(np.concatenate([motion[row, : last[row] + 1], places[row]])))
    return np.asarray(count)


def _refine_extremes(
    function: Callable[[FloatArray], FloatArray],
    x: FloatArray,
    y: FloatArray,
    best: FloatArray,
    end: NDArray[np.intp],
    uneven: bool | NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Return the largest and the smallest value next to three samples each, (d, 2, 3), of which the best is known.

    Values of the smallest have their sign changed; `end` is the index of the last of all samples of a row.
    """
    top, bottom = best[:, 0], -best[:, 1]
    if not (end >= 2).any():
        return top, bottom
    few = (end < FEW_SAMPLES) | uneven
    rounds, beside = (N_PARABOLAS, VERTEX_OFFSETS) if few.any() else (1, np.zeros(1))
    beside = np.where(few[:, None, None], beside, 0.0)
    for number in range(rounds):
        places = _vertex_places(x, y, beside)
        refined = EXTREME_SIGNS[:, None] * function(places.reshape(len(places), -1)).reshape(places.shape)
        refined = np.where(np.isfinite(refined), refined, -np.inf)
        counts = few[:, None] if number else True  # of many samples one parabola is enough
        best = np.where(counts, np.maximum(best, refined.max(axis=-1)), best)
        if number < rounds - 1:
            x, y = _points_around_largest(np.concatenate([x, places], axis=-1), np.concatenate([y, refined], axis=-1))
    curved = end >= 2
    return np.where(curved, best[:, 0], top), np.where(curved, -best[:, 1], bottom)


def _vertex_places(x: FloatArray, y: FloatArray, beside: FloatArray) -> FloatArray:
    """Return where the parabola through three points is largest, between the outer two, and places next to it."""
    (a, b, c), (fa, fb, fc) = np.moveaxis(x, -1, 0), np.moveaxis(y, -1, 0)
    with np.errstate(all="ignore"):
        left, right = (b - a) * (fb - fc), (b - c) * (fb - fa)
        place = b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right)
    places = np.where(np.isfinite(place), place, b)[..., None] + beside * (c - a)[..., None]
    return np.asarray(np.clip(places, np.minimum(a, c)[..., None], np.maximum(a, c)[..., None]))


def _points_around_largest(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the three of all points that surround the largest."""
    order = np.argsort(x, axis=-1)
    x, y = np.take_along_axis(x, order, -1), np.take_along_axis(y, order, -1)
    neighbours = np.clip(y.argmax(axis=-1), 1, x.shape[-1] - 2)[..., None] + np.arange(-1, 2)
    return np.take_along_axis(x, neighbours, -1), np.take_along_axis(y, neighbours, -1)

"""Extremes of sampled functions: turning points by known slopes, largest values with derivatives, smooth least values.

With known slopes a curve is its Hermite cubic between two samples, and turning points are the roots of a quadratic: two
that lie between the same samples are found, too. Along samples and turning points together every curve is monotonic
from each place to the next, so that a change of sign is a root, and a place without one has none.

Largest values, for optimisation, are those of a parabola through three samples. By the envelope theorem the derivative
of an extreme is that of the function at a fixed place, so the weights that give the extreme from three samples also
give its derivative from the derivatives of these samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True, repr=False)
class Monotone(ShortRepr):
    """Curves cut into monotonic pieces."""

    place: FloatArray  # (m, k), increasing along the second axis; what others have more is the last place repeated
    value: FloatArray  # (m, k), the curves there


@np.errstate(all="ignore")
def monotone(
    place: FloatArray,  # (n,) or (m, n): increasing
    # value, slope: (m, n): curves and their derivatives; a slope that is not finite counts as that of the chord
    value: FloatArray,
    slope: FloatArray,
    # the curves at places of each row, (m, k) -> (m, k): the cubics say where to look only
    function: Callable[[FloatArray], FloatArray],
) -> Monotone:
    """Return curves at their samples and turning points.

    Examples
    --------
    >>> x = np.linspace(0.0, 3.0, 4)
    >>> found = monotone(x, np.array([x**3 - 4 * x]), np.array([3 * x**2 - 4]), lambda x: x**3 - 4 * x)
    >>> float(found.value.min().round(6)), round(-16 / 27**0.5, 6)
    (-3.079201, -3.079201)
    """
    place = np.broadcast_to(place, value.shape)
    step, rise = np.diff(place), np.diff(value)
    left, right = slope[:, :-1] * step, slope[:, 1:] * step
    left, right = (np.where(np.isfinite(item), item, rise) for item in (left, right))
    # With like slopes at its ends a cubic turns twice, or not at all.
    a, b = left + right - 2.0 * rise, 3.0 * rise - 2.0 * left - right
    product = 3.0 * a * left
    twice = (product > 0.0) & (b * b > product) & ((a > 0.0) != (b > 0.0)) & (np.abs(b) < 3.0 * np.abs(a))
    row, cell = np.nonzero(((left > 0.0) != (right > 0.0)) | twice)
    # with s the share of a cell, the cubic is s (left + s (b + s a)); its derivative is 3 a s^2 + 2 b s + left
    a, b, left = a[row, cell], b[row, cell], left[row, cell]
    big = -(b + np.copysign(np.sqrt(b * b - 3.0 * a * left), b))
    share = np.sort(np.stack([big / (3.0 * a), left / big]), axis=0)
    inside = (share > 0.0) & (share < 1.0)
    order = np.argsort(np.stack([row, row])[inside], kind="stable")
    turns = (place[row, cell] + share * step[row, cell])[inside][order]
    row = np.stack([row, row])[inside][order]
    count = np.bincount(row, minlength=len(value))
    if not len(row):
        return Monotone(place, value)
    more = np.repeat(place[:, -1:], count.max(), axis=1)
    more[row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)] = turns
    computed = np.where(more == place[:, -1:], value[:, -1:], function(more))
    both, values = np.hstack([place, more]), np.hstack([value, computed])
    order = np.argsort(both, axis=1, kind="stable")
    return Monotone(np.take_along_axis(both, order, 1), np.take_along_axis(values, order, 1))


def largest(places: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the largest values along the last axis: value, place, and weights of the samples.

    Parameters
    ----------
    places : (r,) or (..., r) array
        Increasing.
    values : (..., r) array
        Samples.

    Returns
    -------
    value, place : (...) array
        Of the vertex; of the best sample where the parabola has no vertex among its three samples.
    weights : (..., r) array
        The value, and its derivatives by anything, are the sums of weight times sample.
    """
    shape = values.shape
    value, vertex, three, weight = _parabola(places, values)
    weights = np.zeros((len(three), shape[-1]))
    weights[np.arange(len(three))[:, None], three] = weight
    return value.reshape(shape[:-1]), vertex.reshape(shape[:-1]), weights.reshape(shape)


def largest_of_three(places: FloatArray, values: FloatArray) -> tuple[FloatArray, Any, FloatArray]:
    """Return the same values, and the weights of three samples only: value (...), which (..., 3), weights (..., 3)."""
    before = values.shape[:-1]
    value, _, three, weight = _parabola(places, values)
    return value.reshape(before), three.reshape(*before, 3), weight.reshape(*before, 3)


def _parabola(places: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, Any, FloatArray]:
    """Return value, vertex, the three samples and their weights, of all the rows of the values one after the other."""
    shape, count = values.shape, values.shape[-1]
    flat = values.reshape(-1, count)
    where = np.broadcast_to(places, shape).reshape(-1, count)
    rows = np.arange(len(flat))
    best = flat.argmax(axis=1)
    three = np.clip(best, 1, count - 2)[:, None] + np.array([-1, 0, 1])
    t, f = where[rows[:, None], three], flat[rows[:, None], three]
    vertex = _vertices(t, f, where[rows, best])
    away = vertex[:, None] - t
    weight = away[:, [1, 2, 0]] * away[:, [2, 0, 1]] / ((t - t[:, [1, 2, 0]]) * (t - t[:, [2, 0, 1]]))
    return (weight * f).sum(axis=1), vertex, three, weight


def _vertices(t: FloatArray, f: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return where the parabolas through three samples (n, 3) each are highest; `otherwise` if not between them."""
    first = (f[:, 1] - f[:, 0]) / (t[:, 1] - t[:, 0])
    second = (f[:, 2] - f[:, 1]) / (t[:, 2] - t[:, 1])
    bend = (second - first) / (t[:, 2] - t[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = 0.5 * (t[:, 0] + t[:, 1]) - 0.5 * first / bend
    inside = (bend < 0) & (vertex >= t[:, 0]) & (vertex <= t[:, 2])
    result: FloatArray = np.where(inside, vertex, otherwise)
    return result


def soft_least(values: FloatArray, sharpness: float) -> tuple[FloatArray, FloatArray]:
    """Return smooth lower bounds (...) of the least of values (..., n) along the last axis, and their derivatives.

    -ln(sum(exp(-k v)))/k lies below the least by at most ln(n)/k.

    Examples
    --------
    >>> least, weights = soft_least(np.array([1.0, 2.0]), 50.0)
    >>> float(least.round(6)), weights.round(6).tolist()
    (1.0, [1.0, 0.0])
    """
    lowest = values.min(axis=-1)
    powers = np.exp(-sharpness * (values - lowest[..., None]))
    total = powers.sum(axis=-1)
    return lowest - np.log(total) / sharpness, powers / total[..., None]

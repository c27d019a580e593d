"""Largest values of sampled smooth functions with derivatives, for optimisation: a parabola through three samples.

By the envelope theorem the derivative of an extreme is that of the function at a fixed place, so the weights that give
the extreme from three samples also give its derivative from the derivatives of these samples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


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
    vertex = _vertex(t, f, where[rows, best])
    away = vertex[:, None] - t
    weight = away[:, [1, 2, 0]] * away[:, [2, 0, 1]] / ((t - t[:, [1, 2, 0]]) * (t - t[:, [2, 0, 1]]))
    return (weight * f).sum(axis=1), vertex, three, weight


def _vertex(t: FloatArray, f: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return where the parabolas through three samples (n, 3) each are highest, `otherwise` where they have no top."""
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

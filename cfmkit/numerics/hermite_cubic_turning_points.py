"""Turning points of sampled curves with known slopes, many curves at once.

Between two samples a curve is its Hermite cubic, whose turning points are the roots of a
quadratic: two that lie between the same samples are found, too. Along samples and
turning points together every curve is monotonic from each place to the next, so that a change of sign is a root,
and a place without one has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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
    known = np.where(more == place[:, -1:], value[:, -1:], function(more))
    both, values = np.hstack([place, more]), np.hstack([value, known])
    order = np.argsort(both, axis=1, kind="stable")
    return Monotone(np.take_along_axis(both, order, 1), np.take_along_axis(values, order, 1))

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

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class Monotone:
    """Curves cut into monotonic pieces.

    Attributes
    ----------
    place : (m, k) array
        Increasing along the second axis; turning points that a cell does not have repeat a neighbour.
    value : (m, k) array
        The curves there.
    """

    place: FloatArray
    value: FloatArray


def monotone(place: FloatArray, value: FloatArray, slope: FloatArray) -> Monotone:
    """Return curves at their samples and turning points.

    Parameters
    ----------
    place : (n,) array
        Increasing.
    value, slope : (m, n) array
        Curves and their derivatives; a slope that is not finite counts as that of the chord.

    Examples
    --------
    >>> x = np.linspace(0.0, 3.0, 4)
    >>> found = monotone(x, np.array([x**3 - 4 * x]), np.array([3 * x**2 - 4]))
    >>> float(found.value.min().round(6)), round(-16 / 27**0.5, 6)
    (-3.079201, -3.079201)
    """
    step = np.diff(place)
    low, high = value[:, :-1], value[:, 1:]
    rise = high - low
    left, right = slope[:, :-1] * step, slope[:, 1:] * step
    left, right = (np.where(np.isfinite(item), item, rise) for item in (left, right))
    pair, inside = _turns(left, right, rise)
    # What is missing repeats an end, so that places never decrease.
    share = np.sort(np.where(inside, pair, np.array([0.0, 1.0])[:, None, None]), axis=0)
    between = low + _risen(left, right, rise, share)
    between = np.where(share == 0.0, low, np.where(share == 1.0, high, between))
    return Monotone(_woven(np.broadcast_to(place, value.shape), place[:-1] + share * step), _woven(value, between))


def _turns(left: FloatArray, right: FloatArray, rise: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return where Hermite cubics turn as shares of their cells, increasing, (2, ...), and which lie inside.

    With s the share, a cubic is s (left + s (b + s a)); its derivative is 3 a s^2 + 2 b s + left.
    """
    a, b = left + right - 2.0 * rise, 3.0 * rise - 2.0 * left - right
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b * b - 3.0 * a * left)
        big = -(b + np.copysign(root, b))
        share = np.sort(np.stack([big / (3.0 * a), left / big]), axis=0)
        return share, (share > 0.0) & (share < 1.0)


def _risen(left: FloatArray, right: FloatArray, rise: FloatArray, share: FloatArray) -> FloatArray:
    """Return how far Hermite cubics have risen from the start of their cells at some shares of these."""
    a, b = left + right - 2.0 * rise, 3.0 * rise - 2.0 * left - right
    with np.errstate(invalid="ignore"):
        risen: FloatArray = share * (left + share * (b + share * a))
    return risen


def _woven(samples: FloatArray, between: FloatArray) -> FloatArray:
    """Return samples (m, n) with the two (2, m, n - 1) of each cell behind its first sample, (m, 3 n - 2)."""
    count = samples.shape[1]
    woven = np.empty((samples.shape[0], 3 * count - 2))
    woven[:, ::3] = samples
    woven[:, 1::3], woven[:, 2::3] = between
    return woven


def sharpened(place: FloatArray, value: FloatArray, slope: FloatArray, twice: bool = True) -> FloatArray:
    """Return curves at their samples, with the sample next to each turning point replaced by the value there.

    A tenth of the work of `monotone`, and enough where heights count and places do not.

    Parameters
    ----------
    place : (n,) array
        Increasing.
    value, slope : (m, n) array
        Curves and their derivatives.
    twice : bool
        Whether to look for curves that turn twice between two samples, too: not where they are
        so steep that a cubic would overshoot.
    """
    step = np.diff(place)
    rise = value[:, 1:] - value[:, :-1]
    left, right = slope[:, :-1] * step, slope[:, 1:] * step
    turns = (left > 0.0) != (right > 0.0)
    # With like slopes at its ends a cubic turns twice, or not at all: only if it goes the other way in its middle.
    if twice:
        turns |= (6.0 * rise - left - right) * left < 0.0
    row, cell = np.nonzero(turns)
    if not len(row):
        return value
    cubics = left[row, cell], right[row, cell], rise[row, cell]
    found = value.copy()
    for share, inside in zip(*_turns(*cubics), strict=True):
        height = value[row, cell] + _risen(*cubics, share)
        at = cell + (share > 0.5)
        found[row[inside], at[inside]] = height[inside]
    return found

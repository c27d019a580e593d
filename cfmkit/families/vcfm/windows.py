"""The longest stretch of a curve on which the force stays within a band: for one curve or many at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.curves import FloatArray


def longest_window(force: FloatArray, flatness: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return first and last sample of the longest window with (max - min)/max within `flatness`, for each curve.

    Parameters
    ----------
    force : (k, n) array
        Samples at even places [N]; a window holds positive ones only.
    flatness : float
        Largest (max - min)/max.

    Returns
    -------
    first, last : (k,) array of int
        Equal where no two neighbours are within the band. The first of several longest.

    Examples
    --------
    >>> first, last = longest_window(np.array([[0.0, 5.0, 9.8, 10.0, 9.9, 7.0]]), 0.05)
    >>> int(first[0]), int(last[0])
    (2, 4)
    """
    curves, n = force.shape
    levels = _levels(np.where(np.isfinite(force), force, -1.0))
    reach = np.zeros((curves, n), dtype=np.intp)
    high, low = levels[0][0].copy(), levels[0][1].copy()
    rows, start = np.arange(curves)[:, None], np.arange(n)[None, :]
    for level in range(len(levels) - 1, -1, -1):
        # samples start + reach + 1 ... start + reach + 2^level come in together, if the band allows
        at = start + reach + 1
        fits = at + 2**level <= n
        at = np.minimum(at, n - 1)
        top, bottom = np.maximum(high, levels[level][0][rows, at]), np.minimum(low, levels[level][1][rows, at])
        fits &= (bottom > 0) & (top - bottom <= flatness * top * (1 + 1e-12))
        reach = np.where(fits, reach + 2**level, reach)
        high, low = np.where(fits, top, high), np.where(fits, bottom, low)
    first = reach.argmax(axis=1)
    return first, first + reach[np.arange(curves), first]


def _levels(force: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return largest and smallest of 1, 2, 4, ... samples from each on; beyond the end, of what is there."""
    found, size = [(force, force)], 1
    while 2 * size <= force.shape[1]:
        high, low = found[-1]
        top, bottom = high.copy(), low.copy()
        top[:, :-size], bottom[:, :-size] = (
            np.maximum(high[:, :-size], high[:, size:]),
            np.minimum(low[:, :-size], low[:, size:]),
        )
        found.append((top, bottom))
        size *= 2
    return found

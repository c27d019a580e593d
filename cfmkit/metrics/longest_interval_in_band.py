"""The longest interval of a curve on which the force stays within a band: for one curve or many at once.

Found among samples first, each start with the place in the next cell where the force leaves the band. Then again with
more samples around both ends and around the highest and the lowest force in between, until they are 1/4000000 of a step
apart: the ends are those of the curve, not of its samples. An interval that ends at a corner of the curve, or is
limited by the force there, is known no better than the last step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Levels = list[tuple[FloatArray, FloatArray]]

N_ZOOMS, ZOOM_FACTOR, ZOOM_STEPS = 11, 4.0, np.linspace(-2.0, 2.0, 17)
"""How often it is looked more closely, how much more each time, and where around a place, in steps."""
N_WHOLE_ZOOMS = 4
"""The first looks, which keep the samples elsewhere: of two windows of nearly one length the other may be longer."""
N_MODEL_ZOOMS, MODEL_ZOOM_STEPS, MODEL_ZOOM_FACTOR = 6, np.linspace(-2.0, 2.0, 65), 16.0
"""The same where a call of the model is what takes the time: more places in half as many calls."""


def extremes(
    function: Callable[[FloatArray], FloatArray],  # values of each function, (k, m) -> (k, m)
    place: FloatArray,  # (k,): near which each is largest
    step: FloatArray | float,  # (k, 1) or float: how far off that may be
    span: tuple[FloatArray, FloatArray],  # pair of (k,): within which it is looked for
) -> FloatArray:
    """Return where functions are largest near places, (k,), within spans; `step` says how far off these may be."""
    (low, high), rows = span, np.arange(len(place))
    for _ in range(N_MODEL_ZOOMS):
        places = np.clip(place[:, None] + MODEL_ZOOM_STEPS * step, low[:, None], high[:, None])
        place, step = places[rows, function(places).argmax(axis=1)], step / MODEL_ZOOM_FACTOR
    return place


def flat_window(
    travel: FloatArray, force: FloatArray, flatness: float, force_at: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return start and end of the longest window with (max - min)/max within `flatness`, for each curve [m].

    Parameters
    ----------
    travel : (n,) or (k, n) array
        Increasing [m]; the last place may be repeated, without forces.
    force : (k, n) array
        Forces there [N]; a window holds positive ones only.
    flatness : float
        Largest (max - min)/max.
    force_at : callable
        Forces at other places of each curve, (k, m) -> (k, m) [N].

    Returns
    -------
    start, end : (k,) array
        NaN where no force is positive. The first of several longest.

    Examples
    --------
    >>> hill = lambda x: 4.0 - x**2
    >>> x = np.linspace(-2.0, 2.0, 9)
    >>> start, end = flat_window(x, hill(x)[None, :], 0.05, hill)
    >>> float(start[0].round(3)), float(end[0].round(3)), round(0.2**0.5, 3)
    (-0.447, 0.447, 0.447)
    """
    places = np.broadcast_to(travel, force.shape)
    force = np.where(np.isfinite(force), force, -1.0)
    step = np.diff(places, axis=1).max(axis=1)
    low, high = places[:, :1].copy(), places[:, -1:].copy()
    for zoom in range(N_ZOOMS + 1):
        start, end, top, bottom = _longest(places, force, flatness)
        if zoom == N_ZOOMS:
            break
        centres = np.stack([start, end, top, bottom], axis=1)
        more = (centres[:, :, None] + ZOOM_STEPS * step[:, None, None]).reshape(len(force), -1)
        more = np.clip(np.where(np.isfinite(more), more, low), low, high)
        more_force = force_at(more)
        more_force = np.where(np.isfinite(more_force), more_force, -1.0)
        whole = zoom < N_WHOLE_ZOOMS
        places, force = (np.hstack([places, more]), np.hstack([force, more_force])) if whole else (more, more_force)
        order = np.argsort(places, axis=1, kind="stable")
        places, force = np.take_along_axis(places, order, 1), np.take_along_axis(force, order, 1)
        step = step / ZOOM_FACTOR
    return start, end


def _longest(places: FloatArray, force: FloatArray, flatness: float) -> tuple[FloatArray, ...]:
    """Return start and end of each curve's longest window, and where it is highest and lowest.

    Between two samples the force is linear. The longest of the windows that start at a sample is widened to where the
    force leaves the band before it.
    """
    levels = _levels(force)
    reach = _reach(levels, flatness)
    rows, n = np.arange(len(force)), force.shape[1]
    last = np.arange(n) + reach
    after = np.minimum(last + 1, n - 1)
    high, low = _extremes(levels, last)
    force_here, force_after = np.take_along_axis(force, last, 1), np.take_along_axis(force, after, 1)
    # it leaves the band over its upper end, or over its lower one
    level = np.where(force_after > high, low / (1.0 - flatness), (1.0 - flatness) * high)
    with np.errstate(all="ignore"):
        share = np.where(last < n - 1, np.clip((level - force_here) / (force_after - force_here), 0.0, 1.0), 0.0)
    at_last, at_after = np.take_along_axis(places, last, 1), np.take_along_axis(places, after, 1)
    end = at_last + np.where(np.isfinite(share), share, 0.0) * (at_after - at_last)
    length = np.where(force > 0, end - places, -1.0)
    first = (length >= length.max(axis=1, keepdims=True) * (1 - 1e-12)).argmax(axis=1)
    none = length[rows, first] <= 0
    inside = (np.arange(n) >= first[:, None]) & (np.arange(n) <= last[rows, first][:, None])
    top = places[rows, np.where(inside, force, -np.inf).argmax(axis=1)]
    bottom = places[rows, np.where(inside, force, np.inf).argmin(axis=1)]
    at_end = force_here[rows, first] + np.nan_to_num(share[rows, first] * (force_after - force_here)[rows, first])
    most, least = np.maximum(high[rows, first], at_end), np.minimum(low[rows, first], at_end)
    before = np.maximum(first - 1, 0)
    level = np.where(force[rows, before] > most, least / (1.0 - flatness), (1.0 - flatness) * most)
    with np.errstate(all="ignore"):
        back = (level - force[rows, first]) / (force[rows, before] - force[rows, first])
    back = np.clip(np.where(np.isfinite(back), back, 0.0), 0.0, 1.0)
    start = places[rows, first] + back * (places[rows, before] - places[rows, first])
    interval = start, end[rows, first], top, bottom
    return tuple(np.where(none, np.nan, column) for column in interval)


def _extremes(levels: Levels, last: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Return the largest and smallest force from each sample to another behind it."""
    curves, n = last.shape
    start, row = np.arange(n), n * np.arange(curves)[:, None]
    level = np.frexp((last - start + 1).astype(float))[1] - 1  # the largest power of two within
    highs, lows = (np.concatenate([pair[k].ravel() for pair in levels]) for k in (0, 1))
    head = level * (curves * n) + row
    tail = head + (last + 1 - (1 << level))
    head += start
    return np.maximum(highs.take(head), highs.take(tail)), np.minimum(lows.take(head), lows.take(tail))


def _reach(levels: Levels, flatness: float) -> NDArray[np.intp]:
    """Return how many samples behind each one are still within the band that begins there."""
    curves, n = levels[0][0].shape
    reach = np.zeros((curves, n), dtype=np.intp)
    high, low = levels[0][0].copy(), levels[0][1].copy()
    row, start = n * np.arange(curves)[:, None], np.arange(n)[None, :]
    for level in range(len(levels) - 1, -1, -1):
        # samples start + reach + 1 ... start + reach + 2^level come in together, if the band allows
        at = start + reach + 1
        fits = at + 2**level <= n
        at = np.minimum(at, n - 1) + row  # of the flattened table, which is read in half the time
        top, bottom = np.maximum(high, levels[level][0].take(at)), np.minimum(low, levels[level][1].take(at))
        fits &= (bottom > 0) & (top - bottom <= flatness * top * (1 + 1e-12))
        reach = np.where(fits, reach + 2**level, reach)
        high, low = np.where(fits, top, high), np.where(fits, bottom, low)
    return reach


def _levels(force: FloatArray) -> Levels:
    """Return largest and smallest of 1, 2, 4, ... samples from each on; beyond the end, of what is there."""
    intervals, size = [(force, force)], 1
    while 2 * size <= force.shape[1]:
        high, low = intervals[-1]
        top, bottom = high.copy(), low.copy()
        top[:, :-size], bottom[:, :-size] = (
            np.maximum(high[:, :-size], high[:, size:]),
            np.minimum(low[:, :-size], low[:, size:]),
        )
        intervals.append((top, bottom))
        size *= 2
    return intervals

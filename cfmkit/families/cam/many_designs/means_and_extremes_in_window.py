"""The forces of many cams inside a window, and the metrics over it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.metrics.spread import ManyWindows

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Exact = Callable[[FloatArray, NDArray[np.intp]], FloatArray]
    Places = tuple[FloatArray, FloatArray] | None
    """Start and end of the window of each cam, (d,) each [m]; None: the whole travel."""

_SLACK = 1e-9
"""Share of a window: places that are so near to its ends are at them, but for rounding."""


@dataclass(frozen=True, eq=False)
class SampledBranch:
    """One branch of many cams, force or stress."""

    # travel, values, (d, n): samples
    travel: FloatArray
    values: FloatArray
    exact: Exact  # ``exact(travel, rows)``, the values at any travels of some rows, (r, m) -> (r, m)
    peaks: FloatArray | None = None  # (d, k) travels next to which an extreme may stand that the samples miss

    @cached_property
    def heights(self) -> FloatArray:
        """The values at the peaks, (d, k)."""
        return self.exact(np.empty((len(self.values), 0)) if self.peaks is None else self.peaks, self._every)

    @cached_property
    def _every(self) -> NDArray[np.intp]:
        return np.arange(len(self.values))

    def take(self, rows: NDArray[np.intp]) -> SampledBranch:
        """Return some of the cams."""
        taken = SampledBranch(
            self.travel[rows],
            self.values[rows],
            lambda travel, some: self.exact(travel, rows[some]),
            None if self.peaks is None else self.peaks[rows],
        )
        if "heights" in self.__dict__:
            taken.__dict__["heights"] = self.heights[rows]
        return taken


class CutWindows(ManyWindows):
    """One branch of many cams inside a window: each cam its own samples, those alike worked on together."""

    def __init__(self, sampled: SampledBranch, window: Places) -> None:
        """Cut the window of each cam out."""
        self.count, self.error = len(sampled.values), 0.0
        ways = _ways(sampled, window)
        _, first, which = np.unique(ways, axis=0, return_index=True, return_inverse=True)
        if len(first) == 1 and ways[0, 1]:
            self.parts = [(np.arange(self.count), _part(sampled, window, ways[0]))]
            return
        groups = [np.flatnonzero(which.ravel() == k) for k in range(len(first)) if ways[first[k], 1]]
        self.parts = []
        for rows in groups:
            own = None if window is None else (window[0][rows], window[1][rows])
            self.parts.append((rows, _part(sampled.take(rows), own, ways[rows[0]])))

    def _each(self, number: Callable[[ManyWindows], FloatArray]) -> FloatArray:
        found = np.full(self.count, np.nan)
        for rows, part in self.parts:
            found[rows] = number(part)
        return found

    @cached_property
    def mean(self) -> FloatArray:
        """Mean of each cam, (d,)."""
        return self._each(lambda part: part.mean)

    @cached_property
    def extremes(self) -> tuple[FloatArray, FloatArray]:
        """Largest and smallest value of each cam, (d,) each."""
        return self._each(lambda part: part.extremes[0]), self._each(lambda part: part.extremes[1])

    @property
    def deviation(self) -> FloatArray:
        """Sample standard deviation (n - 1) of each cam, (d,)."""
        return self._each(lambda part: part.deviation)

    @property
    def work(self) -> FloatArray:
        """Integral over the travel of each cam, (d,) [J]."""
        return self._each(lambda part: part.work)


def _ways(sampled: SampledBranch, window: Places) -> NDArray[np.intp]:
    """Return how the window cuts each cam's samples: first and past the last inside, ends added, peaks inside.

    Nothing is inside a window that is not covered.
    """
    travel, count = sampled.travel, len(sampled.values)
    ways = np.zeros((count, 4), dtype=np.intp)
    low, high = travel[:, 0], travel[:, -1]
    if window is None:
        ways[:, 1] = travel.shape[1]
    else:
        low, high = window
        # The curves of one cam, or of many with one stroke, are cut alike: one of them tells it of all.
        alike = all((each == each[:1]).all() for each in (travel, low, high))
        some, first, final = (each[:1] if alike else each for each in (travel, low, high))
        slack = _SLACK * (final - first)
        start, stop = (some < (first - slack)[:, None]).sum(axis=1), (some <= (final + slack)[:, None]).sum(axis=1)
        every, last = np.arange(len(some)), travel.shape[1] - 1
        outside = (some[:, 0] > first + slack) | (some[:, -1] < final - slack)
        ways[:, 0], ways[:, 1] = start, np.where(outside, 0, stop)
        ways[:, 2] = (start < stop) & (some[every, np.minimum(start, last)] > first + slack)
        before = some[every, np.maximum(stop - 1, 0)] < final - slack
        ways[:, 3] = (start < stop) & before & (stop <= last)
    if sampled.peaks is None:
        return ways
    between = (sampled.peaks > low[:, None]) & (sampled.peaks < high[:, None])
    if between.any():
        between &= np.isfinite(sampled.heights)
    return np.column_stack([ways, between.astype(np.intp)])


def _part(sampled: SampledBranch, window: Places, way: NDArray[np.intp]) -> ManyWindows:
    """Return what lies in windows that cut the samples of all these cams alike."""
    rows, (start, stop, before, after) = np.arange(len(sampled.values)), way[:4].tolist()

    def at(places: FloatArray) -> tuple[FloatArray, FloatArray]:
        return places[:, None], sampled.exact(places[:, None], rows)

    parts = [(sampled.travel[:, start:stop], sampled.values[:, start:stop])]
    if window is not None and before:
        parts.insert(0, at(window[0]))
    if window is not None and after:
        parts.append(at(window[1]))
    motion, force = (np.hstack(each) if len(parts) > 1 else each[0] for each in zip(*parts, strict=True))
    return ManyWindows(motion, force, partial(_extremes, sampled, way[4:].astype(bool)))


def _extremes(
    sampled: SampledBranch, inside: NDArray[np.bool_], motion: FloatArray, force: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return largest and smallest force, NaN where one of the samples has none; `inside` says which peaks are."""
    rows, more = np.arange(len(force)), sampled.peaks
    known = np.isfinite(force.sum(axis=1))
    if more is not None and inside.any():
        more, heights = more[:, inside], sampled.heights[:, inside]
        motion = np.concatenate([np.broadcast_to(motion, force.shape), more], axis=1)
        order = np.argsort(motion, axis=1, kind="stable")
        motion = np.take_along_axis(motion, order, axis=1)
        force = np.take_along_axis(np.concatenate([force, heights], axis=1), order, axis=1)
    high, low = extremes(lambda at: sampled.exact(at, rows), motion, force, bool(inside.any()))
    return np.where(known, high, np.nan), np.where(known, low, np.nan)

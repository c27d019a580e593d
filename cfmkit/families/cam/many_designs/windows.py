"""The forces of many cams inside a window, and what is measured over it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.closed import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Exact = Callable[[FloatArray, NDArray[np.intp]], FloatArray]

_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Sampled:
    """One branch of many cams, force or stress.

    Attributes
    ----------
    travel, values : (d, n) array
        Samples.
    exact : callable
        ``exact(travel, rows)``, the values at any travels of some rows, (r, m) -> (r, m).
    peaks : (d, k) array, optional
        Travels next to which an extreme may stand that the samples miss.
    """

    travel: FloatArray
    values: FloatArray
    exact: Exact
    peaks: FloatArray | None = None

    def take(self, rows: NDArray[np.intp]) -> Sampled:
        """Return some of the cams."""
        return Sampled(
            self.travel[rows],
            self.values[rows],
            lambda travel, some: self.exact(travel, rows[some]),
            None if self.peaks is None else self.peaks[rows],
        )


class Spread:
    """What one branch of many cams has inside a window: each cam its own samples, those alike worked on together."""

    def __init__(self, sampled: Sampled, window: tuple[float, float] | None) -> None:
        """Cut the window out."""
        self.count = len(sampled.values)
        ways = _ways(sampled, window)
        _, first, which = np.unique(ways, axis=0, return_index=True, return_inverse=True)
        if len(first) == 1 and ways[0, 1]:
            self.parts = [(np.arange(self.count), _Part(sampled, window, ways[0]))]
            return
        groups = [np.flatnonzero(which.ravel() == k) for k in range(len(first)) if ways[first[k], 1]]
        self.parts = [(rows, _Part(sampled.take(rows), window, ways[rows[0]])) for rows in groups]

    def _each(self, name: str) -> FloatArray:
        found = np.full(self.count, np.nan)
        for rows, part in self.parts:
            found[rows] = getattr(part, name)
        return found

    @cached_property
    def mean(self) -> FloatArray:
        """Mean force of each design [N]."""
        return self._each("mean")

    @cached_property
    def max(self) -> FloatArray:
        """Largest force [N]."""
        return self._each("max")

    @cached_property
    def min(self) -> FloatArray:
        """Smallest force [N]."""
        return self._each("min")

    @cached_property
    def deviation(self) -> FloatArray:
        """Standard deviation (n - 1) of the force [N]."""
        return self._each("deviation")

    @cached_property
    def work(self) -> FloatArray:
        """Integral of the force over the travel [J]."""
        return self._each("work")


def _ways(sampled: Sampled, window: tuple[float, float] | None) -> NDArray[np.intp]:
    """Return how the window cuts each cam's samples: first and past the last inside, ends added, peaks inside.

    Nothing is inside a window that is not covered.
    """
    travel, count = sampled.travel, len(sampled.values)
    ways = np.zeros((count, 4), dtype=np.intp)
    low, high = travel[:, 0], travel[:, -1]
    if window is None:
        ways[:, 1] = travel.shape[1]
    else:
        ends = np.array(window)
        slack = _SLACK * (ends[1] - ends[0])
        # The curves of one cam, or of many with one stroke, are cut alike: one of them tells it of all.
        some = travel[:1] if (travel == travel[:1]).all() else travel
        start, stop = (some < ends[0] - slack).sum(axis=1), (some <= ends[1] + slack).sum(axis=1)
        every, last = np.arange(len(some)), travel.shape[1] - 1
        outside = (some[:, 0] > ends[0] + slack) | (some[:, -1] < ends[1] - slack)
        ways[:, 0], ways[:, 1] = start, np.where(outside, 0, stop)
        ways[:, 2] = (start < stop) & (some[every, np.minimum(start, last)] > ends[0] + slack)
        before = some[every, np.maximum(stop - 1, 0)] < ends[1] - slack
        ways[:, 3] = (start < stop) & before & (stop <= last)
        low, high = np.full(count, ends[0]), np.full(count, ends[1])
    if sampled.peaks is None:
        return ways
    between = (sampled.peaks > low[:, None]) & (sampled.peaks < high[:, None])
    between &= np.isfinite(sampled.exact(sampled.peaks, np.arange(count)))
    return np.column_stack([ways, between.astype(np.intp)])


class _Part:
    """Cams whose samples the window cuts alike."""

    def __init__(self, sampled: Sampled, window: tuple[float, float] | None, way: NDArray[np.intp]) -> None:
        self.sampled, self.rows = sampled, np.arange(len(sampled.values))
        start, stop, before, after = way[:4].tolist()
        parts = [(sampled.travel[:, start:stop], sampled.values[:, start:stop])]
        if window is not None and before:
            parts.insert(0, self._at(window[0]))
        if window is not None and after:
            parts.append(self._at(window[1]))
        self.motion, self.force = (np.hstack(each) if len(parts) > 1 else each[0] for each in zip(*parts, strict=True))
        self.peaks = way[4:].astype(bool)

    def _at(self, place: float) -> tuple[FloatArray, FloatArray]:
        """Return one travel and the forces of all curves there."""
        places = np.full((len(self.rows), 1), place)
        return places, self.sampled.exact(places, self.rows)

    @cached_property
    def _extremes(self) -> tuple[FloatArray, FloatArray]:
        """Return largest and smallest force, NaN where one of the samples has none."""
        motion, force, more = self.motion, self.force, self.sampled.peaks
        known = np.isfinite(force.sum(axis=1))
        if more is not None and self.peaks.any():
            more = more[:, self.peaks]
            heights = self.sampled.exact(more, self.rows)
            motion = np.concatenate([np.broadcast_to(motion, force.shape), more], axis=1)
            order = np.argsort(motion, axis=1, kind="stable")
            motion = np.take_along_axis(motion, order, axis=1)
            force = np.take_along_axis(np.concatenate([force, heights], axis=1), order, axis=1)
        high, low = extremes(lambda at: self.sampled.exact(at, self.rows), motion, force, bool(self.peaks.any()))
        return np.where(known, high, np.nan), np.where(known, low, np.nan)

    @property
    def mean(self) -> FloatArray:
        return np.asarray(self.force.mean(axis=1))

    @property
    def max(self) -> FloatArray:
        return self._extremes[0]

    @property
    def min(self) -> FloatArray:
        return self._extremes[1]

    @property
    def deviation(self) -> FloatArray:
        offset = self.force - self.force.mean(axis=1)[:, None]
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / (offset.shape[1] - 1)))

    @property
    def work(self) -> FloatArray:
        steps = np.diff(np.broadcast_to(self.motion, self.force.shape), axis=1)
        return np.asarray(np.einsum("ij,ij->i", steps, 0.5 * (self.force[:, 1:] + self.force[:, :-1])))

"""The forces of many cams inside a window, and what is measured over it: all curves have the same travel."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.closed import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

    Exact = Callable[[FloatArray], FloatArray]

_SLACK = 1e-9


class Spread:
    """The forces of one branch inside a window; `exact` gives them at any travels of each design."""

    def __init__(self, travel: FloatArray, force: FloatArray, window: tuple[float, float] | None, exact: Exact) -> None:
        """Cut the window out."""
        self.motion, self.force = (travel, force) if window is None else _inside(travel, force, window, exact)
        self.exact = exact

    @cached_property
    def _extremes(self) -> tuple[FloatArray, FloatArray]:
        return extremes(self.exact, self.motion, self.force)

    @cached_property
    def mean(self) -> FloatArray:
        """Mean force of each design [N]."""
        return np.asarray(self.force.mean(axis=1))

    @cached_property
    def max(self) -> FloatArray:
        """Largest force [N]."""
        return self._extremes[0]

    @cached_property
    def min(self) -> FloatArray:
        """Smallest force [N]."""
        return self._extremes[1]

    @cached_property
    def deviation(self) -> FloatArray:
        """Standard deviation (n - 1) of the force [N]."""
        offset = self.force - self.mean[:, None]
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / (offset.shape[1] - 1)))

    @cached_property
    def work(self) -> FloatArray:
        """Integral of the force over the travel [J]."""
        steps = np.diff(self.motion, axis=1)
        return np.asarray(np.einsum("ij,ij->i", steps, 0.5 * (self.force[:, 1:] + self.force[:, :-1])))


def _inside(
    travel: FloatArray, force: FloatArray, window: tuple[float, float], exact: Exact
) -> tuple[FloatArray, FloatArray]:
    """Return the samples in a window, its ends included; all curves have the same travel."""
    low, high = window
    slack, first = _SLACK * (high - low), travel[0]
    start, stop = int(np.searchsorted(first, low - slack)), int(np.searchsorted(first, high + slack, side="right"))
    parts = [(travel[:, start:stop], force[:, start:stop])]
    if start < stop and first[start] > low + slack:
        parts.insert(0, _at(low, len(travel), exact))
    if start < stop and first[stop - 1] < high - slack and stop < travel.shape[1]:
        parts.append(_at(high, len(travel), exact))
    return np.hstack([motion for motion, _ in parts]), np.hstack([effort for _, effort in parts])


def _at(place: float, count: int, exact: Exact) -> tuple[FloatArray, FloatArray]:
    """Return one travel and the forces of all curves there."""
    places = np.full((count, 1), place)
    return places, exact(places)

"""The forces of many cams inside a window, and what is measured over it: all curves have the same travel."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.curves import FloatArray

_SLACK = 1e-9


class Spread:
    """The forces of one branch inside a window."""

    def __init__(self, travel: FloatArray, force: FloatArray, window: tuple[float, float] | None) -> None:
        """Cut the window out."""
        self.motion, self.force = (travel, force) if window is None else _inside(travel, force, window)

    @cached_property
    def mean(self) -> FloatArray:
        """Mean force of each design [N]."""
        return np.asarray(self.force.mean(axis=1))

    @cached_property
    def max(self) -> FloatArray:
        """Largest force [N]."""
        return np.asarray(self.force.max(axis=1))

    @cached_property
    def min(self) -> FloatArray:
        """Smallest force [N]."""
        return np.asarray(self.force.min(axis=1))

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


def _inside(travel: FloatArray, force: FloatArray, window: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Return the samples in a window with its interpolated ends; all curves have the same travel."""
    low, high = window
    slack, first = _SLACK * (high - low), travel[0]
    start, stop = int(np.searchsorted(first, low - slack)), int(np.searchsorted(first, high + slack, side="right"))
    parts = [(travel[:, start:stop], force[:, start:stop])]
    if start < stop and first[start] > low + slack:
        parts.insert(0, _between(travel, force, start, low))
    if start < stop and first[stop - 1] < high - slack and stop < travel.shape[1]:
        parts.append(_between(travel, force, stop, high))
    return np.hstack([motion for motion, _ in parts]), np.hstack([effort for _, effort in parts])


def _between(travel: FloatArray, force: FloatArray, after: int, place: float) -> tuple[FloatArray, FloatArray]:
    left, right = travel[:, after - 1], travel[:, after]
    share = (place - left) / (right - left)
    effort = force[:, after - 1] + share * (force[:, after] - force[:, after - 1])
    return np.full((len(travel), 1), place), effort[:, None]

"""Metrics that are lengths of travel: how far the force stays constant.

Here the window only says what to compare with (its end, its centre, its mean);
the travel that is looked at is the whole branch. Places between two samples are
found by linear interpolation. A sample without equilibrium (no force) is
outside every band, and so is the way from there to the next sample. Where the model
is known at every place (`cfmkit.results.ClosedForm`) places are solved for, whatever the samples.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics import ranges_many
from cfmkit.metrics.traces import ROUNDING, Undefined

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.branch_views import Branch, Cycle, Interval


def range_95(branch: Branch) -> float:
    """Return d - c, with d the end of the window and c where F first reaches 0.95 F(d)."""
    return branch.ends[1] - _first_95(branch)


def range_95_fraction(branch: Branch) -> float:
    """Return (d - c) / d."""
    end = branch.ends[1]
    if end <= 0:
        raise Undefined("the displacement at the end is not positive")
    return (end - _first_95(branch)) / end


def _first_95(branch: Branch) -> float:
    """Return the first motion at which the effort has reached 95 % of that at the end of the window."""
    end = branch.ends[1]
    nominal = branch.at(end)
    if nominal == 0:
        raise Undefined(f"the {branch.kind} at the end is zero")
    if branch.closed is not None:
        return _known(float(branch.closed.solved[0][0]))
    motion, effort = branch.function
    before = int(motion.searchsorted(end))
    reached = effort[:before] / nominal >= 0.95 - ROUNDING
    first = int(reached.argmax()) if reached.any() else before
    if first == 0:
        return float(motion[0])
    place, level = (float(motion[first]), float(effort[first])) if first < before else (end, nominal)
    return _crossing((float(motion[first - 1]), place), (effort[first - 1] - 0.95 * nominal, level - 0.95 * nominal))


def _crossing(motion: Interval, height: tuple[float, float]) -> float:
    """Return where the line through two points is zero; the second place if it is nowhere."""
    step = height[1] - height[0]
    return motion[0] - height[0] * (motion[1] - motion[0]) / step if abs(step) > 0 else motion[1]


def band_range(branch: Branch, tolerance: float) -> float:
    """Return the widest interval around the reference pose in which ``|F / F_ref - 1|`` is within the tolerance."""
    motion, offset, here = branch.around
    if branch.closed is not None:
        return _known(float(ranges_many.band_range(branch.closed, tolerance)[0]))
    outside = ~(np.abs(offset) <= tolerance * (1 + ROUNDING))
    left, right = outside[:here].nonzero()[0], outside[here:].nonzero()[0]
    low = _edge(motion, offset, int(left[-1]), 1, tolerance) if len(left) else float(motion[0])
    high = _edge(motion, offset, here + int(right[0]), -1, tolerance) if len(right) else float(motion[-1])
    return high - low


def _known(value: float) -> float:
    """Return a value that is solved for.

    Raises
    ------
    Undefined
        If it is none: the model gives no force at the places that are asked about.
    """
    if not isfinite(value):
        raise Undefined("there is no equilibrium at the place it is measured against")
    return value


def _edge(motion: FloatArray, offset: FloatArray, bad: int, inward: int, tolerance: float) -> float:
    """Return where the offset leaves the band between the point `bad` and its neighbour inside."""
    level = tolerance if offset[bad] > 0 else -tolerance
    good = bad + inward
    place = (float(motion[bad]), float(motion[good]))
    return _crossing(place, (float(offset[bad]) - level, float(offset[good]) - level))


def band_range_05pct(branch: Branch) -> float:
    """Return `band_range` for 0.5 %."""
    return band_range(branch, 0.005)


def band_range_1pct(branch: Branch) -> float:
    """Return `band_range` for 1 %."""
    return band_range(branch, 0.01)


def band_range_5pct(branch: Branch) -> float:
    """Return `band_range` for 5 %."""
    return band_range(branch, 0.05)


def usable_stroke(cycle: Cycle) -> float:
    """Return the length of the largest usable interval; zero where there is none."""
    start, end = cycle.usable or (0.0, 0.0)
    return end - start


def usable_start(cycle: Cycle) -> float:
    """Return where the largest usable interval starts."""
    return _usable(cycle)[0]


def usable_end(cycle: Cycle) -> float:
    """Return where the largest usable interval ends."""
    return _usable(cycle)[1]


def _usable(cycle: Cycle) -> Interval:
    if cycle.usable is None:
        raise Undefined("no part of the travel is usable")
    return cycle.usable

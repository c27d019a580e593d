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

from cfmkit.metrics import many
from cfmkit.metrics.traces import ROUNDING, Undefined

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.subjects import Branch, Cycle
    from cfmkit.metrics.traces import Trace

Interval = tuple[float, float]


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
        return _known(float(many.band_range(branch.closed, tolerance)[0]))
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


def usable_interval(cycle: Cycle) -> Interval | None:
    """Return the largest interval in which force and stress of every branch keep their limits.

    A place counts only if every state of the path at that place keeps them, so
    that a branch that folds back needs no sorting.
    """
    reference = cycle.frame.target or _mean(cycle)
    travel = (max(b.extent[0] for b in cycle.branches), min(b.extent[1] for b in cycle.branches))
    if cycle.closed and len(cycle.frame.valid or (travel,)) == 1:
        return _solved_interval(cycle, reference, (cycle.frame.valid or (travel,))[0][0])
    bad = sorted(interval for branch in cycle.branches for interval in _bad(branch, reference))
    allowed = cycle.frame.valid if cycle.frame.valid is not None else (travel,)
    gaps = [gap for lo, hi in allowed for gap in _gaps(max(lo, travel[0]), min(hi, travel[1]), bad)]
    longest = max((high - low for low, high in gaps), default=0.0)
    # the first of those that are equally long but for rounding
    return next((gap for gap in gaps if gap[1] - gap[0] >= longest * (1 - 1e-9)), None)


def _solved_interval(cycle: Cycle, reference: float, valid: float) -> Interval | None:
    """Return `usable_interval` of branches that are known at every place, from where the mechanism works on."""
    start, end = many.usable_interval(cycle.closed, np.array([reference]), cycle.frame.band, np.array([valid]))
    return None if np.isnan(start[0]) else (float(start[0]), float(end[0]))


def _mean(cycle: Cycle) -> float:
    """Return the mean of the branches' means, each over its points in the window, or the window where it is solved."""
    value = sum(branch.level for branch in cycle.branches) / len(cycle.branches)
    if value == 0:
        raise Undefined("there is no target, and the mean is zero")
    return value


def _gaps(lo: float, hi: float, bad: Iterable[Interval]) -> Iterable[Interval]:
    """Yield what the sorted bad intervals leave of [lo, hi]."""
    for start, end in bad:
        if start > lo and min(start, hi) > lo:
            yield lo, min(start, hi)
        lo = max(lo, end)
    if hi > lo:
        yield lo, hi


def _bad(branch: Branch, reference: float) -> list[Interval]:
    """Return the intervals of the motion in which a branch breaks a limit."""
    frame, trace = branch.frame, branch.trace
    ratio = trace.effort / reference - 1
    band = frame.band * (1 + ROUNDING)
    # two one-sided limits: the absolute value has a kink that linear interpolation would miss
    broken = _excess(trace, ratio - band) + _excess(trace, -band - ratio)
    for one in (trace, *branch.beside):
        if frame.allowable_stress is not None and one.stress is not None:
            broken += _excess(one, one.stress - frame.allowable_stress * (1 + ROUNDING))
    return broken


def _excess(trace: Trace, height: FloatArray) -> list[Interval]:
    """Return the intervals of the motion over which a piecewise linear height is positive, or no number."""
    bad = ~(height <= 0)
    if not bad.any():
        return []
    motion, edges = trace.motion, (bad[1:] != bad[:-1]).nonzero()[0]
    places = motion[edges] - height[edges] * (motion[edges + 1] - motion[edges]) / (height[edges + 1] - height[edges])
    places = np.where(np.isfinite(places), places, motion[edges + bad[edges]])
    ends = np.concatenate((motion[: int(bad[0])], places, motion[len(motion) - int(bad[-1]) :])).reshape(-1, 2).tolist()
    if not trace.way:  # between its ends, a run of bad points may reach farther than they do
        runs = np.split(motion, edges + 1)[int(not bad[0]) :: 2]
        ends = [[*pair, float(run.min()), float(run.max())] for pair, run in zip(ends, runs, strict=True)]
    return [(min(pair), max(pair)) for pair in ends]

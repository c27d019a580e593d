"""All branches of a curve together, and where all of them keep the limits of force and stress."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics import branches as winding_branches
from cfmkit.metrics import ranges_many
from cfmkit.metrics.branch_views import Branch, MeasuringFrame
from cfmkit.metrics.branches import BAND_RTOL, BranchTrace, Undefined, Window, traces

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.metrics.ranges_many import ManyBranches
    from cfmkit.results import ClosedForm, WindingPath
    from cfmkit.specs.evaluable_target_curve import TargetCurve

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Cycle:
    """All branches of a curve together."""

    branches: tuple[Branch, ...]
    frame: MeasuringFrame

    @property
    def closed(self) -> tuple[ManyBranches, ...]:
        """All branches at every place; empty where the model does not give them."""
        return tuple(branch.closed for branch in self.branches if branch.closed is not None)

    @cached_property
    def usable(self) -> tuple[float, float] | None:
        """Start and end of the largest usable interval; None if the mechanism is usable nowhere."""
        return usable_interval(self)


def cycle(curve: Curve, frame: MeasuringFrame, window: Window | None = None) -> Cycle:
    """Return a curve as metrics see it."""
    return Cycle(tuple(Branch(trace, curve.kind, frame, window) for trace in traces(curve)), frame)


def usable_interval(cycle: Cycle) -> Interval | None:
    """Return the largest interval in which force and stress of every branch keep their limits.

    A place counts only if every state of the path at that place keeps them, so
    that a branch that folds back needs no sorting.
    """
    curve, cycle = cycle.frame.curve, _level_cycle(cycle)
    reference = cycle.frame.target if cycle.frame.has_target() else _mean(cycle)
    assert reference is not None
    travel = (max(b.extent[0] for b in cycle.branches), min(b.extent[1] for b in cycle.branches))
    if cycle.frame.winding is not None:
        travel = winding_branches.reach(cycle.frame.winding)
    allowed = cycle.frame.valid if cycle.frame.valid is not None else (travel,)
    if cycle.closed and len(allowed) == 1:  # known at every place: its ends are solved for
        valid, until = np.array(allowed).T
        start, end = ranges_many.usable_interval(cycle.closed, np.array([reference]), cycle.frame.band, valid, until)
        return None if np.isnan(start[0]) else (float(start[0]), float(end[0]))
    bad = sorted(interval for branch in cycle.branches for interval in _bad(branch, reference, curve))
    gaps = [gap for lo, hi in allowed for gap in _gaps(max(lo, travel[0]), min(hi, travel[1]), bad)]
    longest = max((high - low for low, high in gaps), default=0.0)
    # the first of those that are equally long but for rounding
    return next((gap for gap in gaps if gap[1] - gap[0] >= longest * (1 - 1e-9)), None)


def _level_cycle(cycle: Cycle) -> Cycle:
    """Return a cycle that follows a curve as one that is to be level: its offsets from it, on its largest effort."""
    curve = cycle.frame.curve
    if curve is None:
        return cycle
    low, high = max(b.extent[0] for b in cycle.branches), min(b.extent[1] for b in cycle.branches)
    low, high = max(low, curve.extent[0]), min(high, curve.extent[1])
    if not (low < high and (size := curve.largest(low, high)) > (cycle.frame.effort_error or 0.0)):
        raise Undefined("the target curve is not defined for this travel")
    valid = [(max(a, low), min(b, high)) for a, b in cycle.frame.valid or ((low, high),)]
    model = None if cycle.frame.closed is None else LevelledModel(cycle.frame.closed, curve, size)
    frame = replace(cycle.frame, target=size, curve=None, closed=model, valid=tuple((a, b) for a, b in valid if a < b))
    branches = (
        replace(b, frame=frame, trace=replace(b.trace, effort=b.trace.effort - curve.evaluate(b.trace.motion) + size))
        for b in cycle.branches
    )
    return Cycle(tuple(branches), frame)


@dataclass(frozen=True, eq=False)
class LevelledModel:
    """A model less a curve, on a constant effort (a `cfmkit.results.ClosedForm`)."""

    model: ClosedForm
    curve: TargetCurve
    size: float

    @property
    def places(self) -> FloatArray:
        """Those of the model [m or rad]."""
        return self.model.places

    @property
    def peaks(self) -> FloatArray:
        """Those of the model [m or rad]."""
        return self.model.peaks

    def effort(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the effort less the curve, plus the constant [N or N m]."""
        return np.asarray(self.model.effort(branch, places) - self.curve.evaluate(places) + self.size)

    def stress(self, branch: str, places: FloatArray) -> FloatArray:
        """Return that of the model [Pa]."""
        return self.model.stress(branch, places)


def _mean(cycle: Cycle) -> float:
    """Return the mean of the branches' means, each over its points in the window, or the window where it is solved."""
    value = sum(branch.level for branch in cycle.branches) / len(cycle.branches)
    if abs(value) <= max(branch.error for branch in cycle.branches):
        raise Undefined("there is no target, and the mean is zero within its numerical error")
    return value


def _gaps(lo: float, hi: float, bad: Iterable[Interval]) -> Iterable[Interval]:
    """Yield what the sorted bad intervals leave of [lo, hi]."""
    for start, end in bad:
        if start > lo and min(start, hi) > lo:
            yield lo, min(start, hi)
        lo = max(lo, end)
    if hi > lo:
        yield lo, hi


def _bad(branch: Branch, reference: float, curve: TargetCurve | None) -> list[Interval]:
    """Return the intervals of the motion in which a branch breaks a limit; `curve`: what its effort is to follow."""
    frame, trace = branch.frame, branch.trace
    if frame.winding is not None:
        return _bad_on_way(frame.winding, frame, reference, curve)
    ratio = trace.effort / reference - 1
    band = frame.band * (1 + BAND_RTOL)
    # two one-sided limits: the absolute value has a kink that linear interpolation would miss
    broken = _excess(trace, ratio - band) + _excess(trace, -band - ratio)
    for each_trace in (trace, *branch.beside):
        if frame.allowable_stress is not None and each_trace.stress is not None:
            broken += _excess(each_trace, each_trace.stress - frame.allowable_stress * (1 + BAND_RTOL))
    return broken


def _bad_on_way(
    path: WindingPath, frame: MeasuringFrame, reference: float, curve: TargetCurve | None
) -> list[Interval]:
    """Return the same of a branch that is known at every place of its way."""
    band, allowed = frame.band * (1 + BAND_RTOL), frame.allowable_stress

    def measure_excess(ways: FloatArray) -> FloatArray:
        motion, effort = path.states(ways)
        return np.asarray((effort if curve is None else effort - curve.evaluate(motion) + reference) / reference - 1)

    bad = winding_branches.list_broken_intervals(path, lambda ways: measure_excess(ways) - band)
    bad += winding_branches.list_broken_intervals(path, lambda ways: -band - measure_excess(ways))
    if allowed is not None:
        bad += winding_branches.list_broken_intervals(path, lambda ways: path.stress(ways) / allowed - (1 + BAND_RTOL))
    return bad


def _excess(trace: BranchTrace, height: FloatArray) -> list[Interval]:
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

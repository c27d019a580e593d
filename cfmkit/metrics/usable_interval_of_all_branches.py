"""All branches of curves together, and where all of them keep the limits of force and stress."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.metrics.branches import BAND_RTOL, Undefined, list_broken_intervals, reach
from cfmkit.metrics.rows_in_window import RowsInWindow, restrict_to_window
from cfmkit.numerics.roots import last_places

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.curve_rows import CurveRows, Ends, RowSamples
    from cfmkit.metrics.definition import Definition

Interval = tuple[float, float]


class UsableInterval(NamedTuple):
    """The largest interval in which every branch of curves keeps its limits, (d,) each; NaN where nothing is."""

    stroke: FloatArray  # its length: 0 where there is none
    start: FloatArray
    end: FloatArray


@dataclass(frozen=True, eq=False)
class CycleRows:
    """All branches of curves together, by name."""

    branches: Mapping[str, RowsInWindow]

    @classmethod
    def from_curves(cls, curves: Mapping[str, CurveRows], window: Ends | None) -> CycleRows:
        """Return branches in windows, (d,) each; None: over their full travel."""
        return cls({name: restrict_to_window(rows, window) for name, rows in curves.items()})

    @property
    def first(self) -> RowsInWindow:
        """The first branch."""
        return next(iter(self.branches.values()))

    @cached_property
    def usable(self) -> UsableInterval:
        """The largest interval in which every branch keeps its limits.

        A place counts only if every state of the path at that place keeps them, so that a branch that folds back needs
        no sorting.
        """
        branches = _level_branches(list(self.branches.values()))
        target = _find_reference(branches)
        is_known, target = np.isfinite(target), np.where(np.isfinite(target), target, 1.0)
        valid = branches[0].curves.frame.valid
        if all(rows.curves.effort is not None for rows in branches) and (valid is None or len(valid) == 1):
            start, end = _solve_interval(branches, target)
        else:
            start, end = np.array([_find_interval_between_points(branches, float(target[0]))]).T
        stroke = np.where(np.isnan(start), 0.0, end - start)
        return UsableInterval(*(np.where(is_known, values, np.nan) for values in (stroke, start, end)))


def _find_reference(branches: Sequence[RowsInWindow]) -> FloatArray:
    """Return the effort that all are compared with, (d,): the target, else the mean of the branches' means."""
    first = branches[0]
    if first.has_target.all():
        return first.curves.target
    levels: FloatArray = np.mean([rows.level for rows in branches], axis=0)
    zero = np.abs(levels) <= np.max([rows.curves.error for rows in branches], axis=0)
    first.require(first.has_target | ~zero, "there is no target, and the mean is zero within its numerical error")
    return np.where(first.has_target, first.curves.target, np.where(zero, np.nan, levels))


def _level_branches(branches: Sequence[RowsInWindow]) -> Sequence[RowsInWindow]:
    """Return branches that follow a curve as ones that are to be level: offsets from it, on its largest effort."""
    first = branches[0]
    curve = first.curves.followed
    if curve is None:
        return branches
    low, high = (
        np.clip(pick([rows.curves.extent[end] for rows in branches], axis=0), *curve.extent)
        for end, pick in enumerate((np.max, np.min))
    )
    size, (start, stop) = first.largest_followed(low, high), first.curves.valid
    first.require(~np.isnan(size), "the target curve is not defined for this travel")
    frame, valid = first.curves.frame, (np.maximum(start, low), np.minimum(stop, high))
    if frame.valid is not None:
        kept = [(max(a, float(low[0])), min(b, float(high[0]))) for a, b in frame.valid]
        frame = replace(frame, valid=tuple((a, b) for a, b in kept if a < b))
        valid = (np.array(frame.valid[0][:1]), np.array(frame.valid[0][1:])) if frame.valid else valid
    levelled = (replace(rows.curves.level_along(curve, size), valid=valid, frame=frame) for rows in branches)
    return [RowsInWindow(curves, rows.window) for curves, rows in zip(levelled, branches, strict=True)]


# --- branches that are known at every place: the ends are solved for --------------------------------------------------


def _solve_interval(branches: Sequence[RowsInWindow], target: FloatArray) -> Ends:
    """Return start and end of the largest usable interval of each row, (d,) each; NaN where there is none."""
    first = branches[0].curves
    motion, (valid, until) = first.dense, first.valid
    last, every, count = motion[:, -1], np.arange(len(motion)), motion.shape[1]
    reached = last - motion[:, 0]
    # the last place itself, but for rounding, is no limit
    limits = valid, np.where(until < last - 1e-9 * reached, until, np.inf)
    width = np.broadcast_to(first.band * (1 + BAND_RTOL), len(motion))

    def excess(at: FloatArray, rows: NDArray[np.intp], on_dense_places: bool = False) -> FloatArray:
        """Return by what share that exceeds its limit which does so most; NaN where one is not a number."""
        start, stop = (limit[rows, None] for limit in limits)
        worst = np.maximum(start - at, at - stop) / reached[rows, None]
        for branch in branches:
            curves = branch.curves
            if curves.effort is not None:
                effort = curves.dense_effort if on_dense_places else curves.effort(at, rows)
                worst = np.maximum(worst, np.abs(effort / target[rows, None] - 1) - width[rows, None])
            if curves.stress is not None and curves.stress.limits:
                worst = np.maximum(worst, curves.stress.excess(at, rows))
        return worst

    good = excess(motion, every, on_dense_places=True) <= 0
    begins, ends = good.copy(), good.copy()
    begins[:, 1:] &= ~good[:, :-1]
    ends[:, :-1] &= ~good[:, 1:]
    since = np.maximum.accumulate(np.where(begins, np.arange(count), 0), axis=1)
    # Between two places outside and inside the last bit of length is unknown: runs that are equally long but
    # for that are told apart by their first place, as where places are interpolated.
    length = np.where(ends, motion - np.take_along_axis(motion, since, axis=1), -1.0)
    stop = (length >= length.max(axis=1, keepdims=True) * (1 - 1e-9)).argmax(axis=1)
    start = since[every, stop]
    before, after = np.maximum(start - 1, 0), np.minimum(stop + 1, count - 1)
    inside, outside = (np.stack([motion[every, k] for k in pair], axis=1) for pair in ((start, stop), (before, after)))
    low, high = last_places(lambda at, ends: excess(at, ends // 2), inside, outside).T
    lost = np.flatnonzero(~good.any(axis=1))  # the whole interval may lie between two samples
    if lost.size:
        low[lost], high[lost] = _intervals_between_places(first, target, excess, lost)
    some = high > low
    return np.where(some, low, np.nan), np.where(some, high, np.nan)


def _intervals_between_places(
    curves: CurveRows, target: FloatArray, excess: Callable[..., FloatArray], rows: NDArray[np.intp]
) -> Ends:
    """Return the interval around the first place where the effort passes the target between two places; NaN without.

    ``excess(at, rows)`` is by what share the most exceeded limit is exceeded at places (r, n).
    """
    start, end = np.full((2, len(rows)), np.nan)
    efforts, exact = curves.dense_effort[rows], curves.effort
    above = efforts > target[rows, None]
    passes = (above[:, 1:] != above[:, :-1]) & np.isfinite(efforts[:, 1:] + efforts[:, :-1])
    some = np.flatnonzero(passes.any(axis=1))
    if exact is None or not some.size:
        return start, end
    some_rows, step = rows[some], passes[some].argmax(axis=1)
    left, right = curves.dense[some_rows, step][:, None], curves.dense[some_rows, step + 1][:, None]
    sign = np.where(above[some, step], -1.0, 1.0)[:, None]

    def short(at: FloatArray, few: NDArray[np.intp]) -> FloatArray:
        goal = target[some_rows[few], None]
        return np.asarray(sign[few] * (exact(at, some_rows[few]) - goal) / np.abs(goal))

    middle = last_places(short, left, right)
    kept = np.flatnonzero(excess(middle, some_rows)[:, 0] <= 0)
    if kept.size:
        inside, outside = np.hstack([middle, middle])[kept], np.hstack([left, right])[kept]
        kept_ends = last_places(lambda at, ends: excess(at, some_rows[kept][ends // 2]), inside, outside)
        start[some[kept]], end[some[kept]] = kept_ends.T
    return start, end


# --- one curve that is known at its points, or has several valid intervals --------------------------------------------


def _find_interval_between_points(branches: Sequence[RowsInWindow], reference: float) -> Interval:
    """Return the largest interval in which no branch breaks a limit; NaN if there is none."""
    frame, (low, high) = branches[0].curves.frame, (end.item() for end in branches[0].curves.valid)
    extents = [rows.curves.extent for rows in branches] if frame.winding is None else [reach(frame.winding)]
    travel = float(np.max([start for start, _ in extents])), float(np.min([stop for _, stop in extents]))
    bad = sorted(interval for rows in branches for interval in _list_bad(rows, reference))
    allowed = ((low, high),) if frame.valid is None else frame.valid
    gaps = [gap for lo, hi in allowed for gap in _gaps(max(lo, travel[0]), min(hi, travel[1]), bad)]
    longest = max((high - low for low, high in gaps), default=0.0)
    # the first of those that are equally long but for rounding
    return next((gap for gap in gaps if gap[1] - gap[0] >= longest * (1 - 1e-9)), (np.nan, np.nan))


def _gaps(lo: float, hi: float, bad: Iterable[Interval]) -> Iterable[Interval]:
    """Yield what the sorted bad intervals leave of [lo, hi]."""
    for start, end in bad:
        if start > lo and min(start, hi) > lo:
            yield lo, min(start, hi)
        lo = max(lo, end)
    if hi > lo:
        yield lo, hi


def _list_bad(rows: RowsInWindow, reference: float) -> list[Interval]:
    """Return the intervals of the motion in which a branch breaks a limit."""
    curves = rows.curves
    if curves.frame.winding is not None:
        return _list_bad_on_way(curves, reference)
    samples, band = curves.samples, float(curves.band) * (1 + BAND_RTOL)
    ratio = samples.values / reference - 1
    # two one-sided limits: the absolute value has a kink that linear interpolation would miss
    broken = _excess(samples, ratio - band) + _excess(samples, -band - ratio)
    if (stress := curves.stress) is not None and stress.limits:
        for item in stress.samples:
            broken += _excess(item, item.values - stress.allowable * (1 + BAND_RTOL))
    return broken


def _list_bad_on_way(curves: CurveRows, reference: float) -> list[Interval]:
    """Return the same of a branch that is known at every place of its way."""
    frame, path, band = curves.frame, curves.frame.winding, float(curves.band) * (1 + BAND_RTOL)
    curve, allowed = frame.curve, frame.allowable_stress
    assert path is not None

    def measure_excess(ways: FloatArray) -> FloatArray:
        motion, effort = path.states(ways)
        return np.asarray((effort if curve is None else effort - curve.evaluate(motion) + reference) / reference - 1)

    bad = list_broken_intervals(path, lambda ways: measure_excess(ways) - band)
    bad += list_broken_intervals(path, lambda ways: -band - measure_excess(ways))
    if allowed is not None:
        bad += list_broken_intervals(path, lambda ways: path.stress(ways) / allowed - (1 + BAND_RTOL))
    return bad


def _excess(samples: RowSamples, heights: FloatArray) -> list[Interval]:
    """Return the intervals of the motion of one curve over which a piecewise linear height is positive, or NaN."""
    motion, height = samples.motion[0], heights[0]
    bad = ~(height <= 0)
    if not bad.any():
        return []
    edges = (bad[1:] != bad[:-1]).nonzero()[0]
    places = motion[edges] - height[edges] * (motion[edges + 1] - motion[edges]) / (height[edges + 1] - height[edges])
    places = np.where(np.isfinite(places), places, motion[edges + bad[edges]])
    ends = np.concatenate((motion[: int(bad[0])], places, motion[len(motion) - int(bad[-1]) :])).reshape(-1, 2).tolist()
    if (np.diff(motion) < 0).any():  # between its ends, a run of bad points may reach farther than they do
        runs = np.split(motion, edges + 1)[int(not bad[0]) :: 2]
        ends = [[*pair, float(run.min()), float(run.max())] for pair, run in zip(ends, runs, strict=True)]
    return [(min(pair), max(pair)) for pair in ends]


@np.errstate(all="ignore")
def metric_of_rows(definition: Definition, cycle: CycleRows, time: float | None = None) -> Mapping[str, FloatArray]:
    """Return a metric of curves by branch, (d,) each [SI]; NaN where it has no value.

    Parameters
    ----------
    definition : Definition
        The metric.
    cycle : CycleRows
        The branches of the curves over the window of the metric.
    time : float, optional
        That in its brackets, where it is one of a time [s].

    Returns
    -------
    mapping
        What is no matter of one branch stands under the name "" alone.
    """
    function, branches = definition.function, cycle.branches
    if function is None or not branches or (definition.argument and time is None):
        return {}
    if time is not None:
        function = partial(function, time=time)
    if definition.scope != "branch":
        return {"": _values_or_nan(function, cycle, len(cycle.first))}
    values = {name: _values_or_nan(function, rows, len(rows)) for name, rows in branches.items()}
    if not definition.windowed or len(cycle.first) == 1:  # one row by itself has said already whether it is known
        return values
    return {name: np.where(rows.is_known, values[name], np.nan) for name, rows in branches.items()}


def _values_or_nan(function: Callable[..., FloatArray], subject: object, count: int) -> FloatArray:
    try:
        return function(subject)
    except Undefined:
        return np.full(count, np.nan)

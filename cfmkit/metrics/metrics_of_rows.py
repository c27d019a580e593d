"""Metrics of many curves at once, each of them a row, of models that know the effort at every place.

The values are those of `metric_values` for each curve alone: the same samples in the window, the same places next to
which an extreme may stand, the same ends that are solved for. Curves may have different grids and numbers of points.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.metrics import ranges_many
from cfmkit.metrics.branch_views import ZERO_EFFORT_SHARE
from cfmkit.metrics.branches import BAND_RTOL, WINDOW_RTOL
from cfmkit.metrics.continuous_means_and_extremes import FEW_SAMPLES, extremes, extremes_of_all, mean_of_rows
from cfmkit.metrics.ranges_many import ManyBranches
from cfmkit.metrics.spread import ManyWindows, static_balance
from cfmkit.metrics.window_metrics import NO_STRESS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.metrics.definition import Definition
    from cfmkit.specs.evaluable_target_curve import TargetCurve

    Ends = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class RowSamples:
    """Values over a motion, each curve a row: after the end of a row its last place and value are repeated."""

    motion: FloatArray  # (d, n), increasing [m or rad]
    values: FloatArray  # (d, n)
    count: NDArray[np.intp]  # (d,) of each row

    def find_between(self, window: Ends, slack: FloatArray | float = 0.0) -> NDArray[np.bool_]:
        """Return which samples are inside of windows, the ends left out, (d, n)."""
        low, high = window[0] + slack, window[1] - slack
        motion, count = self.motion, self.count
        if motion.strides[0] == 0 and all((end == end[0]).all() for end in (low, high, count)):  # all are alike
            motion, low, high, count = motion[:1], low[:1], high[:1], count[:1]
        inside = (motion > low[:, None]) & (motion < high[:, None])
        if (count < motion.shape[1]).any():
            inside &= np.arange(motion.shape[1]) < count[:, None]
        return np.broadcast_to(inside, self.motion.shape)

    def with_ends(self, window: Ends, values: FloatArray, slack: FloatArray | float = 0.0) -> RowSamples:
        """Return the samples inside of windows and their ends, with values (d, 2) there."""
        inside, ends = self.find_between(window, slack), np.stack(window, axis=1)
        if inside.strides[0] == 0:  # all are alike
            own = slice(int(inside[0].argmax()), int(inside[0].argmax() + inside[0].sum()))
            motion = np.concatenate([ends[0, :1], self.motion[0, own], ends[0, 1:]])
            inner = np.concatenate([values[:, :1], self.values[:, own], values[:, 1:]], axis=1)
            return RowSamples(np.broadcast_to(motion, inner.shape), inner, np.full(len(inner), len(motion)))
        count = inside.sum(axis=1) + 2
        motion, inner = (
            _pack_rows(item, inside, count, last[:, :1], last[:, 1:])
            for item, last in ((self.motion, ends), (self.values, values))
        )
        return RowSamples(motion, inner, count)

    def extremes(self, function: Callable[[FloatArray], FloatArray], uneven: Any = False) -> Ends:
        """Return the largest and the smallest value of a function of each row next to its samples, (d,) each."""
        return extremes(function, self.motion, self.values, uneven, self.count - 1)

    def extremes_with(
        self, function: Callable[[FloatArray], FloatArray], places: FloatArray, values: FloatArray, uneven: Any
    ) -> Ends:
        """Return the same next to samples and other places, (d, k), which lie between the ends of a row."""
        if not places.shape[1]:
            return self.extremes(function, uneven)
        return extremes_of_all(function, (self.motion, self.values, self.count - 1), places, values, uneven)


def _pack_rows(
    values: FloatArray, kept: NDArray[np.bool_], count: NDArray[np.intp], first: FloatArray, last: FloatArray
) -> FloatArray:
    """Return what is kept, side by side, of each row between its first and last value, (d, 1), repeated behind.

    `count` is the length of each row, both ends included.
    """
    packed = np.empty((len(values), int(count.max())))
    packed[:, :1], packed[:, -1:] = first, last
    begins = kept.argmax(axis=1)
    if (begins == begins[0]).all() and (count == count[0]).all():
        packed[:, 1:-1] = values[:, begins[0] : begins[0] + count[0] - 2]
        return packed
    packed[:, 1:-1] = last
    packed[:, 1:-1][np.arange(1, packed.shape[1] - 1) < count[:, None] - 1] = values[kept]
    return packed


@dataclass(frozen=True, eq=False)
class StressRows:
    """The largest stress of many mechanisms."""

    read: Callable[[], Sequence[RowSamples]]  # at the points of each load case, that of the curve first [Pa]
    at: Callable[[FloatArray, Any], FloatArray]  # of all load cases at places of some rows, (k, m), (k,) -> (k, m) [Pa]
    allowable: FloatArray  # (d,) NaN if there is none [Pa]
    # between two places of each row, (d,), (d,) -> (d,) [Pa]; None: to be looked for from the points on
    largest: Callable[[FloatArray, FloatArray], FloatArray] | None = None

    @cached_property
    def samples(self) -> Sequence[RowSamples]:
        """Values at the points."""
        return self.read()


@dataclass(frozen=True, eq=False, repr=False)
class CurveRows(ShortRepr):
    """One branch of many curves, one a row."""

    samples: RowSamples  # efforts at the points [N or N m]
    # returns (d, q) increasing places, so dense that the effort hides nothing between two; may be repeated
    find_dense: Callable[[], FloatArray]
    effort: Callable[[FloatArray, Any], FloatArray]  # at places of some rows, (k, m), (k,) or None for all -> (k, m)
    error: FloatArray  # (d,) numerical error of the effort
    target: FloatArray  # (d,) effort that is wanted, NaN if there is none
    band: FloatArray | float  # (d,), or for all: half width of the band of `usable_stroke`, as a fraction
    valid: Ends  # (d,) each, from where to where the mechanism works as intended
    part_efforts: Callable[[FloatArray], FloatArray] | None = None  # largest of one spring or member, (d, m) -> (d, m)
    stress: StressRows | None = None
    kind: Kind = "force"
    pose: FloatArray | None = None  # (d,) where bands are taken; default: the middle of the window
    # (d, k) places next to which an extreme may stand that the points miss, NaN behind the last of a row; default: all
    # dense ones
    peaks: FloatArray | None = None
    travel: Ends | None = None  # (d,) each, of which windows may be shares; default: from end to end
    traced: bool = False  # whether every place takes an equilibrium of its own
    followed: TargetCurve | None = None  # what every effort is to follow
    _windows: dict[Any, RowsInWindow] = field(default_factory=dict, init=False, repr=False)

    def all_at(self, places: FloatArray) -> FloatArray:
        """Return the effort at places of every row, (d, m)."""
        return self.effort(places, None)

    @cached_property
    def heights(self) -> FloatArray:
        """The effort at the peaks; NaN behind the last of a row."""
        if self.peaks is None:
            return self.dense_effort
        known = np.isfinite(self.peaks)
        return np.where(known, self.all_at(np.where(known, self.peaks, self.samples.motion[:, :1])), np.nan)

    @cached_property
    def dense(self) -> FloatArray:
        """Dense places, (d, q)."""
        return self.find_dense()

    @cached_property
    def dense_effort(self) -> FloatArray:
        """The effort at the dense places."""
        return self.all_at(self.dense)

    @cached_property
    def extent(self) -> Ends:
        """First and last place of each row."""
        return self.samples.motion[:, 0], self.samples.motion[:, -1]

    def level_along(self, curve: TargetCurve, size: FloatArray) -> CurveRows:
        """Return curves less one that they are to follow, on constant efforts (d,)."""

        def effort(places: FloatArray, rows: Any) -> FloatArray:
            level = size if rows is None else size[rows]
            return np.asarray(self.effort(places, rows) - curve.evaluate(places) + level[:, None])

        return replace(self, effort=effort, target=size, followed=None)

    def restrict_to_window(self, window: Ends | None) -> RowsInWindow:
        """Return the curves in windows, (d,) each; None: over their full travel."""
        key = None if window is None else tuple(end.tobytes() for end in window)
        if key not in self._windows:
            self._windows[key] = RowsInWindow(self, self.extent if window is None else window)
        return self._windows[key]


@dataclass(frozen=True, eq=False)
class RowsInWindow:
    """Curves that are measured between two places, (d,) each."""

    curves: CurveRows
    ends: Ends

    @cached_property
    def covered(self) -> NDArray[np.bool_]:
        """Which curves reach both ends."""
        (first, last), (low, high) = self.curves.extent, self.ends
        slack = WINDOW_RTOL * (high - low)
        return (first <= low + slack) & (last >= high - slack)

    @property
    def is_known(self) -> NDArray[np.bool_]:
        """Which curves reach both ends and have an effort at every point between."""
        return self.covered & np.isfinite(self.many.mean)

    def where_known(self, values: FloatArray) -> FloatArray:
        """Return values of curves; NaN for those that are not known all over the window."""
        return np.where(self.is_known, values, np.nan)

    @cached_property
    def _cut(self) -> Ends:
        """The ends, not beyond those of the curves."""
        first, last = self.curves.extent
        return np.clip(self.ends[0], first, last), np.clip(self.ends[1], first, last)

    @cached_property
    def inside(self) -> RowSamples:
        """The efforts at the points in the window and at its ends."""
        if self.ends is self.curves.extent:
            return self.curves.samples
        low, high = self._cut
        at_ends = self.curves.all_at(np.stack([low, high], axis=1))
        return self.curves.samples.with_ends((low, high), at_ends, WINDOW_RTOL * (high - low))

    @cached_property
    def _peaks(self) -> tuple[FloatArray, FloatArray]:
        """The peaks in the window and the efforts there, (d, k), in order; for others an end of the window stands.

        (d, 0) where no row has a peak in its window.
        """
        curves, inside = self.curves, self.inside
        places = curves.dense if curves.peaks is None else curves.peaks
        low, high = (end[:, None] for end in self._cut)
        if not ((places > low) & (places < high)).any():
            return places[:, :0], places[:, :0]
        heights = curves.heights
        if not np.isfinite(heights[(places > low) & (places < high)]).all():
            places = np.where(np.isfinite(heights), places, np.nan)  # places without an effort go behind all others
            order = np.argsort(places, axis=1)
            places, heights = np.take_along_axis(places, order, 1), np.take_along_axis(heights, order, 1)
        is_early, own = places <= low, (places > low) & (places < high)
        ends = np.where(is_early, inside.values[:, :1], inside.values[:, -1:])
        return np.where(own, places, np.where(is_early, low, high)), np.where(own, heights, ends)

    @cached_property
    def _uneven(self) -> NDArray[np.bool_]:
        curves, places, (low, high) = self.curves, self._peaks[0], self._cut
        count = np.isfinite(curves.dense if curves.peaks is None else curves.peaks).sum(axis=1)
        is_inside = (places > low[:, None]) & (places < high[:, None])
        return np.asarray(is_inside.any(axis=1) & (count < FEW_SAMPLES))

    def _extremes(self, _motion: FloatArray, _effort: FloatArray) -> Ends:
        return self.inside.extremes_with(self.curves.all_at, *self._peaks, self._uneven)

    @cached_property
    def many(self) -> ManyWindows:
        """Mean, extremes and deviation."""
        inside = self.inside
        points = None if (inside.count == inside.motion.shape[1]).all() else inside.count
        return ManyWindows(inside.motion, inside.values, self._extremes, self.curves.error, points)

    @cached_property
    def branches(self) -> ManyBranches:
        """The whole curves, with the ends of the window."""
        curves, stress = self.curves, self.curves.stress
        excess = None
        if stress is not None and np.isfinite(stress.allowable).any():

            def excess(at: FloatArray, rows: Any) -> FloatArray:
                allowable = stress.allowable[rows, None]
                share = stress.at(at, rows) / allowable - (1 + BAND_RTOL)
                return np.where(np.isfinite(allowable), share, -np.inf)

        ends, error = self.ends, curves.error
        return ManyBranches(
            curves.dense, curves.dense_effort, *ends, curves.effort, excess, curves.pose, error, curves.traced
        )

    # --- metrics, (d,) each -----------------------------------------------------------------------------------------

    def static_balance(self) -> FloatArray:
        """Return the largest effort over the largest of one spring or member."""
        function = self.curves.part_efforts
        if function is None:
            return np.full(len(self.ends[0]), np.nan)
        sizes = RowSamples(self.inside.motion, function(self.inside.motion), self.inside.count)
        places, _ = self._peaks
        top, _ = sizes.extremes_with(function, places, function(places), self._uneven)
        return np.asarray(np.where(top > self.curves.error, static_balance(self.many.spread, top), np.nan))

    def stress_max(self) -> FloatArray:
        """Return the largest stress in the window, of all load cases [Pa]."""
        stress, (low, high) = self.curves.stress, self._cut
        if stress is None:
            return np.full(len(low), np.nan)
        if stress.largest is not None:
            return stress.largest(low, high)
        slack, ends = WINDOW_RTOL * (high - low), np.stack([low, high], axis=1)
        points, *beside = stress.samples
        at_point = (np.abs(points.motion[:, :, None] - ends[:, None]) <= slack[:, None, None]).any(axis=1)
        own = np.stack([_value_at(points, end) for end in (low, high)], axis=1)
        rows = np.arange(len(low))
        known = points.with_ends((low, high), np.where(at_point, own, stress.at(ends, rows)), slack)
        top = known.extremes(lambda places: stress.at(places, rows))[0]
        for other in beside:
            start, stop = np.maximum(other.motion[:, 0], low), np.minimum(other.motion[:, -1], high)
            inner = np.where(other.find_between((start, stop)), other.values, -np.inf).max(axis=1, initial=-np.inf)
            most = np.maximum(inner, np.maximum(_value_at(other, start), _value_at(other, stop)))
            top = np.where(start < stop, np.maximum(top, most), top)
        return top

    def safety_factor(self) -> FloatArray:
        """Return the allowable stress over the largest stress in the window."""
        if self.curves.stress is None:
            return np.full(len(self.ends[0]), np.nan)
        allowable, top = self.curves.stress.allowable, self.stress_max()
        return np.where(top > NO_STRESS * allowable, allowable / top, np.nan)

    def rise_to_end(self, function: Callable[[ManyBranches], FloatArray]) -> FloatArray:
        """Return `ranges_many.range_95` or its fraction."""
        return np.where(self._reach(self.branches.high), function(self.branches), np.nan)

    def band_range(self, tolerance: float) -> FloatArray:
        """Return the width within one of the tolerances `ranges_many.BAND_RANGES` about the reference pose."""
        many = self.branches
        here = np.abs(many.interpolate(many.reference[:, None])[:, 0])
        largest = np.nanmax(np.abs(self.curves.samples.values), axis=1, initial=0.0)
        known = self._reach(many.reference) & (here > np.maximum(self.curves.error, ZERO_EFFORT_SHARE * largest))
        return np.where(known, ranges_many.band_range(many, tolerance), np.nan)

    def _reach(self, places: FloatArray) -> NDArray[np.bool_]:
        """Return which curves reach places, (d,)."""
        first, last = self.curves.extent
        slack = WINDOW_RTOL * (last - first)
        return np.asarray((places >= first - slack) & (places <= last + slack))

    def rms_to_target(self) -> FloatArray:
        """Return the root mean square of F - target at places uniform in the motion."""
        return np.where(self._has_target, ranges_many.rms_to_target(self.branches, self.curves.target), np.nan)

    def deviation_from_curve(self) -> FloatArray:
        """Return the largest |F - F*| over the largest |F*|, F* the curve that is to be followed."""
        curve, inside = self.curves.followed, self.inside
        if curve is None:
            return np.full(len(self.ends[0]), np.nan)
        offsets = RowSamples(inside.motion, inside.values - curve.evaluate(inside.motion), inside.count)
        top, bottom = offsets.extremes(lambda places: self.curves.all_at(places) - curve.evaluate(places))
        return np.asarray(np.maximum(top, -bottom) / self.largest_of_curve(*self.ends))

    def rms_to_curve(self) -> FloatArray:
        """Return the root mean square of F - F* at places uniform in the motion."""
        curve, places = self.curves.followed, ranges_many.uniform_places(self.branches)
        if curve is None:
            return np.full(len(places), np.nan)
        offset = self.branches.interpolate(places) - curve.evaluate(places)
        rms = np.sqrt(np.einsum("ij,ij->i", offset, offset) / ranges_many.UNIFORM_POINTS)
        return np.asarray(np.where(self._is_followed(*self.ends), rms, np.nan))

    def largest_of_curve(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return the largest effort of the curve that is to be followed between places, (d,); NaN where it is zero."""
        size, curve, known = np.full(len(low), np.nan), self.curves.followed, self._is_followed(low, high)
        if curve is not None and known.any():
            pairs, which = np.unique(np.stack([low, high], axis=1)[known], axis=0, return_inverse=True)
            size[known] = np.array([curve.largest(*pair) for pair in pairs.tolist()])[which.ravel()]
        return np.where(size > self.curves.error, size, np.nan)

    def _is_followed(self, low: FloatArray, high: FloatArray) -> NDArray[np.bool_]:
        """Return between which places the curve that is to be followed is known, (d,)."""
        curve = self.curves.followed
        ends = zip(low.tolist(), high.tolist(), strict=True)
        return np.array([curve is not None and pair[0] < pair[1] and curve.covers(*pair) for pair in ends])

    @property
    def _has_target(self) -> NDArray[np.bool_]:
        return np.abs(self.curves.target) > self.curves.error

    @cached_property
    def level(self) -> FloatArray:
        """Mean effort over the way in the window [N or N m]; NaN if the curve does not cover it."""
        return np.where(self.is_known, mean_of_rows(self.curves.all_at, self.curves.dense, *self._cut), np.nan)

    @property
    def reference(self) -> FloatArray:
        """Reference of relative metrics: the target, else the mean; NaN if that is zero [N or N m]."""
        if self._has_target.all():
            return self.curves.target
        level = np.where(np.abs(self.level) > self.curves.error, self.level, np.nan)
        return np.where(self._has_target, self.curves.target, level)


def _value_at(samples: RowSamples, place: FloatArray) -> FloatArray:
    """Return the value of each row at a place, (d,), by linear interpolation."""
    rows = np.arange(len(place))
    after = np.clip((samples.motion < place[:, None]).sum(axis=1), 1, np.maximum(samples.count - 1, 1))
    x0, x1 = samples.motion[rows, after - 1], samples.motion[rows, after]
    y0, y1 = samples.values[rows, after - 1], samples.values[rows, after]
    with np.errstate(all="ignore"):
        inner = y0 + (place - x0) / (x1 - x0) * (y1 - y0)
    return np.asarray(np.where(place == x1, y1, np.where(place == x0, y0, inner)))


class UsableInterval(NamedTuple):
    """The largest interval in which every branch of many curves keeps its limits, (d,) each; NaN where nothing is."""

    stroke: FloatArray  # its length: 0 where there is none
    start: FloatArray
    end: FloatArray


@dataclass(frozen=True, eq=False)
class CycleRows:
    """All branches of many curves together, by name."""

    branches: Mapping[str, RowsInWindow]

    @cached_property
    def usable(self) -> UsableInterval:
        """The largest interval in which every branch keeps its limits."""
        levelled = tuple(_level_branches(self.branches).values())
        levels = np.mean([one.reference for one in levelled], axis=0)
        known, first = np.isfinite(levels), levelled[0].curves
        many = [one.branches for one in levelled]
        start, end = ranges_many.usable_interval(many, np.where(known, levels, 1.0), first.band, *first.valid)
        stroke = np.where(np.isnan(start), 0.0, end - start)
        return UsableInterval(*(np.where(known, values, np.nan) for values in (stroke, start, end)))

    @property
    def loop_area(self) -> FloatArray:
        """Area between `load` and `unload` in the window, (d,) [J]; NaN without these branches."""
        if not {"load", "unload"} <= set(self.branches):
            return np.full(len(next(iter(self.branches.values())).ends[0]), np.nan)
        load, unload = self.branches["load"], self.branches["unload"]
        return np.where(load.covered & unload.covered, load.many.work - unload.many.work, np.nan)


def _level_branches(branches: Mapping[str, RowsInWindow]) -> Mapping[str, RowsInWindow]:
    """Return branches that follow a curve as ones that are to be level, where the curve is known."""
    first = next(iter(branches.values()))
    curve = first.curves.followed
    if curve is None:
        return branches
    low, high = (
        np.clip(pick([item.curves.extent[end] for item in branches.values()], axis=0), *curve.extent)
        for end, pick in enumerate((np.max, np.min))
    )
    size, (start, stop) = first.largest_of_curve(low, high), first.curves.valid
    valid = np.maximum(start, low), np.minimum(stop, high)
    level = {name: replace(item.curves.level_along(curve, size), valid=valid) for name, item in branches.items()}
    return {name: RowsInWindow(curves, branches[name].ends) for name, curves in level.items()}


@np.errstate(all="ignore")
def metric_of_rows(definition: Definition, cycle: CycleRows) -> Mapping[str, FloatArray]:
    """Return a metric of many curves by branch, (d,) each [SI]; NaN where it has no value.

    Parameters
    ----------
    definition : Definition
        The metric; one that is known of single curves only has no value.
    cycle : CycleRows
        The branches of the curves over the window of the metric.

    Returns
    -------
    mapping
        What is no matter of one branch stands under the name "" alone.
    """
    function, branches = definition.of_rows, cycle.branches
    if function is None or not branches:
        return {}
    if definition.scope != "branch":
        return {"": function(cycle)}
    values = {name: function(rows) for name, rows in branches.items()}
    if not definition.windowed:
        return values
    return {name: np.where(rows.covered, values[name], np.nan) for name, rows in branches.items()}

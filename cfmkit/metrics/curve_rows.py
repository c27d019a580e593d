"""Curves as rows: one branch of one curve or of many, each a row, with what metrics need to know of it.

A study has many rows of models that know the effort at every place; a curve by itself is one row, and may be known at
its points only. Rows may have different grids and numbers of points.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.metrics.branches import BAND_RTOL, WINDOW_RTOL, Window, reach, restrict, traces
from cfmkit.metrics.continuous_means_and_extremes import extremes, extremes_of_all
from cfmkit.metrics.measuring_frame import MeasuringFrame
from cfmkit.results import LargestStress, OwnStress

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve, Kind
    from cfmkit.metrics.branches import BranchTrace
    from cfmkit.specs.evaluable_target_curve import TargetCurve

    Ends = tuple[FloatArray, FloatArray]

NO_FRAME = MeasuringFrame()
STATED_ERROR = 1e-12
"""Numerical error of a curve whose model states none, in parts of its largest effort: the digits of a file, sums."""


@dataclass(frozen=True, eq=False)
class RowSamples:
    """Values over a motion, each curve a row: after the end of a row its last place and value are repeated."""

    motion: FloatArray  # (d, n), increasing; of one curve that turns back along its path [m or rad]
    values: FloatArray  # (d, n)
    count: NDArray[np.intp]  # (d,) of each row

    @property
    def is_distinct(self) -> NDArray[np.bool_] | None:
        """Which values are not repeated last ones, (d, n); None if all rows are equally long."""
        size = self.motion.shape[1]
        return None if (self.count == size).all() else np.arange(size) < self.count[:, None]

    def cut(self, low: FloatArray, high: FloatArray, values: FloatArray) -> RowSamples:
        """Return `with_ends` with the values (d, 2) where an end is between two points; one at a point has its own."""
        slack, ends = WINDOW_RTOL * (high - low), np.stack([low, high], axis=1)
        at_point = (np.abs(self.motion[:, :, None] - ends[:, None]) <= slack[:, None, None]).any(axis=1)
        at_own_points = np.stack([self.interpolate(low), self.interpolate(high)], axis=1)
        return self.with_ends((low, high), np.where(at_point, at_own_points, values), slack)

    def interpolate(self, place: FloatArray) -> FloatArray:
        """Return the value of each row at a place, (d,), by linear interpolation."""
        rows = np.arange(len(place))
        after = np.clip((self.motion < place[:, None]).sum(axis=1), 1, np.maximum(self.count - 1, 1))
        x0, x1 = self.motion[rows, after - 1], self.motion[rows, after]
        y0, y1 = self.values[rows, after - 1], self.values[rows, after]
        with np.errstate(all="ignore"):
            inner = y0 + (place - x0) / (x1 - x0) * (y1 - y0)
        return np.asarray(np.where(place == x1, y1, np.where(place == x0, y0, inner)))

    def change(self, values: FloatArray) -> RowSamples:
        """Return other values at the same places."""
        return replace(self, values=values)

    def cut_one(self, low: float, high: float) -> RowSamples:
        """Return the part of one curve in a window that it covers, with ends by linear interpolation."""
        motion, values = restrict(self.motion[0], self.values[0], Window(low, high))
        return RowSamples(motion[None], values[None], np.array([len(motion)]))

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
            columns = slice(int(inside[0].argmax()), int(inside[0].argmax() + inside[0].sum()))
            motion = np.concatenate([ends[0, :1], self.motion[0, columns], ends[0, 1:]])
            inner = np.concatenate([values[:, :1], self.values[:, columns], values[:, 1:]], axis=1)
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
    """The largest stress along curves."""

    read: Callable[[], Sequence[RowSamples]]  # at the points of each load case, that of the curve first [Pa]
    # of all load cases at places of some rows, (k, m), (k,) -> (k, m) [Pa]; None: known at the points only
    at: Callable[[FloatArray, Any], FloatArray] | None
    allowable: FloatArray  # (d,) NaN if there is none [Pa]
    # between two places of each row, (d,), (d,) -> (d,) [Pa]; None: to be looked for from the points on
    largest: Callable[[FloatArray, FloatArray], FloatArray | None] | None = None
    read_alone: Callable[[FloatArray], FloatArray] | None = (
        None  # `at` in the load case of the curve, where that differs
    )

    @cached_property
    def samples(self) -> Sequence[RowSamples]:
        """Values at the points."""
        return self.read()

    @cached_property
    def limits(self) -> bool:
        """Whether there is an allowable stress."""
        return bool(np.isfinite(self.allowable).any())

    def excess(self, places: FloatArray, rows: Any) -> FloatArray:
        """Return by what share the stress at places of some rows exceeds what is allowed, (k, m)."""
        assert self.at is not None
        allowable = self.allowable[rows, None]
        share = self.at(places, rows) / allowable - (1 + BAND_RTOL)
        return np.where(np.isfinite(allowable), share, -np.inf)


@dataclass(frozen=True, eq=False, repr=False)
class CurveRows(ShortRepr):
    """One branch of curves, one a row."""

    samples: RowSamples  # efforts at the points [N or N m]
    # returns (d, q) increasing places, so dense that the effort hides nothing between two; may be repeated
    find_dense: Callable[[], FloatArray]
    # at places of some rows, (k, m), (k,) or None for all -> (k, m); None of one curve that is known at its points only
    effort: Callable[[FloatArray, Any], FloatArray] | None
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
    name: str = ""  # of the branch, for messages
    frame: MeasuringFrame = NO_FRAME  # what one curve is measured against, beside the above
    turns_back: bool = False  # whether the motion of one curve does: its samples stand in the order of the path
    # `restrict_to_window`, by window, as long as they are in use
    windows: WeakValueDictionary[Any, Any] = field(default_factory=WeakValueDictionary, init=False, repr=False)

    def all_at(self, places: FloatArray) -> FloatArray:
        """Return the effort at places of every row, (d, m); of one that is known at its points between these."""
        if self.effort is None:
            return np.asarray(np.interp(places, self.samples.motion[0], self.samples.values[0]))
        return self.effort(places, None)

    @cached_property
    def heights(self) -> FloatArray:
        """The effort at the peaks; NaN behind the last of a row."""
        if self.peaks is None:
            return self.dense_effort
        is_peak = np.isfinite(self.peaks)
        return np.where(is_peak, self.all_at(np.where(is_peak, self.peaks, self.samples.motion[:, :1])), np.nan)

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
        motion = self.samples.motion
        return (motion.min(axis=1), motion.max(axis=1)) if self.turns_back else (motion[:, 0], motion[:, -1])

    def level_along(self, curve: TargetCurve, size: FloatArray) -> CurveRows:
        """Return curves less one that they are to follow, on constant efforts (d,)."""

        effort_of_curves = self.effort

        def effort(places: FloatArray, rows: Any) -> FloatArray:
            level = size if rows is None else size[rows]
            assert effort_of_curves is not None
            return np.asarray(effort_of_curves(places, rows) - curve.evaluate(places) + level[:, None])

        motion, values = self.samples.motion, self.samples.values
        samples = replace(self.samples, values=values - curve.evaluate(motion) + size[:, None])
        return replace(self, samples=samples, effort=effort_of_curves and effort, target=size, followed=None)


def rows_of_curve(curve: Curve, frame: MeasuringFrame) -> dict[str, CurveRows]:
    """Return the branches of one curve as rows, by name, measured in a frame."""
    branches = traces(curve)
    extents = [trace.extent for trace in branches] if frame.winding is None else [reach(frame.winding)]
    common = max((low for low, _ in extents), default=0.0), min((high for _, high in extents), default=0.0)
    valid = frame.valid[0] if frame.valid else common
    return {trace.name: _rows_of_trace(trace, curve.kind, frame, valid) for trace in branches}


def _rows_of_trace(trace: BranchTrace, kind: Kind, frame: MeasuringFrame, valid: tuple[float, float]) -> CurveRows:
    model, name, part_efforts = frame.closed, trace.name, frame.part_efforts
    samples, sizes = _samples_of(trace, trace.effort), np.abs(trace.effort)
    error = STATED_ERROR * float(sizes.max(initial=0.0, where=np.isfinite(sizes)))
    return CurveRows(
        samples,
        (lambda: samples.motion) if model is None else (lambda: model.places[None, :]),
        None if model is None else lambda places, _rows: model.effort(name, places),
        np.array([error if frame.effort_error is None else frame.effort_error]),
        np.array([np.nan if frame.target is None else frame.target]),
        frame.band,
        (np.array([valid[0]]), np.array([valid[1]])),
        None if part_efforts is None else lambda places: np.reshape(part_efforts(name, places[0]), places.shape),
        _stress_of_trace(trace, frame),
        kind,
        None if frame.reference is None else np.array([frame.reference]),
        None if model is None else model.peaks[None, :],
        followed=frame.curve,
        name=name,
        frame=frame,
        turns_back=not trace.way,
    )


def _samples_of(trace: BranchTrace, values: FloatArray) -> RowSamples:
    step = trace.way or 1
    return RowSamples(trace.motion[None, ::step], values[None, ::step], np.array([len(values)]))


def _stress_of_trace(trace: BranchTrace, frame: MeasuringFrame) -> StressRows | None:
    """Return the stress of a branch of one curve, and of the same branch in other load cases; None if it has none."""
    model: Any = frame.closed
    name = trace.name
    if trace.read_stress is None and (model is None or frame.allowable_stress is None):
        return None

    def read() -> Sequence[RowSamples]:
        beside = [item for curve in frame.load_cases for item in traces(curve) if item.name == name]
        cases = (trace, *beside) if trace.read_stress else ()
        return [_samples_of(item, item.stress) for item in cases if item.stress is not None]

    def find_largest(low: FloatArray, high: FloatArray) -> FloatArray | None:
        value = model.largest_stress(name, low[0], high[0]) if isinstance(model, LargestStress) else None
        return None if value is None else np.array([value])

    return StressRows(
        read,
        None if model is None else lambda places, _rows: model.stress(name, places),
        np.array([np.nan if frame.allowable_stress is None else frame.allowable_stress]),
        find_largest,
        partial(model.own_stress, name) if frame.load_cases and isinstance(model, OwnStress) else None,
    )

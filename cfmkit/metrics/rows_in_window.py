"""Curves in a window, each a row: what metrics ask for, computed once when it is first needed.

A value that many rows have and one has not is NaN. One row by itself says why: `Undefined` is raised with the reason.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from cfmkit.metrics import branches
from cfmkit.metrics.branches import WINDOW_RTOL, Undefined, span_text
from cfmkit.metrics.continuous_means_and_extremes import FEW_SAMPLES, mean_of_rows
from cfmkit.metrics.spread import Spread

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.curve_rows import CurveRows, Ends, RowSamples, StressRows
    from cfmkit.specs.evaluable_target_curve import TargetCurve

ResultT = TypeVar("ResultT")

NO_FOLLOWED_CURVE = "there is no target curve to compare with: give 'design.target' or 'analysis.target'"
ZERO_EFFORT_SHARE = 1e-9
"""An effort at the reference below this share of the largest is rounding: a band in per cent of it has no width."""


def restrict_to_window(curves: CurveRows, window: Ends | None) -> RowsInWindow:
    """Return curves in windows, (d,) each; None: over their full travel."""
    key = None if window is None else tuple(end.tobytes() for end in window)
    rows: RowsInWindow | None = curves.windows.get(key)
    if rows is None:
        curves.windows[key] = rows = RowsInWindow(curves, window)
    return rows


@dataclass(frozen=True, eq=False)
class RowsInWindow:
    """Curves that are measured between two places, (d,) each."""

    curves: CurveRows
    window: Ends | None  # None: over their full travel
    _known: dict[str, Any] = field(default_factory=dict, init=False)

    def __len__(self) -> int:
        """Return the number of curves."""
        return len(self.curves.error)

    @property
    def ends(self) -> Ends:
        """Ends of the windows, or of the curves where there is no window."""
        return self.curves.extent if self.window is None else self.window

    @cached_property
    def _cut(self) -> Ends:
        """The ends, not beyond those of the curves."""
        first, last = self.curves.extent
        return np.clip(self.ends[0], first, last), np.clip(self.ends[1], first, last)

    # --- what is known, and why something is not --------------------------------------------------------------------

    def require(self, is_known: Any, reason: str | Callable[[], str]) -> NDArray[np.bool_]:
        """Return which rows are known, (d,).

        Raises
        ------
        Undefined
            If there is one row, and it is not.
        """
        mask: NDArray[np.bool_] = np.broadcast_to(is_known, len(self))
        if len(mask) == 1 and not mask[0]:
            raise Undefined(reason if isinstance(reason, str) else reason())
        return mask

    def require_straight(self) -> None:
        """Raise `Undefined` if it is one curve that turns back: a many-valued branch is never sorted."""
        name, kind = self.curves.name, self.curves.kind
        self.require(not self.curves.turns_back, f"branch {name!r} turns back: its {kind} is many-valued")

    def remember(self, function: Callable[[RowsInWindow], ResultT], name: str) -> ResultT:
        """Return a function of these rows, which is called once and kept under a name."""
        if name not in self._known:
            self._known[name] = function(self)
        return self._known[name]  # type: ignore[no-any-return]

    @property
    def pose(self) -> FloatArray:
        """Motion of the reference pose, by default the middle of the window, (d,)."""
        low, high = self.ends
        return (low + high) / 2 if self.curves.pose is None else self.curves.pose

    @cached_property
    def covered(self) -> NDArray[np.bool_]:
        """Which curves reach both ends."""
        (first, last), (low, high) = self.curves.extent, self.ends
        slack = WINDOW_RTOL * (high - low)
        return (first <= low + slack) & (last >= high - slack)

    @property
    def is_known(self) -> NDArray[np.bool_]:
        """Which curves reach both ends and have an effort at every point between."""
        return self.covered & np.isfinite(self.mean)

    def reach(self, places: FloatArray) -> NDArray[np.bool_]:
        """Return which curves reach places, (d,)."""
        first, last = self.curves.extent
        slack = WINDOW_RTOL * (last - first)
        return self.require((places >= first - slack) & (places <= last + slack), self.describe_extent)

    def describe_extent(self) -> str:
        """Return what the first curve covers."""
        low, high = (float(end[0]) for end in self.curves.extent)
        return f"branch {self.curves.name!r} covers only {span_text(low, high, self.curves.kind)}"

    def describe_gap(self) -> str:
        """Return why a share of the first effort has no value: it is zero within its error, or changes its sign."""
        if max(abs(float(end[0])) for end in self.extremes) > self.curves.error[0]:
            return f"the {self.curves.kind} changes sign or is zero"
        balancer = "; 'static_balance' judges a balancer" if self.curves.part_efforts else ""
        return f"the {self.curves.kind} is zero within its numerical error, {self.error_text}{balancer}"

    @property
    def error_text(self) -> str:
        """The numerical error of the first effort with its unit."""
        from cfmkit.specs.units import format_short

        return format_short(float(self.curves.error[0]), self.curves.kind, 2)

    # --- the points in the window -----------------------------------------------------------------------------------

    @cached_property
    def inside(self) -> RowSamples:
        """The efforts at the points in the window and at its ends."""
        self.require(self.covered, self.describe_extent)
        inside = self.curves.samples if self.window is None else self._cut_window()
        self.require(len(self) > 1 or np.isfinite(inside.values).all(), lambda: self._describe_unknown_points(inside))
        return inside

    def _cut_window(self) -> RowSamples:
        curves, (low, high) = self.curves, self._cut
        if curves.effort is None:
            part = curves.samples.cut_one(float(self.ends[0][0]), float(self.ends[1][0]))
            return self._apply_stated_ends(part, lambda stated: stated.effort)
        at_ends = curves.all_at(np.stack([low, high], axis=1))
        if len(self) == 1:
            return curves.samples.cut(low, high, at_ends)
        return curves.samples.with_ends((low, high), at_ends, WINDOW_RTOL * (high - low))

    def _describe_unknown_points(self, part: RowSamples) -> str:
        count, failed = part.values.size, int((~np.isfinite(part.values)).sum())
        name, kind = self.curves.name, self.curves.kind
        return f"{failed} of {count} points of branch {name!r} in the window have no known {kind}"

    def _apply_stated_ends(self, part: RowSamples, read: Callable[[Any], FloatArray]) -> RowSamples:
        """Return a part whose ends have the values of the points that the model states there, if it states some."""
        stated = self.curves.frame.ends
        if stated is None:
            return part
        values, slack = part.values.copy(), WINDOW_RTOL * float(np.ptp(part.motion))
        for end in (0, -1):
            place = part.motion[0, end]
            at_end = np.flatnonzero((np.abs(stated.motion - place) <= slack) & (stated.branch == self.curves.name))
            if len(at_end) == 1 and not (self.curves.samples.motion == place).any():
                values[0, end] = read(stated)[at_end[0]]
        return part.change(values)

    @cached_property
    def mean(self) -> FloatArray:
        """Mean effort over the points; of a recording over the motion. What is not above the error is zero."""
        inside, is_distinct = self.inside, self.inside.is_distinct
        if self.curves.frame.over_motion:
            mean = _mean_over_motion(inside.motion, inside.values)
        elif is_distinct is None:
            mean = inside.values.mean(axis=1)
        else:
            mean = np.where(is_distinct, inside.values, 0.0).sum(axis=1) / inside.count
        return np.where(np.abs(mean) <= self.curves.error, 0.0, mean)

    @property
    def deviation(self) -> FloatArray:
        """Sample standard deviation (n - 1) of the effort at the points; of a recording over the motion."""
        inside, is_distinct = self.inside, self.inside.is_distinct
        offset = inside.values - self.mean[:, None]
        if self.curves.frame.over_motion:
            return np.sqrt(_mean_over_motion(inside.motion, offset**2))
        offset = offset if is_distinct is None else np.where(is_distinct, offset, 0.0)
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / (inside.count - 1)))

    @property
    def work(self) -> FloatArray:
        """Integral of the effort over the motion, whichever way the curve runs, (d,) [J]."""
        inside, motion = self.inside, self.curves.samples.motion
        steps = np.diff(inside.motion, axis=1)
        work = np.einsum("ij,ij->i", steps, 0.5 * (inside.values[:, 1:] + inside.values[:, :-1]))
        return np.asarray(np.sign(motion[:, -1] - motion[:, 0]) * work if self.curves.turns_back else work)

    # --- extremes, of models also between the points ----------------------------------------------------------------

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
        is_early, is_inside = places <= low, (places > low) & (places < high)
        ends = np.where(is_early, inside.values[:, :1], inside.values[:, -1:])
        return np.where(is_inside, places, np.where(is_early, low, high)), np.where(is_inside, heights, ends)

    @cached_property
    def _uneven(self) -> NDArray[np.bool_]:
        curves, places, (low, high) = self.curves, self._peaks[0], self._cut
        count = np.isfinite(curves.dense if curves.peaks is None else curves.peaks).sum(axis=1)
        is_inside = (places > low[:, None]) & (places < high[:, None])
        return np.asarray(is_inside.any(axis=1) & (count < FEW_SAMPLES))

    @cached_property
    def extremes(self) -> Ends:
        """Largest and smallest effort: of the points, or of the model next to them."""
        inside, path = self.inside, self.curves.frame.winding
        if path is not None:
            return _ends_of_one(branches.extremes(path, *self._ends_on_way))
        if self.curves.effort is None:
            return inside.values.max(axis=1), inside.values.min(axis=1)
        return inside.extremes_with(self.curves.all_at, *self._peaks, self._uneven)

    @property
    def _ends_on_way(self) -> tuple[float, float]:
        """Ends of the window; without one, of everything: a motion that turns back may do so between two points."""
        return (-np.inf, np.inf) if self.window is None else (float(self.window[0][0]), float(self.window[1][0]))

    @cached_property
    def spread(self) -> Spread:
        """Mean and extremes of each curve."""
        return Spread.from_extremes(self.mean, *self.extremes, self.curves.error)

    @property
    def largest_part(self) -> FloatArray:
        """Largest effort of one spring or member [N or N m]."""
        function, inside = self.curves.part_efforts, self.inside
        self.require(function is not None, "the model does not tell what single springs and members do")
        if function is None:
            return np.full(len(self), np.nan)
        sizes = function(inside.motion)
        is_finite = np.isfinite(sizes)
        largest = sizes.max(axis=1, initial=0.0, where=is_finite)
        if self.curves.effort is None or not is_finite.all(axis=1).any():
            return np.asarray(largest)
        places, _ = self._peaks
        top, _ = inside.change(sizes).extremes_with(function, places, function(places), self._uneven)
        return np.where(is_finite.all(axis=1), top, largest)

    @cached_property
    def level(self) -> FloatArray:
        """Mean effort over the way where the model gives it at every place, else over the points [N or N m]."""
        curves, path = self.curves, self.curves.frame.winding
        self.inside  # noqa: B018  (raises where the window is not covered)
        if path is not None:
            return np.array([branches.mean(path, *self._ends_on_way)])
        if curves.effort is None:
            return self.mean
        return np.where(self.is_known, mean_of_rows(curves.all_at, curves.dense, *self._cut), np.nan)

    # --- stress -----------------------------------------------------------------------------------------------------

    def largest_stress(self) -> FloatArray:
        """Return the largest stress in the window, of all load cases, (d,) [Pa]."""
        stress, (low, high) = self.curves.stress, self._cut
        self.inside  # noqa: B018  (raises where the window is not covered)
        beside = self.list_stress_ranges_beside()
        solved = None if stress is None or stress.largest is None else stress.largest(low, high)
        largest = self.find_stress_range()[1] if solved is None else solved
        return np.asarray(np.max([largest, *(top for _, top in beside)], 0))

    def find_stress_range(self, alone: bool = False) -> Ends:
        """Return the least and the largest stress, (d,) each [Pa]; of a model next to the points, too.

        `alone`: in the load case of the curve only, where the model of the stress is that of all of them.
        """
        stress, path = self.curves.stress, self.curves.frame.winding
        self.inside  # noqa: B018  (raises where the window is not covered)
        self.require(stress is not None and bool(stress.samples), "the curve has no column 'max_stress'")
        if stress is None:
            return (np.full(len(self), np.nan),) * 2
        inside = self._stress_inside(stress)
        unknown = np.isnan(inside.values).sum(axis=1)
        points = inside.values.shape[1]
        self.require(unknown == 0, lambda: f"the stress is unbounded at {unknown[0]} of {points} points in the window")
        if path is not None:
            return _ends_of_one(branches.stress_extremes(path, *self._ends_on_way))[::-1]
        if stress.at is None:
            return inside.values.min(axis=1), inside.values.max(axis=1)
        rows, function = np.arange(len(self)), stress.at
        if alone and (read := stress.read_alone) is not None:  # ends between points have the stress of all load cases
            return inside.change(read(inside.motion)).extremes(read)[::-1]
        return inside.extremes(lambda places: function(places, rows))[::-1]

    def _stress_inside(self, stress: StressRows) -> RowSamples:
        """Return the stress at the points in the window and at its ends."""
        points, (low, high) = stress.samples[0], self._cut
        if self.window is None:
            return points
        if stress.at is None:
            part = points.cut_one(float(self.ends[0][0]), float(self.ends[1][0]))
            stated = self.curves.frame.ends
            if stated is None or "max_stress" not in stated.extra:
                return part
            return self._apply_stated_ends(part, lambda curve: curve.extra["max_stress"].values)
        return points.cut(low, high, stress.at(np.stack([low, high], axis=1), np.arange(len(self))))

    def list_stress_ranges_beside(self) -> list[Ends]:
        """Return the least and the largest stress in each other load case, as far as it goes, (d,) each [Pa]."""
        stress, (low, high) = self.curves.stress, self._cut
        ranges = []
        for case in () if stress is None or (stress.largest and len(self) > 1) else stress.samples[1:]:
            start, stop = np.maximum(case.motion.min(axis=1), low), np.minimum(case.motion.max(axis=1), high)
            if self.window is None:
                least, most = case.values.min(axis=1), case.values.max(axis=1)
            else:
                inner, ends = (case.find_between((start, stop)), (case.interpolate(end) for end in (start, stop)))
                first, last = ends
                most = np.maximum(np.where(inner, case.values, -np.inf).max(axis=1), np.maximum(first, last))
                least = np.minimum(np.where(inner, case.values, np.inf).min(axis=1), np.minimum(first, last))
            overlaps = (start < stop) | (self.window is None)
            unknown = overlaps & np.isnan(most)
            self.require(~unknown, "the stress of another load case is not known everywhere in the window")
            ranges.append((np.where(overlaps, least, np.inf), np.where(overlaps, most, -np.inf)))
        return ranges

    # --- the curve that is to be followed, or the constant effort ---------------------------------------------------

    @property
    def has_target(self) -> NDArray[np.bool_]:
        """Which curves have a target that is not zero within the numerical error of the effort."""
        return np.abs(self.curves.target) > self.curves.error

    def require_target(self) -> FloatArray:
        """Return the target of each curve, NaN without one or if it is zero, (d,) [N or N m]."""
        curves = self.curves

        def reason() -> str:
            missing = "there is no target to compare with" if np.isnan(curves.target[0]) else "the target is zero"
            return f"{missing}; 'deviation_from_curve' compares with a curve" if curves.followed else missing

        return np.where(self.require(self.has_target, reason), curves.target, np.nan)

    def require_followed(self) -> TargetCurve | None:
        """Return the curve that is to be followed, which one row needs all over its window; None without one."""
        curve, kind = self.curves.followed, self.curves.kind
        self.require(curve is not None, NO_FOLLOWED_CURVE)
        if curve is not None:
            extent, is_followed = curve.extent, self.is_followed(*self.ends)
            self.require(is_followed, lambda: f"the target curve covers only {span_text(*extent, kind)}")
        return curve

    def largest_followed(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return the largest effort of the curve that is to be followed between places, (d,); NaN where it is zero."""
        size, curve, is_known = np.full(len(low), np.nan), self.curves.followed, self.is_followed(low, high)
        if curve is not None and is_known.any():
            pairs, which = np.unique(np.stack([low, high], axis=1)[is_known], axis=0, return_inverse=True)
            size[is_known] = np.array([curve.largest(*pair) for pair in pairs.tolist()])[which.ravel()]
        return np.where(size > self.curves.error, size, np.nan)

    def is_followed(self, low: FloatArray, high: FloatArray) -> NDArray[np.bool_]:
        """Return between which places the curve that is to be followed is known, (d,)."""
        curve = self.curves.followed
        ends = zip(low.tolist(), high.tolist(), strict=True)
        return np.array([curve is not None and pair[0] < pair[1] and curve.covers(*pair) for pair in ends])


def _ends_of_one(values: tuple[float, float]) -> Ends:
    return np.array(values[:1]), np.array(values[1:])


def _mean_over_motion(motion: FloatArray, values: FloatArray) -> FloatArray:
    """Return the mean of values at points over the motion, by trapezoids, (d,)."""
    width = motion[:, -1] - motion[:, 0]
    return np.where(width != 0, np.trapezoid(values, motion, axis=1) / np.where(width, width, 1.0), values.mean(axis=1))

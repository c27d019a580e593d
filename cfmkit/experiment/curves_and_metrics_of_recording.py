"""Evaluation of a recording: raw and filtered curves, points left out, window, metrics, coverage, repeatability.

A recording becomes one curve per cycle. Within a branch the samples stand in the order of the motion, so that the
flicker of an encoder makes no folds; they are filtered before, in the order of time. The value of a metric is its mean
over the complete cycles, or over what there is if none is complete.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.curves import Column, Curve, Kind
from cfmkit.errors import DataError, UsageError
from cfmkit.experiment.branches import LOAD_BRANCH, UNLOAD_BRANCH, Cycles, Stroke, Strokes, choose, read_cycles, split
from cfmkit.experiment.corrections_and_low_pass import DEFAULT_ORDER, LowPass, correct_recording, low_passed
from cfmkit.experiment.findings import RECORDING_FINDINGS, passages_left_out, spikes_left_out, warnings_of
from cfmkit.experiment.reading import read_recording
from cfmkit.experiment.recorded_values import (
    UnrecordedInterval,
    coverage,
    empty_uncovered,
    hole_finding,
    holes_of,
    large_holes,
    least,
    number_of,
    repeatability,
    select_cycle,
    turned_loop,
)  # fmt: skip
from cfmkit.experiment.reversal_transitions import remove_transitions
from cfmkit.metrics import Definition, MeasuringFrame, Window, measure, metrics_by_name
from cfmkit.metrics.branches import span_text
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE
from cfmkit.numerics.robust_statistics import spikes
from cfmkit.results import Finding, Quantity

if TYPE_CHECKING:
    import os
    from collections.abc import Collection, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.reading import Recording

LEFT_OUT = ("reversals", "spikes")  # what verbs leave out of a recording unless it is to count as recorded
CYCLES_PER_STROKE = 60.0
"""Cut-off of the filter that is used unless one is named, in cycles over the whole travel: 2 Hz in [SS]."""


@dataclass(frozen=True, repr=False)
class MeasuredCurves(ShortRepr):
    """A recording as curves."""

    recording: Recording  # as recorded
    strokes: Strokes  # how it was split
    # one a cycle, raw; columns `time` where there is one, and `raw`'s order is that of the motion
    raw: tuple[Curve, ...]
    reached: Window  # what every branch reached before points next to reversals were left out
    passage: float = 0.0  # longest way next to a reversal that was left out [m or rad]
    filtered: tuple[Curve, ...] = ()  # the same points with filtered forces; empty without a filter
    low_pass: LowPass | None = None  # the filter
    warnings: tuple[Finding, ...] = ()  # what the user must know

    @cached_property
    def curve(self) -> Curve:
        """The filtered curve of the first cycle; the raw one where there is none."""
        return (self.filtered or self.raw)[0]


def measure_recording(
    recording: Recording,  # in the order of time
    # default: order 6 per pass, 60 cycles over the whole travel; left out, with a warning, where there are too few
    # points for that. None: no filter
    low_pass: LowPass | Literal["default"] | None = "default",
    # ``"reversals"`` for the points next to them at which the force passes between the branches, ``"spikes"`` for
    # points far off their neighbours
    leave_out: Collection[str] = ("reversals",),
    cycles: Cycles | None = None,  # which are measured; default: the complete ones of full travel
) -> MeasuredCurves:
    """Return a recording as raw and filtered curves.

    Raises DataError if there is no stroke in the recording, a cycle that was chosen, or a filter that was named cannot
    be used; UsageError if another word stands for the filter, or for what is left out.
    """
    _check_arguments(low_pass, leave_out)
    strokes, reached, passage, left_out = _strokes_and_findings(recording, leave_out, cycles)
    measured = strokes.measured
    warnings = (*warnings_of(recording, strokes), *left_out)
    chosen = _default_filter(recording) if low_pass == "default" else low_pass
    raw = tuple(_cycle_curve(recording, cycle, recording.effort, strokes) for cycle in measured)
    if turned_loop(raw):
        reported = (
            f"the {recording.kind} on the way up is smaller than on the way back, and every cycle would deliver energy"
        )
        warnings = (*warnings, Finding("negative_loop", f"{reported}: is the sign of a column reversed?"))
    plain = MeasuredCurves(recording, strokes, raw, reached, passage, warnings=warnings)
    if chosen is None:
        return plain
    try:
        smooth = _filter_strokes(recording, [stroke for cycle in measured for stroke in cycle], chosen)
    except DataError as problem:
        if low_pass != "default":
            raise DataError(f"{recording.name}: {problem}") from None
        return replace(plain, warnings=(*warnings, Finding("not_filtered", str(problem))))
    filtered = tuple(_cycle_curve(recording, cycle, smooth, strokes) for cycle in measured)
    return replace(plain, filtered=filtered, low_pass=chosen)


def _check_arguments(low_pass: LowPass | str | None, leave_out: Collection[str]) -> None:
    if isinstance(low_pass, str) and low_pass != "default":
        raise UsageError(
            f"low_pass: {low_pass!r} is no filter; give 'default', None for no filter, or a LowPass "
            f"('read_filter({low_pass!r})' of cfmkit.experiment.corrections_and_low_pass reads one)"
        )
    if isinstance(leave_out, str) or not set(leave_out) <= set(LEFT_OUT):
        raise UsageError(f"leave_out: a collection of {' and '.join(map(repr, LEFT_OUT))} is needed, not {leave_out!r}")


def read_measured(
    path: str | os.PathLike[str],  # as for `cfmkit.experiment.reading.read_recording`
    units: str | None = None,  # likewise
    # tare, zero, flip: as for `cfmkit.experiment.corrections_and_low_pass.correct_recording`
    tare: str | float | None = None,
    zero: str | float | None = None,
    flip: Collection[str] = (),
    cycles: str | None = None,  # which are measured: ``"2:5"``
    group: str | None = None,  # which specimen of several, as ``"Specimen=2"``
) -> MeasuredCurves:
    """Return the raw curves in a lab file, spikes and passages at reversals left out."""
    chosen = read_cycles(cycles)
    recording = correct_recording(read_recording(path, units, group), tare, zero, flip)
    return measure_recording(recording, None, LEFT_OUT, chosen)


def _strokes_and_findings(
    recording: Recording, leave_out: Collection[str], cycles: Cycles | None
) -> tuple[Strokes, Window, float, tuple[Finding, ...]]:
    """Return the strokes to measure, the range that all cover, the longest passage left out, and findings."""
    spiky = _spiky(recording) if "spikes" in leave_out else np.zeros(len(recording), dtype=bool)
    strokes = choose(_remove_points(recording, spiky), cycles, recording.name)
    reached, reported = _common_range(recording, strokes), spikes_left_out(recording, spiky)
    if "reversals" not in leave_out:
        return strokes, reached, 0.0, reported
    settled = remove_transitions(recording, strokes)
    return settled.strokes, reached, settled.length, (*reported, *passages_left_out(recording, settled))


def _spiky(recording: Recording) -> NDArray[np.bool_]:
    """Return which points are spikes: far off their neighbours, and in few of the strokes that pass the place.

    What most strokes show at one place belongs to the mechanism, such as the corner at which a cam begins.
    """
    jumps = spikes(recording.motion) != 0
    heights = np.where(jumps, 0.0, spikes(recording.effort))
    is_outlier: NDArray[np.bool_] = heights != 0
    strokes = _remove_points(recording, jumps).strokes
    for run in np.split(np.flatnonzero(is_outlier), np.flatnonzero(np.diff(np.flatnonzero(is_outlier)) > 1) + 1):
        if len(run) and any(_recurs_in_strokes(recording.motion, heights, strokes, int(k)) for k in run):
            is_outlier[run] = False
    is_outlier |= jumps
    return is_outlier


def _recurs_in_strokes(motion: FloatArray, heights: FloatArray, strokes: Sequence[Stroke], point: int) -> bool:
    """Return whether most strokes have something alike where one point is off its neighbours."""
    alike = passing = 0
    for stroke in strokes:
        away = np.abs(motion[stroke.points] - motion[point])
        is_near = away <= 1.5 * stroke.covered / len(stroke.points)
        passing += bool(is_near.any())
        ratio = heights[stroke.points[is_near]] / heights[point]
        alike += bool(((ratio > 0.5) & (ratio < 2.0)).any())
    return alike >= 2 and 2 * alike > passing


def _remove_points(recording: Recording, spiky: NDArray[np.bool_]) -> Strokes:
    """Return the strokes of a recording without some of its points."""
    kept = np.flatnonzero(~spiky)
    time = None if recording.time is None else recording.time[kept]
    split_again = split(replace(recording, motion=recording.motion[kept], effort=recording.effort[kept], time=time))
    return replace(split_again, strokes=tuple(replace(item, points=kept[item.points]) for item in split_again.strokes))


def _common_range(recording: Recording, strokes: Strokes) -> Window:
    """Return what all measured strokes reached; the point at a reversal counts for both of its strokes."""
    measured_ones = {id(stroke) for cycle in strokes.measured for stroke in cycle}
    ends, before = [], None
    for stroke in strokes.strokes:
        points = recording.motion[stroke.points]
        points = points if before is None else np.append(points, before)
        before = recording.motion[stroke.points[-1]]
        if id(stroke) in measured_ones:
            ends.append((float(points.min()), float(points.max())))
    return Window(max(low for low, _ in ends), min(high for _, high in ends))


def _default_filter(recording: Recording) -> LowPass:
    cutoff = CYCLES_PER_STROKE / recording.travel
    return LowPass(cutoff, recording.motion_dimension, DEFAULT_ORDER)


def _filter_strokes(recording: Recording, strokes: Sequence[Stroke], chosen: LowPass) -> FloatArray:
    """Return the efforts with every stroke filtered by itself."""
    if chosen.per == "time" and recording.time is None:
        raise DataError("a cut-off in Hz needs a column with the time; give it in 1/mm or 1/deg instead")
    if chosen.per not in ("time", recording.motion_dimension):
        raise DataError(f"a cut-off of {chosen.reported} does not fit a {recording.kind} curve")
    smooth = np.array(recording.effort)
    over = recording.time if chosen.per == "time" else recording.motion
    assert over is not None
    if any(np.ptp(over[stroke.points]) == 0 for stroke in strokes):
        raise DataError("the time is the same at all points of a branch; give the cut-off in 1/mm or 1/deg instead")
    for stroke in strokes:
        points = stroke.points if chosen.per == "time" else stroke.points[_sort_by_motion(recording, stroke)]
        smooth[points] = low_passed(recording.effort[points], over[points], chosen)
    return smooth


def _sort_by_motion(recording: Recording, stroke: Stroke) -> NDArray[np.intp]:
    """Return the order of a stroke's points along its way."""
    motion = recording.motion[stroke.points]
    return np.argsort(motion if stroke.branch == LOAD_BRANCH else -motion, kind="stable")


def _cycle_curve(recording: Recording, cycle: Sequence[Stroke], effort: FloatArray, strokes: Strokes) -> Curve:
    """Return the curve of one cycle."""
    points = np.concatenate([stroke.points[_sort_by_motion(recording, stroke)] for stroke in cycle])
    branch = np.repeat([stroke.branch for stroke in cycle], [len(stroke.points) for stroke in cycle])
    extra = {} if recording.time is None else {"time": Column(recording.time[points], "time")}
    label = {"cycle": (float(cycle[0].cycle), "count")} if len(strokes.cycles) > 1 else {}
    stable = np.ones(len(points), dtype=bool)
    return Curve(recording.motion[points], effort[points], branch, stable, extra, recording.kind, label)


def elapsed_fraction(source: MeasuredCurves, branch: str) -> FloatArray:
    """Return which part of the recording had passed at every raw point of a branch, cycle by cycle; 0 to 1.

    By the time where it was recorded, else by the number of points.
    """
    recording = source.recording
    clock = np.arange(len(recording), dtype=float) if recording.time is None else recording.time
    clock = (clock - clock[0]) / (float(np.ptp(clock)) or 1.0)
    strokes = [stroke for cycle in source.strokes.measured for stroke in cycle if stroke.branch == branch]
    passed: FloatArray = np.concatenate(
        [clock[stroke.points[_sort_by_motion(recording, stroke)]] for stroke in strokes]
    )
    return passed


@dataclass(frozen=True)
class Measurement:
    """Numbers of a measured mechanism."""

    # raw, filtered: metrics by name, SI; `filtered` is empty without a filter
    raw: Mapping[str, Quantity]
    filtered: Mapping[str, Quantity]
    cycle_metrics: tuple[Mapping[str, Quantity], ...]  # raw, of every cycle
    window: Window  # where they hold
    warnings: tuple[Finding, ...] = ()  # what the user must know of the window
    holes: tuple[UnrecordedInterval, ...] = ()  # those so large that what they are in has no value

    @property
    def shortfall(self) -> str:
        """Why some numbers have no value; "" where all have one."""
        return next((item.message for item in self.warnings if item.name == "holes"), "") if self.holes else ""


def numbers_of(
    source: MeasuredCurves,  # with at least one cycle or branch
    frame: MeasuringFrame | None = None,  # target and so on
    window: Window | None = None,  # default: what every branch of every cycle covers
    largest_hole: float = MAX_HOLE_SHARE,  # part of the window: a branch with a larger hole in it has no values
) -> Measurement:
    """Return the metrics of a measured mechanism, raw and filtered, its coverage and its repeatability.

    Raises DataError if a branch does not cover the window.
    """
    window, warnings = _window_and_findings(source, window)
    frame, kind = replace(frame or MeasuringFrame(), over_motion=True), source.recording.kind
    holes = holes_of(source.raw, window)
    large = large_holes(holes, window, largest_hole)
    if large:
        warnings = (
            *warnings,
            hole_finding(large, window, kind, f"; --window avoids {'it' if len(large) == 1 else 'them'}"),
        )

    def all_metrics(curves: Sequence[Curve]) -> tuple[Mapping[str, Quantity], ...]:
        measured = ((curve, measure(curve, frame, window, _motion_definitions(kind))) for curve in curves)
        return tuple(empty_uncovered(metrics, select_cycle(large, curve), kind) for curve, metrics in measured)

    covered_by = tuple(coverage(curve, select_cycle(holes, curve), window) for curve in source.raw)
    by_cycle = tuple({**metrics, **shares} for metrics, shares in zip(all_metrics(source.raw), covered_by, strict=True))
    smooth = all_metrics(source.filtered)
    repeated = empty_uncovered(repeatability(source.raw, window), large, kind)
    raw = _mean_of_cycles(by_cycle) | least(covered_by) | repeated
    return Measurement(raw, _mean_of_cycles(smooth) if smooth else {}, by_cycle, window, warnings, large)


def _motion_definitions(kind: Kind) -> tuple[Definition, ...]:
    """Return the definitions of mean and standard deviation over the motion of a recording."""
    meanings = {f"{kind}_mean": "mean {effort}", f"{kind}_sd": "standard deviation of the {effort}"}
    definitions = metrics_by_name(kind)
    how = "over the {motion} in the window, each sample weighted by the way that it stands for (trapezoids)"
    return tuple(replace(definitions[name], definition=f"{words} {how}") for name, words in meanings.items())


def _window_and_findings(source: MeasuredCurves, wanted: Window | None) -> tuple[Window, tuple[Finding, ...]]:
    """Return the window in which the numbers hold, and a finding if it is less than what was requested."""
    name, kind = source.recording.name, source.recording.kind
    try:
        common = common_window(source.raw)
    except DataError as problem:
        raise DataError(f"{name}: {problem}") from None
    if wanted is None:
        return common, _warn_of_short_window(source, common)
    slack = 1e-9 * (wanted.hi - wanted.lo)
    low, high = max(wanted.lo, common.lo), min(wanted.hi, common.hi)
    if wanted.lo >= common.lo - slack and wanted.hi <= common.hi + slack:
        return wanted, ()
    within_reach = wanted.lo >= source.reached.lo - slack and wanted.hi <= source.reached.hi + slack
    if not within_reach or not low < high:
        raise DataError(
            f"{name}: the window {span_text(wanted.lo, wanted.hi, kind)} is not measured on every branch: "
            f"{span_text(common.lo, common.hi, kind)} is"
        )
    reported = f"the window {span_text(wanted.lo, wanted.hi, kind)} touches a reversal"
    taken = f"the numbers hold over {span_text(low, high, kind)}, which every branch covers"
    return Window(low, high), (Finding("window_at_reversal", f"{reported}: {taken}"),)


def _warn_of_short_window(source: MeasuredCurves, common: Window) -> tuple[Finding, ...]:
    """Return a finding if one branch makes the window much shorter than the others would."""
    kind = source.recording.kind
    extents = {
        (branch, number_of(curve)): (float(part.min()), float(part.max()))
        for curve in source.raw
        for branch in curve.branches
        for part in [curve.select_branch(branch).motion]
    }
    widest = min(low for low, _ in extents.values()), max(high for _, high in extents.values())
    # Passages at reversals are left out of one branch or the other of every recording.
    allowed = MAX_HOLE_SHARE * (widest[1] - widest[0]) + source.passage
    late, early = max(extents, key=lambda key: extents[key][0]), min(extents, key=lambda key: extents[key][1])
    missing = {late: common.lo - widest[0], early: widest[1] - common.hi}
    cut = [key for key, length in missing.items() if length > allowed]
    if not cut:
        return ()
    (branch, number), (low, high) = cut[0], extents[cut[0]]
    where = UnrecordedInterval(low, high, branch, number).text(kind)
    reported = f"the window ends where the shortest branch does, {where}; others cover {span_text(*widest, kind)}"
    return (Finding("window_cut", f"{reported}: choose with --window or --cycles"),)


def common_window(curves: Sequence[Curve]) -> Window:
    """Return the interval that every branch of every curve covers.

    Raises DataError if there is none.
    """
    parts = [curve.motion[curve.branch == name] for curve in curves for name in curve.branches]
    lo, hi = max(float(part.min()) for part in parts), min(float(part.max()) for part in parts)
    if not lo < hi:
        quantity, what = (
            ("angle", "angle and torque") if curves[0].kind == "torque" else ("travel", "displacement and force")
        )
        raise DataError(f"no {quantity} is measured on every branch; are the columns or units of {what} swapped?")
    return Window(lo + 0.0, hi + 0.0)  # no -0


def require_loop(source: MeasuredCurves) -> None:
    """Refuse a recording that has no way back.

    Raises DataError naming the branch that there is.
    """
    if not source.strokes.cycles:
        only = source.strokes.measured[0][0].branch
        raise DataError(
            f"{source.recording.name}: holds only the branch {only!r}: without the return stroke there is no loop and "
            "no hysteresis; if only one stroke was measured, add --one-branch (in Python one_branch=True)"
        )


def _mean_of_cycles(metrics_of_cycles: Sequence[Mapping[str, Quantity]]) -> dict[str, Quantity]:
    """Return the mean of every metric over cycles; undefined where it is on one of them."""
    means = {}
    for name, first in metrics_of_cycles[0].items():
        values = [item[name].value for item in metrics_of_cycles]
        numbers = [value for value in values if value is not None]
        if len(numbers) < len(values):
            means[name] = next(item[name] for item in metrics_of_cycles if item[name].value is None)
        else:
            suffix = f"; mean of {len(metrics_of_cycles)} cycles" if len(metrics_of_cycles) > 1 else ""
            means[name] = replace(first, value=float(np.mean(numbers)), definition=first.definition + suffix)
    return means


__all__ = [
    "LEFT_OUT",
    "LOAD_BRANCH",
    "RECORDING_FINDINGS",
    "UNLOAD_BRANCH",
    "MeasuredCurves",
    "Measurement",
    "common_window",
    "elapsed_fraction",
    "measure_recording",
    "numbers_of",
    "read_measured",
    "require_loop",
]  # fmt: skip

"""Pictures of measurements: the loop, raw and filtered; a model beside its measurement, with their difference."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.experiment.comparison import model_at
from cfmkit.numerics.holes_in_samples import is_hole_after
from cfmkit.plots.axis_labels_and_headings import Heading, axis_label, write_heading
from cfmkit.plots.curves import CurveLook, plot_curve
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.stacked_line_diagrams import MarkedRange
from cfmkit.plots.style import LINE_COLOURS, TEXT_GREY, apply_style, axes_mm, new_figure
from cfmkit.specs.units import from_border, to_border

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.experiment.comparison import Comparison, Samples
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves, Measurement
    from cfmkit.metrics import Window

LITTLE_MORE = 2.0  # forces outside the window are shown as well if the range grows by no more than this factor
MAX_DRAWN_BINS = 1200  # columns of points that a picture can show: more samples are drawn as their extremes


def figures(source: MeasuredCurves, numbers: Measurement) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a measurement, by file stem."""
    return {"loop": partial(loop, source, numbers)}


@apply_style
def loop(source: MeasuredCurves, numbers: Measurement) -> Figure:
    """Return the measured loop: whole and raw above, the window with the filtered branches below."""
    window = numbers.window
    figure = new_figure()
    subject = "raw and filtered" if source.filtered else "raw"
    write_heading(figure, Heading(source.recording.name, f"measured {source.recording.kind}, {subject}"))
    upper, lower = axes_mm(figure, (17, 63, 138, 27.5)), axes_mm(figure, (17, 12, 138, 46))
    thin = [broken_at_holes(thin_curve(curve)) for curve in source.raw]
    plain = CurveLook(names=False, arrows=False)
    plot_curve([replace(curve, label={}) for curve in thin] if len(thin) > 1 else thin[0], upper, plain)
    upper.set_xlabel("")
    upper.tick_params(labelbottom=False)
    across = upper.get_xlim()
    for curve in thin:
        _draw_faint(curve, lower)
    smooth = broken_at_holes(thin_curve(source.curve))
    limits = _range_in(source.raw, (window.lo, window.hi))
    motion = smooth.motion_dimension
    left, right = (float(from_border(value, motion)) for value in across)
    marked = tuple(
        MarkedRange(low, high, "not recorded")
        for low, high in sorted({(hole.low, hole.high) for hole in numbers.holes})
    )
    plot_curve(replace(smooth, label={}), lower, CurveLook(window=((left, right), limits), regions=marked))
    _note_window(source, window, lower)
    return figure


def broken_at_holes(curve: Curve) -> Curve:
    """Return a curve with a point without effort in each hole: its line ends there and begins again."""
    places = [np.sort(curve.select_branch(name).motion) for name in curve.branches]
    after = [set(part[:-1][is_hole_after(part)].tolist()) for part in places]
    breaks = []
    for name, holes in zip(curve.branches, after, strict=True):
        index = np.flatnonzero(curve.branch == name)
        rising = curve.motion[index[-1]] >= curve.motion[index[0]]
        inside = [k for k in index.tolist() if float(curve.motion[k]) in holes]
        breaks += [k + 1 if rising else k for k in inside]
    if not breaks:
        return curve
    at = np.array(sorted(breaks))
    before = np.maximum(at - 1, 0)
    return replace(
        curve,
        motion=np.insert(curve.motion, at, curve.motion[before]),
        effort=np.insert(curve.effort, at, np.nan),
        branch=np.insert(curve.branch, at, curve.branch[before]),
        stable=np.insert(curve.stable, at, True),
        extra={},
    )


def _draw_faint(curve: Curve, ax: Axes) -> None:
    """Draw the raw samples of a curve in grey, branch by branch."""
    for name in curve.branches:
        part = curve.select_branch(name)
        x, y = to_border(part.motion, curve.motion_dimension), to_border(part.effort, curve.kind)
        ax.plot(x, y, color=TEXT_GREY, linewidth=0.5, alpha=0.55, zorder=2, gid="no-obstacle")


def _range_in(curves: tuple[Curve, ...], window: tuple[float, float]) -> tuple[float, float]:
    """Return limits of the effort that show what is in a window, with room around it; all where that is little more."""
    inside = np.concatenate(
        [curve.effort[(curve.motion >= window[0]) & (curve.motion <= window[1])] for curve in curves]
    )
    low, high = float(inside.min()), float(inside.max())
    lowest, highest = (float(extreme([extreme(curve.effort) for curve in curves])) for extreme in (np.min, np.max))
    if highest - lowest <= LITTLE_MORE * (high - low):
        low, high = lowest, highest
    room = 0.18 * (high - low) or 1e-3 * (abs(high) or 1.0)
    return low - room, high + room


def _note_window(source: MeasuredCurves, window: Window, ax: Axes) -> None:
    """Mark the window in which the numbers hold."""
    dimension = source.raw[0].motion_dimension
    low, high = (float(to_border(end, dimension)) for end in (window.lo, window.hi))
    floor, ceiling = ax.get_ylim()
    left, right = ax.get_xlim()
    for place in (low, high):
        if left < place < right:
            ax.axvline(place, color=TEXT_GREY, linewidth=0.7, dashes=(2, 2), zorder=1.5)
    shown = np.linspace(max(low, left), min(high, right), 40)
    text = "grey: raw" if source.filtered else ""
    if text:
        points = np.column_stack([shown, np.full(40, floor + 0.04 * (ceiling - floor))])
        place_labels(ax, [Label(text, TEXT_GREY, points, prefer=0.05)])


def thin_curve(curve: Curve) -> Curve:
    """Return a curve for a picture: of each branch no more than the extremes of `MAX_DRAWN_BINS` equal parts."""
    keep: list[NDArray[np.intp]] = []
    for name in curve.branches:
        index = np.flatnonzero(curve.branch == name)
        if len(index) <= 4 * MAX_DRAWN_BINS:
            keep.append(index)
            continue
        parts = np.array_split(index, MAX_DRAWN_BINS)
        kept_points = [
            part[[0, int(curve.effort[part].argmin()), int(curve.effort[part].argmax()), -1]] for part in parts
        ]
        keep.append(np.unique(np.concatenate(kept_points)))
    return curve.take(np.concatenate(keep))


@apply_style
def overlay(
    comparison: Comparison,  # of the model to judge
    before: Comparison | None,  # of the model that a fit started from
    heading: tuple[str, str],  # (str, str): whose picture it is, and what it shows
) -> Figure:
    """Return model and measurement overlaid, and their difference below."""
    figure = new_figure()
    write_heading(figure, Heading(*heading))
    upper, lower = axes_mm(figure, (17, 41, 138, 49.5)), axes_mm(figure, (17, 12, 138, 24))
    shown = comparison.branches or comparison.samples
    efforts = np.concatenate([item.effort for item in shown])
    models = [comparison, *([before] if before else [])]
    values = [efforts, *(item.errors(model.curve) + item.effort for model in models for item in model.samples)]
    labels = [_draw_measured(item, comparison, upper, 0.25 - 0.12 * k) for k, item in enumerate(shown)]
    if comparison.branches:
        mean = _unbroken_runs(comparison.samples[0], comparison)
        upper.plot(*mean.T, color=TEXT_GREY, linewidth=0.8, dashes=(4, 2), zorder=2.5)
        labels.append(Label("mean of the branches", TEXT_GREY, mean, prefer=0.9))
    for model in models:
        labels += _draw_model(model, upper, dashed=model is before)
    _fit_limits(upper, np.concatenate(values), comparison)
    upper.tick_params(labelbottom=False)
    upper.set_ylabel(axis_label(comparison.curve.kind, comparison.curve.kind))
    _draw_errors(comparison, lower)
    lower.set_xlim(upper.get_xlim())
    place_labels(upper, labels)
    return figure


def _convert_to_border(comparison: Comparison, motion: FloatArray, effort: FloatArray) -> FloatArray:
    curve = comparison.curve
    return np.column_stack([to_border(motion, curve.motion_dimension), to_border(effort, curve.kind)])


def _draw_measured(samples: Samples, comparison: Comparison, ax: Axes, prefer: float) -> Label:
    """Draw a measured branch, cycle by cycle; return its name."""
    points = _unbroken_runs(samples, comparison)
    ax.plot(*points.T, color=TEXT_GREY, linewidth=0.5, alpha=0.6, zorder=2, gid="no-obstacle")
    several = len(comparison.branches or comparison.samples) > 1
    return Label(f"measured, {samples.branch}" if several else "measured", TEXT_GREY, points, prefer=prefer)


def _unbroken_runs(samples: Samples, comparison: Comparison, values: FloatArray | None = None) -> FloatArray:
    """Return points of samples in border units, with a gap between cycles and in holes."""
    points = _convert_to_border(comparison, samples.motion, samples.effort if values is None else values)
    breaks = np.flatnonzero(np.diff(samples.cycle) != 0) + 1
    for start, stop in pairwise([0, *breaks.tolist(), len(points)]):
        step = 1 if samples.motion[stop - 1] >= samples.motion[start] else -1
        breaks = np.append(
            breaks, start + 1 + np.flatnonzero(is_hole_after(samples.motion[start:stop][::step])[::step])
        )
    return np.insert(points, breaks.astype(int), np.nan, axis=0)


def _draw_model(comparison: Comparison, ax: Axes, dashed: bool) -> list[Label]:
    """Draw the branches of a model over the window; return their names."""
    labels = []
    places = np.linspace(comparison.window.lo, comparison.window.hi, 400)
    for number, samples in enumerate(comparison.samples):
        points = _convert_to_border(comparison, places, model_at(comparison.curve, samples.model_branch, places))
        color = LINE_COLOURS[number % len(LINE_COLOURS)]
        ax.plot(*points.T, color=color, linewidth=0.9 if dashed else 1.4, linestyle="--" if dashed else "-", zorder=3)
        if not dashed:
            name = f"model, {samples.model_branch}" if len(comparison.samples) > 1 else "model"
            labels.append(Label(name, color, points, prefer=0.7))
        elif number == 0:
            labels.append(Label("at the start of the fit", color, points, prefer=0.45))
    return labels


def _fit_limits(ax: Axes, values: FloatArray, comparison: Comparison) -> None:
    finite = to_border(values[np.isfinite(values)], comparison.curve.kind)
    low, high = float(finite.min()), float(finite.max())
    room = 0.15 * (high - low) or 1e-3 * (abs(high) or 1.0)
    ax.set_ylim(low - room, high + room)
    motion = comparison.curve.motion_dimension
    lo, hi = (float(to_border(end, motion)) for end in (comparison.window.lo, comparison.window.hi))
    ax.set_xlim(lo - 0.02 * (hi - lo), hi + 0.02 * (hi - lo))


def _draw_errors(comparison: Comparison, ax: Axes) -> None:
    """Draw model less measurement, smoothed only by what the eye does."""
    for number, samples in enumerate(comparison.samples):
        points = _unbroken_runs(samples, comparison, samples.errors(comparison.curve))
        ax.plot(*points.T, color=LINE_COLOURS[number % len(LINE_COLOURS)], linewidth=0.6, alpha=0.8, zorder=3)
    ax.axhline(0.0, color=TEXT_GREY, linewidth=0.7, zorder=2)
    curve = comparison.curve
    ax.set_xlabel(axis_label(curve.motion_name, curve.motion_dimension))
    ax.set_ylabel(axis_label("model \N{MINUS SIGN}\nmeasured", curve.kind))

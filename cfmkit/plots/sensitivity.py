"""Pictures of a sensitivity study: bars with their intervals, curves, scatter of effects, convergence, histograms.

Parameters stand in the order of what they do; what cannot be stated is written so, and never drawn as a short bar.
"""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from functools import partial
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.axis_labels_and_headings import LEFT_MARGIN, Heading, metric_label, metric_values, write_heading
from cfmkit.plots.numbers_in_drawings import is_level, remove_rounding
from cfmkit.plots.style import (
    BAND_GREEN,
    LINE_BLUE,
    LINE_COLOURS,
    LINE_VERMILLION,
    SMALL_FONT,
    TEXT_GREY,
    TEXT_INK,
    TROUBLE_RED,
    apply_style,
    axes_mm,
    has_titles,
    is_plain,
    new_figure,
    size_mm,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.requirements import Bounds
    from cfmkit.plots.style import Look
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.sensitivity.result_types import Findings, IndexLine


MOST_BINS = 40
"""Of a histogram: 1600 samples by the rule of the square root; with more bins a bar gets thinner than 2 mm of print."""


def _write_head(figure: Figure, title: str) -> None:
    """Write the name of the study and what the picture shows."""
    name, _, subject = title.rpartition(": ")
    write_heading(figure, Heading(name, subject) if name else Heading(subject, "all parameters"))


@apply_style
def draw_histogram(findings: Findings, number: int) -> Figure:
    """Return how one metric scatters over the parts that were drawn."""
    setup = findings.setup
    metric = setup.study.metrics[number]
    drawn = findings.outputs[:, 0, number] if findings.outputs is not None else np.empty(0)
    finite = metric_values(drawn[np.isfinite(drawn)], metric.dimension)
    figure = new_figure(140, 84)
    axes = axes_mm(figure, (18, 14, 116, 56))
    _write_head(figure, _metric_title(findings, metric))
    width, height = size_mm(figure)
    allowed = () if is_plain() else setup.limits(metric)
    if not is_plain():
        place = (LEFT_MARGIN / width, 1.0 - (7.6 if has_titles() else 1.6) / height)
        figure.text(*place, _describe_sample(drawn, finite, allowed), va="top", size=SMALL_FONT, color=TEXT_INK)
    if len(finite):
        axes.hist(finite, _bin_borders(finite).tolist(), color=LINE_BLUE, alpha=0.85)
    axes.set_ylim(0, 1.22 * max(1.0, axes.get_ylim()[1]))
    ends = [_ends_in_axis_unit(limits) for limits in allowed]
    nominal = float(metric_values(setup.nominal.values[number], metric.dimension))
    shown = [*finite.tolist(), *(end for pair in ends for end in pair if end is not None), nominal]
    low, high = min(shown), max(shown)
    room = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    axes.set_xlim(low - room, high + room)
    for pair in ends:
        _shade_allowed(axes, pair)
    axes.axvline(nominal, color=TEXT_INK, linewidth=1.0, linestyle="--")
    look: Look = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points", "size": SMALL_FONT}
    axes.annotate("nominal", (nominal, 1.0), (2, -2), va="top", **look)
    axes.set(xlabel=_label_with_unit(metric), ylabel="parts")
    return figure


def _bin_borders(values: FloatArray) -> FloatArray:
    """Return the borders of the bins: as many as the square root of the number of parts, but not too many."""
    low, high = float(values.min()), float(values.max())
    if is_level(values):
        room = 0.01 * abs(low) or 0.5
        return np.array([low - room, low + room])
    return np.linspace(low, high, int(min(MOST_BINS, max(8, len(values) ** 0.5 + 1))) + 1)


def _ends_in_axis_unit(limits: Bounds) -> list[float | None]:
    """Return the ends of what is allowed, in the unit of the axis."""
    return [None if end is None else float(metric_values(end, limits.dimension)) for end in (limits.min, limits.max)]


def _shade_allowed(axes: Axes, ends: list[float | None]) -> None:
    """Shade what is allowed and mark its ends."""
    inside = (edge if end is None else end for end, edge in zip(ends, axes.get_xlim(), strict=True))
    axes.axvspan(*inside, color=BAND_GREEN, alpha=0.10, linewidth=0, zorder=0)
    look: Look = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points", "size": SMALL_FONT}
    for end, words, side, align in zip(ends, ("min", "max"), (3, -3), ("left", "right"), strict=True):
        if end is not None:
            axes.axvline(end, color=TROUBLE_RED, linewidth=1.2)
            axes.annotate(f"{words} {end:.6g}", (end, 0.88), (side, 0), ha=align, color=TROUBLE_RED, **look)


def _describe_sample(drawn: FloatArray, finite: FloatArray, limits: tuple[Bounds, ...]) -> str:
    """Return number, mean, deviation and the share inside the limits, in one line."""
    missing = len(drawn) - len(finite)
    reported = [f"{len(drawn)} parts" + (f", {missing} without a result" if missing else "")]
    if len(finite) > 1:
        reported.append(f"mean {finite.mean():.5g}, sd {finite.std(ddof=1):.3g}")
        low, high = np.percentile(finite, (2.5, 97.5))
        reported.append(f"95 % in {low:.5g} ... {high:.5g}")
    if limits and len(finite):
        inside = sum(all(bounds.is_met(value) for bounds in limits) for value in drawn[np.isfinite(drawn)].tolist())
        reported.append(f"{100 * inside / len(drawn):.1f} % within limits")
    return ";  ".join(reported)


MOST_SHOWN = 12  # parameters on a picture, those that do most; as many as there are markers. The tables have all.
MARKER_SHAPES = "osD^v<>ph*XP"
_LEFT_MARGIN, _ROW_HEIGHT = 46.0, 8.0


@dataclass(frozen=True)
class Bars:
    """One index on a picture: its name in the findings, how it is called, and its colour."""

    index: str
    words: str
    colour: str


BAR_CHARTS = {
    "local": (Bars("normalised_slope", "relative change per relative change of the parameter", LINE_BLUE),),
    "sobol": (
        Bars("total_order", "total order: with all interactions", LINE_BLUE),
        Bars("first_order", "first order: the parameter alone", LINE_VERMILLION),
    ),
}


def figures(findings: Findings) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a study, by name."""
    pictures: dict[str, Callable[[], Figure]] = {}
    if findings.outputs is None:
        return pictures
    if findings.all_met is not None and findings.setup.method == "tolerance":
        pictures["yield_gain"] = lambda: draw_gains(findings)
    for number, metric in enumerate(findings.setup.study.metrics):
        stem = re.sub("[^a-z0-9]+", "_", metric.label.lower()).strip("_")
        for name, function in findings.setup.record.pictures.items():
            pictures[f"{stem}{name}"] = partial(globals()[function], findings, number)
    return pictures


def short(path: str) -> str:
    """Return a parameter's name for a picture, without the block it stands in.

    Examples
    --------
    >>> short("mechanism.brace_length")
    'brace length'
    >>> short("mechanism.springs.stiffness.0, mechanism.springs.stiffness.1")
    'springs stiffness (2)'
    """
    several = path.split(", ")
    shared = takewhile(lambda parts: len(set(parts)) == 1, zip(*(path.split(".") for path in several), strict=False))
    text = ".".join(parts[0] for parts in shared)
    if len(several) > 1 and not text.partition(".")[2]:
        return ", ".join(map(short, several))
    plain = re.sub("[._]", " ", text.partition(".")[2] or text)
    return f"{plain} ({len(several)})" if len(several) > 1 else plain


def _write_note(axes: Axes, place: tuple[float, float], text: str = "not stated") -> None:
    axes.annotate(text, place, (3, 0), textcoords="offset points", va="center", size=SMALL_FONT)


def _wrap_path(path: str, width: int) -> str:
    return "\n".join(textwrap.wrap(short(path), width))


def _index_lines(findings: Findings, metric: str, index: str) -> list[IndexLine]:
    """Return one index of all parameters, in the order of the study."""
    return [line for line in findings.lines if (line.metric, line.index) == (metric, index)]


def _rank_parameters(lines: Sequence[IndexLine]) -> list[int]:
    """Return the numbers of the parameters to draw, those with most influence first; unstated ones lead."""
    sizes = [np.inf if line.value is None else abs(line.value) for line in lines]
    return sorted(range(len(lines)), key=lambda k: -sizes[k])[:MOST_SHOWN]


def _bar_axes(count: int, heading: str, legend: bool = False) -> tuple[Figure, Axes]:
    below, above = 14.0, 9.0 + 10.0 * legend
    figure = new_figure(150, below + above + _ROW_HEIGHT * count + 4.0)
    axes = axes_mm(figure, (_LEFT_MARGIN, below, 150 - _LEFT_MARGIN - 6, _ROW_HEIGHT * count + 4.0))
    _write_head(figure, heading)
    axes.grid(visible=False, axis="y")
    axes.axvline(0.0, color=TEXT_GREY, linewidth=0.8)
    return figure, axes


def _name_rows(axes: Axes, names: Sequence[str]) -> None:
    axes.set_yticks(range(len(names)), [_wrap_path(name, 28) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)


def _draw_bars(
    axes: Axes, lines: Sequence[IndexLine], order: Sequence[int], look: tuple[str, str, float, float]
) -> None:
    """Draw one index: bars with whiskers, whose colour, words, place and height `look` gives."""
    colour, words, shift, height = look
    for row, k in enumerate(order):
        line = lines[k]
        if line.value is None:
            _write_note(axes, (0.0, row + shift))
            continue
        axes.barh(row + shift, line.value, height, color=colour, label=words)
        words = ""
        if line.low is not None and line.high is not None:
            whisker: Look = {"color": TEXT_INK, "linewidth": 1.0, "marker": "|", "markersize": 5}
            axes.plot((line.low, line.high), (row + shift,) * 2, **whisker)


@apply_style
def draw_bars(findings: Findings, number: int) -> Figure:
    """Return the indices of one metric as bars with their intervals."""
    metric, kinds = findings.setup.study.metrics[number], BAR_CHARTS[findings.setup.method]
    lines_of_kinds = [_index_lines(findings, metric.label, kind.index) for kind in kinds]
    order = _rank_parameters(lines_of_kinds[0])
    figure, axes = _bar_axes(len(order), _metric_title(findings, metric), len(kinds) > 1)
    height = 0.7 / len(kinds)
    for k, (kind, lines) in enumerate(zip(kinds, lines_of_kinds, strict=True)):
        _draw_bars(axes, lines, order, (kind.colour, kind.words, (k - (len(kinds) - 1) / 2) * height, 0.9 * height))
    _name_rows(axes, [lines_of_kinds[0][k].parameter for k in order])
    axes.set_xlabel("share of the variance [1]" if len(kinds) > 1 else f"{kinds[0].words} [1]")
    if len(kinds) > 1 and axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=SMALL_FONT)
    return figure


@apply_style
def draw_gains(findings: Findings) -> Figure:
    """Return what the yield gains if a tolerance is halved."""
    lines = _index_lines(findings, "yield", "yield_gain_when_halved")
    order = _rank_parameters(lines)
    share = findings.all_met
    stated = share is not None and share.value == share.value
    reported = f"yield {100 * share.value:.1f} %" if share is not None and stated else "yield not stated"
    figure, axes = _bar_axes(
        len(order), f"{findings.setup.study.spec.name}: {reported}; which tolerance to tighten first"
    )
    _draw_bars(axes, lines, order, (LINE_BLUE, "", 0.0, 0.6))
    _name_rows(axes, [lines[k].parameter for k in order])
    from matplotlib.ticker import PercentFormatter

    axes.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=""))
    axes.set_xlabel("change of the yield when the tolerance is halved,\n95 % interval [percentage points]")
    return figure


def _metric_title(findings: Findings, metric: Metric) -> str:
    return f"{findings.setup.study.spec.name}: {metric.label.replace('_', ' ')}"


@apply_style
def draw_oat(findings: Findings, number: int) -> Figure:
    """Return one metric over each parameter's range, and its values at the ends of the range."""
    metric, setup = findings.setup.study.metrics[number], findings.setup
    swings = _index_lines(findings, metric.label, "swing")
    order = _rank_parameters(swings)
    room = max(60.0, _ROW_HEIGHT * len(order) + 10.0)
    figure = new_figure(190, room + 24)
    curves, bars = (axes_mm(figure, (left, 14, width, room)) for left, width in ((18, 72), (132, 52)))
    _write_head(figure, _metric_title(findings, metric))
    every_output = np.empty((len(swings), 0)) if findings.outputs is None else findings.outputs[:, :, number]
    shown = remove_rounding(metric_values(np.append(setup.nominal.values[number], every_output), metric.dimension))
    nominal, outputs = float(shown[0]), shown[1:].reshape(every_output.shape)
    bars.axvline(nominal, color=TEXT_GREY, linewidth=0.8)
    for row, k in enumerate(order):
        values = outputs[k]
        where = np.linspace(0.0, 1.0, len(values))
        look: Look = {"color": LINE_COLOURS[row % len(LINE_COLOURS)], "marker": MARKER_SHAPES[row]}
        curves.plot(where, values, markersize=3, linewidth=1.0, markevery=max(1, len(values) // 10), **look)
        _draw_tornado_row(bars, row, swings[k], (nominal, float(values[0]), float(values[-1])))
        bars.plot(-0.04, row, transform=bars.get_yaxis_transform(), clip_on=False, ms=4, **look)
    _name_rows(bars, [swings[k].parameter for k in order])
    bars.tick_params(axis="y", pad=9)
    bars.grid(visible=False, axis="y")
    curves.set(xlabel="place in the parameter's range, low ... high", ylabel=_label_with_unit(metric))
    bars.set_xlabel(f"{_label_with_unit(metric)}\nat the low (blue) and high (orange) end")
    return figure


def _draw_tornado_row(axes: Axes, row: int, swing: IndexLine, ends: tuple[float, float, float]) -> None:
    nominal, low, high = ends
    if swing.value is None:
        _write_note(axes, (nominal, row))
        return
    for value, colour, shift in ((low, LINE_BLUE, -0.18), (high, LINE_VERMILLION, 0.18)):
        if np.isfinite(value):
            axes.barh(row + shift, value - nominal, 0.34, left=nominal, color=colour)
        else:
            _write_note(axes, (nominal, row + shift), "no result there")


def _label_with_unit(metric: Metric) -> str:
    return metric_label(metric.name, metric.dimension)


@apply_style
def draw_morris(findings: Findings, number: int) -> Figure:
    """Return mean size and scatter of the effects: far right matters, high up is curved or interacts."""
    metric = findings.setup.study.metrics[number]
    sizes, scatters = (_index_lines(findings, metric.label, name) for name in ("mu_star", "sigma"))
    figure = new_figure(160, 90)
    axes = axes_mm(figure, (20, 14, 84, 66))
    _write_head(figure, _metric_title(findings, metric))
    top, factor = 0.0, 100.0 if metric.dimension == "ratio" else 1.0
    for row, k in enumerate(_rank_parameters(sizes)):
        size, scatter = sizes[k], scatters[k]
        label = _wrap_path(size.parameter, 26)
        if size.value is None or scatter.value is None:
            axes.plot([], [], linestyle="", label=f"{label}\n(not stated)")
            continue
        ends, up = [factor * end for end in _as_floats(size)[2:]], factor * scatter.value
        look: Look = {"color": LINE_COLOURS[row % len(LINE_COLOURS)], "clip_on": False}
        axes.plot(factor * size.value, up, MARKER_SHAPES[row], label=label, linestyle="", ms=5, **look)
        axes.plot(ends, (up,) * 2, marker="|", markersize=4, linewidth=1.0, **look)
        top = max(top, factor * (size.high or 0.0), up)
    if top:
        note: Look = {"textcoords": "offset points", "ha": "right", "size": SMALL_FONT, "color": TEXT_GREY}
        axes.plot((0, top), (0, top), color=TEXT_GREY, linewidth=0.6, linestyle="--")
        axes.annotate("sigma = mu*", (0.5 * top, 0.5 * top), (-4, 2), **note)
    _legend_beside(axes)
    unit = _label_with_unit(metric).rpartition(" ")[2]
    axes.set(xlabel=f"mu*: mean size of the effect of the whole range {unit}", ylabel=f"sigma: its scatter {unit}")
    axes.set(xlim=(0, None), ylim=(0, None))
    return figure


@apply_style
def draw_convergence(findings: Findings, number: int) -> Figure:
    """Return the total order indices over the number of samples, with their intervals."""
    metric = findings.setup.study.metrics[number]
    mine = [line for line in findings.convergence if (line.metric, line.index) == (metric.label, "total_order")]
    figure = new_figure(160, 90)
    axes = axes_mm(figure, (18, 14, 86, 66))
    _write_head(figure, f"{_metric_title(findings, metric)}, convergence")
    order = [findings.setup.paths[k] for k in _rank_parameters(_index_lines(findings, metric.label, "total_order"))]
    for row, path in enumerate(order):
        points = np.array([_as_floats(line) for line in mine if line.parameter == path and line.value is not None])
        if not len(points):
            axes.plot([], [], linestyle="", label=f"{short(path)}\n(not stated)")
            continue
        sizes, values, low, high = points.T
        sizes = sizes * 1.03 ** (row - len(order) / 2)
        colour = LINE_COLOURS[row % len(LINE_COLOURS)]
        axes.plot(sizes, values, color=colour, marker=MARKER_SHAPES[row], markersize=4, label=_wrap_path(path, 26))
        axes.vlines(sizes, low, high, color=colour, linewidth=1.0)
    stages = sorted({line.samples for line in mine})
    axes.set_xscale("log", base=2)
    axes.set_xlim(stages[0] / 1.3, stages[-1] * 1.3)
    axes.set_xticks(stages, [str(size) for size in stages])
    axes.minorticks_off()
    _legend_beside(axes)
    axes.set(xlabel=f"base samples ({len(order) + 2} evaluations each)", ylabel="total order index [1]")
    return figure


def _legend_beside(axes: Axes) -> None:
    axes.legend(loc="upper left", bbox_to_anchor=(1.03, 1.0), frameon=False, fontsize=SMALL_FONT)


def _as_floats(line: IndexLine) -> list[float]:
    return [np.nan if number is None else float(number) for number in (line.samples, line.value, line.low, line.high)]

"""Pictures of a study of many points: curves and metrics over one parameter, maps over two, parallel axes over more.

The best point is marked; where a requirement is missed the ground is hatched, and where nothing was solved it stays
grey.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.colors import to_hex

from cfmkit.plots.axis_labels_and_headings import finite_range
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.numbers_in_drawings import digits_that_differ, is_level, remove_rounding, widen
from cfmkit.plots.stacked_line_diagrams import pad_limits
from cfmkit.plots.study_data_and_marks import (
    COLOUR_MAP,
    EMPTY_COLOUR,
    HEAD_HEIGHT,
    MISSED_HATCH,
    edges,
    head,
    key_of,
    star,
    ticks,
)
from cfmkit.plots.style import (
    LINE_BLUE,
    LINE_COLOURS,
    LINE_VERMILLION,
    SMALL_FONT,
    TEXT_GREY,
    TEXT_INK,
    apply_style,
    axes_mm,
    color_bar,
    is_plain,
    new_figure,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.plots.study_data_and_marks import DrawnScale, StudyCurve, StudyMarks
    from cfmkit.plots.style import Look


MOST_PANELS = 8
"""More values of the first parameter than this are left to the maps: smaller panels have no room for their numbers."""


def can_draw_panels(marks: StudyMarks, lines: Sequence[StudyCurve]) -> bool:
    """Return True if the curves of a study are few enough to be drawn in panels."""
    panels, named = ({line.panel for line in lines}, {line.parameter for line in lines})
    return len(marks.shape) == 2 and 0 < len(panels) <= MOST_PANELS and len(named) <= len(LINE_COLOURS)


@apply_style
def draw_panels(marks: StudyMarks, lines: Sequence[StudyCurve], labels: tuple[str, str]) -> Figure:
    """Return the curves of a study of two parameters; each panel has its own vertical scale."""
    first, second = marks.varied
    panels = sorted({line.panel for line in lines if line.panel is not None})
    rows = -(-len(panels) // 2)
    figure = new_figure(160.0, 20.0 + 52.0 * rows)
    for number, value in enumerate(panels):
        row, column = divmod(number, 2)
        ax = axes_mm(figure, (17.0 + 74.0 * column, 14.0 + 52.0 * (rows - 1 - row), 62.0, 42.0))
        _draw_panel(ax, [line for line in lines if line.panel == value], second)
        ax.set_title(f"{first.plain}: {first.text(value)}", fontsize=SMALL_FONT, loc="left")
        ax.set(xlabel=labels[0] if number + 2 >= len(panels) else "", ylabel=labels[1] if column == 0 else "")
    head(figure, marks, f"curves by {first.plain}, each line a value of {second.plain}")
    return figure


def _draw_line(ax: Axes, line: StudyCurve, color: Any, number: int | None, width: float) -> FloatArray:
    """Draw all branches of a curve, dashed by its number; return the points of the first, which is named."""
    style = "-" if number is None else DASH_STYLES[number % len(DASH_STYLES)]
    for motion, effort in line.branches.values():
        ax.plot(motion, effort, color=color, linewidth=width, linestyle=style)
    return np.column_stack(next(iter(line.branches.values())))


def _draw_panel(ax: Axes, lines: Sequence[StudyCurve], second: DrawnScale) -> None:
    order = sorted({line.parameter for line in lines})
    names = []
    for line in lines:
        number = order.index(line.parameter)
        points = _draw_line(ax, line, LINE_COLOURS[number], number if len(order) > 2 else None, 1.2)
        names.append(Label(second.text(line.parameter), LINE_COLOURS[number], points))
    efforts = np.concatenate([effort for line in lines for _, effort in line.branches.values()])
    low, high = finite_range(efforts) or (0.0, 1.0)
    ax.set_ylim(*pad_limits((min(low, 0.0), max(high, 0.0)), 0.05, 0.15))
    place_labels(ax, names)


MOST_LINES = 1500  # lines of a picture with parallel axes; more are thinned out evenly, as they cover each other
MISSED_COLOUR = "#D5D5D5"
"""Colour of points that miss a requirement, where lines show them."""


def figures(
    marks: StudyMarks,  # the points
    lines: Sequence[StudyCurve] = (),  # curves, for a study of one or two parameters
    labels: tuple[str, str] = ("", ""),  # (str, str): of the curves' axes
) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture, by name."""
    if len(marks.varied) != 1 and len(marks.shape) != 2:
        return {"parallel": partial(draw_parallel, marks)} if marks.metrics else {}
    pictures: dict[str, Callable[[], Figure]] = {}
    has_one_parameter = len(marks.varied) == 1
    if lines and (has_one_parameter or can_draw_panels(marks, lines)):
        pictures["curves"] = partial(draw_curves if has_one_parameter else draw_panels, marks, lines, labels)
    for metric in marks.metrics:
        stem = metric.name.replace("[", "_").replace("]", "")
        pictures[stem] = partial(draw_metric if has_one_parameter else draw_map, marks, metric)
    return pictures


@apply_style
def draw_curves(marks: StudyMarks, lines: Sequence[StudyCurve], labels: tuple[str, str]) -> Figure:
    """Return the curves of a study of one parameter, coloured by it."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    (parameter,) = marks.varied
    values = [line.parameter for line in lines]
    if len(values) <= MOST_NAMED:
        return _draw_named(marks, lines, labels)
    figure = new_figure(160.0, 100.0 + HEAD_HEIGHT)
    axes = axes_mm(figure, (16, 14, 112, 82))
    scale = Normalize(min(values), max(values) if max(values) > min(values) else min(values) + 1)
    for line in lines:
        _draw_line(axes, line, colormaps[COLOUR_MAP](scale(line.parameter)), None, 1.0)
    axes.set(xlabel=labels[0], ylabel=labels[1])
    _clear_of_poles(axes, lines)
    bar = color_bar(ScalarMappable(scale, COLOUR_MAP), axes_mm(figure, (133, 14, 4, 82)), parameter.axis)
    if parameter.words:
        bar.set_ticks(range(len(parameter.words)), labels=list(parameter.words))
    head(figure, marks, f"curves, coloured by {parameter.plain}")
    return figure


MOST_NAMED = 8  # curves that have their names beside them; of more, colours tell the values
DASH_STYLES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (8, 2, 2, 2)))
"""Line styles in turn, so that curves differ without their colours, too."""


def _draw_named(marks: StudyMarks, lines: Sequence[StudyCurve], labels: tuple[str, str]) -> Figure:
    """Return a few curves of a study of one parameter, each with its value beside it."""
    from matplotlib import colormaps

    figure = new_figure(160.0, 100.0 + HEAD_HEIGHT - 6.0)
    axes = axes_mm(figure, (16, 14, 138, 82))
    (parameter,) = marks.varied
    ordered = sorted(lines, key=lambda line: line.parameter)
    names = []
    for number, line in enumerate(ordered):
        # the light end of the scale cannot be read as text
        color = colormaps[COLOUR_MAP](0.72 * number / max(len(ordered) - 1, 1))
        points = _draw_line(axes, line, color, number if len(ordered) > 2 else None, 1.3)
        along = 0.55 + 0.35 * number / max(len(ordered) - 1, 1)
        names.append(Label(parameter.text(line.parameter), to_hex(color), points, along))
    axes.set(xlabel=labels[0], ylabel=labels[1])
    _clear_of_poles(axes, ordered)
    place_labels(axes, names)
    head(figure, marks, f"curves, each a value of {parameter.plain}")
    return figure


def _clear_of_poles(axes: Axes, lines: Sequence[StudyCurve]) -> None:
    """Limit the vertical axis to what most points need: a force without bound would flatten all else."""
    efforts = np.concatenate([effort for line in lines for _, effort in line.branches.values()])
    efforts = efforts[np.isfinite(efforts)]
    if not len(efforts):
        return
    low, high = np.percentile(efforts, [1, 99])
    room = 0.15 * (high - low) or 0.05 * abs(high) or 1.0
    axes.set_ylim(max(low - room, efforts.min() - room), min(high + room, efforts.max() + room))


@apply_style
def draw_metric(marks: StudyMarks, metric: DrawnScale) -> Figure:
    """Return one metric over the only parameter."""
    figure = new_figure(120, 75 + HEAD_HEIGHT)
    axes = axes_mm(figure, (28, 13, 86, 56) if metric.words else (20, 13, 94, 56))
    (parameter,) = marks.varied
    order = np.argsort(parameter.values, kind="stable")
    x, y = parameter.values[order], remove_rounding(metric.values)[order]
    axes.plot(x, y, color=LINE_BLUE, marker="o" if len(x) <= 60 else "", markersize=3)
    _hatch_spans(axes, x, marks.meets[order])
    axes.set(xlabel=parameter.axis, ylabel="" if metric.words else metric.label)
    widen(axes, y)
    ticks(axes.xaxis, parameter)
    ticks(axes.yaxis, metric)
    best = marks.best
    starred = best is not None and star(axes, parameter.values[best], remove_rounding(metric.values)[best])
    head(figure, marks, f"{metric.plain} over {parameter.plain}", key_of(marks, starred, not marks.meets.all()))
    return figure


def _hatch_spans(axes: Axes, x: FloatArray, meets: NDArray[np.bool_]) -> None:
    ends = edges(x)
    look: Look = {"facecolor": EMPTY_COLOUR, "edgecolor": TEXT_GREY, "hatch": MISSED_HATCH, "linewidth": 0, "zorder": 0}
    for k in np.flatnonzero(~meets) if not is_plain() else ():
        axes.axvspan(ends[k], ends[k + 1], **look)
    axes.set_xlim(ends[0], ends[-1])


@apply_style
def draw_parallel(marks: StudyMarks) -> Figure:
    """Return every point as a line over parallel axes, parameters then metrics, coloured by the first metric."""
    from matplotlib import colormaps

    scales = (*marks.varied, *marks.metrics)
    width = max(120.0, 26.0 * len(scales) + 30)
    figure = new_figure(width, 100 + HEAD_HEIGHT)
    axes = axes_mm(figure, (14, 22, width - 28, 66))
    heights = np.column_stack([_relative_values(scale) for scale in scales])
    chosen = np.flatnonzero(np.isfinite(heights[:, len(marks.varied)]))
    if len(chosen) > MOST_LINES:
        chosen = chosen[np.linspace(0, len(chosen) - 1, MOST_LINES).astype(int)]
    for k in sorted(chosen.tolist(), key=lambda k: bool(marks.meets[k])):
        colour = colormaps[COLOUR_MAP](heights[k, len(marks.varied)]) if marks.meets[k] else MISSED_COLOUR
        axes.plot(heights[k], color=colour, linewidth=0.6, alpha=0.7)
    if marks.best is not None:
        axes.plot(heights[marks.best], color=LINE_VERMILLION, linewidth=2.0)
    _draw_parallel_axes(axes, scales)
    head(figure, marks, f"coloured by {marks.metrics[0].plain}", _parallel_key_entries(marks))
    return figure


def _parallel_key_entries(marks: StudyMarks) -> list[Artist]:
    from matplotlib.lines import Line2D

    entries: list[Artist] = []
    if marks.best is not None:
        entries.append(Line2D([], [], color=LINE_VERMILLION, linewidth=2.0, label=marks.best_words or "best point"))
    if not marks.meets.all():
        entries.append(Line2D([], [], color=MISSED_COLOUR, label="requirement missed, or not solved"))
    return entries


def _relative_values(scale: DrawnScale) -> FloatArray:
    """Return values as shares of their range, from 0 to 1; 0.5 if they are all the same."""
    finite = scale.values[np.isfinite(scale.values)]
    if is_level(scale.values):
        return np.where(np.isfinite(scale.values), 0.5, np.nan)
    return np.asarray((scale.values - finite.min()) / (finite.max() - finite.min()))


def _draw_parallel_axes(axes: Axes, scales: Sequence[DrawnScale]) -> None:
    for k, scale in enumerate(scales):
        axes.axvline(k, color=TEXT_INK, linewidth=0.8)
        finite = scale.values[np.isfinite(scale.values)]
        if not len(finite):
            continue
        ends = ((0.0, finite.min()), (1.0, finite.max()))
        digits = digits_that_differ(finite.min(), finite.max())
        for height, value in ends if not is_level(finite) else ends[1:]:
            text = scale.words[int(value)] if scale.words else f"{value:.{digits}g}"
            y, align = (-0.02, "top") if height == 0.0 else (1.02, "bottom")
            axes.annotate(text, (k, y), ha="center", va=align, fontsize=SMALL_FONT, annotation_clip=False)
    axes.set_xticks(range(len(scales)), [scale.label.replace(" [", "\n[") for scale in scales], fontsize=SMALL_FONT)
    axes.tick_params(axis="x", length=0, pad=12)
    axes.set(ylim=(0, 1), xlim=(-0.05, len(scales) - 0.95), yticks=[])
    axes.grid(False)
    axes.spines[["left", "bottom"]].set_visible(False)


MOST_TICKS = 8  # values of a parameter that have a tick each: with more their numbers come close to each other (by eye)
N_LEVEL_LINE_PLACES = 80
"""Places along an axis that level lines are drawn through: about 1 mm of print apart, where no corner shows."""


@apply_style
def draw_map(marks: StudyMarks, metric: DrawnScale) -> Figure:
    """Return one metric over two parameters: colours and level lines."""
    figure = new_figure(140, 100 + HEAD_HEIGHT)
    axes = axes_mm(figure, (18, 14, 92, 80))
    down, across = marks.varied
    up, along = _map_places(down, marks.shape[0], marks.shape[1]), _map_places(across, marks.shape[1], 1)
    values = remove_rounding(metric.values).reshape(marks.shape)[np.ix_(up.order, along.order)]
    meets = marks.meets.reshape(marks.shape)[np.ix_(up.order, along.order)]
    x, y = along.borders, up.borders
    axes.set_facecolor(EMPTY_COLOUR)
    axes.grid(False)
    box = (114, 14, 4, 80)
    if metric.words:
        _draw_words_map(axes, (x, y, values), metric, axes_mm(figure, box))
    else:
        mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(values), cmap=COLOUR_MAP, rasterized=True)
        _draw_level_lines(axes, up, along, values)
        color_bar(mesh, axes_mm(figure, box), metric.label)
    if not meets.all() and not is_plain():
        _hatch_cells(axes, x, y, ~meets)
    axes.set(xlabel=across.axis, ylabel=down.axis)
    along.dress(axes, "x")
    up.dress(axes, "y")
    best = marks.best
    starred = best is not None and star(axes, across.values[best], down.values[best])
    key = key_of(marks, starred, not meets.all(), not np.isfinite(values).all())
    head(figure, marks, f"{metric.plain} over {across.plain} and {down.plain}", key)
    return figure


def _draw_words_map(axes: Axes, map_: tuple[FloatArray, FloatArray, FloatArray], metric: DrawnScale, key: Axes) -> None:
    """Colour a map by words; the key has those that occur, and each region its own name where it is large enough."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    across, up, values = map_
    levels = np.unique(values[np.isfinite(values)]).astype(int)
    index = np.full(len(metric.words), -1.0)
    index[levels] = np.arange(len(levels))
    shown = np.where(np.isfinite(values), index[np.where(np.isfinite(values), values, 0).astype(int)], np.nan)
    colours = ListedColormap([colormaps[COLOUR_MAP](0.15 + 0.8 * k / max(len(metric.words) - 1, 1)) for k in levels])
    last = len(levels) - 0.5
    mesh = axes.pcolormesh(across, up, np.ma.masked_invalid(shown), cmap=colours, vmin=-0.5, vmax=last, rasterized=True)
    bar = color_bar(mesh, key)
    bar.set_ticks(range(len(levels)), labels=[metric.words[k] for k in levels])
    bar.ax.tick_params(length=0)


@dataclass(frozen=True)
class MapPlaces:
    """The values of one parameter of a grid along an axis."""

    scale: DrawnScale  # the parameter
    values: FloatArray  # (n,) increasing
    order: NDArray[np.intp]  # (n,) which of the grid's levels they are

    @property
    def words(self) -> bool:
        """Whether the places stand for words."""
        return bool(self.scale.words)

    @cached_property
    def logarithmic(self) -> bool:
        """Whether the values are spaced more evenly by their ratio than by their difference."""
        if self.words or len(self.values) < 3 or self.values[0] <= 0:
            return False
        ratios, steps = np.diff(np.log(self.values)), np.diff(self.values)
        return bool(np.ptp(ratios) / ratios.mean() < 0.5 * np.ptp(steps) / steps.mean())

    @property
    def positions(self) -> FloatArray:
        """Positions on the axis."""
        return np.log(self.values) if self.logarithmic else self.values

    def value(self, position: FloatArray) -> FloatArray:
        """Return the values at places of the axis."""
        return np.exp(position) if self.logarithmic else position

    @property
    def borders(self) -> FloatArray:
        """The borders between them, and beyond the first and the last."""
        return self.value(edges(self.positions))

    def dress(self, axes: Axes, which: Literal["x", "y"]) -> None:
        """Set limits, scale and ticks of an axis; few values have a tick each."""
        axis = axes.xaxis if which == "x" else axes.yaxis
        if self.logarithmic:
            axes.set(**{f"{which}scale": "log"})
        axes.set(**{f"{which}lim": self.borders[[0, -1]]})
        if self.words:
            ticks(axis, self.scale)
        elif len(self.values) <= MOST_TICKS:
            axis.set_ticks(self.values, labels=[f"{value:.6g}" for value in self.values])
            axis.set_ticks([], minor=True)


def _map_places(parameter: DrawnScale, count: int, stride: int) -> MapPlaces:
    levels = parameter.values[: count * stride : stride]
    order = np.argsort(levels, kind="stable")
    return MapPlaces(parameter, levels[order], order)


def _draw_level_lines(axes: Axes, up: MapPlaces, across: MapPlaces, values: FloatArray) -> None:
    """Draw lines of equal value; on a coarse grid along a smooth surface through its values."""
    finite = values[np.isfinite(values)]
    if min(values.shape) < 3 or up.words or across.words or not len(finite):
        return
    low, high = float(finite.min()), float(finite.max())
    levels = _round_values_between(low, high)
    if is_level(finite) or not len(levels):
        return
    x, y = across.positions, up.positions
    if len(finite) == values.size:
        y, values = _refine(y, values, 0)
        x, values = _refine(x, values, 1)
    from matplotlib import patheffects

    surface = across.value(x), up.value(y), np.ma.masked_invalid(values)
    lines = axes.contour(*surface, levels=levels, colors="white", linewidths=0.7)
    # white is read on the dark end of the colours only; a dark outline carries it over the light end
    outline: list[patheffects.AbstractPathEffect] = [patheffects.withStroke(linewidth=1.6, foreground=TEXT_INK)]
    lines.set_path_effects(outline)
    for label in axes.clabel(lines, fontsize=SMALL_FONT, fmt=f"%.{digits_that_differ(low, high)}g"):
        label.set_path_effects(outline)


def _round_values_between(low: float, high: float) -> FloatArray:
    """Return round values clearly between two: a line at the lowest or highest value would follow rounding."""
    from matplotlib.ticker import MaxNLocator

    levels = np.asarray(MaxNLocator(7).tick_values(low, high))
    room = 0.02 * (high - low)
    return np.asarray(levels[(levels > low + room) & (levels < high - room)])


def _refine(places: FloatArray, values: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Return a grid with more places along one axis, through the same values, without new extremes."""
    steps = N_LEVEL_LINE_PLACES // len(places)
    if steps < 2:
        return places, values
    from scipy.interpolate import PchipInterpolator

    at = np.arange((len(places) - 1) * steps + 1) / steps
    fine = np.interp(at, np.arange(len(places)), places)
    return fine, np.asarray(PchipInterpolator(places, values, axis=axis)(fine))


def _hatch_cells(axes: Axes, x: FloatArray, y: FloatArray, cells: NDArray[np.bool_]) -> None:
    """Hatch cells of a map, all with one pattern: one path along their borders."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    corners: list[Any] = []
    for row in range(len(cells)):
        ends = np.flatnonzero(np.diff(np.concatenate([[0], cells[row].view(np.int8), [0]])))
        for start, stop in zip(ends[::2], ends[1::2], strict=True):
            left, right, low, high = x[start], x[stop], y[row], y[row + 1]
            corners += [(left, low), (right, low), (right, high), (left, high), (left, low)]
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY] * (len(corners) // 5)
    look: Look = {"facecolor": "none", "edgecolor": "#A8A8A8", "hatch": MISSED_HATCH, "linewidth": 0}
    axes.add_patch(PathPatch(Path(corners, codes), **look))

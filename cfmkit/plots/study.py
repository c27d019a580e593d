"""Pictures of a study: curves and metrics over one parameter, maps over two, parallel axes over more.

The best point is marked; where a requirement is missed the ground is hatched, and
where nothing was solved it stays grey.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots.style import BLUE, GREY, INK, SMALL, VERMILLION, axes_mm, new_figure, styled

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.curves import FloatArray
    from cfmkit.plots.findings import Findings, Line, Scale

COLOURS = "viridis"
MOST_LINES = 1500
"""Lines of a picture with parallel axes; more are thinned out evenly."""

EMPTY = "#EFEFEF"
_HATCH = "////"


def figures(
    found: Findings, lines: Sequence[Line] = (), labels: tuple[str, str] = ("", "")
) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture, by name.

    Parameters
    ----------
    found : Findings
        The points.
    lines : sequence of Line
        Curves, for a study of one parameter.
    labels : (str, str)
        Of the curves' axes.
    """
    pictures: dict[str, Callable[[], Figure]] = {}
    if len(found.varied) == 1:
        if lines:
            pictures["curves"] = lambda: draw_curves(found, lines, labels)
        for metric in found.metrics:
            pictures[_stem(metric)] = lambda metric=metric: draw_metric(found, metric)  # type: ignore[misc]
    elif len(found.shape) == 2:
        for metric in found.metrics:
            pictures[_stem(metric)] = lambda metric=metric: draw_map(found, metric)  # type: ignore[misc]
    elif found.metrics:
        pictures["parallel"] = lambda: draw_parallel(found)
    return pictures


def _stem(metric: Scale) -> str:
    return metric.name.replace("[", "_").replace("]", "")


@styled
def draw_curves(found: Findings, lines: Sequence[Line], labels: tuple[str, str]) -> Figure:
    """Return the curves of a study of one parameter, coloured by it."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    figure = new_figure()
    axes = axes_mm(figure, (16, 14, 112, 78))
    (parameter,) = found.varied
    given = [line.parameter for line in lines]
    scale = Normalize(min(given), max(given) if max(given) > min(given) else min(given) + 1)
    for line in lines:
        for motion, effort in line.branches.values():
            axes.plot(motion, effort, color=colormaps[COLOURS](scale(line.parameter)), linewidth=1.0)
    axes.set(xlabel=labels[0], ylabel=labels[1])
    _clear_of_poles(axes, lines)
    bar = figure.colorbar(ScalarMappable(scale, COLOURS), cax=axes_mm(figure, (133, 14, 4, 78)))
    bar.set_label(parameter.label)
    if parameter.words:
        bar.set_ticks(range(len(parameter.words)), labels=list(parameter.words))
    return figure


def _clear_of_poles(axes: Axes, lines: Sequence[Line]) -> None:
    """Limit the vertical axis to what most points need: a force without bound would flatten all else."""
    efforts = np.concatenate([effort for line in lines for _, effort in line.branches.values()])
    efforts = efforts[np.isfinite(efforts)]
    if not len(efforts):
        return
    low, high = np.percentile(efforts, [1, 99])
    room = 0.15 * (high - low) or 0.05 * abs(high) or 1.0
    axes.set_ylim(max(low - room, efforts.min() - room), min(high + room, efforts.max() + room))


@styled
def draw_metric(found: Findings, metric: Scale) -> Figure:
    """Return one metric over the only parameter."""
    figure = new_figure(120, 75)
    axes = axes_mm(figure, (18, 13, 96, 56))
    (parameter,) = found.varied
    order = np.argsort(parameter.values, kind="stable")
    x, y = parameter.values[order], metric.values[order]
    axes.plot(x, y, color=BLUE, marker="o" if len(x) <= 60 else "", markersize=3)
    _hatch_spans(axes, x, found.meets[order])
    axes.set(xlabel=parameter.label, ylabel="" if metric.words else metric.label)
    _ticks(axes.xaxis, parameter)
    _ticks(axes.yaxis, metric)
    if metric.words:
        axes.set_title(metric.label, fontsize=SMALL, loc="left")
        axes.tick_params(axis="y", rotation=90)
    if found.best is not None:
        _star(axes, parameter.values[found.best], metric.values[found.best])
    return figure


def _hatch_spans(axes: Axes, x: FloatArray, meets: NDArray[np.bool_]) -> None:
    edges = _edges(x)
    for k in np.flatnonzero(~meets):
        axes.axvspan(edges[k], edges[k + 1], facecolor=EMPTY, edgecolor=GREY, hatch=_HATCH, linewidth=0, zorder=0)
    axes.set_xlim(edges[0], edges[-1])


def _edges(centers: FloatArray) -> FloatArray:
    """Return the borders between neighbours, and as far beyond the first and the last."""
    if len(centers) == 1:
        half = 0.05 * abs(float(centers[0])) or 0.5
        return np.array([centers[0] - half, centers[0] + half])
    middle = 0.5 * (centers[1:] + centers[:-1])
    return np.concatenate([[2 * centers[0] - middle[0]], middle, [2 * centers[-1] - middle[-1]]])


@styled
def draw_map(found: Findings, metric: Scale) -> Figure:
    """Return one metric over two parameters: colours and level lines."""
    figure = new_figure(140, 100)
    axes = axes_mm(figure, (18, 14, 92, 80))
    down, across = found.varied
    y, rows = _levels(down, found.shape[0], found.shape[1])
    x, columns = _levels(across, found.shape[1], 1)
    values = metric.values.reshape(found.shape)[np.ix_(rows, columns)]
    meets = found.meets.reshape(found.shape)[np.ix_(rows, columns)]
    axes.set_facecolor(EMPTY)
    axes.grid(False)
    box = (114, 14, 4, 80)
    if metric.words:
        _classes(axes, (_edges(x), _edges(y), values), metric, axes_mm(figure, box))
    else:
        mesh = axes.pcolormesh(_edges(x), _edges(y), np.ma.masked_invalid(values), cmap=COLOURS, rasterized=True)
        _level_lines(axes, x, y, values)
        figure.colorbar(mesh, cax=axes_mm(figure, box)).set_label(metric.label)
    if not meets.all():
        _hatch_cells(axes, _edges(x), _edges(y), ~meets)
    axes.set(xlabel=across.label, ylabel=down.label, xlim=_edges(x)[[0, -1]], ylim=_edges(y)[[0, -1]])
    _ticks(axes.xaxis, across)
    _ticks(axes.yaxis, down)
    if found.best is not None:
        _star(axes, across.values[found.best], down.values[found.best])
    return figure


def _classes(axes: Axes, map_: tuple[FloatArray, FloatArray, FloatArray], metric: Scale, key: Axes) -> None:
    """Colour a map by words; the key has those that occur, and each region its own name where it is large enough."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    across, up, values = map_
    there = np.unique(values[np.isfinite(values)]).astype(int)
    index = np.full(len(metric.words), -1.0)
    index[there] = np.arange(len(there))
    shown = np.where(np.isfinite(values), index[np.where(np.isfinite(values), values, 0).astype(int)], np.nan)
    colours = ListedColormap([colormaps[COLOURS](0.15 + 0.8 * k / max(len(metric.words) - 1, 1)) for k in there])
    last = len(there) - 0.5
    mesh = axes.pcolormesh(across, up, np.ma.masked_invalid(shown), cmap=colours, vmin=-0.5, vmax=last, rasterized=True)
    bar = key.figure.colorbar(mesh, cax=key)
    bar.set_ticks(range(len(there)), labels=[metric.words[k] for k in there])
    bar.ax.tick_params(length=0)
    axes.set_title(metric.label, fontsize=SMALL, loc="left")


def _levels(parameter: Scale, count: int, stride: int) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return the values of one parameter of a grid, increasing, and which of its levels they are."""
    levels = parameter.values[: count * stride : stride]
    order = np.argsort(levels, kind="stable")
    return levels[order], order


def _level_lines(axes: Axes, x: FloatArray, y: FloatArray, values: FloatArray) -> None:
    known = values[np.isfinite(values)]
    if min(values.shape) < 3 or not len(known) or known.max() - known.min() <= 1e-9 * abs(known).max():
        return
    lines = axes.contour(x, y, np.ma.masked_invalid(values), levels=6, colors="white", linewidths=0.7)
    axes.clabel(lines, fontsize=SMALL, fmt="%.4g")


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
    axes.add_patch(PathPatch(Path(corners, codes), facecolor="none", edgecolor="#A8A8A8", hatch=_HATCH, linewidth=0))


@styled
def draw_parallel(found: Findings) -> Figure:
    """Return every point as a line over parallel axes, parameters then metrics, coloured by the first metric."""
    from matplotlib import colormaps

    scales = (*found.varied, *found.metrics)
    figure = new_figure(max(120.0, 26.0 * len(scales) + 30), 100)
    width = figure.get_size_inches()[0] * 25.4
    axes = axes_mm(figure, (14, 22, width - 28, 66))
    heights = np.column_stack([_share(scale) for scale in scales])
    chosen = np.flatnonzero(np.isfinite(heights[:, len(found.varied)]))
    thinned = (
        chosen[np.linspace(0, len(chosen) - 1, min(len(chosen), MOST_LINES)).astype(int)] if len(chosen) else chosen
    )
    for k in sorted(thinned.tolist(), key=lambda k: bool(found.meets[k])):
        colour = colormaps[COLOURS](heights[k, len(found.varied)]) if found.meets[k] else "#D5D5D5"
        axes.plot(heights[k], color=colour, linewidth=0.6, alpha=0.7)
    if found.best is not None:
        axes.plot(heights[found.best], color=VERMILLION, linewidth=2.0)
    _parallel_axes(axes, scales)
    return figure


def _share(scale: Scale) -> FloatArray:
    """Return where the values lie between the smallest and the largest of them."""
    known = scale.values[np.isfinite(scale.values)]
    if not len(known) or known.max() == known.min():
        return np.where(np.isfinite(scale.values), 0.5, np.nan)
    share: FloatArray = (scale.values - known.min()) / (known.max() - known.min())
    return share


def _parallel_axes(axes: Axes, scales: Sequence[Scale]) -> None:
    for k, scale in enumerate(scales):
        axes.axvline(k, color=INK, linewidth=0.8)
        known = scale.values[np.isfinite(scale.values)]
        if not len(known):
            continue
        for height, value in ((0.0, known.min()), (1.0, known.max())):
            text = scale.words[int(value)] if scale.words else f"{value:.4g}"
            below = height == 0.0
            place = (k, -0.02 if below else 1.02)
            axes.annotate(
                text, place, ha="center", va="top" if below else "bottom", fontsize=SMALL, annotation_clip=False
            )
    axes.set_xticks(range(len(scales)), [scale.label.replace(" [", "\n[") for scale in scales], fontsize=SMALL)
    axes.tick_params(axis="x", length=0, pad=12)
    axes.set(ylim=(0, 1), xlim=(-0.05, len(scales) - 0.95), yticks=[])
    axes.grid(False)
    axes.spines[["left", "bottom"]].set_visible(False)


def _ticks(axis: Any, parameter: Scale) -> None:
    if parameter.words:
        axis.set_ticks(range(len(parameter.words)), labels=list(parameter.words))


def _star(axes: Axes, x: float, y: float) -> None:
    if np.isfinite([x, y]).all():
        axes.plot(
            [x], [y], marker="*", markersize=12, color=VERMILLION, markeredgecolor="white", clip_on=False, zorder=5
        )

"""Maps of a study: one metric over two parameters, in colours, with lines of equal value."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.plots.rounding import is_level, levelled
from cfmkit.plots.study_marks import COLOURS, EMPTY, HATCH, HEAD, edges, head, key_of, star, ticks
from cfmkit.plots.style import INK, SMALL, axes_mm, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.plots.study_data import DrawnScale, StudyMarks

MOST_TICKS = 8
"""Values of a parameter that have a tick each: with more their numbers come close to each other (by eye)."""

FINE = 80
"""Places along an axis that level lines are drawn through: about 1 mm of print apart, where no corner shows."""


@styled
def draw_map(found: StudyMarks, metric: DrawnScale) -> Figure:
    """Return one metric over two parameters: colours and level lines."""
    figure = new_figure(140, 100 + HEAD)
    axes = axes_mm(figure, (18, 14, 92, 80))
    down, across = found.varied
    up, along = _places(down, found.shape[0], found.shape[1]), _places(across, found.shape[1], 1)
    values = levelled(metric.values).reshape(found.shape)[np.ix_(up.order, along.order)]
    meets = found.meets.reshape(found.shape)[np.ix_(up.order, along.order)]
    x, y = along.borders, up.borders
    axes.set_facecolor(EMPTY)
    axes.grid(False)
    box = (114, 14, 4, 80)
    if metric.words:
        _classes(axes, (x, y, values), metric, axes_mm(figure, box))
    else:
        mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(values), cmap=COLOURS, rasterized=True)
        _level_lines(axes, up, along, values)
        figure.colorbar(mesh, cax=axes_mm(figure, box)).set_label(metric.label)
    if not meets.all():
        _hatch_cells(axes, x, y, ~meets)
    axes.set(xlabel=across.axis, ylabel=down.axis)
    along.dress(axes, "x")
    up.dress(axes, "y")
    best = found.best
    starred = best is not None and star(axes, across.values[best], down.values[best])
    key = key_of(found, starred, not meets.all(), not np.isfinite(values).all())
    head(figure, found, f"{metric.plain} over {across.plain} and {down.plain}", key)
    return figure


def _classes(axes: Axes, map_: tuple[FloatArray, FloatArray, FloatArray], metric: DrawnScale, key: Axes) -> None:
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


@dataclass(frozen=True)
class MapPlaces:
    """The values of one parameter of a grid along an axis.

    Attributes
    ----------
    scale : DrawnScale
        The parameter.
    values : (n,) array
        Increasing.
    order : (n,) array of int
        Which of the grid's levels they are.
    """

    scale: DrawnScale
    values: FloatArray
    order: NDArray[np.intp]

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
        """Where they stand on the axis."""
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


def _places(parameter: DrawnScale, count: int, stride: int) -> MapPlaces:
    levels = parameter.values[: count * stride : stride]
    order = np.argsort(levels, kind="stable")
    return MapPlaces(parameter, levels[order], order)


def _level_lines(axes: Axes, up: MapPlaces, across: MapPlaces, values: FloatArray) -> None:
    """Draw lines of equal value; on a coarse grid along a smooth surface through its values."""
    known = values[np.isfinite(values)]
    if min(values.shape) < 3 or up.words or across.words or not len(known):
        return
    low, high = float(known.min()), float(known.max())
    levels = _between(low, high)
    if is_level(known) or not len(levels):
        return
    x, y = across.positions, up.positions
    if len(known) == values.size:
        y, values = _finer(y, values, 0)
        x, values = _finer(x, values, 1)
    lines = axes.contour(
        across.value(x), up.value(y), np.ma.masked_invalid(values), levels=levels, colors="white", linewidths=0.7
    )
    from matplotlib import patheffects

    # white is read on the dark end of the colours only; a dark outline carries it over the light end
    outline: list[patheffects.AbstractPathEffect] = [patheffects.withStroke(linewidth=1.6, foreground=INK)]
    lines.set_path_effects(outline)
    for label in axes.clabel(lines, fontsize=SMALL, fmt="%.4g"):
        label.set_path_effects(outline)


def _between(low: float, high: float) -> FloatArray:
    """Return round values clearly between two: a line at the lowest or highest value would follow rounding."""
    from matplotlib.ticker import MaxNLocator

    levels = np.asarray(MaxNLocator(7).tick_values(low, high))
    room = 0.02 * (high - low)
    found: FloatArray = levels[(levels > low + room) & (levels < high - room)]
    return found


def _finer(places: FloatArray, values: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Return a grid with more places along one axis, through the same values, without new ups and downs."""
    steps = FINE // len(places)
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
    axes.add_patch(PathPatch(Path(corners, codes), facecolor="none", edgecolor="#A8A8A8", hatch=HATCH, linewidth=0))

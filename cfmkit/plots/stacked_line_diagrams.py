"""Named lines over a common axis, with limits and special regions: the everyday diagram."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.axis_labels_and_headings import (
    Heading,
    axis_label,
    finite_range,
    plain_ticks,
    shown_range,
    write_heading,
)
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.style import TEXT_GREY, TROUBLE_RED, apply_style, axes_mm, is_plain, new_figure
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class Series:
    """One line: SI values, a name to write beside it (empty for none) and how it looks."""

    values: FloatArray
    name: str
    color: str
    dashed: bool = False
    prefer: float = 0.6


@dataclass(frozen=True)
class MarkedRange:
    """A part of the horizontal axis that is special: where it starts and stops [SI], and why."""

    start: float
    stop: float
    text: str


@dataclass(frozen=True)
class Limit:
    """A horizontal line that must not be passed, or that is good to know: SI value and name."""

    value: float
    text: str
    trouble: bool = False


@dataclass(frozen=True)
class Scale:
    """An axis: what is on it, its dimension, and whether zero must be on it or it is logarithmic."""

    name: str
    dimension: str
    zero: bool = True
    log: bool = False

    @property
    def label(self) -> str:
        """The label of the axis, with its unit."""
        return axis_label(self.name, self.dimension)


@dataclass(frozen=True)
class Diagram:
    """Everything on one pair of axes."""

    over: FloatArray  # (n,) what is on the horizontal axis [SI]
    # x, y: the axes
    x: Scale
    y: Scale
    series: Sequence[Series]  # lines, each of n values
    limits: Sequence[Limit] = ()  # horizontal lines
    regions: Sequence[MarkedRange] = ()  # shaded parts of the horizontal axis


def draw_diagram(diagram: Diagram, ax: Axes) -> Axes:
    """Draw a diagram on axes; return the axes."""
    if is_plain():
        diagram = replace(diagram, limits=(), regions=())
    x = to_border(np.asarray(diagram.over, dtype=float), diagram.x.dimension)
    names = []
    for item in diagram.series:
        y = to_border(np.asarray(item.values, dtype=float), diagram.y.dimension)
        ax.plot(x, y, color=item.color, linewidth=1.4, linestyle="--" if item.dashed else "-", zorder=3)
        if item.name:
            names.append(Label(item.name, item.color, np.column_stack([x, y]), item.prefer))
    _scale_axes(diagram, ax)
    for limit in diagram.limits:
        height = float(to_border(limit.value, diagram.y.dimension))
        names.append(level(ax, height, limit.text, TROUBLE_RED if limit.trouble else TEXT_GREY))
    names += [shade(ax, item, diagram.x.dimension) for item in diagram.regions]
    ax.set_xlabel(diagram.x.label)
    ax.set_ylabel(diagram.y.label)
    place_labels(ax, names)
    return ax


@apply_style
def diagram_figure(
    heading: Heading,  # what to write above
    diagrams: Sequence[Diagram],  # from top to bottom; regions are named in the first
    # top_mm, right_mm: room kept free above the first diagram and to the right, for a second axis [mm]
    top_mm: float = 0.0,
    right_mm: float = 5.0,
) -> Figure:
    """Return a figure of diagrams below each other, over one common axis."""
    figure = new_figure()
    write_heading(figure, heading)
    height = (100.0 - heading.height_mm - 1.5 - top_mm - 12.0 + 4.0) / len(diagrams)
    for index, diagram in enumerate(diagrams):
        bottom = 12.0 + height * (len(diagrams) - 1 - index)
        ax = draw_diagram(diagram, axes_mm(figure, (17.0, bottom, 143.0 - right_mm, height - 4.0)))
        if index + 1 < len(diagrams):
            ax.set_xlabel("")
            ax.tick_params(labelbottom=False)
    return figure


def _scale_axes(diagram: Diagram, ax: Axes) -> None:
    ends = [value for region in diagram.regions for value in (region.start, region.stop)]
    across = finite_range(to_border(np.concatenate([diagram.over, ends]), diagram.x.dimension)) or (0.0, 1.0)
    ax.set_xlim(*pad_limits(across, 0.0, 0.02))
    values = [np.asarray(item.values, dtype=float) for item in diagram.series]
    shown = (finite_range if diagram.y.log else shown_range)(np.concatenate(values))
    marks = [item.value for item in diagram.limits]
    low, high = to_border(np.array(finite_range([*(shown or ()), *marks]) or (0.0, 1.0)), diagram.y.dimension).tolist()
    if diagram.y.log:
        ax.set_yscale("log")
        ax.set_ylim(low / 1.6, high * 1.6)
        plain_ticks(ax.yaxis)
        return
    low, high = (min(low, 0.0), max(high, 0.0)) if diagram.y.zero else (low, high)
    ax.set_ylim(*pad_limits((low, high), 0.0 if low == 0 else 0.08, 0.14))


def pad_limits(ends: tuple[float, float], below: float, above: float) -> tuple[float, float]:
    """Return limits with a margin below and above, as fractions of their distance; never empty."""
    width = ends[1] - ends[0]
    if width <= 0:
        width = abs(ends[0]) or 1.0
        below = above = 0.5
    return ends[0] - below * width, ends[1] + above * width


def level(ax: Axes, height: float, text: str, color: str = TEXT_GREY) -> Label:
    """Draw a dashed horizontal line right across, in border units; return its name, still to be placed."""
    ax.axhline(height, color=color, linewidth=0.9, dashes=(6, 3), zorder=2)
    low, high = ax.get_xlim()
    return Label(text, color, np.column_stack([np.linspace(low, high, 40), np.full(40, height)]), prefer=0.9)


def shade(ax: Axes, region: MarkedRange, dimension: str) -> Label:
    """Shade a part of the horizontal axis over the full height; return its name, still to be placed."""
    start, stop = (float(to_border(value, dimension)) for value in (region.start, region.stop))
    ax.axvspan(start, stop, color=TROUBLE_RED, alpha=0.12, linewidth=0, zorder=0.5, gid="no-obstacle")
    low, high = ax.get_ylim()
    share = np.linspace(0.02, 0.98, 40)
    height = low * (high / low) ** share if ax.get_yscale() == "log" else low + (high - low) * share
    return Label(region.text, TROUBLE_RED, np.column_stack([np.full(40, 0.5 * (start + stop)), height]), prefer=0.15)

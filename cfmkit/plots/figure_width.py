"""Figures in another width than they are drawn in, by matplotlib's constrained layout.

A drawing asks for its axes by boxes in millimetres of print. It is drawn once as it asks; the boxes say which axes
stand beside and below each other. In this grid constrained layout makes room for numbers and names at the new width,
and with the boxes that it finds the figure is drawn again: names beside lines are placed in the axes as they are.
"""

from __future__ import annotations

from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

Box = tuple[float, float, float, float]  # left, bottom, width and height [mm of print]

HEADING_MM = 6.0  # height of a heading, which is cut off where there is none
PAD_MM = 1.2  # around axes with their numbers and names
MIN_SHARE_OF_WIDTH = 0.6
"""Axes side by side that would become narrower than this share stand below each other: names beside lines overlap."""
MIN_HEIGHT_FACTOR, MAX_HEIGHT_FACTOR = 0.8, 1.1
"""Limits to the change of a diagram's height with its width: a column of 84 mm gets about 84 x 75 mm."""
MAX_STACKED = 6  # more axes are not stacked: they are small ones of one kind, and would fill a page
MAX_STACK_HEIGHT_MM = 230.0  # the height of a page of print
KEY_MM = 8.0  # boxes that are narrower are keys of colours: they stay beside their diagram
EDGE_PT = 4.0  # smallest distance of a name from the edge of the paper: half a letter
MIN_FONT_FACTOR = 0.7  # share of their size to which letters are made smaller: 5 to 6 pt, which print still shows
LETTER_WIDTH = 0.55  # mean width of a letter, in parts of the font size
BOX_DIGITS = 4
"""Of boxes [mm]: constrained layout differs in its last digits each time, and a figure has the same bytes each time."""


@dataclass
class FigureLayout:
    """Size and boxes that a drawing asks for, and the boxes that it gets; without `boxes` those it asks for."""

    size: tuple[float, float] = (0.0, 0.0)  # of the figure [mm]
    asked: list[Box] = field(default_factory=list)  # in the order of the drawing
    axes: list[Axes] = field(default_factory=list)  # those that got the boxes
    boxes: Sequence[Box] = ()
    own_numbers: bool = False  # whether every axis has numbers, also those whose neighbour had them for both
    broken: tuple[int, ...] = ()  # axes of the figure whose vertical name takes two lines
    width: float | None = None  # of the figure, for drawings that lay themselves out [mm]; None: their own

    def record_size(self, width: float, height: float) -> tuple[float, float]:
        """Return the size of the figure, and note it where none is set."""
        if not self.boxes:
            self.size = (width, height)
        return self.size

    def place_box(self, box: Box) -> Box:
        """Return the box that axes get, and note the one that was requested."""
        self.asked.append(box)
        return self.boxes[len(self.asked) - 1] if self.boxes else box


_ACTIVE_LAYOUT: ContextVar[FigureLayout | None] = ContextVar("layout", default=None)


def active_layout() -> FigureLayout | None:
    """Return the layout of the figure that is being drawn; None if it is drawn as it asks."""
    return _ACTIVE_LAYOUT.get()


def print_width(usual: float) -> float:
    """Return the requested width [mm], for a drawing that lays itself out in any width: without `axes_mm`."""
    layout = active_layout()
    return usual if layout is None or layout.width is None else layout.width


@contextmanager
def _apply_layout(layout: FigureLayout) -> Iterator[None]:
    mark = _ACTIVE_LAYOUT.set(layout)
    try:
        yield
    finally:
        _ACTIVE_LAYOUT.reset(mark)


def draw_in_width(make: Callable[[], Figure], width: float | None, titles: bool) -> Figure:
    """Return a figure in a width [mm], by default its own; without titles their height is cut off."""
    first = layout = FigureLayout(width=width)
    with _apply_layout(first):
        figure = make()
    if not first.axes:
        return figure
    for _ in range(2):  # keys and notes that take more lines in the new width get their room in the second round
        layout = _fit(figure, layout.axes, first, first.size[0] if width is None else width, titles)
        with _apply_layout(layout):
            figure = make()
        for number, ax in enumerate(figure.axes):
            if layout.own_numbers:
                ax.tick_params(labelleft=True, labelbottom=True)
            if number in layout.broken:
                _break_label(ax)
        for text in figure.texts:
            _keep_note_on_paper(text, figure)
    for ax in figure.axes:
        _keep_name_on_paper(ax)
    return figure


def _fit(figure: Figure, axes: Sequence[Axes], first: FigureLayout, width: float, titles: bool) -> FigureLayout:
    """Return the layout for another width; the figure, which was drawn in any layout, is taken apart for it."""
    boxes = np.array(first.asked)
    left, bottom, right, top = _free_margins(figure, width)
    top -= 0.0 if titles else min(HEADING_MM, max(top - PAD_MM, 0.0))
    stacked = _must_stack(boxes, first.size[0], width)
    rows, columns = _stack_cells(boxes) if stacked else _cells(boxes)
    to_scale = any(ax.get_aspect() != "auto" for ax in axes)
    _prepare(figure, stacked)
    height = first.size[1] if not stacked else float(rows.sizes.sum())

    def lay_out(height: float) -> FloatArray:
        margins = left / width, bottom / height, 1.0 - (left + right) / width, 1.0 - (bottom + top) / height
        return _constrain(figure, axes, (width, height), (rows, columns), margins)

    for _ in range(3):  # the height follows from the width that is left for the axes, which needs the height
        placed = lay_out(height)
        for ax in figure.axes:
            if _is_too_long(ax):
                _break_label(ax)
        around = height - _row_height(placed, rows)
        factor = float(np.median(placed[:, 2] / boxes[:, 2]))
        if stacked:
            factor = min(1.0, (MAX_STACK_HEIGHT_MM - around) / rows.sizes.sum(), factor if to_scale else 1.0)
        elif not to_scale:
            factor = min(max(factor, MIN_HEIGHT_FACTOR), MAX_HEIGHT_FACTOR)
        height = around + max(factor, 0.2) * _row_height(boxes, rows)
    placed = lay_out(height)
    broken = tuple(number for number, ax in enumerate(figure.axes) if "\n[" in ax.get_ylabel())
    return FigureLayout((width, height), boxes=list(map(tuple, placed.tolist())), own_numbers=stacked, broken=broken)


@dataclass(frozen=True)
class _Cells:
    """Which rows, or columns, of a grid each box takes: from the first to the last one."""

    first: NDArray[np.intp]
    last: NDArray[np.intp]
    sizes: FloatArray  # of the rows or columns [mm]

    @property
    def count(self) -> int:
        return len(self.sizes)


def _cells(boxes: FloatArray) -> tuple[_Cells, _Cells]:
    """Return rows from the top and columns from the left, in the order in which boxes begin."""
    columns = _cells_along(boxes[:, 0], boxes[:, 0] + boxes[:, 2])
    rows = _cells_along(-(boxes[:, 1] + boxes[:, 3]), -boxes[:, 1])
    return rows, columns


def _cells_along(starts: FloatArray, ends: FloatArray) -> _Cells:
    """Return the cells along one direction: a new one begins where a box begins that is beyond another one."""
    edges = [float(starts.min())]
    for start in np.sort(starts):
        if start - edges[-1] > 1.0 and any(ends[k] <= start + 1.0 and ends[k] > edges[-1] for k in range(len(ends))):
            edges.append(float(start))
    bounds = np.array(edges)
    first = np.searchsorted(bounds, starts + 1.0, side="right") - 1
    last = np.maximum(np.searchsorted(bounds, ends - 1.0, side="right") - 1, first)
    sizes = [
        max((ends[k] - bounds[cell] for k in range(len(ends)) if first[k] == last[k] == cell), default=1.0)
        for cell in range(len(bounds))
    ]
    return _Cells(first, last, np.array(sizes))


def _stack_cells(boxes: FloatArray) -> tuple[_Cells, _Cells]:
    """Return one column, in which boxes stand in the order in which they are read."""
    order = sorted(range(len(boxes)), key=lambda k: (-round(boxes[k][1] + boxes[k][3]), boxes[k][0]))
    row = np.argsort(order)
    none = np.zeros(len(boxes), dtype=int)
    return _Cells(row, row, boxes[order, 3]), _Cells(none, none, np.array([boxes[:, 2].max()]))


def _must_stack(boxes: FloatArray, size: float, width: float) -> bool:
    """Return True if axes stand side by side that would become too narrow."""
    _, columns = _cells(boxes)
    free = size - columns.sizes.sum()
    share = (width - free) / columns.sizes.sum()
    return share < MIN_SHARE_OF_WIDTH and columns.count > 1 and len(boxes) <= MAX_STACKED and boxes[:, 2].min() > KEY_MM


def _row_height(boxes: FloatArray, rows: _Cells) -> float:
    """Return the height of the rows of axes, without what is between them [mm]."""
    single = rows.first == rows.last
    heights = [float(boxes[single & (rows.first == row), 3].max(initial=0.0)) for row in range(rows.count)]
    return sum(heights) or float(boxes[:, 3].max())


def _free_margins(figure: Figure, new_width: float) -> Box:
    """Return what is free of axes at the left, bottom, right and top [mm]: margins for texts beside them."""
    figure.canvas.draw()
    boxes = [ax.get_tightbbox() for ax in figure.axes]
    extents = np.array([[box.x0, box.y0, box.x1, box.y1] for box in boxes if box is not None])
    scale = 25.4 / figure.dpi
    low, high = extents[:, :2].min(axis=0) * scale, extents[:, 2:].max(axis=0) * scale
    width, height = figure.bbox.width * scale, figure.bbox.height * scale
    texts = [item.get_window_extent() for item in (*figure.texts, *figure.legends)]
    beside = any(text.x0 * scale > high[0] - 1.0 for text in texts)
    right = (width - high[0]) * new_width / width if beside else PAD_MM
    # where it begins decides: what takes more lines than before may reach into the axes
    above = max((height - text.y0 * scale + 0.5 for text in texts if text.y1 * scale > high[1] - 2.0), default=0.0)
    below = max((text.y1 * scale for text in texts if text.y1 * scale < low[1] + 1.0), default=0.0)
    return PAD_MM, max(below, PAD_MM), right, max(above, PAD_MM)


def _prepare(figure: Figure, own_numbers: bool) -> None:
    """Let axes fill their boxes, and leave names within them out of the layout."""
    for ax in figure.axes:
        ax.set_aspect("auto")
        if own_numbers:
            ax.tick_params(labelleft=True, labelbottom=True)
        frame = ax.get_window_extent()
        for text in ax.texts:
            text.set_in_layout(not frame.overlaps(text.get_window_extent()))


def _constrain(
    figure: Figure, axes: Sequence[Axes], size: tuple[float, float], cells: tuple[_Cells, _Cells], margins: Box
) -> FloatArray:
    """Return the boxes that constrained layout finds in a figure of a size [mm], (n, 4)."""
    from matplotlib.gridspec import GridSpec
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    rows, columns = cells
    figure.set_size_inches(size[0] / 25.4, size[1] / 25.4)
    grid = GridSpec(rows.count, columns.count, figure, width_ratios=columns.sizes, height_ratios=rows.sizes)
    places = [ax.get_position(original=True).bounds for ax in axes]
    twins = [[ax for ax in figure.axes if ax.get_position(original=True).bounds == place] for place in places]
    for k, together in enumerate(twins):
        for ax in together:
            ax.set_subplotspec(grid[rows.first[k] : rows.last[k] + 1, columns.first[k] : columns.last[k] + 1])
    pad = PAD_MM / 25.4
    engine = ConstrainedLayoutEngine(w_pad=pad, h_pad=pad, wspace=0.0, hspace=0.0, rect=margins)
    figure.set_layout_engine(engine)
    engine.execute(figure)
    bounds = [ax.get_position(original=True).bounds for ax in axes]
    return np.asarray((np.array(bounds) * np.tile(size, 2)).round(BOX_DIGITS))


def _is_too_long(ax: Axes) -> bool:
    """Return True if the name of a vertical axis is longer than the axis."""
    label, height = ax.yaxis.label, ax.get_window_extent().height * 72.0 / ax.figure.dpi
    return bool(len(label.get_text()) * LETTER_WIDTH * float(label.get_fontsize()) > height)


def _break_label(ax: Axes) -> None:
    """Put the unit of a vertical axis below its name."""
    name, bracket, unit = ax.get_ylabel().rpartition(" [")
    if name:
        ax.yaxis.label.set_text(f"{name}\n{bracket.strip()}{unit}")


def _keep_note_on_paper(text: Text, figure: Figure) -> None:
    """Break a note whose parts are parted by semicolons where it would leave the paper, and make it smaller then."""
    room = figure.bbox.x1 - EDGE_PT / 72.0 * figure.dpi - text.get_window_extent().x0
    parts = text.get_text().split(";  ")
    if text.get_window_extent().width > room and len(parts) > 1:
        half = (len(parts) + 1) // 2
        text.set_text(";  ".join(parts[:half]) + ";\n" + ";  ".join(parts[half:]))
    _shrink(text, text.get_window_extent().width, room)


def _keep_name_on_paper(ax: Axes) -> None:
    """Move the name of a horizontal axis sideways where it would leave the paper, smaller where it is wider."""
    label, paper = ax.xaxis.label, ax.figure.bbox
    edge = EDGE_PT / 72.0 * ax.figure.dpi
    if not label.get_text():
        return
    _shrink(label, label.get_window_extent().width, paper.width - 2.0 * edge)
    ax.xaxis.get_tightbbox()  # puts the label where it will be drawn
    box, room = label.get_window_extent(), ax.get_window_extent().width
    shift = max(paper.x0 + edge - box.x0, 0.0) - max(box.x1 - (paper.x1 - edge), 0.0)
    label.set_x(label.get_position()[0] + shift / room)


def _shrink(text: Text, width: float, room: float) -> None:
    """Make the letters of a text smaller until it fits a width, down to a readable size."""
    if width > room > 0.0:
        text.set_fontsize(float(text.get_fontsize()) * max(room / width, MIN_FONT_FACTOR))

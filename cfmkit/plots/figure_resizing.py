"""Layout of the axes of a figure that is wider or narrower than drawn.

A drawing asks for boxes in millimetres of print. It is listened to once; then boxes are stretched, all by one factor in
both directions, so that what is to scale stays so, and the margins between them keep their size, as their labels do.
"""

from __future__ import annotations

import dataclasses
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

NARROW = 8.0
"""Boxes that are narrower keep their size when a figure is stretched [mm]: keys of colours."""

HEADING = 6.0
"""Room that a heading takes, and that is cut off where there is none [mm]."""

LEAST, MOST = 0.8, 1.1
"""By how much the height of a diagram changes with its width: a column of 84 mm gets about 84 x 75 mm."""

LETTER = 0.55
"""Width of a letter, on the average, in sizes of its type."""

EDGE = 4.0
"""Least distance of the name of an axis from the edge of the paper [pt]: half a letter."""

SMALLEST = 0.7
"""Share of their size to which letters are made smaller: 5 to 6 pt, which print still shows."""

SIDE_BY_SIDE = 0.6
"""Boxes that would become narrower than this share of their width stand below each other instead: names beside lines,
in letters of a fixed size, overlap in less."""

MOST_STACKED = 6
"""More boxes are not stacked: they are small ones of one kind, and would fill a page."""

TALLEST = 230.0
"""Of a figure whose boxes stand below each other [mm]: the height of a page of print."""

Box = tuple[float, float, float, float]


@dataclass
class FigureLayout:
    """Boxes that a drawing asks for, and those it gets: while `boxes` is empty it is only listened to."""

    size: tuple[float, float] = (0.0, 0.0)  # of the figure [mm]
    asked: list[Box] = dataclasses.field(default_factory=list)  # boxes of the axes, in the order of the drawing [mm]
    boxes: Sequence[Box] = ()  # what it gets instead
    stacked: bool = False  # whether boxes that stood side by side stand below each other: each has its own scales, then

    def sized(self, width: float, height: float) -> tuple[float, float]:
        """Return the size of the figure, and note it where none is set."""
        if not self.boxes:
            self.size = (width, height)
        return self.size

    def placed(self, box: Box) -> Box:
        """Return the box that axes get, and note the one that was requested."""
        self.asked.append(box)
        return self.boxes[len(self.asked) - 1] if self.boxes else box

    def stretched(self, width: float, titles: bool, to_scale: bool) -> FigureLayout:
        """Return the layout for another width [mm]: boxes by one factor in both directions, margins as they are.

        Diagrams, which are not to scale, lose less height than width: their labels need it.
        """
        across = _Stretch.of([(left, left + wide) for left, _, wide, _ in self.asked], self.size[0])
        up = _Stretch.of([(low, low + high) for _, low, _, high in self.asked], self.size[1])
        factor = across.factor(width)
        taller = factor if to_scale else min(max(factor, LEAST), MOST)
        top = max((low + high for _, low, _, high in self.asked), default=0.0)
        cut = 0.0 if titles else min(HEADING, max(self.size[1] - top - 2.0, 0.0))
        boxes = []
        for left, low, wide, high in self.asked:
            x, y = across.at(left, factor), up.at(low, taller)
            boxes.append((x, y, across.at(left + wide, factor) - x, up.at(low + high, taller) - y))
        return FigureLayout((width, up.at(self.size[1], taller) - cut), [], boxes)

    def narrowed(self, width: float, titles: bool, to_scale: bool) -> FigureLayout:
        """Return the layout for another width [mm]: stretched, or with boxes below each other where they do not fit."""
        across = _Stretch.of([(left, left + wide) for left, _, wide, _ in self.asked], self.size[0])
        fits = across.factor(width) >= SIDE_BY_SIDE or not self._side_by_side()
        if fits or not all(wide > NARROW for _, _, wide, _ in self.asked) or len(self.asked) > MOST_STACKED:
            return self.stretched(width, titles, to_scale)
        return self._below_each_other(width, titles, to_scale)

    def _side_by_side(self) -> bool:
        """Return whether two boxes stand beside each other, whatever lies above or below them."""
        pairs = ((one, other) for k, one in enumerate(self.asked) for other in self.asked[:k])
        return any(
            min(low + high, lower + higher) > max(low, lower)
            and (left + wide <= other_left or other_left + wider <= left)
            for (left, low, wide, high), (other_left, lower, wider, higher) in pairs
        )

    def _below_each_other(self, width: float, titles: bool, to_scale: bool) -> FigureLayout:
        """Return the layout whose boxes stand in one column, in the order in which they are read."""
        left, below = min(box[0] for box in self.asked), min(box[1] for box in self.asked)
        room = width - left - (self.size[0] - max(box[0] + box[2] for box in self.asked))
        above = max(self.size[1] - max(box[1] + box[3] for box in self.asked) - HEADING, 4.0)
        gap, heading = below + above, HEADING if titles else 0.0
        count = len(self.asked)
        heights = sum(box[3] for box in self.asked)
        share = min(1.0, (TALLEST - heading - count * gap) / heights)
        factors = [max(min(share, room / box[2]) if to_scale else share, 0.2) for box in self.asked]
        top = heading + count * gap + sum(factor * box[3] for factor, box in zip(factors, self.asked, strict=True))
        place, boxes = top - heading, [(0.0, 0.0, 0.0, 0.0)] * count
        for number in sorted(range(count), key=lambda at: (-round(self.asked[at][1]), self.asked[at][0])):
            (_, _, wide, high), factor = self.asked[number], factors[number]
            wide, high = factor * wide if to_scale else room, factor * high
            place -= above + high
            boxes[number] = (left + 0.5 * (room - wide), place, wide, high)
            place -= below
        return FigureLayout((width, top), [], boxes, stacked=True)


@dataclass(frozen=True)
class _Stretch:
    """One direction of a figure: which parts of it are stretched, those that a box wider than `NARROW` covers."""

    parts: tuple[tuple[float, float], ...]
    size: float

    @classmethod
    def of(cls, spans: Sequence[tuple[float, float]], size: float) -> _Stretch:
        parts: list[tuple[float, float]] = []
        for start, end in sorted(span for span in spans if span[1] - span[0] > NARROW):
            if parts and start <= parts[-1][1]:
                parts[-1] = (parts[-1][0], max(end, parts[-1][1]))
            else:
                parts.append((start, end))
        return cls(tuple(parts), size)

    def covered(self, place: float) -> float:
        return sum(max(min(place, end) - start, 0.0) for start, end in self.parts)

    def factor(self, size: float) -> float:
        """Return by how much the parts are stretched for another size."""
        whole = self.covered(self.size)
        return max((size - self.size + whole) / whole, 0.05) if whole else 1.0

    def at(self, place: float, factor: float) -> float:
        """Return where a place comes to lie."""
        return place + (factor - 1.0) * self.covered(place)


_LAYOUT: ContextVar[FigureLayout | None] = ContextVar("layout", default=None)


def current() -> FigureLayout | None:
    """Return the layout of the figure that is being drawn; None if it is drawn as it says."""
    return _LAYOUT.get()


def noted(make: Callable[[], Figure]) -> tuple[Figure, FigureLayout]:
    """Return a figure as it is drawn, and the boxes that it asks for."""
    layout = FigureLayout()
    mark = _LAYOUT.set(layout)
    try:
        return make(), layout
    finally:
        _LAYOUT.reset(mark)


def laid_out(make: Callable[[], Figure], layout: FigureLayout) -> Figure:
    """Return a figure in a layout."""
    mark = _LAYOUT.set(layout)
    try:
        figure = make()
    finally:
        _LAYOUT.reset(mark)
    for ax in figure.axes if layout.stacked else ():
        ax.tick_params(labelleft=True, labelbottom=True)  # a neighbour had the numbers of an axis for both
    for ax in figure.axes:
        _break_label(ax, layout.size[1] / 25.4 * 72.0)
        _keep_on_paper(ax)
        _keep_name_below_on_paper(ax)
    for text in figure.texts:
        _keep_note_on_paper(text, figure)
    return figure


def _break_label(ax: Axes, paper: float) -> None:
    """Put the unit of a vertical axis below its name where both are longer than the axis; `paper` is in points."""
    label = ax.yaxis.label
    name, bracket, unit = label.get_text().rpartition(" [")
    if name and len(label.get_text()) * LETTER * float(label.get_fontsize()) > ax.get_position().height * paper:
        label.set_text(f"{name}\n{bracket.strip()}{unit}")


def _keep_on_paper(ax: Axes) -> None:
    """Bring the name of a vertical axis nearer to its numbers where it would leave the paper at the left."""
    label = ax.yaxis.label
    if not label.get_text():
        return
    ax.yaxis.get_tightbbox()  # puts the label where it will be drawn
    scale = 72.0 / label.figure.dpi
    outside = EDGE - label.get_window_extent().x0 * scale
    if outside <= 0.0:
        return
    ax.yaxis.labelpad -= min(outside, ax.yaxis.labelpad)
    ax.yaxis.get_tightbbox()
    box = label.get_window_extent()
    if box.x0 * scale < EDGE:  # in smaller letters, then
        label.set_fontsize(float(label.get_fontsize()) * max((box.x1 * scale - EDGE) / (box.width * scale), 0.7))


def _keep_note_on_paper(text: Text, figure: Figure) -> None:
    """Break a note whose parts are parted by semicolons where it would leave the paper, and make it smaller then."""
    room = figure.bbox.x1 - EDGE / 72.0 * figure.dpi - text.get_window_extent().x0
    parts = text.get_text().split(";  ")
    if text.get_window_extent().width > room and len(parts) > 1:
        half = (len(parts) + 1) // 2
        text.set_text(";  ".join(parts[:half]) + ";\n" + ";  ".join(parts[half:]))
    _shrink(text, text.get_window_extent().width, room)


def _keep_name_below_on_paper(ax: Axes) -> None:
    """Move the name of a horizontal axis sideways where it would leave the paper, smaller where it is wider."""
    label, paper = ax.xaxis.label, ax.figure.bbox
    edge = EDGE / 72.0 * ax.figure.dpi
    if not label.get_text():
        return
    _shrink(label, label.get_window_extent().width, paper.width - 2.0 * edge)
    ax.xaxis.get_tightbbox()  # puts the label where it will be drawn
    box, room = label.get_window_extent(), ax.get_window_extent().width
    shift = max(paper.x0 + edge - box.x0, 0.0) - max(box.x1 - (paper.x1 - edge), 0.0)
    label.set_x(label.get_position()[0] + shift / room)


def _shrink(text: Text, width: float, room: float) -> None:
    """Write a text in letters so small that it has the room, but not smaller than can be read."""
    if width > room > 0.0:
        text.set_fontsize(float(text.get_fontsize()) * max(room / width, SMALLEST))

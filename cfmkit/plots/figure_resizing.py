"""Where the axes of a figure come to lie when it is to be wider or narrower than it is drawn.

A drawing asks for boxes in millimetres of print. It is listened to once; then boxes are stretched, all by one factor in
both directions, so that what is to scale stays so, and the margins between them keep their size, as their labels do.
"""

from __future__ import annotations

import dataclasses
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.figure import Figure

NARROW = 8.0
"""Boxes that are narrower keep their size when a figure is stretched [mm]: keys of colours."""

HEADING = 6.0
"""Room that a heading takes, and that is cut off where there is none [mm]."""

LEAST, MOST = 0.8, 1.1
"""By how much the height of a diagram changes with its width: a column of 84 mm gets about 84 x 75 mm."""

Box = tuple[float, float, float, float]


@dataclass
class FigureLayout:
    """What a drawing asks for, and what it gets: while `boxes` is empty it is only listened to.

    Attributes
    ----------
    size : (float, float)
        Of the figure [mm].
    asked : list of (left, bottom, width, height)
        Boxes of the axes, in the order of the drawing [mm].
    boxes : sequence of (left, bottom, width, height)
        What it gets instead.
    host : Figure, optional
        Where it draws, if not in a figure of its own.
    above : float
        Room at the top that it is to leave free, for the letter of a panel [mm].
    """

    size: tuple[float, float] = (0.0, 0.0)
    asked: list[Box] = dataclasses.field(default_factory=list)
    boxes: Sequence[Box] = ()
    host: Any = None
    above: float = 0.0

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
    """Return the layout of the figure that is being drawn; None where it is drawn as it says."""
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
        return make()
    finally:
        _LAYOUT.reset(mark)

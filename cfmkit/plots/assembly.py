"""A mechanism put together: its parts in one pose, numbered as in the parts list, and the list beside them."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.axis_labels_and_headings import Heading, write_heading
from cfmkit.plots.parts import PLATE_COLOUR, STEEL_COLOUR, mm
from cfmkit.plots.style import SMALL_FONT, SPRING_OCHRE, TEXT_GREY, TEXT_INK, apply_style, axes_mm, new_figure

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.export.posed_part import PosedBody
    from cfmkit.stock.parts_list import ListedPart

SHEET_SIZE = (220.0, 150.0)
"""Of the figure [mm]."""

LIST_WIDTH = 92.0
"""Of the parts list beside the picture [mm]."""

EDGE_MARGIN, BALLOON_RADIUS = 12.0, 3.0
"""Room for balloons around the parts, and their radius [mm of print]."""

ANCHOR_SHARES = (0.0, 0.6, -0.6, 0.3, -0.3)
"""Where a number may point at a part whose middle is that of another one."""

LETTERS_PER_LINE = 50
"""Of the parts list."""


@apply_style
def assembly_figure(title: str, bodies: Sequence[PosedBody], parts: Sequence[ListedPart], pose: int) -> Figure:
    """Return the picture of an assembly.

    Parameters
    ----------
    title : str
        What the mechanism is called.
    bodies : sequence of PosedBody
        What is drawn, the lowest first; those of a part have the name that its `body` says.
    parts : sequence of ListedPart
        In the order of their item numbers.
    pose : int
        Which pose of bodies that move.
    """
    figure = new_figure(*SHEET_SIZE)
    write_heading(figure, Heading(title, "assembly, numbers as in parts.csv"))
    ax = axes_mm(figure, (0.0, 4.0, SHEET_SIZE[0] - LIST_WIDTH, SHEET_SIZE[1] - 16.0))
    ax.axis("off")
    ax.set(xticks=[], yticks=[])
    drawn = [(body, mm(body.outline(pose))) for body in bodies]
    points = np.vstack([outline for _, outline in drawn])
    low, high = points.min(axis=0), points.max(axis=0)
    _frame(ax, low, high)
    made = {part.body for part in parts if part.source == "make"}
    for body, outline in drawn:
        fill = PLATE_COLOUR if body.name in made else SPRING_OCHRE if body.name.startswith("spring") else STEEL_COLOUR
        ax.fill(*outline.T, zorder=2, facecolor=fill, edgecolor=TEXT_INK, linewidth=0.6, alpha=0.85, gid=body.name)
    _balloons(ax, drawn, parts, low, high)
    _list(figure, parts)
    return figure


def _frame(ax: Axes, low: FloatArray, high: FloatArray) -> None:
    """Set the limits of the axes: the parts to scale, with room for balloons."""
    box = ax.get_position()
    width, height = SHEET_SIZE[0] * box.width, SHEET_SIZE[1] * box.height
    scale = min((width - 2.0 * EDGE_MARGIN) / (high[0] - low[0]), (height - 2.0 * EDGE_MARGIN) / (high[1] - low[1]))
    middle, half = 0.5 * (low + high), 0.5 * np.array([width, height]) / scale
    ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
    ax.set_ylim(middle[1] - half[1], middle[1] + half[1])
    ax.set_aspect("equal")


def _balloons(
    ax: Axes,
    drawn: Sequence[tuple[PosedBody, FloatArray]],
    parts: Sequence[ListedPart],
    low: FloatArray,
    high: FloatArray,
) -> None:
    """Draw a number on each side of the parts, in the order of the heights of what it points at."""
    middle = 0.5 * (low + high)
    neighbours = 0.01 * float(np.hypot(*(high - low)))
    shapes = {}
    for number, part in enumerate(parts, start=1):
        result = [outline for body, outline in drawn if part.body and body.name == part.body]
        if result:  # that of several which is farthest from the middle
            shapes[number] = max(result, key=lambda outline: abs(float(outline.mean(axis=0)[0] - middle[0])))
    anchors: dict[int, tuple[float, float]] = {}
    for number in sorted(shapes, key=lambda entry: float(np.prod(np.ptp(shapes[entry], axis=0)))):  # small ones first
        for share in ANCHOR_SHARES:
            anchors[number] = _anchor(shapes[number], share)
            others = [place for entry, place in anchors.items() if entry != number]
            if all(math.dist(anchors[number], place) > neighbours for place in others):
                break
    left, right = _sides(anchors, middle[0])
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    per_mm = (x1 - x0) / (SHEET_SIZE[0] - LIST_WIDTH)
    for side, numbers in ((x0 + 1.5 * BALLOON_RADIUS * per_mm, left), (x1 - 1.5 * BALLOON_RADIUS * per_mm, right)):
        heights = _spread([anchors[number][1] for number in numbers], 2.6 * BALLOON_RADIUS * per_mm, (y0, y1))
        for number, height in zip(numbers, heights, strict=True):
            x, y = anchors[number]
            ax.plot([x, side], [y, height], color=TEXT_GREY, linewidth=0.5, zorder=5)
            ax.plot([x], [y], marker=".", markersize=3, color=TEXT_INK, zorder=6)
            ax.text(
                side, height, str(number), ha="center", va="center", fontsize=SMALL_FONT, color=TEXT_INK, zorder=7,
                gid=f"item-{number}", bbox={"boxstyle": "circle,pad=0.25", "facecolor": "white", "edgecolor": TEXT_INK},
            )  # fmt: skip


def _anchor(outline: FloatArray, share: float) -> tuple[float, float]:
    """Return a point of a part: the middle of its box, or a share of the way from there to its upper right corner."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    middle = 0.5 * (low + high)
    x, y = (middle + share * (high - middle)).tolist()
    return x, y


def _sides(anchors: dict[int, tuple[float, float]], middle: float) -> tuple[list[int], list[int]]:
    """Return the numbers that stand on the left and on the right, each from below up, as many on both sides."""
    across = sorted(anchors, key=lambda number: (anchors[number][0], number))
    half = sum(anchors[number][0] < middle for number in across)
    half = min(max(half, math.floor(0.4 * len(across))), math.ceil(0.6 * len(across)))
    left, right = across[:half], across[half:]
    return sorted(left, key=lambda entry: anchors[entry][1]), sorted(right, key=lambda entry: anchors[entry][1])


def _spread(heights: Sequence[float], gap: float, ends: tuple[float, float]) -> list[float]:
    """Return increasing heights at least a gap apart, near to the wanted ones."""
    placed: list[float] = []
    for height in heights:
        placed.append(max(height, placed[-1] + gap) if placed else max(height, ends[0] + gap))
    top = ends[1] - gap
    for k in range(len(placed) - 1, -1, -1):
        placed[k] = min(placed[k], top)
        top = placed[k] - gap
    return placed


def _list(figure: Figure, parts: Iterable[ListedPart]) -> None:
    """Write the parts list: item, count, name and size."""
    ax = axes_mm(figure, (SHEET_SIZE[0] - LIST_WIDTH, 4.0, LIST_WIDTH, SHEET_SIZE[1] - 16.0))
    ax.set(xlim=(0.0, LIST_WIDTH), ylim=(0.0, SHEET_SIZE[1] - 16.0))
    ax.axis("off")
    ax.set(xticks=[], yticks=[])
    y = SHEET_SIZE[1] - 20.0
    for number, part in enumerate(parts, start=1):
        name = part.name or part.data.partition(",")[0]
        where = f", {part.place}" if part.place != name else ""
        standard = f" ({part.standard})" if part.standard else ""
        said = f"{part.count} x {name}{where}" + (f": {part.size}" if part.size else "") + standard
        ax.text(2.0, y, str(number), fontsize=SMALL_FONT, color=TEXT_INK, va="top", fontweight="bold")
        for line in textwrap.wrap(said, LETTERS_PER_LINE):
            ax.text(8.0, y, line, fontsize=SMALL_FONT, color=TEXT_INK if part.source == "make" else TEXT_GREY, va="top")
            y -= 3.4
        y -= 1.0
    ax.text(2.0, 1.0, "black: to make, grey: to buy", fontsize=SMALL_FONT, color=TEXT_GREY)

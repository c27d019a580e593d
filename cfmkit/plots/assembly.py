"""A mechanism put together: its parts in one pose, numbered as in the parts list, and the list beside or below them."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.axis_labels_and_headings import Heading, write_heading
from cfmkit.plots.figure_width import print_width
from cfmkit.plots.parts import PLATE_COLOUR, STEEL_COLOUR, mm
from cfmkit.plots.style import (
    SMALL_FONT,
    SPRING_OCHRE,
    TEXT_GREY,
    TEXT_INK,
    apply_style,
    has_titles,
    new_figure,
    size_mm,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.export.posed_part import PosedBody
    from cfmkit.stock.parts_list import ListedPart

SHEET_SIZE = (220.0, 150.0)
"""Of the figure where the list stands beside the picture, unless another width is requested [mm]."""
LIST_WIDTH = 92.0  # of the parts list [mm]
MIN_WIDTH_BESIDE = 150.0
"""Of a figure in which the list stands beside the picture; in a narrower one it stands below [mm]."""
HEADING_ROOM, PLAIN_ROOM, BOTTOM_ROOM = 12.0, 4.0, 4.0
"""Above the picture, with and without a heading, and below it [mm]."""
LINE_HEIGHT, ITEM_GAP, LIST_TOP, KEY_ROOM = 3.4, 1.0, 4.0, 5.0
"""Of the parts list: its lines, between two items, above the first, and for what its colours mean [mm]."""
EDGE_MARGIN, BALLOON_RADIUS = 12.0, 3.0  # room for balloons around the parts, and their radius [mm of print]
MAX_HEIGHT_SHARE = 1.2  # height of the picture above a list, in parts of the figure's width, where a mechanism is tall
ANCHOR_SHARES = (0.0, 0.6, -0.6, 0.3, -0.3)  # where a number may point at a part whose middle is that of another one
LETTERS_PER_MM = 0.6  # of the width of the list that its texts have


@apply_style
def assembly_figure(
    title: str,  # what the mechanism is called
    bodies: Sequence[PosedBody],  # what is drawn, the lowest first; those of a part have the name that its `body` says
    parts: Sequence[ListedPart],  # in the order of their item numbers
    pose: int,  # which pose of bodies that move
) -> Figure:
    """Return the picture of an assembly."""
    drawn = [(body, mm(body.outline(pose))) for body in bodies]
    points = np.vstack([outline for _, outline in drawn])
    low, high = points.min(axis=0), points.max(axis=0)
    width = print_width(SHEET_SIZE[0])
    top = HEADING_ROOM if has_titles() else PLAIN_ROOM
    subject = "assembly, numbers as in parts.csv"
    if width >= MIN_WIDTH_BESIDE:
        room = (width - LIST_WIDTH, SHEET_SIZE[1] - HEADING_ROOM - BOTTOM_ROOM)
        figure = new_figure(width, room[1] + top + BOTTOM_ROOM)
        list_box = (room[0], BOTTOM_ROOM, LIST_WIDTH, room[1])
    else:
        subject = "assembly"  # no more stands beside a name of usual length
        scale = (width - 2.0 * EDGE_MARGIN) / (high[0] - low[0])
        room = (width, min(scale * (high[1] - low[1]) + 2.0 * EDGE_MARGIN, MAX_HEIGHT_SHARE * width))
        n_lines = sum(len(_list_lines(part, width)) for part in parts)
        list_height = LINE_HEIGHT * n_lines + ITEM_GAP * len(parts) + LIST_TOP + KEY_ROOM
        list_box = (0.0, BOTTOM_ROOM, width, list_height)
        figure = new_figure(width, room[1] + list_box[3] + top + BOTTOM_ROOM)
    write_heading(figure, Heading(title, subject))
    ax = _blank_axes(figure, (0.0, size_mm(figure)[1] - top - room[1], *room))
    _set_view(ax, low, high)
    made = {part.body for part in parts if part.source == "make"}
    for body, outline in drawn:
        fill = PLATE_COLOUR if body.name in made else SPRING_OCHRE if body.name.startswith("spring") else STEEL_COLOUR
        ax.fill(*outline.T, zorder=2, facecolor=fill, edgecolor=TEXT_INK, linewidth=0.6, alpha=0.85, gid=body.name)
    _draw_balloons(ax, drawn, parts, low, high)
    _write_list(_blank_axes(figure, list_box), parts, list_box[2:])
    return figure


def _blank_axes(figure: Figure, box: tuple[float, float, float, float]) -> Axes:
    """Return axes without lines and numbers in a box (left, bottom, width, height) [mm of print]."""
    ax = figure.add_axes(tuple(np.array(box) / np.tile(size_mm(figure), 2)))
    ax.axis("off")
    ax.set(xticks=[], yticks=[])
    return ax


def _print_size(ax: Axes) -> tuple[float, float]:
    """Return width and height of axes [mm of print]."""
    (width, height), box = size_mm(ax.figure), ax.get_position()
    return width * box.width, height * box.height


def _set_view(ax: Axes, low: FloatArray, high: FloatArray) -> None:
    """Set the limits of the axes: the parts to scale, with room for balloons."""
    width, height = _print_size(ax)
    scale = min((width - 2.0 * EDGE_MARGIN) / (high[0] - low[0]), (height - 2.0 * EDGE_MARGIN) / (high[1] - low[1]))
    middle, half = 0.5 * (low + high), 0.5 * np.array([width, height]) / scale
    ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
    ax.set_ylim(middle[1] - half[1], middle[1] + half[1])
    ax.set_aspect("equal")


def _draw_balloons(
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
            anchors[number] = _anchor_point(shapes[number], share)
            others = [place for entry, place in anchors.items() if entry != number]
            if all(math.dist(anchors[number], place) > neighbours for place in others):
                break
    left, right = _split_in_sides(anchors, middle[0])
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    per_mm = (x1 - x0) / _print_size(ax)[0]
    for side, numbers in ((x0 + 1.5 * BALLOON_RADIUS * per_mm, left), (x1 - 1.5 * BALLOON_RADIUS * per_mm, right)):
        heights = _space_out([anchors[number][1] for number in numbers], 2.6 * BALLOON_RADIUS * per_mm, (y0, y1))
        for number, height in zip(numbers, heights, strict=True):
            x, y = anchors[number]
            ax.plot([x, side], [y, height], color=TEXT_GREY, linewidth=0.5, zorder=5)
            ax.plot([x], [y], marker=".", markersize=3, color=TEXT_INK, zorder=6)
            ax.text(
                side, height, str(number), ha="center", va="center", fontsize=SMALL_FONT, color=TEXT_INK, zorder=7,
                gid=f"item-{number}", bbox={"boxstyle": "circle,pad=0.25", "facecolor": "white", "edgecolor": TEXT_INK},
            )  # fmt: skip


def _anchor_point(outline: FloatArray, share: float) -> tuple[float, float]:
    """Return a point of a part: the middle of its box, or a share of the way from there to its upper right corner."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    middle = 0.5 * (low + high)
    return tuple((middle + share * (high - middle)).tolist())


def _split_in_sides(anchors: dict[int, tuple[float, float]], middle: float) -> tuple[list[int], list[int]]:
    """Return the numbers that stand on the left and on the right, each from below up, as many on both sides."""
    across = sorted(anchors, key=lambda number: (anchors[number][0], number))
    half = sum(anchors[number][0] < middle for number in across)
    half = min(max(half, math.floor(0.4 * len(across))), math.ceil(0.6 * len(across)))
    left, right = across[:half], across[half:]
    return sorted(left, key=lambda entry: anchors[entry][1]), sorted(right, key=lambda entry: anchors[entry][1])


def _space_out(heights: Sequence[float], gap: float, ends: tuple[float, float]) -> list[float]:
    """Return increasing heights at least a gap apart, near to the wanted ones."""
    placed: list[float] = []
    for height in heights:
        placed.append(max(height, placed[-1] + gap) if placed else max(height, ends[0] + gap))
    top = ends[1] - gap
    for k in range(len(placed) - 1, -1, -1):
        placed[k] = min(placed[k], top)
        top = placed[k] - gap
    return placed


def _list_lines(part: ListedPart, width: float) -> list[str]:
    """Return the lines of one item of a list of a width [mm]: count, name, place, size and standard."""
    name = part.name or part.data.partition(",")[0]
    where = f", {part.place}" if part.place != name else ""
    standard = f" ({part.standard})" if part.standard else ""
    text = f"{part.count} x {name}{where}" + (f": {part.size}" if part.size else "") + standard
    return textwrap.wrap(text, round(LETTERS_PER_MM * (width - 8.0)))


def _write_list(ax: Axes, parts: Sequence[ListedPart], size: tuple[float, float]) -> None:
    """Write the parts list in axes of a size [mm]."""
    ax.set(xlim=(0.0, size[0]), ylim=(0.0, size[1]))
    y = size[1] - LIST_TOP
    for number, part in enumerate(parts, start=1):
        ax.text(2.0, y, str(number), fontsize=SMALL_FONT, color=TEXT_INK, va="top", fontweight="bold")
        for line in _list_lines(part, size[0]):
            ax.text(8.0, y, line, fontsize=SMALL_FONT, color=TEXT_INK if part.source == "make" else TEXT_GREY, va="top")
            y -= LINE_HEIGHT
        y -= ITEM_GAP
    ax.text(2.0, 1.0, "black: to make, grey: to buy", fontsize=SMALL_FONT, color=TEXT_GREY)

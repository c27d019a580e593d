"""Drawings that name the dimensions of a mechanism: dimension lines, angles, leaders and a table of what they mean.

Lengths are in millimetres of the drawing, which shows how a mechanism is made and is not to scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots.style import GREY, INK, NORMAL, SMALL, VERMILLION, new_figure, styled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray

    Point = Sequence[float] | FloatArray

NAME = "#004B8D"
"""Names of dimensions and their lines; dark enough to be read as text."""

ROW, CHARACTERS = 4.2, 58
"""Height of a line of the table [mm], and how many characters its last column has room for."""

_MONO: dict[str, Any] = {"family": "DejaVu Sans Mono", "fontsize": SMALL - 0.3}


@dataclass(frozen=True)
class DrawingSymbol:
    """A symbol of the drawing, the key of the specification that sets it, and what it is."""

    symbol: str
    key: str
    meaning: str


@styled
def drawing(title: str, size_mm: tuple[float, float], known: Sequence[DrawingSymbol]) -> tuple[Figure, Axes]:
    """Return a figure with room for a mechanism of some size [mm, drawn to scale] above the table of its dimensions.

    The coordinates of the axes are millimetres from their lower left corner.
    """
    width, height = size_mm
    rows = [("", "key of the specification", ["what it is"])]
    rows += [(one.symbol, one.key, wrap(one.meaning, CHARACTERS)) for one in known]
    below = ROW * sum(len(lines) for *_, lines in rows) + 5.0
    total = height + below + 8.0
    figure = new_figure(width, total)
    figure.text(3.0 / width, 1 - 5.0 / total, title, fontsize=NORMAL + 1.5, fontweight="bold", va="center")
    axes = figure.add_axes((0.0, below / total, 1.0, height / total))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axes.set_axis_off()
    y = below - 3.0
    for symbol, key, lines in rows:
        cells = (
            (4.0, symbol, NAME, {"fontweight": "bold"}),
            (20.0, key, INK if symbol else GREY, _MONO if symbol else {}),
        )
        for at, text, color, look in (*cells, (77.0, "\n".join(lines), INK if symbol else GREY, {})):
            options: dict[str, Any] = {"fontsize": SMALL + 0.3, "va": "top", "linespacing": 1.25} | look
            figure.text(at / width, y / total, text, color=color, **options)
        y -= ROW * len(lines)
    return figure, axes


def by(right: float, up: float) -> FloatArray:
    """Return a step on the page [mm], to be added to a place."""
    return np.array([right, up], dtype=float)


@styled
def length(ax: Axes, start: Point, end: Point, name: str, off: float = 0.0, beside: float = 2.6) -> None:
    """Draw a named dimension line between two points, shifted to its left by `off`; witness lines lead to it."""
    a, b = np.array(start, float), np.array(end, float)
    along = (b - a) / np.hypot(*(b - a))
    left = np.array([-along[1], along[0]])
    first, last = a + off * left, b + off * left
    for point, foot in ((a, first), (b, last)):
        if off:
            over = foot + np.sign(off) * 1.2 * left
            ax.plot(*np.array([point, over]).T, color=GREY, linewidth=0.5, zorder=4)
    look = {"arrowstyle": "<|-|>", "color": NAME, "linewidth": 0.7, "mutation_scale": 6, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", _pair(last), _pair(first), arrowprops=look, zorder=5)
    _name(ax, (first + last) / 2 + beside * left * (1 if off >= 0 else -1), name)


@styled
def angle(ax: Axes, corner: Point, radius: float, start: float, end: float, name: str, beside: float = 3.0) -> None:
    """Draw an angle [deg] between two directions about a corner, with its name."""
    turn = np.radians(np.linspace(start, end, 40))
    arc = np.array(corner, float) + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    ax.plot(*arc.T, color=NAME, linewidth=0.8, zorder=5)
    middle = np.radians(0.5 * (start + end))
    _name(ax, np.array(corner, float) + (radius + beside) * np.array([np.cos(middle), np.sin(middle)]), name)


@styled
def leader(ax: Axes, point: Point, text_at: Point, name: str, dot: bool = True) -> None:
    """Draw a thin line from a name to what it names."""
    ax.plot(*np.array([point, text_at], float).T, color=NAME, linewidth=0.6, zorder=5)
    if dot:
        ax.plot(*np.array(point, float), marker="o", markersize=2.2, color=NAME, zorder=5, linestyle="")
    _name(ax, text_at, name)


@styled
def arrow(ax: Axes, tail: Point, tip: Point, name: str, at: Point | None = None, color: str = VERMILLION) -> None:
    """Draw a force or a motion, with its name at its tail or at another place."""
    look = {"arrowstyle": "-|>", "color": color, "linewidth": 1.5, "mutation_scale": 10, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", _pair(tip), _pair(tail), arrowprops=look, zorder=6)
    _name(ax, tail if at is None else at, name, color)


@styled
def ground(ax: Axes, start: Point, end: Point, depth: float = 2.5) -> None:
    """Draw a wall from one point to another, hatched on its right."""
    a, b = np.array(start, float), np.array(end, float)
    along = (b - a) / np.hypot(*(b - a))
    right = np.array([along[1], -along[0]])
    ax.plot(*np.array([a, b]).T, color=INK, linewidth=1.2, zorder=3)
    for share in np.arange(0.5, np.hypot(*(b - a)) / 2.0):
        foot = a + 2.0 * share * along
        ax.plot(*np.array([foot, foot + depth * (right - 0.6 * along)]).T, color=GREY, linewidth=0.5, zorder=2)


@styled
def line(ax: Axes, points: Any, color: str = INK, width: float = 1.4, dashed: bool = False, order: float = 3.0) -> None:
    """Draw a line through points."""
    style = {"dashes": (4, 2)} if dashed else {}
    ax.plot(*np.array(points, float).T, color=color, linewidth=width, zorder=order, solid_joinstyle="round", **style)  # type: ignore[arg-type]


@styled
def area(ax: Axes, points: Any, color: str, order: float = 2.0) -> None:
    """Draw a filled outline."""
    ax.fill(*np.array(points, float).T, facecolor=color, edgecolor=INK, linewidth=0.9, zorder=order)


@styled
def disc(
    ax: Axes, center: Point, radius: float, color: str = "white", dashed: bool = False, order: float = 3.5
) -> None:
    """Draw a circle."""
    from matplotlib.patches import Circle

    look = (
        {"facecolor": "none", "edgecolor": GREY, "linestyle": (0, (3, 2))}
        if dashed
        else {"facecolor": color, "edgecolor": INK}
    )
    ax.add_patch(Circle(tuple(np.array(center, float)), radius, linewidth=0.9, zorder=order, **look))


@styled
def coil(ax: Axes, start: Point, end: Point, width: float, coils: int = 9) -> None:
    """Draw a helical spring."""
    from cfmkit.plots.style import OCHRE

    a, b = np.array(start, float), np.array(end, float)
    along = b - a
    across = np.array([-along[1], along[0]]) * width / np.hypot(*along)
    share = np.concatenate([[0.0, 0.1], np.linspace(0.1, 0.9, 2 * coils + 1)[1:-1], [0.9, 1.0]])
    side = np.concatenate([[0.0, 0.0], np.resize([1.0, -1.0], 2 * coils - 1), [0.0, 0.0]])
    ax.plot(*(a + share[:, None] * along + side[:, None] * across).T, color=OCHRE, linewidth=1.2, zorder=2.8)


@styled
def spiral(ax: Axes, center: Point, radius: float) -> None:
    """Draw a torsion spring about a pin."""
    from cfmkit.plots.style import OCHRE

    turn = np.linspace(0.0, 4.5 * np.pi, 120)
    reach = radius * np.linspace(0.45, 1.0, 120)
    ax.plot(
        *(np.array(center, float) + reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])).T,
        color=OCHRE,
        linewidth=1.1,
        zorder=3.2,
    )


def _name(ax: Axes, at: Any, text: str, color: str = NAME) -> None:
    room = {"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none", "alpha": 0.9}
    x, y = _pair(at)
    look = {"color": color, "fontsize": NORMAL, "fontweight": "bold", "ha": "center", "va": "center", "zorder": 7}
    ax.text(x, y, text, bbox=room, **look)  # type: ignore[arg-type]


def _pair(point: Any) -> tuple[float, float]:
    return float(point[0]), float(point[1])

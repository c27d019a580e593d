"""Drawing mechanical parts to scale: plates, rollers, links, springs, forces, bodies in poses; panels for them.

Positions and sizes are given in metres; the axes are in millimetres. Every artist that stands for a part carries its
name as `gid`, so that a reader of the figure (or a test) finds it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import signed_area
from cfmkit.export.posed_part import arc
from cfmkit.export.posed_part import box as box_of
from cfmkit.plots.axis_labels_and_headings import Heading, write_heading
from cfmkit.plots.label_placement import Label
from cfmkit.plots.style import (
    LINE_VERMILLION,
    SMALL_FONT,
    SPRING_OCHRE,
    TEXT_GREY,
    TEXT_INK,
    apply_style,
    axes_mm,
    new_figure,
)
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.export.posed_part import PosedBody
    from cfmkit.plots.style import Look

Point = tuple[float, float]
Box = tuple[float, float, float, float]

PLATE_COLOUR, STEEL_COLOUR, LINK_COLOUR = "#DADADA", "#F4F7FA", "#3D5A73"
"""Fill of what is cut from sheet, of rollers, and colour of links."""
N_DRAWN_COILS = 12  # of a tension spring
TITLE_HEIGHT = 10.0  # room for a title of two lines above a panel [mm]


def mm(values: Any) -> FloatArray:
    """Return metres as millimetres."""
    return np.asarray(to_border(np.asarray(values, dtype=float), "length"))


def plate(ax: Axes, outlines: Iterable[FloatArray], gid: str = "plate") -> None:
    """Draw a plate from closed outlines (n, 2); one that runs clockwise is a hole."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    paths = [Path(np.vstack([mm(points), mm(points[:1])]), closed=True) for points in outlines]
    if paths:
        shape = Path.make_compound_path(*paths)
        ax.add_artist(PathPatch(shape, facecolor=PLATE_COLOUR, edgecolor=TEXT_GREY, linewidth=0.7, zorder=1.2, gid=gid))


def _draw_line(ax: Axes, x: Any, y: Any, **look: Any) -> None:
    """Draw a line; the limits of the axes do not follow it: they are those of `to_scale`.

    `Axes.plot` takes four times as long, to find limits and units and the next colour.
    """
    from matplotlib.lines import Line2D

    ax.add_artist(Line2D(x, y, **look))


def edge(ax: Axes, points: FloatArray, gid: str, **options: Any) -> None:
    """Draw a chain of points (n, 2) as a line: a flank, a path."""
    look: Look = {"color": TEXT_INK, "linewidth": 0.9, "zorder": 1.6} | options
    _draw_line(ax, *mm(points).T, gid=gid, **look)


def roller(ax: Axes, center: Point, radius: float, gid: str = "roller", ghost: bool = False) -> None:
    """Draw a roller with its axis; a ghost is a dashed outline, for another place of the same roller."""
    from matplotlib.patches import Circle

    (x, y), colour = mm(center), TEXT_GREY if ghost else TEXT_INK
    look: Look = {"facecolor": "none" if ghost else STEEL_COLOUR, "linestyle": "--" if ghost else "-"}
    ax.add_artist(Circle((x, y), float(mm(radius)), edgecolor=colour, linewidth=0.9, zorder=2.2, gid=gid, **look))
    _draw_line(ax, [x], [y], marker="o", markersize=2.2, color=colour, zorder=4)


def link(ax: Axes, start: Point, end: Point, gid: str = "link") -> None:
    """Draw a rigid link between two pins."""
    _draw_line(
        ax, *mm([start, end]).T, color=LINK_COLOUR, linewidth=2.0, marker="o", markersize=3.0,
        markerfacecolor="white", markeredgewidth=0.8, zorder=3, gid=gid,
    )  # fmt: skip


def spring(ax: Axes, start: Point, end: Point, width: float, gid: str = "spring") -> None:
    """Draw a tension spring as a zigzag of some width between two pins, straight at its ends."""
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    along = b - a
    length = float(np.hypot(*along))
    across = np.array([-along[1], along[0]]) * (width / length if length else 0.0)
    share = np.concatenate([[0.0, 0.12], np.linspace(0.12, 0.88, 2 * N_DRAWN_COILS + 1)[1:-1], [0.88, 1.0]])
    side = np.zeros(len(share))
    side[2:-2] = np.where(np.arange(len(share) - 4) % 2 == 0, 0.5, -0.5)
    points = a + np.outer(share, along) + np.outer(side, across)
    _draw_line(ax, *mm(points).T, color=SPRING_OCHRE, linewidth=0.9, zorder=2.6, gid=gid, solid_joinstyle="round")


def slider(ax: Axes, center: Point, size: float) -> None:
    """Draw a square block that slides along a guide."""
    from matplotlib.patches import Rectangle

    (x, y), side = mm(center), float(mm(size))
    look: Look = {"facecolor": LINK_COLOUR, "edgecolor": TEXT_INK, "linewidth": 0.6}
    ax.add_artist(Rectangle((x - side / 2, y - side / 2), side, side, zorder=3.4, gid="slider", **look))


def axis_of_symmetry(ax: Axes, low: float, high: float) -> None:
    """Draw the vertical axis x = 0 as a dash-dotted line."""
    look: Look = {"color": TEXT_GREY, "linewidth": 0.6, "dashes": (9, 2.5, 1.5, 2.5)}
    _draw_line(ax, [0.0, 0.0], mm([low, high]), zorder=1.1, gid="axis", **look)


def force_arrow(ax: Axes, tail: Point, tip: Point, gid: str = "force") -> None:
    """Draw a force from `tail` to `tip`."""
    look: Look = {"arrowstyle": "-|>", "color": LINE_VERMILLION, "linewidth": 1.4, "mutation_scale": 10}
    arrow = ax.annotate("", mm(tip).tolist(), mm(tail).tolist(), arrowprops=look | {"shrinkA": 0, "shrinkB": 0})
    arrow.set(zorder=3.5, gid=gid, annotation_clip=False)


def area(ax: Axes, outline: Any, gid: str, **options: Any) -> None:
    """Fill an outline (n, 2) [m]; the limits of the axes do not follow it.

    They are those of `to_scale`: to find what a shape of a hundred points spans takes matplotlib five times as long as
    to draw it.
    """
    from matplotlib.patches import Polygon

    look: Look = {"linewidth": 0.4, "zorder": 2.0} | options
    ax.add_artist(Polygon(mm(outline), closed=True, gid=gid, **look))


def bodies(ax: Axes, shown: Sequence[PosedBody], pose: int, colors: Mapping[str, str]) -> None:
    """Draw bodies in a pose: in their colours by name, rigid ones without a colour as one plate."""
    rigid = [body.outline(pose) for body in shown if body.name not in colors]
    plate(ax, [ring if signed_area(ring) > 0.0 else ring[::-1] for ring in rigid], "rigid")
    for body in shown:
        if body.name in colors:
            area(ax, body.outline(pose), body.name, color=colors[body.name])


def box_around(shown: Iterable[PosedBody], margins: tuple[float, float, float, float]) -> tuple[Box, float]:
    """Return the box of bodies in all their poses with room at its left, bottom, right and top, and the unit of that.

    Room is given in parts of the longer side of the box, as is the unit [m].
    """
    (left, bottom), (right, top) = box_of(shown).tolist()
    unit = max(right - left, top - bottom)
    a, b, c, d = (share * unit for share in margins)
    return (left - a, bottom - b, right + c, top + d), unit


def contact(ax: Axes, point: Point, gid: str = "contact") -> None:
    """Mark a point of contact."""
    look: Look = {"marker": "o", "markersize": 3.2, "color": LINE_VERMILLION, "markeredgewidth": 0, "linestyle": ""}
    _draw_line(ax, *mm([point]).T, zorder=4.5, gid=gid, **look)


def to_scale(ax: Axes, box: Box) -> None:
    """Show the box (left, bottom, right, top) [m] with one scale in both directions and no grid."""
    left, bottom, right, top = mm(box)
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect("equal", adjustable="box")
    ax.grid(False)
    ax.set_xlabel("x [mm]")
    if left == -right:
        ax.set_xticks([-_round_below(0.75 * right), 0.0, _round_below(0.75 * right)])


def _round_below(value: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not above the value."""
    decade = 10.0 ** np.floor(np.log10(value))
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= value * (1 + 1e-12)))


def close_up(ax: Axes, center: Point, half_width: float) -> None:
    """Fill the axes with what surrounds a point [m], one scale in both directions."""
    room = ax.get_window_extent()
    half_height = half_width * room.height / room.width
    to_scale(ax, (center[0] - half_width, center[1] - half_height, center[0] + half_width, center[1] + half_height))
    # long numbers need room: a place far from zero beside the width of the view has many digits
    ax.locator_params("x", nbins=4 if abs(center[0]) < 100.0 * half_width else 2)


@apply_style
def panels(figure: Figure, size_mm: tuple[float, float], titles: Sequence[str], stacked: bool = False) -> list[Axes]:
    """Return titled axes of equal size, spread over the width of the figure or `stacked` from top to bottom.

    The lowest 12 mm stay free for the axis, and `TITLE_HEIGHT` above every panel for its title.
    """
    left, bottom, free, last = 17.0, 12.0, 138.0, len(titles) - 1
    across = 0.0 if stacked else (free - size_mm[0]) / max(last, 1)
    up = size_mm[1] + TITLE_HEIGHT if stacked else 0.0
    corners = [(left + number * across, bottom + (last - number) * up) for number in range(len(titles))]
    axes = [axes_mm(figure, (*corner, *size_mm)) for corner in corners]
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title, fontsize=SMALL_FONT)
        ax.locator_params("x", nbins=4)
    return axes


@apply_style
def poses(heading: Heading, box: Box, titles: Sequence[str]) -> tuple[Figure, list[Axes]]:
    """Return a figure with a titled panel for each of up to three poses, all showing one box [m] to scale."""
    slender = (box[3] - box[1]) / (box[2] - box[0])
    size = (min(43.5, 120.0 / slender), min(43.5 * slender, 120.0))
    figure = new_figure(160.0, 10.0 + size[1] + TITLE_HEIGHT + heading.height_mm)
    write_heading(figure, heading)
    axes = panels(figure, size, titles)
    for ax in axes:
        to_scale(ax, box)
        ax.tick_params(labelleft=ax is axes[0])
    axes[0].set_ylabel("y [mm]")
    return figure, axes


def part_name(text: str, points: Any, toward: Point, color: str = TEXT_INK, prefer: float = 0.5) -> Label:
    """Return the name of a part at some points (n, 2) [m], to stand in a direction from it."""
    return Label(text, color, mm(points).reshape(-1, 2), prefer, toward, halo=False)


def ring(center: Point, radius: float, points: int = 73) -> FloatArray:
    """Return a circle's points, counter-clockwise from the left, (n, 2), in the unit of its centre."""
    return arc(center, radius, -np.pi, 2.0 * np.pi, points)

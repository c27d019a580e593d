"""The part on a sheet of paper: its outline to scale, main dimensions, holes, what it is made of, and a title block.

The thickness of every kind of beam is drawn across it: the force goes with its cube. What is cut is drawn in black,
centre lines are dash-dotted. The datum of the hole table is the lower left corner of everything that is cut. Dimensions
stand outside of the part: along x below it, along y to its left, others on their line.
"""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import HELD_LAYER, UNCUT_LAYERS, Arc, DrawnDimension, Line, Smooth
from cfmkit.plots.parts import mm
from cfmkit.plots.style import (
    LINE_VERMILLION,
    NORMAL_FONT,
    SMALL_FONT,
    TEXT_GREY,
    TEXT_INK,
    apply_style,
    axes_mm,
    new_figure,
)
from cfmkit.stock.stock_series import SIZE_RTOL, screw_through

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import BeamSection, Contour, Drawing, Edge
    from cfmkit.plots.style import Look

PAPER_SIZE = (240.0, 165.0)  # of the figure [mm]: a landscape A4 sheet within its margins, less a caption
COLUMN_WIDTH = 78.0  # width of the column of words [mm]
DIMENSION_STEP = 7.0  # between dimension lines beside each other [mm of print]
PAPER_SCALES = tuple(factor * 10.0**power for power in range(3, -4, -1) for factor in (5.0, 2.0, 1.0))
"""Scales that are used on paper (ISO 5455)."""
ARC_POINTS = 91  # points of a full circle of the picture
POINT_MM = 25.4 / 72.0  # of type [mm]
NUMBER_SIDES = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Of a hole, where its number may stand: right or left, above or below; the first one is preferred."""
MOST_HOLES = 12  # rows of the hole table; more are counted
TITLE_BLOCK = 33.0  # height of the title block [mm]
MAX_THICKNESSES = 2  # thicknesses that are drawn of one beam: of more, the smallest and the largest
STUB_LENGTH, LEADER_LENGTH = 4.0, 7.0
"""Lengths of the arrows that point at a beam from both sides, and of the line to its text [mm of print]."""
ARROW_LOOK: Look = {"linewidth": 0.5, "color": TEXT_INK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
TEXT_ON_LINES: Look = {
    "fontsize": SMALL_FONT,
    "color": TEXT_INK,
    # lines of other dimensions end beside a text that is longer than its own
    "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.4},
}


@dataclass(frozen=True)
class TitleBlock:
    """Words of a drawing on itself."""

    revision: str
    weight: str
    decimals: int = 3  # of a millimetre, of every dimension


@dataclass(frozen=True)
class _Hole:
    """A round hole: where its centre is from the datum, and its diameter [m]."""

    x: float
    y: float
    diameter: float


@apply_style
def drawing_figure(
    drawing: Drawing,  # of the part
    title: str,  # what the mechanism is called
    tolerances: Sequence[str] = (),  # one line for each that the specification states
    block: TitleBlock | None = None,  # without it there is none, and dimensions have three decimals
) -> Figure:
    """Return a part's drawing."""
    decimals = block.decimals if block else TitleBlock.decimals
    figure = new_figure(*PAPER_SIZE)
    x0, y0, x1, y1 = mm(drawing.extents).tolist()
    overall = _overall_dimensions(drawing)
    dimensions = [
        dimension for dimension in drawing.dimensions if not any(_have_same_ends(dimension, whole) for whole in overall)
    ]
    dimensions += overall
    below, beside = (DIMENSION_STEP * (1 + sum(dimension.along == axis for dimension in dimensions)) for axis in "xy")
    room = PAPER_SIZE[0] - COLUMN_WIDTH - beside - 6.0, PAPER_SIZE[1] - below - 12.0
    scale = _paper_scale(min(room[0] / max(x1 - x0, 1e-9), room[1] / max(y1 - y0, 1e-9)))
    width, height = scale * (x1 - x0), scale * (y1 - y0)
    left = beside + 0.5 * (room[0] - width)
    bottom = below + 0.5 * (room[1] - height)
    ax = axes_mm(figure, (0.0, 0.0, PAPER_SIZE[0] - COLUMN_WIDTH, PAPER_SIZE[1]))
    # one unit of the axes is a millimetre of the part; its lower left corner stands at (left, bottom) of the paper
    ax.set_xlim(x0 - left / scale, x0 + (PAPER_SIZE[0] - COLUMN_WIDTH - left) / scale)
    ax.set_ylim(y0 - bottom / scale, y0 + (PAPER_SIZE[1] - bottom) / scale)
    ax.set_aspect("equal")
    ax.axis("off")
    for contour in drawing.contours:
        if contour.layer != "reference":
            _draw_contour(ax, contour)
    drawn_holes = list(holes(drawing))
    for number, hole in enumerate(drawn_holes[:MOST_HOLES], start=1):
        _draw_hole(ax, hole, number, drawing, scale)
    if drawn_holes:
        ax.plot(x0, y0, marker="+", markersize=9, color=LINE_VERMILLION, zorder=6, gid="datum")
    _draw_dimensions(ax, dimensions, (x0, y0, x1, y1), scale, decimals)
    for section in thicknesses(drawing):
        _draw_thickness(ax, section, scale, decimals)
    ratio = f"{scale:g} : 1" if scale >= 1 else f"1 : {1 / scale:g}"
    _write_column(figure, drawing, drawn_holes, (title, ratio), tolerances, block)
    return figure


def thicknesses(drawing: Drawing) -> Iterator[BeamSection]:
    """Yield one section for each thickness of each beam that is dimensioned, of a tapered one the ends of its range."""
    beams: dict[str, dict[float, BeamSection]] = {}
    for section in drawing.sections:
        beams.setdefault(section.beam, {}).setdefault(round(section.thickness, 7), section)
    drawn = set()
    for result in beams.values():
        ordered = sorted(result)
        for thickness in ordered if len(ordered) <= MAX_THICKNESSES else (ordered[0], ordered[-1]):
            if thickness not in drawn:  # equal beams are alike
                drawn.add(thickness)
                yield result[thickness]


def length_in_words(value: float, decimals: int) -> str:
    """Return a length [m] with so many decimals of a millimetre, without zeros at its end.

    >>> length_in_words(0.0442, 3), length_in_words(0.1000004, 3)
    ('44.2 mm', '100 mm')
    """
    return f"{1e3 * value:.{decimals}f}".rstrip("0").rstrip(".") + " mm"


def _draw_thickness(ax: Axes, section: BeamSection, scale: float, decimals: int) -> None:
    """Draw the thickness of a beam across it: arrows from both sides, and the text beyond one of them."""
    middle, across = mm(section.at), np.asarray(section.across)
    if across[1] < 0:
        across = -across
    half = 0.5e3 * section.thickness * across
    look = ARROW_LOOK | {"arrowstyle": "-|>"}
    for sense, far in ((1.0, STUB_LENGTH + LEADER_LENGTH), (-1.0, STUB_LENGTH)):
        tip = middle + sense * half
        ax.annotate("", tip.tolist(), (tip + sense * far / scale * across).tolist(), arrowprops=look, zorder=5)
    place = middle + half + (STUB_LENGTH + LEADER_LENGTH) / scale * across
    side, words = "left" if across[0] >= 0 else "right", f"t {length_in_words(section.thickness, decimals)}"
    x, y = place.tolist()
    ax.text(x, y, words, ha=side, va="center", zorder=7, gid="thickness", **TEXT_ON_LINES)


def holes(drawing: Drawing) -> Iterator[_Hole]:
    """Yield the round holes of a drawing, by diameter, then from the datum outwards."""
    x0, y0, _, _ = drawing.extents
    round_holes = [
        _Hole(edge.center[0] - x0, edge.center[1] - y0, 2.0 * edge.radius)
        for contour in drawing.contours
        if contour.hole and len(contour.edges) == 1
        for edge in contour.edges
        if isinstance(edge, Arc) and edge.full
    ]
    yield from sorted(round_holes, key=lambda hole: (round(hole.diameter, 9), round(hole.y, 9), round(hole.x, 9)))


def _overall_dimensions(drawing: Drawing) -> list[DrawnDimension]:
    """Return width and height over everything that is cut."""
    x0, y0, x1, y1 = drawing.extents
    return [DrawnDimension("overall", (x0, y0), (x1, y0), "x"), DrawnDimension("overall", (x0, y0), (x0, y1), "y")]


def _have_same_ends(first: DrawnDimension, second: DrawnDimension) -> bool:
    """Return whether two dimensions along the same axis have the same ends."""
    axis = "xy".find(first.along)
    if first.along != second.along or axis < 0:
        return False
    ends = [sorted((dimension.start[axis], dimension.end[axis])) for dimension in (first, second)]
    return bool(np.allclose(ends[0], ends[1], rtol=0.0, atol=1e-9))


def _paper_scale(largest: float) -> float:
    """Return the largest scale of paper that fits [mm of print for 1 mm]."""
    fitting = [scale for scale in (*PAPER_SCALES, *(1.0 / scale for scale in PAPER_SCALES)) if scale <= largest]
    return max(fitting, default=largest)


def _edge_points(edge: Edge) -> FloatArray:
    if isinstance(edge, Smooth):
        return edge.points
    if isinstance(edge, Line):
        return np.array([edge.start, edge.end])
    share = np.linspace(edge.start, edge.end, max(3, int(ARC_POINTS * abs(edge.end - edge.start) / (2 * np.pi))))
    return np.array(edge.center) + edge.radius * np.column_stack([np.cos(share), np.sin(share)])


def _contour_corners(contour: Contour) -> FloatArray:
    """Return the corners of a contour [mm], the first one again where it is closed."""
    chain = mm(np.vstack([_edge_points(edge) for edge in contour.edges]))
    return np.vstack([chain, chain[:1]]) if contour.closed else chain


def _draw_contour(ax: Axes, contour: Contour) -> None:
    chain = _contour_corners(contour)
    if contour.layer == "path":
        ax.plot(*chain.T, color=TEXT_GREY, linewidth=0.6, dashes=(8, 2, 1, 2), zorder=2, gid="path")
    elif contour.layer in UNCUT_LAYERS:
        hatch = "////" if contour.layer == HELD_LAYER else "...."
        look: Look = {"facecolor": "none", "edgecolor": TEXT_GREY, "hatch": hatch}
        ax.fill(*chain.T, linewidth=0.0, zorder=1, gid=contour.layer, **look)
    else:
        ax.plot(*chain.T, color=TEXT_INK, linewidth=0.9, zorder=3, solid_joinstyle="round", gid=contour.layer)


def _draw_hole(ax: Axes, hole: _Hole, number: int, drawing: Drawing, scale: float) -> None:
    """Draw a hole's centre and number, the number where no line is cut."""
    corner = mm(drawing.extents).tolist()
    x, y, radius = corner[0] + hole.x * 1e3, corner[1] + hole.y * 1e3, 0.5e3 * hole.diameter
    arm = radius + 1.2 / scale
    ax.plot([x - arm, x + arm], [y, y], color=TEXT_GREY, linewidth=0.5, zorder=2)
    ax.plot([x, x], [y - arm, y + arm], color=TEXT_GREY, linewidth=0.5, zorder=2)
    text = SMALL_FONT * POINT_MM / scale * 0.6 * len(str(number)), SMALL_FONT * POINT_MM / scale
    # beside the hole, or beyond the line around it
    spots = [(side, share * arm) for share in (0.75, 1.1, 1.5, 2.0) for side in NUMBER_SIDES]
    clear = (spot for spot in spots if _is_clear(drawing, (x, y), spot[0], spot[1], text))
    (right, up), distance = next(clear, spots[0])
    look: Look = {"ha": "left" if right > 0 else "right", "va": "bottom" if up > 0 else "top", "color": LINE_VERMILLION}
    ax.text(x + right * distance, y + up * distance, str(number), fontsize=SMALL_FONT, zorder=6, **look)


def _is_clear(
    drawing: Drawing, centre: tuple[float, float], side: tuple[int, int], distance: float, text: tuple[float, float]
) -> bool:
    """Return whether no line runs through the box of a text beside a point [mm]."""
    from matplotlib.path import Path
    from matplotlib.transforms import Bbox

    begin = [at + direction * distance for at, direction in zip(centre, side, strict=True)]
    end = [at + direction * size for at, direction, size in zip(begin, side, text, strict=True)]
    box = Bbox([begin, end])
    lines = (contour for contour in drawing.contours if contour.layer not in UNCUT_LAYERS)
    return not any(Path(_contour_corners(contour)).intersects_bbox(box, filled=False) for contour in lines)


def _draw_dimensions(
    ax: Axes, dimensions: Sequence[DrawnDimension], box: tuple[float, float, float, float], scale: float, decimals: int
) -> None:
    """Draw dimensions: those along x below the part, those along y at its left, the short ones nearest to it."""
    for axis, along in enumerate(("x", "y", "line")):
        chosen = [dimension for dimension in dimensions if dimension.along == along]
        ordered = chosen if along == "line" else sorted(chosen, key=lambda dimension: dimension.value)
        for number, dimension in enumerate(ordered, start=1):
            ends = mm([dimension.start, dimension.end])
            moved = ends.copy()
            if along != "line":
                moved[:, 1 - axis] = box[1 - axis] - number * DIMENSION_STEP / scale
                moved = moved[moved[:, axis].argsort()]
            text = f"{dimension.name} {length_in_words(dimension.value, decimals)}"
            _draw_dimension_line(ax, tuple(moved[0].tolist()), tuple(moved[1].tolist()), text, scale)
            for end in ends if along != "line" else ():
                foot = np.where(np.arange(2) == axis, end, moved[0])
                ax.plot(*np.array([end, foot]).T, color=TEXT_GREY, linewidth=0.35, zorder=1)


def _draw_dimension_line(
    ax: Axes, start: tuple[float, float], end: tuple[float, float], text: str, scale: float
) -> None:
    """Draw a dimension line with arrows, and its text above it, or beside it where it is short."""
    gap = np.subtract(end, start)
    length = float(np.hypot(*gap)) * scale
    arrow = ARROW_LOOK | {"arrowstyle": "<|-|>" if length > 5 else "-"}
    ax.annotate("", end, start, arrowprops=arrow, zorder=4, annotation_clip=False)
    angle = float(np.degrees(np.arctan2(gap[1], gap[0])))
    angle -= 180.0 * round(angle / 180.0) if abs(angle) > 90.0 + 1e-9 else 0.0
    middle = 0.5 * (np.asarray(start) + np.asarray(end))
    normal = np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    x, y = (middle + 0.5 / scale * normal).tolist()
    look = TEXT_ON_LINES | {"rotation": angle, "rotation_mode": "anchor"}
    ax.text(x, y, text, ha="center", va="bottom", zorder=6, **look)


def _write_column(
    figure: Figure,
    drawing: Drawing,
    drawn_holes: Sequence[_Hole],
    about: tuple[str, str],
    tolerances: Sequence[str],
    block: TitleBlock | None,
) -> None:
    """Write the column of words: title, what it is made of, dimensions that are no lines, holes, notes."""
    ax = axes_mm(figure, (PAPER_SIZE[0] - COLUMN_WIDTH, 0.0, COLUMN_WIDTH, PAPER_SIZE[1]))
    ax.set(xlim=(0.0, COLUMN_WIDTH), ylim=(0.0, PAPER_SIZE[1]))
    ax.axis("off")
    ax.plot([0, 0], [6, PAPER_SIZE[1] - 6], color=TEXT_GREY, linewidth=0.6)
    title, ratio = about
    decimals = block.decimals if block else TitleBlock.decimals
    floor = 0.0 if block is None else TITLE_BLOCK + 15.0
    if block is not None:
        _draw_title_block(ax, block, title, ratio)
    rows = [*drawing.facts, ("sheet", _describe_sheet(drawing, decimals)), ("scale", ratio)]
    y = PAPER_SIZE[1] - 10.0
    y = _write_text(ax, 4.0, y, title, NORMAL_FONT + 1.0, "bold") - 2.0
    for word, text in rows:
        ax.text(4.0, y, word, fontsize=SMALL_FONT, color=TEXT_GREY, va="top")
        y = _write_text(ax, 24.0, y, text) - 0.6
    if drawn_holes:
        y = _write_text(ax, 4.0, y - 2.0, "holes, at x, y from the lower left corner (+)", NORMAL_FONT)
        for number, hole in enumerate(drawn_holes[:MOST_HOLES], start=1):
            x, up, across = (length_in_words(size, decimals) for size in (hole.x, hole.y, hole.diameter))
            screw = screw_through(hole.diameter)
            fits = f" ({screw.name})" if screw and math.isclose(screw.hole, hole.diameter, rel_tol=SIZE_RTOL) else ""
            y = _write_text(ax, 4.0, y, f"{number}   \u2300 {across}{fits}   {x.removesuffix(' mm')}, {up}")
        if len(drawn_holes) > MOST_HOLES:
            y = _write_text(ax, 4.0, y, f"and {len(drawn_holes) - MOST_HOLES} more, in the DXF file")
    for heading, lines in (
        ("tolerances", tolerances),
        ("notes", (*drawing.notes, *(warning.message for warning in drawing.warnings))),
    ):
        if lines:
            y = _write_text(ax, 4.0, y - 2.0, heading, NORMAL_FONT)
            for line in lines:
                if y < floor:
                    _write_text(ax, 4.0, y, "more: in the page of the run")
                    return
                y = _write_text(ax, 4.0, y, line)


def _draw_title_block(ax: Axes, block: TitleBlock, title: str, ratio: str) -> None:
    """Draw the block at the foot of the column: name, revision, date to be filled in, weight, scale, projection."""
    left, right, low = 4.0, COLUMN_WIDTH - 3.0, 5.0
    rows = (("name", title), ("revision", block.revision), ("date", ""), ("weight", block.weight), ("scale", ratio))
    high = TITLE_BLOCK / (len(rows) + 1)
    ax.plot([left, right, right, left, left], [low, low, *[low + TITLE_BLOCK] * 2, low], color=TEXT_INK, linewidth=0.7)
    for number, (word, text) in enumerate(rows, start=1):
        y = low + TITLE_BLOCK - number * high
        ax.plot([left, right], [y, y], color=TEXT_GREY, linewidth=0.4)
        ax.text(left + 1.5, y + 0.5 * high, word, fontsize=SMALL_FONT, color=TEXT_GREY, va="center")
        fit = int((right - left - 22.0) / (LETTER_WIDTH * SMALL_FONT))
        short = text if len(text) <= fit else f"{text[: fit - 3]}..."
        ax.text(left + 20.0, y + 0.5 * high, short, fontsize=SMALL_FONT, color=TEXT_INK, va="center")
    y, radius = low + 0.5 * high, 0.32 * high
    ax.text(left + 1.5, y, "projection", fontsize=SMALL_FONT, color=TEXT_GREY, va="center")
    # first angle (ISO 5456-2): a truncated cone, and to its right how it looks from the left
    cone = np.array([[0.0, 0.5], [4.0, 1.0], [4.0, -1.0], [0.0, -0.5], [0.0, 0.5]]) * [1.0, radius] + [left + 20.5, y]
    ax.plot(*cone.T, color=TEXT_INK, linewidth=0.6, gid="first-angle")
    turn = np.linspace(0.0, 2.0 * np.pi, ARC_POINTS)
    for size in (radius, 0.5 * radius):
        ax.plot(left + 29.0 + size * np.cos(turn), y + size * np.sin(turn), color=TEXT_INK, linewidth=0.6)
    ax.text(left + 33.0, y, "first angle", fontsize=SMALL_FONT, color=TEXT_INK, va="center")


def _describe_sheet(drawing: Drawing, decimals: int) -> str:
    sheet = drawing.sheet
    others = sorted({region.thickness for region in sheet.regions})
    if sheet.thickness is None:
        return "thickness not stated" + (f" ('{sheet.key}')" if sheet.key else "")
    text = length_in_words(sheet.thickness, decimals)
    more = [length_in_words(thickness, decimals) for thickness in others if thickness != sheet.thickness]
    return text + (f"; in part {', '.join(more)}" if more else "")


LETTER_WIDTH = 0.235  # mean width of a letter [mm] in points of its size, measured on the font of the figures


def _write_text(ax: Axes, x: float, y: float, text: str, size: float = SMALL_FONT, weight: str = "normal") -> float:
    """Write a text, broken into lines that fit, and return where the next one begins [mm]."""
    fit = max(int((COLUMN_WIDTH - x - 3.0) / (LETTER_WIDTH * size)), 10)
    for line in textwrap.wrap(text, fit, break_long_words=False) or [""]:
        ax.text(x, y, line, fontsize=size, color=TEXT_INK, va="top", fontweight=weight)
        y -= 0.50 * size
    return y

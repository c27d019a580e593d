"""Text and axes of a figure: units, headings that fit, colour keys, ticks, second axes, ranges without poles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots.numbers_in_drawings import WholeNumbers, brief
from cfmkit.plots.style import (
    INCHES_PER_MM,
    NORMAL_FONT,
    SMALL_FONT,
    TEXT_GREY,
    TROUBLE_RED,
    apply_style,
    has_titles,
    is_plain,
    size_mm,
)
from cfmkit.specs.units import border_unit, format_short
from cfmkit.tables import border_values

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.results import Result

POLE_PERCENTAGE = 3.0
"""Percentage of the points at each end of the values that may belong to a pole: three of a curve of 101 points."""
LEFT_MARGIN = 3.0  # distance of headings from the edge of the print [mm], about one letter
LEAST_OF_NAME = 4  # characters of a name that a heading keeps: with fewer it says nothing, and the subject stands alone
KEY_GAP = 3.0  # between the entries of a colour key [mm]: twice the space between words


def axis_label(name: str, dimension: str) -> str:
    """Return a label with the border unit.

    Examples
    --------
    >>> axis_label("spring_elongation", "length")
    'spring elongation [mm]'
    >>> axis_label("friction", "ratio")
    'friction [1]'
    """
    unit = border_unit(dimension)
    return f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " ")


def metric_label(name: str, dimension: str) -> str:
    """Return the label of a metric of a study: shares in per cent, as the pages have them.

    Examples
    --------
    >>> metric_label("force_ripple", "ratio"), metric_label("force_mean[load]", "force")
    ('force ripple [%]', 'force mean load [N]')
    """
    plain = name.replace("[", " ").replace("]", "")
    return f"{plain.replace('_', ' ')} [%]" if dimension == "ratio" else axis_label(plain, dimension)


def metric_values(values: Any, dimension: str) -> FloatArray:
    """Return SI values of a metric in the unit of `metric_label`."""
    return 100.0 * np.asarray(values) if dimension == "ratio" else border_values(values, dimension)


def value_text(value: float, dimension: str) -> str:
    """Return a value with its border unit, rounded to three digits.

    Examples
    --------
    >>> value_text(0.00113969652, "length")
    '1.14 mm'
    """
    if dimension == "ratio" and 0 < abs(value) < 1e-4:
        return "< 0.01 %"
    return format_short(value, dimension, 3).replace("-", "\N{MINUS SIGN}")


@dataclass(frozen=True)
class Heading:
    """Heading of a picture: the name of the mechanism, the subject, and a note on what is wrong."""

    name: str
    subject: str
    note: str = ""

    @classmethod
    def from_result(cls, result: Result, subject: str) -> Heading:
        """Return the heading of a picture of a result; the note says why the run did not complete."""
        done = result.status.key == "complete"
        return cls(result.spec.name, subject, "" if done else f"{result.status.key}: {result.message}")

    @property
    def height_mm(self) -> float:
        """Room that the heading takes at the top of the figure [mm]."""
        return 12.0 if self.note else 8.0


@apply_style
def write_heading(figure: Figure, heading: Heading) -> None:
    """Write a heading at the top left, each part on one line: names that are too long are cut, the subject is not."""
    titles = has_titles()
    if is_plain():
        return
    if titles:
        _write_line(figure, 1.8, (heading.name, f": {heading.subject}"), {"size": NORMAL_FONT + 0.5, "weight": "bold"})
    if heading.note:  # what is wrong is said in any case
        _write_line(figure, (6.4 if titles else 1.8), (heading.note, ""), {"size": SMALL_FONT, "color": TROUBLE_RED})


def _write_line(figure: Figure, down_mm: float, parts: tuple[str, str], look: dict[str, Any]) -> None:
    """Write two parts on one line, the first cut with an ellipsis as far as the width demands.

    Where too little of the first would be left to be recognised, the second stands alone, smaller if it must be.
    """
    width, height = size_mm(figure)
    room = (width - 2.0 * LEFT_MARGIN) * INCHES_PER_MM * figure.dpi
    text = figure.text(LEFT_MARGIN / width, 1.0 - down_mm / height, "", ha="left", va="top", **look)
    first, last = (" ".join(part.split(" ")) for part in (" ".join(parts[0].split()), parts[1]))
    least = min(LEAST_OF_NAME, len(first)) if last else 1
    text.set_text(first + last)
    while (extent := text.get_window_extent().width) > room and len(first) > 1:
        # by the excess at the mean width of a letter, so that two or three rounds do
        excess = (extent - room) / extent * len(first + last)
        first = first[: max(len(first) - 1 - max(int(0.8 * excess), 1), 1)].rstrip()
        if len(first) < least:
            break
        text.set_text(f"{first}…{last}")
    if extent > room and last:
        text.set_text(last.removeprefix(": "))
        extent = text.get_window_extent().width
        text.set_fontsize(look["size"] * min(1.0, room / extent))


def color_key(ax: Axes, entries: Sequence[tuple[str, str]]) -> None:
    """Write texts in their colours above axes side by side, on as many lines as the width of the print demands."""
    points = 72.0 / ax.figure.dpi
    start = ax.get_window_extent().x0 * points
    reach = ax.figure.bbox.width * points - start - LEFT_MARGIN * INCHES_PER_MM * 72.0
    lines: list[list[Any]] = [[]]
    across = 0.0
    for text, color in entries:
        written = ax.annotate(
            text, (0.0, 1.0), xycoords="axes fraction", xytext=(across, 0.0), textcoords="offset points",
            size=SMALL_FONT, color=color, ha="left", va="bottom",
        )  # fmt: skip
        wide = written.get_window_extent().width * points
        if across + wide > reach and lines[-1]:
            lines.append([])
            across = 0.0
        written.set_position((across, 0.0))
        lines[-1].append(written)
        across += wide + KEY_GAP * INCHES_PER_MM * 72.0
    for number, line in enumerate(reversed(lines)):
        for written in line:
            written.set_position((written.get_position()[0], 2.0 + 1.4 * SMALL_FONT * number))


def plain_ticks(axis: Axis) -> None:
    """Write the ticks of a logarithmic axis as plain numbers, at 1, 2 and 5 where decades are few."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = sorted(float(value) for value in axis.get_view_interval())
    few = high < 1e3 * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _position: brief(value)))
    axis.set_minor_formatter(NullFormatter())


def remark(ax: Axes, place: tuple[float, float], text: str, **options: Any) -> None:
    """Write a small grey remark at a place in fractions of the axes."""
    if is_plain():
        return
    look: dict[str, Any] = {"size": SMALL_FONT, "color": TEXT_GREY, "transform": ax.transAxes} | options
    ax.text(*place, text, **look)


@apply_style
def top_axis(
    ax: Axes,  # with final limits
    # places, values: (n,): increasing: where on the lower axis which value of the other quantity stands, in border
    # units
    places: FloatArray,
    values: FloatArray,
    label: str,  # of the new axis
) -> None:
    """Add an axis at the top for another quantity that grows with the lower one."""
    low, high = ax.get_xlim()
    chosen: list[float] = []
    taken = -np.inf
    for value in _round_values(float(values[0]), float(values[-1])):
        place = float(np.interp(value, values, places))
        if place - taken >= 0.09 * (high - low):
            chosen.append(value)
            taken = place
    top = ax.twiny()
    top.set_xlim(low, high)
    top.set_xticks(np.interp(chosen, values, places).tolist(), [brief(value) for value in chosen])
    top.set_xlabel(label)
    top.spines["top"].set_visible(True)
    top.grid(False)


@apply_style
def right_axis(ax: Axes, factor: float, label: str, at_zero: float = 0.0) -> None:
    """Add an axis at the right for `at_zero` plus `factor` times the left quantity, in border units."""
    right = ax.twinx()
    right.yaxis.set_major_formatter(WholeNumbers())
    right.set_ylim(*(at_zero + factor * value for value in ax.get_ylim()))
    right.set_ylabel(label)
    right.spines["right"].set_visible(True)
    right.grid(False)


def _round_values(low: float, high: float) -> list[float]:
    """Return round numbers from `low` to `high`, finer towards `low`."""
    span = high - low
    steps = 10.0 ** np.floor(np.log10(span)) * np.array([1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5, 1, 2, 5])
    ticks = {0.0} if low <= 0 <= high else set()
    for step in steps:
        multiples = step * np.arange(np.ceil(low / step), np.floor(min(high, low + 6 * step) / step) + 1)
        ticks |= {float(f"{value:.6g}") for value in multiples}
    return sorted(ticks)


def finite_range(values: Any) -> tuple[float, float] | None:
    """Return smallest and largest finite value; None if there is none."""
    array = np.asarray(values, dtype=float)
    array = array[np.isfinite(array)]
    return (float(array.min()), float(array.max())) if array.size else None


def shown_range(values: Any) -> tuple[float, float] | None:
    """Return the range worth showing: all finite values, but not the peak of a pole that would hide the rest."""
    whole = finite_range(values)
    if whole is None:
        return None
    array = np.asarray(values, dtype=float)
    array, ends = array[np.isfinite(array)], (POLE_PERCENTAGE, 100.0 - POLE_PERCENTAGE)
    low, high = np.percentile(array, ends).tolist()
    room = 3.0 * max(high - low, 0.2 * max(abs(low), abs(high)))
    least = whole[0] if whole[0] >= low - room else low - 0.3 * room
    return least, whole[1] if whole[1] <= high + room else high + 0.3 * room

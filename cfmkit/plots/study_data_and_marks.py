"""Data of the pictures of studies, and their common marks: heading, key, best point, missed requirements, words.

The outcome of a study comes in border units: no specification, no journal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.plots.axis_labels_and_headings import LEFT_MARGIN, Heading, axis_label, write_heading
from cfmkit.plots.style import LINE_VERMILLION, SMALL_FONT, TEXT_GREY, has_titles, is_plain, size_mm

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.plots.style import Look


PERCENT_DIMENSION = "percent"  # dimension of shares that are drawn in per cent
MAX_LABEL_LENGTH = 64  # characters of an axis label: so many of 8 pt fit on 92 mm of print, the axis of a map


@dataclass(frozen=True, repr=False)
class DrawnScale(ShortRepr):
    """Something that is drawn: a parameter or a metric, in border units."""

    # name, dimension: for its label
    name: str
    dimension: str
    values: FloatArray  # (n,) one for each point; indices into `words` where those are given
    words: tuple[str, ...] = ()  # of a parameter or a metric that is not a number
    short: str = ""  # what it is called beside others; the last part of the name where that is empty
    about: str = ""  # what it is, in a few words; for its axis

    @property
    def label(self) -> str:
        """Label of the axis: the short name, with its unit."""
        short = self.short or self.name.rpartition(".")[2]
        if self.dimension == PERCENT_DIMENSION:
            return f"{short.replace('_', ' ')} [%]"
        has_unit = self.dimension not in ("text", "count")
        return axis_label(short, self.dimension) if has_unit else short.replace("_", " ")

    @property
    def axis(self) -> str:
        """The label with what it is, where an axis has room for it: ``positive.length: of one leaf, L1 [mm]``."""
        short, bracket, unit = self.label.partition(" [")
        path = self.name.removeprefix("mechanism.").replace("_", " ")
        reported = f"{path}: {self.about}{bracket}{unit}"
        return reported if self.about and len(reported) <= MAX_LABEL_LENGTH else f"{short}{bracket}{unit}"

    @property
    def plain(self) -> str:
        """The label without the unit, for sentences."""
        return self.label.partition(" [")[0]

    def text(self, value: float) -> str:
        """Return one of the values with its unit, or as its word."""
        if self.words:
            return self.words[int(value)]
        unit = "" if self.dimension in ("text", "count") else self.label.partition(" [")[2].removesuffix("]")
        return f"{value:.4g}" + (f" {unit}" if unit not in ("", "1") else "")


def short_names(paths: Sequence[str]) -> tuple[str, ...]:
    """Return the last part of each path, with as many parts before it as tell it from the others.

    Examples
    --------
    >>> short_names(["mechanism.bistable.length", "mechanism.positive.length", "mechanism.springs.stiffness.0"])
    ('bistable length', 'positive length', 'stiffness 0')
    """
    parts = [path.split(".") for path in paths]
    counts = [2 if words[-1].isdigit() else 1 for words in parts]
    while True:
        names = [" ".join(words[-count:]) for words, count in zip(parts, counts, strict=True)]
        longer = [
            count + (names.count(name) > 1 and count < len(words))
            for words, name, count in zip(parts, names, counts, strict=True)
        ]
        if longer == counts:
            return tuple(names)
        counts = longer


@dataclass(frozen=True, repr=False)
class StudyMarks(ShortRepr):
    """Outcome of a study, as its pictures need it."""

    # varied, metrics: parameters and the metrics to draw
    varied: tuple[DrawnScale, ...]
    metrics: tuple[DrawnScale, ...]
    shape: tuple[int, ...]  # numbers of values of the parameters of a grid; empty if the points are no grid
    meets: NDArray[np.bool_]  # (n,) whether a point was solved and meets every requirement
    best: int | None = None  # index of the best point
    name: str = ""  # whose study it is, for the heading
    best_words: str = ""  # what makes the best point the best, for the key


@dataclass(frozen=True)
class StudyCurve:
    """One curve of a study: branch name -> (motion, effort) in border units, and its parameter.

    Of two parameters that vary, `parameter` is the second and `panel` the first.
    """

    parameter: float
    branches: Mapping[str, tuple[FloatArray, FloatArray]]
    panel: float | None = None


COLOUR_MAP = "viridis"
EMPTY_COLOUR = "#EFEFEF"
"""The ground where nothing was solved."""
MISSED_HATCH = "////"  # where a requirement is missed
HEAD_HEIGHT = 12.0  # room at the top of a picture of a study for its heading and its key [mm]


def head(figure: Figure, marks: StudyMarks, subject: str, key: Sequence[Artist] = ()) -> None:
    """Write above a picture the name of the study, what it shows, and the meaning of its marks."""
    write_heading(figure, Heading(marks.name, subject) if marks.name else Heading(subject, "all points"))
    if not is_plain() and key and _draw_key(figure, key, len(key)).get_window_extent().x1 > figure.bbox.x1:
        figure.legends[-1].remove()
        _draw_key(figure, key, 1)


def _draw_key(figure: Figure, entries: Sequence[Artist], columns: int) -> Legend:
    """Write the key below the heading, or at the top where there is none."""
    width, height = size_mm(figure)
    down = 6.0 if has_titles() else 1.0
    tight: Look = {"borderpad": 0.0, "borderaxespad": 0.0, "handletextpad": 0.4, "columnspacing": 1.2}
    place = (LEFT_MARGIN - 1.0) / width, 1.0 - down / height
    look: Look = {"loc": "upper left", "bbox_to_anchor": place, "frameon": False, "fontsize": SMALL_FONT}
    return figure.legend(handles=list(entries), ncols=columns, **look, **tight)


def key_of(marks: StudyMarks, starred: bool, hatched: bool, empty: bool = False) -> list[Artist]:
    """Return the entries of the key: those marks that occur."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Artist] = []
    if starred:
        mark: Look = {"marker": "*", "markersize": 9, "color": LINE_VERMILLION, "markeredgecolor": "white"}
        entries.append(Line2D([], [], linestyle="", label=marks.best_words or "best point", **mark))
    if hatched:
        look: Look = {"facecolor": EMPTY_COLOUR, "edgecolor": TEXT_GREY, "hatch": MISSED_HATCH, "linewidth": 0}
        entries.append(Patch(label="requirement missed, or not solved", **look))
    if empty:
        entries.append(Patch(facecolor=EMPTY_COLOUR, label="no value"))
    return entries


def edges(centers: FloatArray) -> FloatArray:
    """Return the borders between neighbours, and as far beyond the first and the last."""
    if len(centers) == 1:
        half = 0.05 * abs(float(centers[0])) or 0.5
        return np.array([centers[0] - half, centers[0] + half])
    middle = 0.5 * (centers[1:] + centers[:-1])
    return np.concatenate([[2 * centers[0] - middle[0]], middle, [2 * centers[-1] - middle[-1]]])


def ticks(axis: Any, parameter: DrawnScale) -> None:
    """Name the places on an axis that stand for words; between whole numbers of things there is none."""
    from matplotlib.ticker import MaxNLocator

    if parameter.dimension == "count" and np.array_equal(parameter.values, np.round(parameter.values), equal_nan=True):
        axis.set_major_locator(MaxNLocator("auto", integer=True, min_n_ticks=1))
    if parameter.words:
        axis.set_ticks(range(len(parameter.words)), labels=list(parameter.words))


def star(axes: Axes, x: float, y: float) -> bool:
    """Mark the best point, and return whether it has a place."""
    has_place = bool(np.isfinite([x, y]).all()) and not is_plain()
    if has_place:
        look: Look = {"marker": "*", "markersize": 12, "color": LINE_VERMILLION, "markeredgecolor": "white"}
        axes.plot([x], [y], clip_on=False, zorder=5, **look)
    return has_place

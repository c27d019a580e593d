"""Common part of the pictures of studies: the best point, missed requirements, words on an axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots.axis_labels_and_headings import LEFT_MARGIN, Heading, write_heading
from cfmkit.plots.style import LINE_VERMILLION, SMALL_FONT, TEXT_GREY, has_titles, is_plain, size_mm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

    from cfmkit.arrays import FloatArray
    from cfmkit.plots.study_data_to_draw import DrawnScale, StudyMarks
    from cfmkit.plots.style import Look

COLOUR_MAP = "viridis"
EMPTY_COLOUR = "#EFEFEF"
"""The ground where nothing was solved."""
MISSED_HATCH = "////"  # where a requirement is missed
HEAD_HEIGHT = 12.0  # room at the top of a picture of a study for its heading and its key [mm]


def head(figure: Figure, found: StudyMarks, subject: str, key: Sequence[Artist] = ()) -> None:
    """Write above a picture whose study it is, what it shows, and what its marks mean."""
    write_heading(figure, Heading(found.name, subject) if found.name else Heading(subject, "all points"))
    if not is_plain() and key and _key(figure, key, len(key)).get_window_extent().x1 > figure.bbox.x1:
        figure.legends[-1].remove()
        _key(figure, key, 1)


def _key(figure: Figure, entries: Sequence[Artist], columns: int) -> Legend:
    """Write the key below the heading, or at the top where there is none."""
    width, height = size_mm(figure)
    down = 6.0 if has_titles() else 1.0
    tight: Look = {"borderpad": 0.0, "borderaxespad": 0.0, "handletextpad": 0.4, "columnspacing": 1.2}
    place = (LEFT_MARGIN - 1.0) / width, 1.0 - down / height
    look: Look = {"loc": "upper left", "bbox_to_anchor": place, "frameon": False, "fontsize": SMALL_FONT}
    return figure.legend(handles=list(entries), ncols=columns, **look, **tight)


def key_of(found: StudyMarks, starred: bool, hatched: bool, empty: bool = False) -> list[Artist]:
    """Return what stands in the key: those marks that occur."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Artist] = []
    if starred:
        mark: Look = {"marker": "*", "markersize": 9, "color": LINE_VERMILLION, "markeredgecolor": "white"}
        entries.append(Line2D([], [], linestyle="", label=found.best_words or "best point", **mark))
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

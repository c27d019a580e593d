"""What the pictures of studies have in common: the best point, missed requirements, words on an axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots.style import VERMILLION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cfmkit.curves import FloatArray
    from cfmkit.plots.findings import Scale

COLOURS = "viridis"
EMPTY = "#EFEFEF"
"""The ground where nothing was solved."""

HATCH = "////"
"""Where a requirement is missed."""


def edges(centers: FloatArray) -> FloatArray:
    """Return the borders between neighbours, and as far beyond the first and the last."""
    if len(centers) == 1:
        half = 0.05 * abs(float(centers[0])) or 0.5
        return np.array([centers[0] - half, centers[0] + half])
    middle = 0.5 * (centers[1:] + centers[:-1])
    return np.concatenate([[2 * centers[0] - middle[0]], middle, [2 * centers[-1] - middle[-1]]])


def ticks(axis: Any, parameter: Scale) -> None:
    """Name the places on an axis that stand for words; between whole numbers of things there is none."""
    from matplotlib.ticker import MaxNLocator

    if parameter.dimension == "count" and np.array_equal(parameter.values, np.round(parameter.values), equal_nan=True):
        axis.set_major_locator(MaxNLocator("auto", integer=True, min_n_ticks=1))
    if parameter.words:
        axis.set_ticks(range(len(parameter.words)), labels=list(parameter.words))


def star(axes: Axes, x: float, y: float) -> None:
    """Mark the best point, if it has a place."""
    if np.isfinite([x, y]).all():
        axes.plot(
            [x], [y], marker="*", markersize=12, color=VERMILLION, markeredgecolor="white", clip_on=False, zorder=5
        )

"""Curves of a study of two parameters: one panel for each value of the first, one line for each of the second."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.diagram import padded
from cfmkit.plots.marks import head
from cfmkit.plots.place import Label, place_labels
from cfmkit.plots.style import LINES, SMALL, axes_mm, new_figure, styled
from cfmkit.plots.text import finite_range

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.plots.findings import Findings, Line, Scale

MOST_PANELS = 8
"""More values of the first parameter than this are left to the maps."""


def fit_panels(found: Findings, lines: Sequence[Line]) -> bool:
    """Return whether the curves of a study can be told apart in panels."""
    panels, named = ({line.panel for line in lines}, {line.parameter for line in lines})
    return len(found.shape) == 2 and 0 < len(panels) <= MOST_PANELS and len(named) <= len(LINES)


@styled
def draw_panels(found: Findings, lines: Sequence[Line], labels: tuple[str, str]) -> Figure:
    """Return the curves of a study of two parameters; each panel has its own vertical scale."""
    first, second = found.varied
    panels = sorted({line.panel for line in lines if line.panel is not None})
    rows = -(-len(panels) // 2)
    figure = new_figure(160.0, 20.0 + 52.0 * rows)
    for number, value in enumerate(panels):
        row, column = divmod(number, 2)
        ax = axes_mm(figure, (17.0 + 74.0 * column, 14.0 + 52.0 * (rows - 1 - row), 62.0, 42.0))
        _draw_panel(ax, [line for line in lines if line.panel == value], second)
        ax.set_title(f"{first.plain}: {first.text(value)}", fontsize=SMALL, loc="left")
        ax.set(xlabel=labels[0] if number + 2 >= len(panels) else "", ylabel=labels[1] if column == 0 else "")
    head(figure, found, f"curves by {first.plain}, each line a value of {second.plain}")
    return figure


def _draw_panel(ax: Axes, lines: Sequence[Line], second: Scale) -> None:
    order = sorted({line.parameter for line in lines})
    names = []
    for line in lines:
        color = LINES[order.index(line.parameter)]
        for motion, effort in line.branches.values():
            ax.plot(motion, effort, color=color, linewidth=1.2)
        motion, effort = next(iter(line.branches.values()))
        names.append(Label(second.text(line.parameter), color, np.column_stack([motion, effort]), prefer=0.6))
    efforts = np.concatenate([effort for line in lines for _, effort in line.branches.values()])
    low, high = finite_range(efforts) or (0.0, 1.0)
    ax.set_ylim(*padded((min(low, 0.0), max(high, 0.0)), 0.05, 0.15))
    place_labels(ax, names)

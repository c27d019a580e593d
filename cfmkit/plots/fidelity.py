"""The curves of several models of one mechanism, and what lies between each and the finest one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.axis_labels_and_headings import axis_label, remark, shown_range, write_heading
from cfmkit.plots.curves import CurveLook, plot_curve
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.stacked_line_diagrams import pad_limits
from cfmkit.plots.style import LINE_COLOURS, TEXT_GREY, apply_style, axes_mm, new_figure
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.plots.axis_labels_and_headings import Heading


@dataclass(frozen=True, eq=False)
class Gap:
    """Difference of a curve to the finest one."""

    curve: int  # which of the curves it is
    name: str  # to write beside the line; empty for none
    # places, values, (n,): motion and difference of the effort [SI]
    places: FloatArray
    values: FloatArray


@apply_style
def fidelity_figure(
    heading: Heading,  # to write above
    curves: Sequence[Curve],  # one a model, labelled; at least one
    gaps: Sequence[Gap],  # at most one for each branch of each curve but the finest
) -> Figure:
    """Return curves overlaid, and the differences from the finest below."""
    figure = new_figure()
    write_heading(figure, heading)
    room = 96.0 - heading.height_mm
    upper, lower = axes_mm(figure, (17, 43, 138, room - 41.0)), axes_mm(figure, (17, 12, 138, 26))
    plot_curve(list(curves), upper, CurveLook(arrows=False))
    upper.set_xlabel("")
    upper.tick_params(labelbottom=False)
    lower.set_xlim(upper.get_xlim())
    _draw_gaps(lower, curves, gaps)
    return figure


def _draw_gaps(ax: Axes, curves: Sequence[Curve], gaps: Sequence[Gap]) -> None:
    kind, motion = curves[0].kind, curves[0].motion_dimension
    labels, shown = [], [0.0]
    for gap in gaps:
        points = np.column_stack([to_border(gap.places, motion), to_border(gap.values, kind)])
        color = LINE_COLOURS[gap.curve % len(LINE_COLOURS)]
        ax.plot(*points.T, color=color, linewidth=1.4 if gap.name else 0.8, zorder=3)
        shown += list(shown_range(points[:, 1]) or ())
        labels += [Label(gap.name, color, points, prefer=0.5)] if gap.name and np.isfinite(points).any() else []
    ax.axhline(0.0, color=TEXT_GREY, linewidth=0.7, zorder=2)
    ax.set_ylim(*pad_limits((min(shown), max(shown)), 0.15, 0.25))
    ax.set_xlabel(axis_label(curves[0].motion_name, motion))
    ax.set_ylabel(axis_label("difference", kind))
    if not labels:
        remark(ax, (0.5, 0.6), "nothing to compare", ha="center")
    place_labels(ax, labels)

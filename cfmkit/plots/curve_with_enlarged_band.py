"""Main figure of a result, the same for every family: force over displacement, or torque over angle.

If the whole curve, drawn from zero, leaves the ripple too small to see, a second panel below enlarges the range that is
to be constant: that of the requirement bands, or of the window of the analysis if there are none.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.metric_values import window_of
from cfmkit.plots.axis_labels_and_headings import Heading, finite_range, write_heading
from cfmkit.plots.bands_from_requirements import bands_of
from cfmkit.plots.curves import CurveLook, plot_curve
from cfmkit.plots.style import TEXT_GREY, apply_style, axes_mm, is_plain, new_figure
from cfmkit.specs.units import from_border, to_border

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.curves import Curve
    from cfmkit.results import Result

Interval = tuple[float, float]

ENLARGE_BELOW = 0.45
"""Share of the height below which the range gets a panel of its own: above it that would enlarge it little more than
twice."""
MIN_BAND_SHARE = 0.002
"""The enlarged panel shows at least this fraction of the force to each side: nobody wants to see rounding errors."""


@apply_style
def curve_figure(
    result: Result,  # with at least one curve
    look: CurveLook | None = None,  # levels and regions to draw as well
    subject: str = "",  # for the heading; default: what is drawn over what
) -> Figure:
    """Return the force-displacement (or torque-angle) curve of a result, enlarged where it is flat."""
    look = look or CurveLook()
    curve = result.curve
    figure = new_figure()
    heading = Heading.from_result(result, subject or f"{curve.kind} over {curve.motion_name}")
    write_heading(figure, heading)
    room = 86.5 - heading.height_mm
    detail = None if is_plain() else choose_enlarged_range(result, look)
    if detail is None:
        plot_curve(result, axes_mm(figure, (17, 12, 138, room)), look)
        return figure
    upper = axes_mm(figure, (17, 63, 138, room - 51.0))
    lower = axes_mm(figure, (17, 12, 138, 46))
    plot_curve(result, upper, replace(look, bands=False, names=False, arrows=False))
    upper.set_xlabel("")
    upper.tick_params(labelbottom=False)
    _frame_of_detail(upper, curve, detail)
    low, high = (float(from_border(end, curve.motion_dimension)) for end in upper.get_xlim())
    plot_curve(result, lower, replace(look, window=((low, high), detail[1])))
    return figure


def choose_enlarged_range(result: Result, look: CurveLook) -> tuple[Interval, Interval] | None:
    """Return the range of motion and of effort [SI] to enlarge; None if the whole curve shows it well."""
    curve = result.curve
    bands = bands_of(result)
    spans = [(band.start, band.stop) for band in bands] or [_window(result)]
    efforts = [curve.effort[(curve.motion >= start) & (curve.motion <= stop)] for start, stop in spans]
    bounds = [value for band in bands for value in (band.low, band.high) if value is not None]
    levels = [level.value for level in look.levels]
    if finite_range(np.concatenate(efforts)) is None:
        return None
    inside = finite_range(np.concatenate([*efforts, bounds, levels]))
    whole = finite_range(np.concatenate([curve.effort, [0.0], bounds, levels]))
    if inside is None or whole is None or inside[1] - inside[0] >= ENLARGE_BELOW * (whole[1] - whole[0]):
        return None
    motion = min(start for start, _ in spans), max(stop for _, stop in spans)
    middle, half = 0.5 * (inside[0] + inside[1]), 0.65 * (inside[1] - inside[0])
    half = max(half, MIN_BAND_SHARE * max(abs(inside[0]), abs(inside[1])))
    return motion, (middle - half, middle + half)


def _window(result: Result) -> Interval:
    """Return the motion to enlarge if there are no requirement bands."""
    window = window_of(result)
    if window is not None:
        return window.lo, window.hi
    if result.valid:
        return result.valid[0]
    return float(result.curve.motion.min()), float(result.curve.motion.max())


def _frame_of_detail(ax: Axes, curve: Curve, detail: tuple[Interval, Interval]) -> None:
    """Draw the frame of what the lower panel enlarges."""
    low, high = (float(to_border(value, curve.kind)) for value in detail[1])
    ax.axhspan(low, high, facecolor="none", edgecolor=TEXT_GREY, linewidth=0.5, zorder=1, gid="no-obstacle")
    ax.annotate(
        "enlarged below", (0.995, low), xycoords=("axes fraction", "data"), xytext=(0, -2),
        textcoords="offset points", ha="right", va="top", color=TEXT_GREY, size=6.5,
    )  # fmt: skip

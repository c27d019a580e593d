"""Diagrams of force over displacement or torque over angle; the main figure of a result; several models compared.

Branches are drawn in the order of their path: a curve that folds back shows every force at one displacement, gaps stay
gaps, and what is unstable is dashed. Names stand beside their lines; where the specification bounds the force, the band
that it allows is shaded. Of several models, what lies between each and the finest one is drawn, too.

The main figure of a result is the same for every family. If the whole curve, drawn from zero, leaves the ripple too
small to see, a second panel below enlarges the range that is to be constant: that of the requirement bands, or of the
window of the analysis if there are none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.curves import Curve
from cfmkit.metrics import frame_of, window_of
from cfmkit.plots.axis_labels_and_headings import (
    Heading,
    axis_label,
    finite_range,
    remark,
    shown_range,
    value_text,
    write_heading,
)
from cfmkit.plots.bands_from_requirements import Band, bands_of
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.stacked_line_diagrams import Limit, MarkedRange, level, pad_limits, shade
from cfmkit.plots.style import (
    BAND_GREEN,
    LINE_COLOURS,
    TEXT_GREY,
    TROUBLE_RED,
    apply_style,
    axes_mm,
    is_plain,
    new_figure,
    overlay,
    size_mm,
)
from cfmkit.results import Result
from cfmkit.specs.units import from_border, to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.plots.style import Look


BRANCH_RTOL = 2e-3
"""Branches closer than this fraction of the axes are one line, with one name: 0.2 mm of a print of 100 mm is less
than a line is thick."""
NAME_ROOM = 0.2
"""Where several curves are named at their ends, the axes are longer by this fraction: room for a value with its unit,
chosen by eye on the shipped studies."""
MOST_NAMED = 7  # curves that have their names beside them
USUAL_AXES_WIDTH = 120.0
"""Width of axes for which `NAME_ROOM` was chosen [mm]; in narrower ones names, whose letters keep their size, take a
larger share."""


@dataclass(frozen=True)
class CurveLook:
    """Options of `plot_curve` beside the lines."""

    # bands, names, arrows: requirement bands, names beside the lines, arrows along the path
    bands: bool = True
    names: bool = True
    arrows: bool = True
    levels: tuple[Limit, ...] = ()  # dashed lines to compare with
    regions: tuple[MarkedRange, ...] = ()  # parts of the motion to shade and name
    # limits of motion and effort in SI; default: everything, zero effort included
    window: tuple[tuple[float, float], tuple[float, float]] | None = None


@dataclass(frozen=True)
class _Line:
    """One branch of one curve in border units, ready to be drawn."""

    points: FloatArray
    stable: NDArray[np.bool_]
    color: str
    name: str
    faint: bool = False


@apply_style
def plot_curve(
    source: Result | Curve | Sequence[Curve],  # a result also brings its requirements
    ax: Axes,  # to draw on
    look: CurveLook | None = None,  # what to draw beside the lines
) -> Axes:
    """Draw one or several curves on axes; return the axes."""
    look = look or CurveLook()
    if is_plain():
        look = replace(look, bands=False, levels=(), regions=())
    curves = _as_curves(source)
    lines = _lines_of_curves(curves)
    for line in lines:
        _draw_line(ax, line)
    if not curves:
        return ax
    kind = curves[0].kind
    earlier: list[_Line] = []
    bands: tuple[Band, ...] = ()
    wanted = None
    if isinstance(source, Result):
        earlier, wanted = _earlier_lines(kind), _target_line(source)
        bands = bands_of(source) if look.bands else ()
    for line in earlier:
        ax.plot(*line.points.T, color=line.color, linewidth=1.0, dashes=(3, 1.5), zorder=2.8, gid="earlier")
    _set_limits(ax, [*lines, *earlier, *([] if wanted is None else [wanted])], bands, look, kind)
    if len(curves) > 1 and look.names and look.window is None:
        narrow = USUAL_AXES_WIDTH / (ax.get_position().width * size_mm(ax.figure)[0])
        room = NAME_ROOM * min(max(narrow, 1.0), 2.0)
        ax.set_xlim(right=ax.get_xlim()[1] + room * float(np.ptp(ax.get_xlim())))
    region_names = [shade(ax, region, _motion_dimension(kind)) for region in look.regions]
    level_names = [level(ax, float(to_border(item.value, kind)), item.text) for item in look.levels]
    band_names = [_draw_band(ax, band, curves[0]) for band in bands]
    ax.set_xlabel(axis_label(curves[0].motion_name, curves[0].motion_dimension))
    ax.set_ylabel(axis_label(kind, kind))
    for curve in curves:
        _draw_events(ax, curve)
    if look.arrows and not _all_coincide(ax, lines):
        for line in lines:
            _draw_arrow(ax, line)
    earlier_names = [_label_of_line(line, 0.3) for line in earlier[:1]]
    target_names = [] if wanted is None else [_label_of_line(wanted, 0.85)]
    if wanted is not None:
        ax.plot(*wanted.points.T, color=wanted.color, linewidth=1.0, dashes=(6, 3), zorder=3.5)
    if look.names:
        own_names = [*_name_lines(ax, lines), *earlier_names, *target_names, *_unstable_name(lines)]
        place_labels(ax, [*own_names, *level_names, *band_names, *region_names])
    return ax


def _draw_events(ax: Axes, curve: Curve) -> None:
    """Draw a tick where something changes on the path of a curve: its column `event` says what."""
    if "event" in curve.extra:
        is_event = curve.extra["event"].values != ""
        at = to_border(curve.motion[is_event], curve.motion_dimension), to_border(curve.effort[is_event], curve.kind)
        ax.plot(*at, linestyle="", marker="|", markersize=8.0, color=TEXT_GREY, zorder=3.5, gid="events")


def _as_curves(source: Result | Curve | Sequence[Curve]) -> tuple[Curve, ...]:
    if isinstance(source, Result):
        return source.curves
    return (source,) if isinstance(source, Curve) else tuple(source)


def _lines_of_curves(curves: tuple[Curve, ...]) -> list[_Line]:
    """Return every branch of every curve: coloured by branch if there is one curve, else by curve."""
    if len(curves) == 1:
        names = curves[0].branches
        several = len(names) > 1
        return [
            _line_of_branch(curves[0], name, LINE_COLOURS[i % len(LINE_COLOURS)], name if several else "")
            for i, name in enumerate(names)
        ]
    count = len(curves)  # of many, the first, the last and some between are named
    colors, named = _choose_colors(count), np.linspace(0, count - 1, min(count, MOST_NAMED)).astype(int)
    lines = []
    for index, curve in enumerate(curves):
        first, *others = curve.branches
        lines.append(_line_of_branch(curve, first, colors[index], _curve_name(curve, index) if index in named else ""))
        lines += [
            _line_of_branch(curve, name, colors[index], "" if index else f"thin: {name}", faint=True) for name in others
        ]
    return lines


def _line_of_branch(curve: Curve, branch: str, color: str, name: str, faint: bool = False) -> _Line:
    part = curve.select_branch(branch)
    motion, effort = to_border(part.motion, curve.motion_dimension), to_border(part.effort, curve.kind)
    return _Line(np.column_stack([motion, effort]), part.stable, color, name, faint)


def _choose_colors(count: int) -> list[str]:
    """Return one colour per curve: the palette, or a scale of lightness where there are more curves than colours."""
    if count <= len(LINE_COLOURS):
        return list(LINE_COLOURS[:count])
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](share)) for share in np.linspace(0.0, 0.75, count)]


def _curve_name(curve: Curve, index: int) -> str:
    parts = [
        value if isinstance(value, str) else f"{name.replace('_', ' ')} {value_text(value, kind)}"
        for name, (value, kind) in curve.label.items()
    ]
    return ", ".join(parts) or ("nominal" if index == 0 else f"curve {index + 1}")


def _draw_line(ax: Axes, line: _Line) -> None:
    """Draw a branch in runs of stable (solid) and unstable (dashed) points, each run joined to the next."""
    for start, stop, stable in _runs_by_stability(line.stable):
        look: Look = {"linestyle": "-" if stable else "--", "linewidth": 0.8 if line.faint else 1.4}
        ax.plot(*line.points[start:stop].T, color=line.color, zorder=3, **look)
    is_drawn = np.concatenate([[False], np.isfinite(line.points).all(axis=1), [False]])
    alone = line.points[is_drawn[1:-1] & ~is_drawn[:-2] & ~is_drawn[2:]]
    if len(alone):
        ax.plot(*alone.T, color=line.color, linestyle="", marker=".", zorder=3)


def _runs_by_stability(stable: NDArray[np.bool_]) -> list[tuple[int, int, bool]]:
    """Return (start, stop, stable) of the runs; an unstable run reaches out to its stable neighbours."""
    edges = np.flatnonzero(np.diff(stable.astype(int))) + 1
    runs = [(start, stop, bool(stable[start])) for start, stop in pairwise([0, *edges.tolist(), len(stable)])]
    return [run if run[2] else (max(run[0] - 1, 0), min(run[1] + 1, len(stable)), False) for run in runs]


def _motion_dimension(kind: str) -> str:
    return "length" if kind == "force" else "angle"


def _set_limits(ax: Axes, lines: list[_Line], bands: Sequence[Band], look: CurveLook, kind: str) -> None:
    """Set limits that show everything from zero on, or what the look asks for."""
    motion = _motion_dimension(kind)
    if look.window is not None:
        ax.set_xlim(*(float(to_border(value, motion)) for value in look.window[0]))
        ax.set_ylim(*(float(to_border(value, kind)) for value in look.window[1]))
        return
    points = np.concatenate([line.points for line in lines])
    ends = [value for region in look.regions for value in (region.start, region.stop)]
    bounds = [value for band in bands for value in (band.low, band.high) if value is not None]
    marks = [*bounds, *(item.value for item in look.levels)]
    across = finite_range([*points[:, 0], *to_border(np.array(ends), motion)])
    up = finite_range([0.0, *(shown_range(points[:, 1]) or ()), *to_border(np.array(marks), kind)])
    ax.set_xlim(*pad_limits(across or (0.0, 1.0), 0.0, 0.02))
    if not np.isfinite(points[:, 1]).any():
        ax.text(0.5, 0.5, "no point has a finite value", transform=ax.transAxes, ha="center", color=TROUBLE_RED)
    low, high = up or (0.0, 1.0)
    ax.set_ylim(*pad_limits((low, high), 0.0 if low == 0 else 0.08, 0.14 if high else 0.0))


def _draw_band(ax: Axes, band: Band, curve: Curve) -> Label:
    """Shade a band within the limits of the axes and return its name."""
    left, right = (float(to_border(value, curve.motion_dimension)) for value in (band.start, band.stop))
    floor, ceiling = ax.get_ylim()
    low, high = (None if value is None else float(to_border(value, curve.kind)) for value in (band.low, band.high))
    bottom, top = floor if low is None else low, ceiling if high is None else high
    color = BAND_GREEN if band.met else TROUBLE_RED
    ax.fill_between([left, right], bottom, top, color=color, alpha=0.10, linewidth=0, zorder=1, gid="band")
    for edge in (low, high):
        if edge is not None:
            ax.plot([left, right], [edge, edge], color=color, linewidth=0.7, dashes=(2, 2), zorder=1.5)
    edges = np.array([edge for edge in (high, low) if edge is not None])
    inside = np.linspace(max(left, ax.get_xlim()[0]), min(right, ax.get_xlim()[1]), 40)
    points = np.column_stack([np.repeat(inside, len(edges)), np.tile(edges, len(inside))])
    return Label(band.text, color, points, prefer=0.3)


def _target_line(result: Result) -> _Line | None:
    """Return the curve that a result is compared with, where it has one, over its window or its whole motion."""
    target = frame_of(result).curve
    if target is None or not len(result.curve):
        return None
    curve, (first, last), window = result.curve, target.extent, window_of(result)
    low, high = (float(curve.motion.min()), float(curve.motion.max())) if window is None else (window.lo, window.hi)
    low, high = max(low, first), min(high, last)
    if not low < high:
        return None
    places = np.linspace(low, high, 201)
    effort = to_border(target.evaluate(places), curve.kind)
    points = np.column_stack([to_border(places, curve.motion_dimension), effort])
    return _Line(points, np.ones(len(places), dtype=np.bool_), TEXT_GREY, "target")


def _earlier_lines(kind: Kind) -> list[_Line]:
    """Return the branches of the earlier run that is to be drawn as well."""
    earlier = overlay()
    if earlier is None:
        return []
    earlier.require(kind)
    name = f"earlier: {earlier.name}"
    return [_Line(points, np.ones(len(points), dtype=np.bool_), TEXT_GREY, name) for points in earlier.branches]


def _label_of_line(line: _Line, prefer: float) -> Label:
    return Label(line.name, line.color, line.points, prefer)


def _name_lines(ax: Axes, lines: list[_Line]) -> list[Label]:
    """Return labels for the lines; coinciding lines share one label."""
    named = [line for line in lines if line.name]
    if len(named) == len(lines) and _all_coincide(ax, lines):
        return [Label(" and ".join(line.name for line in named), named[-1].color, named[0].points, prefer=0.6)]
    if len({line.color for line in lines}) < len(lines) or len(named) > 2:
        return [_name_at_end(line) for line in named]
    return [_label_of_line(line, 0.6 - 0.2 * i) for i, line in enumerate(named)]


def _name_at_end(line: _Line) -> Label:
    if line.faint:
        return _label_of_line(line, 0.5)
    finite = line.points[np.isfinite(line.points).all(axis=1)]
    return Label(line.name, line.color, finite[-max(len(finite) // 20, 1) :], prefer=1.0, toward=(1.0, 0.0))


def _all_coincide(ax: Axes, lines: list[_Line]) -> bool:
    return len(lines) > 1 and all(_coincide(ax, lines[0], line) for line in lines[1:])


def _coincide(ax: Axes, first: _Line, second: _Line) -> bool:
    if first.points.shape != second.points.shape:
        return False
    allowed = BRANCH_RTOL * np.array([np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())])
    ways = (np.abs(first.points - points) for points in (second.points, second.points[::-1]))
    return any(bool((np.isnan(gap) | (gap < allowed)).all()) for gap in ways)


def _draw_arrow(ax: Axes, line: _Line) -> None:
    """Draw an arrowhead along a line, in the direction of its path."""
    step = np.diff(line.points[:, 0])
    if line.faint or not (line.name or (step < 0).any()) or len(step) < 8:
        return
    points = ax.transAxes.inverted().transform(ax.transData.transform(line.points))
    visible = np.isfinite(points).all(axis=1) & ((points >= 0) & (points <= 1)).all(axis=1)
    index = np.flatnonzero(visible)
    if len(index) < 8:
        return
    middle = int(index[int(0.55 * len(index))])
    ahead = [i for i in index if i > middle and np.hypot(*(points[i] - points[middle])) > 0.015]
    if not ahead:
        return
    look: Look = {"arrowstyle": "-|>", "color": line.color, "linewidth": 0, "mutation_scale": 11}
    look |= {"shrinkA": 0, "shrinkB": 0}
    ax.annotate("", tuple(line.points[ahead[0]]), tuple(line.points[middle]), arrowprops=look, zorder=4)


def _unstable_name(lines: list[_Line]) -> list[Label]:
    """Return the word for dashed lines, once."""
    for line in lines:
        finite = ~line.stable & np.isfinite(line.points).all(axis=1)
        if finite.sum() >= 2:
            return [Label("unstable", line.color, line.points[finite], prefer=0.5)]
    return []


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
    spans = [(band.start, band.stop) for band in bands] or [_window_without_bands(result)]
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


def _window_without_bands(result: Result) -> Interval:
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

"""Pictures of a cam mechanism in motion: its force over time and over displacement, contacts, rollers."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.statics import constant_force
from cfmkit.plots.axis_labels_and_headings import Heading, value_text
from cfmkit.plots.bands_from_requirements import limits_on
from cfmkit.plots.curves import CurveLook, curve_figure
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.stacked_line_diagrams import Diagram, Limit, MarkedRange, Scale, Series, diagram_figure
from cfmkit.plots.style import LINE_BLUE, LINE_PURPLE, LINE_VERMILLION, TEXT_GREY, apply_style
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.solution import MotionSolution
    from cfmkit.results import Result


TIME_SCALE = Scale("time", "time")
SIDE_RTOL = 1e-9  # sides whose values differ by less than this fraction of the largest are drawn as one line


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a motion, by file stem."""
    makers = (motion, motion_force, motion_contact, motion_rollers)
    return {maker.__name__: partial(maker, result) for maker in makers}


def motion(result: Result) -> Figure:
    """Return the force over time with that at rest in the same places, and their ratio."""
    moved: MotionSolution = result.state
    times, force = moved.history.times, moved.history.force
    constant = constant_force(moved.build.right)
    forces = [
        Series(force, "in motion", LINE_BLUE, prefer=0.3),
        Series(moved.static, "at rest", TEXT_GREY, True, prefer=0.1),
    ]
    ratio = [Series(force / moved.static, "in motion over at rest", LINE_BLUE, prefer=0.3)]
    ranges = list(_mark_regions(moved))
    name = "4KA + slider's weight" if moved.build.right.loads.slider_weight else "4KA"
    level = Limit(constant, f"{name} = {value_text(constant, 'force')}")
    diagrams = [
        Diagram(times, TIME_SCALE, Scale("force", "force"), forces, [level], ranges),
        Diagram(times, TIME_SCALE, Scale("F / F at rest", "ratio"), ratio, [Limit(1.0, "")], _drop_names(ranges)),
    ]
    return diagram_figure(Heading.from_result(result, f"force that the motion needs: {_motion_text(moved)}"), diagrams)


@apply_style
def motion_force(result: Result) -> Figure:
    """Return the force over the displacement with the requirement bands, and the quasi-static one."""
    moved: MotionSolution = result.state
    figure = curve_figure(result, CurveLook(), "force over displacement, in motion and at rest")
    over = to_border(moved.displacement, "length")
    points = np.column_stack([over, to_border(moved.static, "force")])
    moving = np.column_stack([over, to_border(moved.history.force, "force")])
    for ax in figure.axes:
        ax.plot(*points.T, color=TEXT_GREY, linewidth=1.2, linestyle="--", zorder=2.8, gid="static")
    place_labels(
        figure.axes[0],
        [Label("in motion", LINE_BLUE, moving, prefer=0.4), Label("at rest", TEXT_GREY, points, prefer=0.7)],
    )
    return figure


def motion_contact(result: Result) -> Figure:
    """Return the forces of the cam on the rollers, and those in the braces, over time."""
    moved: MotionSolution = result.state
    history, ranges = moved.history, list(_mark_regions(moved))
    contact = _make_side_lines(history.contact, "on a roller", (LINE_BLUE, LINE_VERMILLION))
    roller_end = _make_side_lines(history.brace, "brace, at the roller", (LINE_PURPLE, LINE_VERMILLION))
    slider_end = [
        Series(item.values, item.name, item.color, True, 0.25)
        for item in _make_side_lines(history.pin, "brace, at the slider", (LINE_PURPLE, LINE_VERMILLION))
    ]
    limits = [*limits_on(result, "contact_force_max"), *limits_on(result, "contact_force_min")]
    diagrams = [
        Diagram(history.times, TIME_SCALE, Scale("contact force", "force"), contact, limits, ranges),
        Diagram(
            history.times,
            TIME_SCALE,
            Scale("force in a brace", "force"),
            [*roller_end, *slider_end],
            (),
            _drop_names(ranges),
        ),
    ]
    return diagram_figure(Heading.from_result(result, "forces of the cam on the rollers, and in the braces"), diagrams)


def motion_rollers(result: Result) -> Figure:
    """Return the speed of the slider and of the turning rollers over time."""
    moved: MotionSolution = result.state
    history = moved.history
    speed = [Series(history.slider.speed, "", LINE_BLUE)]
    spin = _make_side_lines(history.spin, "", (LINE_BLUE, LINE_VERMILLION))
    diagrams = [
        Diagram(history.times, TIME_SCALE, Scale("speed of the slider", "velocity"), speed),
        Diagram(history.times, TIME_SCALE, Scale("speed of a roller", "angular_velocity"), spin),
    ]
    return diagram_figure(Heading.from_result(result, "speed of the slider, and at which the rollers turn"), diagrams)


def _make_side_lines(rows: FloatArray, name: str, colors: tuple[str, str]) -> list[Series]:
    """Return one line where both sides are alike, else one for each."""
    if not np.any(np.abs(rows[0] - rows[1]) > SIDE_RTOL * np.nanmax(np.abs(rows))):
        return [Series(rows[0], name, colors[0])]
    names = [f"{name}, {side}" if name else side for side in ("right", "left")]
    return [
        Series(row, text, color, prefer=place)
        for row, text, color, place in zip(rows, names, colors, (0.65, 0.4), strict=True)
    ]


def _mark_regions(moved: MotionSolution) -> Iterator[MarkedRange]:
    """Yield the spans of time in which the roller lifts off, the cable is slack, or the roller is on the corner."""
    history = moved.history
    lost = (history.contact[0] <= 0) | (history.contact[1] <= 0)
    yield from _find_intervals(history.times, lost, "lift-off")
    yield from _find_intervals(history.times, (history.force <= 0) & ~lost, "slack cable")
    yield from _find_intervals(history.times, history.on_corner, "on the corner")


def _find_intervals(times: FloatArray, where: NDArray[np.bool_], text: str) -> Iterator[MarkedRange]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    for index, (first, after) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        yield MarkedRange(float(times[first]), float(times[after - 1]), "" if index else text)


def _drop_names(regions: list[MarkedRange]) -> list[MarkedRange]:
    return [MarkedRange(item.start, item.stop, "") for item in regions]


def _motion_text(moved: MotionSolution) -> str:
    plan = moved.build.motion
    direction = "up" if plan.stroke > 0 else "down"
    return f"{value_text(abs(plan.stroke), 'length')} {direction} in {value_text(plan.time, 'time')}"

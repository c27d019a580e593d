"""Pictures of a printed slider-crank: its force, its stress, and itself to scale while it is pressed."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.fem_results import number_fillets
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import STRIP_BEAM
from cfmkit.families.slider_crank.printed.part import bodies, choose_points
from cfmkit.plots import parts
from cfmkit.plots.axis_labels_and_headings import Heading, value_text, write_heading
from cfmkit.plots.curves import curve_figure
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.mechanism_in_motion import Moving
from cfmkit.plots.mechanism_in_motion import choose_poses as film_poses
from cfmkit.plots.stacked_line_diagrams import Diagram, Limit, Scale, Series, diagram_figure
from cfmkit.plots.stress_map import stress_map_figure, stress_views
from cfmkit.plots.style import (
    LINE_BLUE,
    LINE_PURPLE,
    LINE_VERMILLION,
    SPRING_OCHRE,
    TEXT_GREY,
    TEXT_INK,
    apply_style,
    axes_mm,
    new_figure,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.export.posed_part import PosedBody
    from cfmkit.families.slider_crank.printed.solution import Solution
    from cfmkit.results import Result


N_DRAWN_POSES = 4  # poses drawn, evenly over the travel
DRAWING_MARGIN = 0.08  # room around the part in pictures, in parts of its longer side


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a printed slider-crank, by file stem."""
    if result.spec.get_value("analysis.fidelity") == "solid":
        return {maker.__name__: partial(maker, result) for maker in (curve, stress_map)}
    return {maker.__name__: partial(maker, result) for maker in (curve, stress, guide, part)}


@apply_style
def curve(result: Result) -> Figure:
    """Return the force over the slider's travel, the band that it should keep enlarged."""
    reported = {"lumped": "flexures and rigid links", "beam": "a strip", "solid": "the part as drawn"}
    what = reported[str(result.spec.get_value("analysis.fidelity"))]
    return curve_figure(result, None, f"force over travel of the slider: {what}")


def stress_map(result: Result) -> Figure:
    """Return the stress of the part as drawn half way, where it is largest and at the end of its travel."""
    travel = result.state.fine.course.travel
    middle = int(np.abs(travel - 0.5 * travel[-1]).argmin())
    views = stress_views(result.state.fine, middle, number_fillets(result.state.fillets), result.curve.motion_dimension)
    return stress_map_figure(result, views, "stress of the part as drawn")


@apply_style
def stress(result: Result) -> Figure:
    """Return the largest stress over the travel, with the allowable one, and where it is."""
    solution: Solution = result.state
    over, allowed = Scale("travel of the slider", "length"), solution.material.allowable_stress
    limits = () if allowed is None else (Limit(allowed, "allowable", True),)
    upper = Diagram(
        solution.travel, over, Scale("stress", "stress"), [Series(solution.stress, "largest", LINE_BLUE)], limits
    )
    place = np.concatenate([solution.place[1:2], solution.place[1:]])
    lower = Diagram(solution.travel, over, Scale("place", "length"), [Series(place, "along the part", LINE_PURPLE)])
    return diagram_figure(Heading.from_result(result, "largest stress, and where it is"), [upper, lower])


@apply_style
def guide(result: Result) -> Figure:
    """Return what the slider's guide carries beside the force."""
    solution: Solution = result.state
    over = Scale("travel of the slider", "length")
    forces = [
        Series(solution.force, "force", TEXT_INK),
        Series(solution.side_force, "on the guide, transverse", SPRING_OCHRE),
    ]
    upper = Diagram(solution.travel, over, Scale("force", "force"), forces)
    moment = [Series(solution.guide_moment, "on the guide", SPRING_OCHRE)]
    lower = Diagram(solution.travel, over, Scale("moment", "torque"), moment)
    return diagram_figure(Heading.from_result(result, "force and moment on the slider's guide"), [upper, lower])


@apply_style
def part(result: Result) -> Figure:
    """Return the part to scale at some travels, with the place of the largest stress at the end."""
    solution: Solution = result.state
    points = choose_points(solution, N_DRAWN_POSES)
    shown, view, room = _frame_view(result, points)
    figure = new_figure(160.0, 120.0)
    heading = Heading.from_result(result, "the part to scale while it is pressed")
    write_heading(figure, heading)
    ax = axes_mm(figure, (17.0, 12.0, 138.0, 106.0 - heading.height_mm))
    last = len(points) - 1
    for number in range(len(points)):
        _draw(ax, shown, number, number == last)
    ends = shown[-1].core[:, -1]
    height = float(ends[0][1])
    ax.axhline(float(parts.mm(height)), color=TEXT_GREY, linewidth=0.6, dashes=(6, 3), zorder=1.1, gid="guide")
    parts.slider(ax, tuple(ends[-1]), 0.5 * room)
    worst = _place(solution, [body.core_at(last) for body in shown], float(solution.place[points[-1]]))
    parts.contact(ax, tuple(worst))
    parts.to_scale(ax, view)
    ax.set_ylabel("y [mm]")
    names = [
        Label(value_text(float(solution.travel[k]), "length"), TEXT_INK, parts.mm(end)[None], toward=(0.0, 1.0))
        for number, (k, end) in enumerate(zip(points, ends, strict=True))
        if number in (0, last) or abs(end[0] - ends[0][0]) > 2.0 * room * number
    ]
    top = value_text(float(solution.stress[points[-1]]), "stress")
    names.append(Label(f"largest stress, {top}", LINE_VERMILLION, parts.mm(worst)[None], toward=(-1.0, 1.0)))
    place_labels(ax, names)
    return figure


def _frame_view(result: Result, points: NDArray[Any]) -> tuple[tuple[PosedBody, ...], parts.Box, float]:
    """Return the leg at points of the travel, the box of all poses with a margin, and the margin's unit [m]."""
    _, _, *leg = bodies(result.spec, result.state, points)  # type: ignore[arg-type]
    view, size = parts.box_around(leg, (DRAWING_MARGIN, DRAWING_MARGIN, 2.5 * DRAWING_MARGIN, 2.0 * DRAWING_MARGIN))
    return tuple(leg), view, DRAWING_MARGIN * size


def _draw(ax: Axes, leg: Sequence[PosedBody], pose: int, solid: bool) -> None:
    """Draw a leg in a pose: filled, or as a ghost."""
    look = (
        {"facecolor": LINE_BLUE, "edgecolor": TEXT_INK} if solid else {"facecolor": "#d9dde2", "edgecolor": TEXT_GREY}
    )
    for body in leg:
        parts.area(ax, body.outline(pose), body.name, linewidth=0.5, zorder=3 if solid else 2, **look)


def _place(solution: Solution, lines: Sequence[FloatArray], along: float) -> FloatArray:
    """Return the point of a leg at a length along the unloaded part [m]."""
    names = list(solution.pressed.path.network.beams)
    if names == [STRIP_BEAM]:
        points = lines[0]
        return np.asarray(points[round(along / _polyline_length(solution.chain.points) * (len(points) - 1))])
    marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(solution.chain.points, axis=0).T))])
    piece = int(np.clip(np.searchsorted(marks, along, side="right") - 1, 0, len(lines) - 1))
    points = lines[piece]
    share = (along - marks[piece]) / (marks[piece + 1] - marks[piece])
    return np.asarray(points[round(share * (len(points) - 1))])


def _polyline_length(points: FloatArray) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def moving(result: Result) -> Moving | None:
    """Return the part over its travel, for a film; None of a part solved as a solid."""
    if result.spec.get_value("analysis.fidelity") == "solid":
        return None
    solution: Solution = result.state
    points = film_poses(len(solution.travel))
    shown, view, room = _frame_view(result, points)

    def draw(ax: Axes, number: int) -> None:
        _draw(ax, shown, number, True)
        end = shown[-1].core_at(number)[-1]
        ax.axhline(float(parts.mm(float(end[1]))), color=TEXT_GREY, linewidth=0.6, dashes=(6, 3), zorder=1.1)
        parts.slider(ax, tuple(end), 0.5 * room)
        parts.to_scale(ax, view)

    return Moving(solution.travel[points], view, draw)

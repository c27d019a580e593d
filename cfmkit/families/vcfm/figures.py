"""Figures of a vcfm (snap-through leaves and a preloaded spring): curves, preloads, stress, mechanism to scale."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import Curve
from cfmkit.export.posed_part import box
from cfmkit.families.fem_results import number_fillets
from cfmkit.families.vcfm.curves_in_rows import PreloadedRows
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import force_change, rest_shift
from cfmkit.families.vcfm.model import rests_of
from cfmkit.families.vcfm.part import bodies
from cfmkit.families.vcfm.plane_fem_analysis import fillets
from cfmkit.metrics.longest_interval_in_band import flat_window
from cfmkit.plots import parts
from cfmkit.plots.axis_labels_and_headings import Heading, value_text, write_heading
from cfmkit.plots.curves import CurveLook, curve_figure, plot_curve
from cfmkit.plots.mechanism_in_motion import Moving, choose_poses
from cfmkit.plots.stacked_line_diagrams import Diagram, Limit, MarkedRange, Scale, Series, diagram_figure
from cfmkit.plots.stress_map import StressView, stress_map_figure
from cfmkit.plots.style import (
    LINE_BLACK,
    LINE_BLUE,
    LINE_COLOURS,
    LINE_PURPLE,
    LINE_VERMILLION,
    SMALL_FONT,
    SPRING_OCHRE,
    TEXT_GREY,
    apply_style,
    axes_mm,
    new_figure,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.export.posed_part import PosedBody
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.results import Result

TRAVEL_SCALE = Scale("displacement", "length")
N_WINDOW_PLACES = 241  # places that are tried as the start of a window
ELEMENT_COLOURS = {"leaf": LINE_BLUE, "spring": SPRING_OCHRE}  # colours of the bodies that bend
N_PRELOADS = 41  # preloads for which the figure of the adjustability is computed


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by file stem; empty if nothing was solved."""
    if result.state is None or not result.curves:
        return {}
    makers = [force, split, stress, mechanism]
    if len(result.curves) > 1:
        makers += [preloads, from_rest, adjustability]
    if result.spec.get_value("analysis.fidelity") == "solid":
        makers.append(stress_map)
    return {maker.__name__: partial(maker, result) for maker in makers}


def force(result: Result) -> Figure:
    """Return the nominal curve with the requirement bands."""
    solution: Solution = result.state
    flat, alone = value_text(solution.parts.balance, "length"), float(solution.spring_alone[0])
    levels = () if np.isnan(alone) else (Limit(alone, f"the spring alone, at {flat}"),)
    nominal = replace(result, curves=result.curves[:1])
    look = CurveLook(levels=levels, regions=_range_beyond(solution))
    return curve_figure(nominal, look, "force over travel of the shuttle, from the unloaded position")


def _range_beyond(solution: Solution) -> tuple[MarkedRange, ...]:
    """Return the part of the travel where the leaves have straightened again."""
    end, last = float(solution.linear_range[1][0]), float(solution.first.travel[-1])
    return (MarkedRange(end, last, "leaves straightened"),) if np.isfinite(end) and end < last * (1 - 1e-6) else ()


def split(result: Result) -> Figure:
    """Return what leaves and spring give, their sum, and the paper's law of the leaves [D, Fig. 3 and 11]."""
    solution: Solution = result.state
    push = solution.first
    series = [
        Series(push.force, "sum", LINE_BLACK, prefer=0.55),
        Series(push.spring_force, "spring", SPRING_OCHRE, prefer=0.85),
        Series(push.leaves.force, "leaves", LINE_BLUE, prefer=0.35),
    ]
    if (truss := solution.leaf_kind.truss) is not None and solution.fidelity != "truss":
        bars = solution.parts.half_beams * np.asarray(truss(solution.parts.strip).force(push.travel))
        series.append(Series(bars, "leaves by the truss law", TEXT_GREY, dashed=True, prefer=0.4))
    ranges = list(_range_beyond(solution))
    low = float(solution.linear_range[0][0])
    if np.isfinite(low):
        ranges.insert(0, MarkedRange(push.travel[0], low, "not yet buckled"))
    diagram = Diagram(push.travel, TRAVEL_SCALE, Scale("force", "force"), series, (), ranges)
    subject = f"leaves and spring, preload {value_text(push.preload, 'length')}"
    return diagram_figure(Heading.from_result(result, subject), [diagram])


def stress(result: Result) -> Figure:
    """Return the largest stress in leaves and spring over the travel, for the nominal and the largest preload."""
    solution: Solution = result.state
    nominal, most = solution.first, max(solution.pushes, key=lambda push: push.preload)
    over = most.travel
    series = [
        Series(np.interp(over, nominal.travel, nominal.leaves.stress, left=np.nan), "leaves", LINE_BLUE, prefer=0.5)
    ]
    bought = solution.spec.mechanism.springs is not None  # whose wire is of another material, with another limit
    if not bought:
        pressed = np.interp(over, nominal.travel, nominal.spring_stress, left=np.nan)
        series.append(Series(pressed, "spring", SPRING_OCHRE, prefer=0.6))
    if most is not nominal and not bought:
        text = f"spring, preload {value_text(most.preload, 'length')}"
        series.append(Series(most.spring_stress, text, LINE_VERMILLION, prefer=0.5))
    allowed = solution.spec.mechanism.allowable_stress
    passed = allowed is not None and bool(max(np.nanmax(item.values) for item in series) > allowed * 1.005)
    limits = [Limit(allowed, f"allowed {value_text(allowed, 'stress')}", trouble=passed)] if allowed else []
    diagram = Diagram(over, TRAVEL_SCALE, Scale("largest stress", "stress"), series, limits, _range_beyond(solution))
    return diagram_figure(Heading.from_result(result, "largest stress"), [diagram])


@apply_style
def preloads(result: Result) -> Figure:
    """Return the curves of all preloads over the travel from the unloaded position [D, Fig. 13 (a)]."""
    return _draw_preload_curves(result, "force for each preload, from the unloaded position", shifted=False)


@apply_style
def from_rest(result: Result) -> Figure:
    """Return the curves of all preloads, each from where the shuttle rests [D, Fig. 13 (b)]."""
    return _draw_preload_curves(result, "force for each preload, from where the shuttle rests", shifted=True)


def _draw_preload_curves(result: Result, subject: str, shifted: bool) -> Figure:
    solution: Solution = result.state
    heading, figure = Heading.from_result(result, subject), new_figure()
    write_heading(figure, heading)
    ax = axes_mm(figure, (15.0, 12.0, 140.0, 100.0 - heading.height_mm - 14.0))
    curves = []
    for curve, push in zip(result.curves, solution.pushes, strict=True):
        back = (push.rest or 0.0) if shifted else 0.0
        curves.append(Curve(curve.motion - back, curve.effort, curve.branch, curve.stable, label=curve.label))
    plot_curve(curves, ax, CurveLook(arrows=False))
    windows = np.transpose(solution.curves.flat_parts(solution.spec.analysis.flatness))
    for number, (push, places) in enumerate(zip(solution.pushes, windows, strict=True)):
        if np.isfinite(places[0]):  # both of its ends are marked on the curve
            back = (push.rest or 0.0) if shifted else 0.0
            ax.plot(
                parts.mm(places - back), np.interp(places, push.travel, push.force), linestyle="", marker="|",
                markersize=9, markeredgewidth=1.2, color=LINE_COLOURS[number % len(LINE_COLOURS)], zorder=4,
                gid="window",
            )  # fmt: skip
    if shifted:
        ax.set_xlabel("displacement from rest [mm]")
    return figure


def adjustability(result: Result) -> Figure:
    """Return force in the window, rest position and start of the window, with the paper's straight rules."""
    solution: Solution = result.state
    preloads = np.array([push.preload for push in solution.pushes])
    over = np.linspace(preloads.min(), preloads.max(), N_PRELOADS)
    character = solution.character
    places = np.linspace(*solution.window_of_one, 41)
    grid = np.linspace(0.0, float(solution.first.travel[-1]), 241)
    pushed = PreloadedRows(solution.sampler, over[:, None], solution.curves.stops)
    rests = -rests_of(pushed, grid)
    mean = pushed.force_at(places).mean(axis=1)
    nominal = float(np.interp(solution.first.preload, over, mean))
    straight = nominal + force_change(character.positive_stiffness, over - solution.first.preload)
    by_rule = rest_shift(character.positive_stiffness, character.first_stiffness, over)
    constant = bool(np.isfinite(solution.constant_force[0]))
    x, first = Scale("preload", "length"), Scale("constant force" if constant else "mean force", "force")
    forces = [Series(mean, "mean in the window", LINE_BLUE, prefer=0.4)]
    if np.abs(straight - mean).max() > 2e-3 * np.abs(mean).max():
        forces.append(Series(straight, "F + K_p dr", TEXT_GREY, dashed=True, prefer=0.7))
    shifts = [
        Series(rests, "shift of the rest position", LINE_PURPLE, prefer=0.4),
        Series(by_rule, "K_p dr/(K_p + K_b1)", TEXT_GREY, dashed=True, prefer=0.7),
    ]
    travel = np.linspace(0.0, float(solution.first.travel[-1]), N_WINDOW_PLACES)
    starts = flat_window(travel, pushed.force_at(travel), solution.spec.analysis.flatness, pushed.force_at)[0]
    begins = [
        Series(starts, "start of the window, from the unloaded position", LINE_BLUE, prefer=0.4),
        Series(starts + rests, "start of the window, from rest", LINE_PURPLE, prefer=0.7),
    ]
    diagrams = [Diagram(over, x, first, forces), Diagram(over, x, Scale("shift", "length"), shifts)]
    if np.isfinite(starts + rests).any():
        diagrams.append(Diagram(over, x, Scale("start", "length"), begins))
    return diagram_figure(Heading.from_result(result, "what the preload adjusts"), diagrams)


def stress_map(result: Result) -> Figure:
    """Return the stress of a leaf and of a chain of the spring as drawn, where each has its largest one."""
    solution: Solution = result.state
    sampler: Any = solution.sampler
    leaf, spring = fillets(solution)
    solids = [("leaf", sampler.pushed.solved, 1.0, number_fillets(leaf))]
    if sampler.sides:
        solids.append(("spring", sampler.sides[0].solved, sampler.chain.travel, number_fillets(spring, len(leaf))))
    views = []
    for name, solved, share, beams in solids:
        pose = int(solved.peaks[0].argmax())
        reported = f"{name} at {value_text(solved.course.travel[pose] / share, 'length')}"
        views.append(StressView(solved, pose, reported, beams))
    return stress_map_figure(result, views, "stress of leaf and spring as drawn")


@apply_style
def mechanism(result: Result) -> Figure:
    """Return the mechanism to scale in four poses: bent as the leaves really bend."""
    solution: Solution = result.state
    poses = _choose_poses(solution)
    shown = bodies(solution, [(travel, preload) for _, travel, preload in poses])
    (left, bottom), (right, top) = box(shown).tolist()
    room, aside = 0.12 * (top - bottom), 0.02 * (right - left)
    view = (left - aside, bottom - room, right + aside, top + room)
    heading = Heading.from_result(result, "mechanism to scale")
    across = 68.0
    up = across * (view[3] - view[1]) / (view[2] - view[0])
    figure = new_figure(160.0, heading.height_mm + 12.0 + 2.0 * (up + 8.0))
    write_heading(figure, heading)
    for number, (text, travel, preload) in enumerate(poses):
        row, column = divmod(number, 2)
        ax = axes_mm(figure, (14.0 + column * (across + 5.0), 12.0 + (1 - row) * (up + 8.0), across, up))
        parts.bodies(ax, shown, number, ELEMENT_COLOURS)
        if travel > 0:
            tip = _pushed_at(shown, number)
            parts.force_arrow(ax, (tip[0], tip[1] + 0.9 * room), tip, "force")
        if preload:
            base = _end_of(shown, "base", number, upper=hangs(solution))
            away = (base[0], base[1] - np.sign(preload) * 0.9 * room)
            tail, tip = (away, base) if preload > 0 else (base, away)
            parts.force_arrow(ax, tail, tip, "preload")
        parts.to_scale(ax, view)
        ax.set_title(text, fontsize=SMALL_FONT, loc="left")
        ax.set_xlabel("x [mm]" if row else "")
        ax.set_ylabel("" if column else "y [mm]")
        ax.tick_params(labelbottom=bool(row), labelleft=not column)
    return figure


def hangs(solution: Solution) -> bool:
    """Return True if the spring hangs above the shuttle."""
    springs = solution.spec.mechanism.springs
    return springs is not None and springs.hang


def _pushed_at(shown: Sequence[PosedBody], pose: int) -> parts.Point:
    """Return where the force pushes the shuttle: the middle of its upper end, or of the bar across it [m]."""
    return max(
        (_end_of([body], "shuttle", pose, True) for body in shown if body.name == "shuttle"), key=lambda at: at[1]
    )


def _end_of(shown: Sequence[PosedBody], name: str, pose: int, upper: bool) -> parts.Point:
    """Return the middle of the upper or the lower side of the first body of a name, a rectangle [m]."""
    corners = next(body for body in shown if body.name == name).core_at(pose)
    x, y = corners.mean(axis=0)[0], corners[:, 1]
    return float(x), float(y.max() if upper else y.min())


def _choose_poses(solution: Solution) -> list[tuple[str, float, float]]:
    """Return four poses worth seeing: (what, travel, preload)."""
    nominal, most = solution.first, max(solution.pushes, key=lambda push: abs(push.preload))
    low, high = solution.window_of_one
    middle = 0.5 * (low + high)
    reported, pushed = value_text(middle, "length"), value_text(most.preload, "length")
    first = [("unloaded", 0.0, 0.0), (f"pushed by {reported}", middle, nominal.preload)]
    if most.preload == nominal.preload:
        end = float(nominal.travel[-1])
        flat = solution.parts.balance
        rest = [(f"pushed by {value_text(place, 'length')}", place, nominal.preload) for place in (flat, end)]
        return [*first, *rest]
    rest_at = most.rest or 0.0
    return [
        *first,
        (f"at rest with a preload of {pushed}", rest_at, most.preload),
        (f"pushed by {reported}, preload {pushed}", middle, most.preload),
    ]


def moving(result: Result) -> Moving:
    """Return the mechanism over the travel of its nominal curve, for a film."""
    solution: Solution = result.state
    nominal = solution.first
    points = choose_poses(len(nominal.travel))
    shown = bodies(solution, [(float(nominal.travel[point]), nominal.preload) for point in points])
    view, size = parts.box_around(shown, (0.06, 0.06, 0.06, 0.12))

    def draw(ax: Axes, number: int) -> None:
        parts.bodies(ax, shown, number, ELEMENT_COLOURS)
        x, y = _pushed_at(shown, number)
        parts.force_arrow(ax, (x, y + 0.06 * size), (x, y))
        parts.to_scale(ax, view)

    return Moving(result.curve.motion[points], view, draw)

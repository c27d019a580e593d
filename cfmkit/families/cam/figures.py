"""Pictures of a cam mechanism: its loop, itself to scale, what limits it, and what errors do to its force."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.hardware import hardware
from cfmkit.families.cam.part import describe_position, pivoting, pose, scene, start_curve, swallowtail
from cfmkit.families.cam.part_sizes_and_clearances import nearest_pairs
from cfmkit.families.cam.statics import constant_force
from cfmkit.numerics.holes_in_samples import holes_between
from cfmkit.plots import parts
from cfmkit.plots.assembly import assembly_figure
from cfmkit.plots.axis_labels_and_headings import Heading, finite_range, right_axis, top_axis, value_text, write_heading
from cfmkit.plots.bands_from_requirements import limits_on
from cfmkit.plots.curves import CurveLook, curve_figure, plot_curve
from cfmkit.plots.label_placement import place_labels
from cfmkit.plots.mechanism_in_motion import Moving, choose_poses
from cfmkit.plots.stacked_line_diagrams import Diagram, Limit, MarkedRange, Scale, Series, diagram_figure
from cfmkit.plots.style import (
    LINE_BLACK,
    LINE_BLUE,
    LINE_BROWN,
    LINE_PURPLE,
    LINE_VERMILLION,
    SPRING_OCHRE,
    TEXT_GREY,
    TROUBLE_RED,
    apply_style,
    new_figure,
)
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.measured_cam import MeasuredCam
    from cfmkit.families.cam.part import Scene
    from cfmkit.families.cam.solution import Solution
    from cfmkit.plots.label_placement import Label
    from cfmkit.results import Result


TRAVEL_SCALE = Scale("displacement", "length")
MOST_RADIUS = 100.0
"""Times the brace's length: a path with a larger radius of curvature is straight, and is left out of its picture."""
STACK_BELOW = 0.5
"""Flat mechanisms, less high than this fraction of their width, are drawn below each other, not side by side."""


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result of the cam family, by file stem; empty if nothing was solved."""
    solution = result.state
    if solution is None or not result.curves:
        return {}
    if result.spec.get_value("analysis.fidelity") == "dynamic":
        from cfmkit.families.cam.dynamics import figures as draw_dynamics

        return draw_dynamics.figures(result)
    if result.spec.get_value("mechanism.profile.file"):
        as_measured = partial(curve_figure, result, None, "force over travel, with the measured profile")
        return {"loop": as_measured, "profile": partial(profile, result), "shares": partial(shares, result)}
    makers = [loop, mechanism, curvature, contact, springs, assembly]
    makers += [undercut] if solution.corner_travel > 0 else []
    makers += [clearance] if solution.mechanism.envelope is not None else []
    makers += [manufacturing] if solution.band is not None else []
    return {maker.__name__: partial(maker, result) for maker in makers}


@apply_style
def draw_mechanism(solution: Solution, index: int, ax: Axes, view: Scene | None = None) -> Axes:
    """Draw the mechanism to scale at one point of the solution; return the axes, which are in millimetres."""
    view, drawn_pose = view or scene(solution), pose(solution, index)
    radius, height = solution.mechanism.roller_radius, view.box[3] - view.box[1]
    parts.plate(ax, view.plate)
    parts.axis_of_symmetry(ax, view.box[1], view.box[3])
    for side, name, at in ((1.0, "right", drawn_pose), (-1.0, "left", drawn_pose.mirror())):
        mirror = np.array([side, 1.0])
        parts.edge(ax, view.flank * mirror, f"flank-{name}")
        parts.edge(ax, view.path * mirror, f"path-{name}", color=LINE_BLUE, linewidth=0.7, dashes=(1, 2), zorder=2.4)
        parts.roller(ax, at.roller, radius, f"roller-{name}")
        parts.link(ax, at.slider, at.roller, f"brace-{name}")
        parts.contact(ax, at.contact, f"contact-{name}")
    parts.spring(ax, drawn_pose.mirror().roller, drawn_pose.roller, 0.9 * radius)
    x, y = drawn_pose.slider
    parts.slider(ax, (x, y), 0.035 * height)
    parts.force_arrow(ax, (x, y + 0.02 * height), (x, y + 0.11 * height))
    parts.to_scale(ax, view.box)
    return ax


def assembly(result: Result) -> Figure:
    """Return all parts half way through the travel, numbered as in the parts list."""
    outcome = hardware(result.state)
    return assembly_figure(result.spec.name, outcome.drawn, outcome.parts, len(result.state.travel) // 2)


def loop(result: Result) -> Figure:
    """Return the force-displacement loop with the theoretical force and the requirement bands."""
    solution: Solution = result.state
    force = constant_force(solution.assembly)
    name = "4KA + slider's weight" if solution.assembly.loads.slider_weight else "4KA"
    level = Limit(force, f"{name} = {value_text(force, 'force')}")
    constant = solution.assembly.profile.path.law.constant
    look = CurveLook(levels=(level,) if constant else (), regions=tuple(regions(solution)))
    return curve_figure(result, look, "force over travel of the slider")


def regions(solution: Solution) -> list[MarkedRange]:
    """Return the parts of the displacement in which the mechanism does not work as intended."""
    ranges, origin = [], solution.origin
    asked, reached = solution.assembly.spec.analysis.travel, float(solution.travel[-1])
    corner = min(solution.corner_travel, reached)
    if corner > 0:
        ranges.append(MarkedRange(origin, origin + corner, f"on the corner: first {value_text(corner, 'length')}"))
    slack = np.flatnonzero(solution.elongation < -1e-12)
    if len(slack) and float(solution.travel[slack[-1]]) > corner:
        end = float(solution.travel[slack[-1]])
        ranges.append(MarkedRange(origin, origin + end, f"springs slack: first {value_text(end, 'length')}"))
    if asked and asked > reached * (1 + 1e-9):
        text = f"the profile ends at {value_text(origin + reached, 'length')}"
        ranges.append(MarkedRange(origin + reached, origin + asked, text))
    return ranges


@apply_style
def mechanism(result: Result) -> Figure:
    """Return the mechanism to scale at the start, in the middle and at the end of the travel."""
    solution, heading = result.state, Heading.from_result(result, "mechanism to scale")
    view = scene(solution)
    slender = (view.box[3] - view.box[1]) / (view.box[2] - view.box[0])
    stacked = slender < STACK_BELOW
    across, up = (min(138.0, 45.0 / slender), min(138.0 * slender, 45.0)) if stacked else (43.5, 43.5 * slender)
    figure = new_figure(160.0, 10.0 + (3 if stacked else 1) * (up + parts.TITLE_HEIGHT) + heading.height_mm)
    write_heading(figure, heading)
    last = len(solution.travel) - 1
    places = {"start": 0, "middle": last // 2, "end": last}
    titles = [f"{name}: {describe_position(solution, index)}" for name, index in places.items()]
    panels = parts.panels(figure, (across, up), titles, stacked)
    names = _label_corner, _label_parts, _label_cam_and_path
    for ax, index, named in zip(panels, places.values(), names, strict=True):
        draw_mechanism(solution, index, ax, view)
        ax.tick_params(labelleft=stacked or index == 0, labelbottom=not stacked or index == last)
        ax.set_xlabel("x [mm]" if not stacked or index == last else "")
        place_labels(ax, named(solution, index, view))
    panels[0].set_ylabel("y [mm]")
    return figure


def _label_corner(solution: Solution, index: int, _view: Scene) -> list[Label]:
    drawn_pose = pose(solution, index)
    return [parts.part_name("corner", [drawn_pose.contact], (1.0, 0.6), TROUBLE_RED)] if drawn_pose.on_corner else []


def _label_parts(solution: Solution, index: int, view: Scene) -> list[Label]:
    drawn_pose, mechanism, height = pose(solution, index), solution.mechanism, view.box[3] - view.box[1]
    radius, number, (x, y) = mechanism.roller_radius, mechanism.springs.number, drawn_pose.roller
    roller, pin = np.array(drawn_pose.roller), np.array(drawn_pose.slider)
    spring = np.column_stack([np.linspace(-0.5, 0.5, 20) * x, np.full(20, y - 0.45 * radius)])
    return [
        parts.part_name("F", [pin + np.array([0.0, 0.06 * height])], (1.0, 0.0), LINE_VERMILLION),
        parts.part_name("slider", [pin], (-1.0, 0.2)),
        parts.part_name("brace", pin + np.linspace(0.2, 0.8, 20)[:, None] * (roller - pin), (1.0, 0.5)),
        parts.part_name("roller", parts.ring(drawn_pose.roller, radius, 25), (0.0, -1.0)),
        parts.part_name("spring" if number == 1 else f"{number} springs", spring, (0.0, -1.0), SPRING_OCHRE),
    ]


def _label_cam_and_path(_solution: Solution, _index: int, view: Scene) -> list[Label]:
    return [
        parts.part_name("cam", view.flank[len(view.flank) // 2 :] * np.array([0.4, 0.9]), (0.0, -1.0)),
        parts.part_name("roller\npath", view.path[: len(view.path) // 4], (0.5, -1.0), LINE_BLUE, prefer=0.1),
    ]


def curvature(result: Result) -> Figure:
    """Return the radius of curvature of the roller path against the roller's radius."""
    solution: Solution = result.state
    profile = solution.assembly.profile
    x = np.linspace(profile.path.law.rest_half_width, profile.end, 400)
    radius = np.asarray(profile.path.law.curvature_radius(x))
    if not profile.path.law.constant:  # where the path is hollow or straight no roller is too large
        radius = np.where((radius > 0) & (radius < MOST_RADIUS * profile.path.law.brace_length), radius, np.nan)
    flank = np.where(
        radius - profile.roller_radius > 0.5 * np.nan_to_num(radius[0]), radius - profile.roller_radius, np.nan
    )
    cut_for, built = profile.roller_radius, solution.mechanism.roller_radius
    limits = [Limit(cut_for, f"roller {value_text(cut_for, 'length')}", trouble=profile.corner is not None)]
    if built != cut_for:
        limits.append(Limit(built, f"roller built in {value_text(built, 'length')}"))
    ranges = []
    if profile.corner:
        first = f": the first {value_text(solution.corner_travel, 'length')} of travel"
        text = f"undercut{first if solution.corner_travel > 0 else ''}"
        ranges.append(MarkedRange(float(x[0]), profile.corner.first_contact, text))
    scales = Scale("x of the roller's axis", "length"), Scale("radius of curvature", "length", log=True)
    series = [
        Series(radius, "roller path", LINE_BLUE, prefer=0.5),
        Series(flank, "cam", TEXT_GREY, dashed=True, prefer=0.15),
    ]
    heading = Heading.from_result(result, "Radius of curvature")
    figure = diagram_figure(heading, [Diagram(x, *scales, series, limits, ranges)], top_mm=9.0)
    travel = profile.path.travel(x) + solution.origin
    top_axis(figure.axes[0], parts.mm(x), parts.mm(travel), TRAVEL_SCALE.label)
    return figure


def contact(result: Result) -> Figure:
    """Return the forces at the contact and in a brace, and the pressure angle, over the travel."""
    solution: Solution = result.state
    over, up, down = solution.displacement, solution.up, solution.down
    _, highest = finite_range(up.contact) or (0.0, 0.0)
    alike = not np.any(np.abs(up.contact - down.contact) > 0.02 * highest)
    series = [
        Series(up.contact, "contact, up and down" if alike else "contact, up", LINE_BLUE, prefer=0.7),
        Series(up.brace, "brace, up", LINE_PURPLE, prefer=0.5),
    ]
    if not alike:
        series.append(Series(down.contact, "contact, down", LINE_VERMILLION, prefer=0.3))
    angle = [Series(solution.states.pressure_angle, "between the brace's pull and the roller's motion", LINE_BLUE)]
    ranges = regions(solution)
    limits = [Limit(np.pi / 2, "90 deg: no leverage on the roller"), *limits_on(result, "pressure_angle_max")]
    unnamed = [replace(region, text="") for region in ranges]
    diagrams = [
        Diagram(over, TRAVEL_SCALE, Scale("force", "force"), series, limits_on(result, "contact_force_max"), ranges),
        Diagram(over, TRAVEL_SCALE, Scale("pressure angle", "angle"), angle, limits, unnamed),
    ]
    return diagram_figure(Heading.from_result(result, "forces on the parts, and the pressure angle"), diagrams)


def springs(result: Result) -> Figure:
    """Return the elongation of the springs over the travel, with its limit, and the force of all of them."""
    solution: Solution = result.state
    springs, limits = solution.mechanism.springs, [*limits_on(result, "spring_elongation_max")]
    if limit := springs.max_elongation:
        beyond = float(solution.elongation.max()) > limit * (1 + 1e-9)
        limits.append(Limit(limit, f"limit {value_text(limit, 'length')}", trouble=beyond))
    line = [Series(solution.elongation, "", LINE_BLUE)]
    diagram = Diagram(
        solution.displacement, TRAVEL_SCALE, Scale("elongation", "length"), line, limits, regions(solution)
    )
    figure = diagram_figure(Heading.from_result(result, "elongation of the springs"), [diagram], right_mm=17.0)
    words = "the spring" if springs.number == 1 else f"the {springs.number} springs"
    stiffness, tension = solution.assembly.loads.stiffness, springs.number * springs.initial_tension
    ends = float(to_border(stiffness, "stiffness")), f"force of {words} [N]", float(to_border(tension, "force"))
    right_axis(figure.axes[0], *ends)
    return figure


def clearance(result: Result) -> Figure:
    """Return how far the moving parts stay from plate, screws and each other over the travel, with the gap wanted."""
    solution: Solution = result.state
    envelope, gaps = solution.mechanism.envelope, nearest_pairs(solution)
    colors = (LINE_BLUE, LINE_VERMILLION, LINE_PURPLE, SPRING_OCHRE, LINE_BLACK, LINE_BROWN, TEXT_GREY)
    order = sorted(gaps, key=lambda pair: float(gaps[pair].min()))
    series = [
        Series(gaps[pair], pair, color, prefer=0.15 + 0.12 * number)
        for number, (pair, color) in enumerate(zip(order, colors, strict=False))
    ]
    wanted = envelope.gap if envelope is not None else 0.0
    passed = any(float(gap.min()) < wanted - 1e-9 for gap in gaps.values())
    text = f"wanted {value_text(wanted, 'length')}" if wanted else "touching"
    limits = [*limits_on(result, "clearance_min"), Limit(wanted, text, trouble=passed)]
    diagram = Diagram(solution.displacement, TRAVEL_SCALE, Scale("distance", "length"), series, limits)
    return diagram_figure(Heading.from_result(result, "clearances of the moving parts"), [diagram])


@apply_style
def undercut(result: Result) -> Figure:
    """Return what undercut does: the roller on the corner, what is cut away, and the force there."""
    solution: Solution = result.state
    heading, force = Heading.from_result(result, "undercut at the start"), constant_force(solution.assembly)
    figure = new_figure(160.0, 12.0 + 50.0 + 6.0 + heading.height_mm)
    write_heading(figure, heading)
    titles = "the roller pivots on the corner", "the corner, enlarged", "force on the slider [N]"
    whole, detail, costs = parts.panels(figure, (37.0, 50.0), titles)
    view = scene(solution)
    _roller_on_corner(solution, whole, view)
    _cut_away(solution, detail, view)
    region = MarkedRange(solution.origin, solution.origin + solution.corner_travel, "on the corner")
    look = CurveLook(levels=(Limit(force, value_text(force, "force")),), regions=(region,))
    plot_curve(start_curve(solution, 3.0 * solution.corner_travel), costs, look).set_ylabel("")
    return figure


def _roller_on_corner(solution: Solution, ax: Axes, view: Scene) -> None:
    """Draw the roller at the start and where it leaves the corner."""
    radius, (start, leaves) = solution.mechanism.roller_radius, pivoting(solution)
    corner = _cam_with_corner(solution, ax, view)
    parts.roller(ax, start, radius, "roller-start")
    parts.roller(ax, leaves, radius, "roller-leaves", ghost=True)
    parts.close_up(ax, (start[0], start[1] + 0.35 * radius), 1.5 * radius)
    ax.set_ylabel("y [mm]")
    names = [
        parts.part_name("corner", corner, (-1.0, 1.0), TROUBLE_RED),
        parts.part_name("start", [start], (-1.0, -1.0)),
        parts.part_name("leaves the\ncorner here", parts.ring(leaves, radius), (0.3, 1.0), TEXT_GREY, prefer=0.6),
    ]
    place_labels(ax, names)


def _cut_away(solution: Solution, ax: Axes, view: Scene) -> None:
    """Draw the part of the flank that the roller, at the start, cuts away."""
    tail, profile = swallowtail(solution), solution.assembly.track.profile
    corner = _cam_with_corner(solution, ax, view)
    rim = parts.ring((profile.path.law.rest_half_width, 0.0), profile.roller_radius, 8000)
    parts.edge(ax, tail, "cut-away", color=TROUBLE_RED, linestyle="--", linewidth=1.0, zorder=3)
    parts.edge(ax, rim, "roller-start", zorder=2.2)
    x, y = 0.5 * (tail.max(axis=0) + tail.min(axis=0))
    size = 0.75 * float(np.ptp(tail, axis=0).max())
    parts.close_up(ax, (float(x), float(y)), size)
    close_rim = rim[(np.abs(rim - np.array([x, y])) < size).all(axis=1)]
    names = [
        parts.part_name("corner", corner, (-1.0, 1.0), TROUBLE_RED),
        parts.part_name("shifted path,\ncut away", tail, (0.5, -1.0), TROUBLE_RED, prefer=0.2),
        parts.part_name("roller at the start", close_rim, (0.0, -1.0), prefer=0.8),
    ]
    place_labels(ax, names)


def _cam_with_corner(solution: Solution, ax: Axes, view: Scene) -> FloatArray:
    """Draw the cam and mark its corner; return the corner as an array of one point [m]."""
    profile = solution.assembly.track.profile
    assert profile.corner is not None
    share = np.linspace(0.0, 1.0, 2000)
    flank = np.column_stack(profile.flank(profile.start + (profile.end - profile.start) * share**2))
    parts.plate(ax, view.plate)
    parts.edge(ax, flank, "flank")
    parts.contact(ax, profile.corner.point, "corner")
    return flank[:1]


N_HEIGHTS = 400  # heights at which the errors of measured flanks are drawn


def profile(result: Result) -> Figure:
    """Return the errors of both flanks over the height, along the normal and in x."""
    built: MeasuredCam = result.state
    low = max(float(points[0, 1]) for points in built.registration.points)
    high = min(float(points[-1, 1]) for points in built.registration.points)
    heights = np.linspace(low, high, N_HEIGHTS)
    kinds = (("error along the normal", built.registration.errors), ("error in x", built.across))
    diagrams = []
    for name, errors in kinds:
        right, left = (_values_over_height(built, side, values, heights) for side, values in enumerate(errors))
        series = [Series(right, "right", LINE_BLUE, prefer=0.3), Series(left, "left", LINE_VERMILLION, prefer=0.7)]
        diagrams.append(Diagram(heights, Scale("height on the cam", "length"), Scale(name, "length"), series))
    return diagram_figure(Heading.from_result(result, "measured profile less design, positive outside"), diagrams)


def _values_over_height(built: MeasuredCam, side: int, values: FloatArray, heights: FloatArray) -> FloatArray:
    used = built.registration.used[side]
    y = built.registration.points[side][used, 1]
    order = np.argsort(y, kind="stable")
    deviations: FloatArray = np.interp(heights, y[order], values[used][order])
    for low, high in holes_between(y[order], heights[0], heights[-1]):
        deviations[(heights > low) & (heights < high)] = np.nan
    return deviations


def shares(result: Result) -> Figure:
    """Return what rest length, profile and friction add to the force of the design."""
    built: MeasuredCam = result.state
    parts = built.shares
    series = [
        Series(parts["profile"], "profile", LINE_BLUE, prefer=0.3),
        Series(parts["friction_up"], "friction, up", LINE_VERMILLION, prefer=0.6),
        Series(parts["friction_down"], "friction, down", LINE_PURPLE, prefer=0.6),
    ]
    if np.nanmax(np.abs(parts["rest"])) > 0:
        series.append(Series(parts["rest"], "rest length", SPRING_OCHRE, prefer=0.8))
    over = built.displacement
    diagram = Diagram(over, Scale("displacement", "length"), Scale("force added to the design's", "force"), series)
    return diagram_figure(Heading.from_result(result, "where the force comes from"), [diagram])


def manufacturing(result: Result) -> Figure:
    """Return the band of forces, without friction, of cams that are cut with the stated errors."""
    solution: Solution = result.state
    band, over = solution.band, solution.displacement
    assert band is not None
    shown = solution.travel >= solution.corner_travel + 0.005 * solution.travel[-1]
    lines = (
        (0.975, "97.5 % of the cams are below", LINE_VERMILLION),
        (0.5, "half", LINE_BLUE),
        (0.025, "2.5 %", LINE_VERMILLION),
    )
    series = [Series(band.quantile(share)[shown], name, color, prefer=0.7) for share, name, color in lines]
    example = Series(band.forces[0][shown], "one of them", LINE_PURPLE, prefer=0.3)
    scales = Scale("displacement", "length"), Scale("force without friction", "force", zero=False)
    diagram = Diagram(over[shown], *scales, [*series, example])
    median = 100 * float(np.median(band.deviations()))
    subject = f"cams cut with errors, {median:.2g} % SD along the travel"
    return diagram_figure(Heading.from_result(result, subject), [diagram])


def moving(result: Result) -> Moving | None:
    """Return the mechanism on its way up, for a film; None if its motion is one of time or the cam is as built."""
    solution = result.state
    if solution is None or not hasattr(solution, "states"):
        return None
    view, points = scene(solution), choose_poses(len(solution.travel))
    return Moving(
        solution.displacement[points],
        view.box,
        lambda ax, number: draw_mechanism(solution, int(points[number]), ax, view),
    )

"""Pictures of a slider-crank: its curve, the energy with its wells, what each spring adds, itself to scale."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.slider_crank.springs.bistability_class import NEGATIVE_CLASS
from cfmkit.families.slider_crank.springs.hardware import hardware
from cfmkit.families.slider_crank.springs.hardware import joints as joints_at
from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.springs.part import bodies
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.plots import parts
from cfmkit.plots.assembly import assembly_figure
from cfmkit.plots.axis_labels_and_headings import Heading, value_text, write_heading
from cfmkit.plots.bands_from_requirements import limits_on
from cfmkit.plots.curves import CurveLook, curve_figure, plot_curve
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.mechanism_in_motion import Moving, choose_poses
from cfmkit.plots.stacked_line_diagrams import Diagram, Limit, Scale, Series, diagram_figure
from cfmkit.plots.style import (
    LINE_BLUE,
    LINE_BROWN,
    LINE_PURPLE,
    LINE_VERMILLION,
    SPRING_OCHRE,
    TEXT_GREY,
    TEXT_INK,
    apply_style,
    axes_mm,
    is_plain,
    new_figure,
)
from cfmkit.specs.units import format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.families.slider_crank.springs.spec import Springs
    from cfmkit.results import Result


KEY_ROOM = 42.0  # room for the small curve above the linkages [mm of print]

Point = tuple[float, float]


@dataclass(frozen=True)
class KeyPosition:
    """The linkage at one place of its motion."""

    name: str  # what is special about it
    # motion, angle: the place [rad or m], and the crank's angle there [rad]
    motion: float
    angle: float
    # crank_pin, slider_pin: B and C [m]
    crank_pin: Point
    slider_pin: Point

    def title(self, solution: Solution) -> str:
        """Return what stands above its panel."""
        angle = format_short(self.angle, "angle", 3)
        if solution.drive == "torque":
            return f"{self.name}: crank at {angle}"
        return f"{self.name}: {format_short(self.motion, 'length', 3)},\ncrank at {angle}"

    @property
    def joints(self) -> tuple[Point, Point, Point]:
        """A, B and C."""
        return (0.0, 0.0), self.crank_pin, self.slider_pin

    @property
    def directions(self) -> tuple[float, float, float]:
        """Direction of the link at each joint that its spring turns with [rad]."""
        (bx, by), (cx, cy) = self.crank_pin, self.slider_pin
        coupler = math.atan2(cy - by, cx - bx)
        return math.atan2(by, bx), coupler, coupler + math.pi


@dataclass(frozen=True)
class PanelView:
    """Common data of all panels."""

    box: tuple[float, float, float, float]  # left, bottom, right, top [m]
    size: float  # of symbols [m]
    wall: float  # where the slider's spring is fixed: its x [m]


def key(solution: Solution, name: str, motion: float) -> KeyPosition:
    """Return the linkage at one place of its motion."""
    units = solution.assembly.units(np.array([motion]))
    _, pin, end = (tuple(at[0].tolist()) for at in joints_at(solution, units))
    return KeyPosition(name, motion, float(units.angle[0]), pin, end)


def key_positions(solution: Solution) -> tuple[KeyPosition, ...]:
    """Return three telling positions: unloaded, stretched or unstable, and the second stable one or the last."""
    low, high = float(solution.motion[0, 0]), float(solution.motion[0, -1])
    start, stretched = solution.assembly.start, solution.assembly.stretched_motion
    at_rest = low <= solution.assembly.rest <= high
    first = key(solution, "unloaded", start) if at_rest else key(solution, "first", low)
    unstable, stable = solution.nearest_of_one(stable=False), solution.nearest_of_one(stable=True)
    if unstable is not None:
        middle = key(solution, "unstable", unstable.motion)
    elif solution.drive == "torque" and low < stretched < high and abs(stretched - start) > 1e-9:
        middle = key(solution, "stretched", stretched)
    else:
        middle = key(solution, "mid-travel", 0.5 * (low + high))
    far = high if abs(high - start) >= abs(low - start) else low
    last = key(solution, "end", far) if stable is None else key(solution, "second stable", stable.motion)
    return first, middle, last


def scene(result: Result) -> PanelView:
    """Return a box around all positions of the motion, with room for symbols."""
    solution: Solution = result.state
    link, units = solution.assembly.linkage, solution.unit_spring_curves
    x = np.concatenate([[0.0], link.crank * np.cos(units.angle[0]), units.position[0]])
    y = np.concatenate([[0.0, link.offset], link.crank * np.sin(units.angle[0])])
    extent = max(float(np.ptp(x)), float(np.ptp(y)))
    size = 0.045 * extent
    far = float(units.position.max()) if link.branch > 0 else float(units.position.min())
    wall = far + link.branch * 4.0 * size
    springs: Springs = result.spec.get_value("mechanism.springs")
    if springs.pulled_outwards(*(float(end[3, 0]) for end in solution.extremes.turns)):
        # it lies beside the coupler, as long as its wire is wound
        rest = float(solution.assembly.units(np.array([solution.assembly.start])).position[0])
        wall = rest - link.branch * max(coil.free_length_for(0.0) for coil in springs.coils_at("slider"))
    ends = [
        float(x.min()),
        float(x.max()),
        wall if solution.assembly.rates[3] > 0.0 else far + 3.0 * size * link.branch,
    ]
    room = 1.6 * size
    bottom, top = min(float(y.min()), -size) - room, max(float(y.max()), link.offset + size) + room
    return PanelView((min(ends) - room, bottom, max(ends) + room, top), size, wall)


def torsion_spring(joint: Point, direction: float, radius: float) -> FloatArray:
    """Return a spiral of one and a half turns around a joint that ends on a link, (n, 2) [m]."""
    turn = np.linspace(-3.0 * math.pi, 0.0, 60)
    reach = radius * np.linspace(0.35, 1.0, 60)
    return np.column_stack([joint[0] + reach * np.cos(direction + turn), joint[1] + reach * np.sin(direction + turn)])


STACK_BELOW = 0.55
"""Mechanisms less high than this fraction of their width are drawn below each other, not side by side."""
SPRING_COLOURS = (LINE_BLUE, LINE_VERMILLION, LINE_PURPLE, LINE_BROWN)  # of the springs, in the order of the joints


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a solved mechanism, by file stem."""
    sprung = result.state.assembly.rates.any()
    makers = [curve, energy, springs, joints, linkage, assembly] if sprung else [joints, linkage]
    return {maker.__name__: partial(maker, result) for maker in makers}


def motion_scale(solution: Solution) -> Scale:
    """Return the horizontal axis of every diagram."""
    return Scale(solution.assembly.motion_words, solution.assembly.dimension)


def assembly(result: Result) -> Figure:
    """Return all parts half way through the motion, numbered as in the parts list."""
    spec: Any = result.spec
    outcome = hardware(spec, result.state)
    return assembly_figure(spec.name, outcome.drawn, outcome.parts, result.state.motion.shape[1] // 2)


@apply_style
def curve(result: Result) -> Figure:
    """Return torque or force over the motion: the constant band named, equilibria marked."""
    solution: Solution = result.state
    heading = f"{solution.drive} over {solution.assembly.motion_words}: {_kind(solution)}"
    figure = curve_figure(result, None, heading)
    for ax in figure.axes:
        _mark_equilibria(ax, solution, lambda _motion, _energy: 0.0)
        _shade_band(ax, solution)
    return figure


def _kind(solution: Solution) -> str:
    """Return the class of the stiffness in words for a heading."""
    name = solution.class_name
    return name if name in ("bistable", "tristable", "snap-through") else f"{name} stiffness"


def _shade_band(ax: Axes, solution: Solution) -> None:
    """Shade the constant band and name it; of a mechanism that snaps through it says nothing."""
    if is_plain() or np.isnan(solution.band[0][0]) or solution.stability_classes.kind[0] > NEGATIVE_CLASS:
        return
    dimension = motion_scale(solution).dimension
    low, high = (float(to_border(float(end[0]), dimension)) for end in solution.band)
    ax.axvspan(low, high, color=LINE_BLUE, alpha=0.10, linewidth=0, zorder=0.5, gid="no-obstacle")
    width = value_text(float(solution.band[1][0] - solution.band[0][0]), dimension)
    text = f"within {100.0 * solution.tolerance[0, 0]:g} %: {width}"
    floor, ceiling = ax.get_ylim()
    places = np.column_stack([np.full(40, 0.5 * (low + high)), np.linspace(floor, ceiling, 42)[1:-1]])
    place_labels(ax, [Label(text, LINE_BLUE, places, prefer=0.12)])


def _mark_equilibria(ax: Axes, solution: Solution, height: Callable[[float, float], float]) -> None:
    """Mark stable equilibria with a full, unstable ones with an open circle."""
    dimension = motion_scale(solution).dimension
    for item in solution.equilibria:
        x, y = float(to_border(item.motion, dimension)), height(item.motion, item.energy)
        if not ax.get_ylim()[0] <= y <= ax.get_ylim()[1]:
            continue
        face = TEXT_INK if item.stable else "white"
        ax.plot(
            [x], [y], marker="o", markersize=5, color=TEXT_INK, markerfacecolor=face,
            linestyle="", zorder=5, clip_on=False, gid="stable" if item.stable else "unstable",
        )  # fmt: skip


@apply_style
def energy(result: Result) -> Figure:
    """Return the energy over the motion with its wells, and the share of each spring."""
    solution: Solution = result.state
    rates = solution.assembly.rates
    shares = 0.5 * rates[:, None] * solution.unit_spring_curves.turn[:, 0] ** 2
    series = [Series(solution.energy[0], "all springs", TEXT_INK, prefer=0.75)]
    if (rates > 0.0).sum() > 1:
        series += [
            Series(shares[k], JOINTS_BY_NAME[name].words, SPRING_COLOURS[k], dashed=True, prefer=0.9 - 0.1 * k)
            for k, name in enumerate(JOINT_NAMES)
            if rates[k] > 0.0
        ]
    diagram = Diagram(solution.motion[0], motion_scale(solution), Scale("energy", "energy"), series)
    figure = diagram_figure(Heading.from_result(result, "energy of the springs, and its minima"), [diagram])
    _mark_equilibria(figure.axes[0], solution, lambda _motion, height: float(to_border(height, "energy")))
    _name_wells(figure.axes[0], solution)
    return figure


def _name_wells(ax: Axes, solution: Solution) -> None:
    dimension, labels = motion_scale(solution).dimension, []
    for item in solution.equilibria:
        place = float(to_border(item.motion, dimension)), float(to_border(item.energy, "energy"))
        text = f"{'stable' if item.stable else 'unstable'} pose at {value_text(item.motion, dimension)}"
        labels.append(Label(text, TEXT_INK if item.stable else TEXT_GREY, np.array([place]), toward=(0.0, 1.0)))
    place_labels(ax, labels)


@apply_style
def springs(result: Result) -> Figure:
    """Return the effort of each spring over the motion, and the stiffness of all."""
    solution: Solution = result.state
    drive, over, stiffness = solution.drive, motion_scale(solution), solution.assembly.stiffness_dimension
    joints = [k for k in range(4) if solution.assembly.rates[k] > 0.0]
    series = [
        Series(
            solution.spring_efforts[k, 0],
            JOINTS_BY_NAME[JOINT_NAMES[k]].words,
            SPRING_COLOURS[k],
            prefer=0.9 - 0.12 * n,
        )
        for n, k in enumerate(joints)
    ]
    if len(joints) > 1:
        series.insert(0, Series(solution.effort[0], "all springs", TEXT_INK, prefer=0.7))
    slope = [Series(solution.stiffness[0], "", TEXT_INK)]
    upper = Diagram(solution.motion[0], over, Scale(f"{drive} of a spring", drive), series)
    lower = Diagram(
        solution.motion[0],
        over,
        Scale("stiffness", stiffness),
        slope,
        [Limit(0.0, "zero stiffness")],
    )
    heading = Heading.from_result(result, f"what each spring adds to the {drive}, and the slope of all")
    return diagram_figure(heading, [upper, lower])


@apply_style
def joints(result: Result) -> Figure:
    """Return how far each joint turns, against its limit, and the forces inside."""
    solution: Solution = result.state
    turn, over = solution.unit_spring_curves.turn[:, 0], motion_scale(solution)
    series = [
        Series(turn[k], JOINTS_BY_NAME[JOINT_NAMES[k]].words, SPRING_COLOURS[k], prefer=0.85 - 0.15 * k)
        for k in range(3)
    ]
    limits = [limit for name in JOINT_NAMES[:3] for limit in limits_on(result, f"{name}_rotation_max")]
    coupler, guide = (force[0] for force in solution.reactions)
    forces = [
        Series(coupler, "along the coupler, tension", LINE_BLUE),
        Series(guide, "on the guide", LINE_VERMILLION, prefer=0.8),
    ]
    diagrams = [
        Diagram(solution.motion[0], over, Scale("rotation", "angle"), series, limits),
        Diagram(solution.motion[0], over, Scale("force of one leg", "force"), forces),
    ]
    return diagram_figure(Heading.from_result(result, "rotations of the joints, and forces inside"), diagrams)


@apply_style
def linkage(result: Result) -> Figure:
    """Return the linkage to scale in its key positions, above each other if it is flat, with the curve they are on."""
    solution: Solution = result.state
    keys, view = key_positions(solution), scene(result)
    heading = Heading.from_result(result, "linkage to scale in its key positions")
    width, height = view.box[2] - view.box[0], view.box[3] - view.box[1]
    slender = height / width
    stacked = slender < STACK_BELOW
    size = (138.0, 138.0 * slender) if stacked else (43.5, min(43.5 * slender, 90.0))
    rows = len(keys) if stacked else 1
    figure = new_figure(160.0, 12.0 + rows * (size[1] + parts.TITLE_HEIGHT) + KEY_ROOM + heading.height_mm)
    write_heading(figure, heading)
    panels = parts.panels(figure, size, [key.title(solution) for key in keys], stacked)
    for number, (ax, key) in enumerate(zip(panels, keys, strict=True)):
        draw_linkage(solution, key, ax, view)
        last = number == len(keys) - 1
        ax.tick_params(labelleft=stacked or number == 0, labelbottom=not stacked or last)
        ax.set_xlabel("x [mm]" if not stacked or last else "")
        ax.set_ylabel("y [mm]" if stacked or number == 0 else "")
    place_labels(panels[0], _label_parts(solution, keys[0], view))
    _key_curve(figure, result, keys, (17.0, 20.0 + rows * (size[1] + parts.TITLE_HEIGHT), 138.0, KEY_ROOM - 12.0))
    return figure


def _key_curve(
    figure: Figure, result: Result, keys: tuple[KeyPosition, ...], box: tuple[float, float, float, float]
) -> None:
    """Draw the curve small, with the key positions on it."""
    solution: Solution = result.state
    ax = axes_mm(figure, box)
    plot_curve(result, ax, CurveLook(bands=False, arrows=False, names=False))
    drive, dimension = solution.drive, motion_scale(solution).dimension
    names = []
    for key in keys:
        place = (
            float(to_border(key.motion, dimension)),
            float(to_border(solution.frictionless(np.array([[key.motion]]))[0], drive)),
        )
        ax.plot(*[[value] for value in place], marker="o", markersize=4, color=LINE_VERMILLION, linestyle="", zorder=5)
        names.append(Label(key.name, LINE_VERMILLION, np.array([place]), toward=(0.0, 1.0)))
    place_labels(ax, names)


@apply_style
def draw_linkage(solution: Solution, key: KeyPosition, ax: Axes, view: PanelView) -> Axes:
    """Draw the linkage at one place of its motion; return the axes, which are in millimetres."""
    link, rates, size = solution.assembly.linkage, solution.assembly.rates, view.size
    pin, end = key.crank_pin, key.slider_pin
    ax.axhline(float(parts.mm(link.offset)), color=TEXT_GREY, linewidth=0.6, dashes=(6, 3), zorder=1.1, gid="guide")
    if rates[3] > 0.0:
        parts.spring(ax, end, (view.wall, link.offset), 0.5 * size, "spring-slider")
        wall = np.array([[view.wall, link.offset - size], [view.wall, link.offset + size]])
        parts.edge(ax, wall, "wall", color=TEXT_INK, linewidth=1.6)
    parts.slider(ax, end, 0.9 * size)
    parts.link(ax, (0.0, 0.0), pin, "crank")
    parts.link(ax, pin, end, "coupler")
    base = np.array([[-0.5, -0.8], [0.5, -0.8], [0.0, 0.0]]) * size
    parts.plate(ax, [base], "ground")
    for rate, joint, direction in zip(rates[:3], key.joints, key.directions, strict=True):
        if rate > 0.0:
            parts.edge(
                ax, torsion_spring(joint, direction, 0.55 * size), "torsion-spring", color=SPRING_OCHRE, zorder=3.6
            )
    if solution.drive == "force":
        tail = end[0] + 2.6 * size * link.branch, end[1]
        parts.force_arrow(ax, tail, (end[0] + 0.6 * size * link.branch, end[1]))
    parts.to_scale(ax, view.box)
    return ax


def _label_parts(solution: Solution, key: KeyPosition, view: PanelView) -> list[Label]:
    """Return the names of the parts."""
    crank = np.linspace(0.2, 0.8, 20)[:, None] * np.array(key.crank_pin)
    coupler = key.crank_pin + np.linspace(0.3, 0.8, 20)[:, None] * (np.array(key.slider_pin) - key.crank_pin)
    labels = [
        parts.part_name("crank", crank, (0.3, -1.0)),
        parts.part_name("coupler", coupler, (0.0, 1.0)),
        parts.part_name("slider", [key.slider_pin], (0.0, -1.0)),
    ]
    if solution.drive == "force":
        tail = np.array([key.slider_pin[0] + 1.8 * view.size * solution.assembly.linkage.branch, key.slider_pin[1]])
        labels.append(parts.part_name("F", [tail], (0.0, 1.0), LINE_VERMILLION))
    return labels


def moving(result: Result) -> Moving:
    """Return the linkage over its motion, for a film."""
    solution: Solution = result.state
    motion, view = solution.motion[0, choose_poses(solution.motion.shape[1])], scene(result)
    poses = [key(solution, "", float(place)) for place in motion]
    return Moving(
        motion,
        view.box,
        lambda ax, number: draw_linkage(solution, poses[number], ax, view),
        lambda ax, number: draw_as_made(result, poses[number], ax, view),
    )


def draw_as_made(result: Result, key: KeyPosition, ax: Axes, view: PanelView) -> None:
    """Draw links and springs at one place of the motion with the sizes that the box of the mechanism counts."""
    solution: Solution = result.state
    spec: Any = result.spec
    half, hole = eye_and_hole(spec)
    rates, offset = solution.assembly.rates, solution.assembly.linkage.offset
    slider_path = np.array(
        [
            [at, offset]
            for at in (solution.unit_spring_curves.position.min(), solution.unit_spring_curves.position.max())
        ]
    )
    for held in hardware(spec, solution).bodies:
        outline = held.outline()
        parts.edge(ax, np.vstack([outline, outline[:1]]), held.name, color=TEXT_GREY, linewidth=0.6)
    parts.edge(ax, slider_path, "guide", color=TEXT_GREY, linewidth=0.6)
    parts.slider(ax, key.slider_pin, 2.0 * half)
    *links, pivot, crank_pin, slider_pin = bodies(spec, solution, solution.assembly.units(np.array([key.motion])))
    for link in links:
        parts.plate(ax, [link.outline()], link.name)
    for joint in key.joints[:2]:
        parts.roller(ax, joint, hole, "pin")
    coils = (pivot, crank_pin, slider_pin)
    for rate, joint, direction, coil in zip(rates[:3], key.joints, key.directions, coils, strict=True):
        if rate > 0.0:
            spiral = np.vstack([torsion_spring(joint, direction, coil.reach), coil.outline()])
            parts.edge(ax, spiral, "torsion-spring", color=SPRING_OCHRE, zorder=3.6)
    if rates[3] > 0.0:
        wide = max((coil.outer_diameter for coil in spec.mechanism.springs.coils_at("slider")), default=half)
        parts.spring(ax, key.slider_pin, (view.wall, offset), wide, "spring-slider")
    if solution.drive == "force":
        out = view.size * solution.assembly.linkage.branch
        tail, tip = (key.slider_pin[0] + 2.6 * out, offset), (key.slider_pin[0] + 0.6 * out, offset)
        parts.force_arrow(ax, tail, tip)
    parts.to_scale(ax, view.box)

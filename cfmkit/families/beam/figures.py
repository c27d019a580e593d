"""Pictures of a beam mechanism: curve, shapes, beam forces, stresses, frequencies, a touched surface; and its film."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.model.network import LineSpring
from cfmkit.elastica.results.beam_states import states
from cfmkit.export.posed_part import PosedBody
from cfmkit.families.beam.drawn_contacts import draw_contacts
from cfmkit.families.beam.network_from_spec import node_place
from cfmkit.families.beam.part import BOX_TOLERANCE, bodies, made_strips, regions
from cfmkit.families.beam.scalar_results import natural_frequencies
from cfmkit.families.beam.solution import choose_points, node_at
from cfmkit.families.beam.strips_and_gaps import strips
from cfmkit.families.beam.tip_on_uneven_surface import follow_surface
from cfmkit.families.fem_results import number_fillets
from cfmkit.plots import parts
from cfmkit.plots.axis_labels_and_headings import Heading, color_key, value_text, write_heading
from cfmkit.plots.bands_from_requirements import limits_on
from cfmkit.plots.curves import CurveLook, curve_figure
from cfmkit.plots.label_placement import place_labels
from cfmkit.plots.mechanism_in_motion import Moving, choose_poses
from cfmkit.plots.numbers_in_drawings import zero_rounding
from cfmkit.plots.stacked_line_diagrams import Diagram, Limit, MarkedRange, Scale, Series, diagram_figure
from cfmkit.plots.stress_map import stress_map_figure, stress_views
from cfmkit.plots.style import (
    LINE_BLUE,
    LINE_COLOURS,
    LINE_VERMILLION,
    TEXT_GREY,
    TEXT_INK,
    TROUBLE_RED,
    apply_style,
    axes_mm,
    new_figure,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.families.beam.plane_fem_analysis import SolidSolution
    from cfmkit.families.beam.solution import Solution
    from cfmkit.plots.label_placement import Label
    from cfmkit.results import Result


N_DRAWN_POSES = 5
KEY_MM = 5.0  # room for the key of the poses above the axes [mm]
MOST_BEAMS = 6  # so many beams have lines of their own: those with the largest force or stress
MOST_MODES = 4  # so many modes have lines: held and free they are twice as many
MAX_LINEAR_FREQUENCY_RATIO = 30.0  # frequencies that differ by more than this factor stand on a logarithmic axis
LINE_RTOL = 1e-4  # lines closer than this share of their size are one


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result of the beam family, by file stem; empty if nothing was solved."""
    if result.state is None or not result.curves:
        return {}
    if result.spec.get_value("analysis.fidelity") == "solid":
        return {maker.__name__: partial(maker, result) for maker in (curve, stress_map)}
    makers = [curve, shapes, reactions, stress]
    if result.spec.get_value("analysis.surface") is not None and len(result.curves) > 1:
        makers.append(surface)
    if any(name.startswith("frequency_") for name in result.curve.extra):
        makers.append(frequencies)
    return {maker.__name__: partial(maker, result) for maker in makers}


def _x_axis(result: Result) -> Scale:
    return Scale(result.curve.motion_name, result.curve.motion_dimension)


def curve(result: Result) -> Figure:
    """Return the force over the displacement, with c ... d of the paper and the requirement bands."""
    solution: Solution = result.state
    regions, levels = [], []
    limit, start = (result.values[name].value for name in ("stress_limit_displacement", "range_start"))
    along = solution.along
    end, farthest = along.sense * along.end, float(along.motion.max())
    if limit is not None and along.sense * limit < farthest:
        low, high = sorted((limit, along.sense * farthest))
        regions.append(MarkedRange(low, high, f"allowable stress reached at {value_text(limit, 'length')}"))
    nominal = result.values["nominal_force"].value
    if nominal is not None and start is not None and result.spec.analysis.window is not None:  # type: ignore[attr-defined]
        levels.append(Limit(0.95 * nominal, f"0.95 F_d: from {value_text(start, 'length')}"))
        levels.append(Limit(nominal, f"F_d = {value_text(nominal, 'force')} at {value_text(end, 'length')}"))
    look = CurveLook(levels=tuple(levels), regions=tuple(regions))
    only = replace(result, curves=result.curves[:1])
    return curve_figure(only, look, f"{result.curve.kind} over {result.curve.motion_name}")


def stress_map(result: Result) -> Figure:
    """Return the stress of the part as a solid at up to three poses, in one scale, with the place of its peak."""
    solution: SolidSolution = result.state
    middle = len(solution.fine.course.poses) // 2
    views = stress_views(solution.fine, middle, number_fillets(solution.fillets), result.curve.motion_dimension)
    return stress_map_figure(result, views, "equivalent stress of the part as cut")


@apply_style
def shapes(result: Result) -> Figure:
    """Return the mechanism to scale: as cut, and bent at several places of the travel."""
    solution: Solution = result.state
    poses = choose_points(len(solution.keep), N_DRAWN_POSES)[1:]
    shown, made = bodies(solution, poses, centre_line=centre_line), made_strips(solution.assembly)
    drawn = {int(pose): [body.core_at(k) for body in shown] for k, pose in enumerate(poses)}
    springs = solution.assembly.add_images(spring_lines(solution.path))
    box = _box_of_bodies([*made, *shown, *(PosedBody.line("spring", "free", line, 0.0) for line in springs)])
    width, height = box[2] - box[0], box[3] - box[1]
    scale = min(138.0 / width, 110.0 / height)
    heading = Heading.from_result(result, "shapes to scale, as cut and during the travel")
    figure = new_figure(160.0, height * scale + 16.0 + KEY_MM + heading.height_mm)
    write_heading(figure, heading)
    room = (17.0 + 0.5 * (138.0 - width * scale), 12.0, width * scale, height * scale)
    ax = axes_mm(figure, room)
    parts.bodies(ax, made, 0, {})
    for number, line in enumerate(solution.assembly.add_images(rigid_parts(solution.path, None))):
        parts.edge(ax, line, f"rigid-{number}", color=TEXT_GREY, linewidth=2.4, zorder=1.3, solid_capstyle="round")
    for number, line in enumerate(springs):
        ends = [(float(x), float(y)) for x, y in line]
        parts.spring(ax, ends[0], ends[1], 0.02 * max(width, height), f"spring-{number}")
    peak = _draw_poses(solution, ax, drawn)
    motion = f"{result.curve.motion_name}:"
    color_key(ax, [(motion, TEXT_INK), *_key(solution, list(drawn))])
    _supports(solution, ax)
    draw_contacts(solution, ax, max(width, height), dict(zip(drawn, _colors(len(drawn)), strict=True)))
    parts.to_scale(ax, box)
    ax.set_ylabel("y [mm]")
    place_labels(ax, [peak, *_label_beams(solution)])
    return figure


def _colors(count: int) -> list[str]:
    """Return the colours of poses, from the first to the last."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](share)) for share in np.linspace(0.8, 0.0, count)]


def _key(solution: Solution, poses: list[int]) -> list[tuple[str, str]]:
    """Return what the motion is in each pose, and its colour."""
    reported = (value_text(float(solution.motion[pose]), solution.spec.motion) for pose in poses)
    return list(zip(reported, _colors(len(poses)), strict=True))


def _draw_poses(solution: Solution, ax: Axes, drawn: dict[int, list[FloatArray]]) -> Label:
    """Draw the bent beams of each pose, and mark the largest stress; return the name of the mark."""
    for color, (pose, lines) in zip(_colors(len(drawn)), drawn.items(), strict=True):
        for number, line in enumerate(lines):
            parts.edge(ax, line, f"pose-{pose}-{number}", color=color, linewidth=1.2, zorder=2.5)
        point = int(solution.keep[pose])
        for number, line in enumerate(solution.assembly.add_images(rigid_parts(solution.path, point))):
            parts.edge(ax, line, f"rigid-{pose}-{number}", color=color, linewidth=0.7, linestyle="--", zorder=2.4)
    index = int(np.argmax(np.where(np.isfinite(solution.stress), solution.stress, -np.inf)))
    return _mark_peak(solution, ax, index)


def _mark_peak(solution: Solution, ax: Axes, index: int) -> Label:
    """Mark where the stress is largest, on the unbent beam: there a reader finds the place on the part."""
    name, share = str(solution.stress_at[0][index]), float(solution.stress_at[1][index])
    points = _unbent_line(solution.path, name)
    arc_length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    x, y = (float(np.interp(share * arc_length[-1], arc_length, points[:, k])) for k in (0, 1))
    at = parts.mm((x, y))
    ax.plot(*at, marker="o", markersize=8, markerfacecolor="none", color=TROUBLE_RED, zorder=5, gid="peak")
    return parts.part_name(value_text(float(solution.stress[index]), "stress"), [(x, y)], (1.0, 0.6), TROUBLE_RED)


def _label_beams(solution: Solution) -> list[Label]:
    """Return the names of the beams as cut."""
    labels = []
    for name in list(solution.path.network.beams)[: 2 * MOST_BEAMS]:
        points = _unbent_line(solution.path, name)
        labels.append(parts.part_name(name, points[len(points) // 4 : 3 * len(points) // 4], (0.3, 1.0), TEXT_INK))
    return labels


def _unbent_line(path: Path, name: str) -> FloatArray:
    """Return the centre line of a beam as cut, (n, 2) [m]."""
    return np.concatenate([strip.points for strip in strips(path.network, path.fits, name)])


def _box_of_bodies(shown: Sequence[PosedBody]) -> parts.Box:
    return parts.box_around(shown, (0.08, 0.08, 0.08, 0.08))[0]


def _supports(solution: Solution, ax: Axes) -> None:
    """Mark the nodes by their support: squares where the rotation is held, else circles; hollow where they slide."""
    for name, node in solution.path.network.nodes.items():
        support = node.support
        if not (support.along or support.across or support.rotation) and name != solution.assembly.driven:
            continue
        color = LINE_VERMILLION if name == solution.assembly.driven else TEXT_INK
        for at in solution.assembly.add_images([node_place(solution.path.network, name)]):
            ax.plot(
                *parts.mm(at), marker="s" if support.rotation else "o", markersize=4.5, color=color, zorder=4,
                markerfacecolor=color if support.along or color != TEXT_INK else "white", linestyle="",
                gid=f"at-{name}",
            )  # fmt: skip


def reactions(result: Result) -> Figure:
    """Return the force that each beam exerts on its last node, along the drive and across it [Lan, Fig. 8]."""
    solution: Solution = result.state
    turned = solution.spec.mechanism.drive.turns
    names = ("to the right", "upwards") if turned else ("against the drive", "across")
    angle = np.pi if turned else solution.assembly.direction
    c, s = np.cos(angle), np.sin(angle)
    forces = {name: solution.beam_force(name) for name in solution.path.network.beams}
    # against the drive: what holds the load counts as positive
    along = {name: -(force[:, 0] * c + force[:, 1] * s) for name, force in forces.items()}
    across = {name: (force[:, 1] * c - force[:, 0] * s) * (-1 if turned else 1) for name, force in forces.items()}
    size = max(float(np.nanmax(np.abs(force[:, :2]))) for force in forces.values())
    along, across = ({name: zero_rounding(row, size) for name, row in rows.items()} for rows in (along, across))
    per_copy = ", one copy" if solution.assembly.parallel > 1 else ""
    heading = Heading.from_result(result, f"force of each beam on its last node{per_copy}{_more_beams(forces)}")
    pairs = zip(names, (along, across), strict=True)
    diagrams = [Diagram(solution.motion, _x_axis(result), Scale(name, "force"), _series(rows)) for name, rows in pairs]
    return diagram_figure(heading, diagrams)


def _more_beams(beams: Mapping[str, object]) -> str:
    """Note that a diagram has not all beams."""
    return "" if len(beams) <= MOST_BEAMS else f"; the {MOST_BEAMS} largest of {len(beams)}"


def _series(values: dict[str, FloatArray]) -> list[Series]:
    """Return named lines of those with the largest values; beams with the same line share it."""
    size = {name: float(np.nanmax(np.abs(value))) for name, value in values.items()}
    lines: dict[str, tuple[str, FloatArray]] = {}
    for name in sorted(size, key=lambda name: -size[name])[:MOST_BEAMS]:
        same = next((key for key, (_, drawn_values) in lines.items() if _same_line(values[name], drawn_values)), None)
        names = name if same is None else f"{lines[same][0]}, {name}"
        lines[same or name] = (names, values[name])
    series = []
    for number, name in enumerate(sorted(lines, key=list(values).index)):
        names, line = lines[name]
        color, prefer = LINE_COLOURS[number % len(LINE_COLOURS)], 0.25 + 0.5 * number / len(lines)
        series.append(Series(line, names, color, prefer=prefer))
    return series


def _same_line(first: FloatArray, second: FloatArray) -> bool:
    largest = float(np.nanmax(np.abs(first)))
    return bool(np.nanmax(np.abs(first - second)) <= LINE_RTOL * largest)


def stress(result: Result) -> Figure:
    """Return the largest stress of each beam over the motion, with the allowable one."""
    solution: Solution = result.state
    allowable = solution.assembly.allowable_stress
    limits = [*limits_on(result, "stress_max")]
    if allowable is not None:
        over = bool(np.nanmax(solution.stress) > allowable)
        limits.append(Limit(allowable, f"allowable {value_text(allowable, 'stress')}", trouble=over))
    series = _series({name: value for name, (value, _) in solution.stresses.items()})
    part = "bending and axial" if solution.spec.stress == "total" else "bending"
    diagram = Diagram(solution.motion, _x_axis(result), Scale("largest stress", "stress"), series, limits)
    heading = Heading.from_result(result, f"largest stress of each beam ({part}){_more_beams(solution.stresses)}")
    return diagram_figure(heading, [diagram])


def frequencies(result: Result) -> Figure:
    """Return the natural frequencies over the motion, with the drive held and with it free."""
    solution: Solution = result.state
    series, both = [], natural_frequencies(solution)
    for number in range(min(MOST_MODES, solution.spec.analysis.modes)):
        for name, dashed in (("held", False), ("free", True)):
            values = both[name][:, number]
            if np.isfinite(values).any():
                color, prefer = LINE_COLOURS[number % len(LINE_COLOURS)], (0.3 if dashed else 0.7) - 0.1 * (number % 2)
                series.append(Series(values, f"{number + 1} {name}", color, dashed, prefer))
    most = f"; the lowest {MOST_MODES}" if solution.spec.analysis.modes > MOST_MODES else ""
    heading = Heading.from_result(result, f"natural frequencies about each pose, drive held and free{most}")
    values = np.concatenate([line.values[np.isfinite(line.values)] for line in series] or [np.ones(1)])
    wide = bool(values.min() > 0 and values.max() > MAX_LINEAR_FREQUENCY_RATIO * values.min())
    scale = Scale("frequency", "frequency", zero=not wide, log=wide)
    return diagram_figure(heading, [Diagram(solution.motion, _x_axis(result), scale, series)])


def surface(result: Result) -> Figure:
    """Return the contact along the surface: its height, and the forces at the tip [Lan, Fig. 14]."""
    contact = follow_surface(result.state)
    if contact is None:
        raise ValueError("there is no surface")
    scale = Scale("along the surface", "length")
    low, high = (result.values[name].value for name in ("tip_force_min", "tip_force_max"))
    limits = [*limits_on(result, "tip_force_min"), *limits_on(result, "tip_force_max")]
    if low is not None and high is not None:
        limits += [Limit(value, value_text(value, "force")) for value in (low, high)]
    heights, forces = Series(contact.height, "surface", TEXT_GREY), Series(contact.force, "", LINE_COLOURS[0])
    diagrams = [
        Diagram(contact.place, scale, Scale("height", "length"), [heights]),
        Diagram(contact.place, scale, Scale("tip force", "force", zero=False), [forces], limits),
    ]
    return diagram_figure(Heading.from_result(result, "contact force along the surface"), diagrams)


def moving(result: Result) -> Moving | None:
    """Return the mechanism as it bends, above a shade of it as cut, for a film; None of a part solved as a solid."""
    if result.spec.get_value("analysis.fidelity") == "solid":
        return None
    solution: Solution = result.state
    points = choose_poses(len(solution.keep))
    made = made_strips(solution.assembly)
    shown = bodies(solution, points, regions(solution.spec, BOX_TOLERANCE), centre_line)
    box = _box_of_bodies([*made, *shown])

    def draw(ax: Axes, number: int) -> None:
        parts.bodies(ax, made, 0, {})
        parts.bodies(ax, shown, number, {"beam": LINE_BLUE})
        for line in solution.assembly.add_images(rigid_parts(solution.path, int(solution.keep[points[number]]))):
            parts.edge(ax, line, "rigid", color=TEXT_GREY, linewidth=2.4, zorder=2.4, solid_capstyle="round")
        _supports(solution, ax)
        parts.to_scale(ax, box)

    return Moving(solution.motion[points], box, draw)


_N_ELEMENT_PLACES = 65  # of an element: more than a picture shows
_LENGTH_RTOL = 1e-9  # of the size: parts shorter than this are not there


def centre_line(path: Path, beam: str, point: int) -> FloatArray:
    """Return the centre line of a beam at a point of the path, (n, 2) [m]."""
    line_states = states(path.network, path.take(np.array([point])).at, beam, np.linspace(0.0, 1.0, _N_ELEMENT_PLACES))
    line = np.stack([line_states.x[0], line_states.y[0]], axis=-1)
    return np.asarray(line[np.append(True, np.diff(line_states.place) > 0)])


def rigid_parts(path: Path, point: int | None) -> list[FloatArray]:
    """Return links and the arms beside nodes as lines (2, 2) [m], at a point of the path or before any load."""
    network = path.network
    ends = [(node_at(path, link.master, point), node_at(path, link.node, point)) for link in network.links]
    for beam in network.beams.values():
        for node, arm in ((beam.start, beam.start_offset), (beam.end, beam.end_offset)):
            at = node_at(path, node, point)
            angle = 0.0 if point is None else float(path.motion(node)[point, 2])
            turned = complex(*map(float, np.real(arm))) * np.exp(1j * angle)
            ends.append((at, at + np.array([turned.real, turned.imag])))
    least = _LENGTH_RTOL * path.mesh.scales.length
    return [np.array([start, end]) for start, end in ends if np.hypot(*(end - start)) > least]


def spring_lines(path: Path) -> list[FloatArray]:
    """Return the springs between two places as lines (2, 2) [m], before any load."""
    lines = []
    for spring in path.network.springs:
        if isinstance(spring, LineSpring):
            ground = np.array([float(np.real(x)) for x in spring.ground])
            far_end = ground if spring.end is None else node_at(path, spring.end)
            lines.append(np.array([node_at(path, spring.start), far_end]))
    return lines

"""Stops, obstacles and contacts in the figure of poses: outlines, where parts touch, and the forces there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, BeamSide, NodeOnBeam, Stop
from cfmkit.families.beam.solution import node_at
from cfmkit.plots import parts
from cfmkit.plots.style import TEXT_INK, TROUBLE_RED

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from matplotlib.axes import Axes

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.contact import ObstacleEdge
    from cfmkit.families.beam.solution import Solution

LONGEST_ARROW = 0.12  # length of the arrow of the largest force, as a share of the figure's size


def draw_contacts(
    solution: Solution,
    ax: Axes,
    size: float,  # of the drawn mechanism [m]
    poses: Mapping[int, str],  # poses that are drawn, and the colour of each
) -> None:
    """Draw obstacles, bars of stops at the ends of their gaps, and what touches in each pose with its force."""
    contacts = solution.path.network.contacts
    outlines = {contact.name: contact.outline for contact in contacts
                if not isinstance(contact, Stop | NodeOnBeam | BeamOnBeam)}  # fmt: skip
    for name, outline in outlines.items():
        for number, line in enumerate(solution.assembly.add_images(outline.lines(2 * size))):
            parts.edge(ax, line, f"obstacle-{name}-{number}", color=TEXT_INK, linewidth=1.8, zorder=1.6)
        strokes = [_hatch(outline, line, 0.02 * size) for line in outline.lines(2 * size)]
        for number, line in enumerate(solution.assembly.add_images(strokes)):
            parts.edge(ax, line, f"hatch-{name}-{number}", color=TEXT_INK, linewidth=0.5, zorder=1.5)
    for number, contact in enumerate(contacts):
        if isinstance(contact, BeamSide):
            _touching_side(solution, ax, number, poses)
        if not isinstance(contact, BeamOnObstacle | BeamOnBeam):
            _stop_or_pad(solution, ax, number, size, poses)
    _forces(solution, ax, size, poses)


def _hatch(outline: ObstacleEdge, line: FloatArray, length: float) -> FloatArray:
    """Return strokes from a part of an outline into the solid, with gaps between them, (n, 2) [m]."""
    arc_length = np.append(0.0, np.hypot(*np.diff(line, axis=0).T).cumsum())
    shares = np.arange(0.5 * length, arc_length[-1], length)
    begin = np.column_stack([np.interp(shares, arc_length, line[:, k]) for k in (0, 1)])
    free = outline.distance(begin).normal
    end = begin - 0.7 * length * (free + np.column_stack([-free[:, 1], free[:, 0]]))
    return np.stack([begin, end, np.full_like(begin, np.nan)], axis=1).reshape(-1, 2)


def _stop_or_pad(solution: Solution, ax: Axes, number: int, size: float, poses: Mapping[int, str]) -> None:
    """Draw the bar of a stop at the end of its gap, and node and rim of a pad where it touches."""
    contact: Any = solution.path.network.contacts[number]
    if isinstance(contact, Stop) and contact.direction is not None:
        along = np.array([np.cos(contact.direction), np.sin(contact.direction)])
        at = node_at(solution.path, contact.node) + contact.gap * along
        bar = 0.03 * size * np.array([[-along[1], along[0]], [along[1], -along[0]]])
        for image, line in enumerate(solution.assembly.add_images([at + bar])):
            parts.edge(ax, line, f"stop-{contact.name}-{number}-{image}", color=TEXT_INK, linewidth=2.6, zorder=1.6)
    for pose, color in poses.items():
        point = int(solution.keep[pose])
        if contact.turns or not solution.path.contact_force(number)[point] > 0:
            continue
        node = node_at(solution.path, contact.node, point)[None]
        for at_pad in () if isinstance(contact, NodeOnBeam) else solution.assembly.add_images([node]):
            ax.plot(*parts.mm(at_pad[0]), marker="o", markersize=4.0, color=color, zorder=4.5, linestyle="",
                    gid=f"touch-{number}-{pose}")  # fmt: skip
        if isinstance(contact, Stop):
            continue
        turn = np.linspace(0.0, 2.0 * np.pi, 61)
        rim = contact.radius * np.column_stack([np.cos(turn), np.sin(turn)])
        for image, line in enumerate(solution.assembly.add_images([node + rim])):
            parts.edge(ax, line, f"pad-{number}-{pose}-{image}", color=color, linewidth=0.8, zorder=4.4)


def _side_between(solution: Solution, number: int, point: int) -> FloatArray | None:
    """Return where the centre line of a beam touches with its side, (n, 2) [m]: one place or a line; None if apart."""
    path = solution.path
    contact: Any = path.network.contacts[number]
    first, last = path.contact_places(number)[point].tolist()
    if np.isnan(first):
        return None
    along = path.places(contact.beam)
    sampled, line = along[point] if along.ndim > 1 else along, path.shape(contact.beam, point)
    shares = np.linspace(first, last, 2 + 30 * int(last > first)) if last > first else np.array([first])
    return np.column_stack([np.interp(shares, sampled, line[:, k]) for k in (0, 1)])


def _touching_side(solution: Solution, ax: Axes, number: int, poses: Mapping[int, str]) -> None:
    """Mark where the side of a beam touches: a dot, or a thick line along what lies on an obstacle."""
    for pose, color in poses.items():
        places = _side_between(solution, number, int(solution.keep[pose]))
        for image, copy in enumerate([] if places is None else solution.assembly.add_images([places])):
            gid = f"side-{number}-{pose}-{image}"
            if len(copy) > 1:
                parts.edge(ax, copy, gid, color=color, linewidth=3.0, zorder=4.4)
            else:
                ax.plot(*parts.mm(copy[0]), marker="o", markersize=4.0, color=color, zorder=4.5, linestyle="", gid=gid)


def _forces(solution: Solution, ax: Axes, size: float, poses: Mapping[int, str]) -> None:
    """Draw the normal forces of stops and obstacles on the mechanism as arrows, in one scale for all poses."""
    forces = {(pose, number): (at, force) for pose in poses
              for number, at, force in _forces_at(solution, int(solution.keep[pose]))}  # fmt: skip
    largest = max((float(np.hypot(*force)) for _, force in forces.values()), default=0.0)
    look = {"arrowstyle": "->", "color": TROUBLE_RED, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
    for (pose, number), (at, force) in forces.items():
        arrow = np.array([at, at + LONGEST_ARROW * size * force / largest])
        for image, line in enumerate(solution.assembly.add_images([arrow])):
            begin, end = parts.mm(line).tolist()
            gid = f"force-{number}-{pose}-{image}"
            ax.annotate("", end, begin, zorder=4.6, gid=gid, arrowprops=look)


def _forces_at(solution: Solution, point: int) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Yield number, place (2,) [m] and normal force (2,) [N] of each contact that touches at one place."""
    for number, contact in enumerate(solution.path.network.contacts):
        force = float(solution.path.contact_force(number)[point])
        if contact.turns or not force > 0:
            continue
        if isinstance(contact, Stop):
            assert contact.direction is not None
            normal = -np.array([np.cos(contact.direction), np.sin(contact.direction)])
            yield number, node_at(solution.path, contact.node, point), force * normal
            continue
        if isinstance(contact, BeamSide):
            places = _side_between(solution, number, point)
        else:
            places = node_at(solution.path, contact.node, point)[None]
        if places is None or len(places) > 1:
            continue
        if isinstance(contact, NodeOnBeam | BeamOnBeam):
            away = places[0] - _counterpart_at(solution, number, point)
            normal = away / np.hypot(*away)
        else:
            normal = contact.outline.distance(places[0]).normal
        yield number, places[0], force * normal


def _counterpart_at(solution: Solution, number: int, point: int) -> FloatArray:
    """Return the node, or the place on the other beam, that touches a beam, (2,) [m]."""
    contacts = solution.path.network.contacts
    contact = contacts[number]
    if isinstance(contact, NodeOnBeam):
        return node_at(solution.path, contact.node, point)
    mates = (k for k, mate in enumerate(contacts) if mate.name == contact.name and k != number)
    places = (_side_between(solution, k, point) for k in mates if isinstance(contacts[k], BeamOnBeam))
    return next(place[0] for place in places if place is not None)

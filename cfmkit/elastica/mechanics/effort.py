"""What the drive of a network works with: a force, a moment, or the displacement of its loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.poses import poses

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Attached, Discretisation


def effort(network: Discretisation, z: Any, drive: float) -> float:
    """Return the effort of the drive at an equilibrium, SI.

    Of a motion the force or moment along it [N, N m]: the functional's derivative by it. Of loads alone the sum of
    load times displacement [J].
    """
    if network.rate.any():
        unit = network.scales.moment / network.scales.drive
        return float(np.real(energy.gradient(network, z, drive) @ network.rate)) * unit
    points = sum(_load_displacement(network, load, z) for load in network.loads if load.grows)
    rest = np.zeros(network.size)
    lines = (_line_moment(network, place, *factors) for place, factors in ((z, (drive, 1.0)), (rest, (0.0, 0.0))))
    now, before = lines
    return float(points + (now - before) * network.scales.moment)


def motion(network: Discretisation, node: str, z: Any) -> Any:
    """Return displacement and rotation of a node, (3,) [m, m, rad]."""
    place = network.nodes[node]
    at = poses(network.attachments, z, [place])
    moved = at.place[0] - network.attachments.origin[place] - network.attachments.arm[place]
    return np.append(moved * network.scales.length, z[at.unknowns[0, 3]])


def _load_displacement(network: Discretisation, load: Attached, z: Any) -> float:
    """Return a point load times the displacement of its node [J]."""
    place = load.places[0]
    at = poses(network.attachments, z, [place])
    moved = (at.place[0] - network.attachments.origin[place] - network.attachments.arm[place]) * network.scales.length
    turn, item = z[at.unknowns[0, 3]], load.item
    force = np.array([item.fx, item.fy])
    if item.follows:
        cos, sin = np.cos(turn), np.sin(turn)
        force = np.array([[cos, -sin], [sin, cos]]) @ force
    return float(force @ moved + item.moment * turn)


def _line_moment(network: Discretisation, z: Any, drive: float, share: float) -> Any:
    """Return the growing line loads times the places of the beams' axes, integrated; dimensionless."""
    e = network.elements
    if not e.line[:, 1].any():
        return 0.0
    at = energy.fields(network, z, drive, share)
    start = poses(network.attachments, z, e.ends[:, 0]).place
    ahead = e.weight * e.ahead
    reach = np.stack([(ahead * at.slope_x).sum(axis=1), (ahead * at.slope_y).sum(axis=1)], axis=1)
    return (e.line[:, 1] * (e.length[:, None] * start + reach)).sum()

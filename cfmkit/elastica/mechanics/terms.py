"""Energy terms of springs and loads: each a function that returns its gradient and Hessian by the unknowns it acts on.

A term takes the network's arrays, what it is of (`Attached`), the poses of its places, all unknowns z and two factors:
`share` of what is constant, `drive` of what grows with it. A new term is one function and a line in `ENERGY_TERMS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.network import LineSpring, PointLoad, SlideSpring, TorsionSpring

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Attached, Discretisation


class Contribution(NamedTuple):
    """Part of the functional: energy, gradient and Hessian by the unknowns it acts on, all dimensionless."""

    energy: Any  # of loads: less the work of those that do not follow
    unknowns: Any  # (n,)
    gradient: Any  # (n,)
    hessian: Any  # (n, n); unsymmetric under loads that follow


def point_load(mesh: Discretisation, load: Attached, z: Any, share: Any, drive: Any) -> Contribution:
    """Return the term of a force and a moment at a node: dead, or turning with the node."""
    at = poses(mesh.attachments, z, list(load.places))
    factor = drive * mesh.scales.drive if load.grows else share
    turn = z[at.unknowns[0, 3]]
    force = np.array([load.item.fx, load.item.fy]) * factor / mesh.scales.force
    moment = load.item.moment * factor / mesh.scales.moment
    if load.item.follows:
        cos, sin = np.cos(turn), np.sin(turn)
        force = np.array([cos * force[0] - sin * force[1], sin * force[0] + cos * force[1]])
    moves = force @ at.jacobian[0]
    hessian = np.zeros((4, 4), moves.dtype)
    hessian[2, 2] = force @ at.arm[0]
    if load.item.follows:
        hessian[:3, 3] = -np.array([-force[1], force[0]]) @ at.jacobian[0]
    rest = mesh.attachments.origin[load.places[0]] + mesh.attachments.arm[load.places[0]]
    work = force @ (at.place[0] - rest) + moment * turn
    return Contribution(-work, at.unknowns[0], np.append(-moves, -moment), hessian)


def slide_spring(mesh: Discretisation, spring: Attached, z: Any, share: Any, _drive: Any) -> Contribution:
    """Return the term of a spring that resists the motion of a node along a fixed direction."""
    item, scales = spring.item, mesh.scales
    at = poses(mesh.attachments, z, list(spring.places))
    along = np.array([np.cos(item.direction), np.sin(item.direction)])
    rest = mesh.attachments.origin[spring.places[0]] + mesh.attachments.arm[spring.places[0]]
    gap = (at.place[0] - rest) @ along - share * item.free_displacement / scales.length
    stiffness = item.stiffness * scales.length / scales.force
    return force_along_direction(at, along, stiffness * gap**2 / 2, stiffness * gap, stiffness)


def force_along_direction(at: Any, along: Any, energy: Any, force: Any, stiffness: Any) -> Contribution:
    """Return the term of a force along a fixed direction at an attachment."""
    reach = along @ at.jacobian[0]
    hessian = stiffness * np.outer(reach, reach)
    hessian[2, 2] -= force * (along @ at.arm[0])
    return Contribution(energy, at.unknowns[0, :3], force * reach, hessian)


def line_spring(mesh: Discretisation, spring: Attached, z: Any, share: Any, _drive: Any) -> Contribution:
    """Return the term of a spring along the line between two places; its free length goes from the length at rest."""
    item, scales, attachments = spring.item, mesh.scales, mesh.attachments
    at = poses(attachments, z, list(spring.places))
    rest = attachments.origin[list(spring.places)] + attachments.arm[list(spring.places)]
    ground = np.array(item.ground) / scales.length
    span = (at.place[1] if item.end else ground) - at.place[0]
    unloaded = (rest[1] if item.end else ground) - rest[0]
    length, free = (span @ span) ** 0.5, (unloaded @ unloaded) ** 0.5
    if item.free_length is not None:
        free = free + share * (item.free_length / scales.length - free)
    stiffness = item.stiffness * scales.length / scales.force
    along, force = span / length, stiffness * (length - free)
    across = np.array([-along[1], along[0]])
    reach = np.concatenate([-at.jacobian[0], *([at.jacobian[1]] if item.end else [])], axis=1)
    stretch, turn = along @ reach, across @ reach
    hessian = stiffness * np.outer(stretch, stretch) + force / length * np.outer(turn, turn)
    hessian[2, 2] += force * (along @ at.arm[0])
    if item.end:
        hessian[5, 5] -= force * (along @ at.arm[1])
    energy = stiffness * (length - free) ** 2 / 2
    return Contribution(energy, at.unknowns[:, :3].ravel(), force * stretch, hessian)


def torsion_spring(mesh: Discretisation, spring: Attached, z: Any, share: Any, _drive: Any) -> Contribution:
    """Return the term of a spring between two rotations, or of one against the ground."""
    unknowns = mesh.attachments.unknowns[list(spring.places), 3]
    sign = np.array([-1.0, 1.0]) if spring.item.start is not None else np.array([1.0])
    gap = sign @ z[unknowns] - share * spring.item.free_angle
    stiffness = spring.item.stiffness / mesh.scales.moment
    return Contribution(stiffness * gap**2 / 2, unknowns, stiffness * gap * sign, stiffness * np.outer(sign, sign))


Term = Callable[["Discretisation", "Attached", Any, Any, Any], Contribution]
ENERGY_TERMS: dict[type, Term] = {
    PointLoad: point_load,
    SlideSpring: slide_spring,
    LineSpring: line_spring,
    TorsionSpring: torsion_spring,
}

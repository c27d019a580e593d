"""Gaps of contacts with their derivatives, and the term of a contact in the functional; dimensionless."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.terms import Contribution
from cfmkit.elastica.model.contact import NodeOnObstacle, Stop

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation


class ContactGap(NamedTuple):
    """Gap of a contact with its derivatives by the n unknowns that change it."""

    value: Any
    unknowns: Any  # (n,)
    gradient: Any  # (n,)
    hessian: Any  # (n, n)


def measure(mesh: Discretisation, contact: ContactAt, z: Any) -> ContactGap:
    """Return the gap of a contact at the values of all unknowns (size,)."""
    item, length = contact.item, mesh.scales.length
    at = poses(mesh.attachments, z, [contact.place])
    if isinstance(item, Stop) and item.turns:
        turn = at.unknowns[0, 3]
        return ContactGap(item.gap - item.sense * z[turn], np.array([turn]), np.array([-item.sense]), np.zeros((1, 1)))
    arm, jacobian = at.arm[0], at.jacobian[0]
    if isinstance(item, Stop):
        normal = -_direction(item)
        value = item.gap / length + normal @ (at.place[0] - _place_at_rest(mesh, contact))
        hessian = np.zeros((3, 3), jacobian.dtype)
    else:
        assert isinstance(item, NodeOnObstacle)
        found = item.outline.distance(at.place[0] * length)
        normal, value = found.normal, (found.value - item.radius) / length
        across = np.array([normal[1], -normal[0]]) @ jacobian
        hessian = found.curvature * length * np.outer(across, across)
    hessian[2, 2] -= normal @ arm
    return ContactGap(value, at.unknowns[0, :3], normal @ jacobian, hessian)


def gaps(mesh: Discretisation, contact: ContactAt, z: Any) -> Any:
    """Return the gaps of a contact in several states (n, size), (n,)."""
    item, length = contact.item, mesh.scales.length
    if isinstance(item, Stop) and item.turns:
        return item.gap - item.sense * z[:, mesh.attachments.unknowns[contact.place, 3]]
    place = poses(mesh.attachments, z, [contact.place]).place[:, 0]
    if isinstance(item, Stop):
        return item.gap / length - (place - _place_at_rest(mesh, contact)) @ _direction(item)
    assert isinstance(item, NodeOnObstacle)
    return (item.outline.distance(place * length).value - item.radius) / length


def compliance(mesh: Discretisation, contact: ContactAt) -> float:
    """Return by how much a contact yields to a unit force."""
    scales = mesh.scales
    unit = scales.moment if contact.item.turns else scales.force / scales.length
    return unit / contact.item.stiffness


def is_closed(contact: ContactAt, z: Any, gap: Any) -> bool:
    """Return True if a contact counts as closed: as it was set, or as its force and its gap say [HIK]."""
    if contact.closed is not None:
        return contact.closed
    return float(np.real(z[contact.unknown])) > float(np.real(gap))


def press(mesh: Discretisation, contact: ContactAt, z: Any) -> Contribution:
    """Return the term of a contact: that of its force where it is closed, else of the condition that it has none."""
    gap, force = measure(mesh, contact, z), z[contact.unknown]
    unknowns = np.append(gap.unknowns, contact.unknown)
    count = len(gap.unknowns)
    hessian = np.zeros((count + 1, count + 1), np.result_type(gap.hessian, z.dtype))
    if not is_closed(contact, z, gap.value):
        hessian[-1, -1] = -1.0
        return Contribution(0.0 * force, unknowns, np.append(np.zeros(count), -force), hessian)
    soft = compliance(mesh, contact)
    hessian[:count, :count] = -force * gap.hessian
    hessian[:count, -1] = hessian[-1, :count] = -gap.gradient
    hessian[-1, -1] = -soft
    gradient = np.append(-force * gap.gradient, -gap.value - soft * force)
    return Contribution(0.5 * soft * force**2, unknowns, gradient, hessian)


def _direction(stop: Stop) -> Any:
    assert stop.direction is not None
    return np.array([np.cos(stop.direction), np.sin(stop.direction)])


def _place_at_rest(mesh: Discretisation, contact: ContactAt) -> Any:
    return mesh.attachments.origin[contact.place] + mesh.attachments.arm[contact.place]

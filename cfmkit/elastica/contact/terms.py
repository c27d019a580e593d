"""Gaps and ways of slip of contacts with derivatives, and the term of a contact in the functional; dimensionless."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.terms import Contribution
from cfmkit.elastica.model.contact import FrictionState, NodeOnObstacle, Stop

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation

GAP_ROUNDING = 1e-13
"""Of a gap, mean beam lengths: an open contact whose gap another one keeps at zero must not close, too."""


class MeasuredGap(NamedTuple):
    """Gap of a contact, or the way that it has slipped, with its derivatives by the n unknowns that change it."""

    value: Any
    unknowns: Any  # (n,)
    gradient: Any  # (n,)
    hessian: Any  # (n, n)


def measure(mesh: Discretisation, contact: ContactAt, z: Any) -> MeasuredGap:
    """Return the gap of a contact at the values of all unknowns (size,)."""
    item, length = contact.item, mesh.scales.length
    at = poses(mesh.attachments, z, [contact.place])
    if isinstance(item, Stop) and item.turns:
        turn = at.unknowns[0, 3]
        return MeasuredGap(item.gap - item.sense * z[turn], np.array([turn]), np.array([-item.sense]), np.zeros((1, 1)))
    arm, jacobian = at.arm[0], at.jacobian[0]
    if isinstance(item, Stop):
        normal = -_unit_direction(item)
        value = item.gap / length + normal @ (at.place[0] - _place_at_rest(mesh, contact))
        hessian = np.zeros((3, 3), jacobian.dtype)
    else:
        assert isinstance(item, NodeOnObstacle)
        nearest = item.outline.distance(at.place[0] * length)
        normal, value = nearest.normal, (nearest.value - item.radius) / length
        across = np.array([normal[1], -normal[0]]) @ jacobian
        hessian = nearest.curvature * length * np.outer(across, across)
    hessian[2, 2] -= normal @ arm
    return MeasuredGap(value, at.unknowns[0, :3], normal @ jacobian, hessian)


def gaps(mesh: Discretisation, contact: ContactAt, z: Any) -> Any:
    """Return the gaps of a contact in several states (n, size), (n,)."""
    item, length = contact.item, mesh.scales.length
    if isinstance(item, Stop) and item.turns:
        return item.gap - item.sense * z[:, mesh.attachments.unknowns[contact.place, 3]]
    place = poses(mesh.attachments, z, [contact.place]).place[:, 0]
    if isinstance(item, Stop):
        return item.gap / length - (place - _place_at_rest(mesh, contact)) @ _unit_direction(item)
    assert isinstance(item, NodeOnObstacle)
    return (item.outline.distance(place * length).value - item.radius) / length


def measure_slip(mesh: Discretisation, contact: ContactAt, z: Any, anchor: float | None = None) -> MeasuredGap:
    """Return how far the point of a pad that touches has come along an obstacle or a stop, rolling counted.

    The sense is that of the normal turned by -90 deg. Around a closed obstacle it is what is nearest to `anchor`.
    """
    item, length = contact.item, mesh.scales.length
    at = poses(mesh.attachments, z, [contact.place])
    place, jacobian, radius = at.place[0], at.jacobian[0], 0.0
    if isinstance(item, Stop):
        normal = -_unit_direction(item)
        along = np.array([normal[1], -normal[0]])
        value, bend = along @ (place - _place_at_rest(mesh, contact)), np.zeros((2, 2))
    else:
        assert isinstance(item, NodeOnObstacle)
        slip, round_length = item.outline.way_along(place * length, item.radius), item.outline.round_length(item.radius)
        value, along, bend = slip.value / length, slip.gradient, slip.hessian * length
        if anchor is not None and np.isfinite(round_length):
            value = value - np.rint((np.real(value) - anchor) * length / round_length) * round_length / length
        radius = item.radius / length
    unknowns = at.unknowns[0]
    hessian = np.zeros((4, 4), np.result_type(bend, jacobian))
    hessian[:3, :3] = jacobian.T @ bend @ jacobian
    hessian[2, 2] -= along @ at.arm[0]
    gradient = np.append(along @ jacobian, radius)
    if unknowns[2] == unknowns[3]:  # the node turns with its body
        gradient, hessian, unknowns = gradient[:3], hessian[:3, :3], unknowns[:3]
        gradient[2] += radius
    return MeasuredGap(value + radius * z[at.unknowns[0, 3]], unknowns, gradient, hessian)


def measure_friction(mesh: Discretisation, contact: ContactAt, state: FrictionState, z: FloatArray) -> FloatArray:
    """Return what must not become negative in states (n, size), (n,): what is left of the friction where it sticks.

    Where it slips it is how far it has come in its sense, which must grow.
    """
    if state.sense == 0:
        return np.asarray(contact.item.friction * z[:, contact.unknown] - np.abs(z[:, contact.rub]))
    ways = [float(measure_slip(mesh, contact, state_values, state.anchor).value) for state_values in z]
    round_length = np.inf
    if isinstance(contact.item, NodeOnObstacle):
        round_length = contact.item.outline.round_length(contact.item.radius) / mesh.scales.length
    return state.sense * (np.array(ways) if np.isinf(round_length) else np.unwrap(ways, period=round_length))


def find_friction(contact: ContactAt, z: Any) -> FrictionState:
    """Return what friction does at a closed contact: as it was set, or as the state says."""
    if contact.friction is not None:
        return contact.friction
    return FrictionState(float(np.rint(np.real(z[contact.flag]))), float(np.real(z[contact.anchor])))


def compliance(mesh: Discretisation, contact: ContactAt) -> float:
    """Return by how much a contact yields to a unit force."""
    scales = mesh.scales
    unit = scales.moment if contact.item.turns else scales.force / scales.length
    return unit / contact.item.stiffness


def is_closed(contact: ContactAt, z: Any, gap: Any) -> bool:
    """Return True if a contact counts as closed: as it was set, or as its force and its gap say [HIK]."""
    if contact.closed is not None:
        return contact.closed
    return float(np.real(z[contact.unknown])) > float(np.real(gap)) + GAP_ROUNDING


def contact_contribution(mesh: Discretisation, contact: ContactAt, z: Any) -> Contribution:
    """Return the term of a contact: that of its forces where it is closed, else of the condition that it has none.

    With friction it has no functional where it slips: its matrix is not symmetric. Flag and anchor of a state keep the
    values that they have.
    """
    gap, force, extra = measure(mesh, contact, z), z[contact.unknown], contact.own_unknowns
    motions, slip = gap.unknowns, None
    if contact.rub >= 0:
        state = find_friction(contact, z)
        slip = measure_slip(mesh, contact, z, state.anchor)
        motions = np.union1d(gap.unknowns, slip.unknowns)
    unknowns, count, size = np.append(motions, extra), len(motions), len(motions) + len(extra)
    kind = np.result_type(gap.value, gap.gradient, gap.hessian, z.dtype)
    gradient, hessian = np.zeros(size, kind), np.zeros((size, size), kind)
    hessian[range(count, size), range(count, size)] = -1.0
    if not is_closed(contact, z, gap.value):
        forces = list(extra[:2])
        gradient[count : count + len(forces)] = -z[forces]
        return Contribution(0.0 * force, unknowns, gradient, hessian)
    soft, pressing = compliance(mesh, contact), np.searchsorted(motions, gap.unknowns)
    gradient[pressing] -= force * gap.gradient
    hessian[np.ix_(pressing, pressing)] -= force * gap.hessian
    hessian[pressing, count] = hessian[count, pressing] = -gap.gradient
    gradient[count], hessian[count, count] = -gap.value - soft * force, -soft
    if slip is not None:
        rub, rubbing = z[contact.rub], np.searchsorted(motions, slip.unknowns)
        gradient[rubbing] -= rub * slip.gradient
        hessian[np.ix_(rubbing, rubbing)] -= rub * slip.hessian
        hessian[rubbing, count + 1] = -slip.gradient
        if state.sense == 0:
            hessian[count + 1, rubbing], hessian[count + 1, count + 3] = -slip.gradient, 1.0
            gradient[count + 1], hessian[count + 1, count + 1] = state.anchor - slip.value, 0.0
        else:
            share = contact.item.friction * state.sense if abs(state.sense) == 1 else 0.0
            gradient[count + 1], hessian[count + 1, count] = -rub - share * force, -share
    return Contribution(0.5 * soft * force**2, unknowns, gradient, hessian)


def _unit_direction(stop: Stop) -> Any:
    assert stop.direction is not None
    return np.array([np.cos(stop.direction), np.sin(stop.direction)])


def _place_at_rest(mesh: Discretisation, contact: ContactAt) -> Any:
    return mesh.attachments.origin[contact.place] + mesh.attachments.arm[contact.place]

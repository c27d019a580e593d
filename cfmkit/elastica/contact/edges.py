"""Edges that the side of a beam may touch, of obstacles, pads or other beams: distances from them, what moves them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, Distance, NodeOnBeam

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation
    from cfmkit.elastica.model.contact import BeamSide


def measure_distance(mesh: Discretisation, item: BeamSide, places: Any, z: Any) -> Distance:
    """Return the signed distances of places (..., k, 2) from an edge in states (..., size); dimensionless.

    Places have as many leading axes as the states, and any number of axes behind them. Of another beam the edge is
    the circle about its place that touches.
    """
    length = mesh.scales.length
    if isinstance(item, BeamOnObstacle):
        edge = item.outline.distance(places * length)
        return Distance(edge.value / length, edge.normal, edge.curvature * length)
    number, radius = find_circle(mesh, item)
    centre = poses(mesh.attachments, z, [number]).place[..., 0, :]
    away = places - centre.reshape(*centre.shape[:-1], *(1,) * (places.ndim - centre.ndim), 2)
    reach = np.hypot(away[..., 0], away[..., 1])
    return Distance(reach - radius, away / reach[..., None], 1 / reach)


class EdgeMotion(NamedTuple):
    """Unknowns that move an edge: none of an obstacle, those of its body of a circle: x, y and rotation."""

    unknowns: Any  # (m,)
    jacobian: FloatArray  # (2, m)
    arm: FloatArray  # (2,) from its body to the centre of the circle


def find_motion(mesh: Discretisation, item: BeamSide, z: FloatArray) -> EdgeMotion:
    """Return the unknowns that move an edge, and their effect, in a state (size,)."""
    if isinstance(item, BeamOnObstacle):
        return EdgeMotion(np.zeros(0, np.int64), np.zeros((2, 0)), np.zeros(2))
    at = poses(mesh.attachments, z, [find_circle(mesh, item)[0]])
    return EdgeMotion(at.unknowns[0, :3], at.jacobian[0], at.arm[0])


def find_circle(mesh: Discretisation, item: NodeOnBeam | BeamOnBeam) -> tuple[int, float]:
    """Return the attachment and the radius of the pad, or of the other beam at its place, that a side touches."""
    if isinstance(item, NodeOnBeam):
        return mesh.nodes[item.node], item.radius / mesh.scales.length
    return find_mate(mesh, item).place, half_thickness_of(mesh, item.partner)


def find_leading(mesh: Discretisation, contact: ContactAt) -> ContactAt:
    """Return the contact that has gap and force: of a pair of beams one of both, else the contact itself."""
    item = contact.item
    return find_mate(mesh, item) if isinstance(item, BeamOnBeam) and not item.leads else contact


def find_mate(mesh: Discretisation, item: BeamOnBeam) -> ContactAt:
    """Return the contact of the other beam of a pair that touches."""
    return next(
        contact
        for contact in mesh.contacts
        if type(contact.item) is type(item) and contact.item.name == item.name and contact.item.beam == item.partner
    )


def half_thickness_of(mesh: Discretisation, beam: str) -> float:
    """Return half the thickness of a beam of one thickness, in mean beam lengths."""
    return 0.5 * mesh.fits.network.beams[beam].section.thinnest / mesh.scales.length

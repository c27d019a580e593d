"""Equations of an element that lies on an obstacle: its curvature is known, tension and both ends are not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.moving_elements import cuts_at
from cfmkit.elastica.mechanics.poses import poses

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation


class LaidPart(NamedTuple):
    """An element that lies on an obstacle: which, where it does, and the curvature that it takes on."""

    element: int
    contact: ContactAt  # at one of its ends
    curvature: float


def compute_laid_rows(mesh: Discretisation, part: LaidPart, z: FloatArray) -> tuple[Any, FloatArray, FloatArray]:
    """Return unknowns, residual and its derivatives (9, 9) of an element that lies on an obstacle.

    They are x, y and rotation of both ends, the tension, and a force that is none; the places are held.
    """
    indices = mesh.elements.unknowns[part.element]
    item: Any = part.contact.item
    fitted, section = mesh.fits[item.beam], mesh.fits.network.beams[item.beam].section
    cuts = cuts_at(mesh, z)[part.element]
    inside = float(mesh.elements.cuts[part.element].mean())
    scale = mesh.scales
    speed = float(np.real(fitted.speed(np.array([inside]), inside) + np.zeros(1))[0]) / scale.length
    rest = np.real(fitted.angle(cuts, inside)) + 0.0 * cuts
    bend = float(rest[1] - rest[0]) / ((cuts[1] - cuts[0]) * speed)
    rigidity = float(np.real(section.rigidities(np.array([inside]), inside)[0][0])) / (scale.force * scale.length**2)
    axial = float(mesh.axial[part.element, 0])
    moment, length = rigidity * (part.curvature - bend), float(cuts[1] - cuts[0]) * speed
    unknowns = np.array(
        [indices[0], indices[1], indices[3], indices[4], indices[5], indices[7], indices[-2], indices[-1]]
    )
    angle = rest + z[indices[[3, 7]]]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    tension, idle = z[indices[-2]], z[indices[-1]]
    ends = mesh.elements.ends[part.element]
    if part.curvature:
        reach = (angle[1] - angle[0]) / part.curvature
    else:
        place = [poses(mesh.attachments, z, [int(end)]).place[0] for end in ends]
        reach = along[0] @ (place[1] - place[0])
    residual, slopes = np.zeros(8), np.zeros((8, 8))
    residual[0:2], residual[3:5] = -tension * along[0], tension * along[1]
    residual[2], residual[5] = -moment, moment
    residual[6], residual[7] = reach - length * (1 + axial * tension), idle
    slopes[0:2, 6], slopes[3:5, 6] = -along[0], along[1]
    slopes[0:2, 2], slopes[3:5, 5] = -tension * across[0], tension * across[1]
    if part.curvature:
        slopes[6, 5], slopes[6, 2] = 1 / part.curvature, -1 / part.curvature
    else:
        slopes[6, 3:5], slopes[6, 0:2] = along[0], -along[0]
        slopes[6, 2] = across[0] @ (place[1] - place[0])
    slopes[6, 6], slopes[7, 7] = -length * axial, 1.0
    return unknowns, residual, slopes

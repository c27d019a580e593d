"""Edges that the side of a beam may touch, in states of a network: outlines that stand still, round pads of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.contact import BeamOnObstacle, Distance

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.contact import BeamSide


def measure_distance(mesh: Discretisation, item: BeamSide, places: Any, z: Any) -> Distance:
    """Return the signed distances of places (..., k, 2) from an edge in states (..., size); dimensionless.

    Places have as many leading axes as the states, and any number of axes behind them.
    """
    length = mesh.scales.length
    if isinstance(item, BeamOnObstacle):
        edge = item.outline.distance(places * length)
        return Distance(edge.value / length, edge.normal, edge.curvature * length)
    centre = poses(mesh.attachments, z, [mesh.nodes[item.node]]).place[..., 0, :]
    away = places - centre.reshape(*centre.shape[:-1], *(1,) * (places.ndim - centre.ndim), 2)
    reach = np.hypot(away[..., 0], away[..., 1])
    return Distance(reach - item.radius / length, away / reach[..., None], 1 / reach)


class EdgeMotion(NamedTuple):
    """What moves an edge: m unknowns, none of an obstacle, three of the pad of a node: x, y and rotation."""

    unknowns: Any  # (m,)
    jacobian: FloatArray  # (2, m)
    arm: FloatArray  # (2,) from its body to the centre of the pad


def find_motion(mesh: Discretisation, item: BeamSide, z: FloatArray) -> EdgeMotion:
    """Return what moves an edge in a state (size,)."""
    if isinstance(item, BeamOnObstacle):
        return EdgeMotion(np.zeros(0, np.int64), np.zeros((2, 0)), np.zeros(2))
    at = poses(mesh.attachments, z, [mesh.nodes[item.node]])
    return EdgeMotion(at.unknowns[0, :3], at.jacobian[0], at.arm[0])

"""Search for the node that a prescribed displacement or rotation moves, and for which of its motions that is.

A drive that cannot be applied, because its node is held or moved by a link, is an error of the user.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.elastica.model.drive import Loading, Rotation
from cfmkit.elastica.model.network import same_direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

FRAME_OF_DRIVE = 3  # number of the motion of a node in the frame of its drive


class DrivenNode(NamedTuple):
    """A node and its motion that a drive prescribes."""

    node: str
    # 0 or 1 for the motion along or across the direction of the node's support, 2 for its rotation; `FRAME_OF_DRIVE` if
    # the support holds neither of the first two: its frame is then turned so that its x axis is along the drive
    motion: int
    sense: float  # 1 or -1: a drive may lead against the direction that the support leaves free


def find_driven_node(network: Network, drive: Drive) -> DrivenNode | None:
    """Return what a drive moves; None if the drive prescribes loads.

    Directions may be complex (derivatives are taken by complex steps); their real parts decide.

    Raises InputError if the node is moved by a link, or held where it is to move.
    """
    if isinstance(drive, Loading):
        return None
    if drive.node not in network.nodes or network.is_moved_by_link(drive.node):
        known = ", ".join(name for name in network.nodes if not network.is_moved_by_link(name))
        raise InputError(f"{drive.node!r} cannot be driven: nodes that are not moved by a link are {known}")
    support = network.nodes[drive.node].support
    if isinstance(drive, Rotation):
        if support.rotation:
            raise InputError(f"node {drive.node!r} cannot be turned: its rotation is held")
        return DrivenNode(drive.node, 2, 1.0)
    if not support.along and not support.across:
        return DrivenNode(drive.node, FRAME_OF_DRIVE, 1.0)
    for held, other, offset, turn in (
        (support.along, support.across, 0, 0.0),
        (support.across, support.along, 1, np.pi / 2),
    ):
        if not held and other and same_direction(drive.direction, support.direction + turn):
            along = math.cos(drive.direction.real - support.direction.real - turn)
            return DrivenNode(drive.node, offset, math.copysign(1.0, along))
    direction = np.degrees(np.real(drive.direction))
    raise InputError(f"node {drive.node!r} cannot be moved along {direction:.6g} deg: it is held")

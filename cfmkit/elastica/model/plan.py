"""How a network is made up: everything that depends on names, joints and supports, and not on any value.

Networks of one make-up share a plan, kept between calls: a batch, an optimisation or a sweep numbers its degrees of
freedom once.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.drive import Drive, Loading, Rotation
from cfmkit.elastica.model.network import LineLoad, Network, SlideSpring, TorsionSpring, same_direction
from cfmkit.elastica.model.numbering import LINE, SLIDE, TURN, Builder, Plan, apart
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.elastica.model.network import LoadOn, Spring

_KEPT = 64
_plans: OrderedDict[Any, Plan] = OrderedDict()


def driven(network: Network, drive: Drive) -> tuple[str, int, float] | None:
    """Return node, local degree of freedom and sense of what a drive moves; None for loads.

    The local number is 0, 1 or 2 in the frame of the node's support, or 3 where the frame turns along the drive.

    Raises
    ------
    cfmkit.errors.InputError
        If the node is moved by a link, or held where it is to move.
    """
    if isinstance(drive, Loading):
        return None
    if drive.node not in network.nodes or network.moved(drive.node):
        known = ", ".join(name for name in network.nodes if not network.moved(name))
        raise InputError(f"{drive.node!r} cannot be driven: nodes that are not moved by a link are {known}")
    support = network.nodes[drive.node].support
    if isinstance(drive, Rotation):
        if support.rotation:
            raise InputError(f"node {drive.node!r} cannot be turned: its rotation is held")
        return drive.node, 2, 1.0
    if not support.along and not support.across:
        return drive.node, 3, 1.0
    for held, other, offset, turn in (
        (support.along, support.across, 0, 0.0),
        (support.across, support.along, 1, np.pi / 2),
    ):
        if not held and other and same_direction(drive.direction, support.direction + turn):
            along = math.cos(drive.direction.real - support.direction.real - turn)
            return drive.node, offset, math.copysign(1.0, along)
    direction = np.degrees(np.real(drive.direction))
    raise InputError(f"node {drive.node!r} cannot be moved along {direction:.6g} deg: it is held")


def plan_of(network: Network, drive: Drive, moved: tuple[str, int, float] | None) -> Plan:
    """Return the plan of a network under a drive that moves what `driven` says; kept for the next of its kind."""
    key = _key(network, drive, moved)
    plan = _plans.get(key)
    if plan is None:
        plan = _plans[key] = Builder(network, drive, moved).plan()
        if len(_plans) > _KEPT:
            _plans.popitem(last=False)
    return plan


def _key(network: Network, drive: Drive, moved: tuple[str, int, float] | None) -> Any:
    """Return all that a plan depends on."""
    nodes = [(name, (s := node.support).along, s.across, s.rotation) for name, node in network.nodes.items()]
    beams = [
        (name, b.start, b.end, b.start_joint, b.end_joint, any(b.start_offset), any(b.end_offset))
        for name, b in network.beams.items()
    ]
    key: list[Any] = [tuple(nodes), tuple(beams), moved and moved[:2]]
    if network.links:
        away = tuple(apart(network, link.node) for link in network.links)
        key += [network.links, away]
    if network.springs:
        key.append(tuple(_spring_key(spring) for spring in network.springs))
    driving = drive.loads
    if network.loads or driving:
        key += [tuple(_load_key(load) for load in loads) for loads in (network.loads, driving)]
    return tuple(key)


def _spring_key(spring: Spring) -> Any:
    if isinstance(spring, SlideSpring):
        return SLIDE, spring.node
    return (TURN if isinstance(spring, TorsionSpring) else LINE), spring.start, spring.end


def _load_key(load: LoadOn) -> Any:
    if isinstance(load, LineLoad):
        return (load.beam,)
    return load.node, load.follows, load.moment != 0

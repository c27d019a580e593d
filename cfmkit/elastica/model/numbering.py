"""How a network is made up: numbers of its degrees of freedom and attachments, its plan.

A plan depends on names, joints and supports, and not on any value. Networks of one make-up share one, kept between
calls: a batch, an optimisation or a sweep numbers its degrees of freedom once.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.kernels.network_array_types import LINE, SLIDE, TURN
from cfmkit.elastica.model.drive import Drive, Loading, Rotation
from cfmkit.elastica.model.network import LineLoad, Network, PointLoad, SlideSpring, TorsionSpring, same_direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.elastica.kernels.network_array_types import IntArray
    from cfmkit.elastica.model.network import LoadOn, Spring

GROUND, NOWHERE = -1, -1


@dataclass(frozen=True)
class NumberingPlan:
    """Numbers of degrees of freedom and attachments.

    Attributes
    ----------
    masters : list of str
        Nodes that no link moves; three degrees of freedom each, in this order.
    first, turn, swing : dict
        First degree of freedom of every master; rotation of every node, and that by which its place swings about its
        master's.
    dof_count : int
        Degrees of freedom, those of the ground (the last three) included.
    pins : dict
        (beam, side) and names of pinned nodes to the rotation that they have of their own.
    place_dof : (n, 4) int array
        As in `cfmkit.elastica.kernels.network_array_types.DiscreteNetwork`.
    place_node, place_master, place_offset : (n,) int arrays
        Node and master of an attachment, GROUND for places on the ground; its beam's end, 2 beam + side, or NOWHERE.
    ground_of : dict
        Places on the ground to the spring that is held there.
    beam_end : (beams, 2) int array
    spring_place, spring_kind, load_place, load_follows : int arrays
    load_of, line_load_of : list of (int, int)
        Where each point load and each line load comes from: 0 for the network's, 1 for the drive's, and which.
    line_beam : list of int
        The beam under each line load.
    free : (dofs,) bool array
    slot : (dofs,) int array
    """

    masters: list[str]
    first: dict[str, int]
    turn: dict[str, int]
    swing: dict[str, int]
    dof_count: int
    pins: dict[Any, int]
    place_dof: IntArray
    place_node: IntArray
    place_master: IntArray
    place_offset: IntArray
    ground_of: dict[int, int]
    beam_end: IntArray
    spring_place: IntArray
    spring_kind: IntArray
    load_place: IntArray
    load_follows: IntArray
    load_of: list[tuple[int, int]]
    line_load_of: list[tuple[int, int]]
    line_beam: list[int]
    free: Any
    slot: IntArray

    @cached_property
    def offsets(self) -> bool:
        """Whether any beam's end has an offset."""
        return bool((self.place_offset != NOWHERE).any())

    @cached_property
    def n_free(self) -> int:
        """Number of free degrees of freedom."""
        return int(self.free.sum())

    @cached_property
    def level(self) -> Any:
        """Cos and sin of the frames of all attachments where no support is turned, (n, 2)."""
        return np.tile([1.0, 0.0], (len(self.place_master), 1))


class Builder:
    """Numbers degrees of freedom and attachments, once for every make-up."""

    def __init__(self, network: Network, drive: Drive, moved: tuple[str, int, float] | None) -> None:
        """Number the degrees of freedom."""
        self.network, self.drive, self.moved = network, drive, moved
        self.masters = [name for name in network.nodes if not network.moved(name)]
        self.first = {name: 3 * i for i, name in enumerate(self.masters)}
        self.names = list(network.nodes)
        self.count = 3 * len(self.masters)
        self.pins: dict[Any, int] = {}
        for link in network.links:
            if not link.turns:
                self._pin(link.node)
        for name, beam in network.beams.items():
            for side, joint in enumerate((beam.start_joint, beam.end_joint)):
                if joint == "pin":
                    self._pin((name, side))
        self.ground = self.count
        self.count += 3
        self.turn = {name: self._turn(name) for name in self.names}
        self.rows: list[tuple[tuple[int, int, int, int], int, int, int]] = []
        self.arms: list[bool] = []
        self.ground_of: dict[int, int] = {}

    def _pin(self, what: Any) -> None:
        self.pins[what] = self.count
        self.count += 1

    def _turn(self, node: str) -> int:
        """Return the rotation of a node."""
        body = self.network.body_of(node)
        return self.pins[body] if body in self.pins else self.first[body] + 2

    def _swing(self, node: str) -> int:
        """Return the rotation by which a node's place swings about its master's."""
        body = self.network.body_of(node)
        if body in self.pins and not apart(self.network, body):
            return self.pins[body]
        return self.first[self.network.master_of(node)] + 2

    def plan(self) -> NumberingPlan:
        """Collect the attachments."""
        names = list(self.network.beams)
        ends = [[self._beam_place(k, name, side) for side in (0, 1)] for k, name in enumerate(names)]
        springs = [self._spring(k, spring) for k, spring in enumerate(self.network.springs)]
        load_of, line_of, line_beam, loads = [], [], [], []
        driving = self.drive.loads
        for when, given in enumerate((self.network.loads, driving)):
            for k, load in enumerate(given):
                if isinstance(load, PointLoad):
                    load_of.append((when, k))
                    loads.append((self._place(load.node), load.follows, load.moment != 0))
                else:
                    line_of.append((when, k))
                    line_beam.append(names.index(load.beam))
        free = self._free(np.array(ends), springs, loads)
        slot = np.full(self.count, -1, dtype=np.int64)
        slot[free] = np.arange(int(free.sum()))
        return NumberingPlan(
            masters=self.masters,
            first=self.first,
            turn=self.turn,
            swing={name: self._swing(name) for name in self.names},
            dof_count=self.count,
            pins=self.pins,
            place_dof=np.array([row[0] for row in self.rows], dtype=np.int64),
            place_node=np.array([row[1] for row in self.rows], dtype=np.int64),
            place_master=np.array([row[2] for row in self.rows], dtype=np.int64),
            place_offset=np.array([row[3] for row in self.rows], dtype=np.int64),
            ground_of=self.ground_of,
            beam_end=np.array(ends, dtype=np.int64),
            spring_place=np.array([row[1:] for row in springs], dtype=np.int64).reshape(-1, 2),
            spring_kind=np.array([row[0] for row in springs], dtype=np.int64),
            load_place=np.array([row[0] for row in loads], dtype=np.int64),
            load_follows=np.array([int(row[1]) for row in loads], dtype=np.int64),
            load_of=load_of,
            line_load_of=line_of,
            line_beam=line_beam,
            free=free,
            slot=slot,
        )

    def _place(self, node: str, offset: int = NOWHERE, carried: bool = False, pose: int | None = None) -> int:
        """Add an attachment to a node, with the offset of a beam's end; return its index."""
        master, body = self.network.master_of(node), self.network.body_of(node)
        first, turn, away = self.first[master], self._swing(node), apart(self.network, node)
        if body in self.pins and apart(self.network, body) and (carried or self._away(node, body)):
            raise InputError(f"{body!r} is pinned to a rigid arm: it cannot carry offsets or rigid links of its own")
        own = self.turn[node] if pose is None else pose
        self.rows.append(((first, first + 1, turn, own), self.names.index(node), self.names.index(master), offset))
        self.arms.append(away or carried)
        return len(self.rows) - 1

    def _away(self, node: str, body: str) -> bool:
        one, other = self.network.nodes[node], self.network.nodes[body]
        return bool(one.x != other.x or one.y != other.y)

    def _ground_place(self, spring: int) -> int:
        g = self.ground
        self.rows.append(((g, g + 1, g + 2, g + 2), GROUND, GROUND, NOWHERE))
        self.arms.append(False)
        self.ground_of[len(self.rows) - 1] = spring
        return len(self.rows) - 1

    def _beam_place(self, number: int, name: str, side: int) -> int:
        beam = self.network.beams[name]
        node, offset = ((beam.start, beam.start_offset), (beam.end, beam.end_offset))[side]
        carried = any(offset)
        return self._place(node, 2 * number + side if carried else NOWHERE, carried, self.pins.get((name, side)))

    def _spring(self, number: int, spring: Spring) -> tuple[int, int, int]:
        """Return kind and the two attachments of a spring."""
        if isinstance(spring, SlideSpring):
            return SLIDE, self._ground_place(number), self._place(spring.node)
        if isinstance(spring, TorsionSpring):
            start = self._ground_place(number) if spring.start is None else self._place(spring.start)
            return TURN, start, self._place(spring.end)
        start = self._place(spring.start)
        return LINE, start, self._ground_place(number) if spring.end is None else self._place(spring.end)

    def _free(self, beam_end: Any, springs: list[tuple[int, int, int]], loads: list[tuple[int, bool, bool]]) -> Any:
        """Decide which degrees of freedom are free; a rotation that nothing resists or uses is held at zero."""
        free = np.zeros(self.count, dtype=bool)
        for name in self.masters:
            support, first = self.network.nodes[name].support, self.first[name]
            free[first : first + 3] = (not support.along, not support.across, not support.rotation)
        dofs = [row[0] for row in self.rows]
        turned = set(beam_end.ravel().tolist()) | {p for row in springs if row[0] == TURN for p in row[1:]}
        needed = {dofs[p][3] for p in turned} | {dofs[p][3] for p, follows, moment in loads if follows or moment}
        needed |= {d[2] for d, arm in zip(dofs, self.arms, strict=True) if arm}
        for name in self.masters:
            free[self.first[name] + 2] &= self.first[name] + 2 in needed
        for pin in self.pins.values():
            free[pin] = pin in needed
        if self.moved is not None:
            free[self.first[self.moved[0]] + self.moved[1] % 3] = False
        return free


def apart(network: Network, node: str) -> bool:
    """Tell whether a node is away from its master."""
    one, other = network.nodes[node], network.nodes[network.master_of(node)]
    return bool(one.x != other.x or one.y != other.y)


_KEPT = 64  # plans: of all that a study varies at once
_plans: OrderedDict[Any, NumberingPlan] = OrderedDict()


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


def plan_of(network: Network, drive: Drive, moved: tuple[str, int, float] | None) -> NumberingPlan:
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

"""Planar networks of slender beams: nodes with their supports, beams, rigid links, springs, constant loads.

Values only, in SI; what is done to a network is a `cfmkit.elastica.model.drive`, what comes out a
`cfmkit.elastica.results.path.EquilibriumPath`.

Assumes: plane bending, linear elastic material, rigid joints and links, conservative springs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cfmkit.arrays import ShortRepr
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, BeamSide
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.contact import Contact


_NO_DISPLACEMENT = (0.0, 0.0, 0.0)  # not displaced


@dataclass(frozen=True)
class Support:
    """Which motions of a node are held, in a frame turned by `direction`."""

    along: bool = False  # the direction
    across: bool = False  # 90 deg to its left
    rotation: bool = False
    direction: float = 0.0  # [rad]
    # where held motions are held: along [m], across [m], rotation [rad]; applied before anything else is
    displacement: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse displacements of motions that are free."""
        if tuple(self.displacement) == _NO_DISPLACEMENT:
            return
        for held, value, name in zip(
            (self.along, self.across, self.rotation), self.displacement, ("along", "across", "rotation"), strict=True
        ):
            if value != 0 and not held:
                raise InputError(f"a displacement {name} is given but that motion is not held")


FREE_SUPPORT = Support()
CLAMPED_SUPPORT = Support(True, True, True)
PINNED_SUPPORT = Support(True, True, False)


def slider_support(direction: float, rotates: bool = False) -> Support:
    """Return the support of a node that slides along `direction` [rad] and, if requested, rotates."""
    return Support(along=False, across=True, rotation=not rotates, direction=direction)


@dataclass(frozen=True)
class Node:
    """A place in the plane [m] and its support."""

    x: float
    y: float
    support: Support = FREE_SUPPORT


@dataclass(frozen=True)
class Link:
    """A rigid link: `node` moves and turns with `master` as one body; a pin where it does not turn with it.

    A pin lets beams, links and springs at `node` turn against those at `master` without a moment; a torsion spring
    between the two makes it a sprung hinge.
    """

    master: str
    node: str
    turns: bool = True


@dataclass(frozen=True)
class LineSpring:
    """A spring along the line between two nodes; `free_length` [m] is the present one unless given.

    `stiffness` in N/m. A second node that is None is `ground`, a place [m].
    """

    start: str
    end: str | None
    stiffness: float
    free_length: float | None = None
    ground: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class TorsionSpring:
    """A spring between the rotations of two nodes, or one node and the ground.

    `stiffness` in N m/rad; the moment vanishes where the rotation of `end` less that of `start` is `free_angle` [rad].
    """

    start: str | None
    end: str
    stiffness: float
    free_angle: float = 0.0


@dataclass(frozen=True)
class SlideSpring:
    """A spring that resists the motion of a node along a fixed `direction` [rad]; `stiffness` in N/m."""

    node: str
    direction: float
    stiffness: float
    free_displacement: float = 0.0


Spring = LineSpring | TorsionSpring | SlideSpring


@dataclass(frozen=True)
class PointLoad:
    """A force [N] and moment [N m] at a node. One that `follows` turns with the node; else it keeps its direction.

    Under loads that follow a path is called unstable where it diverges. Whether it flutters, which depends on masses,
    is not judged.
    """

    node: str
    fx: float = 0.0
    fy: float = 0.0
    moment: float = 0.0
    follows: bool = False


@dataclass(frozen=True)
class LineLoad:
    """A uniform dead load on a beam per reference length [N/m]."""

    beam: str
    wx: float = 0.0
    wy: float = 0.0


LoadOn = PointLoad | LineLoad


@dataclass(frozen=True, repr=False)
class Network(ShortRepr):
    """A network: everything about it, by name, and nothing about what is done to it.

    Raises InputError if names do not match, or a linked node has a support of its own.
    """

    nodes: Mapping[str, Node]
    beams: Mapping[str, Beam]
    links: tuple[Link, ...] = ()
    springs: tuple[Spring, ...] = ()
    loads: tuple[LoadOn, ...] = field(default=())
    contacts: tuple[Contact, ...] = ()  # stops, obstacles, pads on beams

    def __post_init__(self) -> None:
        nodes, beams = dict(self.nodes), dict(self.beams)
        object.__setattr__(self, "nodes", MappingProxyType(nodes))
        object.__setattr__(self, "beams", MappingProxyType(beams))
        if not beams:
            raise InputError("a network needs at least one beam")
        for name, beam in beams.items():
            if beam.start not in nodes or beam.end not in nodes:
                self._require_node(beam.start, f"beam {name!r}")
                self._require_node(beam.end, f"beam {name!r}")
        for spring in self.springs:
            for end in spring_ends(spring):
                self._require_node(end, "a spring")
            if isinstance(spring, LineSpring):
                end_place = self._place(spring.end) if spring.end is not None else spring.ground
                if self._place(spring.start) == end_place:
                    raise InputError(f"the line spring at {spring.start!r} begins and ends at one place: no direction")
        for load in self.loads:
            self.check_load(load)
        for contact in self.contacts:
            if isinstance(contact, BeamSide) and contact.beam not in beams:
                raise InputError(f"contact {contact.name!r} is of the beam {contact.beam!r}, which is not there")
            if not isinstance(contact, BeamOnObstacle | BeamOnBeam):
                self._require_node(contact.node, f"contact {contact.name!r}")
        if self.links:
            self._check_links()

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what pickling needs (mapping proxies do not pickle)."""
        return type(self), (dict(self.nodes), dict(self.beams), self.links, self.springs, self.loads, self.contacts)

    def check_load(self, load: LoadOn) -> None:
        """Raise an error if what the load acts on is not there."""
        if isinstance(load, PointLoad):
            self._require_node(load.node, "a load")
        elif load.beam not in self.beams:
            raise InputError(f"a line load acts on {load.beam!r}, which is not a beam; beams: {', '.join(self.beams)}")

    def master_of(self, node: str) -> str:
        """Return the node that moves `node`: its link's master, or itself."""
        for link in self.links:
            if link.node == node:
                return self.master_of(link.master)
        return node

    def is_moved_by_link(self, node: str) -> bool:
        """Return True if a link moves a node."""
        return any(link.node == node for link in self.links)

    def body_of(self, node: str) -> str:
        """Return the node whose rotation is that of `node`: up the links as far as the first pin."""
        for link in self.links:
            if link.node == node and link.turns:
                return self.body_of(link.master)
        return node

    def _place(self, node: str) -> tuple[float, float]:
        return self.nodes[node].x, self.nodes[node].y

    def _require_node(self, node: str, what: str) -> None:
        if node not in self.nodes:
            raise InputError(f"{what} refers to {node!r}, which is not a node; nodes: {', '.join(self.nodes)}")

    def _check_links(self) -> None:
        moved = [link.node for link in self.links]
        for link in self.links:
            self._require_node(link.master, "a link")
            self._require_node(link.node, "a link")
            seen = {link.node}
            at = link.master
            while at in moved:
                if at in seen:
                    raise InputError(f"the links through {link.node!r} form a loop")
                seen.add(at)
                at = self.links[moved.index(at)].master
            support = self.nodes[link.node].support
            if support.along or support.across or support.rotation:
                raise InputError(f"node {link.node!r} is moved by a link and cannot have a support")
        if len(set(moved)) != len(moved):
            raise InputError("a node can be moved by one link only")


def spring_ends(spring: Spring) -> list[str]:
    """Return the names of the nodes at a spring."""
    if isinstance(spring, SlideSpring):
        return [spring.node]
    return [end for end in (spring.start, spring.end) if end is not None]


def same_direction(first: float, second: float) -> bool:
    """Return True if two directions [rad] are parallel, in either sense."""
    between = first.real - second.real
    return math.isfinite(between) and abs(math.sin(between)) < 1e-12


def apart(network: Network, node: str) -> bool:
    """Return True if a node is away from its master."""
    place, master_place = network.nodes[node], network.nodes[network.master_of(node)]
    return bool(place.x != master_place.x or place.y != master_place.y)


def swings_with_master(network: Network, node: str) -> bool:
    """Return True if arms at a linked node turn with its master; else, with offsets at a pin there, with itself.

    Of a pin without arms the first holds: it may be moved away from its master.
    """
    return apart(network, node) or not _carries_arms(network, node)


def _carries_arms(network: Network, carrier: str) -> bool:
    """Return True if a beam's offset is not zero, or a node away, at what turns with a node."""
    place = network._place(carrier)
    carried = {name for name in network.nodes if network.body_of(name) == carrier}
    offsets = [
        offset
        for beam in network.beams.values()
        for name, offset in ((beam.start, beam.start_offset), (beam.end, beam.end_offset))
        if name in carried
    ]
    return any(map(any, offsets)) or any(network._place(name) != place for name in carried)

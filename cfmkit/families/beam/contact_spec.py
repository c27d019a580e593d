"""Specification of contact (stops of nodes, obstacles, contacts between parts), its checks, and its columns' names."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Discriminator, Field, Tag, create_model, model_validator

from cfmkit.elastica.model.contact import (
    BeamOnBeam,
    BeamOnObstacle,
    Contact,
    NodeOnBeam,
    NodeOnObstacle,
    ObstacleEdge,
    Stop,
    arc_edge,
    circle_edge,
    line_edge,
    polyline_edge,
)
from cfmkit.families.beam.shapes_spec import Point
from cfmkit.families.end_stops_spec import FreeWay
from cfmkit.specs.spec import Model, PositiveLength
from cfmkit.specs.units import Angle, Length, Ratio, RotationalStiffness, Stiffness, format_short

FreeAngle = Annotated[Angle, Field(ge=0)]
FrictionCoefficient = Annotated[Ratio, Field(ge=0, lt=2)]
Fault = tuple[tuple[str | int, ...], str]
Mechanism = Any  # the block `mechanism`, which imports this file
FRICTION_COLUMNS = ("tangential", "state")
MAX_OVERLAP_SHARE = 1e-9  # share of the mechanism's size by which a pad may lie in an obstacle at rest: rounding
HELD_SUPPORTS = ("clamped", "pinned")  # supports of nodes that are held in place
LONGEST_POLYLINE = 200  # corners


class StopBase(Model):
    """Common part of both kinds of stops."""

    kind_tag: ClassVar[str]  # how the kind is told apart in places of faults

    node: str = Field(description="node that is stopped")

    @property
    def gaps(self) -> tuple[float | None, float | None]:
        """Free ways against and along the direction, or clockwise and counter-clockwise; None where nothing limits."""
        gap: Any = self.gap  # type: ignore[attr-defined]
        return gap if isinstance(gap, tuple) else (None, gap)

    def contacts(self, name: str) -> Iterator[Contact]:
        """Yield the one-sided contacts of the stop."""
        stiffness: float | None = self.stiffness  # type: ignore[attr-defined]
        direction: float | None = getattr(self, "direction", None)
        for sense, gap in zip((-1.0, 1.0), self.gaps, strict=True):
            if gap is not None:
                along = direction if direction is None or sense > 0 else direction + math.pi
                friction: float = getattr(self, "friction", 0.0)
                yield Stop(name, self.node, gap, along, sense, math.inf if stiffness is None else stiffness, friction)


class MotionStop(StopBase):
    """A stop that limits how far a node moves along a direction."""

    kind_tag = "motion"

    direction: Angle = Field(description="along which the motion is limited; from the x axis")
    gap: FreeWay | tuple[FreeWay, FreeWay] = Field(
        description="free way before any load: of a motion along the direction, or two: [against, along] it"
    )
    stiffness: Annotated[Stiffness, Field(gt=0)] | None = Field(None, description="of the stop; default: it is rigid")
    friction: FrictionCoefficient = Field(0.0, description="coefficient of Coulomb friction across the direction")


class RotationStop(StopBase):
    """A stop that limits how far a node turns."""

    kind_tag = "rotation"

    rotation: Literal[True] = Field(description="true: the rotation is limited")
    gap: FreeAngle | tuple[FreeAngle, FreeAngle] = Field(
        description="free angle before any load: counter-clockwise, or two: [clockwise, counter-clockwise]"
    )
    stiffness: Annotated[RotationalStiffness, Field(gt=0)] | None = Field(
        None, description="of the stop; default: it is rigid"
    )


def _kind_of_stop(tree: Any) -> str:
    """Return which kind of stop is meant: one with a direction, unless a rotation is named."""
    turns = "rotation" in tree if isinstance(tree, Mapping) else isinstance(tree, RotationStop)
    return "rotation" if turns else "motion"


StopSpec = Annotated[
    Annotated[MotionStop, Tag("motion")] | Annotated[RotationStop, Tag("rotation")], Discriminator(_kind_of_stop)
]


class ObstacleBase(Model):
    """Common part of all kinds of obstacles, which differ in `outline`."""

    nodes: dict[str, Annotated[Length, Field(ge=0)]] | None = Field(
        None,
        description="nodes that may touch it, with the radius of their round pads: {tip: 2 mm}; default: all free "
        "ends of beams, and ends of the beams that may touch it, with half the thickness there",
    )
    beams: tuple[str, ...] | None = Field(
        None,
        description="beams whose sides may touch it, anywhere along their lengths; default: all, none where nodes or "
        "a stiffness or friction are stated",
    )
    stiffness: Annotated[Stiffness, Field(gt=0)] | None = Field(
        None, description="of the obstacle at a pad; default: it is rigid"
    )
    friction: FrictionCoefficient = Field(
        0.0, description="coefficient of Coulomb friction of pads; the curve has a way back then, as branch 'unload'"
    )

    @abstractmethod
    def outline(self) -> ObstacleEdge:
        """Return its edge, the free side to the left."""


class LineObstacle(ObstacleBase):
    """A straight wall that goes on for ever."""

    kind: Literal["line"]
    through: Point = Field(description="a point of the wall")
    direction: Angle = Field(description="of the wall, from the x axis; the free side is to its left")

    def outline(self) -> ObstacleEdge:
        """Return its edge."""
        return line_edge(self.through, self.direction)


class DiscObstacle(ObstacleBase):
    """A round body."""

    kind: Literal["disc"]
    centre: Point = Field(description="its middle")
    radius: PositiveLength = Field(description="its radius")

    def outline(self) -> ObstacleEdge:
        """Return its edge."""
        return circle_edge(self.centre, self.radius)


class HoleObstacle(ObstacleBase):
    """A round hole: the free side is inside."""

    kind: Literal["hole"]
    centre: Point = Field(description="its middle")
    radius: PositiveLength = Field(description="its radius")

    def outline(self) -> ObstacleEdge:
        """Return its edge."""
        return circle_edge(self.centre, self.radius, hole=True)


class PolylineObstacle(ObstacleBase):
    """A body with straight sides and rounded corners."""

    kind: Literal["polyline"]
    points: Annotated[tuple[Point, ...], Field(min_length=2, max_length=LONGEST_POLYLINE)] = Field(
        description="corners [[x, y], ...]; the free side is to the left of the way along them"
    )
    fillet: PositiveLength | None = Field(None, description="radius of all corners; needed where there are any")
    closed: bool = Field(False, description="whether the last point is joined to the first: a block")

    @model_validator(mode="after")
    def _has_an_outline(self) -> Self:
        corners = len(self.points) - (0 if self.closed else 2)
        if self.closed and len(self.points) < 3:
            raise ValueError("a closed polyline needs three points")
        if corners and self.fillet is None:
            raise ValueError("'fillet', the radius of its corners, is missing")
        self.outline()
        return self

    def outline(self) -> ObstacleEdge:
        """Return its edge."""
        return polyline_edge(self.points, self.fillet or 0.0, self.closed)


_FROM_FIELD: Any = {"from": (Angle, Field(description="direction from the middle to one end of the arc"))}
"""No name in Python."""
_BeginsAnywhere = create_model("_BeginsAnywhere", __base__=ObstacleBase, **_FROM_FIELD)


class ArcObstacle(_BeginsAnywhere):
    """A part of the edge of a disc that goes on straight at both ends."""

    kind: Literal["arc"]
    centre: Point = Field(description="middle of the disc")
    radius: PositiveLength = Field(description="radius of the disc")
    to: Angle = Field(description="direction from the middle to the other end")

    @property
    def ends(self) -> tuple[float, float]:
        """Directions from the middle to both ends of the arc [rad]."""
        return getattr(self, "from"), self.to

    @model_validator(mode="after")
    def _turns_at_most_half_round(self) -> Self:
        if not 0 < abs(self.ends[1] - self.ends[0]) <= math.pi:
            raise ValueError("between 'from' and 'to' there must be more than 0 and at most 180 deg")
        return self

    def outline(self) -> ObstacleEdge:
        """Return its edge."""
        return arc_edge(self.centre, self.radius, *self.ends)


ObstacleSpec = Annotated[
    LineObstacle | DiscObstacle | HoleObstacle | PolylineObstacle | ArcObstacle, Field(discriminator="kind")
]


class PartContact(Model):
    """A contact between two parts of the mechanism: two beams, or the round pad of a node and a beam."""

    between: tuple[str, str] = Field(description="two beams, or a node, whose round pad touches, and a beam")
    radius: Annotated[Length, Field(ge=0)] | None = Field(
        None, description="of the pad of a node; default: half the thickness of the beam that ends freely there"
    )

    def find_pad(self, mechanism: Mechanism) -> tuple[str, str] | None:
        """Return the node and the beam, in whichever order they are stated; None if it is not one of each."""
        pairs = (self.between, self.between[::-1])
        return next(((a, b) for a, b in pairs if a in mechanism.nodes and b in mechanism.beams), None)

    def find_fault(self, mechanism: Mechanism) -> tuple[str, str] | None:
        """Return the key and what is wrong with it; None if nothing is."""
        for name in self.between:
            if name not in mechanism.nodes and name not in mechanism.beams:
                names = f"nodes are {list_names(mechanism.nodes)}; beams are {list_names(mechanism.beams)}"
                return "between", f"there is no node or beam {name!r}; {names}"
        pad = self.find_pad(mechanism)
        if pad is None:
            return self._find_fault_of_beams(mechanism)
        node, beam = pad
        if node in end_nodes(mechanism, beam):
            return "between", f"node {node!r} is an end of beam {beam!r}: its pad always touches that beam"
        if self.radius is None and node not in free_ends(mechanism):
            return "radius", f"no beam ends freely at node {node!r}: state the radius of its round pad"
        return None

    def _find_fault_of_beams(self, mechanism: Mechanism) -> tuple[str, str] | None:
        """Return what is wrong with two parts that are not a node and a beam."""
        first, second = self.between
        if first not in mechanism.beams or second not in mechanism.beams:
            return "between", "these are two nodes: one must be a beam, such as [tip, lower]"
        if first == second:
            return "between", f"contact of beam {first!r} with itself is not modelled"
        common = set(end_nodes(mechanism, first)) & set(end_nodes(mechanism, second))
        if common:
            return "between", f"both beams are at node {common.pop()!r}: give a node that touches, and the other beam"
        tapered = [name for name in self.between if len(mechanism.list_thicknesses(name)) > 1]
        if tapered:
            return "between", f"the thickness of beam {tapered[0]!r} varies: give a node that touches, and a beam"
        for name in self.between:
            if mechanism.beams[name].start_offset or mechanism.beams[name].end_offset:
                return "between", f"beam {name!r} ends beside a node: give a node that touches, and a beam"
        if self.radius is not None:
            return "radius", "two beams touch with half their thickness: leave it out"
        return None

    def contacts(self, mechanism: Mechanism) -> tuple[BeamOnBeam | NodeOnBeam, ...]:
        """Return the contacts, all of one name: of two beams also those of their ends."""
        pad = self.find_pad(mechanism)
        if pad is not None:
            node, beam = pad
            radius = free_ends(mechanism)[node] if self.radius is None else self.radius
            return (NodeOnBeam(f"{node}_{beam}", node, beam, radius),)
        first, second = self.between
        name = f"{first}_{second}"
        ends = [
            NodeOnBeam(name, node, partner, radius)
            for beam, partner in ((first, second), (second, first))
            for node, radius in end_radii(mechanism, beam).items()
        ]
        return (BeamOnBeam(name, first, second), BeamOnBeam(name, second, first, leads=False), *ends)


def end_nodes(mechanism: Mechanism, beam: str) -> tuple[str, str]:
    """Return the nodes at both ends of a beam."""
    return mechanism.beams[beam].start, mechanism.beams[beam].end


def end_radii(mechanism: Mechanism, beam: str) -> dict[str, float]:
    """Return the nodes at both ends of a beam, with half its thickness there [m]."""
    thicknesses = mechanism.list_thicknesses(beam)
    return dict(zip(end_nodes(mechanism, beam), (0.5 * thicknesses[0], 0.5 * thicknesses[-1]), strict=True))


def list_names(names: Iterable[str]) -> str:
    """Return names separated by commas, twelve at most; ", ..." stands for the rest."""
    listed = list(names)
    return ", ".join(listed[:12]) + (", ..." if len(listed) > 12 else "")


def contacts_of(mechanism: Mechanism) -> tuple[Contact, ...]:
    """Return all one-sided contacts of a mechanism: of stops first, then of obstacles, then between parts."""
    contacts = [contact for name, stop in mechanism.stops.items() for contact in stop.contacts(name)]
    for name, obstacle in mechanism.obstacles.items():
        outline = obstacle.outline()
        for node, radius in pads_of(mechanism, obstacle).items():
            stiffness = obstacle.stiffness or math.inf
            contacts.append(NodeOnObstacle(name, node, outline, radius, stiffness, obstacle.friction))
        contacts.extend(BeamOnObstacle(name, beam, outline) for beam in sides_of(mechanism, obstacle))
    contacts.extend(contact for pair in mechanism.contacts for contact in pair.contacts(mechanism))
    return tuple(contacts)


def has_friction(mechanism: Mechanism) -> bool:
    """Return True if a contact has friction: the way back is another one then."""
    touched = (*mechanism.stops.values(), *mechanism.obstacles.values())
    return any(getattr(item, "friction", 0.0) for item in touched)


def sides_of(mechanism: Mechanism, obstacle: ObstacleBase) -> tuple[str, ...]:
    """Return the beams whose sides may touch an obstacle."""
    if obstacle.beams is not None:
        return obstacle.beams
    pads_only = obstacle.nodes is not None or obstacle.stiffness is not None or obstacle.friction
    return () if pads_only else tuple(mechanism.beams)


def pads_of(mechanism: Mechanism, obstacle: ObstacleBase) -> Mapping[str, float]:
    """Return the nodes that may touch an obstacle, with the radii of their pads [m].

    Where the sides of beams may touch it, so may their ends, but for those that are held in place.
    """
    stated = obstacle.nodes or {}
    pads = dict(stated) if obstacle.nodes is not None else free_ends(mechanism)
    for beam in sides_of(mechanism, obstacle):
        for node, radius in end_radii(mechanism, beam).items():
            if node not in stated and mechanism.nodes[node].support not in HELD_SUPPORTS:
                pads[node] = max(pads.get(node, 0.0), radius)
    return pads


def free_ends(mechanism: Mechanism) -> dict[str, float]:
    """Return the nodes at which one beam ends freely, with half its thickness there [m]."""
    linked = {name for link in mechanism.links for name in (link.master, link.node)}
    radii: dict[str, list[float]] = {name: [] for name in mechanism.nodes}
    for beam in mechanism.beams:
        for node, radius in end_radii(mechanism, beam).items():
            radii[node].append(radius)
    is_free = {name: node.support == "free" and name not in linked for name, node in mechanism.nodes.items()}
    return {node: ends[0] for node, ends in radii.items() if is_free[node] and len(ends) == 1}


def contact_faults(mechanism: Mechanism) -> Iterator[Fault]:
    """Yield what is wrong with the contacts of a mechanism whose names of nodes are right."""
    size = max(math.dist(a.at, b.at) for a in mechanism.nodes.values() for b in mechanism.nodes.values())
    for name, obstacle in mechanism.obstacles.items():
        place = ("obstacles", name, obstacle.kind)
        yield from _side_faults(mechanism, obstacle, place)
        if obstacle.friction and obstacle.beams:
            text = "friction along a beam's flank is not modelled: state 'nodes', or leave out 'friction'"
            yield (*place, "friction"), text
        pads = pads_of(mechanism, obstacle)
        if not pads and not sides_of(mechanism, obstacle):
            yield (*place, "nodes"), "no beam ends freely: state the nodes that may touch it, such as {tip: 2 mm}"
        outline = obstacle.outline()
        for node, radius in pads.items():
            if outline.smallest_hollow <= radius:
                hollow, size_of_pad = (format_short(size, "length") for size in (outline.smallest_hollow, radius))
                yield place, f"its hollow of {hollow} is too tight for the pad of {node!r}, radius {size_of_pad}"
                continue
            if radius == 0 and outline.smallest_bulge == 0:
                yield place, f"a sharp corner needs a pad of {node!r} with a radius"
            inside = radius - float(outline.distance(mechanism.nodes[node].at).value)
            if inside > MAX_OVERLAP_SHARE * size and mechanism.closure != "chain":
                yield place, f"the pad of node {node!r} lies {format_short(inside, 'length')} inside it before any load"
    if not mechanism.has_contacts:
        return
    yield from _column_faults(mechanism)
    smooth: list[tuple[str | int, ...]] = [
        ("obstacles", name) for name, obstacle in mechanism.obstacles.items() if sides_of(mechanism, obstacle)
    ]
    smooth += [("contacts", number) for number in range(len(mechanism.contacts))]
    reported = any(obstacle.friction and obstacle.beams for obstacle in mechanism.obstacles.values())
    if smooth and has_friction(mechanism) and not reported:
        text = "flanks of beams beside contacts with friction are not modelled: state the 'nodes' that may touch it"
        yield smooth[0], f"{text}, or leave out 'friction'"
    yield from _stop_faults(mechanism)
    for name in mechanism.obstacles:
        if name in mechanism.stops:
            yield ("obstacles", name), "a stop has the same name: rename one of them"
    for number, pair in enumerate(mechanism.contacts):
        name = pair.contacts(mechanism)[0].name
        if name in mechanism.stops or name in mechanism.obstacles:
            yield ("contacts", number), f"a stop or an obstacle has its name, {name!r}: rename that"
    key = next(key for key in ("stops", "obstacles", "contacts") if getattr(mechanism, key))
    if mechanism.layers > 1:
        yield (key,), "contact is not supported with stages in series: leave out 'copies.layers'"
    acting = (mechanism.drive, *mechanism.loads, *getattr(mechanism.drive, "loads", ()))
    if any(getattr(load, "follows", False) for load in acting):
        yield (key,), "contact is not supported under loads that turn with their node: leave out 'follows'"


def _stop_faults(mechanism: Mechanism) -> Iterator[Fault]:
    """Yield which stops are of nodes that do not move."""
    for name, stop in mechanism.stops.items():
        support = mechanism.nodes[stop.node]
        stands = support.support == "clamped" or (support.support == "pinned" and stop.kind_tag == "motion")
        if stands and support.moved is None and getattr(mechanism.drive, "node", None) != stop.node:
            yield ("stops", name, stop.kind_tag, "node"), f"node {stop.node!r} is {support.support}: it reaches no stop"


def _side_faults(mechanism: Mechanism, obstacle: ObstacleBase, place: tuple[str | int, ...]) -> Iterator[Fault]:
    """Yield what is wrong with the sides of beams on an obstacle."""
    if obstacle.beams and obstacle.stiffness is not None:
        yield (*place, "stiffness"), "an obstacle that sides of beams touch is rigid: leave it out, or state 'nodes'"
    hollow = obstacle.outline().smallest_hollow
    for name in sides_of(mechanism, obstacle):
        most = max(mechanism.list_thicknesses(name))
        if hollow <= 0.5 * most:
            tight, thick = (format_short(size, "length") for size in (hollow, most))
            yield place, f"its hollow of {tight} is too tight for beam {name!r}, half as thick as {thick}"


def _column_faults(mechanism: Mechanism) -> Iterator[Fault]:
    seen = {f"{name}_force" for name in mechanism.beams}
    for place, force in column_names(mechanism):
        for column in (force, *(friction_columns(force) if has_friction(mechanism) else ())):
            if column in seen:
                yield place, f"its column {column!r} has the name of another one: rename it"
            seen.add(column)


def friction_columns(column: str) -> tuple[str, ...]:
    """Return the columns of friction of a contact by the column of its force."""
    return tuple(f"{column.removesuffix('force')}{what}" for what in FRICTION_COLUMNS)


def column_names(mechanism: Mechanism) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield the place in the specification and the column of the force of each stop, of each pad, of each pair."""
    for name in mechanism.stops:
        yield ("stops", name), f"stop_{name}_force"
    for name, obstacle in mechanism.obstacles.items():
        for toucher in (*pads_of(mechanism, obstacle), *sides_of(mechanism, obstacle)):
            yield ("obstacles", name, obstacle.kind), f"{name}_{toucher}_force"
    for number, pair in enumerate(mechanism.contacts):
        yield ("contacts", number), f"{pair.contacts(mechanism)[0].name}_force"

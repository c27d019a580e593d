"""Specification of a whole beam mechanism (`Mechanism`), and checks that nodes, beams, links and drive fit together."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from cfmkit.families.beam.contact_spec import (
    Fault,
    MotionStop,
    ObstacleSpec,
    PartContact,
    StopSpec,
    contact_faults,
    list_names,
)
from cfmkit.families.beam.network_elements_spec import (
    HELD_MOTIONS,
    Copies,
    DisplacementDrive,
    DriveSpec,
    LineSpringSpec,
    LinkSpec,
    LoadsDrive,
    LoadSpec,
    MaterialField,
    MemberSpec,
    NodeSpec,
    PartSpec,
    SpringSpec,
    Thickness,
    checked_thickness,
)
from cfmkit.specs.spec import Model, PositiveLength, refuse
from cfmkit.specs.units import format_short
from cfmkit.stock.material_and_part_spec import CutPart, RoundedCorners, SafetyFactor

if TYPE_CHECKING:
    from collections.abc import Mapping


_NAME_PATTERN = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,39}")
_SAME_DIRECTION = 1e-6  # rad; the support's direction is used
_SAME_PLACE = 1e-12  # m; sums of offsets are rounded


def faults(mechanism: Mechanism) -> Iterator[Fault]:
    """Yield what is wrong with a mechanism whose keys are each right by themselves."""
    for group in ("nodes", "beams", "springs", "stops", "obstacles"):
        for name in getattr(mechanism, group):
            if not _NAME_PATTERN.fullmatch(name):
                yield (group, name), "a name is a letter and then at most 39 letters, digits, '_' or '-'"
    if len(mechanism.nodes) == 1:
        held = "{at: [0 mm, 0 mm], support: clamped}"
        yield ("nodes",), f"a beam joins two nodes, and there is one: add another, such as 'wall: {held}'"
        return
    references = list(_unknown(mechanism))
    yield from references
    if references:
        return
    beams = [
        (("beams", name, *place), text)
        for name, beam in mechanism.beams.items()
        for place, text in _beam_faults(mechanism, beam)
    ]
    yield from beams
    yield from _spring_faults(mechanism)
    yield from _link_faults(mechanism)
    yield from () if beams else _loose_nodes(mechanism)
    yield from _drive_faults(mechanism)
    yield from _copy_faults(mechanism)
    yield from contact_faults(mechanism)
    if mechanism.shear and not mechanism.axial:
        yield ("shear",), "beams that shear stretch, too: add 'axial: true'"


def _unknown(mechanism: Mechanism) -> Iterator[Fault]:
    """Yield names of nodes and beams that do not exist."""
    for place, kind, name in references(mechanism):
        items: Mapping[str, object] = getattr(mechanism, f"{kind}s")
        if name not in items:
            yield place, f"there is no {kind} {name!r}; {kind}s are {list_names(items)}"
    for number, contact in enumerate(mechanism.contacts):
        if (fault := contact.find_fault(mechanism)) is not None:
            yield ("contacts", number, fault[0]), fault[1]


def references(mechanism: Mechanism) -> Iterator[tuple[tuple[str | int, ...], str, str]]:
    """Yield every mention of a node or a beam: its place, "node" or "beam", the name."""
    for name, beam in mechanism.beams.items():
        yield ("beams", name, "start"), "node", beam.start
        yield ("beams", name, "end"), "node", beam.end
    for index, link in enumerate(mechanism.links):
        yield ("links", index, "master"), "node", link.master
        yield ("links", index, "node"), "node", link.node
    for name, spring in mechanism.springs.items():
        for key in ("start", "end", "node"):
            if (node := getattr(spring, key, None)) is not None:
                yield ("springs", name, spring.kind, key), "node", node
    for name, stop in mechanism.stops.items():
        yield ("stops", name, stop.kind_tag, "node"), "node", stop.node
    for name, obstacle in mechanism.obstacles.items():
        for node in obstacle.nodes or ():
            yield ("obstacles", name, obstacle.kind, "nodes", node), "node", node
        for number, side in enumerate(obstacle.beams or ()):
            yield ("obstacles", name, obstacle.kind, "beams", number), "beam", side
    driving = mechanism.drive.loads if isinstance(mechanism.drive, LoadsDrive) else ()
    for place, loads in ((("loads",), mechanism.loads), (("drive", "loads", "loads"), driving)):
        for index, load in enumerate(loads):
            yield (*place, index, load.kind, load.acts_on), load.acts_on, getattr(load, load.acts_on)
    yield ("drive", mechanism.drive.kind, "node"), "node", mechanism.drive.node


def _beam_faults(mechanism: Mechanism, beam: MemberSpec) -> Iterator[Fault]:
    if beam.start == beam.end:
        yield ("end",), f"a beam needs two different nodes, not {beam.start!r} twice"
        return
    start, end = (mechanism.nodes[name] for name in (beam.start, beam.end))
    arms = beam.start_offset or (0.0, 0.0), beam.end_offset or (0.0, 0.0)
    x, y = (end.at[k] + arms[1][k] - start.at[k] - arms[0][k] for k in (0, 1))
    reach = math.hypot(x, y)
    if reach < _SAME_PLACE:
        yield ("end",), f"the two ends of the beam are at the same place, at {beam.start!r}"
        return
    for key, why in beam.shape.find_faults(reach):
        yield ("shape", beam.shape.kind, key), why


def _spring_faults(mechanism: Mechanism) -> Iterator[Fault]:
    for name, spring in mechanism.springs.items():
        if isinstance(spring, LineSpringSpec):
            start, end = mechanism.nodes[spring.start].at, spring.ground or mechanism.nodes[str(spring.end)].at
            if math.dist(start, end) < _SAME_PLACE:
                key = "end" if spring.ground is None else "ground"
                why = f"the spring begins and ends at the place of {spring.start!r}: it has no direction"
                yield ("springs", name, "line", key), f"{why}; use two springs of kind 'slide'"


def _link_faults(mechanism: Mechanism) -> Iterator[Fault]:
    leads: dict[str, str] = {}
    for index, link in enumerate(mechanism.links):
        if link.node in leads:
            yield ("links", index, "node"), f"{link.node!r} follows {leads[link.node]!r} already"
        elif mechanism.nodes[link.node].support != "free":
            yield ("links", index, "node"), f"{link.node!r} has a support and cannot follow another node"
        elif link.node in _chain(leads, link.master):
            yield ("links", index), f"the links through {link.node!r} form a loop"
        else:
            leads[link.node] = link.master


def _chain(leads: Mapping[str, str], node: str) -> list[str]:
    """Return a node and all that lead it."""
    chain = [node]
    while chain[-1] in leads:
        chain.append(leads[chain[-1]])
    return chain


def _loose_nodes(mechanism: Mechanism) -> Iterator[Fault]:
    held = {name for place, kind, name in references(mechanism) if kind == "node" and place[0] in ("beams", "links")}
    for name in mechanism.nodes:
        if name not in held:
            yield ("nodes", name), "no beam and no link holds this node"


def _drive_faults(mechanism: Mechanism) -> Iterator[Fault]:
    drive: Any = mechanism.drive
    at = ("drive", drive.kind, "node")
    leader = next((link.master for link in mechanism.links if link.node == drive.node), None)
    if leader is not None:
        yield at, f"{drive.node!r} follows {leader!r}: drive that one"
        return
    node = mechanism.nodes[drive.node]
    along, across, rotation = HELD_MOTIONS[node.support]
    if drive.turns:
        if rotation:
            yield at, f"{drive.node!r} cannot turn: its support is {node.support!r}; 'pinned' lets it turn"
        return
    if isinstance(drive, LoadsDrive) and not drive.acts:
        yield ("drive", "loads", "loads"), "every load is zero, or they cancel: nothing drives the mechanism"
    if along and across:
        remedy = f"'guided' with 'direction: {format_short(drive.direction, 'angle')}'"
        yield at, f"{drive.node!r} cannot move: its support is {node.support!r}; {remedy} or 'free' lets it"
    elif across and not are_parallel(drive.direction, node.direction or 0.0):
        drive_angle, guide_angle = format_short(drive.direction, "angle"), format_short(node.direction or 0.0, "angle")
        yield (
            ("drive", drive.kind, "direction"),
            f"{drive.node!r} slides along {guide_angle} only ('mechanism.nodes.{drive.node}.direction'), not along "
            f"{drive_angle}: make both directions equal, or its support 'free'",
        )


def are_parallel(angle: float, reference: float) -> bool:
    """Return True if two directions [rad] are parallel, in either sense."""
    return abs(math.sin(angle - reference)) < _SAME_DIRECTION


def _copy_faults(mechanism: Mechanism) -> Iterator[Fault]:
    copies, drive = mechanism.copies, mechanism.drive
    if copies is None:
        return
    if copies.mirror is not None and drive.turns:
        yield ("copies", "mirror"), f"two halves have no common {drive.kind}: drive them by a displacement or a force"
    if copies.layers == 1:
        return
    place = ("copies", "layers")
    if not drive.is_displacement or mechanism.nodes[drive.node].support != "guided":
        yield place, "stages in series need a displacement as the drive, of a node that is 'guided'"
    if mechanism.springs or mechanism.loads:
        yield place, "stages in series may have beams and links only: no springs and no loads"
    for name, node in mechanism.nodes.items():
        if name != drive.node and node.support not in ("clamped", "free"):
            yield ("nodes", name, "support"), "in stages in series, every support but the driven one is 'clamped'"


class Mechanism(RoundedCorners, Model):
    """A planar network of slender beams, its loads and its drive."""

    default_part: ClassVar[type[CutPart]] = PartSpec

    material: MaterialField = Field(description="a name from `show materials`, or {youngs_modulus, ...}")
    safety_factor: SafetyFactor = 1.0
    thickness: Thickness = Field(
        description="in the plane of bending (w of Lan); or [[fraction, thickness], ...], linear between"
    )
    width: PositiveLength = Field(description="out of the plane (t of Lan)")
    axial: bool = Field(False, description="whether beams stretch; `analysis.fidelity` takes precedence")
    shear: bool = Field(False, description="whether beams shear, too")
    wide_beams: bool = Field(
        False,
        description="whether wide beams are stiffer because their anticlastic bending is suppressed; clamped ends, "
        "which stiffen them further, are left out",
    )
    closure: Literal["rotscale", "chain", "raw"] = Field(
        "rotscale",
        description=(
            "how beams are fitted between rounded nodes: turned and scaled, nodes that are not held moved to the "
            "beams' ends (guides with them), or forced into place (prestressed)"
        ),
    )
    nodes: dict[str, NodeSpec] = Field(min_length=1, description="by name: {n1: {at: [0 mm, 0 mm], support: clamped}}")
    beams: dict[str, MemberSpec] = Field(min_length=1, description="by name: {b1: {start: n1, end: n2}}")
    links: tuple[LinkSpec, ...] = Field((), description="rigid links: [{master: n1, node: n2}]")
    springs: dict[str, SpringSpec] = Field({}, description="by name; of `kind` line, torsion or slide")
    loads: tuple[LoadSpec, ...] = Field((), description="constant loads; of `kind` point or line")
    stops: dict[str, StopSpec] = Field(
        {}, description="by name: {end: {node: tip, direction: -90 deg, gap: 3 mm}}, or with {rotation: true}"
    )
    obstacles: dict[str, ObstacleSpec] = Field(
        {}, description="rigid bodies that nodes may touch, by name; of `kind` line, disc, hole, polyline or arc"
    )
    contacts: tuple[PartContact, ...] = Field(
        (), description="between its parts: [{between: [upper, lower]}, {between: [tip, lower], radius: 1 mm}]"
    )
    drive: DriveSpec = Field(description="the drive; of `kind` displacement, rotation, force, moment or loads")
    copies: Copies | None = Field(None, description="copies of the part described here")
    part: PartSpec | None = Field(None, description="how it is cut: fillets, smallest gap and feature")

    @field_validator("thickness")
    @classmethod
    def _stations(cls, value: Thickness) -> Thickness:
        return checked_thickness(value)

    def collect_beam_values(self, key: Literal["material", "thickness", "width"]) -> dict[str, Any]:
        """Return a value of each beam by name: its own, or that of the mechanism where it has none."""
        usual = getattr(self, key)
        return {name: getattr(beam, key) or usual for name, beam in self.beams.items()}

    def list_thicknesses(self, beam: str) -> tuple[float, ...]:
        """Return the thicknesses that are stated along a beam, from its start to its end [m]."""
        thickness = self.beams[beam].thickness or self.thickness
        return tuple(value for _, value in thickness) if isinstance(thickness, tuple) else (thickness,)

    @property
    def legs(self) -> int:
        """Number of equal parts side by side."""
        return 1 if self.copies is None else self.copies.legs

    @property
    def layers(self) -> int:
        """Number of equal stages in series."""
        return 1 if self.copies is None else self.copies.layers

    @property
    def has_contacts(self) -> bool:
        """True if any contact is stated."""
        return bool(self.stops or self.obstacles or self.contacts)

    def ends_before_stops(self, travel: float | None) -> bool:
        """Return True if a motion of the driven node [m] surely ends before each stop: all are on it, along the drive.

        True without stops.
        """
        drive = self.drive
        return all(
            isinstance(drive, DisplacementDrive)
            and travel is not None
            and isinstance(stop, MotionStop)
            and (stop.node, stop.direction) == (drive.node, drive.direction)
            and (stop.gaps[1] or 0.0) > travel
            for stop in self.stops.values()
        )

    @property
    def thinnest(self) -> float:
        """Smallest thickness of all beams [m]."""
        return min(min(self.list_thicknesses(name)) for name in self.beams)

    @model_validator(mode="after")
    def _names_match(self) -> Self:
        refuse("Mechanism", dict(faults(self)))
        return self

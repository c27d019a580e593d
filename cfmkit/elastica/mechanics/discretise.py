"""A network under a drive as arrays of mixed spectral elements; everything is dimensionless.

Lengths are counted in the mean beam length L0, forces in F0 = EI / L0^2 with EI of the first beam, the drive in L0
(a displacement), rad (a rotation) or 1 (loads). Every node that no link moves is a body with three unknowns (x, y in
the frame of its support, and a rotation). An attachment is where an element's end, a spring or a load acts on a body,
by chance through a rigid arm, with a rotation of its own behind a pin. The ends of elements inside a beam are bodies,
too.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.contact_unknowns import ContactAt
from cfmkit.elastica.mechanics.element_cuts import (
    TAUT_RATIO,
    MovingCuts,
    find_cuts,
    find_moving_cuts,
    is_straight,
    join_cut_laws,
    turns_little,
)
from cfmkit.elastica.mechanics.element_tables import element_tables
from cfmkit.elastica.mechanics.units import MechanicsUnits
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.elastica.model.contact import BeamSide, Stop
from cfmkit.elastica.model.drive import Displacement, Loading
from cfmkit.elastica.model.driven_node import find_driven_node
from cfmkit.elastica.model.network import LineLoad, PointLoad, SlideSpring, TorsionSpring, apart
from cfmkit.elastica.model.plain_beams_at_once import is_plain
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network, Spring

FLOOR_UNDER_MOTION = 3e-12
"""1/EA [L^2/EI] of a straight beam that does not stretch: at rest nothing else determines the force along it."""
FLOOR_UNDER_LOADS = 1e-3 * FLOOR_UNDER_MOTION
"""The same where loads drive: they reach 1e3 times the force that a motion causes before it is noticed."""
FRAME_OF_DRIVE = 3
"""Frame of a node that is held nowhere in `driven`: that of the drive, along whose x it moves."""


class BeamElements(NamedTuple):
    """Elements at their q Gauss points; e elements of one degree."""

    angle: Any  # (e, q) of the axis at rest [rad]
    weight: Any  # (e, q) quadrature weight times ds
    rigidity: Any  # (e, q) EI / (ds/du)^2
    axial: Any  # (e, q) 1/EA
    shear: Any  # (e, q) 1/GA
    ahead: Any  # (e, q) arc length from the point to the element's end
    length: Any  # (e,)
    line: Any  # (e, 2, 2) line load: constant and growing with the drive; x, y
    gap: Any  # (e, 2) by which a prestressed beam misses its node at rest
    ends: Any  # (e, 2) attachments
    unknowns: Any  # (e, degree + 9) those of both ends (x, y, body's and own rotation), bubbles, force
    beam: tuple[str, ...]  # the beam each one is a piece of
    cuts: FloatArray  # (e, 2) where it begins and ends, parameter of the beam's shape
    rest: Any = None  # (e, q) curvature at rest by u; with curl and hindrance those of wide strips, None without any
    curl: Any = None  # (e, q) th^4/K^2 by u
    hindrance: Any = None  # (e, q) nu^2/(1 - nu^2), 0 unless it is wide
    laid: Any = None  # (..., e) which lie on an obstacle: their first force is the tension; None: none may
    moved_cuts: Any = None  # (..., e, 2) cuts with contacts at their places; None where no cut moves


class Attachments(NamedTuple):
    """Places where something acts on a body."""

    unknowns: Any  # (k, 4) x, y, rotation of the body that carries it; its own rotation
    arm: Any  # (k, 2) from the body's node, as it lies at rest
    origin: Any  # (k, 2) the body's node at rest
    frame: Any  # (k, 2) cos and sin of the axes of the body's x and y


class Attached(NamedTuple):
    """A spring or a load and where it acts."""

    item: Any
    places: tuple[int, ...]  # attachments
    grows: bool = False  # with the drive


class FlankPlace(NamedTuple):
    """A place at which the side of a beam may touch: an end of two elements that moves along the beam."""

    number: int  # of the contact in `Network.contacts`
    parameter: float  # of the beam's shape
    laid: int = 0  # -1 or 1: the side before or behind it, to the next contact or the end, lies on the obstacle


@dataclass(frozen=True, eq=False)
class Discretisation:
    """All arrays of a network under a drive, and the names behind its unknowns."""

    degree: int
    elements: BeamElements
    attachments: Attachments
    springs: tuple[Attached, ...]
    loads: tuple[Attached, ...]
    size: int  # unknowns, held ones included: motions, two forces an element, forces of contacts
    free: Any  # indices of those that are solved for
    base: Any  # (size,) values of the held ones
    rate: Any  # (size,) their change with the drive
    scales: MechanicsUnits
    bodies: Mapping[str, tuple[int, int, int]]  # unknowns of nodes that no link moves
    nodes: Mapping[str, int]  # attachment of every node
    fits: BeamFits
    floored: Any = ()  # (e,) elements of beams that do not stretch but for a floor
    pieces: int = 1  # elements for every smooth piece of a beam, at least
    tension: Mapping[str, float] | None = None  # beams that were cut for a large tension
    contacts: tuple[ContactAt, ...] = ()
    moving: MovingCuts | None = None  # None: no end of an element moves

    @cached_property
    def known(self) -> dict[Any, Any]:
        """Cache of objects made of these arrays, by their maker; it does not go to other processes."""
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Return what is sent to another process."""
        return {name: value for name, value in self.__dict__.items() if name != "known"}

    @property
    def axial(self) -> FloatArray:
        """1/EA of the elements, (e, q); with contacts at places of several states those of the first."""
        return np.asarray(self.elements.axial.reshape(-1, *self.elements.axial.shape[-2:])[0])

    @property
    def floor(self) -> FloatArray:
        """1/EA of the elements of beams that do not stretch, (e,): what is left of their floors."""
        return np.asarray(np.where(self.floored, self.axial[:, 0], 0.0))

    @property
    def cuts(self) -> dict[str, list[float]]:
        """Parameters between which the elements of each beam lie, ascending."""
        cuts = {name: [0.0] for name in self.fits}
        for name, (_, end) in zip(self.elements.beam, self.elements.cuts.tolist(), strict=True):
            cuts[name].append(end)
        return cuts

    @property
    def n_motions(self) -> int:
        """Number of unknowns that are motions; forces come behind them."""
        return int(self.elements.unknowns[:, -2:].min())


def discretise(
    network: Network,
    drive: Drive,
    degree: int = 10,
    pieces: int = 1,
    tension: Mapping[str, float] | None = None,
    scales: MechanicsUnits | None = None,
    fits: BeamFits | None = None,
    cuts: Mapping[str, list[float]] | None = None,
    flanks: Sequence[FlankPlace] = (),
) -> Discretisation:
    """Return the arrays of a network under a drive.

    Parameters
    ----------
    network, drive : Network, Drive
        They may hold complex steps: then the arrays do, with `scales` those of the network without them.
    degree : int
        Of the rotation on an element, at least 2.
    pieces : int
        Elements for every smooth piece of a beam, at least.
    tension : mapping, optional
        Beams under a large tension N to their L sqrt(N/EI).
    scales : MechanicsUnits, optional
        Units; found from the beams unless given.
    fits : BeamFits, optional
        Those of the same network, if it was set up before.
    cuts : mapping, optional
        Parameters between which the elements of each beam lie; found from degree, pieces and tension unless given.
    flanks : sequence of FlankPlace
        Places at which sides of beams may touch obstacles; of one beam in ascending order.

    Raises
    ------
    cfmkit.errors.InputError
        If the driven node cannot move along the drive, or beams with offsets hang at a node that is pinned to an arm.
    """
    fits = fits or BeamFits(network)
    return _ArrayBuilder(network, drive, degree, pieces, tension or {}, scales, fits).build(cuts, tuple(flanks))


class _ArrayBuilder:
    """Numbers unknowns and attachments and collects the elements."""

    def __init__(
        self, network: Network, drive: Drive, degree: int, pieces: int, tension: Mapping[str, float], scales: Any,
        fits: BeamFits,
    ) -> None:  # fmt: skip
        self.network, self.drive, self.degree, self.pieces, self.tension = network, drive, degree, pieces, tension
        self.count = 0
        self.places: list[tuple[Any, Any, Any, Any]] = []  # unknowns, arm, origin, angle of the frame
        self.fits, self.bundle = fits, fits.bundle
        self.scales = scales or self._scales()
        self.bodies = {name: self._body() for name in network.nodes if not network.is_moved_by_link(name)}
        self.driven = find_driven_node(network, drive)
        along = self.driven is not None and self.driven[1] == FRAME_OF_DRIVE
        self.turned = {drive.node: drive.direction} if along else {}  # type: ignore[union-attr]
        self.turns = {name: body[2] for name, body in self.bodies.items()}
        self.own = {name: self._own_place(name) for name in network.nodes}

    def build(
        self, given_cuts: Mapping[str, list[float]] | None, flanks: tuple[FlankPlace, ...] = ()
    ) -> Discretisation:
        """Return the arrays."""
        beams = self.network.beams
        touched: dict[str, list[float]] = {}
        for flank in flanks:
            touched.setdefault(self.network.contacts[flank.number].beam, []).append(flank.parameter)  # type: ignore[union-attr]
        laws = {name: find_moving_cuts(beams[name], self.fits[name], places) for name, places in touched.items()}
        cuts = given_cuts or {
            name: laws[name].evaluate(touched[name]) if name in laws else self._cuts(name, beam)
            for name, beam in beams.items()
        }
        tables = element_tables(self.fits, self.scales, self.degree, cuts)
        ends = np.array([pair for name, beam in beams.items() for pair in self._beam(beam, cuts[name], tables)])
        springs = tuple(Attached(spring, self._spring_places(spring)) for spring in self.network.springs)
        given = [(load, False) for load in self.network.loads] + [(load, True) for load in self.drive.loads]
        loads = tuple(
            Attached(load, (self._attach(load.node),), grows) for load, grows in given if isinstance(load, PointLoad)
        )
        nodes = {name: self._attach(name) for name in self.network.nodes}
        touching = [
            (number, self._attach(contact.node))
            for number, contact in enumerate(self.network.contacts)
            if not isinstance(contact, BeamSide)
        ]
        dofs, arms, origins, frames = zip(*self.places, strict=True)
        frame = np.array([(1.0, 0.0)] * len(frames)) if not any(frames) else _direction(np.array(frames))
        attachments = Attachments(np.array(dofs), np.array(arms), np.array(origins), frame)
        floors = np.array([self._floor(name, beam) for name, beam in beams.items()])
        each = np.array([len(own) - 1 for own in cuts.values()])
        elements, size = self._elements(cuts, tables, ends, attachments, np.repeat(floors, each))
        contacts = tuple(
            ContactAt(self.network.contacts[number], place, size + k, number)
            for k, (number, place) in enumerate(touching)
        )
        behind = size + len(contacts) + 3 * len(flanks)
        contacts, n_friction = _number_friction(contacts, behind)
        contacts += self._flank_contacts(flanks, elements, size + len(contacts))
        acting = [*springs, *loads, *(Attached(contact.item, (contact.place,)) for contact in contacts)]
        free, base, rate = self._constraints(size, elements, attachments, acting)
        if contacts:
            sides = [contact for contact in contacts if contact.slide >= 0]
            more = (
                [contact.unknown for contact in contacts]
                + [contact.slide for contact in sides]
                + [contact.flag for contact in sides]
                + list(range(behind, behind + n_friction))
            )
            size += len(more)
            free = np.append(free, more)
            base, rate = (np.append(values, np.zeros(len(more))) for values in (base, rate))
        return Discretisation(
            self.degree, elements, attachments, springs, loads, size, free, base, rate, self.scales,
            self.bodies, nodes, self.fits, np.repeat(floors > 0, each), self.pieces, self.tension, contacts,
            join_cut_laws(laws, elements.beam, _sides(contacts))
            if flanks
            else None,
        )  # fmt: skip

    def _flank_contacts(
        self, flanks: tuple[FlankPlace, ...], elements: BeamElements, first: int
    ) -> tuple[ContactAt, ...]:
        """Return the contacts of the sides of beams: their forces are numbered from `first` on, then their places."""
        found = []
        for k, flank in enumerate(flanks):
            item: Any = self.network.contacts[flank.number]
            own = [number for number, name in enumerate(elements.beam) if name == item.beam]
            element = min(own, key=lambda number: abs(elements.cuts[number, 1] - flank.parameter))
            place = int(elements.ends[element, 1])
            count = len(flanks)
            found.append(
                ContactAt(
                    item, place, first + k, flank.number, None, first + count + k, element, flank.laid,
                    first + 2 * count + k,
                )
            )  # fmt: skip
        return tuple(found)

    # -- bodies and attachments ------------------------------------------------------------------------------------
    def _scales(self) -> MechanicsUnits:
        lengths = [np.real(self.fits[name].length) for name in (self.bundle.names[k] for k in self.bundle.others)]
        lengths += np.real(self.bundle.length).tolist() if self.bundle.plain else []
        length = float(sum(lengths) / len(lengths))
        if self.bundle.plain[:1] == [0]:
            rigidity = float(np.real(self.bundle.rigidities[0][0]))
        else:
            section = next(iter(self.network.beams.values())).section
            rigidity = float(np.real(section.rigidities(np.array([0.5]), 0.5)[0][0]))
        return MechanicsUnits(length, rigidity / length**2, length if isinstance(self.drive, Displacement) else 1.0)

    def _number(self, more: int) -> int:
        self.count += more
        return self.count - more

    def _body(self) -> tuple[int, int, int]:
        first = self._number(3)
        return first, first + 1, first + 2

    def _own_place(self, name: str) -> tuple[Any, Any, Any, Any]:
        """Return unknowns, arm, origin and frame of a node.

        Its arm swings with its master's body, or with the pin between the two if that is where the master is.
        """
        master, carrier = self.network.master_of(name), self.network.body_of(name)
        node, at = self.network.nodes[name], self.network.nodes[master]
        turn, pinned = self._turn_of(carrier), carrier != master
        swing = turn if pinned and not apart(self.network, carrier) else self.bodies[master][2]
        frame, length = self.turned.get(master, at.support.direction), self.scales.length
        arm = ((node.x - at.x) / length, (node.y - at.y) / length)
        return (*self.bodies[master][:2], swing, turn), arm, (at.x / length, at.y / length), frame

    def _turn_of(self, carrier: str) -> int:
        if carrier not in self.turns:
            self.turns[carrier] = self._number(1)
        return self.turns[carrier]

    def _attach(self, name: str, offset: Any = (0.0, 0.0), pin: bool = False) -> int:
        """Return a new attachment at a node: with a rigid offset, behind a pin."""
        unknowns, arm, origin, frame = self.own[name]
        carrier = self.network.body_of(name)
        if carrier not in self.bodies and apart(self.network, carrier):
            node, body = self.network.nodes[name], self.network.nodes[carrier]
            if any(offset) or node.x != body.x or node.y != body.y:
                raise InputError(
                    f"{carrier!r} is pinned to a rigid arm: it cannot carry offsets or rigid links of its own"
                )
        if pin:
            unknowns = (*unknowns[:3], self._number(1))
        length = self.scales.length
        self.places.append((unknowns, (arm[0] + offset[0] / length, arm[1] + offset[1] / length), origin, frame))
        return len(self.places) - 1

    def _spring_places(self, spring: Spring) -> tuple[int, ...]:
        if isinstance(spring, SlideSpring):
            return (self._attach(spring.node),)
        return tuple(self._attach(name) for name in (spring.start, spring.end) if name is not None)

    # -- elements --------------------------------------------------------------------------------------------------
    def _cuts(self, name: str, beam: Beam) -> list[float]:
        """Return the parameters between which the elements of a beam lie."""
        tautness = self.tension.get(name, 0.0)
        whole = self.pieces == 1 and tautness <= TAUT_RATIO and turns_little(beam)
        return [0.0, 1.0] if whole and is_plain(beam) else find_cuts(beam, self.fits[name], self.pieces, tautness)

    def _beam(self, beam: Beam, cuts: list[float], tables: Mapping[str, Any]) -> list[tuple[int, int]]:
        """Return the attachments of the ends of a beam's elements; those inside the beam are bodies of their own."""
        start = self._attach(beam.start, beam.start_offset, beam.start_joint == "pin")
        end = self._attach(beam.end, beam.end_offset, beam.end_joint == "pin")
        inner, count = len(cuts) - 2, len(self.places)
        if inner:
            first = self._elements_before
            rows = slice(first, first + inner)
            chords = [(tables["weight"][rows] * turn(tables["angle"][rows])).sum(axis=1) for turn in (np.cos, np.sin)]
            _, arm, origin, _ = self.places[start]
            x, y = ((origin[k] + arm[k] + np.cumsum(chords[k])).tolist() for k in (0, 1))
            for place in zip(x, y, strict=True):
                body = self._body()
                self.places.append(((*body, body[2]), (0.0, 0.0), place, 0.0))
        self._elements_before += inner + 1
        marks = [start, *range(count, count + inner), end]
        return list(itertools.pairwise(marks))

    _elements_before = 0  # of the beams that are attached

    def _floor(self, name: str, beam: Beam) -> float:
        """Return 1/EA that a straight beam gets which does not stretch."""
        if beam.section.axial or not is_straight(beam, self.fits, name):
            return 0.0
        rigidity = np.real(beam.section.rigidities(np.array([0.5]), 0.5)[0][0])
        floor = FLOOR_UNDER_LOADS if isinstance(self.drive, Loading) else FLOOR_UNDER_MOTION
        return float(floor * self.scales.force * self.scales.length**2 / rigidity)

    def _elements(
        self, cuts: Mapping[str, list[float]], tables: dict[str, Any], ends: Any, attachments: Attachments, floors: Any
    ) -> tuple[BeamElements, int]:
        """Return the elements and the number of unknowns: bubbles and forces are numbered behind motions of ends."""
        count = len(ends)
        bubbles = self._number(count * (self.degree - 1)) + np.arange(count * (self.degree - 1)).reshape(count, -1)
        forces = self._number(2 * count) + np.arange(2 * count).reshape(count, 2)
        whole = attachments.unknowns
        unknowns = np.concatenate([whole[ends[:, 0]], whole[ends[:, 1]], bubbles, forces], axis=1)
        if floors.any():
            tables = tables | {"axial": tables["axial"] + floors[:, None]}
        beams = tuple(name for name, own in cuts.items() for _ in own[1:])
        elements = BeamElements(
            **tables, line=self._line_loads(beams), gap=np.zeros((count, 2)), ends=ends, unknowns=unknowns, beam=beams,
            cuts=np.array([pair for own in cuts.values() for pair in itertools.pairwise(own)]),
        )  # fmt: skip
        return elements._replace(gap=self._gaps(elements, attachments)), self.count

    def _line_loads(self, beams: tuple[str, ...]) -> Any:
        """Return the line loads of every element: constant and growing with the drive."""
        given = [(k, load) for k, loads in enumerate((self.network.loads, self.drive.loads)) for load in loads]
        lines = [(k, load) for k, load in given if isinstance(load, LineLoad)]
        kind = np.result_type(float, *(value for _, load in lines for value in (load.wx, load.wy)))
        total = np.zeros((len(beams), 2, 2), kind)
        unit = self.scales.length / self.scales.force
        for grows, load in lines:
            own = [name == load.beam for name in beams]
            total[own, grows] += np.array([load.wx, load.wy]) * unit * (self.scales.drive if grows else 1.0)
        return total

    def _gaps(self, elements: BeamElements, attachments: Attachments) -> Any:
        """Return by how much the last element of each beam that is forced into place misses its node."""
        raw = [self.network.beams[name].closure == "raw" for name in elements.beam]
        if not any(raw):
            return elements.gap
        place = attachments.origin + attachments.arm
        span = place[elements.ends[:, 1]] - place[elements.ends[:, 0]]
        reach = [(elements.weight * turn(elements.angle)).sum(axis=1) for turn in (np.cos, np.sin)]
        last = np.array(raw) & (elements.cuts[:, 1] == 1.0)
        return np.where(last[:, None], span - np.stack(reach, axis=1), 0.0)

    # -- what is held ----------------------------------------------------------------------------------------------
    def _constraints(
        self, size: int, elements: BeamElements, attachments: Attachments, acting: list[Attached]
    ) -> tuple[Any, Any, Any]:
        """Return the free unknowns, the values of held ones and their change with the drive."""
        displaced = [value for node in self.network.nodes.values() for value in node.support.displacement]
        held, base, rate = (
            np.zeros(size, bool),
            np.zeros(size, np.result_type(float, np.asarray(displaced))),
            np.zeros(size),
        )
        for name, body in self.bodies.items():
            support = self.network.nodes[name].support
            flags = support.along, support.across, support.rotation
            for flag, unknown, value in zip(flags, body, support.displacement, strict=True):
                if flag:
                    held[unknown] = True
                    base[unknown] = value / (1.0 if unknown == body[2] else self.scales.length)
        held |= ~_used(size, elements, attachments, acting)
        if self.driven is not None:
            node, local, sense = self.driven
            unknown = self.bodies[node][local % FRAME_OF_DRIVE]
            held[unknown], rate[unknown], base[unknown] = True, sense, 0.0
        return np.flatnonzero(~held), base, rate


def _number_friction(contacts: tuple[ContactAt, ...], first: int) -> tuple[tuple[ContactAt, ...], int]:
    """Return contacts with the unknowns of their friction, numbered from `first` on, and how many these are."""
    numbered, count = list[ContactAt](), 0
    for contact in contacts:
        if contact.item.friction:
            own = first + count
            contact = contact._replace(rub=own, flag=own + 1, anchor=own + 2)
            count += 3
        numbered.append(contact)
    return tuple(numbered), count


def _sides(contacts: tuple[ContactAt, ...]) -> list[tuple[str, int]]:
    """Return beam and unknown place of each contact of a side."""
    sides: Any = [contact for contact in contacts if contact.slide >= 0]
    return [(contact.item.beam, contact.slide) for contact in sides]


def _direction(angle: Any) -> Any:
    """Return cosine and sine in a last axis."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _used(size: int, elements: BeamElements, attachments: Attachments, acting: list[Attached]) -> Any:
    """Return which unknowns anything acts on: a rotation that nothing resists or turns is none of them."""
    used = np.zeros(size, bool)
    used[elements.unknowns[:, [0, 1, 3, 4, 5, *range(7, elements.unknowns.shape[1])]]] = True
    arms = np.abs(attachments.arm).max(axis=1) > 0
    used[elements.unknowns[:, [2, 6]][arms[elements.ends]]] = True
    for item, places, _ in acting:
        for unknowns, has_arm in zip(attachments.unknowns[list(places)], arms[list(places)], strict=True):
            if isinstance(item, TorsionSpring):
                used[unknowns[3]] = True
                continue
            if isinstance(item, Stop) and item.turns:  # alone it holds no rotation
                continue
            used[unknowns[:2]] = True
            used[unknowns[2]] |= has_arm
            used[unknowns[3]] |= isinstance(item, PointLoad) and (item.follows or item.moment != 0)
    return used

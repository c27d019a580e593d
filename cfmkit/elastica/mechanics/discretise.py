"""A network under a drive as arrays of mixed spectral elements (`Discretisation`); the same with a higher degree.

Lengths are counted in the mean beam length L0, forces in F0 = EI / L0^2 with EI of the first beam, the drive in L0 (a
displacement), rad (a rotation) or 1 (loads). Every node that no link moves is a body with three unknowns (x, y in the
frame of its support, and a rotation). An attachment is where an element's end, a spring or a load acts on a body, by
chance through a rigid arm, with a rotation of its own behind a pin. The ends of elements inside a beam are bodies, too.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.elements import (
    CutLaw,
    MechanicsUnits,
    MovingCuts,
    element_tables,
    find_cuts,
    find_moving_cuts,
    is_straight,
    join_cut_laws,
)
from cfmkit.elastica.mechanics.network_arrays import fill_arrays, join_held
from cfmkit.elastica.mechanics.numbering import Numbering, Topology, find_free, number
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.elastica.model.contact import BeamSide, Stop
from cfmkit.elastica.model.drive import FRAME_OF_DRIVE, Displacement, Loading, find_driven_node
from cfmkit.elastica.model.network import PointLoad, TorsionSpring, apart, spring_ends, swings_with_master
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.contact import Contact, FrictionState
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

FLOOR_UNDER_MOTION = 3e-12
"""1/EA [L^2/EI] of a straight beam that does not stretch: at rest nothing else determines the force along it."""
FLOOR_UNDER_LOADS = 1e-3 * FLOOR_UNDER_MOTION
"""The same where loads drive: they reach 1e3 times the force that a motion causes before it is noticed."""


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


class ContactAt(NamedTuple):
    """A contact, where it acts, and the unknown that is its force; of the side of a beam also its place."""

    item: Contact
    place: int  # attachment
    unknown: int
    number: int  # in `Network.contacts`
    closed: bool | None = None  # None: as force and gap say
    slide: int = -1  # unknown that is the parameter of the beam's shape at which it touches; -1: a node touches
    element: int = -1  # that ends there
    laid: int = 0  # -1 or 1: the element before or behind it lies on the obstacle
    # unknown that says the same of a state; of a node with friction: 0 where it sticks, the sense in which it slips
    flag: int = -1
    rub: int = -1  # unknown that is the tangential force; -1: there is no friction
    anchor: int = -1  # unknown that is the place along the obstacle at which it sticks
    friction: FrictionState | None = None  # None: as the state's flag says

    @property
    def own_unknowns(self) -> tuple[int, ...]:
        """Unknowns of the contact of a node: its force, then with friction tangential force, flag and anchor."""
        return (self.unknown,) if self.rub < 0 else (self.unknown, self.rub, self.flag, self.anchor)


UNKNOWNS_OF_CONTACTS = ("unknown", "slide", "flag", "rub", "anchor")


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
    numbering: Numbering
    fits: BeamFits
    floored: Any = ()  # (e,) elements of beams that do not stretch but for a floor
    pieces: int = 1  # elements for every smooth piece of a beam, at least
    tension: Mapping[str, float] | None = None  # beams that were cut for a large tension
    contacts: tuple[ContactAt, ...] = ()
    moving: MovingCuts | None = None  # None: no end of an element moves

    @cached_property
    def cache(self) -> dict[Any, Any]:
        """Objects made of these arrays, by their maker; they do not go to other processes."""
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Return what is sent to another process."""
        return {name: value for name, value in self.__dict__.items() if name != "cache"}

    @property
    def bodies(self) -> Mapping[str, tuple[int, int, int]]:
        """Unknowns of nodes that no link moves."""
        return self.numbering.bodies

    @property
    def nodes(self) -> Mapping[str, int]:
        """Attachment of every node."""
        return self.numbering.nodes

    @property
    def acting(self) -> tuple[Attached | ContactAt, ...]:
        """Springs, loads and contacts: all that acts on attachments."""
        return (*self.springs, *self.loads, *self.contacts)

    @property
    def node_contacts(self) -> list[ContactAt]:
        """Contacts of nodes."""
        return [contact for contact in self.contacts if contact.slide < 0]

    @property
    def side_contacts(self) -> list[ContactAt]:
        """Contacts of sides of beams."""
        return [contact for contact in self.contacts if contact.slide >= 0]

    @property
    def axial(self) -> FloatArray:
        """1/EA of the elements, (e, q); with contacts at places of several states those of the first."""
        return np.asarray(self.elements.axial.reshape(-1, *self.elements.axial.shape[-2:])[0])

    @property
    def floor(self) -> FloatArray:
        """1/EA of the elements of beams that do not stretch, (e,): what is left of their floors."""
        return np.asarray(np.where(self.floored, self.axial[:, 0], 0.0))

    @property
    def n_motions(self) -> int:
        """Number of unknowns that are motions; forces come behind them."""
        return self.numbering.n_motions


def discretise(
    # network, drive: they may hold complex steps: then the arrays do, with `scales` those of the network without them
    network: Network,
    drive: Drive,
    degree: int = 10,  # of the rotation on an element, at least 2
    pieces: int = 1,  # elements for every smooth piece of a beam, at least
    tension: Mapping[str, float] | None = None,  # beams under a large tension N to their L sqrt(N/EI)
    scales: MechanicsUnits | None = None,  # units; found from the beams unless given
    fits: BeamFits | None = None,  # those of the same network, if it was set up before
    # places at which sides of beams may touch obstacles; of one beam in ascending order
    flanks: Sequence[FlankPlace] = (),
) -> Discretisation:
    """Return the arrays of a network under a drive.

    Raises InputError if the driven node cannot move along the drive, or beams with offsets hang at a node that is
    pinned to an arm.
    """
    fits, tension = fits or BeamFits(network), tension or {}
    scales, driven = scales or _find_units(network, drive, fits), find_driven_node(network, drive)
    _check_arms(network)
    cuts, laws = _cut_beams(network, fits, pieces, tension, flanks)
    point_loads = [
        (load, grows)
        for grows, group in enumerate((network.loads, drive.loads))
        for load in group
        if isinstance(load, PointLoad)
    ]
    numbering = number(_find_topology(network, degree, cuts, [load for load, _ in point_loads]))
    acting = iter(numbering.acting)
    springs = tuple(Attached(spring, next(acting)) for spring in network.springs)
    loads = tuple(Attached(load, next(acting), bool(grows)) for load, grows in point_loads)
    places = np.array([pair for ends in cuts.values() for pair in itertools.pairwise(ends)])
    arrays = fill_arrays(numbering, scales, places, [(network, drive)], [fits], driven)
    attachments = Attachments(numbering.places, **{name: at[0] for name, at in arrays.places.items()})
    floors = np.array([_find_floor(beam, drive, scales, fits, name) for name, beam in network.beams.items()])
    floors = floors[numbering.row]
    tables = {name: table[0] for name, table in arrays.tables.items()}
    if np.count_nonzero(floors):
        tables["axial"] = tables["axial"] + floors[:, None]
    names = tuple(map(list(network.beams).__getitem__, numbering.row.tolist()))
    elements = BeamElements(**tables, ends=numbering.ends, unknowns=numbering.unknowns, beam=names, cuts=places)
    contacts, size = _number_contacts(network, numbering, flanks, elements)
    rate, held = np.zeros(size), arrays.held[0]
    if driven is not None:
        rate[numbering.bodies[driven.node][driven.motion % FRAME_OF_DRIVE]] = driven.sense
    arms = ((attachments.arm[:, 0] != 0) | (attachments.arm[:, 1] != 0)).tobytes()
    acts = [(attached.places, *_find_actions(attached.item)) for attached in (*springs, *loads)]
    acts += [((contact.place,), *_find_actions(contact.item)) for contact in contacts]
    free = find_free(numbering, tuple(held), arms, tuple(acts))
    if contacts:
        free = np.append(free, np.arange(numbering.size, size))
    sides = [(contact.item.beam, contact.slide) for contact in contacts if contact.slide >= 0]  # type: ignore[union-attr]
    return Discretisation(
        degree, elements, attachments, springs, loads, size, free, join_held([held], size)[0], rate, scales,
        numbering, fits, floors > 0, pieces, tension, contacts, join_cut_laws(laws, names, sides) if flanks else None,
    )  # fmt: skip


def _cut_beams(
    network: Network, fits: BeamFits, pieces: int, tension: Mapping[str, float], flanks: Sequence[FlankPlace]
) -> tuple[dict[str, list[float]], dict[str, CutLaw]]:
    """Return where the elements of each beam begin and end, and how these places move with contacts on their sides."""
    touched: dict[str, list[float]] = {}
    for flank in flanks:
        touched.setdefault(network.contacts[flank.number].beam, []).append(flank.parameter)  # type: ignore[union-attr]
    laws = {name: find_moving_cuts(network.beams[name], fits[name], places) for name, places in touched.items()}
    cuts = {
        name: laws[name].evaluate(touched[name]) if name in laws else find_cuts(beam, fits, name, pieces, tension)
        for name, beam in network.beams.items()
    }
    return cuts, laws


def _find_units(network: Network, drive: Drive, fits: BeamFits) -> MechanicsUnits:
    """Return the mean beam length, EI of the first beam over its square, and the unit of the drive."""
    bundle = fits.bundle
    lengths = [np.real(fits[bundle.names[k]].length) for k in bundle.others]
    lengths += bundle.length[fits.number].real.tolist() if bundle.plain else []
    length = float(sum(lengths) / len(lengths))
    if bundle.plain[:1] == [0]:
        rigidity = float(bundle.rigidities[0, fits.number, 0].real)
    else:
        rigidity = _find_rigidity(next(iter(network.beams.values())))
    return MechanicsUnits(length, rigidity / length**2, length if isinstance(drive, Displacement) else 1.0)


def _find_rigidity(beam: Beam) -> float:
    """Return the bending rigidity of a beam in its middle [N m2]."""
    return float(np.real(beam.section.rigidities(np.array([0.5]), 0.5)[0][0]))


def _find_floor(beam: Beam, drive: Drive, scales: MechanicsUnits, fits: BeamFits, name: str) -> float:
    """Return 1/EA that a straight beam gets which does not stretch."""
    if beam.section.axial or not is_straight(beam, fits, name):
        return 0.0
    return find_straight_floor(drive) * scales.force * scales.length**2 / _find_rigidity(beam)


def find_straight_floor(drive: Drive) -> float:
    """Return 1/EA [L^2/EI] that a straight beam gets under a drive if it does not stretch."""
    return FLOOR_UNDER_LOADS if isinstance(drive, Loading) else FLOOR_UNDER_MOTION


def _find_topology(network: Network, degree: int, cuts: Mapping[str, list[float]], loads: list[PointLoad]) -> Topology:
    """Return what the numbers of unknowns and attachments depend on."""
    beams = zip(network.beams.values(), cuts.values(), strict=True)
    return Topology(
        degree,
        tuple(network.nodes),
        network.links,
        tuple(link.node for link in network.links if swings_with_master(network, link.node)),
        tuple((b.start, b.end, b.start_joint == "pin", b.end_joint == "pin", len(ends) - 1) for b, ends in beams),
        tuple(tuple(spring_ends(spring)) for spring in network.springs) + tuple((load.node,) for load in loads),
        tuple(contact.node for contact in network.contacts if not isinstance(contact, BeamSide)),
    )


def _check_arms(network: Network) -> None:
    """Refuse what hangs at a distance from a node that is pinned to a rigid arm."""
    for link in network.links:
        carrier, node = network.body_of(link.node), network.nodes[link.node]
        if not network.is_moved_by_link(carrier) or not apart(network, carrier):
            continue
        ends = [((b.start, b.start_offset), (b.end, b.end_offset)) for b in network.beams.values()]
        offsets = [offset for pair in ends for name, offset in pair if name == link.node]
        if np.any(offsets) or node.x != network.nodes[carrier].x or node.y != network.nodes[carrier].y:
            raise InputError(f"{carrier!r} is pinned to a rigid arm: it cannot carry offsets or rigid links of its own")


def _number_contacts(
    network: Network, numbering: Numbering, flanks: Sequence[FlankPlace], elements: BeamElements
) -> tuple[tuple[ContactAt, ...], int]:
    """Return the contacts, those of nodes first, and the number of all unknowns: those of contacts are the last.

    They are all forces, then places and flags of sides of beams, then three of every node with friction.
    """
    contacts, count = list[ContactAt](), len(flanks)
    touching = [(k, contact) for k, contact in enumerate(network.contacts) if not isinstance(contact, BeamSide)]
    first = numbering.size + len(touching)
    size = first + 3 * count
    for unknown, (k, contact), place in zip(itertools.count(numbering.size), touching, numbering.touching):
        at = ContactAt(contact, place, unknown, k)
        if contact.friction:
            at, size = at._replace(rub=size, flag=size + 1, anchor=size + 2), size + 3
        contacts.append(at)
    for unknown, flank in enumerate(flanks, start=first):
        item: Any = network.contacts[flank.number]
        on_beam = [element for element, name in enumerate(elements.beam) if name == item.beam]
        ending = elements.cuts[on_beam, 1] - flank.parameter
        element = on_beam[int(np.abs(ending).argmin())]
        place = int(elements.ends[element, 1])
        contacts.append(
            ContactAt(
                item, place, unknown, flank.number, None, unknown + count, element, flank.laid, unknown + 2 * count
            )
        )
    return tuple(contacts), size


def _find_actions(item: Any) -> tuple[bool, bool]:
    """Return whether a spring, load or contact acts on the place of an attachment, and whether on its rotation."""
    if isinstance(item, TorsionSpring):
        return False, True
    if isinstance(item, Stop) and item.turns:  # alone it holds no rotation
        return False, False
    return True, isinstance(item, PointLoad) and bool(item.follows or item.moment != 0)


def raise_degree(mesh: Discretisation, degree: int) -> Discretisation:
    """Return a network with the same elements and a higher degree of their rotations, and with its floors."""
    if degree == mesh.degree:
        return mesh
    e = mesh.elements
    many = element_tables([mesh.fits], mesh.scales, degree, mesh.numbering.row, e.cuts)
    tables = {name: table[0] for name, table in many.items()}
    if np.any(mesh.floored):
        tables["axial"] = tables["axial"] + mesh.floor[:, None]
    coarse = mesh.numbering
    numbering = number(coarse.topology._replace(degree=degree))
    ends, ahead = coarse.n_ends, numbering.size - coarse.size
    size = mesh.size + ahead
    contacts = tuple(
        contact._replace(
            **{name: value + ahead for name in UNKNOWNS_OF_CONTACTS if (value := getattr(contact, name)) >= 0}
        )
        for contact in mesh.contacts
    )
    moving = mesh.moving
    if moving is not None:
        moving = moving._replace(places=[place + ahead for place in moving.places])
    free = np.concatenate([mesh.free[mesh.free < ends], np.arange(ends, size)])
    base, rate = np.zeros(size, mesh.base.dtype), np.zeros(size)
    base[:ends], rate[:ends] = mesh.base[:ends], mesh.rate[:ends]
    elements = e._replace(**tables, unknowns=numbering.unknowns, moved_cuts=None)
    return replace(
        mesh, degree=degree, elements=elements, numbering=numbering, size=size, free=free, base=base, rate=rate,
        contacts=contacts, moving=moving,
    )  # fmt: skip


def refine_state(mesh: Discretisation, fine: Discretisation, z: Any) -> Any:
    """Return a state (..., size) in the unknowns of the same network with a higher degree: shapes are hierarchical."""
    ends, old, new = mesh.numbering.n_ends, mesh.elements.unknowns, fine.elements.unknowns
    raised = np.zeros((*z.shape[:-1], fine.size), z.dtype)
    raised[..., :ends] = z[..., :ends]
    raised[..., new[:, 8 : mesh.degree + 7]] = z[..., old[:, 8 : mesh.degree + 7]]
    raised[..., new[:, -2:]] = z[..., old[:, -2:]]
    behind = mesh.size - mesh.numbering.size
    if behind:
        raised[..., -behind:] = z[..., -behind:]
    return raised


def make_inextensible(mesh: Discretisation, elements: Any) -> Discretisation:
    """Return the same arrays with elements that do not stretch at all."""
    axial, floored = mesh.elements.axial.copy(), mesh.floored.copy()
    axial[elements], floored[elements] = 0.0, False
    stiff = replace(mesh, elements=mesh.elements._replace(axial=axial), floored=floored)
    return stiff if mesh.moving is not None else keep_equations(mesh, stiff)


def keep_equations(mesh: Discretisation, changed: Discretisation) -> Discretisation:
    """Return arrays that differ in closed contacts and stretching alone, with equations made from those of a mesh."""
    equations = ((key, made) for key, made in mesh.cache.items() if hasattr(made, "exchange"))
    exchanged = ((key, made.exchange(changed)) for key, made in equations)
    changed.cache.update((key, made) for key, made in exchanged if made is not None)
    return changed

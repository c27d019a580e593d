"""One piece of a path with contact, whose set of closed contacts stays the same, and where that set changes.

Between two points of the piece gaps and forces are looked at along the cubic through them, so densely that no obstacle
is passed. Where one becomes negative, the change is solved for: gap and force of that contact are both zero there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.carried_states import carry
from cfmkit.elastica.contact.equations import NO_FRICTION, with_closed
from cfmkit.elastica.contact.line_tangent import raise_pad
from cfmkit.elastica.contact.side_conditions import SideConditions
from cfmkit.elastica.contact.side_gaps import LoadStage
from cfmkit.elastica.contact.terms import gaps, measure, rub_values, slip_way
from cfmkit.elastica.mechanics.discretise import FlankPlace
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.elastica.model.contact import BeamOnBeam, NodeOnBeam, NodeOnObstacle, describe
from cfmkit.numerics.continuation.follow import LOCKED_FORCE, LOCKED_STEP

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.contact_unknowns import ContactAt
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.contact import FrictionState
    from cfmkit.numerics.continuation.path import MarchedSteps, Options, PathEvent, Walk
    from cfmkit.numerics.continuation.problem import PathEquilibrium

GAP_ROUNDING, FORCE_ROUNDING = 1e-11, 1e-10
"""Gap, in mean beam lengths, and force, as a share of the largest and of one, that may be negative by rounding."""
SLIP_ROUNDING = 1e-13  # way of slip in one sample, in mean beam lengths, by which it may go back by rounding
FEWEST_SAMPLES = 16  # of a step between whose ends a gap may close and open again
SAMPLES_PER_RADIUS = 6.0  # of the smallest radius that a pad may pass
MAX_SLOPE_STEPS = 3.0  # times a step's motion that its slopes may promise, for a cubic to tell what is between
SIDES_TOGETHER, NODES_TOGETHER = 6, 40  # states of a march, between which it is seen at once whether a contact changes


@dataclass(frozen=True, eq=False)
class PieceOfPath:
    """The problem with one set of closed contacts, beside the problem of all, whose unknowns points have."""

    whole: NetworkProblem
    closed: frozenset[int]
    options: Options
    friction: Mapping[int, FrictionState] = field(default_factory=dict)  # of closed contacts that rub
    siblings: dict[frozenset[int], PieceOfPath] = field(default_factory=dict)  # of the same arrays, by what is closed
    seen_between: dict[tuple[float, float], FloatArray] = field(init=False, default_factory=dict)  # values by drives

    @cached_property
    def own(self) -> WatchedProblem:
        """The problem whose contacts neither begin nor end."""
        assert self.whole.equations is not None  # from which those of the piece are made
        mesh = with_closed(self.whole.mesh, self.closed, self.friction)
        return WatchedProblem(mesh, self.whole.ramp, self.whole.next_correction, piece=self)

    @cached_property
    def sides(self) -> SideConditions:
        """Conditions on the sides of beams."""
        return SideConditions(self.whole.mesh, self.closed)

    @property
    def flanks(self) -> tuple[FlankPlace, ...]:
        """Places at which sides touch."""
        cuts = self.whole.mesh.elements.cuts
        return tuple(
            FlankPlace(contact.number, float(cuts[contact.element, 1]), contact.laid)
            for contact in self.whole.mesh.contacts
            if contact.slide >= 0
        )

    def sides_of(self, beam: str) -> list[int]:
        """Return the numbers in the arrays of the contacts of the side of a beam, in order along it."""
        sides: Any = [(k, contact) for k, contact in enumerate(self.whole.mesh.contacts) if contact.slide >= 0]
        return [k for k, contact in sides if contact.item.beam == beam]

    def with_flanks(self, flanks: Sequence[FlankPlace], closed: frozenset[int]) -> PieceOfPath:
        """Return the problem in which sides touch at other places, and nodes as said."""
        assert self.whole.remesh is not None
        network = self.whole.mesh.fits.network
        beams = list(network.beams)

        def place(flank: FlankPlace) -> tuple[int, float]:
            item: Any = network.contacts[flank.number]
            return beams.index(item.beam), flank.parameter

        order = sorted(flanks, key=place)
        mesh = self.whole.remesh(tuple(order))
        sides = [k for k, contact in enumerate(mesh.contacts) if contact.slide >= 0]
        nodes = [k for k in closed if self.whole.mesh.contacts[k].slide < 0]
        return PieceOfPath(replace(self.whole, mesh=mesh), frozenset([*nodes, *sides]), self.options)

    def carry(self, at: PathEquilibrium, beyond: PieceOfPath) -> PathEquilibrium:
        """Return an equilibrium in the unknowns of another piece, but for forces and places of sides."""
        z, old, new = self.whole.values(at.x, at.drive), self.whole.mesh, beyond.whole.mesh
        moved = carry(old, z[None], LoadStage.from_problem(self.whole, np.array([at.drive])), new)[0]
        kept = {(contact.number, k): contact for k, contact in self._enumerate_contacts(old)}
        for k, contact in self._enumerate_contacts(new):
            same = kept.get((contact.number, k))
            if same is not None and contact.slide >= 0:
                moved[contact.unknown] = z[same.unknown]
        return at._replace(x=moved[new.free], rate=np.zeros(len(new.free)))

    @staticmethod
    def _enumerate_contacts(mesh: Discretisation) -> Iterator[tuple[int, ContactAt]]:
        """Yield each contact with its place among those of the same item."""
        seen: dict[int, int] = {}
        for contact in mesh.contacts:
            seen[contact.number] = seen.get(contact.number, -1) + 1
            yield seen[contact.number], contact

    def with_closed(self, closed: frozenset[int]) -> PieceOfPath:
        """Return the problem with another set of closed contacts; what friction does at a new one is left open."""
        friction = {number: state for number, state in self.friction.items() if number in closed}
        if friction:
            return PieceOfPath(self.whole, closed, self.options, friction, self.siblings)
        if not self.friction:
            self.siblings.setdefault(self.closed, self)
        if closed not in self.siblings:
            self.siblings[closed] = PieceOfPath(self.whole, closed, self.options, siblings=self.siblings)
        return self.siblings[closed]

    def say(self, number: int) -> str:
        """Return what the contact of a row of `values` is called."""
        count = len(self.whole.mesh.contacts)
        if number >= count + len(self.sides.all):
            number = self.rubbing[number - count - len(self.sides.all)]
        return describe(
            self.whole.mesh.contacts[number].item if number < count else self.sides.all[number - count].item
        )

    def say_all(self, number: int) -> str:
        """Return what a contact and those that are closed with it are called, where they block the drive together."""
        others = [self.say(index) for index in sorted(self.closed - {number})]
        return " with ".join([self.say(number), *others[:2]])

    def say_rubbing(self) -> str:
        """Return what the closed contacts with friction are called."""
        contacts = self.whole.mesh.contacts
        return ", ".join(describe(contacts[k].item) for k in sorted(self.closed) if contacts[k].rub >= 0)

    # -- unknowns ------------------------------------------------------------------------------------------------------
    @cached_property
    def own_mask(self) -> Any:
        """Which free unknowns of the whole are those of the own problem."""
        mask = np.zeros(len(self.whole.mesh.free), bool)
        mask[np.searchsorted(self.whole.mesh.free, self.own.mesh.free)] = True
        return mask

    def shrink(self, at: PathEquilibrium) -> PathEquilibrium:
        """Return an equilibrium without the forces of open contacts."""
        return at._replace(x=at.x[self.own_mask], rate=at.rate[self.own_mask])

    @cached_property
    def _kept(self) -> FloatArray:
        """Free unknowns of the whole that say what friction does, (n,); the others are zero."""
        kept = np.zeros(len(self.own_mask))
        for number, state in self.friction.items():
            contact = self.whole.mesh.contacts[number]
            kept[np.searchsorted(self.whole.mesh.free, [contact.flag, contact.anchor])] = state
        return kept

    def expand_state(self, values: FloatArray) -> FloatArray:
        """Return a state of the own unknowns among those of all."""
        return np.asarray(self.expand(values) + self._kept if self.friction else self.expand(values))

    def expand(self, values: Any) -> Any:
        """Return values of the own unknowns among those of all, zero for the others."""
        spread_values = np.zeros((len(self.own_mask), *np.shape(values)[1:]))
        spread_values[self.own_mask] = values
        return spread_values

    def grow(self, at: PathEquilibrium) -> PathEquilibrium:
        """Return an equilibrium with the forces of all contacts."""
        return at._replace(x=self.expand_state(at.x), rate=self.expand(at.rate))

    def grow_event(self, event: PathEvent) -> PathEvent:
        """Return an event whose equilibria have the forces of all contacts."""
        within = None if event.within is None else (self.grow(event.within[0]), self.grow(event.within[1]))
        start = None if event.near is None else self.grow(event.near)
        modes = None if event.modes is None else self.expand(event.modes)
        return replace(event, near=start, modes=modes, within=within)

    def is_locked(self, before: PathEquilibrium, at: PathEquilibrium) -> bool:
        """Return True if forces are as large as where a structure locks, between two points that nearly coincide."""
        forces = (np.abs(at.x) / self.whole.unit)[~self.whole.motions]
        start = abs(at.drive - before.drive) <= LOCKED_STEP * self.options.span
        return bool(start and forces.max(initial=0.0) > LOCKED_FORCE)

    # -- gaps and forces -----------------------------------------------------------------------------------------------
    def values(self, x: FloatArray, drives: FloatArray) -> FloatArray:
        """Return the forces of closed and the gaps of open contacts in states (n, free), (contacts, n).

        Behind them come the values of the conditions on sides of beams.
        """
        mesh, way = self.whole.mesh, drives[:, None]
        z = np.asarray(way * mesh.base if self.whole.ramp else mesh.base + way * mesh.rate)
        z[:, mesh.free] = x
        count = len(mesh.contacts) + len(self.sides.all)
        spread_values = np.empty((count + len(self.rubbing), len(z)))
        measured = self.whole.equations.measure_nodes(z)
        for number, contact in enumerate(mesh.contacts):
            if number in self.closed:
                spread_values[number] = z[:, contact.unknown]
            else:
                spread_values[number] = gaps(mesh, contact, z) if measured is None else measured[number]
                spread_values[number] += raise_pad(mesh, contact, z)
        spread_values[len(mesh.contacts) : count] = self.sides.values(z, LoadStage.from_problem(self.whole, drives))
        for row, number in enumerate(self.rubbing, count):
            spread_values[row] = rub_values(mesh, mesh.contacts[number], self.friction[number], z)
        return spread_values

    @cached_property
    def rubbing(self) -> tuple[int, ...]:
        """Closed contacts with friction."""
        return tuple(number for number, state in sorted(self.friction.items()) if state.sense != NO_FRICTION.sense)

    @cached_property
    def slipping_rows(self) -> dict[int, int]:
        """Rows of `values` that are ways of slip, which must grow, with their contacts."""
        first = len(self.whole.mesh.contacts) + len(self.sides.all)
        return {first + k: number for k, number in enumerate(self.rubbing) if self.friction[number].sense}

    def slip_rate(self, at: PathEquilibrium, number: int) -> float:
        """Return how far a contact slips in its sense by the drive, at an equilibrium."""
        mesh = self.whole.mesh
        way = slip_way(mesh, mesh.contacts[number], self.whole.values(at.x, at.drive))
        moved = self.moved_by_drive(at)
        return float(self.friction[number].sense * (way.gradient @ moved[way.unknowns]))

    def moved_by_drive(self, at: PathEquilibrium) -> FloatArray:
        """Return the change of all unknowns by the drive at an equilibrium, (size,)."""
        mesh = self.whole.mesh
        moved = np.array(mesh.base if self.whole.ramp else mesh.rate, float)
        moved[mesh.free] = at.rate
        return moved

    def row_value(self, at: PathEquilibrium, number: int, travel: float = 1.0) -> float:
        """Return one row of `values` at an equilibrium: of a way of slip how much it grows in the sense of travel."""
        mesh, drives = self.whole.mesh, np.array([at.drive])
        z = self.whole.values(at.x, at.drive)[None]
        if number in self.slipping_rows:
            return travel * self.slip_rate(at, self.slipping_rows[number])
        first = len(mesh.contacts) + len(self.sides.all)
        if number >= first:
            rubs = self.rubbing[number - first]
            return float(rub_values(mesh, mesh.contacts[rubs], self.friction[rubs], z)[0])
        if number >= len(mesh.contacts):
            condition = self.sides.all[number - len(mesh.contacts)]
            return float(self.sides.value(condition, z, LoadStage.from_problem(self.whole, drives))[0])
        contact = mesh.contacts[number]
        open_gap = gaps(mesh, contact, z) + raise_pad(mesh, contact, z)
        return float(z[0, contact.unknown] if number in self.closed else open_gap[0])

    def roundings(self, values: FloatArray) -> FloatArray:
        """Return by how much a force or a gap (contacts, ..., shares) may be negative, (contacts, ...)."""
        closed = list(self.closed)
        largest = np.abs(values[closed]).max(axis=(0, -1), initial=1.0)
        shape = -1, *(1,) * (values.ndim - 2)
        spread_values = np.full(values.shape[:-1], GAP_ROUNDING)
        spread_values[closed] = FORCE_ROUNDING * largest
        count = len(self.whole.mesh.contacts)
        spread_values[count : count + len(self.sides.all)] = self.sides.roundings.reshape(shape)
        for row in range(count + len(self.sides.all), len(values)):
            spread_values[row] = SLIP_ROUNDING if row in self.slipping_rows else FORCE_ROUNDING * largest
        return spread_values

    def roundings_of_force(self, at: PathEquilibrium) -> float:
        """Return which force of a contact is rounding at an equilibrium."""
        z = self.whole.values(at.x, at.drive)
        return FORCE_ROUNDING * max(1.0, *(abs(float(z[contact.unknown])) for contact in self.whole.mesh.contacts))

    def are_quiet(self, states: Sequence[PathEquilibrium]) -> Any:
        """Return between which of m + 1 states certainly no contact changes, (m,): seen in all steps together."""
        whole, kept, n_samples = self.whole, self.own_mask, FEWEST_SAMPLES + 1
        x, rate = (self.expand(np.array(rows).T).T for rows in zip(*((at.x, at.rate) for at in states), strict=True))
        drive = np.array([at.drive for at in states])
        width, chord = np.diff(drive)[:, None], np.diff(x, axis=0)
        moved = np.abs(chord[:, whole.motions]).max(axis=1)
        slope = np.abs(rate[:, whole.motions]).max(axis=1)
        dense = SAMPLES_PER_RADIUS * moved * whole.mesh.scales.length <= FEWEST_SAMPLES * self.smallest_radius
        smooth = np.maximum(slope[:-1], slope[1:]) * np.abs(width[:, 0]) <= MAX_SLOPE_STEPS * moved
        s, some = np.linspace(0.0, 1.0, n_samples)[:, None, None], self.seen_unknowns
        between = np.zeros((n_samples, *chord.shape))
        between[..., some] = x[:-1, some] + s * s * (3 - 2 * s) * chord[:, some]
        between[..., some] += width * (s * (1 - s) ** 2 * rate[:-1, some] + s * s * (s - 1) * rate[1:, some])
        drives = drive[:-1] + s[:, :, 0] * width[:, 0]
        values = self.values(between.reshape(-1, len(kept)), drives.ravel())
        values = values.reshape(len(values), n_samples, -1).swapaxes(1, 2)
        for row, number in self.slipping_rows.items():
            grown = np.array([self.slip_rate(self.grow(at), number) for at in states[1:]]) * width[:, 0]
            values[row] = np.diff(values[row], axis=-1, prepend=values[row, :, :1])
            values[row, :, -1] = np.minimum(values[row, :, -1], grown)
        calm: Any = (values[..., 1:] >= -self.roundings(values)[..., None]).all(axis=(0, 2))
        suspect = int(calm.argmin())
        if not calm[suspect] and dense[suspect] and smooth[suspect] and not self.slipping_rows:
            self.seen_between[float(drive[suspect]), float(drive[suspect + 1])] = values[:, suspect]
        return calm & dense & smooth

    @cached_property
    def seen_unknowns(self) -> Any:
        """Free unknowns of the whole that `values` depends on: all if sides may touch, else those of nodes that do."""
        mesh = self.whole.mesh
        if self.sides.all:
            return slice(None)
        unknowns = [*mesh.attachments.unknowns[[contact.place for contact in mesh.contacts]].ravel().tolist()]
        unknowns += [unknown for contact in mesh.contacts for unknown in contact.own_unknowns]
        return np.flatnonzero(np.isin(mesh.free, unknowns))

    @cached_property
    def smallest_radius(self) -> float:
        """Smallest radius of a pad and the obstacle that it may pass, or half the beam [m]."""
        beams, items = self.whole.mesh.fits.network.beams, self.whole.mesh.fits.network.contacts
        radii = [item.outline.smallest_bulge + item.radius for item in items if isinstance(item, NodeOnObstacle)]
        radii += [
            item.radius + 0.5 * beams[item.beam].section.thinnest for item in items if isinstance(item, NodeOnBeam)
        ]
        radii += [beams[item.beam].section.thinnest for item in items if isinstance(item, BeamOnBeam)]
        return min(radii, default=np.inf)

    def grows_along(self, at: PathEquilibrium, number: int) -> float:
        """Return how force or gap of a contact changes with the drive at an equilibrium."""
        mesh = self.whole.mesh
        contact = mesh.contacts[number]
        moved = self.moved_by_drive(at)
        if number in self.closed:
            return float(moved[contact.unknown])
        gap = measure(mesh, contact, self.whole.values(at.x, at.drive))
        return float(gap.gradient @ moved[gap.unknowns])

    def slot(self, number: int) -> int:
        """Return the number of a contact's force among the free unknowns of the whole problem."""
        return int(np.searchsorted(self.whole.mesh.free, self.whole.mesh.contacts[number].unknown))

    def slot_in_own(self, number: int, slide: bool = False) -> int:
        """Return the number of a contact's force, or place, among the free unknowns of the own problem."""
        contact = self.whole.mesh.contacts[number]
        return int(np.searchsorted(self.own.mesh.free, contact.slide if slide else contact.unknown))


@dataclass(frozen=True, eq=False)
class WatchedProblem(NetworkProblem):
    """The problem of a piece; it knows between which states of a march no contact changes."""

    piece: PieceOfPath | None = None

    def march(self, walk: Walk) -> MarchedSteps:
        """Return the equilibria on the way to the next requested values, as far as nothing happens."""
        marched = super().march(walk)
        if len(marched.drive) and self.piece is not None:
            states = [walk.here, *marched.states]
            together = SIDES_TOGETHER if self.piece.sides.all else NODES_TOGETHER
            for first in range(0, len(states) - 1, together):
                some = states[first : first + together + 1]
                quiet = self.piece.are_quiet(some).tolist()
                self._quiet.update((id(at), at) for at, calm in zip(some[1:], quiet, strict=True) if calm)
                if not all(quiet):
                    break
        return marched

    def is_quiet_before(self, at: PathEquilibrium) -> bool:
        """Return True if no contact changes on the step of a march that ends at a state."""
        return self._quiet.pop(id(at), None) is not None

    @cached_property
    def _quiet(self) -> dict[int, PathEquilibrium]:
        return {}

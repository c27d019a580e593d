"""A piece of a path, on which the set of closed contacts stays: its problem, its unknowns among all, its conditions.

Between two points gaps and forces are looked at along the cubic through them, so densely that no obstacle
is passed. Where one becomes negative, the change is solved for: gap and force of that contact are both zero there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.carried_states import carry
from cfmkit.elastica.contact.conditions import FORCE_ROUNDING, Conditions
from cfmkit.elastica.contact.equations import with_closed
from cfmkit.elastica.contact.side_gaps import LoadStage
from cfmkit.elastica.contact.terms import measure, measure_slip
from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation, FlankPlace
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.elastica.model.contact import BeamOnBeam, FrictionState, NodeOnBeam, NodeOnObstacle, describe
from cfmkit.numerics.continuation.follow import LOCKED_FORCE, LOCKED_STEP
from cfmkit.numerics.continuation.problem import Border, PathEquilibrium

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.path import MarchedSteps, Options, PathEvent, Walk

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
    def own_problem(self) -> WatchedProblem:
        """The problem whose contacts neither begin nor end."""
        assert self.whole.equations is not None  # from which those of the piece are made
        mesh = with_closed(self.whole.mesh, self.closed, self.friction)
        return WatchedProblem(mesh, self.whole.ramp, self.whole.next_correction, piece=self)

    @cached_property
    def conditions(self) -> Conditions:
        """Conditions, none of which may become negative on this piece."""
        return Conditions(self.whole.mesh, self.closed, self.friction)

    @property
    def flanks(self) -> tuple[FlankPlace, ...]:
        """Places at which sides touch."""
        cuts = self.whole.mesh.elements.cuts
        return tuple(
            FlankPlace(contact.number, float(cuts[contact.element, 1]), contact.laid)
            for contact in self.whole.mesh.contacts
            if contact.slide >= 0
        )

    def list_sides(self, beam: str) -> list[int]:
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

        mesh = self.whole.remesh(tuple(sorted(flanks, key=place)))
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

    def name_contact(self, row: int) -> str:
        """Return the name of the contact of a row of `values` in messages: of a contact its number is its row."""
        return describe(self.conditions.all[row].item)

    def name_contacts(self, number: int) -> str:
        """Return the names of a contact and of those that block the drive together with it."""
        others = [self.name_contact(index) for index in sorted(self.closed - {number})]
        return " with ".join([self.name_contact(number), *others[:2]])

    @property
    def rubbing(self) -> list[int]:
        """Closed contacts with friction."""
        return [k for k in sorted(self.closed) if self.whole.mesh.contacts[k].rub >= 0]

    def name_rubbing_contacts(self) -> str:
        """Return the names of the closed contacts with friction."""
        return ", ".join(map(self.name_contact, self.rubbing))

    def stick_at(self, at: PathEquilibrium, number: int) -> FrictionState:
        """Return the state of friction of a contact that begins to stick at an equilibrium."""
        slip = measure_slip(self.whole.mesh, self.whole.mesh.contacts[number], self.whole.values(at.x, at.drive))
        return FrictionState(0.0, float(slip.value))

    def stick_all(self, at: PathEquilibrium) -> PieceOfPath:
        """Return the piece in which all closed contacts with friction stick from an equilibrium on."""
        return replace(self, friction={k: self.stick_at(at, k) for k in self.rubbing})

    # -- unknowns ------------------------------------------------------------------------------------------------------
    @cached_property
    def own_mask(self) -> Any:
        """Which free unknowns of the whole are those of the own problem."""
        mask = np.zeros(len(self.whole.mesh.free), bool)
        mask[np.searchsorted(self.whole.mesh.free, self.own_problem.mesh.free)] = True
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

    def grow_each(self, states: Sequence[PathEquilibrium]) -> list[PathEquilibrium]:
        """Return equilibria with the forces of all contacts."""
        x, rate = np.zeros((2, len(states), len(self.own_mask)))
        x[:, self.own_mask], rate[:, self.own_mask] = [at.x for at in states], [at.rate for at in states]
        x += self._kept
        return [PathEquilibrium(row, at.drive, slope, *at[3:]) for row, slope, at in zip(x, rate, states, strict=True)]

    def grow_event(self, event: PathEvent) -> PathEvent:
        """Return an event whose equilibria have the forces of all contacts."""
        within = None if event.within is None else (self.grow(event.within[0]), self.grow(event.within[1]))
        nearest = None if event.nearest is None else self.grow(event.nearest)
        modes = None if event.modes is None else self.expand(event.modes)
        return replace(event, nearest=nearest, modes=modes, within=within)

    def solve_near(self, at: PathEquilibrium) -> PathEquilibrium | None:
        """Return the equilibrium of this piece at the drive of one near it; both have the unknowns of all contacts."""
        guess = self.shrink(at)
        solution = self.own_problem.solve(guess.x, guess.drive)
        return None if solution is None else self.grow(solution)

    def solve_at_level(self, begin: PathEquilibrium, row: dict[int, float], level: float) -> PathEquilibrium | None:
        """Return the equilibrium at which a combination of its own unknowns has a value, near one of all unknowns."""
        guess = self.shrink(begin)
        border = np.zeros(len(guess.x) + 1)
        border[list(row)] = list(row.values())
        state = self.own_problem.solve(guess.x, guess.drive, Border(border, level))
        return state if state is not None and np.isfinite(state.rate).all() else None

    def is_locked(self, before: PathEquilibrium, at: PathEquilibrium) -> bool:
        """Return True if forces are as large as where a structure locks, between two points that nearly coincide."""
        if abs(at.drive - before.drive) > LOCKED_STEP * self.options.span:
            return False
        return bool((np.abs(at.x) / self.whole.unit)[~self.whole.motions].max(initial=0.0) > LOCKED_FORCE)

    # -- gaps and forces -----------------------------------------------------------------------------------------------
    def values(self, x: FloatArray, drives: FloatArray) -> FloatArray:
        """Return the values of all conditions in states (n, free), (rows, n)."""
        mesh, drive_column = self.whole.mesh, drives[:, None]
        z = np.asarray(drive_column * mesh.base if self.whole.ramp else mesh.base + drive_column * mesh.rate)
        z[:, mesh.free] = x
        return self.conditions.values(z, LoadStage.from_problem(self.whole, drives))

    def measure_slip_rate(self, at: PathEquilibrium, number: int) -> float:
        """Return the rate by the drive at which a contact slips in its sense, at an equilibrium."""
        mesh = self.whole.mesh
        slip = measure_slip(mesh, mesh.contacts[number], self.whole.values(at.x, at.drive))
        moved = self.measure_rates(at)
        return float(self.friction[number].sense * (slip.gradient @ moved[slip.unknowns]))

    def measure_rates(self, at: PathEquilibrium) -> FloatArray:
        """Return the rates of all unknowns by the drive at an equilibrium, (size,)."""
        mesh = self.whole.mesh
        moved = np.array(mesh.base if self.whole.ramp else mesh.rate, float)
        moved[mesh.free] = at.rate
        return moved

    def measure_condition(self, at: PathEquilibrium, row: int, travel: float = 1.0) -> float:
        """Return one row of `values` at an equilibrium: of slip the rate at which it grows in the sense of travel."""
        condition = self.conditions.all[row]
        if condition.kind == "slip":
            return travel * self.measure_slip_rate(at, condition.number)
        stage = LoadStage.from_problem(self.whole, np.array([at.drive]))
        return float(self.conditions.value(condition, self.whole.values(at.x, at.drive)[None], stage)[0])

    def violates(self, at: PathEquilibrium, roundings: FloatArray, travel: float) -> bool:
        """Return True if some condition is violated at an equilibrium, in the sense of travel."""
        values = self.values(at.x[None], np.array([at.drive]))[:, 0]
        for row in self.conditions.rows_of("slip"):
            values[row] = self.measure_condition(at, row, 1.0 if travel >= 0 else -1.0)
        return not (values >= -roundings).all()

    def estimate_force_rounding(self, at: PathEquilibrium) -> float:
        """Return the size of a contact's force that counts as rounding at an equilibrium."""
        z = self.whole.values(at.x, at.drive)
        return FORCE_ROUNDING * max(1.0, *(abs(float(z[contact.unknown])) for contact in self.whole.mesh.contacts))

    def are_quiet(self, states: Sequence[PathEquilibrium]) -> Any:
        """Return between which of m + 1 states certainly no contact changes, (m,): seen in all steps together.

        The states have the forces of all contacts.
        """
        steps = StepsOfPiece.from_states(self, states)
        values = steps.values(FEWEST_SAMPLES)
        calm: Any = (values[..., 1:] >= -self.conditions.roundings(values)[..., None]).all(axis=(0, 2))
        dense, suspect = steps.wanted_samples <= FEWEST_SAMPLES, int(calm.argmin())
        if not calm[suspect] and dense[suspect] and steps.are_smooth[suspect] and not self.conditions.rows_of("slip"):
            self.seen_between[states[suspect].drive, states[suspect + 1].drive] = values[:, suspect]
        return calm & dense & steps.are_smooth

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

    def measure_growth(self, at: PathEquilibrium, number: int) -> float:
        """Return the rate by the drive of the force of a closed contact, or the gap of an open one."""
        mesh = self.whole.mesh
        contact = mesh.contacts[number]
        moved = self.measure_rates(at)
        if number in self.closed:
            return float(moved[contact.unknown])
        gap = measure(mesh, contact, self.whole.values(at.x, at.drive))
        return float(gap.gradient @ moved[gap.unknowns])

    def slot(self, number: int) -> int:
        """Return the number of a contact's force among the free unknowns of the whole problem."""
        return int(np.searchsorted(self.whole.mesh.free, self.whole.mesh.contacts[number].unknown))

    def find_own_slot(self, number: int, slide: bool = False) -> int:
        """Return the number of a contact's force, or place, among the free unknowns of the own problem."""
        contact = self.whole.mesh.contacts[number]
        return int(np.searchsorted(self.own_problem.mesh.free, contact.slide if slide else contact.unknown))


@lru_cache(maxsize=64)
def cubic_weights(count: int) -> FloatArray:
    """Return the weights of start, chord and bends at both ends of a step at equal shares of it, (count + 1, 4)."""
    s = np.linspace(0.0, 1.0, count + 1)
    return read_only(np.stack([np.ones_like(s), s, s * (1 - s) ** 2, s * s * (1 - s)], axis=1))


@dataclass(frozen=True, eq=False)
class StepsOfPiece:
    """m steps between m + 1 points of a piece: cubics through their ends, or chords where slopes are steep."""

    piece: PieceOfPath
    x: FloatArray  # (m + 1, free) of the whole
    drive: FloatArray  # (m + 1,)
    rate: FloatArray  # (m + 1, free)

    @classmethod
    def from_states(cls, piece: PieceOfPath, states: Sequence[PathEquilibrium]) -> StepsOfPiece:
        """Return the steps between states with the forces of all contacts."""
        x, drive, rate = (np.array(column) for column in list(zip(*states, strict=True))[:3])
        return cls(piece, x, drive, rate)

    @cached_property
    def moved(self) -> FloatArray:
        """Largest motion of each step, (m,)."""
        return np.asarray(np.abs(np.diff(self.x, axis=0)[:, self.piece.whole.motions]).max(axis=1))

    @cached_property
    def are_smooth(self) -> Any:
        """True for steps that cubics describe, (m,)."""
        slope, width = np.abs(self.rate[:, self.piece.whole.motions]).max(axis=1), np.abs(np.diff(self.drive))
        return (width > 0) & (np.maximum(slope[:-1], slope[1:]) * width <= MAX_SLOPE_STEPS * self.moved)

    @property
    def wanted_samples(self) -> FloatArray:
        """Places of each step at which gaps and forces are looked at so densely that no obstacle is passed, (m,)."""
        length = self.piece.whole.mesh.scales.length
        return SAMPLES_PER_RADIUS * self.moved * length / self.piece.smallest_radius

    def values(self, count: int) -> FloatArray:
        """Return the values of all conditions at the ends of equal parts of each step, (rows, m, count + 1)."""
        piece, x, rate, width = self.piece, self.x, self.rate, np.diff(self.drive)[:, None]
        chord, smooth, weights = np.diff(x, axis=0), self.are_smooth[:, None], cubic_weights(count)
        bends = smooth * (width * rate[:-1] - chord), smooth * (chord - width * rate[1:])
        between = weights @ np.stack([x[:-1], chord, *bends], axis=1)
        drives = self.drive[:-1, None] + weights[:, 1] * width
        between[:, -1], drives[:, -1] = x[1:], self.drive[1:]
        values = piece.values(between.reshape(-1, x.shape[1]), drives.ravel()).reshape(-1, *drives.shape)
        for row in piece.conditions.rows_of("slip"):
            number = piece.conditions.all[row].number
            ends = (PathEquilibrium(*end, 0) for end in zip(self.x[1:], self.drive[1:], self.rate[1:], strict=True))
            grown = np.array([piece.measure_slip_rate(end, number) for end in ends]) * width[:, 0]
            values[row] = np.diff(values[row], axis=-1, prepend=values[row, :, :1])
            values[row, :, -1] = np.minimum(values[row, :, -1], grown)
        return values


@dataclass(frozen=True, eq=False)
class WatchedProblem(NetworkProblem):
    """The problem of a piece; it knows between which states of a march no contact changes."""

    piece: PieceOfPath | None = None

    def march(self, walk: Walk) -> MarchedSteps:
        """Return the equilibria on the way to the next requested values, as far as nothing happens."""
        marched = super().march(walk)
        if len(marched.drive) and self.piece is not None:
            states = [walk.current, *marched.states]
            together = SIDES_TOGETHER if self.piece.conditions.rows_of("touch") else NODES_TOGETHER
            for first in range(0, len(states) - 1, together):
                some = states[first : first + together + 1]
                grown = self.piece.grow_each(some)
                quiet = self.piece.are_quiet(grown).tolist()
                watched = zip(some[1:], grown[1:], quiet, strict=True)
                self._watched_states.update((id(at), (at, *state)) for at, *state in watched)
                if not all(quiet):
                    break
        return marched

    def grow_watched(self, at: PathEquilibrium) -> tuple[PathEquilibrium, bool]:
        """Return a state with the forces of all contacts, and whether surely none changes on the step before it."""
        assert self.piece is not None
        _, grown, is_quiet = self._watched_states.pop(id(at), (at, None, False))
        return grown or self.piece.grow(at), is_quiet

    @cached_property
    def _watched_states(self) -> dict[int, tuple[PathEquilibrium, PathEquilibrium, bool]]:
        """States of marches by their identity, with the forces of all contacts, and whether the step is quiet."""
        return {}

"""The path of a network under a drive, `EquilibriumPath`: its events, motions, forces, stresses, contacts, energy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica.contact.terms import contact_contribution, gaps
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.design_derivatives import Equilibria, partials
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.terms import ENERGY_TERMS
from cfmkit.elastica.mechanics.wide_strip import bending
from cfmkit.elastica.model.contact import BeamSide
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.model.network import PointLoad
from cfmkit.elastica.results import beam_states, stress_extremes
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.beam import Fit
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

N_PLACES = 17  # even places of every element at which states along a beam are handed out; neighbours share their ends
STRESS_RTOL = 1e-9  # share by which stresses of two beams differ that are one but for rounding


class PathStatus(Enum):
    """End of a path."""

    COMPLETE = "all requested points were reached"
    LIMIT_POINT = "the drive cannot go further: a limit point"
    BLOCKED = "the drive is blocked by a contact"
    JUMPS = "stability is lost and no stable equilibrium is near"
    LOST = "the path was lost: no step converged"
    OUTSIDE = "the path left the range of the drive"
    FULL = "the path has more points than allowed"
    NO_START = "no equilibrium under the constant loads"
    INACCURATE = "the tolerance could not be reached"


@dataclass(frozen=True)
class Event:
    """Something on the path: a limit point, a bifurcation, or a change of stability that was not resolved.

    `drive` is where (SI); `before` and `after` count the unstable directions on both sides of the path that it lies on,
    in the sense of travel: at the end of a branch, of the path that it joins. What is passed before the drive begins is
    reported first: its kind ends in "under prestress" or "under constant loads", `drive` is the share [1].
    """

    kind: str
    drive: float
    before: int
    after: int


@dataclass(frozen=True)
class ContactEvent:
    """The begin or end of a contact, or a contact that blocks the drive; unstable directions before and after."""

    kind: Literal["begins", "ends", "blocks", "moves", "spreads", "closes", "slips", "sticks"]
    number: int  # of the contact in `Network.contacts`
    drive: float  # [m, rad or 1]
    before: int
    after: int
    states: int = 1  # of friction that are possible behind it; the first was taken


@dataclass(frozen=True)
class StressPeak:
    """The largest stress at every point [Pa], the beam that has it and the place on it (fraction of its length)."""

    value: FloatArray
    beam: Any
    place: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class EquilibriumPath(ShortRepr):
    """Equilibria of a network under a drive, n points in the order of the path; SI."""

    network: Network  # as specified
    load_case: Drive  # what was done to it
    at: Equilibria  # the equilibria, dimensionless
    unstable: Any  # (n,) number of unstable directions while the drive is held
    requested: Any  # (n,) index of the requested point, -1 for points in between
    branch: Any  # (n,) which branch each point is on
    status: PathStatus
    message: str  # if not all requested points were reached: why, and where
    events: tuple[Event, ...]  # limit points and bifurcations, in path order
    error: float  # estimated error of forces and positions, relative to the largest of the path
    accurate: Any  # (n,) False at points whose own error is above the tolerance, or not known
    imperfection: str = ""  # what was added to the shapes: size and mode; empty for the network as given
    contact_events: tuple[ContactEvent, ...] = ()  # in path order
    at_contact: Any = False  # (n,) points at which a contact begins or ends; False for all

    def __len__(self) -> int:
        return len(self.at.z)

    @property
    def mesh(self) -> Discretisation:
        """The arrays of the network."""
        return self.at.mesh

    @property
    def free(self) -> FloatArray:
        """Unknowns that were solved for at every point, (n, free); dimensionless."""
        return np.asarray(self.at.z[:, self.mesh.free])

    @property
    def follows(self) -> bool:
        """True if a load turns with its node."""
        return any(load.item.follows for load in self.mesh.loads)

    def take(self, points: Any) -> EquilibriumPath:
        """Return some of the points: their indices, or True for each."""
        at = Equilibria(self.mesh, self.at.z[points], self.at.drive[points])
        return replace(self, at=at, **{name: column[points] for name, column in self._columns.items()})

    def append(self, following: EquilibriumPath) -> EquilibriumPath:
        """Return the points of this path, then those of another of the same network, as one."""
        z, drive = np.vstack([self.at.z, following.at.z]), np.concatenate([self.at.drive, following.at.drive])
        columns: dict[str, Any] = {}
        for name, values in self._columns.items():
            column = np.concatenate([values, following._columns[name]])
            columns[name] = read_only(column, column.dtype)
        return replace(self, at=Equilibria(self.mesh, z, drive), **columns)

    @property
    def _columns(self) -> dict[str, Any]:
        """Values that every point has besides its equilibrium."""
        names = ("unstable", "requested", "branch", "accurate")
        return {name: getattr(self, name) for name in names} | {"at_contact": self.changes_contact}

    def with_states(self, nearest: Any, free: FloatArray, drive: FloatArray, accurate: Any = True) -> EquilibriumPath:
        """Return other equilibria of the network as a path, none of them requested.

        They have unknowns (m, free) and drives (m,), dimensionless, branch and stability of the points `nearest`, (m,).
        """
        mesh = self.mesh
        z = mesh.base + drive[:, None] * mesh.rate
        z[:, mesh.free] = free
        count = len(drive)
        return replace(
            self,
            at=Equilibria(mesh, z, drive),
            unstable=self.unstable[nearest],
            requested=read_only(np.full(count, -1), np.int64),
            branch=self.branch[nearest],
            accurate=read_only(np.broadcast_to(accurate, count), np.bool_),
            at_contact=False,
        )

    @property
    def changes_contact(self) -> Any:
        """True at points at which a contact begins or ends, (n,)."""
        return np.broadcast_to(self.at_contact, (len(self),))

    def contact_force(self, number: int) -> FloatArray:
        """Return the force of a contact at every point, (n,) [N], of a stop that limits a rotation the moment [N m].

        Of the side of a beam it is the sum over all places.
        """
        mesh = self.mesh
        unit = mesh.scales.moment if self.network.contacts[number].turns else mesh.scales.force
        unknowns = [contact.unknown for contact in mesh.contacts if contact.number == number]
        return read_only(self.at.z[:, unknowns].sum(axis=1) * unit)

    def contact_friction(self, number: int) -> tuple[FloatArray, Any]:
        """Return the tangential force of the contact of a node, (n,) [N], and what it does: "stick", "slip" or "".

        The force is on the node, positive along what it touches: the free side is to the left.
        """
        contact = next(contact for contact in self.mesh.contacts if contact.number == number)
        if contact.rub < 0:
            return read_only(np.zeros(len(self))), read_only(np.full(len(self), ""), np.str_)
        z = self.at.z
        flags = np.rint(z[:, contact.flag])
        said = np.where(
            z[:, contact.unknown] > 0, np.where(flags == 0, "stick", np.where(np.abs(flags) == 1, "slip", "")), ""
        )
        return read_only(z[:, contact.rub] * self.mesh.scales.force), read_only(said, np.str_)

    def contact_places(self, number: int) -> FloatArray:
        """Return between which places the side of a beam touches at every point, (n, 2) [share of its length].

        They are the same where it touches at one place, and not a number where it is apart.
        """
        mesh, item = self.mesh, self.network.contacts[number]
        sides = [contact for contact in mesh.contacts if contact.number == number]
        places = np.full((len(self), 2, max(len(sides), 1)), np.nan)
        for k, contact in enumerate(sides):
            side = np.rint(self.at.z[:, contact.flag])
            place = np.reshape(mesh.fits[item.beam].arc(self.at.z[:, contact.slide]), (-1,))  # type: ignore[union-attr]
            closed = self.at.z[:, contact.unknown] > 0
            first, last = sides[:1] == [contact], sides[-1:] == [contact]
            places[:, 0, k] = np.where(closed, np.where((side < 0) & first, 0.0, place), np.nan)
            places[:, 1, k] = np.where(closed, np.where((side > 0) & last, 1.0, place), np.nan)
        low = np.where(np.isnan(places[:, 0]), np.inf, places[:, 0]).min(axis=1)
        high = np.where(np.isnan(places[:, 1]), -np.inf, places[:, 1]).max(axis=1)
        apart = ~np.isfinite(low)
        return read_only(np.where(apart[:, None], np.nan, np.stack([low, high], axis=1)))

    def contact_gap(self, number: int) -> FloatArray:
        """Return the gap of a contact at every point, (n,) [m or rad]; negative by what an elastic one yields.

        Of the side of a beam it is the least, wherever along the beam that is.
        """
        item = self.network.contacts[number]
        if isinstance(item, BeamSide):
            from cfmkit.elastica.contact.pair_gaps import least_side_gaps

            return read_only(least_side_gaps(self.mesh, item, self.at.z, self.at.drive) * self.mesh.scales.length)
        mesh, contact = self.mesh, next(contact for contact in self.mesh.contacts if contact.number == number)
        unit = 1.0 if contact.item.turns else mesh.scales.length
        return read_only(gaps(mesh, contact, self.at.z) * unit)

    @cached_property
    def drive(self) -> FloatArray:
        """Value of the drive at every point [m, rad or 1]."""
        return read_only(self.at.drive * self.mesh.scales.drive)

    @property
    def stable(self) -> Any:
        """True where it is stable while the drive is held; under loads that follow: where it does not diverge."""
        return read_only(self.unstable == 0, np.bool_)

    @cached_property
    def at_requested(self) -> Any:
        """Indices of the points that were requested, in path order."""
        return read_only(np.flatnonzero(self.requested >= 0), np.int64)

    @property
    def fits(self) -> Any:
        """Fit of each beam between its nodes, by its name."""
        fits: dict[str, Fit] = dict(self.mesh.fits)
        return fits

    # -- nodes -------------------------------------------------------------------------------------------------------
    @cached_property
    def residual(self) -> FloatArray:
        """Gradient of the functional by all unknowns at every point, (n, size): zero at free ones; dimensionless."""
        return self.at.residual

    def motion(self, node: str) -> FloatArray:
        """Return displacement and rotation of a node, (n, 3) [m, m, rad]."""
        return read_only(node_motion(self.at, node))

    def reaction(self, node: str) -> FloatArray:
        """Return force and moment that hold a node, (n, 3) [N, N, N m]: of its support and of a drive by a motion.

        Loads are not among them, those of a drive neither. Raises InputError if there is no such node, or a link moves
        it.
        """
        if node not in self.network.nodes:
            raise InputError(f"{node!r} is not a node; nodes: {', '.join(self.network.nodes)}")
        if self.network.is_moved_by_link(node):
            master = self.network.master_of(node)
            raise InputError(f"node {node!r} is moved by a link: what is held is its master, {master!r}")
        return read_only(node_reaction(self.at, node, self.residual))

    @cached_property
    def effort(self) -> FloatArray:
        """Work-conjugate of the drive: the force along it [N], the moment [N m], or for loads the displacement [J]."""
        return read_only(work_with_drive(self.at, self.load_case))

    # -- along beams -------------------------------------------------------------------------------------------------
    @property
    def _fractions(self) -> FloatArray:
        return np.linspace(0.0, 1.0, N_PLACES)

    def states(self, beam: str) -> beam_states.BeamStates:
        """Return states at the sampled places of a beam at every point."""
        if beam not in self._states:
            self._states[beam] = beam_states.states(self.network, self.at, beam, self._fractions)
        return self._states[beam]

    @cached_property
    def _states(self) -> dict[str, beam_states.BeamStates]:
        return {}

    def end_force(self, beam: str, end: int) -> FloatArray:
        """Return (h, v, m) on the first (0) or last (1) section of a beam, (n, 3) [N, N, N m].

        It is what the part after the section exerts on the part before it, in global axes.
        """
        states, k = self.states(beam), -1 if end else 0
        return read_only(np.stack([states.h[:, k], states.v[:, k], states.moment[:, k]], axis=-1))

    def line_motion(self, beam: str) -> FloatArray:
        """Return the displacements of the sampled places of a beam, (n, k, 2) [m]."""
        states = self.states(beam)
        rest = beam_states.unloaded_places(self.network, self.at, beam, self._fractions)
        return read_only(np.stack([states.x, states.y], axis=-1) - rest)

    def shape(self, beam: str, point: int) -> FloatArray:
        """Return the deformed centre line of a beam at one point, (k, 2) [m]."""
        states = self.states(beam)
        return read_only(np.stack([states.x[point], states.y[point]], axis=-1))

    def places(self, beam: str) -> FloatArray:
        """Return where the sampled places of a beam lie, (k,) [fraction of the arc length]."""
        return read_only(self.states(beam).place)

    def sections(self, beam: str) -> beam_states.BeamSections:
        """Return section forces and stresses along a beam at all points; arrays (n, k)."""
        return beam_states.sections(self.network, beam, self.states(beam))

    @cached_property
    def energy(self) -> FloatArray:
        """Strain energy of beams and springs at every point [J]."""
        return read_only(strain_energy(self.at) * self.mesh.scales.moment)

    # -- stresses ----------------------------------------------------------------------------------------------------
    def beam_stresses(self, axial: bool = True) -> tuple[FloatArray, FloatArray]:
        """Return the largest stress magnitude of b beams at every point, (b, n) [Pa], and its share of the length.

        Bending and axial stress together; of bending alone if not `axial`.
        """
        if axial not in self._beam_stresses:
            extremes = stress_extremes.largest_stresses(self.network, self.at, list(self.network.beams), axial)
            self._beam_stresses[axial] = read_only(extremes[0]), read_only(extremes[1])
        return self._beam_stresses[axial]

    def known_beam_stresses(self, axial: bool) -> FloatArray | None:
        """Return the first of `beam_stresses`; None if they are not known yet."""
        extremes = self._beam_stresses.get(axial)
        return None if extremes is None else extremes[0]

    @cached_property
    def _beam_stresses(self) -> dict[bool, tuple[FloatArray, FloatArray]]:
        """Results of `beam_stresses`, of which curves, metrics between their points and findings are made."""
        return {}

    @cached_property
    def cross_stiffnesses(self) -> dict[tuple[str, float], tuple[FloatArray, FloatArray]]:
        """Values and signs by node and direction that `cfmkit.elastica.results.cross_stiffness` has computed."""
        return {}

    def stress_extremes(self, beam: str, axial: bool = True) -> stress_extremes.SideExtremes:
        """Return the highest and lowest stress on both sides of a beam at every point, signed, with their places."""
        return stress_extremes.signed_extremes(self.network, self.at, beam, axial)

    def peak_stress(self, axial: bool = True) -> StressPeak:
        """Return the largest stress of the network at every point, with its place; see `most_stressed`."""
        names = list(self.network.beams)
        values, places = self.beam_stresses(axial)
        best, pick = most_stressed(values, places), np.arange(len(self))
        return StressPeak(
            read_only(values[best, pick]), read_only(np.array(names)[best], np.str_), read_only(places[best, pick])
        )


Path = EquilibriumPath


def most_stressed(values: FloatArray, places: FloatArray) -> Any:
    """Return which beam (n,) has the largest of stresses (beams, n) at places (fractions of the length).

    Beams that meet have one stress there, but for rounding: it is that of the beam that begins.
    """
    return np.where(values >= (1 - STRESS_RTOL) * values.max(axis=0), -places, -np.inf).argmax(axis=0)


def node_motion(at: Equilibria, node: str) -> Any:
    """Return displacement and rotation of a node, (p, 3) [m, m, rad]."""
    mesh = at.mesh
    pose = poses(mesh.attachments, at.z, [mesh.nodes[node]])
    rest = (mesh.attachments.origin + mesh.attachments.arm)[mesh.nodes[node]]
    moved = (pose.place[:, 0] - rest) * mesh.scales.length
    return np.concatenate([moved, at.z[:, pose.unknowns[0, 3:]]], axis=1)


def node_reaction(at: Equilibria, node: str, residual: Any) -> Any:
    """Return force and moment on a node from the gradient at all unknowns, (p, 3) [N, N, N m]."""
    mesh, scales = at.mesh, at.mesh.scales
    if node not in mesh.bodies:
        raise InputError(f"{node!r} is moved by a link: it has no support of its own")
    cos, sin = mesh.attachments.frame[mesh.nodes[node]]
    along, across, moment = (residual[:, unknown] for unknown in mesh.bodies[node])
    force = np.stack([cos * along - sin * across, sin * along + cos * across], axis=-1) * scales.force
    return np.concatenate([force, moment[:, None] * scales.moment], axis=1)


def work_with_drive(at: Equilibria, drive: Drive) -> FloatArray:
    """Return the work-conjugate of a drive at equilibria, (p,): see `EquilibriumPath.effort`."""
    scales = at.mesh.scales
    if isinstance(drive, Loading):
        return np.asarray(load_displacement(at, drive))
    return np.asarray(at.residual @ at.mesh.rate * scales.moment / scales.drive)


def load_displacement(at: Equilibria, drive: Loading) -> Any:
    """Return the work-conjugate displacement of a drive by loads, (p,) [J]."""
    mesh, scales = at.mesh, at.mesh.scales
    work = None if mesh.contacts or np.iscomplexobj(at.z) else equations(mesh).measure_load_work(at.z)
    if work is not None:
        return work * (scales.moment / scales.drive)
    total: Any = 0.0
    for load in drive.loads:
        if not isinstance(load, PointLoad):
            continue
        moved = node_motion(at, load.node)
        fx, fy = load.fx, load.fy
        if load.follows:
            cos, sin = np.cos(moved[:, 2]), np.sin(moved[:, 2])
            fx, fy = cos * load.fx - sin * load.fy, sin * load.fx + cos * load.fy
        total = total + fx * moved[:, 0] + fy * moved[:, 1] + load.moment * moved[:, 2]
    line = mesh.elements.line[:, 1]
    if line.any():
        unloaded = beam_states.drop_line_loads(mesh)
        rest = partials(unloaded, np.zeros_like(at.z), np.zeros(len(at.z)), ("line",))["line"]
        moved = rest[:, :, 0] - partials(mesh, at.z, at.drive, ("line",))["line"][:, :, 0]
        total = total + (moved * line).sum(axis=(1, 2)) * scales.moment / scales.drive
    return total + np.zeros(len(at.z))


def strain_energy(at: Equilibria) -> Any:
    """Return the strain energy of beams and springs, (p,), dimensionless."""
    e, fields = at.mesh.elements, energy.compute_fields(at.mesh, at.z, at.drive)
    density = 2 * bending(e, fields.curvature).energy + e.axial * fields.normal**2 + e.shear * fields.shear**2
    total = (e.weight * density).sum(axis=(1, 2)) / 2
    for spring in at.mesh.springs:
        term = ENERGY_TERMS[type(spring.item)]
        total = total + np.array(
            [term(at.mesh, spring, z, 1.0, drive).energy for z, drive in zip(at.z, at.drive, strict=True)]
        )
    for contact in at.mesh.contacts:
        if contact.slide < 0:
            total = total + np.array([contact_contribution(at.mesh, contact, z).energy for z in at.z])
    return total


def largest_force(at: Equilibria) -> float:
    """Return the largest force or moment in a beam at any state, dimensionless."""
    mesh, e = at.mesh, at.mesh.elements
    element_unknowns = at.z[:, e.unknowns]
    curvature = element_unknowns[..., energy.rotation_columns(mesh.degree)] @ basis(mesh.degree).slopes.T
    moment = np.abs(e.rigidity * e.length[..., None] * curvature).max(initial=0.0)
    return float(max(moment, np.abs(element_unknowns[..., -2:]).max(initial=0.0)))

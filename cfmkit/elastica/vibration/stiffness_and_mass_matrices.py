"""A network linearised about equilibria of a path: stiffness, mass, and the constraints of its motions.

The stiffness is the second variation of the energy about the exact pose: elastic energy, section forces, springs, arms
and dead loads, symmetric; what loads that turn with their node add is kept apart, and is not. The unknowns are all
degrees of freedom of the layout, held ones included, then the inner ones of the beams (`beam_basis`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.kernels.network_array_types import SLIDE, TURN
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.vibration.beam_basis import ENDS, panels, quadratic, states_at
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.path import Path
    from cfmkit.elastica.vibration.network_masses_type import NetworkMasses

_MOST = 4000  # unknowns: dense matrices of this size take 130 MB each, and half a minute per pose


@dataclass(frozen=True)
class Linearised:
    """Small motions about some equilibria; dimensionless, masses in kg/m.

    Attributes
    ----------
    stiffness, mass : (points, n, n) arrays
        Symmetric.
    turning : (points, n, n) array
        What loads that turn with their node add to the stiffness.
    tied : (points, k, n) array
        Rows whose product with a motion vanishes.
    free, driven : int arrays
        The unknowns that move while the drive is held; those that the drive moves or, under loads, none.
    held : (points, 1, n) or (points, 0, n) array
        What else is tied while the drive is held, where the drive is a load.
    """

    stiffness: FloatArray
    mass: FloatArray
    turning: FloatArray
    tied: FloatArray
    free: Any
    driven: Any
    held: FloatArray


class Linearisation:
    """Linearises a network about points of its path.

    Parameters
    ----------
    path : Path
        Its equilibria.
    masses : NetworkMasses
        What its parts weigh.
    modes : int
        How many of the lowest modes are to be right.
    hold : (str, float or None), optional
        Of a drive by loads: the node, and the direction [rad] along which it stands still while the drive is held,
        or None for its rotation.
    """

    def __init__(
        self, path: Path, masses: NetworkMasses, modes: int, hold: tuple[str, float | None] | None = None
    ) -> None:
        """Sample the beams."""
        self.path, self.masses, self.hold, self.layout = path, masses, hold, path.layout
        names = list(self.layout.network.beams)
        if missing := [name for name in names if name not in masses.density]:
            raise InputError(f"no density is given for the beams {', '.join(missing)}")
        for name in masses.nodes:
            if name not in self.layout.network.nodes:
                raise InputError(f"a mass is given for {name!r}, which is not a node")
        self.panels = [panels(path, name, modes) for name in names]
        inner = [one.unknowns - ENDS for one in self.panels]
        self.firsts = (self.layout.dof_count + np.cumsum([0, *inner])).tolist()
        self.size = int(self.firsts[-1])
        if self.size > _MOST:
            raise InputError(
                f"natural frequencies need {self.size} unknowns, more than {_MOST}: the beams have too many windings "
                "or too much tension"
            )

    @cached_property
    def _values(self) -> FloatArray:
        """Values of the degrees of freedom, (points of the path, dofs)."""
        return np.stack([self.path.value(dof) for dof in range(self.layout.dof_count)], axis=1)

    def at(self, points: Any) -> Linearised:
        """Return the matrices at points of the path (indices)."""
        points = np.asarray(points, dtype=np.int64)
        system = _System(self, points)
        system.add_beams()
        system.add_springs()
        system.add_loads()
        system.add_masses()
        plan = self.layout.plan
        inner = np.arange(self.layout.dof_count, self.size)
        driven = [] if self.layout.driven is None else [self.layout.driven[0]]
        return Linearised(
            system.stiffness,
            system.mass,
            system.turning,
            system.tied,
            np.concatenate([np.flatnonzero(plan.slot >= 0), inner]),
            np.array(driven, dtype=np.int64),
            system.held(),
        )


class _System:
    """The matrices of some points, as they are added up."""

    def __init__(self, of: Linearisation, points: Any) -> None:
        self.of, self.points, self.layout, self.model = of, points, of.layout, of.path.solver.model
        count, n = len(points), of.size
        self.values = of._values[points]
        self.stiffness, self.mass, self.turning = (np.zeros((count, n, n)) for _ in range(3))
        self.tied = np.zeros((count, 2 * len(of.panels), n))

    def arm(self, place: int) -> FloatArray:
        """Return the arm of an attachment as it is turned, (points, 2)."""
        arm, turn = self.model.place_arm[place], self.values[:, self.model.place_dof[place, 2]]
        c, s = np.cos(turn), np.sin(turn)
        return np.stack([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]], axis=1)

    def jacobian(self, place: int) -> FloatArray:
        """Return the motion of an attachment by its degrees of freedom, (points, 3, 4)."""
        return _moves(self.model.place_frame[place], self.arm(place))

    def add(self, to: FloatArray, rows: Any, columns: Any, block: FloatArray) -> None:
        """Add blocks (points, rows, columns); numbers may occur twice."""
        where: Any = (slice(None), np.asarray(rows)[:, None], np.asarray(columns)[None, :])
        np.add.at(to, where, block)

    def bend_arm(self, place: int, force: FloatArray) -> None:
        """Add the stiffness of the arm of an attachment under a force (points, 2) on the network."""
        dof = self.model.place_dof[place, 2]
        self.stiffness[:, dof, dof] += (self.arm(place) * force).sum(axis=1)

    def add_beams(self) -> None:
        """Add the beams, with their arms, and what ties them to their nodes."""
        path, m, length = self.of.path, self.model, self.layout.scales.length
        for e, (name, given) in enumerate(zip(self.layout.network.beams, self.of.panels, strict=True)):
            places = [int(place) for place in m.beam_end[e]]
            state = states_at(path, e, given, self.points)
            moves = np.zeros((len(self.points), 2, ENDS))
            moves[:, :, :4] = self.jacobian(places[0])[:, :2]
            density = self.of.masses.density[name]
            turning = density / length**2 if self.layout.network.beams[name].section.shear else 0.0
            found = quadratic(given, state, moves, (density, turning))
            inner = np.arange(self.of.firsts[e], self.of.firsts[e + 1])
            own = np.concatenate([m.place_dof[places[0]], m.place_dof[places[1]], inner])
            self.add(self.stiffness, own, own, found.stiffness)
            self.add(self.mass, own, own, found.mass)
            found.gap[:, :, 4:ENDS] -= self.jacobian(places[1])[:, :2]
            self.add(self.tied, [2 * e, 2 * e + 1], own, found.gap)
            for end, sense in ((0, 1.0), (1, -1.0)):
                # what the beam exerts on its node is the force on its first section, and minus that on its last one
                force = path.end_force(name, end)[self.points, :2] / self.layout.scales.force
                self.bend_arm(places[end], sense * force)

    def add_springs(self) -> None:
        """Add the springs: along the line or direction, across a line under force, and their arms."""
        m = self.model
        for k, (i, j) in enumerate(m.spring_place.tolist()):
            force, block = self._spring(k, i, j)
            ja, jb = self.jacobian(i), self.jacobian(j)
            da, db = m.place_dof[i], m.place_dof[j]
            for one, left, to, right, sense in (
                (da, ja, da, ja, 1.0), (db, jb, db, jb, 1.0), (da, ja, db, jb, -1.0), (db, jb, da, ja, -1.0)
            ):  # fmt: skip
                self.add(self.stiffness, one, to, sense * left.transpose(0, 2, 1) @ block @ right)
            self.bend_arm(j, force)
            self.bend_arm(i, -force)

    def _place(self, i: int) -> FloatArray:
        """Return the place of an attachment, (points, 2)."""
        m, at = self.model, self.values[:, self.model.place_dof[i]]
        (c, s), origin = m.place_frame[i], m.place_origin[i]
        moved = np.stack([c * at[:, 0] - s * at[:, 1], s * at[:, 0] + c * at[:, 1]], axis=1)
        return np.asarray(origin + moved + self.arm(i))

    def _spring(self, k: int, i: int, j: int) -> tuple[FloatArray, FloatArray]:
        """Return the force of a spring on its second place (points, 2), and its stiffness (points, 3, 3)."""
        m, count = self.model, len(self.points)
        kind, value = int(m.spring_kind[k]), m.spring_value[k]
        block, stiffness = np.zeros((count, 3, 3)), float(value[0])
        if kind == TURN:
            block[:, 2, 2] = stiffness
            return np.zeros((count, 2)), block
        way = self._place(j) - self._place(i)
        if kind == SLIDE:
            along = np.tile(value[1:3], (count, 1))
            force, across = stiffness * ((way * along).sum(axis=1) - value[3]), np.zeros(count)
        else:
            length = np.hypot(*way.T)
            along = way / np.where(length > 0, length, 1.0)[:, None]
            force = stiffness * (length - value[1])
            across = np.where(length > 0, force / np.where(length > 0, length, 1.0), stiffness)
        outer = along[:, :, None] * along[:, None, :]
        block[:, :2, :2] = stiffness * outer + across[:, None, None] * (np.eye(2) - outer)
        return -force[:, None] * along, block

    def add_loads(self) -> None:
        """Add the arms of point loads, and what those that turn with their node add."""
        m, drive = self.model, self.of.path.points.drive[self.points]
        for k, i in enumerate(m.load_place.tolist()):
            given = m.load_value[k, 0] + drive[:, None] * m.load_value[k, 1]
            force, dofs = given[:, :2], m.place_dof[i]
            if m.load_follows[k]:
                turn = self.values[:, dofs[3]]
                c, s = np.cos(turn), np.sin(turn)
                force = np.stack([c * force[:, 0] - s * force[:, 1], s * force[:, 0] + c * force[:, 1]], axis=1)
                across = np.stack([-force[:, 1], force[:, 0]], axis=1)
                rows = -np.einsum("pra,pr->pa", self.jacobian(i)[:, :2], across)
                self.add(self.turning, dofs, dofs[3:], rows[:, :, None])
            self.bend_arm(i, force)

    def add_masses(self) -> None:
        """Add the masses and moments of inertia at nodes."""
        length = self.layout.scales.length
        for name, (mass, inertia) in self.of.masses.nodes.items():
            moves, dofs = self.node(name)
            weight = np.array([mass, mass, inertia / length**2]) / length
            self.add(self.mass, dofs, dofs, moves.transpose(0, 2, 1) @ (weight[:, None] * moves))

    def node(self, name: str) -> tuple[FloatArray, Any]:
        """Return the motion of a node (points, 3, 4) by its degrees of freedom, and their numbers."""
        layout, plan = self.layout, self.layout.plan
        master = layout.network.master_of(name)
        frame = float(layout.direction[master])
        arm = np.subtract(layout.position(name), layout.position(master)) / layout.scales.length
        dofs = np.array([layout.first[master], layout.first[master] + 1, plan.swing[name], plan.turn[name]])
        turn = self.values[:, plan.swing[name]]
        c, s = np.cos(turn), np.sin(turn)
        turned = np.stack([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]], axis=1)
        return _moves(np.array([np.cos(frame), np.sin(frame)]), turned), dofs

    def held(self) -> FloatArray:
        """Return what is tied while a drive by loads is held."""
        count, n = len(self.points), self.of.size
        if self.of.hold is None or not isinstance(self.layout.drive, Loading):
            return np.zeros((count, 0, n))
        name, direction = self.of.hold
        moves, dofs = self.node(name)
        row = moves[:, 2] if direction is None else np.cos(direction) * moves[:, 0] + np.sin(direction) * moves[:, 1]
        tied = np.zeros((count, 1, n))
        self.add(tied, [0], dofs, row[:, None])
        return tied


def _moves(frame: FloatArray, arm: FloatArray) -> FloatArray:
    """Return the motion of the end of an arm (points, 2) by along, across, swing and pose: (points, 3, 4)."""
    moves = np.zeros((len(arm), 3, 4))
    moves[:, 0, 0], moves[:, 0, 1] = frame[0], -frame[1]
    moves[:, 1, 0], moves[:, 1, 1] = frame[1], frame[0]
    moves[:, 0, 2], moves[:, 1, 2] = -arm[:, 1], arm[:, 0]
    moves[:, 2, 3] = 1.0
    return moves


__all__ = ["Linearisation", "Linearised"]

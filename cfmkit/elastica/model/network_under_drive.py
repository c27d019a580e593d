"""The index map and the values of a network under a drive: what the compiled code's arrays are made from, and units."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.model.beam import Fit, fit, same_value
from cfmkit.elastica.model.drive import Displacement, Drive, Rotation
from cfmkit.elastica.model.network import LineSpring, Network, PointLoad, SlideSpring, Spring, TorsionSpring
from cfmkit.elastica.model.numbering import NOWHERE, driven, plan_of
from cfmkit.elastica.model.plain_beams_at_once import Bundle, coils
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.network import LoadOn


class Scales(NamedTuple):
    """Units of the dimensionless system: length [m], bending rigidity [N m2], drive [its own unit]."""

    length: float
    rigidity: float
    drive: float = 1.0

    @property
    def force(self) -> float:
        """Unit of force [N]."""
        return self.rigidity / self.length**2

    @property
    def moment(self) -> float:
        """Unit of moment and energy [N m]."""
        return self.rigidity / self.length


class Places(NamedTuple):
    """Attachments: degrees of freedom (n, 4), cos and sin of their frames (n, 2), places and arms (n, 2) [m]."""

    dof: Any
    frame: Any
    origin: Any
    arm: Any


class Layout:
    """Degrees of freedom of a network under a drive, in the order that the compiled code uses, and its values."""

    def __init__(self, network: Network, drive: Drive, known: Layout | None = None) -> None:
        """Number the degrees of freedom and collect the attachments.

        From a `known` layout of a similar network the fits of beams that are the same are taken over, as objects.
        """
        self.network, self.drive, self.known = network, drive, known
        moved = driven(network, drive)
        self.plan = plan = plan_of(network, drive, moved)
        self.masters, self.first, self.dof_count, self.free = plan.masters, plan.first, plan.dof_count, plan.free
        self.pin_dof, self.beam_end = plan.pins, plan.beam_end
        self.driven = None if moved is None else (self.first[moved[0]] + moved[1] % 3, moved[2])
        self.direction: dict[str, Any] = {name: network.nodes[name].support.direction for name in self.masters}
        if moved is not None and moved[1] == 3:
            self.direction[moved[0]] = drive.direction  # type: ignore[union-attr]
        self.places = self._places()
        self.bundle = Bundle(network, self.places.origin + self.places.arm, self.beam_end)
        self._fits: dict[str, Fit] = {}
        self.scales = self._scales()
        self.base = self._base()
        self.spring_values = [self._spring(spring) for spring in network.springs]

    def position(self, node: str) -> tuple[Any, Any]:
        """Return the reference position of a node [m]."""
        return self.network.nodes[node].x, self.network.nodes[node].y

    def motion(self, node: str, value: Callable[[int], FloatArray]) -> FloatArray:
        """Return displacement and rotation of a node at n equilibria, (n, 3) [m, m, rad].

        Parameters
        ----------
        node : str
            Its name.
        value : callable
            Returns the values (n,) of a degree of freedom at the equilibria, dimensionless.
        """
        length, plan = self.scales.length, self.plan
        master = self.network.master_of(node)
        first = self.first[master]
        frame = self.direction[master]
        c, s = math.cos(frame) * length, math.sin(frame) * length
        a, b = value(first), value(first + 1)
        moved = np.empty((len(a), 3))
        moved[:, 0], moved[:, 1], moved[:, 2] = c * a - s * b, s * a + c * b, value(plan.turn[node])
        (x, y), (mx, my) = self.position(node), self.position(master)
        ax, ay = x - mx, y - my
        if ax != 0 or ay != 0:
            swing = value(plan.swing[node])
            less, across = np.cos(swing) - 1.0, np.sin(swing)
            moved[:, 0] += less * ax - across * ay
            moved[:, 1] += across * ax + less * ay
        return moved

    def supported(self, node: str) -> int:
        """Return the first degree of freedom of a node that support and drive can act on.

        Raises
        ------
        cfmkit.errors.InputError
            If there is no such node, or a link moves it.
        """
        if node in self.first:
            return self.first[node]
        if node in self.network.nodes:
            master = self.network.master_of(node)
            raise InputError(f"node {node!r} is moved by a link: what is held is its master, {master!r}")
        raise InputError(f"{node!r} is not a node; nodes: {', '.join(self.network.nodes)}")

    def beam_end_at(self, name: str, side: int) -> tuple[Any, Any]:
        """Return the reference position of a beam's end [m]."""
        beam = self.network.beams[name]
        x, y = self.position((beam.start, beam.end)[side])
        offset = (beam.start_offset, beam.end_offset)[side]
        return x + offset[0], y + offset[1]

    @property
    def fits(self) -> dict[str, Fit]:
        """How each beam is fitted between its nodes."""
        if not self._fits:
            self._fits = {name: self._fit(name) for name in self.network.beams}
        return self._fits

    @property
    def turn(self) -> float:
        """The largest turn of an unloaded beam, 0 where none is coiled up [rad]."""
        beams = [name for name, beam in self.network.beams.items() if coils(beam)]
        return max((self.fits[name].turn for name in beams), default=0.0)

    def _fit(self, name: str) -> Fit:
        known, beam = self.known, self.network.beams[name]
        if known is not None and self._ends(name) == known._ends(name) and same_value(beam, known.network.beams[name]):
            return known.fits[name]
        own = self.bundle.fit_of(name)
        if own is not None:
            return own
        (xa, ya), (xb, yb) = self._ends(name)
        return fit(beam, (xb - xa, yb - ya), None if known is None else known.fits[name])

    def _ends(self, name: str) -> Any:
        return self.beam_end_at(name, 0), self.beam_end_at(name, 1)

    @property
    def line_load(self) -> Any:
        """Dead loads along the beams [N/m], (beams, 2, 2): the constant ones, those of the drive."""
        rows: list[list[list[Any]]] = [[[0.0, 0.0], [0.0, 0.0]] for _ in self.network.beams]
        for (when, which), beam in zip(self.plan.line_load_of, self.plan.line_beam, strict=True):
            load: Any = self._given(when)[which]
            row = rows[beam][when]
            row[0], row[1] = row[0] + load.wx, row[1] + load.wy
        return np.array(rows)

    @property
    def load_values(self) -> list[tuple[int, tuple[Any, Any, Any]]]:
        """Point loads: 0 if constant, 1 if the drive's, and (fx, fy, moment) in SI."""
        loads: list[tuple[int, Any]] = [(when, self._given(when)[which]) for when, which in self.plan.load_of]
        return [(when, (load.fx, load.fy, load.moment)) for when, load in loads]

    @property
    def spring_rows(self) -> list[Any]:
        """Springs, as many as there are."""
        return self.spring_values

    @property
    def load_rows(self) -> list[Any]:
        """Point loads, as many as there are."""
        return self.load_values

    def _given(self, when: int) -> tuple[LoadOn, ...]:
        return self.network.loads if when == 0 else self.drive.loads

    @cached_property
    def units(self) -> Any:
        """Factors that make the columns of a table dimensionless, (6,), as in `network_array_types.DiscreteNetwork`.

        Thirteen where a beam is a wide strip: see `cfmkit.elastica.kernels.network_array_types.HALVES`.
        """
        length, force, turn = self.scales.length, self.scales.force, self.scales.moment
        own = [1.0, 1 / length, turn, force / length, force / length, 1 / length]
        return np.array([*own, 1.0, turn, 1.0, 1.0, turn, 1.0, 1.0] if self.bundle.wide else own)

    def _scales(self) -> Scales:
        lengths, middles = self.bundle.sizes(self.fits if self.bundle.others else None)
        length = sum(lengths.tolist()) / len(lengths)
        rigidity = math.exp(sum(map(math.log, middles.tolist())) / len(middles))
        return Scales(length, rigidity, self._drive_unit(length, rigidity))

    def _drive_unit(self, length: float, rigidity: float) -> float:
        """Return the value of the drive that counts as one."""
        if isinstance(self.drive, Displacement):
            return length
        if isinstance(self.drive, Rotation):
            return 1.0
        force = rigidity / length**2
        sizes = []
        for load in self.drive.loads:
            self.network.check_load(load)
            if isinstance(load, PointLoad):
                fx, fy, moment = load.fx.real, load.fy.real, load.moment.real
                sizes.append(max((fx * fx + fy * fy) ** 0.5 / force, abs(moment) / (force * length)))
            else:
                sizes.append(float(np.hypot(np.real(load.wx), np.real(load.wy))) * length / force)
        if not max(sizes) > 0:
            raise InputError("the loads of the drive are all zero")
        return float(1.0 / max(sizes))

    def _places(self) -> Places:
        """Return the attachments in SI."""
        plan, nodes = self.plan, self.network.nodes
        where = np.array([(node.x, node.y) for node in nodes.values()])
        origin = where[plan.place_master]
        arm = where[plan.place_node] - origin
        for k in np.flatnonzero(plan.place_offset != NOWHERE).tolist() if plan.offsets else ():
            beam = self.beams[plan.place_offset[k] // 2]
            offset = (beam.start_offset, beam.end_offset)[plan.place_offset[k] % 2]
            arm = arm + np.eye(len(arm))[:, k : k + 1] * np.array(offset)
        for k, number in plan.ground_of.items():
            origin = origin + np.eye(len(arm))[:, k : k + 1] * (np.array(self._ground(number)) - origin[k])
        return Places(plan.place_dof, self._frames(), origin, arm)

    @property
    def beams(self) -> list[Any]:
        """The beams in order."""
        return list(self.network.beams.values())

    def _frames(self) -> Any:
        """Return cos and sin of the frames of the attachments' masters."""
        if not any(self.direction.values()):
            return self.plan.level
        given = [self.direction.get(name, 0.0) for name in self.network.nodes]
        turns = np.array([*given, 0.0])[self.plan.place_master]  # GROUND is the last
        frames = np.empty((len(turns), 2), turns.dtype)
        frames[:, 0], frames[:, 1] = np.cos(turns), np.sin(turns)
        return frames

    def _ground(self, number: int) -> tuple[Any, Any]:
        """Return where a spring is held [m]."""
        spring = self.network.springs[number]
        if isinstance(spring, SlideSpring):
            return self.position(spring.node)
        return spring.ground if isinstance(spring, LineSpring) else (0.0, 0.0)

    def _base(self) -> Any:
        """Return the values at which degrees of freedom are held, [m] and [rad]."""
        base: list[Any] = [0.0] * self.dof_count
        for name in self.masters:
            first = self.first[name]
            base[first : first + 3] = self.network.nodes[name].support.displacement
        self.held = any(base)  # whether any is held away from where it rests
        return np.array(base)

    def _spring(self, spring: Spring) -> tuple[Any, Any, Any, Any]:
        """Return the values of a spring in SI."""
        if isinstance(spring, TorsionSpring):
            return spring.stiffness, spring.free_angle, 0.0, 0.0
        if isinstance(spring, SlideSpring):
            c, s = np.cos(spring.direction), np.sin(spring.direction)
            return spring.stiffness, c, s, spring.free_displacement
        free = spring.free_length
        if free is None:
            far = spring.ground if spring.end is None else self.position(spring.end)
            near = self.position(spring.start)
            free = ((far[0] - near[0]) ** 2 + (far[1] - near[1]) ** 2) ** 0.5
        return spring.stiffness, free, 0.0, 0.0

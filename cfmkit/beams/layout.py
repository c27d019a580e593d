"""The index map: from a network and a drive to the arrays of the compiled code, and the units between the two."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cfmkit.beams.beam import Fit, fit, same_value
from cfmkit.beams.drive import Displacement, Drive, Loading, Rotation
from cfmkit.beams.network import (
    LineLoad,
    LoadOn,
    Network,
    PointLoad,
    SlideSpring,
    Spring,
    TorsionSpring,
    same_direction,
)
from cfmkit.errors import InputError

_LINE, _TURN, _SLIDE = 0, 1, 2  # as in cfmkit.beams.kernels.springs


@dataclass(frozen=True)
class Scales:
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


@dataclass
class _Places:
    """Attachments as they are collected."""

    dof: list[tuple[int, int, int, int]] = field(default_factory=list)
    frame: list[tuple[float, float]] = field(default_factory=list)
    origin: list[tuple[Any, Any]] = field(default_factory=list)
    arm: list[tuple[Any, Any]] = field(default_factory=list)


class Layout:
    """Degrees of freedom of a network under a drive, in the order that the compiled code uses."""

    def __init__(self, network: Network, drive: Drive, known: Layout | None = None) -> None:
        """Number the degrees of freedom and collect the attachments.

        From a `known` layout of a similar network the fits of beams that are the same are taken over, as objects.
        """
        self.network, self.drive, self.known = network, drive, known
        self.masters = [name for name in network.nodes if network.master_of(name) == name]
        self.first = {name: 3 * i for i, name in enumerate(self.masters)}
        self.direction = {name: network.nodes[name].support.direction for name in self.masters}
        self.dof_count = 3 * len(self.masters)
        self.pin_dof: dict[tuple[str, int], int] = {}
        for name, beam in network.beams.items():
            for side, joint in enumerate((beam.start_joint, beam.end_joint)):
                if joint == "pin":
                    self.pin_dof[name, side] = self.dof_count
                    self.dof_count += 1
        self.ground = self.dof_count
        self.dof_count += 3
        self.fits = {name: self._fit(name) for name in network.beams}
        self.scales = self._scales()
        self.driven: tuple[int, float] | None = self._driven()
        self.places = _Places()
        self.beam_end = np.array(
            [[self._beam_place(name, 0), self._beam_place(name, 1)] for name in network.beams], dtype=np.int64
        )
        self.spring_rows = [self._spring(spring) for spring in network.springs]
        self._collect_loads()
        self._release()

    def position(self, node: str) -> tuple[Any, Any]:
        """Return the reference position of a node [m]."""
        return self.network.nodes[node].x, self.network.nodes[node].y

    def beam_end_at(self, name: str, side: int) -> tuple[Any, Any]:
        """Return the reference position of a beam's end [m]."""
        beam = self.network.beams[name]
        x, y = self.position((beam.start, beam.end)[side])
        offset = (beam.start_offset, beam.end_offset)[side]
        return x + offset[0], y + offset[1]

    def _fit(self, name: str) -> Fit:
        ends, known, beam = self._ends(name), self.known, self.network.beams[name]
        if known is not None and ends == known._ends(name) and same_value(beam, known.network.beams[name]):
            return known.fits[name]
        (xa, ya), (xb, yb) = ends
        return fit(beam, (xb - xa, yb - ya))

    def _ends(self, name: str) -> Any:
        return self.beam_end_at(name, 0), self.beam_end_at(name, 1)

    def _scales(self) -> Scales:
        lengths = [float(np.real(f.length)) for f in self.fits.values()]
        middles = [beam.section.rigidities(np.array([0.5]), 0.5)[0] for beam in self.network.beams.values()]
        length = float(np.mean(lengths))
        rigidity = float(np.exp(np.mean([np.log(np.real(m[0])) for m in middles])))
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
                fx, fy, moment = np.real([load.fx, load.fy, load.moment])
                sizes.append(max(np.hypot(fx, fy) / force, abs(moment) / (force * length)))
            else:
                sizes.append(float(np.hypot(np.real(load.wx), np.real(load.wy))) * length / force)
        if not max(sizes) > 0:
            raise InputError("the loads of the drive are all zero")
        return 1.0 / float(max(sizes))

    def _driven(self) -> tuple[int, float] | None:
        """Return the driven degree of freedom and its sense; turn the frame of a free node along the drive."""
        drive = self.drive
        if isinstance(drive, Loading):
            return None
        if drive.node not in self.first:
            known = ", ".join(self.masters)
            raise InputError(f"{drive.node!r} cannot be driven: nodes that are not moved by a link are {known}")
        support = self.network.nodes[drive.node].support
        if isinstance(drive, Rotation):
            if support.rotation:
                raise InputError(f"node {drive.node!r} cannot be turned: its rotation is held")
            return self.first[drive.node] + 2, 1.0
        if not support.along and not support.across:
            self.direction[drive.node] = drive.direction
            return self.first[drive.node], 1.0
        for held, other, offset, turn in (
            (support.along, support.across, 0, 0.0),
            (support.across, support.along, 1, np.pi / 2),
        ):
            if not held and other and same_direction(drive.direction, support.direction + turn):
                sense = float(np.sign(np.cos(drive.direction - np.real(support.direction) - turn)))
                return self.first[drive.node] + offset, sense
        raise InputError(f"node {drive.node!r} cannot be moved along {np.degrees(drive.direction):.6g} deg: it is held")

    def _place(self, node: str, offset: tuple[Any, Any] = (0.0, 0.0), pose_dof: int | None = None) -> int:
        """Add an attachment to a node (or to its master, with an arm); return its index."""
        master = self.network.master_of(node)
        first = self.first[master]
        (x, y), (mx, my) = self.position(node), self.position(master)
        c, s = np.cos(self.direction[master]), np.sin(self.direction[master])
        own = first + 2 if pose_dof is None else pose_dof
        self.places.dof.append((first, first + 1, first + 2, own))
        self.places.frame.append((c, s))
        self.places.origin.append((mx, my))
        self.places.arm.append((x - mx + offset[0], y - my + offset[1]))
        return len(self.places.dof) - 1

    def _ground_place(self, x: float, y: float) -> int:
        self.places.dof.append((self.ground, self.ground + 1, self.ground + 2, self.ground + 2))
        self.places.frame.append((1.0, 0.0))
        self.places.origin.append((x, y))
        self.places.arm.append((0.0, 0.0))
        return len(self.places.dof) - 1

    def _beam_place(self, name: str, side: int) -> int:
        beam = self.network.beams[name]
        node = (beam.start, beam.end)[side]
        return self._place(node, (beam.start_offset, beam.end_offset)[side], self.pin_dof.get((name, side)))

    def _spring(self, spring: Spring) -> tuple[int, int, int, tuple[Any, ...]]:
        """Return kind, the two attachments and the values of a spring in SI."""
        if isinstance(spring, TorsionSpring):
            start = self._ground_place(0.0, 0.0) if spring.start is None else self._place(spring.start)
            return _TURN, start, self._place(spring.end), (spring.stiffness, spring.free_angle, 0.0, 0.0)
        if isinstance(spring, SlideSpring):
            x, y = self.position(spring.node)
            values = (spring.stiffness, np.cos(spring.direction), np.sin(spring.direction), spring.free_displacement)
            return _SLIDE, self._ground_place(x, y), self._place(spring.node), values
        far = spring.ground if spring.end is None else self.position(spring.end)
        near = self.position(spring.start)
        free = spring.free_length
        if free is None:
            free = ((far[0] - near[0]) ** 2 + (far[1] - near[1]) ** 2) ** 0.5
        other = self._ground_place(*far) if spring.end is None else self._place(spring.end)
        return _LINE, self._place(spring.start), other, (spring.stiffness, free, 0.0, 0.0)

    def _collect_loads(self) -> None:
        """Sort the loads: constant ones and those of the drive, at points and along beams (SI)."""
        names = list(self.network.beams)
        line_load: list[list[list[Any]]] = [[[0.0, 0.0], [0.0, 0.0]] for _ in names]
        self.load_rows: list[tuple[int, int, tuple[Any, Any, Any], bool, str]] = []
        driven: tuple[LoadOn, ...] = self.drive.loads if isinstance(self.drive, Loading) else ()
        for when, loads in enumerate((self.network.loads, driven)):
            for load in loads:
                if isinstance(load, LineLoad):
                    row = line_load[names.index(load.beam)][when]
                    row[0], row[1] = row[0] + load.wx, row[1] + load.wy
                else:
                    values = (load.fx, load.fy, load.moment)
                    self.load_rows.append((self._place(load.node), when, values, load.follows, load.node))
        self.line_load = np.array(line_load)

    def _release(self) -> None:
        """Decide which degrees of freedom are free; a rotation that nothing resists or uses is held at zero."""
        free = np.zeros(self.dof_count, dtype=bool)
        base: list[Any] = [0.0] * self.dof_count
        for name in self.masters:
            support, first = self.network.nodes[name].support, self.first[name]
            free[first : first + 3] = (not support.along, not support.across, not support.rotation)
            base[first : first + 3] = support.displacement
        self.base = np.array(base)
        used = {place[3] for place in self.places.dof}
        used |= {d[2] for d, a in zip(self.places.dof, self.places.arm, strict=True) if np.any(np.real(a))}
        for place, _, values, follows, _ in self.load_rows:
            dofs = self.places.dof[place]
            if not follows and values[2] == 0 and self._only_load(dofs[3]):
                used.discard(dofs[3])
        for name in self.masters:
            rotation = self.first[name] + 2
            free[rotation] &= rotation in used
        for pin in self.pin_dof.values():
            free[pin] = True
        if self.driven is not None:
            free[self.driven[0]] = False
        self.free = free

    def _only_load(self, rotation: int) -> bool:
        """Tell whether no beam end or spring turns with this rotation."""
        places = set(self.beam_end.ravel().tolist()) | {p for row in self.spring_rows for p in row[1:3]}
        dofs, arms = self.places.dof, self.places.arm
        return not any(dofs[p][3] == rotation or (dofs[p][2] == rotation and np.any(np.real(arms[p]))) for p in places)

"""The paper's model: nine coordinates, nine constraints, forces by Lagrange multipliers.

Positions follow from the integration of the first derivatives of the constraints with
Baumgarte's stabilisation [SS, eq. 19 to 22] by the classical Runge-Kutta method, accelerations from
their second derivatives [eq. 23 to 25], the multipliers from inverse dynamics [eq. 28];
the force on the slider is minus the last one.

This is a check on `cfmkit.families.cam.dynamics.inverse`, which needs no integration. It has
no rolling resistance, like the paper's model, and starts beyond the corner of an undercut cam.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.dynamics.center import Flank
from cfmkit.families.cam.dynamics.constraints import GIVEN, HOLONOMIC, ROLLING, SIZE, Chain
from cfmkit.families.cam.dynamics.flankline import FlankLine

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.constraints import Posture
    from cfmkit.families.cam.dynamics.machine import Machine
    from cfmkit.families.cam.dynamics.motion import Cycloid
    from cfmkit.families.cam.dynamics.side import Side


@dataclass(frozen=True)
class Scheme:
    """How the equations are integrated.

    Attributes
    ----------
    steps : int
        Runge-Kutta steps between two points of output.
    stabilisation : float
        Baumgarte's beta times the duration of the motion; beta times a step must stay below 2.785.
    """

    steps: int = 4
    stabilisation: float = 10.0


class CornerContact(ValueError):
    """The motion includes the corner of the cam, where the flank is not a function x(y)."""


@dataclass(frozen=True)
class Trajectory:
    """What the integration and the inverse dynamics give at n times.

    Attributes
    ----------
    times : (n,) array
        [s].
    coordinates, velocities, accelerations : (n, 9) array
        s2, theta3, theta4, xi4, y4, theta5, theta6, xi6, y6 [m, rad, s].
    multipliers : (n, 9) array
        Of six holonomic constraints, two rolling constraints and the motion.
    residual : float
        Largest violation of a holonomic constraint [m].
    postures : (Posture, Posture)
        Right and left, at the same times.
    """

    times: FloatArray
    coordinates: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
    multipliers: FloatArray
    residual: float
    postures: tuple[Posture, Posture]

    @property
    def force(self) -> FloatArray:
        """Force on the slider [N]."""
        return -self.multipliers[:, GIVEN]


class NineCoordinates:
    """The mechanism as five moving bodies on two flanks.

    Parameters
    ----------
    machine : Machine
        Its friction is not used.
    """

    def __init__(self, machine: Machine) -> None:
        """Describe each flank as a line x(y)."""
        self.machine = machine
        self.chains = (_chain(machine.right, 1.0), _chain(machine.left, -1.0))

    def run(self, motion: Cycloid, points: int, scheme: Scheme | None = None, first: int | None = None) -> Trajectory:
        """Return the motion and its multipliers at equally spaced times, or at the `first` of them only.

        Raises
        ------
        CornerContact
            If a roller begins or ends on the corner of its cam.
        """
        scheme = scheme or Scheme()
        times = motion.times(points)[:first]
        points = len(times)
        start, contacts = self._start(motion, times)
        coordinates, contacts = self._integrate(motion, times, (start, contacts), scheme)
        postures = self.postures(coordinates, contacts)
        jacobian = self.jacobian(postures, (points,))
        position, speed, push = motion.at(times)
        driven = np.zeros((points, SIZE))
        residual = self.residual(coordinates, postures)
        driven[:, HOLONOMIC] = -scheme.stabilisation / motion.time * residual[:, HOLONOMIC]
        driven[:, GIVEN] = speed - scheme.stabilisation / motion.time * (coordinates[:, 0] - position)
        velocities = _solve(jacobian, driven)
        needed = -self.quadratic(postures, velocities)
        needed[:, GIVEN] += push
        accelerations = _solve(jacobian, needed)
        applied = self.applied(coordinates, velocities, postures)
        inertia = np.einsum("nij,nj->ni", self.mass(coordinates, postures), accelerations)
        multipliers = _solve(np.swapaxes(jacobian, 1, 2), applied - inertia)
        worst = float(np.abs(residual[:, HOLONOMIC]).max())
        return Trajectory(times, coordinates, velocities, accelerations, multipliers, worst, postures)

    def postures(self, x: FloatArray, contacts: Any) -> tuple[Posture, Posture]:
        """Return the posture of both sides; `contacts` are estimates of the path coordinates at contact [m]."""
        right, left = self.chains
        return right.posture(x, contacts[0]), left.posture(x, contacts[1])

    def residual(self, x: FloatArray, postures: tuple[Posture, Posture]) -> FloatArray:
        """Return the holonomic constraints in their rows; zero in the other rows."""
        out = np.zeros(x.shape)
        for chain, posture in zip(self.chains, postures, strict=True):
            chain.residual(x, posture, out)
        return out

    def jacobian(self, postures: tuple[Posture, Posture], shape: tuple[int, ...] = ()) -> FloatArray:
        """Return D [SS, eq. 27]."""
        out = np.zeros((*shape, SIZE, SIZE))
        for chain, posture in zip(self.chains, postures, strict=True):
            chain.jacobian(posture, out)
        out[..., GIVEN, 0] = 1.0
        return out

    def quadratic(self, postures: tuple[Posture, Posture], velocity: FloatArray) -> FloatArray:
        """Return the part of the constraints' second time derivative that is quadratic in the velocities."""
        out = np.zeros(velocity.shape)
        for chain, posture in zip(self.chains, postures, strict=True):
            chain.quadratic(posture, velocity, out)
        return out

    def mass(self, x: FloatArray, postures: tuple[Posture, Posture]) -> FloatArray:
        """Return the mass matrix m(x)."""
        out = np.zeros((*x.shape, SIZE))
        out[..., 0, 0] = self.machine.slider_mass
        for chain, posture, side in zip(self.chains, postures, self.sides, strict=True):
            brace, roller = chain.columns.start, chain.columns.start + 1
            parts = side.parts
            first = parts.brace_length * (0.5 * parts.brace_mass + parts.roller_mass)
            out[..., 0, 0] += parts.brace_mass + parts.roller_mass
            out[..., 0, brace] = out[..., brace, 0] = first * posture.cos
            second = parts.brace_length**2 * (0.25 * parts.brace_mass + parts.roller_mass)
            out[..., brace, brace] = parts.brace_inertia + second
            out[..., roller, roller] = parts.roller_inertia
        return out

    def applied(self, x: FloatArray, velocity: FloatArray, postures: tuple[Posture, Posture]) -> FloatArray:
        """Return q(x, x'): weight, springs, and what the mass matrix owes to its dependence on the braces' angles."""
        machine, out = self.machine, np.zeros(x.shape)
        out[..., 0] = -machine.gravity * machine.slider_mass
        right, left = (
            side.parts.brace_length * (p.cos + 1j * p.sin) for side, p in zip(self.sides, postures, strict=True)
        )
        gap = right - left
        distance = np.abs(gap)
        pull = machine.stiffness * np.maximum(distance - machine.rest_length, 0.0) * gap / distance
        for chain, posture, side, arm in zip(self.chains, postures, self.sides, (right, -left), strict=True):
            parts, brace = side.parts, chain.columns.start
            first = parts.brace_length * (0.5 * parts.brace_mass + parts.roller_mass)
            out[..., 0] += first * posture.sin * velocity[..., brace] ** 2
            out[..., 0] -= machine.gravity * (parts.brace_mass + parts.roller_mass)
            out[..., brace] = -machine.gravity * first * posture.cos - (np.conj(1j * arm) * pull).real
        return out

    @property
    def sides(self) -> tuple[Side, Side]:
        """The right and the left side."""
        return self.machine.right, self.machine.left

    def _start(self, motion: Cycloid, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return coordinates that meet the constraints at the beginning [SS, eq. 18], and the path coordinates."""
        ends = motion.at(times[[0, -1]]).position
        stances = self.machine.stances(ends)
        if any(stance.on_corner.any() for stance in stances):
            raise CornerContact
        x, contacts = np.zeros(SIZE), np.zeros(2)
        x[0] = motion.start
        for index, (chain, stance) in enumerate(zip(self.chains, stances, strict=True)):
            inwards = 1j * stance.tangent[0]
            brace, touch = stance.center[0] - 1j * motion.start, stance.center[0] + chain.radius * inwards
            contacts[index] = chain.line.estimate(touch.imag)
            known = np.pi if chain.hand > 0 else 0.0
            angles = [_angle(chain.hand, brace), _angle(chain.hand, inwards) - known, known]
            x[chain.columns] = [*angles, touch.imag]
        free = [1, 2, 4, 5, 6, 8]
        for _ in range(4):
            postures = self.postures(x, contacts)
            step = np.linalg.solve(self.jacobian(postures)[HOLONOMIC][:, free], self.residual(x, postures)[HOLONOMIC])
            x[free] -= step
        return x, np.array([posture.flank.parameter for posture in self.postures(x, contacts)])

    def _integrate(
        self, motion: Cycloid, times: FloatArray, start: tuple[FloatArray, FloatArray], scheme: Scheme
    ) -> tuple[FloatArray, FloatArray]:
        """Return coordinates (n, 9) and path coordinates at contact (2, n) at the times, by Runge-Kutta's method."""
        rate = self._rate(motion, scheme, start[1])
        step = float(times[1]) / scheme.steps
        x: Any = start[0]
        found, touched = [x], [start[1]]
        for index in range((len(times) - 1) * scheme.steps):
            t = index * step
            first, _ = rate(t, x)
            second, _ = rate(t + 0.5 * step, x + 0.5 * step * first)
            third, _ = rate(t + 0.5 * step, x + 0.5 * step * second)
            fourth, contacts = rate(t + step, x + step * third)
            x = x + (step / 6.0) * (first + 2.0 * (second + third) + fourth)
            if (index + 1) % scheme.steps == 0:
                found.append(x)
                touched.append(contacts)
        return np.array(found), np.array(touched).T

    def _rate(
        self, motion: Cycloid, scheme: Scheme, contacts: FloatArray
    ) -> Callable[[float, FloatArray], tuple[FloatArray, FloatArray]]:
        """Return the function that gives x' [SS, eq. 19 to 21] and the path coordinates at contact."""
        beta = scheme.stabilisation / motion.time
        known = [float(contacts[0]), float(contacts[1])]

        def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
            postures = self.postures(x, known)
            known[:] = [float(posture.flank.parameter) for posture in postures]
            position, speed, _ = motion.at(np.float64(t))
            right = -beta * self.residual(x, postures)
            right[ROLLING] = 0.0
            right[GIVEN] = speed - beta * (x[0] - position)
            return _solve(self.jacobian(postures), right), np.array(known)

        return rate


def _chain(side: Side, hand: float) -> Chain:
    flank = side.pieces[-1]
    if not isinstance(flank, Flank):
        raise TypeError("the last piece of a roller's curve must run along the flank")
    distance = flank.shift - side.parts.roller_radius
    line = FlankLine(flank.profile.path, distance, side.angle, side.height, flank.ends)
    return Chain(hand, side.parts.brace_length, side.parts.roller_radius, line)


def _angle(hand: float, direction: complex) -> float:
    """Return the angle of a direction; on the left, of its mirror image."""
    return float(np.angle(direction if hand > 0 else -direction.conjugate()))


def _solve(matrices: FloatArray, right: FloatArray) -> FloatArray:
    solution: Any = np.linalg.solve(matrices, right[..., None])[..., 0]
    return np.asarray(solution, dtype=np.float64)

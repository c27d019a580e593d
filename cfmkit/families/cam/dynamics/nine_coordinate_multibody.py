"""Cam dynamics by Lagrange multipliers in nine coordinates [SS]: the method `multibody`, and a check of `inverse`.

The coordinates are x = (s2, theta3, theta4, xi4, y4, theta5, theta6, xi6, y6) [SS, eq. 4]:
slider, right brace, right roller, its contact seen from the roller, height of the contact
on the right flank, and the same on the left. Rows: six holonomic constraints [SS, eq. 5],
of which the first and third block are plane vectors (the paper writes a third component
that is always zero), two rolling constraints [eq. 15] and the given motion [eq. 16]; their
Jacobians and second time derivatives are analytic.

Positions follow from the integration of the first derivatives of the constraints with
Baumgarte's stabilisation [SS, eq. 19 to 22] by the classical Runge-Kutta method, accelerations from
their second derivatives [eq. 23 to 25], the multipliers from inverse dynamics [eq. 28];
the force on the slider is minus the last one.

The rows of the closure and of rolling act where roller and flank touch, so that the cam
pushes the roller with -(lambda_x, lambda_y) - lambda_roll (dx/dy, 1). The pins follow from the
balance of roller and brace. Left vectors are given as on the right, in a mirror.

`cfmkit.families.cam.dynamics.inverse` needs no integration. This model has
no rolling resistance, like the paper's, and starts beyond the corner of an undercut cam.

Everything works for one vector of coordinates and for many, (..., 9).

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 4.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.families.cam.dynamics.axis_springs import AxisGap

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.roller_curves_and_motion import Cycloid, Machine, Side
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile, ParallelPoints
    from cfmkit.families.cam.geometry.slope_law import Real, SlopeLaw

    ComplexArray = NDArray[np.complex128]


N_KNOTS = 65
NEWTON_STEPS = 30  # turned flanks of the tests take five from the estimates by 65 knots
N_COORDINATES = 9
HOLONOMIC_ROWS, ROLLING_ROWS, DRIVE_ROW = slice(0, 6), slice(6, 8), 8


def _slope_second_derivative(law: SlopeLaw, x: Real) -> Real:
    """Return d3y/dx3 of the roller path [1/m^2]."""
    rise, bow = law.rise_and_bow(x)
    turn = 1.0 - law.friction * law.frictionless(x)
    second: Real = (1.0 + law.friction**2) * (bow + 2.0 * law.friction * rise * rise / turn) / (turn * turn)
    return second


class FlankPoint(NamedTuple):
    """A point of the flank, or arrays of points: path coordinate and x [m], dx/dy and its derivatives by y."""

    parameter: Any
    x: Any
    first: Any
    second: Any
    third: Any


@dataclass(frozen=True)
class FlankLine:
    """The flank of a side as the paper needs it: its x as a function of its height y, with three derivatives.

    With tau the angle of the tangent from the x-axis, k the flank's curvature and k_s its derivative along the flank
    dx/dy = cot tau, d2x/dy2 = -k / sin^3 tau, d3x/dy3 = -k_s / sin^4 tau + 3 k^2 cos tau / sin^5 tau. Only the point
    that belongs to y needs Newton's method. The corner of an undercut cam cannot be described so.
    """

    profile: CamProfile
    distance: float  # from the roller path to the flank, negative inwards [m]
    # angle, height: as of a `Side`
    angle: float
    height: float

    def evaluate(self, u: Any) -> tuple[Any, Any, ParallelPoints]:
        """Return points and tangents of the turned flank for path coordinates u [m], and those before it is turned."""
        line, turn = self.profile.parallel(u, self.distance), cmath.exp(1j * self.angle)
        point, tangent = line.x + 1j * (line.y - self.height), (1.0 + 1j * line.slope) / line.length
        return point * turn, tangent * turn, line

    def estimate(self, y: float) -> float:
        """Return a rough path coordinate of the point at height y [m]."""
        u = np.linspace(self.profile.start, self.profile.end, N_KNOTS)
        return float(np.interp(y, self.evaluate(u)[0].imag, u))

    def locate(self, y: Real, guess: Real) -> FlankPoint:
        """Return the points of the flank at heights y [m], starting the search at path coordinates `guess` [m]."""
        law, u = self.profile.path.law, guess
        for _ in range(NEWTON_STEPS):
            point, tangent, line = self.evaluate(u)
            step = (point.imag - y) / (line.length * line.stretch * tangent.imag)
            u = u - step
            if np.max(np.abs(step)) <= 1e-16 + 4e-16 * law.brace_length:
                break
        point, tangent, line = self.evaluate(u)
        bend, square = line.curvature * line.length**3, line.length * line.length
        change = (_slope_second_derivative(law, u) - 3.0 * line.slope * bend * bend / square) / (square * square)
        cosine, sine, curvature = tangent.real, tangent.imag, line.curvature / line.stretch
        third = (3.0 * curvature * curvature * cosine / sine - change / line.stretch**3) / sine**4
        return FlankPoint(u, point.real, cosine / sine, -curvature / sine**3, third)


class Posture(NamedTuple):
    """Sines and cosines of a side: of its brace, and of the direction from roller axis to contact; and the flank."""

    sin: Any
    cos: Any
    contact_sin: Any
    contact_cos: Any
    flank: FlankPoint


@dataclass(frozen=True)
class SideChain:
    """One side: brace, roller, flank."""

    hand: float  # 1 on the right, -1 on the left: the left flank is the mirror image of `line`
    # length, radius: of brace and roller [m]
    length: float
    radius: float
    line: FlankLine  # the flank, as on the right

    @property
    def columns(self) -> slice:
        """Indices of this side's four coordinates."""
        return slice(1, 5) if self.hand > 0 else slice(5, 9)

    @property
    def rows(self) -> tuple[int, int, int, int]:
        """Indices of this side's constraints: x and y of the closure, tangency, rolling."""
        return (0, 1, 2, 6) if self.hand > 0 else (3, 4, 5, 7)

    def posture(self, x: FloatArray, guess: Any) -> Posture:
        """Return the angles and the contact of this side."""
        brace, roller, contact, height = np.moveaxis(x[..., self.columns], -1, 0)
        turned = roller + contact
        flank = self.line.locate(height, guess)
        return Posture(np.sin(brace), np.cos(brace), np.sin(turned), np.cos(turned), flank)

    def residual(self, x: FloatArray, at: Posture, out: FloatArray) -> None:
        """Write the three holonomic constraints [SS, eq. 5]."""
        i, j, k, _ = self.rows
        out[..., i] = self.length * at.cos + self.radius * at.contact_cos - self.hand * at.flank.x
        height = x[..., self.columns.stop - 1]
        out[..., j] = x[..., 0] + self.length * at.sin + self.radius * at.contact_sin - height
        out[..., k] = self.radius * (self.hand * at.flank.first * at.contact_cos + at.contact_sin)

    def jacobian(self, at: Posture, out: FloatArray) -> None:
        """Write the rows of the Jacobian that belong to this side [SS, eq. 27]."""
        i, j, k, roll = self.rows
        brace, roller, contact, height = range(self.columns.start, self.columns.stop)
        length, radius, steep = self.length, self.radius, self.hand * at.flank.first
        out[..., i, brace] = -length * at.sin
        out[..., i, roller] = out[..., i, contact] = -radius * at.contact_sin
        out[..., i, height] = -steep
        out[..., j, 0] = 1.0
        out[..., j, brace] = length * at.cos
        out[..., j, roller] = out[..., j, contact] = radius * at.contact_cos
        out[..., j, height] = -1.0
        out[..., k, roller] = out[..., k, contact] = radius * (at.contact_cos - steep * at.contact_sin)
        out[..., k, height] = self.hand * radius * at.flank.second * at.contact_cos
        out[..., roll, 0] = 1.0
        out[..., roll, brace] = length * (at.cos - steep * at.sin)
        out[..., roll, roller] = radius * (at.contact_cos - steep * at.contact_sin)

    def quadratic(self, at: Posture, velocity: FloatArray, out: FloatArray) -> None:
        """Write d/dx (D x') x', what the second time derivative has beside D x'' [SS, eq. 23 and 24]."""
        i, j, k, roll = self.rows
        brace, roller, contact, height = np.moveaxis(velocity[..., self.columns], -1, 0)
        turned, hand, flank = roller + contact, self.hand, at.flank
        length, radius, steep = self.length, self.radius, hand * flank.first
        steepening = hand * flank.second * height
        out[..., i] = -length * at.cos * brace**2 - radius * at.contact_cos * turned**2 - steepening * height
        out[..., j] = -length * at.sin * brace**2 - radius * at.contact_sin * turned**2
        out[..., k] = radius * (
            hand * flank.third * at.contact_cos * height**2
            - 2.0 * steepening * at.contact_sin * turned
            - (steep * at.contact_cos + at.contact_sin) * turned**2
        )
        swing, spin = length * brace, radius * roller
        out[..., roll] = (
            -steepening * (swing * at.sin + spin * at.contact_sin)
            - swing * brace * (steep * at.cos + at.sin)
            - spin * turned * (steep * at.contact_cos + at.contact_sin)
        )


@dataclass(frozen=True)
class Scheme:
    """Options of the integration."""

    steps: int = 4  # runge-Kutta steps between two points of output
    # baumgarte's beta times the duration of the motion; beta times a step must stay below 2.785
    stabilisation: float = 10.0


class CornerContact(ValueError):
    """The motion includes the corner of the cam, where the flank is not a function x(y)."""


@dataclass(frozen=True)
class Trajectory:
    """Results of the integration and of the inverse dynamics at n times."""

    times: FloatArray  # (n,) [s]
    # coordinates, velocities, accelerations, (n, 9): s2, theta3, theta4, xi4, y4, theta5, theta6, xi6, y6 [m, rad, s]
    coordinates: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
    multipliers: FloatArray  # (n, 9) of six holonomic constraints, two rolling constraints and the motion
    residual: float  # largest violation of a holonomic constraint [m]
    postures: tuple[Posture, Posture]  # right and left, at the same times

    @property
    def force(self) -> FloatArray:
        """Force on the slider [N]."""
        return -self.multipliers[:, DRIVE_ROW]


class NineCoordinates:
    """The mechanism as five moving bodies on two flanks, without friction."""

    def __init__(self, machine: Machine) -> None:
        """Describe each flank as a line x(y)."""
        self.machine = machine
        self.chains = (_make_side_chain(machine.right, 1.0), _make_side_chain(machine.left, -1.0))

    def run(self, motion: Cycloid, points: int, scheme: Scheme | None = None, first: int | None = None) -> Trajectory:
        """Return the motion and its multipliers at equally spaced times, or at the `first` of them only.

        Raises CornerContact if a roller begins or ends on the corner of its cam.
        """
        scheme = scheme or Scheme()
        times = motion.times(points)[:first]
        points = len(times)
        start, contacts = self._start(motion, times)
        coordinates, contacts = self._integrate(motion, times, (start, contacts), scheme)
        postures = self.postures(coordinates, contacts)
        jacobian = self.jacobian(postures, (points,))
        position, speed, push = motion.evaluate(times)
        driven = np.zeros((points, N_COORDINATES))
        residual = self.residual(coordinates, postures)
        driven[:, HOLONOMIC_ROWS] = -scheme.stabilisation / motion.time * residual[:, HOLONOMIC_ROWS]
        driven[:, DRIVE_ROW] = speed - scheme.stabilisation / motion.time * (coordinates[:, 0] - position)
        velocities = _solve_systems(jacobian, driven)
        needed = -self.quadratic(postures, velocities)
        needed[:, DRIVE_ROW] += push
        accelerations = _solve_systems(jacobian, needed)
        applied = self.compute_forces(coordinates, velocities, postures)
        inertia = np.einsum("nij,nj->ni", self.mass(coordinates, postures), accelerations)
        multipliers = _solve_systems(np.swapaxes(jacobian, 1, 2), applied - inertia)
        worst = float(np.abs(residual[:, HOLONOMIC_ROWS]).max())
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
        out = np.zeros((*shape, N_COORDINATES, N_COORDINATES))
        for chain, posture in zip(self.chains, postures, strict=True):
            chain.jacobian(posture, out)
        out[..., DRIVE_ROW, 0] = 1.0
        return out

    def quadratic(self, postures: tuple[Posture, Posture], velocity: FloatArray) -> FloatArray:
        """Return the part of the constraints' second time derivative that is quadratic in the velocities."""
        out = np.zeros(velocity.shape)
        for chain, posture in zip(self.chains, postures, strict=True):
            chain.quadratic(posture, velocity, out)
        return out

    def mass(self, x: FloatArray, postures: tuple[Posture, Posture]) -> FloatArray:
        """Return the mass matrix m(x)."""
        out = np.zeros((*x.shape, N_COORDINATES))
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

    def compute_forces(self, x: FloatArray, velocity: FloatArray, postures: tuple[Posture, Posture]) -> FloatArray:
        """Return q(x, x'): weight, springs, and what the mass matrix owes to its dependence on the braces' angles."""
        machine, out = self.machine, np.zeros(x.shape)
        out[..., 0] = -machine.gravity * machine.slider_mass
        spring = self.spring_force(x, velocity)
        for chain, posture, side, pull in zip(self.chains, postures, self.sides, (spring, -spring), strict=True):
            parts, brace = side.parts, chain.columns.start
            first = parts.brace_length * (0.5 * parts.brace_mass + parts.roller_mass)
            out[..., 0] += first * posture.sin * velocity[..., brace] ** 2
            out[..., 0] -= machine.gravity * (parts.brace_mass + parts.roller_mass)
            axis_by_angle = 1j * parts.brace_length * (posture.cos + 1j * posture.sin)
            out[..., brace] = (np.conj(axis_by_angle) * pull).real - machine.gravity * first * posture.cos
        return out

    def spring_force(self, x: FloatArray, velocity: FloatArray) -> Any:
        """Return the force of the springs on the axis of the right roller, a complex number [N]."""
        columns = [chain.columns.start for chain in self.chains]
        arms = [chain.length * np.exp(1j * x[..., column]) for chain, column in zip(self.chains, columns, strict=True)]
        swings = [1j * arm * velocity[..., column] for arm, column in zip(arms, columns, strict=True)]
        return self.machine.springs.force(AxisGap(arms[0] - arms[1], swings[0] - swings[1]))

    @property
    def sides(self) -> tuple[Side, Side]:
        """The right and the left side."""
        return self.machine.right, self.machine.left

    def _start(self, motion: Cycloid, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return coordinates that meet the constraints at the beginning [SS, eq. 18], and the path coordinates."""
        ends = motion.evaluate(times[[0, -1]]).position
        stances = self.machine.stances(ends)
        if any(stance.on_corner.any() for stance in stances):
            raise CornerContact
        x, contacts = np.zeros(N_COORDINATES), np.zeros(2)
        x[0] = motion.start
        for index, (chain, stance) in enumerate(zip(self.chains, stances, strict=True)):
            inwards = 1j * stance.tangent[0]
            brace, touch = stance.center[0] - 1j * motion.start, stance.center[0] + chain.radius * inwards
            contacts[index] = chain.line.estimate(touch.imag)
            contact_angle = np.pi if chain.hand > 0 else 0.0
            angles = [_angle(chain.hand, brace), _angle(chain.hand, inwards) - contact_angle, contact_angle]
            x[chain.columns] = [*angles, touch.imag]
        free = [1, 2, 4, 5, 6, 8]
        for _ in range(4):
            postures = self.postures(x, contacts)
            step = np.linalg.solve(
                self.jacobian(postures)[HOLONOMIC_ROWS][:, free], self.residual(x, postures)[HOLONOMIC_ROWS]
            )
            x[free] -= step
        return x, np.array([posture.flank.parameter for posture in self.postures(x, contacts)])

    def _integrate(
        self, motion: Cycloid, times: FloatArray, start: tuple[FloatArray, FloatArray], scheme: Scheme
    ) -> tuple[FloatArray, FloatArray]:
        """Return coordinates (n, 9) and path coordinates at contact (2, n) at the times, by Runge-Kutta's method."""
        rate = self._rate(motion, scheme, start[1])
        step = float(times[1]) / scheme.steps
        x: Any = start[0]
        coordinates, touched = [x], [start[1]]
        for index in range((len(times) - 1) * scheme.steps):
            t = index * step
            first, _ = rate(t, x)
            second, _ = rate(t + 0.5 * step, x + 0.5 * step * first)
            third, _ = rate(t + 0.5 * step, x + 0.5 * step * second)
            fourth, contacts = rate(t + step, x + step * third)
            x = x + (step / 6.0) * (first + 2.0 * (second + third) + fourth)
            if (index + 1) % scheme.steps == 0:
                coordinates.append(x)
                touched.append(contacts)
        return np.array(coordinates), np.array(touched).T

    def _rate(
        self, motion: Cycloid, scheme: Scheme, contacts: FloatArray
    ) -> Callable[[float, FloatArray], tuple[FloatArray, FloatArray]]:
        """Return the function that gives x' [SS, eq. 19 to 21] and the path coordinates at contact."""
        beta = scheme.stabilisation / motion.time
        last_contacts = [float(contacts[0]), float(contacts[1])]

        def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
            postures = self.postures(x, last_contacts)
            last_contacts[:] = [float(posture.flank.parameter) for posture in postures]
            position, speed, _ = motion.evaluate(np.float64(t))
            right = -beta * self.residual(x, postures)
            right[ROLLING_ROWS] = 0.0
            right[DRIVE_ROW] = speed - beta * (x[0] - position)
            return _solve_systems(self.jacobian(postures), right), np.array(last_contacts)

        return rate


def _make_side_chain(side: Side, hand: float) -> SideChain:
    distance = side.track.shift - side.parts.roller_radius
    line = FlankLine(side.track.profile, distance, side.angle, side.height)
    return SideChain(hand, side.parts.brace_length, side.parts.roller_radius, line)


def _angle(hand: float, direction: complex) -> float:
    """Return the angle of a direction; on the left, of its mirror image."""
    return float(np.angle(direction if hand > 0 else -direction.conjugate()))


def _solve_systems(matrices: FloatArray, right: FloatArray) -> FloatArray:
    solution: Any = np.linalg.solve(matrices, right[..., None])[..., 0]
    return np.asarray(solution, dtype=np.float64)


def reactions(model: NineCoordinates, trajectory: Trajectory) -> tuple[NDArray[Any], ...]:
    """Return the forces of both sides (right, left), each (2, n), x outwards.

    `center` of the roller [m], normal `contact` force and `traction` along the way up [N], force on the
    brace at the roller and at the slider [N], `spin` of the roller, positive on the way up [rad/s].
    """
    pull = model.spring_force(trajectory.coordinates, trajectory.velocities)
    sides = (_react(model, trajectory, index, springs) for index, springs in enumerate((pull, pull.conj())))
    return tuple(np.array(pair) for pair in zip(*sides, strict=True))


def _react(model: NineCoordinates, trajectory: Trajectory, index: int, springs: ComplexArray) -> tuple[Any, ...]:
    """Return roller centre, contact force, traction, forces on the brace and spin of one side, (n,) each."""
    chain, posture, parts = model.chains[index], trajectory.postures[index], model.sides[index].parts
    i, j, _, roll = chain.rows
    multipliers, column, steep = trajectory.multipliers, chain.columns.start, chain.hand * posture.flank.first
    push = -(multipliers[:, i] + 1j * multipliers[:, j]) - multipliers[:, roll] * (steep + 1j)  # of the cam
    angle, rate = trajectory.coordinates[:, column], trajectory.velocities[:, column]
    arm = parts.brace_length * np.exp(1j * angle)
    bent = arm * (1j * trajectory.accelerations[:, column] - rate * rate)
    if chain.hand < 0:  # as seen in a mirror
        push, arm, bent = (-vector.conj() for vector in (push, arm, bent))
    tangent = (posture.flank.first + 1j) / np.sqrt(1.0 + posture.flank.first**2)
    lift = 1j * (trajectory.accelerations[:, 0] + model.machine.gravity)
    roller_pin = push + springs - parts.roller_mass * (bent + lift)
    slider_pin = parts.brace_mass * (0.5 * bent + lift) - roller_pin
    center, spin = 1j * trajectory.coordinates[:, 0] + arm, chain.hand * trajectory.velocities[:, column + 1]
    return center, (push * (-1j * tangent).conj()).real, (push * tangent.conj()).real, roller_pin, slider_pin, spin

"""Kinematics and forces of a cam mechanism for a given motion of its slider, from its position alone; also at rest.

The mechanism has one degree of freedom, so every velocity is a known function of the slider's position times its speed.
With C the roller's centre, t the unit tangent of its curve, k the curvature, sigma the arc length, d = C - i S the
brace (complex numbers, ' = d/dS):

    sigma'  = Im d / Re(conj(d) t)                                from |d| = L
    sigma'' = -(|d'|^2 + k sigma'^2 Re(conj(d) i t)) / Re(conj(d) t)

and C' = t sigma', C'' = t sigma'' + i k t sigma'^2. Rolling without slip is integrable in the plane: the roller turns
by sigma / r. With all accelerations known, the balance of each brace about the slider's pin gives the contact force,
that of the roller the force at its axis, that of the brace the force at the pin, and that of the slider the force
wanted: side by side, without symmetry, and with nothing to integrate. The power of all forces is the rate of the energy
(`MotionResponse.energy`), which the tests use as a check.

Rolling resistance, which the multibody model of [SS] lacks, is that of the quasi-static
model: a force mu N against the motion of the roller's centre.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.families.cam.dynamics.axis_springs import AxisGap
from cfmkit.families.cam.dynamics.roller_curves_and_motion import SliderState

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.roller_curves_and_motion import Machine, SideParts, Stance

    ComplexArray = NDArray[np.complex128]


class Kinematics(NamedTuple):
    """Both sides (right, left; x outwards) at n positions of the slider, each (2, n); ' is d/d(slider).

    `center` C [m], `tangent` t, `brace` d [m], `lever` Re(conj(d) t) [m]; `arc_slope` sigma',
    `arc_bend` sigma'' [1/m]; `center_slope` C', `center_bend` C'' [1/m]; `angle_slope`, `angle_bend`: first and second
    derivative of the brace's angle [rad/m, rad/m^2].
    """

    center: ComplexArray
    tangent: ComplexArray
    brace: ComplexArray
    lever: FloatArray
    arc_slope: FloatArray
    arc_bend: FloatArray
    center_slope: ComplexArray
    center_bend: ComplexArray
    angle_slope: FloatArray
    angle_bend: FloatArray


class MovingLoads(NamedTuple):
    """Forces on rollers and braces beside the contact, each (2, n).

    `roller`, `middle`: acceleration of the roller's axis and of the brace's middle, weight
    counted as acceleration [m/s^2]; `turning`: angular acceleration of the brace [rad/s^2];
    `rolling`: force that speeds up the roller's spin, along the tangent [N]; `springs`: on the roller [N].
    """

    roller: ComplexArray
    middle: ComplexArray
    turning: FloatArray
    rolling: FloatArray
    springs: ComplexArray


@dataclass(frozen=True)
class MotionResponse:
    """Forces and speeds of a motion; rows of (2, n) arrays are right and left, x outwards."""

    # machine, slider: what was asked
    machine: Machine
    slider: SliderState
    at: Kinematics  # how the sides follow the slider
    force: FloatArray  # (n,) on the slider, upwards [N]
    # contact, traction, (2, n): normal and tangential force of the cam on a roller [N]; traction along the way up
    contact: FloatArray
    traction: FloatArray
    # roller_pin, slider_pin, (2, n): force on a brace at the roller's axis and at the slider [N]
    roller_pin: ComplexArray
    slider_pin: ComplexArray
    on_corner: NDArray[np.bool_]  # (n,) whether a roller pivots on the corner of its cam

    @cached_property
    def spin(self) -> FloatArray:
        """Speed at which each roller turns, positive on the way up, (2, n) [rad/s]."""
        spin: FloatArray = self.at.arc_slope * self.slider.speed / self.machine.parts.roller_radius
        return spin

    @cached_property
    def guide(self) -> FloatArray:
        """Force of the slider's guide on it, to the right, (n,) [N]: zero where both sides are alike."""
        side = self.slider_pin.real
        guide: FloatArray = side[0] - side[1] - self.machine.slider_mass * self.machine.sideways
        return guide

    @cached_property
    def axis_distance(self) -> FloatArray:
        """Distance of the axes of the rollers, (n,) [m]."""
        distance: FloatArray = np.abs(self.at.center[0] + self.at.center[1].conj())
        return distance

    @cached_property
    def elongation(self) -> FloatArray:
        """Elongation of the springs, (n,) [m]."""
        elongation: FloatArray = self.machine.springs.elongation(self.axis_distance)
        return elongation

    @cached_property
    def mass(self) -> FloatArray:
        """Mass that moved with the slider would have the same kinetic energy, (n,) [kg]."""
        parts, at = self.machine.parts, self.at
        roller = (parts.roller_mass + parts.roller_inertia / parts.roller_radius**2) * at.arc_slope**2
        brace = parts.brace_mass * np.abs(at.center_slope + 1j) ** 2 / 4.0 + parts.brace_inertia * at.angle_slope**2
        total: FloatArray = self.machine.slider_mass + (roller + brace).sum(axis=0)
        return total

    @cached_property
    def energy(self) -> FloatArray:
        """Kinetic and potential energy, (n,) [J]."""
        parts, machine, position = self.machine.parts, self.machine, self.slider.position
        center = self.at.center.imag
        lifted = parts.roller_mass * center + parts.brace_mass * (center + position) / 2.0
        height = machine.slider_mass * position + lifted.sum(axis=0)
        potential = machine.gravity * height + machine.springs.energy(self.axis_distance)
        if machine.sideways:
            outward = (parts.roller_mass + 0.5 * parts.brace_mass) * self.at.center.real
            potential = potential - machine.sideways * (outward[0] - outward[1])
        total: FloatArray = potential + self.mass * self.slider.speed**2 / 2.0
        return total


def respond(machine: Machine, slider: SliderState) -> MotionResponse:
    """Return the forces of a motion of the slider, at positions within ``machine.span``.

    Speeds are of one sign: rolling resistance acts against the motion, also where it begins and ends.
    """
    parts, stances = machine.parts, machine.stances(slider.position)
    at = kinematics(stances, slider.position, parts.brace_length)
    loads = _loads(machine, parts, at, slider)
    free = loads.springs - parts.roller_mass * loads.roller - loads.rolling * at.tangent
    middle = parts.brace_mass * loads.middle
    balance = parts.brace_inertia * loads.turning + _cross_product(at.brace, 0.5 * middle - free)
    traction = loads.rolling
    if machine.friction:
        resistance = -machine.friction if slider.speed.sum() < 0 else machine.friction
        lever = at.lever + resistance * _cross_product(at.brace, at.tangent)
        contact = np.where(lever < 0, -balance / lever, np.nan)  # else friction holds the roller
        free, traction = free - resistance * contact * at.tangent, traction + resistance * contact
    else:
        contact = -balance / at.lever
    roller_pin = free - 1j * contact * at.tangent
    slider_pin = middle - roller_pin
    up = slider_pin.imag
    force = machine.slider_mass * (slider.acceleration + machine.gravity) + (up[0] + up[1])
    on_corner = stances[0].on_corner | stances[1].on_corner
    return MotionResponse(machine, slider, at, force, contact, -traction, roller_pin, slider_pin, on_corner)


def statics(machine: Machine, position: FloatArray, upward: bool = True) -> MotionResponse:
    """Return the forces at rest at positions of the slider [m]; rolling resistance as on the way up, or down."""
    still = np.zeros(position.shape)
    creep = still if upward else still - np.finfo(float).tiny
    return respond(machine, SliderState(position, creep, still))


def kinematics(stances: tuple[Stance, Stance], position: FloatArray, length: FloatArray) -> Kinematics:
    """Return how both sides follow the slider; `length` of the braces is (2, 1) [m]."""
    right, left = stances
    center, tangent = np.array([right.center, left.center]), np.array([right.tangent, left.tangent])
    curvature = np.array([right.curvature, left.curvature])
    brace = center - 1j * position
    product = brace.conj() * tangent  # its real part is Re(conj(d) t), its imaginary part -Re(conj(d) i t)
    lever = product.real
    ratio = brace.imag / lever
    center_slope = tangent * ratio
    relative = center_slope - 1j
    bent = curvature * ratio * ratio
    arc_bend = (bent * product.imag - (relative.real**2 + relative.imag**2)) / lever
    center_bend = tangent * (arc_bend + 1j * bent)
    square = length * length
    angle_slope, angle_bend = _cross_product(brace, relative) / square, _cross_product(brace, center_bend) / square
    return Kinematics(
        center, tangent, brace, lever, ratio, arc_bend, center_slope, center_bend, angle_slope, angle_bend
    )


def _loads(machine: Machine, parts: SideParts, at: Kinematics, slider: SliderState) -> MovingLoads:
    push, square = slider.acceleration, slider.speed * slider.speed
    lift: Any = 1j * machine.gravity
    if machine.sideways:  # to the right is outwards on the right, inwards on the left
        lift = lift - machine.sideways * np.array([[1.0], [-1.0]])
    roller = at.center_slope * push + at.center_bend * square + lift
    middle: ComplexArray = 0.5 * (roller + (1j * push + lift))
    along = at.arc_slope * push + at.arc_bend * square
    pull = machine.springs.force(AxisGap.from_outward_axes(at.center, at.center_slope * slider.speed))
    return MovingLoads(
        roller=roller,
        middle=middle,
        turning=at.angle_slope * push + at.angle_bend * square,
        rolling=parts.roller_inertia / parts.roller_radius**2 * along,
        springs=np.array([pull, pull.conj()]),  # the left roller sees the opposite force in a mirror
    )


def _cross_product(a: ComplexArray, b: ComplexArray) -> FloatArray:
    return a.real * b.imag - a.imag * b.real

"""Scalar results of a motion of a cam mechanism, its contact pressure, and its force when moved slowly."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.contact_pressure import pressure
from cfmkit.families.cam.dynamics.inverse import respond, statics
from cfmkit.families.cam.scalar_results import SCALAR_DEFINITIONS
from cfmkit.families.cam.statics import STANDARD_GRAVITY, constant_force
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.solution import MotionSolution

SLOW_DURATION = 1.0  # duration of the motion that the paper compares with [s]


def values_of(moved: MotionSolution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; None if a value does not exist."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        numbers = _shared_values(moved) | _compute_values(moved)
    finite = {name: value if np.isfinite(value) else None for name, value in numbers.items()}
    return {name: Quantity(value, *SCALAR_DEFINITIONS[name]) for name, value in finite.items()}


def _shared_values(moved: MotionSolution) -> dict[str, float]:
    """Return the values that the quasi-static analysis has, too."""
    right, history = moved.build.right, moved.history
    return {
        "force_constant": right.profile.path.law.force_constant,
        "spring_stiffness": right.loads.stiffness,
        "theoretical_force": constant_force(right),
        "spring_elongation_max": _largest(history.elongation),
        "contact_force_max": _largest(history.contact),
    }


def _compute_values(moved: MotionSolution) -> dict[str, float]:
    history, machine = moved.history, moved.build.machine
    moving = respond(machine, history.slider)
    ratio = history.force / moved.static
    pressed = contact_pressure(moved)
    return {
        **({"contact_pressure_max": _largest(pressed)} if moved.spec.mechanism.contact else {}),
        "contact_force_min": -_largest(-history.contact),
        "brace_force_max": _largest(history.brace),
        "roller_speed_max": _largest(np.abs(history.spin)),
        "slider_speed_max": _largest(np.abs(history.slider.speed)),
        "slider_acceleration_max": _largest(np.abs(history.slider.acceleration)),
        "dead_weight_peak": _largest(np.abs(history.slider.acceleration)) / STANDARD_GRAVITY,
        "moving_mass_max": _largest(moving.mass),
        "force_peak_over_static": _largest(ratio) - 1.0,
        "force_dip_under_static": 1.0 + _largest(-ratio),
        "force_peak_over_slow": _largest(history.force / slow_force(moved)) - 1.0,
        "angle_error_effect": _angle_effect(moved),
    }


def contact_pressure(moved: MotionSolution) -> FloatArray:
    """Return the larger pressure of both contacts over the motion [Pa]; NaN on a corner, and without a contact.

    The axis of a roller with radius r runs at that distance from the cam: where its path has the curvature k
    the cam's radius is 1/k - r, and the sum of both curvatures 1/(r (1 - k r)).
    """
    contact, history = moved.spec.mechanism.contact, moved.history
    if contact is None:
        return np.full(len(history.times), np.nan)
    machine = moved.build.machine
    low, high = machine.span
    stances = machine.stances(np.clip(history.slider.position, low, high))
    radius, bend = machine.parts.roller_radius, np.array([stance.curvature for stance in stances])
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature = 1.0 / (radius * (1.0 - bend * radius))
        pressed = pressure(history.contact, curvature, contact.material, contact.width).max(axis=0)
    return np.where(history.on_corner, np.nan, pressed)


def slow_force(moved: MotionSolution) -> FloatArray:
    """Return the force of the same motion within one second, at the same places [N]."""
    scale = moved.build.motion.time / SLOW_DURATION
    position, speed, acceleration = moved.history.slider
    slider = moved.history.slider._replace(speed=speed * scale, acceleration=acceleration * scale**2)
    return respond(moved.build.machine, slider._replace(position=position)).force


def _angle_effect(moved: MotionSolution) -> float:
    """Return how much larger the force at the end is, at rest, than with flanks at the right angles."""
    machine, end = moved.build.machine, moved.history.slider.position[-1:]
    right = replace(machine, right=replace(machine.right, angle=0.0), left=replace(machine.left, angle=0.0))
    if right == machine:
        return 0.0
    low, high = right.span
    if not low <= end[0] <= high:
        return np.nan
    upward = moved.build.motion.stroke > 0
    return float(statics(machine, end, upward).force[0] / statics(right, end, upward).force[0]) - 1.0


def _largest(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else np.nan

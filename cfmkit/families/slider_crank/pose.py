"""Where the parts of a slider-crank are in its key positions, for drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.model import Solution

KEY_ROOM = 42.0
"""Room for the small curve above the linkages [mm of print]."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Key:
    """The linkage at one place of its motion.

    Attributes
    ----------
    name : str
        What is special about it.
    motion, angle : float
        The place [rad or m], and the crank's angle there [rad].
    crank_pin, slider_pin : (float, float)
        B and C [m].
    """

    name: str
    motion: float
    angle: float
    crank_pin: Point
    slider_pin: Point

    def title(self, solution: Solution) -> str:
        """Return what stands above its panel."""
        angle = format_short(self.angle, "angle", 3)
        if solution.assembly.drive == "torque":
            return f"{self.name}: crank at {angle}"
        return f"{self.name}: {format_short(self.motion, 'length', 3)},\ncrank at {angle}"

    @property
    def joints(self) -> tuple[Point, Point, Point]:
        """A, B and C."""
        return (0.0, 0.0), self.crank_pin, self.slider_pin

    @property
    def directions(self) -> tuple[float, float, float]:
        """Direction of the link at each joint that its spring turns with [rad]."""
        (bx, by), (cx, cy) = self.crank_pin, self.slider_pin
        coupler = math.atan2(cy - by, cx - bx)
        return math.atan2(by, bx), coupler, coupler + math.pi


@dataclass(frozen=True)
class Scene:
    """What all panels have in common.

    Attributes
    ----------
    box : (float, float, float, float)
        Left, bottom, right, top [m].
    size : float
        Of symbols [m].
    wall : float
        Where the slider's spring is fixed: its x [m].
    """

    box: tuple[float, float, float, float]
    size: float
    wall: float


def key(solution: Solution, name: str, motion: float) -> Key:
    """Return the linkage at one place of its motion."""
    units, link = solution.assembly.units(np.array([motion])), solution.assembly.linkage
    angle = float(units.angle[0])
    pin = link.crank * math.cos(angle), link.crank * math.sin(angle)
    return Key(name, motion, angle, pin, (float(units.position[0]), link.offset))


def key_positions(solution: Solution) -> tuple[Key, ...]:
    """Return three telling positions: unloaded, stretched or unstable, and the second stable one or the last."""
    low, high = float(solution.motion[0]), float(solution.motion[-1])
    start, stretched = solution.assembly.start, solution.assembly.stretched
    first = key(solution, "unloaded", start) if low <= solution.assembly.rest <= high else key(solution, "first", low)
    unstable, stable = solution.nearest(False), solution.nearest(True)
    if unstable is not None:
        middle = key(solution, "unstable", unstable.motion)
    elif solution.assembly.drive == "torque" and low < stretched < high and abs(stretched - start) > 1e-9:
        middle = key(solution, "stretched", stretched)
    else:
        middle = key(solution, "half way", 0.5 * (low + high))
    far = high if abs(high - start) >= abs(low - start) else low
    last = key(solution, "last", far) if stable is None else key(solution, "second stable", stable.motion)
    return first, middle, last


def scene(solution: Solution) -> Scene:
    """Return a box around all positions of the motion, with room for symbols."""
    link, units = solution.assembly.linkage, solution.units
    x = np.concatenate([[0.0], link.crank * np.cos(units.angle), units.position])
    y = np.concatenate([[0.0, link.offset], link.crank * np.sin(units.angle)])
    extent = max(float(np.ptp(x)), float(np.ptp(y)))
    size = 0.045 * extent
    far = float(units.position.max()) if link.branch > 0 else float(units.position.min())
    wall = far + link.branch * 4.0 * size
    ends = [
        float(x.min()),
        float(x.max()),
        wall if solution.assembly.rates[3] > 0.0 else far + 3.0 * size * link.branch,
    ]
    room = 1.6 * size
    bottom, top = min(float(y.min()), -size) - room, max(float(y.max()), link.offset + size) + room
    return Scene((min(ends) - room, bottom, max(ends) + room, top), size, wall)


def torsion_spring(joint: Point, direction: float, radius: float) -> FloatArray:
    """Return a spiral of one and a half turns around a joint that ends on a link, (n, 2) [m]."""
    turn = np.linspace(-3.0 * math.pi, 0.0, 60)
    reach = radius * np.linspace(0.35, 1.0, 60)
    return np.column_stack([joint[0] + reach * np.cos(direction + turn), joint[1] + reach * np.sin(direction + turn)])

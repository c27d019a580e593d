"""What moves: two sides, a slider and springs; and how the slider is moved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.side_kinematics import Side, Stance


class Constants(NamedTuple):
    """Parts of both sides, each (2, 1), so that they multiply a row each."""

    length: FloatArray
    brace_mass: FloatArray
    brace_inertia: FloatArray
    radius: FloatArray
    roller_mass: FloatArray
    roller_inertia: FloatArray


@dataclass(frozen=True)
class Machine:
    """Everything that decides the forces of a motion, SI units.

    Attributes
    ----------
    right, left : Side
        The left one as its mirror image; they need not be alike.
    slider_mass : float
        [kg].
    stiffness, rest_length : float
        Of all springs together, between the axes of the rollers [N/m, m].
    gravity : float
        Acceleration against the slider's way up; 0 switches weight off [m/s^2].
    friction : float
        Rolling resistance over roller radius.
    sideways : float
        Acceleration across the slider's way, to the right, with which weight acts [m/s^2].
    """

    right: Side
    left: Side
    slider_mass: float
    stiffness: float
    rest_length: float
    gravity: float
    friction: float = 0.0
    sideways: float = 0.0

    @cached_property
    def constants(self) -> Constants:
        """The parts of both sides as columns."""
        sides = self.right.parts, self.left.parts
        names = ("brace_length", "brace_mass", "brace_inertia", "roller_radius", "roller_mass", "roller_inertia")
        return Constants(*np.array([[[getattr(parts, name)] for parts in sides] for name in names]))

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest position of the slider that both sides allow [m]."""
        right, left = self.right.span, self.left.span
        return max(right[0], left[0]), min(right[1], left[1])

    def stances(self, position: FloatArray) -> tuple[Stance, Stance]:
        """Return where the right and the left roller are for slider positions within `span` [m].

        Sides with the same geometry are solved once; that changes no number.
        """
        right = self.right.stance(position)
        return right, right if self.left.runs_like(self.right) else self.left.stance(position)


class Moment(NamedTuple):
    """Slider position [m], speed [m/s] and acceleration [m/s^2], each (n,) or a number."""

    position: Any
    speed: Any
    acceleration: Any


@dataclass(frozen=True)
class Cycloid:
    """Cycloidal motion: rest to rest without a jump of acceleration [SS, eq. 17].

    Attributes
    ----------
    start : float
        Slider position at the beginning [m].
    stroke : float
        Travel, negative for lowering [m].
    time : float
        Duration [s].
    """

    start: float
    stroke: float
    time: float

    def times(self, points: int) -> FloatArray:
        """Return `points` equal steps from beginning to end [s]."""
        return np.linspace(0.0, self.time, points)

    def at(self, times: FloatArray | np.float64) -> Moment:
        """Return position, speed and acceleration at times between 0 and `time` [s].

        Examples
        --------
        >>> middle = Cycloid(0.2, 0.1, 0.5).at(np.array([0.25]))
        >>> [round(float(values[0]), 12) for values in middle]
        [0.25, 0.4, 0.0]
        """
        share = times / self.time
        turn = (2.0 * np.pi) * share
        sine, speed = np.sin(turn), self.stroke / self.time
        position = self.start + self.stroke * (share - sine / (2.0 * np.pi))
        return Moment(position, speed * (1.0 - np.cos(turn)), (2.0 * np.pi * speed / self.time) * sine)

"""Machine of the dynamic cam models (two sides with their rollers' tracks, slider, springs), and the slider's motion.

The slider's pin is on the axis at i S, the roller's centre C on its track, the brace between them: |C - i S| = L. The
track may be turned about the origin (a slider that deviates from the axis of the cam, or a flank cut at a wrong angle).

Complex numbers x + iy [m], x outwards; the left side is mirrored.
"""

from __future__ import annotations

import cmath
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import brief
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TurnedTrack
from cfmkit.families.rows import PlacesKept

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.axis_springs import AxisSprings
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import Track

    ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class SideParts:
    """Dimensions and masses of a side, or of both as columns (2, 1), SI units; braces balance at mid-length."""

    brace_length: Any
    brace_mass: Any
    brace_inertia: Any
    roller_radius: Any
    roller_mass: Any
    roller_inertia: Any


@dataclass(frozen=True)
class Machine:
    """Everything that decides the forces of a motion, SI units."""

    # right, left: the left one as its mirror image; they need not be alike
    right: Side
    left: Side
    slider_mass: float  # [kg]
    springs: AxisSprings  # between the axes of the rollers
    gravity: float  # acceleration against the slider's travel up; 0 switches weight off [m/s^2]
    friction: float = 0.0  # rolling resistance over roller radius
    sideways: float = 0.0  # acceleration across the slider's travel, to the right, with which weight acts [m/s^2]

    @cached_property
    def parts(self) -> SideParts:
        """The parts of both sides as columns (2, 1), so that they multiply a row each."""
        columns = np.array([astuple(self.right.parts), astuple(self.left.parts)]).T[..., None]
        return SideParts(*columns)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest position of the slider that both sides allow [m]."""
        right, left = self.right.span, self.left.span
        return max(right[0], left[0]), min(right[1], left[1])

    @cached_property
    def stances(self) -> PlacesKept[tuple[Stance, Stance]]:
        """Stances of the right and the left roller as a function of slider positions within `span` [m]."""
        return PlacesKept(self._find_stances)

    def _find_stances(self, position: FloatArray) -> tuple[Stance, Stance]:
        right = self.right.stance(position)
        # sides with the same geometry are solved once; that changes no number
        return right, right if self.left.runs_like(self.right) else self.left.stance(position)


class SliderState(NamedTuple):
    """Slider position [m], speed [m/s] and acceleration [m/s^2], each (n,) or a number."""

    position: Any
    speed: Any
    acceleration: Any

    def __repr__(self) -> str:
        """Return the three, each with a short text."""
        return f"SliderState{tuple(brief(array) for array in self)}"


@dataclass(frozen=True)
class Cycloid:
    """Cycloidal motion: rest to rest without a jump of acceleration [SS, eq. 17]."""

    start: float  # slider position at the beginning [m]
    stroke: float  # travel, negative for lowering [m]
    time: float  # duration [s]

    def times(self, points: int) -> FloatArray:
        """Return `points` equal steps from beginning to end [s]."""
        return np.linspace(0.0, self.time, points)

    def evaluate(self, times: FloatArray | np.float64) -> SliderState:
        """Return position, speed and acceleration at times between 0 and `time` [s].

        Examples
        --------
        >>> middle = Cycloid(0.2, 0.1, 0.5).evaluate(np.array([0.25]))
        >>> [round(float(values[0]), 12) for values in middle]
        [0.25, 0.4, 0.0]
        """
        share = times / self.time
        turn = (2.0 * np.pi) * share
        sine, speed = np.sin(turn), self.stroke / self.time
        position = self.start + self.stroke * (share - sine / (2.0 * np.pi))
        return SliderState(position, speed * (1.0 - np.cos(turn)), (2.0 * np.pi * speed / self.time) * sine)


class Stance(NamedTuple):
    """Pose of a side: roller centre [m], tangent and curvature [1/m] of its curve, on the corner or not; all (n,)."""

    center: ComplexArray
    tangent: ComplexArray
    curvature: FloatArray
    on_corner: NDArray[np.bool_]


@dataclass(frozen=True)
class Side:
    """One side, its flank turned by `angle` about the point at `height` above the start of the roller path."""

    parts: SideParts  # brace and roller
    track: Track  # of the roller's centre, before it is turned
    angle: float = 0.0  # counter-clockwise, as seen on the right side [rad]
    height: float = 0.0  # of the origin of all positions above the start of the roller path [m]

    @cached_property
    def turned_track(self) -> Track:
        """The track of the roller's centre; raises NoTrack if the slider does not rise on it."""
        return TurnedTrack(self.track, self.angle, self.height) if self.angle else self.track

    def runs_like(self, side: Side) -> bool:
        """Return whether the other side has the same geometry (its masses may differ)."""
        return self.track is side.track and (self.angle, self.height) == (side.angle, side.height)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest position of the slider [m]."""
        return self.turned_track.dead_point - self.height, self.turned_track.end - self.height

    def stance(self, slider: FloatArray) -> Stance:
        """Return where the roller is for slider positions within `span` [m]."""
        states, turn = self.turned_track.states(slider + self.height), cmath.exp(1j * self.angle)
        length = np.sqrt(1.0 + states.slope * states.slope)
        center = (states.x + 1j * (states.y - self.height)) * turn
        return Stance(center, (1.0 + 1j * states.slope) / length * turn, states.bend / length**3, states.on_corner)

"""The curve of a roller's centre: points, tangents and curvature, piece by piece.

Everything is in the right half-plane with x pointing outwards, as complex numbers
x + iy [m]; the left side is its mirror image. The curve has two kinds of pieces: the
line at a constant distance from the roller path, and, where the cam is undercut, a
circle about the corner before it. Tangent and curvature are analytic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.cut import CamProfile
    from cfmkit.families.cam.geometry.track import Track

    ComplexArray = NDArray[np.complex128]


class Places(NamedTuple):
    """Points of a curve for values of its parameter, each (n,).

    `point` [m], unit `tangent`, `curvature` [1/m] (positive to the left of the tangent),
    and `pace`, the length of curve per unit of the parameter.
    """

    point: ComplexArray
    tangent: ComplexArray
    curvature: FloatArray
    pace: FloatArray


class Piece(Protocol):
    """A smooth piece of a curve between two values of its parameter."""

    @property
    def ends(self) -> tuple[float, float]:
        """First and last value of the parameter."""
        ...

    @property
    def on_corner(self) -> bool:
        """Whether the roller pivots on the cam's corner."""
        ...

    def at(self, parameter: FloatArray) -> Places:
        """Return the points for values of the parameter."""
        ...


@dataclass(frozen=True)
class Flank:
    """The line at a distance `shift` [m] outwards from the roller path; its parameter is the path coordinate."""

    profile: CamProfile
    shift: float
    ends: tuple[float, float]
    on_corner: bool = False

    def at(self, parameter: FloatArray) -> Places:
        """Return the points for path coordinates [m]."""
        slope, bend = self.profile.path.law.slopes(parameter)
        square = 1.0 + slope * slope
        length = np.sqrt(square)
        tangent, curvature = (1.0 + 1j * slope) / length, bend / (square * length)
        point = parameter + 1j * self.profile.path.height(parameter)
        if self.shift:
            stretch = 1.0 + self.shift * curvature
            point, curvature, length = point - 1j * self.shift * tangent, curvature / stretch, length * stretch
        return Places(point, tangent, curvature, length)


@dataclass(frozen=True)
class Pivot:
    """The circle on which the centre turns about the cam's corner; its parameter is the angle [rad]."""

    corner: complex
    radius: float
    ends: tuple[float, float]
    on_corner: bool = True

    def at(self, parameter: FloatArray) -> Places:
        """Return the points for angles of the centre as seen from the corner [rad]."""
        toward = np.exp(1j * parameter)
        size = np.full(parameter.shape, self.radius)
        return Places(self.corner + self.radius * toward, 1j * toward, 1.0 / size, size)


def pieces_of(track: Track) -> tuple[Piece, ...]:
    """Return the curve of the roller's centre on a cam, from the start of the track to the cam's end."""
    profile = track.profile
    flank = Flank(profile, track.shift, (profile.start, profile.end))
    if profile.corner is None:
        return (flank,)
    corner = complex(*profile.corner.point)
    first = profile.path.law.rest_half_width - corner
    last = flank.at(np.array([profile.start])).point[0] - corner
    return Pivot(corner, track.radius, (float(np.angle(first)), float(np.angle(last)))), flank

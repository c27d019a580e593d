"""Force of the springs between the axes of both rollers while they move: of all of them together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import Mechanism


class AxisGap(NamedTuple):
    """Vector from the axis of the left roller to that of the right one, a complex number, and how fast it changes."""

    vector: Any  # [m]
    velocity: Any  # for laws that depend on speed [m/s]

    @classmethod
    def from_outward_axes(cls, center: Any, velocity: Any) -> AxisGap:
        """Return the gap between axes (2, n) that are given with x outwards: the left one as its mirror image."""
        return cls(center[0] + center[1].conj(), velocity[0] + velocity[1].conj())


@dataclass(frozen=True)
class AxisSprings:
    """All springs together."""

    stiffness: float  # [N/m]
    rest_length: float  # distance of the axes at which they would pull no more [m]
    tension_stretch: float = 0.0  # how much farther apart the axes are when springs with initial tension open [m]

    @classmethod
    def from_mechanism(cls, mechanism: Mechanism) -> AxisSprings:
        """Return the springs of a mechanism."""
        springs = mechanism.springs
        return cls(springs.total, 2.0 * mechanism.springs_rest, springs.tension_stretch)

    def force(self, gap: AxisGap) -> Any:
        """Return the force on the right axis, a complex number [N], opposite on the left one; springs do not push."""
        distance = np.abs(gap.vector)
        pull = self.stiffness * np.maximum(distance - self.rest_length, 0.0)
        return -pull / distance * gap.vector

    def elongation(self, distance: Any) -> Any:
        """Return by how much they are longer than closed [m]."""
        return distance - self.rest_length - self.tension_stretch

    def energy(self, distance: Any) -> Any:
        """Return their energy [J]."""
        stretch = np.maximum(self.elongation(distance) + self.tension_stretch, 0.0)
        return self.stiffness * stretch**2 / 2.0

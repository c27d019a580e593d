"""Force of the springs between the axes of both rollers while they move: of all of them together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import Mechanism


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

    def pull(self, distance: Any) -> Any:
        """Return the force [N] with which they pull axes together that are so far apart [m]; they do not push."""
        return self.stiffness * np.maximum(distance - self.rest_length, 0.0)

    def elongation(self, distance: Any) -> Any:
        """Return by how much they are longer than closed [m]."""
        return distance - self.rest_length - self.tension_stretch

    def energy(self, distance: Any) -> Any:
        """Return their energy [J]."""
        stretch = np.maximum(self.elongation(distance) + self.tension_stretch, 0.0)
        return self.stiffness * stretch**2 / 2.0

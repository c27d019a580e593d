"""A flexible strip: one straight leaf of a mechanism, by size and material, and what follows from them.

Every field may be a number or an array; the formulas of this family broadcast.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

SHEAR_FACTOR = 5.0 / 6.0  # share of a rectangle's area that carries shear


@dataclass(frozen=True)
class LeafStrip:
    """One leaf, clamped at one end, `angle` from the direction across the motion; numbers or arrays."""

    length: Any  # between its ends [m]
    angle: Any  # between the leaf and the direction across the shuttle's motion [rad]
    # thickness, width: in the plane of bending and out of it [m]
    thickness: Any
    width: Any
    youngs_modulus: Any  # [Pa]
    poisson_ratio: Any = 0.3  # [1]

    @property
    def reach(self) -> Any:
        """Extent across the motion, X [m]."""
        return self.length * np.cos(self.angle)

    @property
    def rise(self) -> Any:
        """Extent along the motion, h [m]."""
        return self.length * np.sin(self.angle)

    @property
    def slenderness(self) -> Any:
        """Rise over thickness, Q."""
        return self.rise / self.thickness

    @property
    def area(self) -> Any:
        """Cross-section A [m2]."""
        return self.width * self.thickness

    @property
    def bending(self) -> Any:
        """Flexural rigidity EI [N m2]."""
        return self.youngs_modulus * self.width * self.thickness**3 / 12.0

    @property
    def axial(self) -> Any:
        """Axial rigidity EA [N]."""
        return self.youngs_modulus * self.area

    @property
    def shear(self) -> Any:
        """Shear rigidity 5/6 GA [N]."""
        return SHEAR_FACTOR * self.axial / (2.0 * (1.0 + self.poisson_ratio))

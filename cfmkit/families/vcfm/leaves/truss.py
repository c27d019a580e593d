"""The paper's own law of a leaf as intended: a bar that only compresses. For comparison.

The bar ignores buckling and clamping. For the leaf of Table I of [D] its peak is 36 % too high and at twice the travel,
and its steepest slope is 2.8 times that of the real leaf. It is nowhere straight.

Reference
---------
[D] B. Ding, X. Li, Y. Li, Robotica (2022), eq. 18, which is for one V: here the leaves count that are there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cfmkit.families.vcfm.leaves.bent_centre_line import N_LINE_POINTS
from cfmkit.families.vcfm.leaves.kinds import LeafLaw

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class TrussLeaf(LeafLaw):
    """One leaf as a bar on two pins [D, eq. 18]: half of E S u (u - s)(u - 2 s), u = d/L, s = sin(theta)."""

    one_by_one: ClassVar[bool] = False

    def force(self, travel: Any) -> Any:
        """Return the force of one leaf along the motion [N].

        Examples
        --------
        >>> from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
        >>> leaf = TrussLeaf(LeafStrip(35e-3, np.radians(7), 1e-3, 6e-3, 1477e6, 0.3))
        >>> float(leaf.force(1e-3).round(6))
        2.541452
        """
        u, s = np.asarray(travel) / self.strip.length, np.sin(self.strip.angle)
        return 0.5 * self.strip.axial * u * (u - s) * (u - 2.0 * s)

    def stress(self, travel: Any) -> Any:
        """Return the axial stress [Pa]: the law has no bending."""
        u, s = np.asarray(travel) / self.strip.length, np.sin(self.strip.angle)
        return self.strip.youngs_modulus * np.abs(s * u - 0.5 * u * u)

    @property
    def first_stiffness(self) -> Any:
        """Stiffness, unloaded [N/m]."""
        return self.strip.axial * np.sin(self.strip.angle) ** 2 / self.strip.length

    @property
    def negative_stiffness(self) -> Any:
        """Size of the largest negative stiffness [N/m]: where the bar is flat."""
        return 0.5 * self.first_stiffness

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]: straight."""
        share = np.linspace(0.0, 1.0, N_LINE_POINTS)[:, None]
        line: FloatArray = share * np.array([self.strip.reach, self.strip.rise - travel])
        return line

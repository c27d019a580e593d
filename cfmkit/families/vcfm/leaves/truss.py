"""The paper's own laws as intended: a bar that only compresses, and a diamond that only bends. For comparison.

The bar ignores buckling and clamping. For the leaf of Table I of [D] its peak is 36 % too high and at twice the travel,
and its steepest slope is 2.8 times that of the real leaf. It is nowhere straight.

Reference
---------
[D] B. Ding, X. Li, Y. Li, Robotica (2022), eq. 18 and 19. The formula of eq. 19 is for one chain of the diamond, eq. 18
for one V: here they count the chains and leaves that are there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip


@dataclass(frozen=True)
class TrussLeaf:
    """One leaf as a bar on two pins [D, eq. 18]: half of E S u (u - s)(u - 2 s), u = d/L, s = sin(theta)."""

    strip: LeafStrip

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
    def balance(self) -> Any:
        """Travel at which the bar carries nothing [m]: flat."""
        return self.strip.rise

    @property
    def first_stiffness(self) -> Any:
        """Stiffness as made [N/m]."""
        return self.strip.axial * np.sin(self.strip.angle) ** 2 / self.strip.length

    @property
    def negative_stiffness(self) -> Any:
        """Size of the largest negative stiffness [N/m]: where the bar is flat."""
        return 0.5 * self.first_stiffness

    @property
    def linear(self) -> tuple[Any, Any]:
        """NaN: the law is nowhere straight."""
        return np.nan, np.nan

    def buckled(self, travel: Any) -> Any:
        """Return False everywhere: the law does not know buckling."""
        return np.zeros(np.shape(travel), dtype=bool)


@dataclass(frozen=True)
class TrussDiamond:
    """The diamond by bending alone [D, eq. 19]: E b t^3/(2 (L cos)^3) for each chain."""

    strip: LeafStrip
    share: Any = 1.0

    @property
    def stiffness(self) -> Any:
        """K_p [N/m]."""
        return 2.0 * self.share * 6.0 * self.strip.bending / self.strip.reach**3

    def force(self, compression: Any) -> Any:
        """Return the force [N] at a compression [m]."""
        return self.stiffness * compression

    def stress(self, compression: Any) -> Any:
        """Return the largest bending stress [Pa]."""
        from cfmkit.families.vcfm.leaves.positive_stiffness_springs import leaf_stress

        return leaf_stress(self.strip, 0.5 * compression)

"""Positive-stiffness structures as closed forms: diamond, folded, U-shaped and straight beams, bought springs; preload.

All are given for the whole structure: two chains of the diamond or of U-shaped beams, four of folded beams, one
straight beam with a leaf to either side. A chain is two leaves in series, each taking half of the compression.

Departures from [D]: its eq. 15 counts one chain of the diamond and half of the shear term, L^3 cos^2 and not (L cos)^3
belongs into the bending term, and the force F_1 inside its bracket is a misprint.

[D] takes the force to rise by K_p dr (eq. 3), and the shuttle to move back by K_p dr/(K_p + K_b1) (eq. 6). The first is
exact where K_p = K_n and both are constant; the second is not: pulled back, the leaves are in tension and stiffen.

Reference
---------
[D] B. Ding, X. Li, Y. Li, Robotica (2022), eq. 1-6, eq. 7-15 and Table II.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.leaves.s_form import s_force

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip


def leaf_compliance(strip: LeafStrip) -> Any:
    """Return the compliance of a leaf whose far end is guided and free to move across [m/N].

    Examples
    --------
    >>> from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    >>> leaf = LeafStrip(25e-3, np.radians(7), 1.5e-3, 10e-3, 1477e6, 0.3)
    >>> float((1e-3 / leaf_compliance(leaf)).round(6))
    3.202276
    """
    s2, c2 = np.sin(strip.angle) ** 2, np.cos(strip.angle) ** 2
    bent = strip.length**3 * c2 / (12.0 * strip.bending)
    return bent + strip.length * c2 / strip.shear + strip.length * s2 / strip.axial


def leaf_stress(strip: LeafStrip, deflection: Any) -> Any:
    """Return the bending stress at the ends of a leaf that is deflected by so much [m], in Pa."""
    e, t, length = strip.youngs_modulus, strip.thickness, strip.length
    return 3.0 * e * t * np.abs(deflection) * np.cos(strip.angle) / length**2


@dataclass(frozen=True)
class Diamond:
    """Two chains of two leaves: K_p = 1/c for the whole diamond, c of one leaf.

    `share` is the loaded part of the structure: 1, or 0.5 for one of the two chains.
    """

    strip: LeafStrip
    share: Any = 1.0
    pairs: float = 1.0

    @property
    def stiffness(self) -> Any:
        """K_p as made [N/m]."""
        return self.pairs * self.share / leaf_compliance(self.strip)

    def force(self, compression: Any) -> Any:
        """Return the force [N] at a compression [m]: straight to 1 % up to a fifth of the length of a leaf."""
        return self.stiffness * compression

    def stress(self, compression: Any) -> Any:
        """Return the largest bending stress [Pa]."""
        return leaf_stress(self.strip, 0.5 * compression)


@dataclass(frozen=True)
class UShape:
    """Two chains of two straight leaves that a flexible semicircle of `radius` [m] joins.

    By symmetry half a chain, with the guided end's moment released about its centroid: K = EI/(I2 - xb^2 S) of both
    chains, S its developed length, xb and I2 its centroid and second moment across the motion.
    """

    strip: LeafStrip
    radius: Any
    share: Any = 1.0

    @property
    def moments(self) -> tuple[Any, Any, Any]:
        """S [m], xb [m] and I2 [m3] of half a chain."""
        length, radius = self.strip.length, self.radius
        developed = length + 0.5 * np.pi * radius
        centroid = (0.5 * length**2 + 0.5 * np.pi * length * radius + radius**2) / developed
        second = length**3 / 3.0 + length**2 * np.pi * radius / 2.0 + 2.0 * length * radius**2 + np.pi * radius**3 / 4.0
        return developed, centroid, second

    @property
    def stiffness(self) -> Any:
        """K_p as made [N/m]."""
        developed, centroid, second = self.moments
        return self.share * self.strip.bending / (second - centroid**2 * developed)

    def force(self, compression: Any) -> Any:
        """Return the force [N] at a compression [m]."""
        return self.stiffness * compression

    def stress(self, compression: Any) -> Any:
        """Return the largest bending stress [Pa]: at the clamped end or at the arc's apex."""
        _, centroid, _ = self.moments
        arm = np.maximum(centroid, self.strip.length + self.radius - centroid)
        one_chain = 0.5 * self.stiffness / self.share * np.abs(compression)
        moment = one_chain * arm
        return 0.5 * moment * self.strip.thickness * self.strip.youngs_modulus / self.strip.bending


@dataclass(frozen=True)
class StraightSpring:
    """A straight beam clamped at both ends and pushed in the middle: two leaves at no angle, stretched as they bend.

    The usual sum of a bending and a cubic stretching term is 11 % high at 2 mm and 31 % at 5 mm of [D], Fig. 4's size;
    the S form in tension is within 1 %.
    """

    strip: LeafStrip
    share: Any = 1.0

    @property
    def stiffness(self) -> Any:
        """K_p as made [N/m]; it grows with the square of the compression."""
        return self.share * 2.0 * 12.0 * self.strip.bending / self.strip.length**3

    def force(self, compression: Any) -> FloatArray:
        """Return the force [N] at a compression [m]."""
        unit, found = self._leaf(compression)
        return np.asarray(-2.0 * self.share * unit * found.along)

    def stress(self, compression: Any) -> FloatArray:
        """Return the largest stress, bending and axial [Pa]."""
        unit, found = self._leaf(compression)
        bent = 0.5 * self.strip.youngs_modulus * self.strip.thickness * found.curvature / self.strip.length
        return np.asarray(bent + np.abs(4.0 * found.z * unit) / self.strip.area)

    def _leaf(self, compression: Any) -> tuple[Any, Any]:
        strip = self.strip
        # a leaf that leaves the flat pose: the S form's travel runs away from it
        travel = -np.asarray(compression, dtype=float) / strip.length
        return strip.bending / strip.length**2, s_force(0.0, strip.thickness / strip.length, travel)


@dataclass(frozen=True)
class Coils:
    """Bought helical springs, all of them together: straight in their deflection, and slack without any.

    Attributes
    ----------
    stiffness : float
        Of all [N/m].
    tension : float
        Force at which they begin to open [N].
    """

    stiffness: float
    tension: float = 0.0

    def force(self, compression: Any) -> FloatArray:
        """Return the force [N] at a deflection [m]; none where it is not positive."""
        deflection = np.asarray(compression, dtype=float)
        return np.where(deflection > 0, self.tension + self.stiffness * deflection, 0.0 * deflection)

    def stress(self, compression: Any) -> FloatArray:
        """Return zero: the wire is not of the mechanism's material (`wire_stress_max` is its stress)."""
        return 0.0 * np.asarray(compression, dtype=float)


Spring = Diamond | UShape | StraightSpring | Coils


def folded(strip: LeafStrip, share: Any = 1.0) -> Diamond:
    """Return eight folded beams: four chains of two straight leaves, whose joints move along the leaves."""
    return Diamond(strip, share, pairs=2.0)


def force_change(positive_stiffness: Any, preload: Any) -> Any:
    """Return K_p dr, the change of the constant force [N].

    Examples
    --------
    >>> force_change(1400.0, 2.5e-3)
    3.5
    """
    return positive_stiffness * preload


def rest_shift(positive_stiffness: Any, first_stiffness: Any, preload: Any) -> Any:
    """Return how far the preload moves the shuttle back, by constant stiffnesses [m] [D, eq. 6]."""
    return positive_stiffness * preload / (positive_stiffness + first_stiffness)


def measured_stiffness_for(force: float, balance: float) -> float:
    """Return the K_p that a force at the balance point needs without preload [N/m]: the leaves carry nothing there."""
    return force / balance

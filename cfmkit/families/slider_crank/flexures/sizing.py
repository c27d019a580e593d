"""Closed forms for a small flexure with a rectangular section that stands for a torsion spring [B, eq. 12].

A flexure of length L in pure bending turns by psi = M L / EI, so its rate is K = E b h^3 / (12 L) and its
stress is sigma = E h psi / (2 L). Solved for the section: h from the stress, then b from the rate.

Reference
---------
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.linkage import Linkage

PEAK_FACTOR = 1.09
"""Largest stress of a flexure of finite length over that of pure bending, at the stroke that the stress allows:
the moment is not constant along it, and the normal force adds its part."""


@dataclass(frozen=True)
class Flexure:
    """A flexure with a rectangular section, lying across a joint.

    Attributes
    ----------
    length, thickness, width : float
        Along the link, in the plane of bending, out of it [m].
    before : float
        Share of the length that lies before the joint.
    """

    length: float
    thickness: float
    width: float
    before: float = 0.5

    def rate(self, youngs_modulus: float) -> float:
        """Return the rate as a torsion spring [N m/rad] [B, eq. 12].

        Examples
        --------
        >>> round(Flexure(10.8e-3, 0.908e-3, 2.478e-3).rate(1.8e9) * 1e3, 6)
        25.764775
        """
        return youngs_modulus * self.width * self.thickness**3 / (12.0 * self.length)

    def rotation(self, youngs_modulus: float, stress: float) -> float:
        """Return the rotation at which pure bending reaches a stress [rad]."""
        return 2.0 * stress * self.length / (youngs_modulus * self.thickness)

    @property
    def volume(self) -> float:
        """Volume [m^3]; for a rate K and a rotation psi within a stress it is 3 E K psi^2 / sigma^2, whatever L."""
        return self.length * self.thickness * self.width


def thickness_from_stress(stress: float, length: float, youngs_modulus: float, rotation: float) -> float:
    """Return the largest thickness that may be turned by `rotation` [rad]: h = 2 sigma L / (E psi) [m].

    Examples
    --------
    >>> round(thickness_from_stress(42.5e6, 10.8e-3, 1.8e9, 0.531250) * 1e3, 3)
    0.96
    """
    return 2.0 * stress * length / (youngs_modulus * rotation)


def width_from_stiffness(rate: float, length: float, youngs_modulus: float, thickness: float) -> float:
    """Return the width that gives a rate [N m/rad]: b = 12 K L / (E h^3) [m].

    Examples
    --------
    >>> round(width_from_stiffness(32.206848e-3, 10.8e-3, 1.8e9, 0.960e-3) * 1e3, 3)
    2.621
    """
    return 12.0 * rate * length / (youngs_modulus * thickness**3)


def sized(rate: float, length: float, youngs_modulus: float, stress: float, rotation: float) -> Flexure:
    """Return the flexure that turns by `rotation` [rad] within `stress` [Pa] and has the rate [N m/rad].

    Its width grows with the third power of the rotation: b = 3 K E^2 psi^3 / (2 sigma^3 L^2).
    """
    thickness = thickness_from_stress(stress, length, youngs_modulus, rotation)
    return Flexure(length, thickness, width_from_stiffness(rate, length, youngs_modulus, thickness))


def rotations(linkage: Linkage, unloaded: float, travel: FloatArray) -> FloatArray:
    """Return how far the three joints have turned where the slider has travelled, (3, n) [rad]."""
    from cfmkit.families.slider_crank.unit_springs import along_slider

    side = -1 if linkage.knee(unloaded) < 0 else 1
    return along_slider(linkage, unloaded, side, np.asarray(travel)).turn[:3]


def stroke_within(linkage: Linkage, unloaded: float, allowed: FloatArray) -> tuple[float, int]:
    """Return the travel at which the first joint has turned as far as is allowed [m], and which joint that is.

    Parameters
    ----------
    linkage : Linkage
        The rigid links.
    unloaded : float
        Crank angle with all flexures straight [rad].
    allowed : (3,) array
        Rotations at pivot, crank pin and slider pin [rad].
    """
    from cfmkit.numerics.roots import bracketed_root

    far = linkage.branch * float(linkage.slider_position(np.array(unloaded))) - linkage.way(unloaded)[0]
    grid = np.linspace(0.0, 0.999 * far, 400)
    share = np.abs(rotations(linkage, unloaded, grid)) / np.asarray(allowed)[:, None]
    worst = share.max(axis=0)
    if not (worst >= 1.0).any():
        return float(far), int(share[:, -1].argmax())
    first = int(np.argmax(worst >= 1.0))
    joint = int(share[:, first].argmax())

    def excess(travel: float) -> float:
        turn = rotations(linkage, unloaded, np.array([travel]))[joint, 0]
        return float(abs(turn) / allowed[joint] - 1.0)

    return bracketed_root(excess, float(grid[first - 1]), float(grid[first])), joint

"""Constraints of the nine-coordinate model, with analytic Jacobians and second time derivatives.

The coordinates are x = (s2, theta3, theta4, xi4, y4, theta5, theta6, xi6, y6) [SS, eq. 4]:
slider, right brace, right roller, its contact seen from the roller, height of the contact
on the right flank, and the same on the left. Rows: six holonomic constraints [SS, eq. 5],
of which the first and third block are plane vectors (the paper writes a third component
that is always zero), two rolling constraints [eq. 15] and the given motion [eq. 16].

Everything works for one vector of coordinates and for many, (..., 9).

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.flankline import FlankLine, FlankPoint

SIZE = 9
HOLONOMIC, ROLLING, GIVEN = slice(0, 6), slice(6, 8), 8


class Posture(NamedTuple):
    """Sines and cosines of a side: of its brace, and of the direction from roller axis to contact; and the flank."""

    sin: Any
    cos: Any
    contact_sin: Any
    contact_cos: Any
    flank: FlankPoint


@dataclass(frozen=True)
class Chain:
    """One side: brace, roller, flank.

    Attributes
    ----------
    hand : float
        1 on the right, -1 on the left: the left flank is the mirror image of `line`.
    length, radius : float
        Of brace and roller [m].
    line : FlankLine
        The flank, as on the right.
    """

    hand: float
    length: float
    radius: float
    line: FlankLine

    @property
    def columns(self) -> slice:
        """Where this side's four coordinates are."""
        return slice(1, 5) if self.hand > 0 else slice(5, 9)

    @property
    def rows(self) -> tuple[int, int, int, int]:
        """Where this side's constraints are: x and y of the closure, tangency, rolling."""
        return (0, 1, 2, 6) if self.hand > 0 else (3, 4, 5, 7)

    def posture(self, x: FloatArray, guess: Any) -> Posture:
        """Return the angles and the contact of this side."""
        brace, roller, contact, height = np.moveaxis(x[..., self.columns], -1, 0)
        turned = roller + contact
        flank = self.line.at(height, guess)
        return Posture(np.sin(brace), np.cos(brace), np.sin(turned), np.cos(turned), flank)

    def residual(self, x: FloatArray, at: Posture, out: FloatArray) -> None:
        """Write the three holonomic constraints [SS, eq. 5]."""
        i, j, k, _ = self.rows
        out[..., i] = self.length * at.cos + self.radius * at.contact_cos - self.hand * at.flank.x
        height = x[..., self.columns.stop - 1]
        out[..., j] = x[..., 0] + self.length * at.sin + self.radius * at.contact_sin - height
        out[..., k] = self.radius * (self.hand * at.flank.first * at.contact_cos + at.contact_sin)

    def jacobian(self, at: Posture, out: FloatArray) -> None:
        """Write the rows of the Jacobian that belong to this side [SS, eq. 27]."""
        i, j, k, roll = self.rows
        brace, roller, contact, height = range(self.columns.start, self.columns.stop)
        length, radius, steep = self.length, self.radius, self.hand * at.flank.first
        out[..., i, brace] = -length * at.sin
        out[..., i, roller] = out[..., i, contact] = -radius * at.contact_sin
        out[..., i, height] = -steep
        out[..., j, 0] = 1.0
        out[..., j, brace] = length * at.cos
        out[..., j, roller] = out[..., j, contact] = radius * at.contact_cos
        out[..., j, height] = -1.0
        out[..., k, roller] = out[..., k, contact] = radius * (at.contact_cos - steep * at.contact_sin)
        out[..., k, height] = self.hand * radius * at.flank.second * at.contact_cos
        out[..., roll, 0] = 1.0
        out[..., roll, brace] = length * (at.cos - steep * at.sin)
        out[..., roll, roller] = radius * (at.contact_cos - steep * at.contact_sin)

    def quadratic(self, at: Posture, velocity: FloatArray, out: FloatArray) -> None:
        """Write d/dx (D x') x', what the second time derivative has beside D x'' [SS, eq. 23 and 24]."""
        i, j, k, roll = self.rows
        brace, roller, contact, height = np.moveaxis(velocity[..., self.columns], -1, 0)
        turned, hand, flank = roller + contact, self.hand, at.flank
        length, radius, steep = self.length, self.radius, hand * flank.first
        steepening = hand * flank.second * height
        out[..., i] = -length * at.cos * brace**2 - radius * at.contact_cos * turned**2 - steepening * height
        out[..., j] = -length * at.sin * brace**2 - radius * at.contact_sin * turned**2
        out[..., k] = radius * (
            hand * flank.third * at.contact_cos * height**2
            - 2.0 * steepening * at.contact_sin * turned
            - (steep * at.contact_cos + at.contact_sin) * turned**2
        )
        swing, spin = length * brace, radius * roller
        out[..., roll] = (
            -steepening * (swing * at.sin + spin * at.contact_sin)
            - swing * brace * (steep * at.cos + at.sin)
            - spin * turned * (steep * at.contact_cos + at.contact_sin)
        )

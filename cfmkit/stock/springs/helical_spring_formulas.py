"""Helical springs of round wire: rate, lengths and stress from wire diameter, coil diameter and turns.

With d the wire, D the mean coil diameter, n the active turns and c = D/d:

    extension, compression   k = G d^4 / (8 D^3 n),    tau = K_W 8 F D / (pi d^3),  K_W = (4c-1)/(4c-4) + 0.615/c
    torsion                  k = E d^4 / (64 D n),     sigma = K_i 32 M / (pi d^3), K_i = (4c^2-c-1)/(4c(c-1))

K_W is Wahl's factor of curvature and direct shear, K_i that of the inner side of a bent bar.

Assumes: round wire, small pitch, no friction between turns; the legs of torsion springs do not bend.

Reference
---------
[W] A. M. Wahl, Mechanical Springs, 2nd ed., McGraw-Hill (1963).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Kind = Literal["extension", "compression", "torsion"]

SHEAR_MODULUS, YOUNGS_MODULUS = 72e9, 190e9
"""Of music wire, ASTM A228 [Pa]: makeitfrom.com, 'ASTM A228 (SWP-A, K08500) Music Wire'. A list may state others."""


def tensile_strength(wire: float) -> float:
    """Return the smallest tensile strength of music wire, 2060 MPa / d^0.163 with d in mm [Pa].

    As engineeringprep.com, problem 141, uses it (A and m for music wire of the handbook of the FE exam).

    Examples
    --------
    >>> round(tensile_strength(7.25e-3) / 1e6)
    1492
    """
    return float(2060e6 / (wire * 1e3) ** 0.163)


@dataclass(frozen=True)
class Wound:
    """A helical spring of round wire.

    Attributes
    ----------
    kind : {"extension", "compression", "torsion"}
        What it is loaded by.
    wire, coil : float
        Wire diameter, and mean diameter of the coil [m].
    turns : float
        Active turns.
    shear_modulus, youngs_modulus : float
        Of the wire [Pa].
    """

    kind: Kind
    wire: float
    coil: float
    turns: float
    shear_modulus: float = SHEAR_MODULUS
    youngs_modulus: float = YOUNGS_MODULUS

    @property
    def index(self) -> float:
        """Coil diameter over wire diameter, c."""
        return self.coil / self.wire

    @property
    def rate(self) -> float:
        """Force per deflection [N/m], or couple per angle [N m/rad]."""
        if self.kind == "torsion":
            return self.youngs_modulus * self.wire**4 / (64.0 * self.coil * self.turns)
        return self.shear_modulus * self.wire**4 / (8.0 * self.coil**3 * self.turns)

    def stress(self, load: float) -> float:
        """Return the largest stress in the wire [Pa] under a force [N] or a couple [N m]: shear, or bending."""
        c = self.index
        if self.kind == "torsion":
            inner = (4.0 * c * c - c - 1.0) / (4.0 * c * (c - 1.0))
            return inner * 32.0 * load / (math.pi * self.wire**3)
        curved = (4.0 * c - 1.0) / (4.0 * c - 4.0) + 0.615 / c
        return curved * 8.0 * load * self.coil / (math.pi * self.wire**3)

    @property
    def body_length(self) -> float:
        """Length of the coil with its turns on each other [m]; two idle turns close a compression spring's ends."""
        return (self.turns + (3.0 if self.kind == "compression" else 1.0)) * self.wire

    @property
    def outer_diameter(self) -> float:
        """Coil and wire [m]."""
        return self.coil + self.wire

    def deflection_at(self, stress: float) -> float:
        """Return the deflection [m] or angle [rad] at a stress in the wire [Pa]."""
        return stress / (self.stress(1.0) * self.rate)

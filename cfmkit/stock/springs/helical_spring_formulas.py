"""Helical springs of round wire: rate, lengths, stress and buckling from wire diameter, coil diameter and turns.

With d the wire, D the mean coil diameter, n the active turns and c = D/d:

    extension, compression   k = G d^4 / (8 D^3 n),    tau = K_W 8 F D / (pi d^3),  K_W = (4c-1)/(4c-4) + 0.615/c
    torsion                  k = E d^4 / (64 D n),     sigma = K_i 32 M / (pi d^3), K_i = (4c^2-c-1)/(4c(c-1))

K_W is Wahl's factor of curvature and direct shear, K_i that of the inner side of a bent bar. The rate of torsion
springs is that of beam theory, as in EN 13906-3; [Sh, eq. 10-51] has 10.8 for 64/(2 pi) = 10.2 in the rate per turn, a
spring that rubs on its pin and is 6 % softer.

A compression spring of free length L buckles at the deflection [Sh, eq. 10-10; the same in EN 13906-1]

    y = L C1 (1 - sqrt(1 - C2 (D/(alpha L))^2)),   C1 = E/(2(E - G)),   C2 = 2 pi^2 (E - G)/(2G + E),

alpha by how its ends are held; never if the root has no value. A torsion spring that is wound up by the angle theta has
the mean diameter D n/(n + theta/(2 pi)) and as much more length in turns [Sh, eq. 10-53].

Assumes: round wire, small pitch, no friction between turns; the legs of torsion springs do not bend, or are counted in
n with (l1 + l2)/(3 pi D) [Sh, eq. 10-48].

Reference
---------
[W] A. M. Wahl, Mechanical Springs, 2nd ed., McGraw-Hill (1963).
[Sh] R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill (2011), chapter 10.
[Norton] R. L. Norton, Machine Design, Prentice Hall, chapter on springs: clearance of a spring in a hole or on a rod.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.stock.springs.wire_materials import MUSIC_WIRE, WIRES_BY_NAME, WireName, WireOutOfRange

if TYPE_CHECKING:
    from collections.abc import Mapping

Kind = Literal["extension", "compression", "torsion"]

SHEAR_MODULUS, YOUNGS_MODULUS = MUSIC_WIRE.shear_modulus, MUSIC_WIRE.youngs_modulus
"""Moduli of music wire [Pa], taken for a spring whose list states none."""

tensile_strength = MUSIC_WIRE.tensile_strength
"""Smallest tensile strength of music wire of a diameter [m] in [Pa]; refuses diameters that its table does not list."""

Seats = Literal["fixed-fixed", "fixed-pivoted", "pivoted-pivoted", "fixed-free"]

SEAT_FACTORS: Mapping[Seats, float] = MappingProxyType(
    {"fixed-fixed": 0.5, "fixed-pivoted": 0.707, "pivoted-pivoted": 1.0, "fixed-free": 2.0}
)
"""alpha, by which the free length counts in buckling [Sh, Table 10-2]; a fixed end stands flat on a plate."""
SMALL_HOLE, SMALL_HOLE_CLEARANCE, ROD_CLEARANCE = 0.013, 0.10, 0.05
"""Inner diameter below which a spring is small [m]; clearance of small and of larger springs on a rod, as shares of it
[Norton]."""
MAX_GUIDE_CLEARANCE = 0.20
"""Largest clearance of a guide, in diameters of the inside (rod) or outside (tube): twice that of [Norton], assumed. A
spring in a looser guide bows as far as the clearance lets it."""


@dataclass(frozen=True)
class HelicalSpring:
    """Helical spring of round wire."""

    kind: Kind  # what it is loaded by
    wire: float  # diameter [m]
    coil: float  # mean diameter [m]
    turns: float  # active turns, which bend or twist
    shear_modulus: float = SHEAR_MODULUS  # of the wire [Pa]
    youngs_modulus: float = YOUNGS_MODULUS  # of the wire [Pa]
    material: WireName | None = MUSIC_WIRE.name  # class of the wire, which its moduli may differ from; None: unknown

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

    def loop_stress(self, load: float) -> float:
        """Return the largest bending stress in the full loops of an extension spring [Pa] under a force [N].

        The loops are as wide as the coil: [Sh, eq. 10-34] with the factor of curvature of eq. 10-35 for r1 = D/2.

        Examples
        --------
        >>> spring = HelicalSpring("extension", 2e-3, 12e-3, 20.0)
        >>> round(spring.loop_stress(80.0) / 1e6, 1), round(spring.stress(80.0) / 1e6, 1)
        (723.2, 382.7)
        """
        c = self.index
        curved = (4.0 * c * c - c - 1.0) / (4.0 * c * (c - 1.0))
        return load * (curved * 16.0 * self.coil / (math.pi * self.wire**3) + 4.0 / (math.pi * self.wire**2))

    def yield_load(self) -> Any:
        """Return the force [N] or couple [N m] at which turns or loops yield; of an array of coils, of each.

        Raises WireOutOfRange if no strength is published for this diameter, or the class of the wire is not known.

        Examples
        --------
        >>> spring = HelicalSpring("extension", 2e-3, 12e-3, 20.0)
        >>> load = spring.yield_load()
        >>> round(float(load)), round(float(spring.stress(load)) / tensile_strength(2e-3), 3)
        (166, 0.397)
        """
        if self.material is None:
            raise WireOutOfRange("the class of the wire is not known, nor its strength: state 'material'")
        wire = WIRES_BY_NAME[self.material]
        strength, shares = wire.tensile_strength(self.wire), wire.yields
        if self.kind == "torsion":
            return shares.bending * strength / self.stress(1.0)
        turns = shares.shear * strength / self.stress(1.0)
        if self.kind == "compression":
            return turns
        return np.minimum(turns, shares.loops * strength / self.loop_stress(1.0))

    @property
    def body_length(self) -> float:
        """Length of the coil with its turns on each other [m]; two idle turns close a compression spring's ends."""
        return (self.turns + (3.0 if self.kind == "compression" else 1.0)) * self.wire

    @property
    def outer_diameter(self) -> float:
        """Coil and wire [m]."""
        return self.coil + self.wire

    @property
    def inner_diameter(self) -> float:
        """Coil without wire [m]."""
        return self.coil - self.wire

    def deflection_at(self, stress: float) -> float:
        """Return the deflection [m] or angle [rad] at a stress in the wire [Pa]."""
        return stress / (self.stress(1.0) * self.rate)

    def inner_diameter_wound_up(self, angle: float) -> float:
        """Return the inner diameter of a torsion spring that is wound up by an angle [rad], in [m].

        Examples
        --------
        >>> spring = HelicalSpring("torsion", 1e-3, 10e-3, 5.0)
        >>> round(1e3 * spring.inner_diameter_wound_up(math.pi), 4)
        8.0909
        """
        return self.coil * self.turns / (self.turns + abs(angle) / (2.0 * math.pi)) - self.wire

    def body_length_wound_up(self, angle: float) -> float:
        """Return the length of a close-wound torsion spring that is wound up by an angle [rad], in [m]."""
        return self.body_length + self.wire * abs(angle) / (2.0 * math.pi)

    def buckling_deflection(self, free_length: float, seats: Seats = "fixed-fixed") -> float:
        """Return the deflection at which a compression spring of a free length [m] buckles [m]; infinite if never.

        Examples
        --------
        >>> slender, squat = (HelicalSpring("compression", 1e-3, coil, 20.0) for coil in (8e-3, 16e-3))
        >>> round(1e3 * slender.buckling_deflection(60e-3), 2), squat.buckling_deflection(60e-3)
        (13.62, inf)
        """
        return buckling_deflection(free_length, self.coil, seats, (self.youngs_modulus, self.shear_modulus))

    @property
    def usual_initial_tension(self) -> tuple[float, float]:
        """Range of initial tension that extension springs of this index are easily wound with [N] [Sh, eq. 10-41].

        Examples
        --------
        >>> low, high = HelicalSpring("extension", 1e-3, 10e-3, 20.0).usual_initial_tension
        >>> round(low, 2), round(high, 2)
        (2.38, 3.97)
        """
        stress = 231e6 / math.exp(0.105 * self.index)
        spread = max(6.9e6 * (4.0 - (self.index - 3.0) / 6.5), 0.0)
        load = math.pi * self.wire**3 / (8.0 * self.coil)
        return load * max(stress - spread, 0.0), load * (stress + spread)

    @property
    def thickest_guide_rod(self) -> float:
        """Diameter of the thickest rod that guides the spring with clearance [m]."""
        inner = self.inner_diameter
        return inner * (1.0 - (SMALL_HOLE_CLEARANCE if inner < SMALL_HOLE else ROD_CLEARANCE))

    @property
    def thinnest_guide_rod(self) -> float:
        """Diameter of the thinnest rod that still guides a compression spring [m]."""
        return self.inner_diameter * (1.0 - MAX_GUIDE_CLEARANCE)

    @property
    def widest_guide_tube(self) -> float:
        """Inner diameter of the widest tube that still guides a compression spring [m]."""
        return self.outer_diameter * (1.0 + MAX_GUIDE_CLEARANCE)


def buckling_deflection(
    # free_length, coil: relaxed length, and mean diameter of the coil [m]
    free_length: float,
    coil: float,
    seats: Seats = "fixed-fixed",  # how its ends are held, a key of `SEAT_FACTORS`
    moduli: tuple[float, float] = (YOUNGS_MODULUS, SHEAR_MODULUS),  # e and G of the wire [Pa]
) -> float:
    """Return the deflection at which a compression spring buckles [m]; infinite if it is stable [Sh, eq. 10-10]."""
    young, shear = moduli
    slenderness = SEAT_FACTORS[seats] * free_length / coil
    inside = 1.0 - 2.0 * math.pi**2 * (young - shear) / (2.0 * shear + young) / slenderness**2
    if inside < 0.0:
        return math.inf
    return free_length * young / (2.0 * (young - shear)) * (1.0 - math.sqrt(inside))

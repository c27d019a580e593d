"""Compression springs: with closed ends on flat plates, which buckle unless they are short or guided.

One of free length L buckles at the deflection [Sh, eq. 10-10; the same in EN 13906-1]

    y = L C1 (1 - sqrt(1 - C2 (D/(alpha L))^2)),   C1 = E/(2(E - G)),   C2 = 2 pi^2 (E - G)/(2G + E),

alpha by how its ends are held; never if the root has no value. References: those of `helical_spring_formulas`.
"""

from __future__ import annotations

import math
from typing import Any

from cfmkit.stock.springs.helical_spring_formulas import (
    SEAT_FACTORS,
    SHEAR_MODULUS,
    YOUNGS_MODULUS,
    HelicalSpring,
    Seats,
)

SOLID_RESERVE = 1.15
"""A spring of the generic series touches its turns at so many times its largest deflection: assumed."""


class CompressionSpring(HelicalSpring):
    """Spring that is pressed."""

    kind = "compression"
    lengthening = -1.0
    idle_turns = 3.0  # two more close the ends
    needs_guide = True

    @classmethod
    def unguided_deflection(
        cls, free_length: float | None, wound: HelicalSpring | None, outer_diameter: float | None, seats: Seats
    ) -> float:
        """Return the deflection up to which it does not buckle [m]; infinite if never, or if that is not known.

        One whose wire is not known is judged as one of music wire with its outer diameter for the mean one: it buckles
        no later than that.
        """
        if free_length is None:
            return math.inf
        if wound is not None:
            moduli = wound.youngs_modulus, wound.shear_modulus
            return buckling_deflection(free_length, wound.coil, seats, moduli)
        return math.inf if outer_diameter is None else buckling_deflection(free_length, outer_diameter, seats)

    @classmethod
    def deflection_until_closed(cls, free_length: float | None, body_length: float | None) -> float:
        """Return the deflection at which its turns touch [m]; infinite if a length is unknown."""
        return math.inf if free_length is None or body_length is None else free_length - body_length

    def free_length_for(self, largest: Any) -> Any:
        """Return the relaxed length of one whose turns touch only beyond its largest deflection [m]."""
        return self.body_length + SOLID_RESERVE * largest


def buckling_deflection(
    # free_length, coil: relaxed length, and mean diameter of the coil [m]
    free_length: float,
    coil: float,
    seats: Seats = "fixed-fixed",  # how its ends are held, a key of `SEAT_FACTORS`
    moduli: tuple[float, float] = (YOUNGS_MODULUS, SHEAR_MODULUS),  # E and G of the wire [Pa]
) -> float:
    """Return the deflection at which a compression spring buckles [m]; infinite if it is stable [Sh, eq. 10-10].

    Examples
    --------
    >>> round(1e3 * buckling_deflection(60e-3, 8e-3), 2), buckling_deflection(60e-3, 16e-3)
    (13.62, inf)
    """
    young, shear = moduli
    slenderness = SEAT_FACTORS[seats] * free_length / coil
    inside = 1.0 - 2.0 * math.pi**2 * (young - shear) / (2.0 * shear + young) / slenderness**2
    if inside < 0.0:
        return math.inf
    return free_length * young / (2.0 * (young - shear)) * (1.0 - math.sqrt(inside))

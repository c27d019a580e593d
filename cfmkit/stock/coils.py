"""Coil springs of round steel wire, sized by the formulas of the standards; none of them is an article of a catalogue.

The wire is patented carbon steel (EN 10270-1: G = 81.5 GPa). How much of its strength is used is assumed, not quoted:
`SHEAR_STRESS` is about a third of the tensile strength that such wire of 1 to 10 mm has, so that a spring of any maker
holds it. Bodies are close-wound, loops are as high as the coil is wide.

Reference
---------
[EN] EN 13906-2, round wire: rate of a coil, k = G d^4/(8 D^3 n), and stress, tau = q 8 F D/(pi d^3).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

SHEAR_MODULUS = 81.5e9
"""Of spring wire [Pa] [EN]."""

SHEAR_STRESS = 600e6
"""Allowed at the largest elongation [Pa]; assumed, see above."""

INDICES = (5.0, 6.0, 8.0, 10.0, 12.0, 16.0)
"""Mean diameter of the coil over that of the wire: what is wound easily."""

THINNEST = 0.2e-3
"""Wire that springs are usually wound of [m]."""

FEWEST = 3.0
"""Turns below which the loops decide the rate."""


@dataclass(frozen=True)
class Coil:
    """An extension spring: diameters of wire and coil (outside) [m], number of turns, length without load [m]."""

    wire: float
    outside: float
    turns: float
    length: float


def extension_spring(rate: float, stretch: float, room: float) -> Coil | None:
    """Return the slimmest extension spring of a rate [N/m] that can be stretched so far [m] from at most a length [m].

    None if there is none: the body would be longer than the room, or have too few turns.

    Examples
    --------
    >>> coil = extension_spring(690.0, 0.132, 0.136)
    >>> round(1e3 * coil.wire, 2), round(1e3 * coil.outside, 1), round(coil.turns)
    (1.9, 17.1, 55)
    """
    found = []
    for index in INDICES:
        correction = (index + 0.5) / (index - 0.75)
        wire = sqrt(8.0 * correction * index * rate * stretch / (pi * SHEAR_STRESS))
        wire = max(wire, THINNEST)
        turns = SHEAR_MODULUS * wire / (8.0 * index**3 * rate)
        if turns < FEWEST:
            # a stiffer wire would do: so few turns that the wire, not the stress, decides
            wire, turns = FEWEST * 8.0 * index**3 * rate / SHEAR_MODULUS, FEWEST
        length = (turns + 1.0) * wire + 2.0 * (index - 1.0) * wire
        if length <= room:
            found.append(Coil(wire, (index + 1.0) * wire, turns, length))
    return min(found, key=lambda coil: coil.outside, default=None)

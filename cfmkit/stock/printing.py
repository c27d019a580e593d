"""Strands and layers of a printed part: strands of a nozzle beside each other, and layers on each other.

Along its layers a part bears more than across them. A wall is a whole number of strands: between two whole numbers a
slicer leaves a gap, or presses strands together, and the wall is not what was analysed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

Layers = Literal["along", "across"]
"""Whether what bends is stressed along the layers of the print (it lies flat), or across them (it stands)."""

WHOLE_SHARE = 0.02  # part of a strand within which a thickness counts as a whole number of them


@dataclass(frozen=True)
class LayeredStrength:
    """Strength of a printed material along its layers and between them."""

    along: float  # [Pa]
    across: float  # [Pa]
    modulus_across: float | None  # [Pa]; None if no source gives one
    source: str


LAYER_STRENGTHS: Mapping[str, LayeredStrength] = MappingProxyType(
    {
        "pla": LayeredStrength(
            45e6, 12e6, 1.6e9,
            "along: Stratasys PLA, ASTM D638, on edge (flat: 26 MPa); across: PolyTerra PLA data sheet V5.3, ISO 527",
        ),
        "petg": LayeredStrength(
            45e6, 25e6, None, "additive.tools/materials/petg: 44 to 56 MPa along, 25 to 38 MPa between the layers"
        ),
    }
)  # fmt: skip
"""By the name of the material; the others have no source that tells both."""


def strands(thickness: float, nozzle: float) -> tuple[int, ...]:
    """Return the whole numbers of strands next to a thickness [m], the nearest first; one if it is whole already.

    Examples
    --------
    >>> strands(0.96e-3, 0.4e-3), strands(1.2e-3, 0.4e-3), strands(0.1e-3, 0.4e-3)
    ((2, 3), (3,), (1,))
    """
    share = thickness / nozzle
    nearest = max(1, round(share))
    if abs(share - nearest) <= WHOLE_SHARE or share < 1.0:
        return (nearest,)
    return (nearest, nearest + (1 if share > nearest else -1))


def is_whole(thickness: float, nozzle: float) -> bool:
    """Return True if a thickness [m] is a whole number of strands."""
    share = thickness / nozzle
    return share > 0.5 and abs(share - round(share)) <= WHOLE_SHARE


def strands_in_words(thickness: float, nozzle: float) -> str:
    """Return how many strands a thickness is, and what would be whole numbers of them.

    Examples
    --------
    >>> strands_in_words(0.96e-3, 0.4e-3)
    '0.96 mm are 2.4 strands of 0.4 mm: whole ones are 0.8 mm (2) or 1.2 mm (3)'
    >>> strands_in_words(1.2e-3, 0.4e-3)
    '1.2 mm are 3 strands of 0.4 mm'
    """
    millimetres, share = 1e3 * thickness, thickness / nozzle
    if is_whole(thickness, nozzle):
        return f"{millimetres:.6g} mm are {round(share)} strand{'s' if round(share) > 1 else ''} of {1e3 * nozzle:g} mm"
    neighbours = sorted(strands(thickness, nozzle))
    whole = " or ".join(f"{1e3 * nozzle * number:.6g} mm ({number})" for number in neighbours)
    rounded = math.floor(100.0 * share + 0.5) / 100.0
    return f"{millimetres:.6g} mm are {rounded:g} strands of {1e3 * nozzle:g} mm: whole ones are {whole}"

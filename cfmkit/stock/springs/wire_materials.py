"""Spring wire by class: moduli, tensile strength, and the diameters for which the strength is published.

Strength is A / d^m with d in mm, the smallest tensile strength of a wire. A and m hold between the diameters that the
table prints with them; a wire outside of these is refused, not extrapolated.

Reference
---------
[Sh] R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill (2011): Table 10-4
    (A, m and their diameters), Table 10-5 (moduli), Tables 10-6 and 10-7 and eq. 10-57 (shares of the tensile strength
    at which turns and loops yield, set not removed).
[G] Gutekunst Federn, Federn-EinMalEins, Table 1.1: moduli that a maker calculates with, of the wires of EN 10270-1,
    EN 10270-3 and EN 12166. Those of EN 10270-1 are in the standard, too, for all of its diameters (0.05 to 20 mm).
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

RANGE_RTOL = 1e-9  # diameters at the ends of a range are inside of it, whatever their rounding


class WireOutOfRange(InputError, ValueError):
    """A wire diameter for which a class has no published strength (also a ValueError, for validators)."""


@dataclass(frozen=True)
class Strength:
    """Tensile strength over a range of diameters: A / d^m."""

    thinnest: float  # diameter [mm]
    thickest: float  # diameter [mm]
    constant: float  # A, the strength at 1 mm [MPa]
    exponent: float  # m

    def includes(self, wire: float) -> bool:
        """Return True if a diameter [m] is in the range."""
        return self.thinnest * (1 - RANGE_RTOL) <= 1e3 * wire <= self.thickest * (1 + RANGE_RTOL)


@dataclass(frozen=True)
class YieldShares:
    """Stresses at which a spring yields under a load at rest, over the tensile strength of its wire."""

    shear: float  # in the turns of extension and compression springs
    bending: float  # in those of torsion springs
    loops: float  # bending in the loops of extension springs


COLD_DRAWN = YieldShares(0.45, 0.78, 0.75)
HARDENED_TEMPERED = YieldShares(0.50, 0.87, 0.75)
STAINLESS_OR_NONFERROUS = YieldShares(0.35, 0.61, 0.55)
"""[Sh, Tables 10-6 and 10-7, eq. 10-57], of a range the smaller share."""


@dataclass(frozen=True)
class WireMaterial:
    """Class of spring wire."""

    name: str
    words: str  # in words, with the standards that it is bought by
    youngs_modulus: float  # [Pa]
    shear_modulus: float  # [Pa]
    source: str  # of the moduli
    yields: YieldShares
    strengths: tuple[Strength, ...] = ()  # [Sh, Table 10-4], by increasing diameter; empty where it has none

    @property
    def thinnest(self) -> float:
        """Smallest diameter with a published strength [m]; zero if there is none."""
        return 1e-3 * self.strengths[0].thinnest if self.strengths else 0.0

    @property
    def thickest(self) -> float:
        """Largest diameter with a published strength [m]; infinite if there is none."""
        return 1e-3 * self.strengths[-1].thickest if self.strengths else float("inf")

    def check_diameter(self, diameter: float) -> None:
        """Raise `WireOutOfRange` if strengths of this class are published, but not of this diameter [m]."""
        if self.strengths and not any(entry.includes(diameter) for entry in self.strengths):
            raise WireOutOfRange(
                f"{self.name} is listed from {1e3 * self.thinnest:g} to {1e3 * self.thickest:g} mm "
                f"(Shigley, Table 10-4), and the wire is {1e3 * diameter:.4g} mm"
            )

    def tensile_strength(self, wire: float) -> float:
        """Return the smallest tensile strength of a diameter [m], A / d^m [Pa].

        Raises WireOutOfRange if [Sh, Table 10-4] does not list the diameter, or the class.

        Examples
        --------
        >>> round(WIRES_BY_NAME["music-wire"].tensile_strength(2e-3) / 1e6)
        2000
        >>> WIRES_BY_NAME["music-wire"].tensile_strength(7.25e-3)
        Traceback (most recent call last):
        ...
        cfmkit.stock.springs.wire_materials.WireOutOfRange: music-wire is listed from 0.1 to 6.5 mm (Shigley, \
        Table 10-4), and the wire is 7.25 mm
        """
        self.check_diameter(wire)
        for entry in self.strengths:
            if entry.includes(wire):
                return float(entry.constant * 1e6 / (1e3 * wire) ** entry.exponent)
        raise WireOutOfRange(f"{self.name} has no tensile strength in Table 10-4 of Shigley: state 'max_stress'")


_EN_10270_1 = "EN 10270-1 [G]: 206 and 81.5 GPa for all diameters"
WIRES_BY_NAME: Mapping[str, WireMaterial] = MappingProxyType(
    {
        material.name: material
        for material in (
            WireMaterial(
                "music-wire", "music wire (ASTM A228, EN 10270-1 SH and DH)", 206e9, 81.5e9, _EN_10270_1,
                COLD_DRAWN,
                (Strength(0.10, 6.5, 2211.0, 0.145),),
            ),
            WireMaterial(
                "hard-drawn", "hard-drawn wire (ASTM A227, EN 10270-1 SL and SM)", 206e9, 81.5e9, _EN_10270_1,
                COLD_DRAWN,
                (Strength(0.7, 12.7, 1783.0, 0.190),),
            ),
            WireMaterial(
                "oil-tempered", "oil-tempered wire (ASTM A229)", 196.5e9, 77.2e9, "[Sh, Table 10-5]",
                HARDENED_TEMPERED,
                (Strength(0.5, 12.7, 1855.0, 0.187),),
            ),
            WireMaterial(
                "chrome-vanadium", "chrome-vanadium wire (ASTM A232)", 203.4e9, 77.2e9, "[Sh, Table 10-5]",
                HARDENED_TEMPERED,
                (Strength(0.8, 11.1, 2005.0, 0.168),),
            ),
            WireMaterial(
                "chrome-silicon", "chrome-silicon wire (ASTM A401)", 203.4e9, 77.2e9, "[Sh, Table 10-5]",
                HARDENED_TEMPERED,
                (Strength(1.6, 9.5, 1974.0, 0.108),),
            ),
            WireMaterial(
                "stainless-302", "stainless wire (302 and 304, ASTM A313; 1.4310, EN 10270-3)", 185e9, 70e9,
                "1.4310 of EN 10270-3 [G]; [Sh, Table 10-5] has 193 and 69.0 GPa",
                STAINLESS_OR_NONFERROUS,
                (
                    Strength(0.3, 2.5, 1867.0, 0.146),
                    Strength(2.5, 5.0, 2065.0, 0.263),
                    Strength(5.0, 10.0, 2911.0, 0.478),
                ),
            ),
            WireMaterial(
                "stainless-17-7ph", "stainless wire (17-7 PH, ASTM A313 type 631; 1.4568, EN 10270-3)", 195e9, 73e9,
                "1.4568 of EN 10270-3 [G]; [Sh, Table 10-5] has 203 and 75.8 GPa",
                STAINLESS_OR_NONFERROUS,
            ),
            WireMaterial(
                "phosphor-bronze", "phosphor bronze (ASTM B159; CuSn6, EN 12166)", 115e9, 42e9, "CuSn6 of EN 12166 [G]",
                STAINLESS_OR_NONFERROUS,
                (
                    Strength(0.1, 0.6, 1000.0, 0.0),
                    Strength(0.6, 2.0, 913.0, 0.028),
                    Strength(2.0, 7.5, 932.0, 0.064),
                ),
            ),
            WireMaterial(
                "beryllium-copper", "beryllium copper (ASTM B197; CuBe2, EN 12166)", 120e9, 47e9,
                "CuBe2 of EN 12166 [G]; [Sh, Table 10-5] has 117 and 44.8, or 131 and 50.3 GPa",
                STAINLESS_OR_NONFERROUS,
            ),
        )
    }
)  # fmt: skip
"""Every class by name."""
MUSIC_WIRE = WIRES_BY_NAME["music-wire"]  # what a spring is wound of where nothing else is stated

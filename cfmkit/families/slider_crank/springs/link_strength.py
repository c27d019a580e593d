"""Whether crank and coupler bear what springs and drive put on them, and how much they bend: links are no rigid lines.

Each link is a bar with a hole at both ends, w wide and s thick. Along it act an axial force N and a moment that runs
linearly between its ends, where the torsion springs take hold. Counted are, per leg and without friction:

- tension and bending in the section through a hole of diameter d: |N|/((w - d) s) + 6 w |M|/(s (w^3 - d^3));
- shear-out behind a pin, on two planes as long as the wall is thick: R/(s (w - d)), against the yield shear strength of
  von Mises, the allowable stress over sqrt(3);
- bearing of a pin: R/(d s);
- Euler's load out of the plane, the pins as hinges: pi^2 E w s^3/(12 L^2);
- the turn of one end of a link against the other under the moment k q of a torsion spring, all along the link: k L/(E
  I)
  times the spring's own turn q, I = s w^3/12. The true moment is smaller everywhere but at that end.

Assumes: both links of one sheet, equal pins; no load out of the plane (links lie beside each other, a sheet apart).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.springs.sprung_linkage import coupler_angle
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly

DEFINITIONS = {
    "link_stress_max": (
        "stress",
        "largest tension and bending in crank and coupler, in the section through a pin hole",
    ),
    "pin_bearing_max": ("stress", "largest force on a pin hole over its diameter and the thickness of the link"),
    "link_safety_factor": (
        "factor",
        "allowable stress of the links' material over what they bear: tension with bending, bearing of the pins, "
        "shear-out behind them; and Euler's load over the largest compression",
    ),
    "link_turn_share_max": (
        "ratio",
        "elastic turn of a link under the moment of a torsion spring at its end, over that spring's turn: k L/(E I)",
    ),
}


@dataclass(frozen=True)
class LinkLoads:
    """What acts on crank and coupler of one leg.

    Rows of every (2, n) array are crank and coupler, n places of the motion.
    """

    lengths: tuple[float, float]  # crank, coupler [m]
    axial: FloatArray  # (2, n), tension positive [N]
    moment: FloatArray  # (2, n), larger one of both ends, positive [N m]
    pin: FloatArray  # (n,), force on each pin hole [N]
    springs: tuple[float, float]  # stiffest torsion spring at an end of each link [N m/rad]

    @cached_property
    def pin_max(self) -> float:
        """Largest force on a pin hole [N]."""
        return float(self.pin.max())


@dataclass(frozen=True)
class LinkBar:
    """Section and material of crank and coupler."""

    width: float  # [m]
    sheet: float  # thickness [m]
    hole: float  # diameter [m]
    modulus: float  # [Pa]

    def stress(self, loads: LinkLoads) -> float:
        """Return the largest tension and bending in the section through a hole [Pa]."""
        w, d, s = self.width, self.hole, self.sheet
        both = np.abs(loads.axial) / ((w - d) * s) + 6.0 * w * loads.moment / (s * (w**3 - d**3))
        return float(both.max())

    def bearing(self, loads: LinkLoads) -> float:
        """Return the largest pressure of a pin [Pa]."""
        return loads.pin_max / (self.hole * self.sheet)

    def shear_out(self, loads: LinkLoads) -> float:
        """Return the largest shear stress behind a pin [Pa]."""
        return loads.pin_max / (self.sheet * (self.width - self.hole))

    def turn_share(self, loads: LinkLoads) -> float:
        """Return the largest elastic turn of a link over that of the torsion spring at its end."""
        bending = self.modulus * self.sheet * self.width**3 / 12.0
        return max(rate * length / bending for rate, length in zip(loads.springs, loads.lengths, strict=True))

    def safety(self, loads: LinkLoads, allowable: float) -> float:
        """Return by what all loads may grow, at least 1 where the links bear them; infinite without any."""
        euler = pi**2 * self.modulus * self.width * self.sheet**3 / 12.0
        pressed = np.maximum(-loads.axial, 0.0).max(axis=1) * np.square(loads.lengths)
        used = (
            self.stress(loads) / allowable,
            self.bearing(loads) / allowable,
            sqrt(3.0) * self.shear_out(loads) / allowable,
            float(pressed.max()) / euler,
        )
        return 1.0 / max(used) if max(used) > 0.0 else np.inf


def link_loads(assembly: Assembly, motion: FloatArray, legs: int) -> LinkLoads:
    """Return what acts on the links of one leg along a motion, (n,) [rad or m]."""
    alone = replace(assembly, rates=assembly.rates / legs)
    units, rates, linkage = alone.units(motion), alone.rates, alone.linkage
    # a spring that is nowhere does nothing, even where a unit spring would at a pole
    effort = np.where(rates[:, None] > 0.0, units.effort, 0.0)
    turn = np.where(rates[:, None] > 0.0, units.turn, 0.0)
    drive = rates @ effort if alone.drive == "force" else np.zeros(len(motion))
    beta, angle = coupler_angle(linkage, units), units.angle
    own, other = rates[1] * turn[1], rates[2] * turn[2]
    pulled = -rates[3] * turn[3] - linkage.branch * drive  # on the slider, along its path
    with np.errstate(divide="ignore", invalid="ignore"):
        across = (linkage.coupler * np.sin(beta) * pulled + own + other) / (linkage.coupler * np.cos(beta))
    at_pivot = linkage.crank * (-pulled * np.sin(angle) + across * np.cos(angle)) + own
    axial = np.stack([pulled * np.cos(angle) + across * np.sin(angle), pulled * np.cos(beta) + across * np.sin(beta)])
    moment = np.stack([np.maximum(np.abs(own), np.abs(at_pivot)), np.maximum(np.abs(own), np.abs(other))])
    there = np.isfinite(axial).all(axis=0) & np.isfinite(moment).all(axis=0)
    lengths = linkage.crank, linkage.coupler
    springs = float(max(rates[:2])), float(max(rates[1:3]))
    return LinkLoads(lengths, axial[:, there], moment[:, there], np.hypot(pulled, across)[there], springs)


def link_of(spec: SliderCrankSpec) -> LinkBar | None:
    """Return the links of a mechanism; None where their material or their thickness is not stated."""
    part, material = spec.mechanism.part, spec.mechanism.material
    if material is None or part is None or part.sheet is None:
        return None
    eye, hole = eye_and_hole(spec)
    return LinkBar(2.0 * eye, part.sheet, 2.0 * hole, material.modulus)


def values_of_links(spec: SliderCrankSpec, assembly: Assembly, motion: FloatArray) -> Mapping[str, Quantity]:
    """Return what the links bear over a motion; nothing where they are not described."""
    link, material = link_of(spec), spec.mechanism.material
    if link is None or material is None or not assembly.rates.any():
        return {}
    loads = link_loads(assembly, motion, spec.mechanism.sets)
    if not len(loads.pin):
        return {}
    allowable = material.allowable(spec.mechanism.safety_factor)
    numbers: dict[str, float | None] = {
        "link_stress_max": link.stress(loads),
        "pin_bearing_max": link.bearing(loads),
        "link_safety_factor": None if allowable is None else link.safety(loads, allowable),
        "link_turn_share_max": link.turn_share(loads),
    }
    reason = "no strength of the material is known"
    return {
        name: Quantity(value, *DEFINITIONS[name], "" if value is not None else reason)
        for name, value in numbers.items()
    }


PIN_DIAMETERS = tuple(1e-3 * d for d in (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30))
"""Dowel pins that are made [m]: the diameters of ISO 2338."""

PIN_STRENGTH = 235e6
"""Yield strength of pins [Pa]: plain carbon steel, EN 10025-2 S235; hardened ones bear more."""

LARGEST_TURN_SHARE = 0.01
"""Turn of a link over that of its spring up to which links count as rigid."""

WIDEST_SHARE = 0.5
"""Largest width of a link over the length of the shorter one: wider ones are plates, and bend as plates do."""

SPARE = 1.001
"""Sizes are larger by this share than just enough."""


def links_that_bear(
    loads: LinkLoads, sheet: float, modulus: float, allowable: float, least: float, widest_pin: float
) -> LinkBar | None:
    """Return the narrowest links of a sheet that bear their loads and stay straight; None if there are none.

    Parameters
    ----------
    loads : LinkLoads
    sheet : float
        Thickness [m].
    modulus, allowable : float
        Of the material [Pa].
    least : float
        Thinnest wall that the process makes [m].
    widest_pin : float
        Largest diameter of a pin: torsion springs go around it [m].
    """
    pin = next((d for d in PIN_DIAMETERS if _pin_bears(d, loads, sheet, allowable)), None)
    if pin is None or pin > widest_pin:
        return None
    low, high = pin + 2.0 * max(least, 0.25 * pin), WIDEST_SHARE * min(loads.lengths)

    def bears(width: float) -> bool:
        link = LinkBar(width, sheet, pin, modulus)
        return link.safety(loads, allowable) >= SPARE and SPARE * link.turn_share(loads) <= LARGEST_TURN_SHARE

    if low > high or not bears(high):
        return None
    if bears(low):
        return LinkBar(low, sheet, pin, modulus)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if bears(middle) else (middle, high)
    return LinkBar(high, sheet, pin, modulus)


def least_sheet(loads: LinkLoads, modulus: float, allowable: float) -> float:
    """Return a thickness below which not even the widest links stay straight and bear their bending [m]."""
    widest = LinkBar(WIDEST_SHARE * min(loads.lengths), 1.0, 0.0, modulus)  # both go with one over the thickness
    return max(widest.turn_share(loads) / LARGEST_TURN_SHARE, widest.stress(loads) / allowable)


def _pin_bears(diameter: float, loads: LinkLoads, sheet: float, allowable: float) -> bool:
    """Return True if a pin bears its load: in its hole, and bent between two links, whose middles are a sheet apart."""
    pressure = loads.pin_max / (diameter * sheet)
    bent = 32.0 * loads.pin_max * sheet / (pi * diameter**3)
    return SPARE * pressure <= allowable and SPARE * bent <= PIN_STRENGTH

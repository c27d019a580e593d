"""Whether crank and coupler bear what springs and drive put on them, and how much they bend: links are no rigid lines.

Each link is a bar with a hole at both ends, w wide and s thick. Along it act an axial force N and a moment that runs
linearly between its ends, where the torsion springs take hold. Counted are, per leg and without friction:

- tension and bending in the section through a hole of diameter d: |N|/((w - d) s) + 6 w |M|/(s (w^3 - d^3));
- shear-out behind a pin, on two planes as long as the wall is thick: R/(s (w - d)), against the yield shear strength of
  von Mises, the allowable stress over sqrt(3);
- bearing of a pin: R/(d s);
- Euler's load out of the plane, the pins as hinges: pi^2 E w s^3/(12 L^2);
- the turn of one end of a link against the other under the moment k q of a torsion spring, all along the link:
  k L/(E I) times the spring's own turn q, I = s w^3/12. The true moment is smaller everywhere but at that end.

Assumes: both links of one sheet, equal pins; no load out of the plane (links lie beside each other, a sheet apart).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.springs.sprung_linkage import coupler_angle
from cfmkit.stock.joint_strength import SHEAR_SHARE, bearing_pressure, euler_load, link_stress, pin_bending, shear_out
from cfmkit.stock.stock_series import ALL_SERIES

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.hardware import PartStrength
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly

STRENGTH_DEFINITIONS = {
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
    """Loads on crank and coupler of one leg, at n places of the motion; of m mechanisms as rows.

    Rows of every (2, ..., n) array are crank and coupler. Where forces are unbounded there are zeros.
    """

    lengths: tuple[Any, Any]  # crank, coupler [m]
    axial: FloatArray  # (2, ..., n), tension positive [N]
    moment: FloatArray  # (2, ..., n), larger one of both ends, positive [N m]
    pin: FloatArray  # (..., n), force on each pin hole [N]
    springs: tuple[Any, Any]  # stiffest torsion spring at an end of each link [N m/rad]

    @cached_property
    def pin_max(self) -> Any:
        """Largest force on a pin hole [N]."""
        return self.pin.max(axis=-1)


@dataclass(frozen=True)
class LinkBar:
    """Section and material of crank and coupler; of m mechanisms arrays (m,)."""

    width: Any  # [m]
    sheet: Any  # thickness [m]
    hole: Any  # diameter [m]
    modulus: Any  # [Pa]

    def stress(self, loads: LinkLoads) -> Any:
        """Return the largest tension and bending in the section through a hole [Pa]."""
        w, d, s = (np.asarray(size)[..., None] for size in (self.width, self.hole, self.sheet))
        return link_stress(loads.axial, loads.moment, w, s, d).max(axis=(0, -1))

    def bearing(self, loads: LinkLoads) -> Any:
        """Return the largest pressure of a pin [Pa]."""
        return bearing_pressure(loads.pin_max, self.hole, self.sheet)

    def shear_out(self, loads: LinkLoads) -> Any:
        """Return the largest shear stress behind a pin [Pa]."""
        return shear_out(loads.pin_max, self.width, self.sheet, self.hole)

    def turn_share(self, loads: LinkLoads) -> Any:
        """Return the largest elastic turn of a link over that of the torsion spring at its end."""
        bending = self.modulus * self.sheet * self.width**3 / 12.0
        crank, coupler = (rate * length for rate, length in zip(loads.springs, loads.lengths, strict=True))
        return np.maximum(crank, coupler) / bending

    def safety(self, loads: LinkLoads, allowable: Any) -> Any:
        """Return by what all loads may grow, at least 1 where the links bear them; infinite without any."""
        pressed = zip(np.maximum(-loads.axial, 0.0).max(axis=-1), loads.lengths, strict=True)
        used = (
            self.stress(loads) / allowable,
            self.bearing(loads) / allowable,
            self.shear_out(loads) / (SHEAR_SHARE * allowable),
            *(force / euler_load(self.modulus, self.width, self.sheet, length) for force, length in pressed),
        )
        with np.errstate(divide="ignore"):
            return 1.0 / np.max(np.broadcast_arrays(*used), axis=0)


def link_loads(assembly: Assembly, motion: FloatArray, legs: Any) -> LinkLoads:
    """Return what acts on the links of one leg along a motion, (n,) [rad or m]; as rows, (m, n) with `legs` (m,)."""
    units, link = assembly.units(motion), assembly.linkage
    per_leg = 1.0 / np.asarray(legs, dtype=float)[..., None]
    drive = assembly.total(units.effort) if assembly.drive == "force" else np.zeros(1)
    moments = assembly.weigh(units.turn)
    at_crank_pin, at_slider_pin = moments[1], moments[2]
    beta, angle = coupler_angle(link, units), units.angle
    pulled = -moments[3] - link.branch * drive  # on the slider, along its path
    with np.errstate(divide="ignore", invalid="ignore"):
        across = (link.coupler * np.sin(beta) * pulled + at_crank_pin + at_slider_pin) / (link.coupler * np.cos(beta))
        at_pivot = link.crank * (-pulled * np.sin(angle) + across * np.cos(angle)) + at_crank_pin
        axial = [pulled * np.cos(link_angle) + across * np.sin(link_angle) for link_angle in (angle, beta)]
        moment = [np.maximum(np.abs(at_crank_pin), np.abs(at_end)) for at_end in (at_pivot, at_slider_pin)]
    loads = np.stack(np.broadcast_arrays(*axial, *moment, np.hypot(pulled, across))) * per_leg
    loads = np.where(np.isfinite(loads).all(axis=0), loads, 0.0)
    shape = assembly.rates.shape[1:2]  # () of one, (m,) of rows
    stiffest = (assembly.rates[k : k + 2].max(axis=0).reshape(shape) * per_leg[..., 0] for k in (0, 1))
    lengths = tuple(np.reshape(length, np.shape(length)[:1]) for length in (link.crank, link.coupler))
    return LinkLoads((lengths[0], lengths[1]), loads[:2], loads[2:4], loads[4], (next(stiffest), next(stiffest)))


def link_of(spec: SliderCrankSpec) -> LinkBar | None:
    """Return the links of a mechanism; None if their material or their thickness is not stated."""
    part, material = spec.mechanism.part, spec.mechanism.material
    if material is None or part is None or part.sheet is None:
        return None
    eye, hole = eye_and_hole(spec)
    return LinkBar(2.0 * eye, part.sheet, 2.0 * hole, material.modulus)


def allowable_of(spec: SliderCrankSpec) -> float | None:
    """Return the allowable stress of the links' material [Pa]; None if no strength is known."""
    material = spec.mechanism.material
    return None if material is None else material.allowable(spec.mechanism.safety_factor)


PIN_DIAMETERS = tuple(
    diameter for series in ALL_SERIES if series.standard == "ISO 2338" for diameter in series.sizes if diameter >= 1e-3
)
"""Pins of links [m]: the diameters of ISO 2338 from 1 mm on."""
LARGEST_TURN_SHARE = 0.01  # turn of a link over that of its spring up to which links count as rigid
WIDEST_SHARE = 0.5
"""Largest width of a link over the length of the shorter one: wider ones are plates, and bend as plates do."""
SIZE_MARGIN = 1.001  # sizes are larger by this share than just enough


def links_that_bear(
    loads: LinkLoads,
    sheet: float,  # thickness [m]
    strength: PartStrength,  # of the material, and of its pins
    least: float,  # thinnest wall that the process makes [m]
    widest_pin: float,  # largest diameter of a pin: torsion springs go around it [m]
) -> LinkBar | None:
    """Return the narrowest links of a sheet that bear their loads and stay straight; None if there are none."""
    pin = next((d for d in PIN_DIAMETERS if _pin_bears(d, loads, sheet, strength)), None)
    if pin is None or pin > widest_pin:
        return None
    low, high = pin + 2.0 * max(least, 0.25 * pin), WIDEST_SHARE * min(loads.lengths)

    modulus = strength.modulus

    def bears(width: float) -> bool:
        link = LinkBar(width, sheet, pin, modulus)
        return bool(
            link.safety(loads, strength.allowable) >= SIZE_MARGIN
            and SIZE_MARGIN * link.turn_share(loads) <= LARGEST_TURN_SHARE
        )

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
    return float(max(widest.turn_share(loads) / LARGEST_TURN_SHARE, widest.stress(loads) / allowable))


def _pin_bears(diameter: float, loads: LinkLoads, sheet: float, strength: PartStrength) -> bool:
    """Return True if a pin bears its load: in its hole, and bent between two links, whose middles are a sheet apart."""
    pressure = bearing_pressure(loads.pin_max, diameter, sheet)
    bent = pin_bending(loads.pin_max, sheet, diameter)
    return bool(SIZE_MARGIN * pressure <= strength.allowable and SIZE_MARGIN * bent <= strength.pins)

"""Custom springs: the slimmest one of a rate that can be stretched, or turned, so far, where no list has it.

The formulas are those of `cfmkit.stock.springs.helical_spring_formulas`, the wire is music wire of the diameters in its
table, the share of the strength is that of the generic series. Bodies are close-wound, loops are as high as the inside
of the coil.
"""

from __future__ import annotations

from math import log2, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.specs.units import format_short
from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring, Kind, tensile_strength
from cfmkit.stock.springs.offer_type_and_generic_series import BENDING_SHARE, SHEAR_SHARE
from cfmkit.stock.springs.wire_materials import MUSIC_WIRE

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

SPRING_INDICES = (5.0, 6.0, 8.0, 10.0, 12.0, 16.0)
"""Mean diameter of the coil over that of the wire: what is wound easily."""

MIN_WIRE_DIAMETER = 0.2e-3
"""Wire that springs are usually wound of [m]."""

MIN_TURNS = 3.0
"""Turns below which the loops decide the rate."""

PIN_SHARE = 0.9
"""Diameter of a pin over the inside of a torsion spring that is wound up: what spring makers leave as clearance."""

N_HALVINGS = 16
"""Of the wire's diameter, where the length decides it."""


def extension_spring(rate: float, stretch: float, room: float) -> HelicalSpring | None:
    """Return the slimmest extension spring of a rate [N/m] that can be stretched so far [m] from at most a length [m].

    None if there is none: the body would be longer than the room.

    Examples
    --------
    >>> spring = extension_spring(690.0, 0.132, 0.136)
    >>> round(spring.rate, 6), round(1e3 * spring.wire, 2), round(1e3 * spring.outer_diameter, 1), round(spring.turns)
    (690.0, 1.68, 15.1, 48)
    """
    fitting = [spring for spring in _candidates("extension", rate, stretch) if loaded_length(spring) <= room]
    return min(fitting, key=lambda spring: spring.outer_diameter, default=None)


def as_stated(spring: HelicalSpring) -> dict[str, Any]:
    """Return designation and wire of a spring as a specification has them."""
    wire, coil = (format_short(size, "length") for size in (spring.wire, spring.coil))
    return {
        "name": f"custom, wire {wire}, coil {coil}, {spring.turns:.3g} turns",
        "wound": {"wire": spring.wire, "coil": spring.coil, "turns": spring.turns},
    }


def torsion_spring(rate: float, turn: float, room: float, pin: float = 0.0) -> HelicalSpring | None:
    """Return the slimmest torsion spring of a rate [N m/rad] that can be turned so far [rad], at most so long [m].

    None if there is none: the body, which is longest when it is wound up, would be longer, or the inside, which is
    narrowest then, too narrow for a pin of that diameter [m].

    Examples
    --------
    >>> spring = torsion_spring(0.05, 1.0, 0.05)
    >>> round(spring.rate, 9), round(1e3 * spring.wire, 2), round(1e3 * spring.outer_diameter, 1), round(spring.turns)
    (0.05, 0.76, 4.5, 6)
    >>> torsion_spring(0.05, 1.0, 0.002) is None
    True
    """
    springs = _fit_over_pin(_candidates("torsion", rate, turn), turn, pin)
    fitting = [spring for spring in springs if spring.body_length_wound_up(turn) <= room]
    return min(fitting, key=lambda spring: spring.outer_diameter, default=None)


def shortest_torsion_spring(rate: float, turn: float, widest: float, pin: float = 0.0) -> HelicalSpring | None:
    """Return the shortest torsion spring of a rate [N m/rad] that can be turned so far [rad], at most so wide [m].

    None if there is none: the coil would be wider, or too narrow for a pin of that diameter [m].
    """
    springs = _fit_over_pin(_candidates("torsion", rate, turn), turn, pin)
    fitting = [spring for spring in springs if spring.outer_diameter <= widest]
    return min(fitting, key=lambda spring: spring.body_length, default=None)


def stiffest(kind: Kind, deflection: FloatArray, widest: float | FloatArray, room: float | FloatArray) -> FloatArray:
    """Return the largest rates of springs that can be stretched [m], or turned [rad], so far and fit: zero for none.

    Parameters
    ----------
    kind : {"extension", "torsion"}
        Of the springs.
    deflection : (n,) array
        How far they are stretched or turned.
    widest, room : float or (n,) array
        Largest outer diameter, and length with the loops of one that is stretched [m].

    Examples
    --------
    >>> (rate,) = stiffest("torsion", np.array([1.0]), 5e-3, 30e-3)
    >>> [bool(torsion_spring(share * rate, 1.0, 30e-3).outer_diameter <= 5e-3) for share in (0.999, 1.001)]
    [True, False]
    """
    units = [HelicalSpring(kind, 1e-3, index * 1e-3, 1.0) for index in SPRING_INDICES]
    rate, stress = (np.array(one)[:, None] for one in zip(*((one.rate, one.stress(1.0)) for one in units), strict=True))
    power, share = (3.0, BENDING_SHARE) if kind == "torsion" else (1.0, SHEAR_SHARE)
    index = np.array(SPRING_INDICES)[:, None]
    # in wires: one more than the turns, and what winds up, or both loops
    ends = 1.0 + (deflection / (2.0 * pi) if kind == "torsion" else 2.0 * (index - 1.0))
    falls = log2(tensile_strength(1e-3) / tensile_strength(2e-3))
    each = rate * stress * np.maximum(deflection, 1e-12) / (share * tensile_strength(1e-3))

    def turns(wire: FloatArray) -> FloatArray:  # of a wire in mm at its allowed stress: load is as its square or cube
        return np.asarray(np.maximum(each * wire ** (power - max(power, 2.0) + falls), MIN_TURNS))

    # the thicker the wire, the stiffer, and the longer
    thickest = np.minimum(1e3 * widest / (index + 1.0), 1e3 * MUSIC_WIRE.thickest) + np.zeros(each.shape)
    low = np.full(each.shape, MIN_WIRE_DIAMETER / 1e-3)
    high = np.maximum(thickest, low)
    for _ in range(N_HALVINGS):
        middle = 0.5 * (low + high)
        fits = (turns(middle) + ends) * middle * 1e-3 <= room
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    there = (thickest >= MIN_WIRE_DIAMETER / 1e-3) & ((turns(low) + ends) * low * 1e-3 <= room)
    return np.asarray(np.where(there, rate * low**power / turns(low), 0.0).max(axis=0))


def loaded_length(spring: HelicalSpring) -> float:
    """Return the length at rest with both loops [m]."""
    return spring.body_length + 2.0 * (spring.coil - spring.wire)


def _candidates(kind: Kind, rate: float, deflection: float) -> list[HelicalSpring]:
    """Return the spring of each index whose wire is drawn so thick."""
    springs = [_size_spring(kind, index, rate, deflection) for index in SPRING_INDICES]
    return [spring for spring in springs if spring.wire <= MUSIC_WIRE.thickest]


def _fit_over_pin(springs: list[HelicalSpring], turn: float, pin: float) -> list[HelicalSpring]:
    """Return the torsion springs that fit over a pin [m] when they are wound up by an angle [rad]."""
    return [spring for spring in springs if PIN_SHARE * spring.inner_diameter_wound_up(turn) >= pin]


def _size_spring(kind: Kind, index: float, rate: float, deflection: float) -> HelicalSpring:
    """Return the spring of an index whose wire is at its allowed stress when deflected, or with the fewest turns."""
    unit = HelicalSpring(kind, 1e-3, index * 1e-3, MIN_TURNS)
    # the rate of wire of an index is as a power of its diameter, and so is its stress but for the strength, which falls
    # with the 0.145th power: with 1 mm as the unit of the wire
    power, share = (3.0, BENDING_SHARE) if kind == "torsion" else (1.0, SHEAR_SHARE)
    falls = log2(tensile_strength(1e-3) / tensile_strength(2e-3))
    exponent = (3.0 if kind == "torsion" else 2.0) - falls
    wire = (unit.stress(rate * deflection) / (share * tensile_strength(1e-3))) ** (1.0 / exponent)
    wire = max(wire, MIN_WIRE_DIAMETER / 1e-3)
    turns = MIN_TURNS * unit.rate * wire**power / rate
    if turns < MIN_TURNS:
        wire, turns = (rate / unit.rate) ** (1.0 / power), MIN_TURNS
    return HelicalSpring(kind, 1e-3 * wire, 1e-3 * index * wire, turns)

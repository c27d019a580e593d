"""Custom springs: the slimmest one of a rate that can be stretched, or turned, so far, where no list has it.

The formulas are those of `cfmkit.stock.springs.helical_spring_formulas`, the wire is music wire in the diameters of the
metric series, coils and turns are in steps that a winder sets. The load is that which the generic series allows, or
where it is less that at which the spring yields over a safety factor. Bodies are close-wound, loops are as high as the
inside of the coil.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from cfmkit.specs.units import format_short
from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring, Kind
from cfmkit.stock.springs.offer_type_and_generic_series import largest_load
from cfmkit.stock.springs.wire_materials import MUSIC_WIRE
from cfmkit.stock.stock_series import ALL_SERIES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray

MIN_INDEX, MAX_INDEX = 5.0, 16.0  # mean diameter of the coil over that of the wire: what is wound easily
N_INDICES = 12  # indices that are compared for the largest rate
MIN_WIRE_DIAMETER = 0.2e-3  # wire that springs are usually wound of [m]
WIRE_DIAMETERS = tuple(
    size
    for series in ALL_SERIES
    if (series.kind, series.system) == ("wire", "metric")
    for size in series.sizes
    if MIN_WIRE_DIAMETER <= size <= MUSIC_WIRE.thickest
)
"""Wire on offer [m], of the metric series."""
MIN_TURNS = 3.0  # turns below which the loops decide the rate
PIN_SHARE = 0.9
"""Diameter of a pin over the inside of a torsion spring that is wound up: what spring makers leave as clearance."""
COIL_STEP, COIL_STEP_OF_LARGE, LARGE_COIL = 1e-5, 5e-5, 1e-2  # steps of coil diameters, and those above a diameter [m]
STEPS_PER_TURN = 100.0  # steps of turns: a torsion spring's legs stand within 4 deg of where they should


def extension_spring(rate: float, stretch: float, room: float, safety: float = 1.0) -> HelicalSpring | None:
    """Return the slimmest extension spring of a rate [N/m] that can be stretched so far [m] from at most a length [m].

    None if there is none: the body would be longer than the room. Its rate is off by
    what the turns are rounded by.

    Examples
    --------
    >>> spring = extension_spring(690.0, 0.132, 0.136)
    >>> round(spring.rate, 1), round(1e3 * spring.wire, 2), round(1e3 * spring.outer_diameter, 1), spring.turns
    (690.0, 1.6, 12.7, 71.72)
    """
    return min(
        _springs("extension", rate, stretch, room, safety), key=lambda spring: spring.outer_diameter, default=None
    )


def as_stated(spring: HelicalSpring) -> dict[str, Any]:
    """Return designation and wire of a spring as a specification has them."""
    wire, coil = (format_short(size, "length") for size in (spring.wire, spring.coil))
    return {
        "name": f"custom, wire {wire}, coil {coil}, {spring.turns:.3g} turns",
        "wound": {"wire": spring.wire, "coil": spring.coil, "turns": spring.turns},
    }


def torsion_spring(
    rate: float, turn: float, room: float, pin: float = 0.0, safety: float = 1.0
) -> HelicalSpring | None:
    """Return the slimmest torsion spring of a rate [N m/rad] that can be turned so far [rad], at most so long [m].

    None if there is none: the body, which is longest when it is wound up, would be longer, or the inside, which is
    narrowest then, too narrow for a pin of that diameter [m].

    Examples
    --------
    >>> spring = torsion_spring(0.05, 1.0, 0.05)
    >>> round(spring.rate, 4), round(1e3 * spring.wire, 2), round(1e3 * spring.outer_diameter, 1), spring.turns
    (0.05, 0.8, 4.8, 6.59)
    >>> torsion_spring(0.05, 1.0, 0.002) is None
    True
    """
    return min(
        _springs("torsion", rate, turn, room, safety, pin), key=lambda spring: spring.outer_diameter, default=None
    )


def shortest_torsion_spring(
    rate: float, turn: float, widest: float, pin: float = 0.0, safety: float = 1.0
) -> HelicalSpring | None:
    """Return the shortest torsion spring of a rate [N m/rad] that can be turned so far [rad], at most so wide [m].

    None if there is none: the coil would be wider, or too narrow for a pin of that diameter [m].
    """
    springs = _springs("torsion", rate, turn, np.inf, safety, pin, widest)
    return min(springs, key=lambda spring: spring.body_length, default=None)


def stiffest(
    kind: Kind,  # of the springs
    deflection: FloatArray,  # (n,): how far they are stretched or turned
    # widest, room: float or (n,): largest outer diameter, and length with the loops of one that is stretched [m]
    widest: float | FloatArray,
    room: float | FloatArray,
    safety: float = 1.0,  # against yield
) -> FloatArray:
    """Return the largest rates of springs that can be stretched [m], or turned [rad], so far and fit: zero for none.

    Examples
    --------
    >>> (rate,) = stiffest("torsion", np.array([1.0]), 5e-3, 30e-3)
    >>> bool(torsion_spring(0.98 * rate, 1.0, 30e-3).outer_diameter <= 5e-3)
    True
    """
    deflection, widest, room = (np.asarray(values, dtype=float) for values in (deflection, widest, room))
    windings = np.array(_windings(kind, safety))
    slim = windings[:, windings[0] + windings[1] <= widest.max(initial=0.0)]
    wire, coil, one_turn, load = (values[:, None] for values in slim)
    rate = np.minimum(load / np.maximum(deflection, 1e-12), one_turn / MIN_TURNS)
    long = _length(kind, wire, coil, one_turn / rate, deflection)
    return np.asarray(np.where((long <= room) & (coil + wire <= widest), rate, 0.0).max(axis=0, initial=0.0))


@lru_cache(maxsize=8)
def _windings(kind: Kind, safety: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return wire and coil of all sizes and indices [m], their rate with one turn and their largest load, (n,) each."""
    indices = np.linspace(MIN_INDEX, MAX_INDEX, N_INDICES)
    springs: list[Any] = [HelicalSpring(kind, wire, cast("Any", wire * indices), 1.0) for wire in WIRE_DIAMETERS]
    rows = [
        (0.0 * spring.coil + spring.wire, spring.coil, spring.rate, largest_load(spring, safety)) for spring in springs
    ]
    wire, coil, rate, load = np.concatenate(rows, axis=1)
    return wire, coil, rate, load


def loaded_length(spring: HelicalSpring) -> float:
    """Return the length at rest with both loops [m]."""
    return spring.body_length + 2.0 * (spring.coil - spring.wire)


def _length(kind: Kind, wire: Any, coil: Any, turns: Any, deflection: Any) -> Any:
    """Return the length of a body that winds up, or of one with both loops [m]."""
    if kind == "torsion":
        return (turns + 1.0 + deflection / (2.0 * pi)) * wire
    return (turns + 1.0) * wire + 2.0 * (coil - wire)


def _springs(
    kind: Kind, rate: float, deflection: float, room: float, safety: float, pin: float = 0.0, widest: float = np.inf
) -> Iterator[HelicalSpring]:
    """Yield of each wire on offer the slimmest spring that fits; if only its width is limited, the widest.

    A pin [m] has to fit into a torsion spring that is wound up.
    """
    slimmest = np.inf
    for wire in WIRE_DIAMETERS:
        if wire * (MIN_INDEX + 1.0) >= min(slimmest, widest):  # no coil of this or of thicker wire is slimmer
            return
        coil, one_turn, most = _coils_of(kind, wire, safety)
        turns = np.maximum(np.round(one_turn / rate * STEPS_PER_TURN), 1.0) / STEPS_PER_TURN
        fits = (turns >= MIN_TURNS) & (one_turn / turns * deflection <= most) & (coil + wire <= widest)
        fits &= _length(kind, wire, coil, turns, deflection) <= room
        fits &= PIN_SHARE * (coil * turns / (turns + abs(deflection) / (2.0 * pi)) - wire) >= pin if pin else True
        places = np.flatnonzero(fits)
        if len(places):
            place = places[0 if np.isfinite(room) else -1]
            spring = HelicalSpring(kind, wire, float(coil[place]), float(turns[place]))
            slimmest = spring.outer_diameter if np.isfinite(room) else np.inf
            yield spring


@lru_cache(maxsize=512)
def _coils_of(kind: Kind, wire: float, safety: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the coils of a wire [m], the rate that each has with one turn and the load that it bears, (n,) each."""
    coil = _coil_diameters(wire)
    spring: Any = HelicalSpring(kind, wire, cast("Any", coil), 1.0)
    return coil, spring.rate, largest_load(spring, safety)


def _coil_diameters(wire: float) -> FloatArray:
    """Return the mean diameters in which a wire [m] is wound [m], increasing."""
    low, high = MIN_INDEX * wire, MAX_INDEX * wire
    small = np.arange(np.ceil(low / COIL_STEP - 1e-6), min(high, LARGE_COIL) / COIL_STEP + 1e-6) * COIL_STEP
    start = max(low, LARGE_COIL + COIL_STEP_OF_LARGE)
    large = np.arange(np.ceil(start / COIL_STEP_OF_LARGE - 1e-6), high / COIL_STEP_OF_LARGE + 1e-6) * COIL_STEP_OF_LARGE
    return np.round(np.concatenate([small, large]), 8)

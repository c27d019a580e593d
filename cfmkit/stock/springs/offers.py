"""Springs on offer: those of a list, the generic series, and custom ones; and which come nearest where none fits.

The generic series is no maker's list: it is computed (`cfmkit.stock.springs.helical_spring_formulas`) from preferred
numbers of wire diameters, spring indices and turns. It says what can be had; the spring itself is then bought by its
dimensions.

Its limits are assumed: extension and compression springs up to 38 % of the tensile strength of music wire in shear,
torsion springs up to 60 % in bending, both below what the wire holds under a load at rest, because the springs of a
constant-force mechanism move. Extension springs are taken as wound without initial tension, with full loops at both
ends. Compression springs stand with closed ends on flat plates; those that would buckle before their largest deflection
come with the rod that guides them.

A custom spring is the slimmest one of a rate that can be stretched, or turned, so far, where no list has it. The wire
is music wire in the diameters of the metric series, coils and turns are in steps that a winder sets. The load is that
which the generic series allows, or where it is less that at which the spring yields over a safety factor. Bodies are
close-wound, loops are as high as the inside of the coil.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from cfmkit.specs.units import format_short
from cfmkit.stock.springs.helical_spring_formulas import tensile_strength
from cfmkit.stock.springs.wire_materials import MUSIC_WIRE
from cfmkit.stock.stock_series import ALL_SERIES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.fatigue_and_relaxation import FatigueLaw
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring, Seats


GENERIC_SERIES = "generic"  # the word for the series that ships with the package
GENERIC_WIRE_DIAMETERS = (0.4, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0)
SPRING_INDICES = (6.0, 8.0, 10.0, 12.5)
SPRING_COUNTS = (1, 2, 4)  # the generic series: wires [mm] are preferred numbers (ISO 3, R10)
SERIES_SHARES = {"shear": 0.38, "bending": 0.60}
"""Shares of the tensile strength that the generic series allows: assumed. At 38 % in the turns the loops of an
extension spring bear up to 74 % in bending; Shigley, Table 10-7, allows 75 % there."""


@dataclass(frozen=True)
class Offer:
    """A spring on offer; SI, deflections are angles and loads couples where it is wound up."""

    name: str  # by which it is bought
    spring_type: type[HelicalSpring]  # its kind
    rate: float  # [N/m or N m/rad]
    largest: float | None = None  # largest deflection from the relaxed state [m or rad]; None if not stated
    free_length: float | None = None  # relaxed, between the hooks or over the ends [m]
    body_length: float | None = None  # of the coil [m]
    initial_tension: float = 0.0  # load at which it begins to open [N or N m]
    outer_diameter: float | None = None  # of the coil [m]
    wound: HelicalSpring | None = None  # its wire, coil and turns, if they are known
    counts: tuple[int, ...] = (1,)  # numbers in parallel to try
    max_stress: float | None = None  # largest stress allowed in the wire [Pa]; None if not stated
    fatigue: FatigueLaw | None = None  # of the wire
    life: float | None = None  # cycles that its maker states
    seats: Seats = "fixed-fixed"  # how the ends of a compression spring are held
    guide_rod: float | None = None  # diameter of the rod in a compression spring, which keeps it from buckling [m]
    guide_tube: float | None = None  # or of the tube around it [m]

    @property
    def unguided(self) -> float:
        """Deflection up to which it does not buckle without a guide [m or rad]; infinite if it never does."""
        return self.spring_type.unguided_deflection(self.free_length, self.wound, self.outer_diameter, self.seats)

    def stress(self, deflection: float) -> float | None:
        """Return the stress in the wire at a deflection [Pa]; None if the wire is not known."""
        return None if self.wound is None else self.wound.stress(self.initial_tension + self.rate * deflection)


@lru_cache
def generic_series(spring_type: type[HelicalSpring]) -> tuple[Offer, ...]:
    """Return the generic series of one kind.

    Examples
    --------
    >>> from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring
    >>> generic_series(HelicalTorsionSpring)[0].name
    'generic-torsion-d0.4-D2.4-n3'
    """
    # 4.8, not 4.800000000000001, in what is written of a coil
    coils = [(wire, round(index * wire, 6)) for wire in GENERIC_WIRE_DIAMETERS for index in SPRING_INDICES]
    return tuple(
        _make_generic_offer(spring_type(wire * 1e-3, coil * 1e-3, float(turns)))
        for wire, coil in coils
        for turns in spring_type.series_turns
    )


def largest_load(wound: HelicalSpring, safety: float) -> Any:
    """Return the load that a spring of music wire may bear [N or N m]; of an array of coils, of each.

    That which the series allows, or where it is less that at which the spring yields over a safety factor.
    """
    return np.minimum(_allowed_stress(wound) / wound.stress(1.0), wound.yield_load() / safety)


def _allowed_stress(wound: HelicalSpring) -> float:
    """Return the stress that the series allows [Pa]."""
    return SERIES_SHARES[wound.wire_stress] * tensile_strength(wound.wire)


def _make_generic_offer(wound: HelicalSpring) -> Offer:
    largest = wound.deflection_at(_allowed_stress(wound))
    offer = Offer(
        f"generic-{wound.kind}-d{wound.wire * 1e3:g}-D{wound.coil * 1e3:g}-n{wound.turns:g}",
        type(wound),
        wound.rate,
        largest,
        wound.free_length_for(largest),
        wound.body_length,
        outer_diameter=wound.outer_diameter,
        wound=wound,
        counts=SPRING_COUNTS,
    )
    # a rod in the spring is part of the offer where the whole of its deflection needs one
    return offer if offer.unguided >= largest else replace(offer, guide_rod=guide_rod_for(wound))


def guide_rod_for(wound: HelicalSpring) -> float:
    """Return the diameter of a rod that guides a compression spring, in whole hundredths of a mm [m]."""
    return math.floor(1e5 * wound.thickest_guide_rod * (1 + 1e-9)) / 1e5


@dataclass(frozen=True)
class Miss:
    """A choice that was refused: what it is, by how much it misses (0: only just), and why, in words."""

    label: str
    share: float
    reason: str


def describe_nearest(misses: Sequence[Miss]) -> str:
    """Return the choices that miss least, and what, in one line."""
    best = sorted(misses, key=lambda miss: miss.share)[:3]
    left = len(misses) - len(best)
    reported = "; ".join(f"{miss.label}: {miss.reason}" for miss in best)
    more = "1 other misses by more" if left == 1 else f"{left} others miss by more"
    return f"{reported}; {more}" if left else reported


MIN_INDEX, MAX_INDEX = 5.0, 16.0  # mean diameter of the coil over that of the wire: what is wound easily
N_INDICES = 12  # indices that are compared for the largest rate
MIN_WIRE_DIAMETER = 0.2e-3  # wire that springs are usually wound of [m]
METRIC_WIRE_DIAMETERS = tuple(
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


def slimmest_spring(
    spring_type: type[HelicalSpring],  # its kind
    rate: float,  # [N/m or N m/rad]
    deflection: float,  # how far it can be stretched or turned [m or rad]
    room: float,  # length that it may have, relaxed with loops if it is stretched, or wound up [m]
    safety: float = 1.0,  # against yield
    pin: float = 0.0,  # diameter of a pin that fits into it, deflected as it is [m]
) -> HelicalSpring | None:
    """Return the slimmest spring of a rate that can be deflected so far; None if there is none.

    Its rate is off by what the turns are rounded by.

    Examples
    --------
    >>> from cfmkit.stock.springs import ExtensionSpring, HelicalTorsionSpring
    >>> spring = slimmest_spring(ExtensionSpring, 690.0, 0.132, 0.136)
    >>> round(spring.rate, 1), round(1e3 * spring.wire, 2), round(1e3 * spring.outer_diameter, 1), spring.turns
    (690.0, 1.6, 12.7, 71.72)
    >>> spring = slimmest_spring(HelicalTorsionSpring, 0.05, 1.0, 0.05)
    >>> round(spring.rate, 4), round(1e3 * spring.wire, 2), round(1e3 * spring.outer_diameter, 1), spring.turns
    (0.05, 0.8, 4.8, 6.59)
    >>> slimmest_spring(HelicalTorsionSpring, 0.05, 1.0, 0.002) is None
    True
    """
    springs = _springs(spring_type, rate, deflection, room, safety, pin)
    return min(springs, key=lambda spring: spring.outer_diameter, default=None)


def shortest_spring(
    spring_type: type[HelicalSpring],  # its kind
    rate: float,  # [N/m or N m/rad]
    deflection: float,  # how far it can be stretched or turned [m or rad]
    widest: float,  # outer diameter that it may have [m]
    safety: float = 1.0,  # against yield
    pin: float = 0.0,  # diameter of a pin that fits into it, deflected as it is [m]
) -> HelicalSpring | None:
    """Return the shortest spring of a rate that can be deflected so far; None if there is none."""
    springs = _springs(spring_type, rate, deflection, np.inf, safety, pin, widest)
    return min(springs, key=lambda spring: spring.body_length, default=None)


def as_stated(spring: HelicalSpring) -> dict[str, Any]:
    """Return designation and wire of a spring as a specification has them."""
    wire, coil = (format_short(size, "length") for size in (spring.wire, spring.coil))
    return {
        "name": f"custom, wire {wire}, coil {coil}, {spring.turns:.3g} turns",
        "wound": {"wire": spring.wire, "coil": spring.coil, "turns": spring.turns},
    }


def stiffest_rates(
    spring_type: type[HelicalSpring],  # kind of the springs
    deflection: FloatArray,  # (n,): how far they are stretched or turned
    # widest, room: float or (n,): largest outer diameter, and length with the loops of one that is stretched [m]
    widest: float | FloatArray,
    room: float | FloatArray,
    safety: float = 1.0,  # against yield
) -> FloatArray:
    """Return the largest rates of springs that can be stretched [m], or turned [rad], so far and fit: zero for none.

    Examples
    --------
    >>> from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring
    >>> (rate,) = stiffest_rates(HelicalTorsionSpring, np.array([1.0]), 5e-3, 30e-3)
    >>> bool(slimmest_spring(HelicalTorsionSpring, 0.98 * rate, 1.0, 30e-3).outer_diameter <= 5e-3)
    True
    """
    deflection, widest, room = (np.asarray(values, dtype=float) for values in (deflection, widest, room))
    windings = np.array(_windings(spring_type, safety))
    slim = windings[:, windings[0] + windings[1] <= widest.max(initial=0.0)]
    wire, coil, one_turn, load = (values[:, None] for values in slim)
    rate = np.minimum(load / np.maximum(deflection, 1e-12), one_turn / MIN_TURNS)
    long = spring_type(wire, coil, one_turn / rate).room_for(deflection)
    return np.asarray(np.where((long <= room) & (coil + wire <= widest), rate, 0.0).max(axis=0, initial=0.0))


@lru_cache(maxsize=8)
def _windings(spring_type: type[HelicalSpring], safety: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return wire and coil of all sizes and indices [m], their rate with one turn and their largest load, (n,) each."""
    indices = np.linspace(MIN_INDEX, MAX_INDEX, N_INDICES)
    springs: list[Any] = [spring_type(wire, cast("Any", wire * indices), 1.0) for wire in METRIC_WIRE_DIAMETERS]
    rows = [
        (0.0 * spring.coil + spring.wire, spring.coil, spring.rate, largest_load(spring, safety)) for spring in springs
    ]
    wire, coil, rate, load = np.concatenate(rows, axis=1)
    return wire, coil, rate, load


def _springs(
    spring_type: type[HelicalSpring],
    rate: float,
    deflection: float,
    room: float,
    safety: float,
    pin: float = 0.0,
    widest: float = np.inf,
) -> Iterator[HelicalSpring]:
    """Yield of each wire on offer the slimmest spring that fits; if only its width is limited, the widest.

    A pin [m] has to fit into a spring that is deflected.
    """
    slimmest = np.inf
    for wire in METRIC_WIRE_DIAMETERS:
        if wire * (MIN_INDEX + 1.0) >= min(slimmest, widest):  # no coil of this or of thicker wire is slimmer
            return
        coil, one_turn, most = _coils_of(spring_type, wire, safety)
        turns = np.maximum(np.round(one_turn / rate * STEPS_PER_TURN), 1.0) / STEPS_PER_TURN
        springs: Any = spring_type(wire, cast("Any", coil), cast("Any", turns))
        fits = (turns >= MIN_TURNS) & (one_turn / turns * deflection <= most) & (coil + wire <= widest)
        fits &= springs.room_for(deflection) <= room
        fits &= PIN_SHARE * springs.inner_diameter_at(deflection) >= pin if pin else True
        places = np.flatnonzero(fits)
        if len(places):
            place = places[0 if np.isfinite(room) else -1]
            spring = spring_type(wire, float(coil[place]), float(turns[place]))
            slimmest = spring.outer_diameter if np.isfinite(room) else np.inf
            yield spring


@lru_cache(maxsize=512)
def _coils_of(
    spring_type: type[HelicalSpring], wire: float, safety: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the coils of a wire [m], the rate that each has with one turn and the load that it bears, (n,) each."""
    coil = _coil_diameters(wire)
    spring: Any = spring_type(wire, cast("Any", coil), 1.0)
    return coil, spring.rate, largest_load(spring, safety)


def _coil_diameters(wire: float) -> FloatArray:
    """Return the mean diameters in which a wire [m] is wound [m], increasing."""
    low, high = MIN_INDEX * wire, MAX_INDEX * wire
    small = np.arange(np.ceil(low / COIL_STEP - 1e-6), min(high, LARGE_COIL) / COIL_STEP + 1e-6) * COIL_STEP
    start = max(low, LARGE_COIL + COIL_STEP_OF_LARGE)
    large = np.arange(np.ceil(start / COIL_STEP_OF_LARGE - 1e-6), high / COIL_STEP_OF_LARGE + 1e-6) * COIL_STEP_OF_LARGE
    return np.round(np.concatenate([small, large]), 8)

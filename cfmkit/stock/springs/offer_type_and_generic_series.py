"""Springs on offer: those of a list, or the generic series; and which of them come nearest where none fits.

The generic series is no maker's list: it is computed (`cfmkit.stock.springs.helical_spring_formulas`) from preferred
numbers of wire diameters, spring indices and turns. It says what can be had; the spring itself is then bought by its
dimensions.
Its limits are assumed: extension and compression springs up to 38 % of the tensile strength of music wire in shear,
torsion springs up to 60 % in bending, both below what the wire holds under a load at rest, because the springs of a
constant-force mechanism move. Extension springs are taken as wound without initial tension, with full loops at both
ends. Compression springs stand with closed ends on flat plates; those that would buckle before their largest deflection
come with the rod that guides them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.stock.springs.helical_spring_formulas import (
    HelicalSpring,
    Kind,
    Seats,
    buckling_deflection,
    tensile_strength,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.metrics.fatigue_and_relaxation import FatigueLaw

GENERIC_SERIES = "generic"  # the word for the series that ships with the package
WIRE_DIAMETERS = (0.4, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0)
SPRING_INDICES = (6.0, 8.0, 10.0, 12.5)
COIL_COUNTS = (6, 8, 10, 12, 16, 20, 25, 32, 40, 50, 63, 80, 100, 125, 160)
TORSION_TURNS = (3, 4, 5, 6, 8, 10, 12)
SPRING_COUNTS = (1, 2, 4)  # the generic series: wires [mm] and numbers of turns are preferred numbers (ISO 3, R10)
SHEAR_SHARE, BENDING_SHARE = 0.38, 0.60
"""Shares of the tensile strength that the generic series allows: assumed. At 38 % in the turns the loops of an
extension spring bear up to 74 % in bending; Shigley, Table 10-7, allows 75 % there."""
SOLID_RESERVE = 1.15
"""A compression spring of the series touches its turns at so many times its largest deflection: assumed."""


@dataclass(frozen=True)
class Offer:
    """A spring on offer; SI, deflections are angles and loads couples where it is a torsion spring."""

    name: str  # by which it is bought
    kind: Kind  # what it is loaded by
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
        return unguided_deflection(self.kind, self.free_length, self.wound, self.outer_diameter, self.seats)

    def stress(self, deflection: float) -> float | None:
        """Return the stress in the wire at a deflection [Pa]; None if the wire is not known."""
        return None if self.wound is None else self.wound.stress(self.initial_tension + self.rate * deflection)


@lru_cache(maxsize=3)
def generic(kind: Kind) -> tuple[Offer, ...]:
    """Return the generic series of one kind.

    Examples
    --------
    >>> generic("torsion")[0].name
    'generic-torsion-d0.4-D2.4-n3'
    """
    series = []
    for wire in WIRE_DIAMETERS:
        for index in SPRING_INDICES:
            for turns in TORSION_TURNS if kind == "torsion" else COIL_COUNTS:
                coil = round(index * wire, 6)  # 4.8, not 4.800000000000001, in what is written of it
                series.append(_generic(HelicalSpring(kind, wire * 1e-3, coil * 1e-3, float(turns))))
    return tuple(series)


def largest_load(wound: HelicalSpring, safety: float) -> Any:
    """Return the load that a spring of music wire may bear [N or N m]; of an array of coils, of each.

    That which the series allows, or where it is less that at which the spring yields over a safety factor.
    """
    return np.minimum(_allowed_stress(wound) / wound.stress(1.0), wound.yield_load() / safety)


def _allowed_stress(wound: HelicalSpring) -> float:
    """Return the stress that the series allows [Pa]."""
    return (BENDING_SHARE if wound.kind == "torsion" else SHEAR_SHARE) * tensile_strength(wound.wire)


def _generic(wound: HelicalSpring) -> Offer:
    largest = wound.deflection_at(_allowed_stress(wound))
    free_length = {
        "extension": wound.body_length + 2.0 * (wound.coil - wound.wire),
        "compression": wound.body_length + SOLID_RESERVE * largest,
        "torsion": wound.body_length,
    }[wound.kind]
    name = f"generic-{wound.kind}-d{wound.wire * 1e3:g}-D{wound.coil * 1e3:g}-n{wound.turns:g}"
    offer = Offer(
        name,
        wound.kind,
        wound.rate,
        largest,
        free_length,
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


def unguided_deflection(
    kind: Kind, free_length: float | None, wound: HelicalSpring | None, outer_diameter: float | None, seats: Seats
) -> float:
    """Return the deflection [m] up to which a spring does not buckle; infinite if never, or if that is not known.

    A compression spring whose wire is not known is judged as one of music wire with its outer diameter for the mean
    one: it buckles no later than that.
    """
    if kind != "compression" or free_length is None:
        return math.inf
    if wound is not None:
        return wound.buckling_deflection(free_length, seats)
    return math.inf if outer_diameter is None else buckling_deflection(free_length, outer_diameter, seats)


@dataclass(frozen=True)
class Miss:
    """A choice that was refused: what it is, by how much it misses (0: only just), and why, in words."""

    label: str
    share: float
    reason: str


def nearest(misses: Sequence[Miss], count: int = 3) -> str:
    """Return the choices that miss least, and what, in one line."""
    best = sorted(misses, key=lambda miss: miss.share)[:count]
    left = len(misses) - len(best)
    reported = "; ".join(f"{miss.label}: {miss.reason}" for miss in best)
    more = "1 other misses by more" if left == 1 else f"{left} others miss by more"
    return f"{reported}; {more}" if left else reported

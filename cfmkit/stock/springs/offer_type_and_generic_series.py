"""What springs are on offer: those of a list, or the generic series; and which of them come nearest where none fits.

The generic series is no maker's list: it is computed (`cfmkit.stock.springs.helical_spring_formulas`) from preferred
numbers of wire diameters, spring indices and turns. It says what can be had; the spring itself is then bought by its
dimensions.
Its limits are assumed: extension and compression springs up to 40 % of the tensile strength of music wire in shear,
torsion springs up to 60 % in bending, both below what the wire holds under a load at rest, because the springs of a
constant-force mechanism move. Extension springs are taken as wound without initial tension, with full loops at both
ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from cfmkit.stock.springs.helical_spring_formulas import Kind, Wound, tensile_strength

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.metrics.fatigue_and_relaxation import FatigueLaw

GENERIC = "generic"
"""The word for the series that ships with the package."""

WIRES = (0.4, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0)
INDICES = (6.0, 8.0, 10.0, 12.5)
COILS = (6, 8, 10, 12, 16, 20, 25, 32, 40, 50, 63, 80, 100, 125, 160)
TORSION_TURNS = (3, 4, 5, 6, 8, 10, 12)
COUNTS = (1, 2, 4)
"""The generic series: wires [mm] and numbers of turns are preferred numbers (ISO 3, R10)."""

SHEAR_SHARE, BENDING_SHARE = 0.40, 0.60
"""Shares of the tensile strength that the generic series allows: assumed."""

SOLID_RESERVE = 1.15
"""A compression spring of the series touches its turns at so many times its largest deflection: assumed."""


@dataclass(frozen=True)
class Offer:
    """A spring on offer; SI, deflections are angles and loads couples where it is a torsion spring.

    Attributes
    ----------
    name : str
        By which it is bought.
    kind : {"extension", "compression", "torsion"}
        What it is loaded by.
    rate : float
        [N/m or N m/rad].
    largest : float or None
        Largest deflection from the relaxed state [m or rad]; None: not stated.
    free_length, body_length : float or None
        Relaxed length between the hooks, or over the ends; length of the coil [m].
    initial_tension : float
        Load at which it begins to open [N or N m].
    outer_diameter : float or None
        Of the coil [m].
    wound : Wound or None
        Its wire, coil and turns, where they are known.
    counts : tuple of int
        Numbers in parallel to try.
    max_stress : float or None
        Largest stress allowed in the wire [Pa]; None: not stated.
    fatigue : FatigueLaw or None
        Of the wire.
    life : float or None
        Cycles that its maker states.
    """

    name: str
    kind: Kind
    rate: float
    largest: float | None = None
    free_length: float | None = None
    body_length: float | None = None
    initial_tension: float = 0.0
    outer_diameter: float | None = None
    wound: Wound | None = None
    counts: tuple[int, ...] = (1,)
    max_stress: float | None = None
    fatigue: FatigueLaw | None = None
    life: float | None = None

    def stress(self, deflection: float) -> float | None:
        """Return the stress in the wire at a deflection [Pa]; None where the wire is not known."""
        return None if self.wound is None else self.wound.stress(self.initial_tension + self.rate * deflection)


@lru_cache(maxsize=3)
def generic(kind: Kind) -> tuple[Offer, ...]:
    """Return the generic series of one kind.

    Examples
    --------
    >>> generic("torsion")[0].name
    'generic-torsion-d0.4-D2.4-n3'
    """
    found = []
    for wire in WIRES:
        for index in INDICES:
            for turns in TORSION_TURNS if kind == "torsion" else COILS:
                coil = round(index * wire, 6)  # 4.8, not 4.800000000000001, in what is written of it
                found.append(_generic(Wound(kind, wire * 1e-3, coil * 1e-3, float(turns))))
    return tuple(found)


def _generic(wound: Wound) -> Offer:
    share = BENDING_SHARE if wound.kind == "torsion" else SHEAR_SHARE
    largest = wound.deflection_at(share * tensile_strength(wound.wire))
    lengths = {
        "extension": wound.body_length + 2.0 * (wound.coil - wound.wire),
        "compression": wound.body_length + SOLID_RESERVE * largest,
        "torsion": wound.body_length,
    }
    name = f"generic-{wound.kind}-d{wound.wire * 1e3:g}-D{wound.coil * 1e3:g}-n{wound.turns:g}"
    return Offer(
        name,
        wound.kind,
        wound.rate,
        largest,
        lengths[wound.kind],
        wound.body_length,
        0.0,
        wound.outer_diameter,
        wound,
        COUNTS,
    )


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

"""Load of a bought spring in its mechanism: the stress in its wire, and its life.

The life follows from the S-N data of the wire where they are given, between the smallest and the largest load of the
travel [W, ch. 4: stress with the factor of curvature]; else it is what the maker states. Nothing is assumed.

Reference
---------
[W] A. M. Wahl, Mechanical Springs, 2nd ed., McGraw-Hill (1963).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.metrics.branches import Undefined
from cfmkit.results import Quantity
from cfmkit.stock.springs.wire_materials import WireOutOfRange

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.metrics.fatigue_and_relaxation import FatigueLaw
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring
    from cfmkit.stock.springs.offers import Offer

WIRE_DEFINITIONS = {
    "wire_stress_max": (
        "stress",
        "largest stress in the turns of a bought spring over the travel, with Wahl's curvature factor: shear, or "
        "bending in a torsion spring; loops of extension springs: 'loop_stress_max'",
    ),
    "loop_stress_max": (
        "stress",
        "largest bending stress in the loops of bought extension springs over the travel: full loops as wide as the "
        "coil (Shigley, eq. 10-34), which springs with a stated 'wound' are assumed to have",
    ),
    "spring_safety_factor": (
        "factor",
        "load at which a bought spring yields over its largest load over the travel: Shigley's shares of the tensile "
        "strength (music wire: 45 % in shear, 78 % in bending of torsion springs, 75 % in loops)",
    ),
    "spring_life": (
        "count",
        "life of the turns of a bought spring in cycles of the whole travel: from the S-N data of its wire and "
        "Goodman's line, "
        "or as its manufacturer states",
    ),
}


@dataclass(frozen=True)
class SpringInUse:
    """A spring between two loads."""

    wound: HelicalSpring | None  # its wire, coil and turns; None if they are not known
    # least, largest: load of one spring, over the travel [N or N m], in the sense of the larger one: the least is
    # negative where the load reverses
    least: float
    largest: float
    fatigue: FatigueLaw | None = None  # of the wire
    stated_life: float | None = None  # cycles that its maker states

    @classmethod
    def from_offer(cls, offer: Offer, least: float, largest: float) -> SpringInUse:
        """Return a spring on offer between two deflections [m or rad]."""
        low, high = (offer.initial_tension + offer.rate * deflection for deflection in (least, largest))
        return cls(offer.wound, low, high, offer.fatigue, offer.life)

    @property
    def safety_factor(self) -> float | None:
        """Load at which it yields over its largest load; None if that of its wire is not published."""
        if self.wound is None or self.largest <= 0.0:
            return None
        try:
            return float(self.wound.yield_load() / self.largest)
        except WireOutOfRange:
            return None

    def why_too_weak(self, life: float | None, safety: float | None) -> tuple[float, str] | None:
        """Return by what share the spring misses a life in cycles or a safety factor, and why; None if it has both."""
        factor = self.safety_factor
        if safety is not None and factor is None:
            return 1.0, "its strength is not known: give 'wire', 'coil', 'turns' and a 'material' with a strength"
        if safety is not None and factor is not None and factor < safety * (1 - 1e-9):
            return safety / factor - 1.0, f"its safety factor is {factor:.3g} of {safety:.3g}"
        return None if life is None else self._misses_life(life)

    def _misses_life(self, wanted: float) -> tuple[float, str] | None:
        """Return by what share of it the spring misses a life in cycles, and why; None if it lasts."""
        try:
            life = self.life()
        except Undefined as error:
            return 1.0, str(error)
        if life is None:
            return 1.0, "its life is not known: give its 'life', or 'fatigue' of its wire"
        return (
            None if life >= wanted * (1 - 1e-9) else (1.0 - life / wanted, f"lasts {life:.3g} of {wanted:.3g} cycles")
        )

    @property
    def stress(self) -> float | None:
        """Largest stress in the turns [Pa]."""
        return None if self.wound is None else self.wound.stress(self.largest)

    @property
    def loop_stress(self) -> float | None:
        """Largest bending stress in the loops at its ends [Pa]; None if it has none."""
        return None if self.wound is None else self.wound.loop_stress(self.largest)

    def life(self) -> float | None:
        """Return the cycles that it lasts; None if nothing is known of it.

        Raises Undefined if the S-N data have no number for these stresses.
        """
        if self.wound is None or self.fatigue is None:
            return self.stated_life
        return self.fatigue.life(self.wound.stress(self.largest), self.wound.stress(self.least))


def orient_to_larger(high: float, low: float) -> tuple[float, float]:
    """Return the least and the largest of what a spring goes through between two ends, the larger of these positive."""
    return (low, high) if abs(high) >= abs(low) else (-high, -low)


def wire_quantities(springs: Sequence[SpringInUse]) -> dict[str, Quantity]:
    """Return the largest stresses and the shortest life of some springs by name, as far as they are known."""
    quantities: dict[str, Quantity] = {}
    for name, values in (
        ("wire_stress_max", [spring.stress for spring in springs]),
        ("loop_stress_max", [spring.loop_stress for spring in springs]),
    ):
        if stresses := [stress for stress in values if stress is not None]:
            quantities[name] = Quantity(max(stresses), *WIRE_DEFINITIONS[name])
    if factors := [factor for factor in (spring.safety_factor for spring in springs) if factor is not None]:
        quantities["spring_safety_factor"] = Quantity(min(factors), *WIRE_DEFINITIONS["spring_safety_factor"])
    try:
        lives = [life for life in (spring.life() for spring in springs) if life is not None]
    except Undefined as error:
        return quantities | {"spring_life": Quantity(None, *WIRE_DEFINITIONS["spring_life"], reason=str(error))}
    if lives:
        quantities["spring_life"] = Quantity(min(lives), *WIRE_DEFINITIONS["spring_life"])
    return quantities

"""Seats and guide of a compression spring: their keys, and words about what keeps it from buckling.

That is a rod inside of it, or a tube around it.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from cfmkit.specs.spec import Model
from cfmkit.specs.units import Length, format_short
from cfmkit.stock.springs.helical_spring_formulas import Seats
from cfmkit.stock.springs.kinds import HELICAL_KINDS, list_kinds
from cfmkit.stock.springs.offers import guide_rod_for
from cfmkit.stock.springs.stress_and_life import SpringInUse

if TYPE_CHECKING:
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring


Positive = Field(gt=0)


class SpringSupport(Model):
    """Seats and guide of a compression spring, which keep it from buckling."""

    seats: Seats = Field(
        "fixed-fixed",
        description="how the ends of a compression spring are held: fixed is flat on a plate, against buckling",
    )
    guide_rod: Annotated[Length, Positive] | None = Field(
        None,
        description="diameter of the rod in a compression spring: guided, it does not buckle; at least 80 % of its "
        "inner diameter",
    )
    guide_tube: Annotated[Length, Positive] | None = Field(
        None, description="or inner diameter of the tube around it, at most 120 % of its outer diameter"
    )

    def guides(self, wound: HelicalSpring | None) -> bool:
        """Return whether a rod or a tube keeps a spring from buckling; where its wire is not known, any that is stated.

        A guide with more clearance than `LOOSEST` is none.
        """
        rod, tube = self.guide_rod, self.guide_tube
        if wound is None:
            return rod is not None or tube is not None
        fits = 1.0 - 1e-9
        on_rod = rod is not None and rod >= wound.thinnest_guide_rod * fits
        return on_rod or (tube is not None and tube * fits <= wound.widest_guide_tube)

    def check_guide(self, spring_type: type[HelicalSpring], wound: HelicalSpring | None, outer: float | None) -> None:
        """Raise `ValueError` for a guide that does not fit, or for one of a spring that does not buckle."""
        stated = ["seats"] if self.seats != "fixed-fixed" else []
        stated += [key for key in ("guide_rod", "guide_tube") if getattr(self, key) is not None]
        if stated and not spring_type.needs_guide:
            buckling = list_kinds(kind for kind in HELICAL_KINDS.values() if kind.needs_guide)
            raise ValueError(
                f"{stated[0]!r} is for {buckling} springs, which buckle; this is of kind {spring_type.kind!r}"
            )
        inside = wound.inner_diameter if wound is not None else outer
        if self.guide_rod is not None and inside is not None and self.guide_rod >= inside:
            inner = format_short(inside, "length")
            raise ValueError(f"'guide_rod' must be thinner than the inside of the spring, which is below {inner}")
        around = wound.outer_diameter if outer is None and wound is not None else outer
        if self.guide_tube is not None and around is not None and self.guide_tube <= around:
            reported = format_short(around, "length")
            raise ValueError(f"'guide_tube' must be wider than the spring, which is {reported} outside")


class BuiltInSpring(SpringSupport):
    """Wire and support of springs that are built in, of any kind."""

    @property
    @abstractmethod
    def spring_type(self) -> type[HelicalSpring]:
        """Kind of the springs."""

    @property
    def coil(self: Any) -> HelicalSpring | None:
        """Wire, coil and turns of one; None if they are not stated."""
        return None if self.wound is None else self.wound.to_wound(self.spring_type)

    @property
    def is_guided(self) -> bool:
        """True if a rod or a tube keeps it from buckling."""
        return self.guides(self.coil)

    @property
    def unguided(self: Any) -> float:
        """Deflection up to which it does not buckle without a guide [m]; infinite if it never does."""
        outer = getattr(self, "outer_diameter", None)
        return float(self.spring_type.unguided_deflection(self.free_length, self.coil, outer, self.seats))

    def put_under(self: Any, least: float, largest: float) -> SpringInUse:
        """Return one between two loads [N or N m]."""
        fatigue = None if self.wound is None or self.wound.fatigue is None else self.wound.fatigue.law
        return SpringInUse(self.coil, least, largest, fatigue, self.life)


def guide_words(support: SpringSupport) -> list[str]:
    """Return what a parts list says of the guide of a spring; empty if it has none."""
    words = []
    if support.guide_rod is not None:
        words.append(f"guided on a rod of {format_short(support.guide_rod, 'length')}")
    if support.guide_tube is not None:
        words.append(f"guided in a tube of {format_short(support.guide_tube, 'length')}")
    return words


def guide_needed(support: SpringSupport, wound: HelicalSpring | None, key: str) -> str:
    """Return the remedy for a spring that buckles, in words; `key` is the path of its block."""
    if wound is None:
        return f"guide it on a rod ('{key}.guide_rod') or in a tube, or use a shorter or wider one"
    rod, least, most = (
        format_short(value, "length")
        for value in (guide_rod_for(wound), wound.thinnest_guide_rod, wound.widest_guide_tube)
    )
    loose = f"the guide stated is too loose (a rod from {least}, a tube up to {most}); " if guide_words(support) else ""
    return f"{loose}guide it on a rod of {rod} ('{key}.guide_rod') or in a tube, or use a shorter or wider one"


def guide_cure(wound: HelicalSpring | None, key: str) -> tuple[str, ...]:
    """Return the setting that guides a spring; none if its wire is not known."""
    return () if wound is None else (f"{key}.guide_rod={1e3 * guide_rod_for(wound):.10g} mm",)

"""Words about what keeps a compression spring from buckling: a rod inside of it, or a tube around it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.specs.units import format_short
from cfmkit.stock.springs.offer_type_and_generic_series import guide_rod_for

if TYPE_CHECKING:
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring
    from cfmkit.stock.springs.support_spec import SpringSupport


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

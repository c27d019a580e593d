"""The kinds of helical springs, in the order of the documentation: a new one is its file, and its line here."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.stock.springs.compression_springs import CompressionSpring
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring

HELICAL_KINDS: dict[str, type[HelicalSpring]] = {
    spring_type.kind: spring_type for spring_type in (ExtensionSpring, CompressionSpring, HelicalTorsionSpring)
}
AXIAL_KINDS, TURNED_KINDS = (
    {name: spring_type for name, spring_type in HELICAL_KINDS.items() if spring_type.dimension == dimension}
    for dimension in ("length", "angle")
)
"""Those that are loaded along their axis, and those that are wound up."""
PRESSED_FIRST = tuple(sorted(AXIAL_KINDS.values(), key=lambda spring_type: spring_type.lengthening))
"""Those that are loaded along their axis, in the order in which a design between two parts tries them."""


def list_kinds(spring_types: Iterable[type[HelicalSpring]]) -> str:
    """Return the names of some kinds as a sentence lists them."""
    *others, last = (spring_type.kind for spring_type in spring_types)
    return f"{', '.join(others)} or {last}" if others else last

"""Quantities in sentences: rounded for reading, never for computing."""

from __future__ import annotations

from cfmkit.specs.units.table import border_unit, to_border


def format_short(value: float, dimension: str, digits: int = 4) -> str:
    """Return a value as a reader wants it in a sentence, rounded, in the border unit.

    Examples
    --------
    >>> format_short(0.010328365, "length")
    '10.33 mm'
    >>> format_short(0.05, "ratio")
    '5 %'
    """
    if dimension == "ratio":
        return f"{100 * value:.{digits}g} %"
    number = f"{float(to_border(value, dimension)):.{digits}g}"
    if "e+" in number:
        number = f"{float(number):.0f}"
    unit = border_unit(dimension)
    return number if unit in ("", "1") else f"{number} {unit}"

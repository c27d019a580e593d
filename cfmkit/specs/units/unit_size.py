"""From a unit's text to its exact size in SI.

The text is cut into known symbols here; only that clean product reaches pint,
whose registry holds our closed list and nothing else (its own default list reads
``5 MM`` as megamolar). pint is imported when the first unit is looked up.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from cfmkit.errors import QuantityError
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.specs.units.table import UNIT_TABLE, UNITS_BY_SYMBOL, dimension_of

_FACTOR_PATTERN = re.compile(r" *([*/]?) *([A-Za-z%]+|1) *(?:(?:\^|\*\*) *(-?[1-9])(?![0-9]))? *")
_MOST_FACTORS = 8
_BASE_UNITS = {"meter": "m", "kilogram": "kg", "second": "s", "radian": "rad"}


@dataclass(frozen=True)
class Size:
    """Unit in SI: its exact size, and the powers of m, kg, s and rad."""

    factor: Fraction
    powers: tuple[tuple[str, int], ...]


def is_unit(text: str) -> bool:
    """Return whether `text` is a product of known symbols with integer powers, such as ``N*mm/rad``."""
    return _factors(text) is not None


@lru_cache(maxsize=512)
def unit_size(text: str) -> Size:
    """Return the SI size of a unit.

    Raises QuantityError if it is not made of known symbols.
    """
    factors = _factors(text)
    if factors is None:
        raise QuantityError(f"{quote(text)} is not a unit")
    registry = _registry()
    product = registry.parse_units("*".join(f"{UNITS_BY_SYMBOL[symbol].name}**{power}" for symbol, power in factors))
    factor, base = registry.get_base_units(product)
    powers = sorted((_BASE_UNITS[name], int(power)) for name, power in dict(base._units).items())
    return Size(Fraction(factor), tuple(powers))


def border_size(dimension: str) -> Size:
    """Return the SI size of the border unit of `dimension`."""
    unit = dimension_of(dimension).unit
    return Size(Fraction(1), ()) if unit in ("1", "") else unit_size(unit)


def unit_table() -> list[tuple[str, str, str, float, bool]]:
    """Return every unit as (symbol, name, dimension, size in SI, accepted on input only)."""
    return [
        (
            unit.symbol,
            unit.name.replace("_", " "),
            unit.dimension,
            float(unit_size(unit.symbol).factor),
            unit.input_only,
        )
        for unit in UNIT_TABLE
    ]


@lru_cache(maxsize=512)
def _factors(text: str) -> tuple[tuple[str, int], ...] | None:
    """Return the (symbol, power) factors of a unit, or None if it is not one."""
    factors: list[tuple[str, int]] = []
    position = 0
    while position < len(text) and len(factors) < _MOST_FACTORS:
        match = _FACTOR_PATTERN.match(text, position)
        if not match or bool(match[1]) != (position > 0):
            return None
        symbol, power = match[2], int(match[3] or 1)
        if symbol == "1":
            if position > 0 or match[3] or match.end() == len(text):
                return None
        elif symbol in UNITS_BY_SYMBOL:
            factors.append((symbol, -power if match[1] == "/" else power))
        else:
            return None
        position = match.end()
    return tuple(factors) if factors and position == len(text) else None


@lru_cache(maxsize=1)
def _registry() -> Any:
    """Return the pint registry that knows our units, exactly, and nothing else."""
    import pint

    registry: Any = pint.UnitRegistry(None, non_int_type=Fraction, cache_folder=None)
    for unit in UNIT_TABLE:
        registry.define(f"{unit.name} = {unit.definition}")
    return registry

"""The closed tables of dimensions and units: the unit of each dimension in files, and the exact size of each in SI.

The tables are plain data and arithmetic on it: no import of pint, numpy or
pydantic, so that whoever only prints millimetres pays for nothing.

An angle is a dimension: N*mm (a torque) and N*mm/rad (a stiffness) differ.

For the exact size of a unit in SI its text is cut into known symbols; only that clean product reaches pint,
whose registry holds our closed list and nothing else (its own default list reads
``5 MM`` as megamolar). pint is imported when the first unit is looked up.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cfmkit.errors import QuantityError
from cfmkit.specs.units.strict_decimal_number import quote

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity and how it looks at the border.

    A value in the border unit is ``si * up / down``: two numbers, because a
    division by 1000 is exact where a multiplication by 0.001 is not.
    """

    name: str
    unit: str
    description: str
    example: str
    up: float = 1.0
    down: float = 1.0

    @property
    def phrase(self) -> str:
        """The name with its article: ``a length``, ``an angle``."""
        words = self.name.replace("_", " ")
        return f"{'an' if words[0] in 'aeiou' else 'a'} {words}"


_DEGREES_PER_RADIAN = 180 / math.pi
_DIMENSION_LIST = (
    Dimension("length", "mm", "length, displacement, elongation", "200 mm", up=1e3),
    Dimension("angle", "deg", "plane angle, rotation", "30 deg", up=_DEGREES_PER_RADIAN),
    Dimension("ratio", "1", "ratio, fraction, coefficient", "5 %"),
    Dimension("force", "N", "force", "50 N"),
    Dimension("torque", "N*mm", "moment of a force", "1200 N*mm", up=1e3),
    Dimension("energy", "N*mm", "energy, work, area of a force-displacement loop", "310 N*mm", up=1e3),
    Dimension("stiffness", "N/mm", "force per displacement", "0.69 N/mm", down=1e3),
    Dimension("rotational_stiffness", "N*mm/rad", "torque per angle", "500 N*mm/rad", up=1e3),
    Dimension("stress", "MPa", "stress, pressure, elastic modulus", "2100 MPa", down=1e6),
    Dimension("mass", "kg", "mass", "0.25 kg"),
    Dimension("inertia", "kg*mm^2", "mass moment of inertia", "12 kg*mm^2", up=1e6),
    Dimension("density", "kg/m^3", "mass per volume", "1240 kg/m^3"),
    Dimension("time", "s", "time, duration", "0.5 s"),
    Dimension("temperature", "K", "temperature above absolute zero", "296.15 K"),
    Dimension("velocity", "mm/s", "speed", "10 mm/s", up=1e3),
    Dimension("acceleration", "m/s^2", "acceleration", "9.80665 m/s^2"),
    Dimension("frequency", "Hz", "cycles per time", "2 Hz"),
    Dimension("line_load", "N/mm", "force per length of a line", "0.3 N/mm", down=1e3),
    Dimension("area", "mm^2", "area", "12 mm^2", up=1e6),
    Dimension("volume", "mm^3", "volume", "500 mm^3", up=1e9),
    Dimension("second_moment", "mm^4", "second moment of an area", "2.5 mm^4", up=1e12),
    Dimension("curvature", "1/mm", "inverse of a radius", "0.05 1/mm", down=1e3),
    Dimension("flexural_rigidity", "N*mm^2", "bending stiffness EI of a section", "800 N*mm^2", up=1e6),
    Dimension("angular_velocity", "deg/s", "angle per time", "90 deg/s", up=_DEGREES_PER_RADIAN),
    Dimension("angular_acceleration", "deg/s^2", "angular velocity per time", "90 deg/s^2", up=_DEGREES_PER_RADIAN),
    Dimension("damping", "N*s/mm", "force per velocity", "0.01 N*s/mm", down=1e3),
    Dimension("rotational_damping", "N*mm*s/rad", "torque per angular velocity", "2 N*mm*s/rad", up=1e3),
    Dimension("factor", "1", "multiple of a value", "1.5"),
    Dimension("count", "1", "number of items", "2"),
    Dimension("text", "", "a word, not a number", "load"),
)
DIMENSIONS_BY_NAME: Mapping[str, Dimension] = MappingProxyType({item.name: item for item in _DIMENSION_LIST})
"""Every dimension by name."""
_PI_DIGITS = "3.14159265358979323846264338327950288419716939937510582097494459230781640629"


def _exact(item: Dimension) -> Fraction:
    """Return the SI size of a border unit; that of a degree to the digits of pi above."""
    up = Fraction(180) / Fraction(_PI_DIGITS) if item.up == _DEGREES_PER_RADIAN else Fraction(item.up)
    return Fraction(item.down) / up


COMMON_UNIT_SIZES: Mapping[tuple[str, str], Fraction] = MappingProxyType(
    {(item.name, item.unit): _exact(item) for item in _DIMENSION_LIST if item.unit}
    | {("ratio", "%"): Fraction(1, 100), ("angle", "rad"): Fraction(1), ("stress", "GPa"): Fraction(10**9)}
)
"""Exact SI size of what nearly every file says, by (dimension, unit): these need no look into pint's registry."""
UNITLESS_DIMENSIONS = ("ratio", "factor", "count")  # dimensions whose numbers need no unit


@dataclass(frozen=True)
class Unit:
    """One unit symbol of the closed list.

    `definition` is its size in terms of other units, as pint reads it.
    """

    symbol: str
    name: str
    definition: str
    dimension: str
    input_only: bool = False
    aliases: tuple[str, ...] = ()


UNIT_TABLE = (
    Unit("m", "meter", "[length]", "length"),
    Unit("cm", "centimeter", "0.01 * meter", "length"),
    Unit("mm", "millimeter", "0.001 * meter", "length"),
    Unit("um", "micrometer", "0.000001 * meter", "length"),
    Unit("in", "inch", "0.0254 * meter", "length", input_only=True, aliases=("inch",)),
    Unit("ft", "foot", "0.3048 * meter", "length", input_only=True),
    Unit("rad", "radian", "[angle]", "angle"),
    Unit("mrad", "milliradian", "0.001 * radian", "angle"),
    Unit("deg", "degree", f"{_PI_DIGITS} / 180 * radian", "angle"),
    Unit("rev", "revolution", "360 * degree", "angle"),
    Unit("%", "percent", "0.01", "ratio", aliases=("percent",)),
    Unit("kg", "kilogram", "[mass]", "mass"),
    Unit("g", "gram", "0.001 * kilogram", "mass"),
    Unit("mg", "milligram", "0.000001 * kilogram", "mass"),
    Unit("lb", "pound", "0.45359237 * kilogram", "mass", input_only=True),
    Unit("s", "second", "[time]", "time"),
    Unit("ms", "millisecond", "0.001 * second", "time"),
    Unit("min", "minute", "60 * second", "time"),
    Unit("h", "hour", "3600 * second", "time"),
    Unit("K", "kelvin", "[temperature]", "temperature"),
    Unit("Hz", "hertz", "1 / second", "frequency"),
    Unit("kHz", "kilohertz", "1000 / second", "frequency"),
    Unit("rpm", "revolution_per_minute", "revolution / minute", "angular_velocity"),
    Unit("N", "newton", "kilogram * meter / second ** 2", "force"),
    Unit("mN", "millinewton", "0.001 * newton", "force"),
    Unit("kN", "kilonewton", "1000 * newton", "force"),
    Unit("uN", "micronewton", "0.000001 * newton", "force"),
    Unit("cN", "centinewton", "0.01 * newton", "force", input_only=True),
    Unit("daN", "decanewton", "10 * newton", "force", input_only=True),
    Unit("kgf", "kilogram_force", "9.80665 * newton", "force", input_only=True, aliases=("kp",)),
    Unit("gf", "gram_force", "0.001 * kilogram_force", "force", input_only=True),
    Unit("lbf", "pound_force", "4.4482216152605 * newton", "force", input_only=True),
    Unit("ozf", "ounce_force", "pound_force / 16", "force", input_only=True),
    Unit("J", "joule", "newton * meter", "energy"),
    Unit("mJ", "millijoule", "0.001 * joule", "energy"),
    Unit("Pa", "pascal", "newton / meter ** 2", "stress"),
    Unit("kPa", "kilopascal", "1000 * pascal", "stress"),
    Unit("MPa", "megapascal", "1000000 * pascal", "stress"),
    Unit("GPa", "gigapascal", "1000000000 * pascal", "stress"),
    Unit("psi", "pound_per_square_inch", "pound_force / inch ** 2", "stress", input_only=True),
    Unit("ksi", "kilopound_per_square_inch", "1000 * pound_per_square_inch", "stress", input_only=True),
)
"""The whole list; there are no prefixes beyond what it spells out."""
UNITS_BY_SYMBOL: Mapping[str, Unit] = MappingProxyType(
    {word: unit for unit in UNIT_TABLE for word in (unit.symbol, *unit.aliases)}
)
"""Every accepted spelling of a unit, case-sensitive."""


def dimension_of(name: str) -> Dimension:
    """Return the dimension called `name`.

    Raises KeyError if there is none; the message lists them.
    """
    try:
        return DIMENSIONS_BY_NAME[name]
    except KeyError:
        raise KeyError(f"there is no dimension {name!r}; there are {', '.join(DIMENSIONS_BY_NAME)}") from None


def border_unit(dimension: str) -> str:
    """Return the unit in which a dimension is written to files and screens: ``"mm"``."""
    return dimension_of(dimension).unit


def to_border(values: Any, dimension: str) -> Any:
    """Return SI values (a number or an array) in the border unit of `dimension`."""
    item = dimension_of(dimension)
    return values * item.up if item.down == 1.0 else values / item.down


def from_border(values: Any, dimension: str) -> Any:
    """Return values in the border unit of `dimension` as SI."""
    item = dimension_of(dimension)
    return values / item.up if item.down == 1.0 else values * item.down


_FACTOR_PATTERN = re.compile(r" *([*/]?) *([A-Za-z%]+|1) *(?:(?:\^|\*\*) *(-?[1-9])(?![0-9]))? *")
_MOST_FACTORS = 8
_BASE_UNITS = {"meter": "m", "kilogram": "kg", "second": "s", "radian": "rad", "kelvin": "K"}


@dataclass(frozen=True)
class Size:
    """Unit in SI: its exact size, and the powers of m, kg, s, rad and K."""

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

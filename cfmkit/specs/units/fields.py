"""Types of specification fields: SI floats read from text with units, windows by place or share, open bounds.

A field ``width: Length = Field(gt=0)`` takes text with a unit, or a Python number that is SI already (so do defaults);
inside it is a plain SI float. A number that comes from a file or an option is a `Bare` one and refused, unless it is
zero. Bounds are SI. ``model_dump()`` gives SI, ``model_dump(mode="json")`` text with units.

Windows are between places, or between shares of a travel, which they follow wherever it goes.
"""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Self

from cfmkit.errors import InputError, QuantityError
from cfmkit.specs.units.quantities import (
    check_quantity,
    decimal_text,
    describe_dimensions,
    example,
    format_quantity,
    meant_as_percent,
    read_one_of,
)
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.specs.units.table import DIMENSIONS_BY_NAME, UNITLESS_DIMENSIONS, dimension_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema


PLACE_DIMENSIONS = ("length", "angle")
MIN_QUANTITY, MAX_QUANTITY = 1e-30, 1e30
"""Sizes that a specification may give, in SI units: their squares and products are still numbers."""
MOST_TURNS = 10_000  # angles that a specification may give, in turns: arrays are made as long as a shape winds
_BOUND_OPERATORS: dict[str, tuple[str, Callable[[float, float], bool]]] = {
    "gt": (">", operator.gt),
    "ge": (">=", operator.ge),
    "lt": ("<", operator.lt),
    "le": ("<=", operator.le),
}


class BareInt(int):
    """A whole number of a file or an option, without a unit."""


class BareFloat(float):
    """A number of a file or an option, without a unit."""


Bare = BareInt | BareFloat


@dataclass(frozen=True)
class UnitField:
    """The annotation that makes a float field read, check and write units.

    `dimensions` holds one name, or several where the text decides.
    """

    dimensions: tuple[str, ...]

    def read(self, value: Any) -> tuple[float, str]:
        """Return (SI value, dimension) of text, or of a number that is SI already.

        Raises QuantityError with what is wrong and what to write instead.
        """
        number, dimension = self._read(value)
        if number and not MIN_QUANTITY <= abs(number) <= MAX_QUANTITY:
            reported = value.strip() if isinstance(value, str) else decimal_text(number)
            raise QuantityError(
                f"{reported} is outside the range of the computation: {MIN_QUANTITY:g} to {MAX_QUANTITY:g} in SI units"
            )
        if dimension == "angle" and abs(number) > MOST_TURNS * math.tau:
            reported = value.strip() if isinstance(value, str) else format_quantity(number, "angle")
            raise QuantityError(
                f"{reported} is outside the range of the computation: at most {MOST_TURNS} turns of 360 deg"
            )
        return number, dimension

    def _read(self, value: Any) -> tuple[float, str]:
        if isinstance(value, str):
            return read_one_of(value, self.dimensions)
        number = _finite(value, self.dimensions)
        if isinstance(value, Bare) and number != 0 and self.needs_unit:
            text = decimal_text(number)
            raise QuantityError(f"{text} has no unit; write {example(self.dimensions, text)}")
        return number, self.dimensions[0]

    def write(self, value: float) -> str | float:
        """Return text that `read` takes back; a ratio stays a number."""
        return format_quantity(value, self.dimensions[0]) if self.needs_unit else float(value)

    def check(self, value: float, bounds: Mapping[str, float], stated: Any = None) -> float:
        """Return `value` if it keeps its SI bounds: gt, ge, lt, le.

        Raises QuantityError with the value as it was given, and the bounds with units.
        """
        if all(_BOUND_OPERATORS[name][1](value, bound) for name, bound in bounds.items()):
            return value
        reported = stated.strip() if isinstance(stated, str) else self.format_value(value)
        raise QuantityError(f"{reported} is not allowed: must be {self.describe_allowed(bounds, reported)}")

    def describe_allowed(self, bounds: Mapping[str, float], stated: str) -> str:
        """Return bounds in words, with the percentage that was meant by a number above 1, if it keeps them."""
        meant = meant_as_percent(stated) if self.dimensions == ("ratio",) else ""
        share = read_one_of(meant, self.dimensions)[0] if meant else 0.0
        fits = meant and all(_BOUND_OPERATORS[name][1](share, bound) for name, bound in bounds.items())
        return f"{self.limits(bounds)}; did you mean {meant}?" if fits else self.limits(bounds)

    def limits(self, bounds: Mapping[str, float]) -> str:
        """Return bounds in words with units: ``> 0 and <= 500 mm``."""
        return " and ".join(f"{_BOUND_OPERATORS[name][0]} {self.format_value(bound)}" for name, bound in bounds.items())

    @property
    def needs_unit(self) -> bool:
        """Whether a number other than zero must carry a unit in a file."""
        return self.dimensions[0] not in UNITLESS_DIMENSIONS

    def format_value(self, value: float) -> str:
        """Return an SI value with its unit, for a message."""
        return format_quantity(value, self.dimensions[0]) if value else "0"

    def json_schema(self, bounds: Mapping[str, float]) -> dict[str, Any]:
        """Return the JSON schema of such a value."""
        items = [DIMENSIONS_BY_NAME[name] for name in self.dimensions]
        kind = "string" if self.needs_unit else ["number", "string"]
        about = {"x-dimension": " or ".join(item.name for item in items), "examples": [item.example for item in items]}
        return {"type": kind} | about | ({"x-allowed": self.limits(bounds)} if bounds else {})

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Build the validator and the serialiser around the schema of a plain float."""
        from pydantic_core import core_schema

        inner: Any = handler(source)
        bounds = {name: inner.pop(name) for name in _BOUND_OPERATORS if name in inner}

        def read(value: Any) -> float:
            return self.check(self.read(value)[0], bounds, value)

        def describe(_core: Any, _handler: Any) -> dict[str, Any]:
            return self.json_schema(bounds)

        return core_schema.no_info_before_validator_function(
            read,
            inner,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
            metadata={"pydantic_js_functions": [describe]},
        )


class DimensionedFloat(float):
    """An SI float that knows its dimension."""

    __slots__ = ("dimension",)
    dimension: str

    def __new__(cls, value: float, dimension: str) -> Self:
        """Return `value` as a number of that dimension."""
        number = super().__new__(cls, value)
        number.dimension = dimension
        return number

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what copying and pickling need."""
        return type(self), (float(self), self.dimension)

    def __repr__(self) -> str:
        """Return ``Place(0.002, 'length')``."""
        return f"{type(self).__name__}({float(self)!r}, {self.dimension!r})"


class Place(DimensionedFloat):
    """An SI float that knows whether it is a length [m] or an angle [rad]."""

    __slots__ = ()

    def __new__(cls, value: float, dimension: str = "length") -> Self:
        """Return `value` as a place of that dimension."""
        if dimension not in PLACE_DIMENSIONS:
            raise ValueError(f"a place is a length or an angle, not {dimension!r}")
        return super().__new__(cls, value, dimension)


@dataclass(frozen=True)
class DimensionedField(UnitField):
    """Text of one of several dimensions, which the number then knows; a plain number is of the first."""

    make: Callable[[float, str], DimensionedFloat] = DimensionedFloat

    def write(self, value: float) -> str:
        """Return text that `read` takes back."""
        return format_quantity(value, getattr(value, "dimension", self.dimensions[0]))

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> CoreSchema:
        """Build the validator and the serialiser."""

        def read(value: Any) -> DimensionedFloat:
            is_read = isinstance(value, DimensionedFloat) and value.dimension in self.dimensions
            return value if is_read else self.make(*self.read(value))

        return plain_schema(read, self.write)

    def __get_pydantic_json_schema__(self, _core: Any, _handler: Any) -> dict[str, Any]:
        """Describe the text that is expected."""
        return self.json_schema({})


@dataclass(frozen=True)
class _OpenQuantity:
    """Text whose dimension is known only later: a requirement's bound."""

    def read(self, value: Any) -> str:
        """Return tidy text; numbers become text."""
        return check_quantity(value) if isinstance(value, str) else decimal_text(_finite(value, ()))

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> CoreSchema:
        """Build the validator."""
        return plain_schema(self.read, _number_or_text)

    def __get_pydantic_json_schema__(self, _core: Any, _handler: Any) -> dict[str, Any]:
        """Describe the text that is expected."""
        return {"type": ["number", "string"], "examples": ["5 %", "140 mm", 0.05]}


def quantity(dimension: str) -> UnitField:
    """Return the annotation for a float of that dimension: ``Annotated[float, quantity("length")]``.

    Raises KeyError if there is no such dimension.
    """
    return UnitField((dimension_of(dimension).name,))


def plain_schema(read: Callable[[Any], Any], write: Callable[[Any], Any]) -> CoreSchema:
    """Return the schema of what is read and written by two functions."""
    from pydantic_core import core_schema

    written = core_schema.plain_serializer_function_ser_schema(write, when_used="json")
    return core_schema.no_info_plain_validator_function(read, serialization=written)


def _finite(value: Any, dimensions: tuple[str, ...]) -> float:
    """Return a Python or numpy number as a finite float; nothing else is one, least of all a bool."""
    if value is None:
        raise QuantityError(
            f"nothing is given here; {describe_dimensions(dimensions)} is needed, e.g. {example(dimensions)}"
        )
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise QuantityError(
            f"{describe_value(value)} is not {describe_dimensions(dimensions)}; write e.g. {example(dimensions)}"
        )
    try:
        number = float(value)
    except OverflowError:
        raise QuantityError("the number is too large: at most 1.8e308") from None
    if not math.isfinite(number):
        raise QuantityError(f"{number} is not a finite number")
    return number


def describe_value(value: Any) -> str:
    """Return a value in the words of a specification: ``'text'``, ``5``, ``true``, ``a list``, ``nothing``."""
    if value is None:
        return "nothing"
    if isinstance(value, str):
        return quote(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return quote(repr(value + 0)).strip("'")
    if isinstance(value, Mapping) or hasattr(type(value), "model_fields"):
        return "a block"
    return "a list" if isinstance(value, list | tuple) else f"a {type(value).__name__}"


def _number_or_text(text: str) -> str | float:
    """Return text that is a bare number as that number, for tidy files."""
    try:
        return float(text)
    except ValueError:
        return text


Length = Annotated[float, quantity("length")]
Angle = Annotated[float, quantity("angle")]
Ratio = Annotated[float, quantity("ratio")]
Factor = Annotated[float, quantity("factor")]
Force = Annotated[float, quantity("force")]
Torque = Annotated[float, quantity("torque")]
Stiffness = Annotated[float, quantity("stiffness")]
RotationalStiffness = Annotated[float, quantity("rotational_stiffness")]
Stress = Annotated[float, quantity("stress")]
Mass = Annotated[float, quantity("mass")]
Inertia = Annotated[float, quantity("inertia")]
Density = Annotated[float, quantity("density")]
Time = Annotated[float, quantity("time")]
LineLoad = Annotated[float, quantity("line_load")]
Displacement = Annotated[float, DimensionedField(PLACE_DIMENSIONS, Place)]
MetricValue = Annotated[str, _OpenQuantity()]


SHARE_DIMENSION = "ratio"  # dimension of an end of a window that is given as a share of the travel


class TravelShare(Place):
    """A part of the travel, from 0 at its start to 1 at its end; never equal to a place of the same number."""

    __slots__ = ()

    def __new__(cls, value: float) -> TravelShare:
        """Return `value` as a share."""
        return DimensionedFloat.__new__(cls, value, SHARE_DIMENSION)

    def __eq__(self, other: object) -> bool:
        """Return whether the other is the same share."""
        return isinstance(other, TravelShare) and float(self) == float(other)

    def __ne__(self, other: object) -> bool:
        """Return whether the other is anything else; that of floats would compare the numbers."""
        return not self == other

    def __hash__(self) -> int:
        """Distinguish a share from a place of the same number."""
        return hash((SHARE_DIMENSION, float(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what copying and pickling need."""
        return type(self), (float(self),)

    def __repr__(self) -> str:
        """Return ``TravelShare(0.01)``."""
        return f"TravelShare({float(self)!r})"


@dataclass(frozen=True)
class _WindowEnd(DimensionedField):
    """Text such as ``2 mm``, ``3 deg`` or ``100 %`` of the travel; a plain number is a length."""

    def read(self, value: Any) -> tuple[float, str]:
        number, dimension = super().read(value)
        if dimension == SHARE_DIMENSION and not 0 <= number <= 1:
            raise QuantityError(f"{str(value).strip()} is not allowed: shares of the travel are 0 % to 100 %")
        return number, dimension

    def write(self, value: float) -> str:
        return format_quantity(value, SHARE_DIMENSION, "%") if isinstance(value, TravelShare) else super().write(value)


def attach_dimension(value: float, dimension: str) -> DimensionedFloat:
    """Return a number that knows what it is: a length, an angle, with ``ratio`` a share of the travel, or a force."""
    if dimension == SHARE_DIMENSION:
        return TravelShare(value)
    return (Place if dimension in PLACE_DIMENSIONS else DimensionedFloat)(value, dimension)


_END_FIELD = _WindowEnd((*PLACE_DIMENSIONS, SHARE_DIMENSION), attach_dimension)
WindowEnd = Annotated[float, _END_FIELD]
Ends = tuple[WindowEnd, WindowEnd]


def ends_increase(ends: Ends) -> bool:
    """Return whether the ends are in order, as far as that needs no travel: 2 mm and 100 % may be in either."""
    kinds = {dimension_of_end(end) for end in ends}
    return len(kinds) > 1 or ends[0] < ends[1]


def dimension_of_end(end: float) -> str:
    """Return ``length``, ``angle`` or ``ratio``; a plain number is a length."""
    return str(getattr(end, "dimension", PLACE_DIMENSIONS[0]))


def window_places(
    ends: Ends,  # places, or shares of the travel
    travel: tuple[float, float],  # where the motion starts and where it ends, in this order [m or rad]
) -> tuple[float, float]:
    """Return a window as places, increasing [m or rad].

    Raises InputError if nothing is left between the ends.

    Examples
    --------
    >>> window_places((TravelShare(0.25), TravelShare(1.0)), (0.0, 0.2))
    (0.05, 0.2)
    >>> window_places((0.002, TravelShare(1.0)), (0.0, -0.2))
    (-0.2, 0.002)
    """
    start, stop = travel
    places = [start + float(end) * (stop - start) if isinstance(end, TravelShare) else float(end) for end in ends]
    if places[0] == places[1]:
        reported = " and ".join(_END_FIELD.write(end) for end in ends)
        raise InputError(f"a window from {reported} has no width on this travel")
    return min(places), max(places)

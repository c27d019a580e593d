"""Windows of the motion: between places, or between shares of a travel, which they follow wherever it goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from cfmkit.errors import InputError, QuantityError
from cfmkit.specs.units.fields import PLACE_DIMENSIONS, DimensionedField, DimensionedFloat, Place
from cfmkit.specs.units.quantities import format_quantity

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

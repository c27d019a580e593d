"""Moving the decimal point of floats, metres to millimetres without 4.1000000000000005; even grids of decimals.

``0.0041 * 1000`` is not the float nearest to 4.1, because 0.0041 is itself rounded and the product is rounded once
more. What a reader means by 0.0041 is the decimal, so the decimal is what gets shifted:

- a float that is the nearest one to a decimal of at most 15 significant digits
  (every such decimal has a float of its own) becomes the float nearest to that
  decimal, shifted. Shifting back gives the first float again, bit by bit.
- any other float (a computed value that fills all its digits) becomes the
  nearest float to the exact product with the power of ten.

Nothing is ever rounded to fewer digits than it has: the result is within two units in the last place of the exact
product. Noise that a computation left in the last digits is therefore still there; `even_grid` is for places that
should never have any.
"""

from __future__ import annotations

import sys
from decimal import Context, Decimal
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from cfmkit.arrays import FloatArray

MAX_FLOAT_DIGITS = 15  # every decimal with so many digits survives the way through a float
_MAX_EXACT_POWER = 22  # powers of ten up to this one are exact floats
_POWERS_OF_TEN = np.array([float(f"1e{power}") for power in range(-_MAX_EXACT_POWER, _MAX_EXACT_POWER + 1)])
_WIDE_CONTEXT = Context(prec=800)  # wide enough for the exact digits of any float


def shift_decimal(
    values: ArrayLike,
    power: int,  # how far the decimal point moves to the right, -15 to 15
) -> FloatArray:
    """Return `values` times ``10**power``, correctly rounded as decimals; NaN, infinities and zeros as they are.

    Examples
    --------
    >>> 0.0041 * 1000
    4.1000000000000005
    >>> float(shift_decimal(0.0041, 3))
    4.1
    """
    if not -MAX_FLOAT_DIGITS <= power <= MAX_FLOAT_DIGITS:
        raise ValueError(f"the decimal point can move by -{MAX_FLOAT_DIGITS} to {MAX_FLOAT_DIGITS} places, not {power}")
    numbers = np.asarray(values, dtype=np.float64)
    flat = numbers.ravel()
    shifted = _times(flat, power)
    if power:
        _shift_short(flat, power, shifted)
    return shifted.reshape(numbers.shape)


def even_grid(
    start: float,  # the first and the last place [m]; other units work as well
    stop: float,
    count: int,  # of places, at least 2
) -> FloatArray:
    """Return evenly spaced places, each the float nearest to its decimal [m].

    `numpy.linspace` rounds a step first and multiplies it: its 0.24 m in 480 steps has 4.500000000000001 mm on the way.
    Here both ends are taken in whole nanometres, where the arithmetic is exact up to one division.

    Examples
    --------
    >>> even_grid(0.0, 0.24, 481)[9].item(), np.linspace(0.0, 0.24, 481)[9].item()
    (0.0045, 0.0045000000000000005)
    """
    if count < 2:
        raise ValueError(f"a grid needs at least 2 places, not {count}")
    first, last = shift_decimal([start, stop], 9)
    step = np.arange(count, dtype=np.float64)
    places = shift_decimal((first * step[::-1] + last * step) / (count - 1), -9)
    places[[0, -1]] = start, stop
    return places


def _shift_short(flat: FloatArray, power: int, shifted: FloatArray) -> None:
    """Correct, in place, the entries of `shifted` that are short decimals."""
    size = np.abs(flat)
    leading = np.searchsorted(_POWERS_OF_TEN, size, side="right") - 1 - _MAX_EXACT_POWER
    places = MAX_FLOAT_DIGITS - 1 - leading
    fast = (
        (leading < _MAX_EXACT_POWER)
        & (np.abs(places) <= _MAX_EXACT_POWER)
        & (np.abs(power - places) <= _MAX_EXACT_POWER)
    )
    places[~fast] = 0
    digits = np.rint(_times(flat, places))
    short = fast & (_times(digits, -places) == flat)
    places[~fast] = power
    np.copyto(shifted, _times(digits, power - places), where=short)
    for index in np.flatnonzero(~fast & (size > 0) & np.isfinite(size)):
        shifted[index] = _shift_one(float(flat[index]), power)


def _times(values: FloatArray, power: int | NDArray[np.intp]) -> FloatArray:
    """Return ``values * 10**power`` with a single rounding, for powers of -22 to 22."""
    scale: FloatArray = _POWERS_OF_TEN[np.abs(power) + _MAX_EXACT_POWER]
    with np.errstate(all="ignore"):
        product: FloatArray = np.where(np.less(power, 0), values / scale, values * scale)
    return product


def _shift_one(value: float, power: int) -> float:
    """Return one shifted value of any magnitude, by decimal arithmetic."""
    decimal = Decimal(repr(value))
    # Below the normal floats 15 digits do not tell one float from the next any more.
    if len(decimal.normalize().as_tuple().digits) > MAX_FLOAT_DIGITS or abs(value) < sys.float_info.min:
        decimal = Decimal(value)
    return float(decimal.scaleb(power, _WIDE_CONTEXT))

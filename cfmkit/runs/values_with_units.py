"""Values of options and of arguments of the Python functions: numbers in SI, or texts with a unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import QuantityError, UsageError
from cfmkit.metrics import Window
from cfmkit.specs.units import read_quantity

if TYPE_CHECKING:
    from cfmkit.curves import Kind


def read_length(length: str | float | None, option: str) -> float | None:
    """Return a length above zero [m] of a number or a text with its unit; None for None."""
    if length is None:
        return None
    try:
        value = read_quantity(length, "length") if isinstance(length, str) else float(length)
    except QuantityError as error:
        raise UsageError(f"{option}: {error}") from None
    if not value > 0:
        raise UsageError(f"{option}: {length} is not allowed: must be > 0")
    return value


def read_window(text: Window | str | tuple[float, float] | None, kind: Kind) -> Window | None:
    """Return the window that text such as ``40 mm:210 mm`` says, or two numbers in m or rad; a window as it is.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is malformed.
    """
    if text is None or isinstance(text, Window):
        return text
    if not isinstance(text, str):
        low, high = text
        return Window(low, high)
    ends = text.split(":")
    if len(ends) != 2:
        raise UsageError(f"--window: {text!r} is not 'from:to'; write e.g. --window '40 mm:210 mm'")
    try:
        low, high = (read_quantity(end, "length" if kind == "force" else "angle") for end in ends)
    except QuantityError as error:
        raise UsageError(f"--window: {error}") from None
    if not low < high:
        raise UsageError(f"--window: {text!r} must be increasing")
    return Window(low, high)


def read_target(text: str | float | None, kind: Kind) -> float | None:
    """Return the force [N] or torque [N m] that a text says, or a number as it is; None for None.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is malformed.
    """
    if text is None or not isinstance(text, str):
        return text
    try:
        return read_quantity(text, kind)
    except QuantityError as error:
        raise UsageError(f"--target: {error}") from None

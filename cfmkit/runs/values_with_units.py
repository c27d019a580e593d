"""Lengths, windows and targets from options and arguments of Python functions: numbers in SI, or texts with units."""

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


def read_window(window: Window | str | tuple[float, float] | None, kind: Kind) -> Window | None:
    """Return a window from text ``40 mm:210 mm`` or from two numbers in m or rad; a `Window` or None as it is.

    The ends are lengths if the `kind` of the curve is a force, and angles if it is a torque.

    Raises UsageError if it is malformed, or not increasing.
    """
    if window is None or isinstance(window, Window):
        return window
    if isinstance(window, str):
        ends = window.split(":")
        if len(ends) != 2:
            raise UsageError(f"--window: {window!r} is not 'from:to'; write e.g. --window '40 mm:210 mm'")
        try:
            low, high = (read_quantity(end, "length" if kind == "force" else "angle") for end in ends)
        except QuantityError as error:
            raise UsageError(f"--window: {error}") from None
    else:
        low, high = window
    if not low < high:
        raise UsageError(f"--window: {window!r} must be increasing")
    return Window(low, high)


def read_target(text: str | float | None, kind: Kind) -> float | None:
    """Return the force [N] or torque [N m] that a text says, or a number as it is; None for None.

    Raises UsageError if it is malformed.
    """
    if text is None or not isinstance(text, str):
        return text
    try:
        return read_quantity(text, kind)
    except QuantityError as error:
        raise UsageError(f"--target: {error}") from None

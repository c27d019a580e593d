"""What options say about a measurement: the window and the target, as text with units."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import QuantityError, UsageError
from cfmkit.metrics import Window

if TYPE_CHECKING:
    from cfmkit.curves import Kind


def read_window(text: str | tuple[float, float] | None, kind: Kind) -> Window | None:
    """Return the window that text such as ``40 mm:210 mm`` says, or two numbers in m or rad; None for None.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is malformed.
    """
    from cfmkit.specs.units import read_quantity

    if text is None:
        return None
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
    from cfmkit.specs.units import read_quantity

    if text is None or not isinstance(text, str):
        return text
    try:
        return read_quantity(text, kind)
    except QuantityError as error:
        raise UsageError(f"--target: {error}") from None

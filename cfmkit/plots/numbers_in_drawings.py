"""Numbers in drawings: ticks with whole values, digits as needed, values that differ by rounding only drawn as level.

No number at a tick has to be added to, or multiplied by, a number in a corner.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import ScalarFormatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cfmkit.arrays import FloatArray


MAX_NUMBER_WIDTH = 6.5  # in digits, a point half of one, of a number at a tick: margins of figures have room for it
MIN_RANGE_SHARE = 2e-5
"""Share of the size of its values that an axis shows at least: below it their ticks would need more than seven
digits."""


class WholeNumbers(ScalarFormatter):
    """Writes ticks in full, 0.0002 or 50.6601; where that is too long each with its own power of ten, 2e-9."""

    def __init__(self) -> None:
        """Write neither an offset nor a common power of ten, whatever matplotlib is set to."""
        super().__init__(useOffset=False)
        self.set_scientific(False)

    def format_ticks(self, values: list[float]) -> list[str]:
        """Return the texts of all ticks of an axis."""
        texts = super().format_ticks(values)
        short = [self.fix_minus(brief(value)) for value in values]
        too_long = max((len(text) - 0.5 * text.count(".") for text in texts), default=0.0) > MAX_NUMBER_WIDTH
        return short if too_long and len(set(short)) >= len(set(texts)) else texts


def brief(value: float) -> str:
    """Return a number of up to six digits.

    Examples
    --------
    >>> brief(2.5e-9), brief(1.2e7), brief(-0.03), brief(0.0)
    ('2.5e-9', '1.2e7', '-0.03', '0')
    """
    digits, _, exponent = f"{value:.5e}".partition("e")
    return f"{value:g}" if -3 <= int(exponent) < 6 else f"{float(digits):g}e{int(exponent)}"


def digits_that_differ(low: float, high: float) -> int:
    """Return how many significant digits tell two numbers apart with two to spare, four to eight.

    Examples
    --------
    >>> digits_that_differ(49.1, 50.9), digits_that_differ(50.6601, 50.6643)
    (4, 7)
    """
    size, apart = max(abs(low), abs(high)), abs(high - low)
    return int(np.clip(2 + np.ceil(np.log10(size / apart)), 4, 8)) if apart > 0 else 4


def widen(axes: Axes, values: FloatArray) -> None:
    """Show more of the vertical axis where the values that it shows hardly vary: they are drawn as level then."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return
    low, high = float(finite.min()), float(finite.max())
    least = MIN_RANGE_SHARE * max(abs(low), abs(high))
    if 0.0 < high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


NOISE_SHARE = 1e-9
"""Share of the size of values below which a difference of them, or one of them, is rounding: far above what
sums of a thousand terms lose (1e-13), and far below what a picture shows."""


def is_level(values: FloatArray) -> bool:
    """Return whether the finite ones of some values differ by rounding only, or there are none."""
    finite = values[np.isfinite(values)]
    return not len(finite) or bool(np.ptp(finite) <= NOISE_SHARE * np.abs(finite).max())


def remove_rounding(values: FloatArray) -> FloatArray:
    """Return values; those that differ by rounding only are all the same.

    Examples
    --------
    >>> remove_rounding(np.array([0.3, np.nan, 0.1 + 0.2])).tolist()
    [0.3, nan, 0.3]
    >>> remove_rounding(np.array([0.3, 0.31])).tolist()
    [0.3, 0.31]
    """
    if not is_level(values):
        return values
    is_finite = np.isfinite(values)
    return np.where(is_finite, values[is_finite][0], values) if is_finite.any() else values


def zero_rounding(values: FloatArray, size: float) -> FloatArray:
    """Return values, zero where they are rounding of something of that size.

    Examples
    --------
    >>> zero_rounding(np.array([1e-12, -2.0]), 5.0).tolist()
    [0.0, -2.0]
    """
    return np.where(np.abs(values) <= NOISE_SHARE * size, 0.0, values)

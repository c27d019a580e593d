"""Bounds of a requirement, and how a value stands to them in words."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from cfmkit.metrics.table import split_name
from cfmkit.specs.units import format_short, read_one_of, to_border

if TYPE_CHECKING:
    from cfmkit.metrics.evaluation import Value
    from cfmkit.specs.spec import Requirement

ROUNDING = 1e-9
"""A value on its bound is within it, whatever the conversion of units does to the last bits (relative)."""


@lru_cache(maxsize=256)
def bound(text: str | None, dimensions: tuple[str, ...]) -> float | None:
    """Return a bound in SI from its text, read in one of some dimensions; None where there is none."""
    return None if text is None else read_one_of(text, dimensions)[0]


@dataclass(frozen=True)
class Limits:
    """The bounds of one requirement, as numbers and as they were written."""

    dimension: str
    min: float | None
    max: float | None
    text: str

    @classmethod
    def of(cls, requirement: Requirement, dimension: str) -> Limits:
        """Return the bounds of a requirement that has been validated."""
        low, high = bound(requirement.min, (dimension,)), bound(requirement.max, (dimension,))
        if requirement.min is None:
            text = f"allowed <= {requirement.max}"
        elif requirement.max is None:
            text = f"required >= {requirement.min}"
        else:
            text = f"required {requirement.min} ... {requirement.max}"
        return cls(dimension, low, high, text)

    def met(self, value: float | None) -> bool:
        """Return whether a value keeps both bounds."""
        if value is None:
            return False
        high = self.max is None or value <= self.max + ROUNDING * abs(self.max)
        return high and (self.min is None or value >= self.min - ROUNDING * abs(self.min))

    def margin(self, item: Value) -> float:
        """Return how far a value is inside the bounds; least for none."""
        if item.value is None:
            return -float("inf")
        gaps = [item.value - self.min] if self.min is not None else []
        return min([*gaps, self.max - item.value] if self.max is not None else gaps)

    def sentence(self, metric: str, item: Value, over: str) -> str:
        """Return the outcome in one line."""
        name, branch = split_name(metric)
        words = name.replace("_", " ") + (f" on {branch}" if branch else "")
        if item.value is None:
            return f"{words}{over}: no value ({item.reason}), {self.text}: missed"
        return f"{words} {self.shown(item.value)}{over}, {self.text}: {'ok' if self.met(item.value) else 'missed'}"

    def shown(self, value: float) -> str:
        """Return a value rounded for reading, but never so far that it seems to be on the other side of a bound."""
        for digits in range(4, 18):
            rounded = float(f"{to_border(value, self.dimension):.{digits}g}") / float(to_border(1.0, self.dimension))
            if self.met(rounded) == self.met(value):
                break
        if self.dimension == "ratio" and "%" not in self.text:
            return f"{value:.{digits}g}"
        return format_short(value, self.dimension, digits)

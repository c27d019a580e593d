"""A target curve as a function of the motion: its values, range and extremes, and its points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from cfmkit.numerics.interpolation import ThroughPoints


@dataclass(frozen=True)
class TargetCurve:
    """A force over displacements, or a torque over angles, that a mechanism is to have.

    Examples
    --------
    >>> TargetCurve((10.0, -500.0)).evaluate(0.01)
    5.0
    """

    # through points [m or rad, N or N m]; or a line, its value at zero and its slope
    function: ThroughPoints | tuple[float, float]
    kind: str | None = None  # what it is; None if nothing but zeros says so

    def evaluate(self, places: Any) -> Any:
        """Return the effort that is wanted at places [N or N m]."""
        if isinstance(self.function, ThroughPoints):
            return self.function.evaluate(places)
        level, slope = self.function
        return level + slope * places

    @property
    def extent(self) -> tuple[float, float]:
        """Ends of the motion between which the curve is known [m or rad]."""
        if isinstance(self.function, ThroughPoints):
            return self.function.places[0], self.function.places[-1]
        return -float("inf"), float("inf")

    def scale(self, factor: float) -> TargetCurve:
        """Return the curve with all efforts multiplied by a factor."""
        if isinstance(self.function, ThroughPoints):
            values = tuple(factor * value for value in self.function.values)
            return replace(self, function=replace(self.function, values=values))
        level, slope = self.function
        return replace(self, function=(factor * level, factor * slope))

    def covers(self, low: float, high: float) -> bool:
        """Return True if the curve is known between two places [m or rad], but for rounding."""
        first, last = self.extent
        slack = 1e-6 * (high - low)
        return first <= low + slack and high - slack <= last

    def to_points(self, low: float, high: float) -> ThroughPoints:
        """Return the curve as a function through points [m or rad]; a line has two."""
        if isinstance(self.function, ThroughPoints):
            return self.function
        return ThroughPoints((low, high), (float(self.evaluate(low)), float(self.evaluate(high))))

    def extremes(self, low: float, high: float) -> tuple[float, float]:
        """Return the smallest and the largest effort between two places [N or N m]."""
        return self.to_points(low, high).extremes(low, high)

    def largest(self, low: float, high: float) -> float:
        """Return the largest magnitude between two places [N or N m]."""
        return max(map(abs, self.extremes(low, high)))

"""A curve as it is seen along its motion: a travel to the negative side is turned round, and its force with it.

So places grow, forces that hold against the motion are positive, and what is said of a travel holds for its mirror
image, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.specs.units import between

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.solution import OnCurve


def travel_of(solution: OnCurve) -> tuple[float, float]:
    """Return where the motion was to start and to end; of a drive by a load, where it did [m or rad]."""
    start, end = float(solution.motion[0]), float(solution.motion[-1])
    return start, solution.spec.extent if solution.spec.analysis.travel is not None else end


def window_of(solution: OnCurve) -> tuple[float, float]:
    """Return the window of the analysis in places, or the whole travel."""
    window = solution.spec.analysis.window
    if window is not None:
        return between(window, travel_of(solution))
    return float(solution.motion.min()), float(solution.motion.max())


@dataclass(frozen=True)
class AlongMotion:
    """A curve of at least one point, turned round if it leads to the negative side."""

    solution: OnCurve  # the solved mechanism

    @cached_property
    def sense(self) -> float:
        """Factor of places and forces, 1 or -1: here, and to bring them back."""
        return 1.0 if self.solution.motion[-1] >= self.solution.motion[0] else -1.0

    @cached_property
    def motion(self) -> FloatArray:
        """Places of the points of the curve (n,) [m or rad]; they increase, unless the curve turns back."""
        return np.asarray(self.sense * self.solution.motion)

    @cached_property
    def effort(self) -> FloatArray:
        """Force or torque at the points (n,) [N or N m]."""
        return np.asarray(self.sense * self.solution.effort)

    @cached_property
    def end(self) -> float:
        """The end of the window, or of the travel [m or rad]."""
        return max(self.sense * end for end in window_of(self.solution))

    @property
    def reaches_end(self) -> bool:
        """Whether the curve does not turn back and has the end of the window on it."""
        x = self.motion
        return bool((np.diff(x) > 0).all() and x[0] <= self.end <= x[-1] * (1 + 1e-12))

    @cached_property
    def knots(self) -> tuple[FloatArray, FloatArray]:
        """Places, increasing, and efforts: of the points, and of extremes between them where the model is known."""
        law = self.solution.everywhere
        if law is None:
            return self.motion, self.effort
        x, effort = law.knots
        return (x, effort) if self.sense > 0 else (-x[::-1], -effort[::-1])

    @cached_property
    def corners(self) -> FloatArray | None:
        """Places of kinks of the effort [m or rad]; None if the model between the points is not known."""
        law = self.solution.everywhere
        return None if law is None else np.asarray(self.sense * law.corners)

    def effort_at(self, places: FloatArray) -> FloatArray:
        """Return the effort at places, by the model between the points [N or N m]."""
        assert self.solution.everywhere is not None
        return np.asarray(self.sense * self.solution.everywhere.effort("", self.sense * places))

    def stress_at(self, places: FloatArray) -> FloatArray:
        """Return the largest stress at places, by the model between the points [Pa]."""
        assert self.solution.everywhere is not None
        return self.solution.everywhere.stress("", self.sense * places)

    def stress_reaches(self, level: float) -> float | None:
        """Return where the largest stress first reaches a level, by the model between the points [m or rad]."""
        assert self.solution.everywhere is not None
        found = self.solution.everywhere.stress_reaches(level, self.sense)
        return None if found is None else self.sense * found

    def back(self, value: float | None) -> float | None:
        """Return a place or a force as the specification has it."""
        return value if value is None or self.sense > 0 else 0.0 - value  # not -0

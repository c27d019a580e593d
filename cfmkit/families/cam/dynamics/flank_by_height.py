"""A flank of the cam as the paper needs it: its x as a function of its height y, with three derivatives.

Along the flank at a constant distance from the roller path the tangent is that of the path and

    dx/dy = cot tau,  d2x/dy2 = -k / sin^3 tau,  d3x/dy3 = -k_s / sin^4 tau + 3 k^2 cos tau / sin^5 tau

with tau the angle of the tangent from the x-axis, k the flank's curvature and k_s its derivative
along the flank. All are analytic; only the point that belongs to y needs Newton's method.
The corner of an undercut cam is not a function of y: it cannot be described so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.families.cam.geometry.path import RollerPath
    from cfmkit.families.cam.geometry.slope_law import Real, SlopeLaw

N_KNOTS = 65
NEWTON_STEPS = 30  # turned flanks of the tests take five from the estimates by 65 knots


def slope_second_derivative(law: SlopeLaw, x: Real) -> Real:
    """Return d3y/dx3 of the roller path [1/m^2]."""
    length = law.brace_length
    across = (length - x) * (length + x)
    root = across**0.5
    turn = 1.0 - law.friction * law.frictionless(x)
    rise = law.slope_factor * (1.0 / law.force_constant + length**2 / (across * root))
    bow = law.slope_factor * 3.0 * length**2 * x / (across * across * root)
    second: Real = (1.0 + law.friction**2) * (bow + 2.0 * law.friction * rise * rise / turn) / (turn * turn)
    return second


class FlankPoint(NamedTuple):
    """A point of the flank, or arrays of points: path coordinate and x [m], dx/dy and its derivatives by y."""

    parameter: Any
    x: Any
    first: Any
    second: Any
    third: Any


@dataclass(frozen=True)
class FlankLine:
    """A flank at a distance outwards from a roller path, turned by an angle about a point on the axis."""

    path: RollerPath  # the roller path
    distance: float  # from the path to the flank, negative inwards [m]
    # angle, height: see `cfmkit.families.cam.dynamics.roller_curves_and_motion.Side`
    angle: float
    height: float
    ends: tuple[float, float]  # first and last path coordinate of the flank [m]

    @cached_property
    def _turn(self) -> tuple[float, float]:
        return math.cos(self.angle), math.sin(self.angle)

    def place(self, u: Real) -> tuple[Real, Real]:
        """Return x and y [m] of the flank for path coordinates u [m]."""
        cos, sin = self._turn
        slope = self.path.law.slope(u)
        length = (1.0 + slope * slope) ** 0.5
        x = u + self.distance * slope / length
        y = self.path.height(u) - self.distance / length - self.height
        return cos * x - sin * y, sin * x + cos * y

    def estimate(self, y: float) -> float:
        """Return a rough path coordinate of the point at height y [m]."""
        u = np.linspace(*self.ends, N_KNOTS)
        return float(np.interp(y, self.place(u)[1], u))

    def locate(self, y: Real, guess: Real) -> FlankPoint:
        """Return the points of the flank at heights y [m], starting the search at path coordinates `guess` [m]."""
        cos, sin = self._turn
        law, u = self.path.law, guess
        for _ in range(NEWTON_STEPS):
            step = (self.place(u)[1] - y) / self._climb(u)
            u = u - step
            if np.max(np.abs(step)) <= 1e-16 + 4e-16 * abs(law.brace_length):
                break
        slope, bend, bow = law.slope(u), law.slope_derivative(u), slope_second_derivative(law, u)
        square = 1.0 + slope * slope
        length = square**0.5
        curvature = bend / (square * length)
        change = (bow - 3.0 * slope * bend * bend / square) / (square * square)
        stretch = 1.0 + self.distance * curvature
        curvature, change = curvature / stretch, change / (stretch * stretch * stretch)
        sine, cosine = (sin + slope * cos) / length, (cos - slope * sin) / length
        third = (3.0 * curvature * curvature * cosine / sine - change) / sine**4
        return FlankPoint(u, self.place(u)[0], cosine / sine, -curvature / sine**3, third)

    def _climb(self, u: Real) -> Real:
        """Return dy/du of the flank."""
        cos, sin = self._turn
        law = self.path.law
        slope = law.slope(u)
        square = 1.0 + slope * slope
        climb: Real = (sin + slope * cos) * (1.0 + self.distance * law.slope_derivative(u) / (square * square**0.5))
        return climb

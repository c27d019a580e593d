"""Smoothing splines whose smoothness follows from the noise that is stated, not from the eye.

Discrepancy principle: of all cubic splines that minimise sum (y - s)^2 + lambda integral s''^2
the one is taken whose residuals are as large as the noise, sum (y - s)^2 = n sigma^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

MIN_SPLINE_POINTS = 5
"""What scipy's smoothing spline needs."""

_MAX_LOG_LAMBDA, _MIN_LOG_LAMBDA = 6.0, -14.0
"""Decades of lambda, for data scaled to unit spacing, between which the spline is sought."""


@dataclass(frozen=True)
class SmoothedFunction:
    """A smooth function through noisy points."""

    spline: Any  # the function
    residual: float  # root mean square of (points - function)
    # low, high: where the points begin and end
    low: float
    high: float

    def evaluate(self, places: FloatArray, derivative: int = 0) -> FloatArray:
        """Return the function or one of its derivatives; constant beyond the ends."""
        inside = np.clip(places, self.low, self.high)
        values: FloatArray = self.spline(inside, nu=derivative)
        return values if derivative == 0 else np.where(inside == places, values, 0.0)


def fit_smoothing_spline(
    places: FloatArray,  # (n,): strictly increasing
    values: FloatArray,  # (n,): noisy
    noise: float,  # standard deviation of the noise; 0 interpolates
) -> SmoothedFunction:
    """Return the smoothest cubic spline that is as near to the points as their noise.

    Raises ValueError if there are too few points, or they do not increase.
    """
    from scipy.interpolate import BSpline

    if len(places) < MIN_SPLINE_POINTS or np.diff(places).min() <= 0:
        raise ValueError(f"at least {MIN_SPLINE_POINTS} points in increasing order are needed")
    low, high = float(places[0]), float(places[-1])
    unit = (high - low) / (len(places) - 1)
    spline = _choose_spline((places - low) / unit, values, noise)
    moved = BSpline(spline.t * unit + low, spline.c, spline.k)
    residual = float(np.sqrt(np.mean((moved(places) - values) ** 2)))
    return SmoothedFunction(moved, residual, low, high)


def _choose_spline(x: FloatArray, values: FloatArray, noise: float) -> Any:
    """Return the spline in units of the spacing."""
    from scipy.interpolate import make_interp_spline, make_smoothing_spline

    if noise == 0:
        return make_interp_spline(x, values)
    # Values in units of the noise: the numbers that scipy works with are then of order one.
    scaled = values / noise

    def excess(decade: float) -> float:
        return float(np.mean((make_smoothing_spline(x, scaled, lam=10.0**decade)(x) - scaled) ** 2)) - 1.0

    if excess(_MAX_LOG_LAMBDA) <= 0:
        decade = _MAX_LOG_LAMBDA
    elif excess(_MIN_LOG_LAMBDA) >= 0:
        return make_interp_spline(x, values)
    else:
        decade = _crossing(excess)
    spline = make_smoothing_spline(x, scaled, lam=10.0**decade)
    spline.c = spline.c * noise
    return spline


def _crossing(excess: Any) -> float:
    """Return the decade at which the residuals are as large as the noise: they grow with lambda."""
    low, high = _MIN_LOG_LAMBDA, _MAX_LOG_LAMBDA
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if excess(middle) > 0 else (middle, high)
    return 0.5 * (low + high)

"""Smoothing splines whose smoothness follows from the noise that is stated.

Discrepancy principle: of all cubic splines that minimise sum (y - s)^2 + lambda integral s''^2
the one is taken whose residuals are as large as the noise, sum (y - s)^2 = n sigma^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

MIN_SPLINE_POINTS = 5  # what scipy's smoothing spline needs
LOG_LAMBDA_RANGE = (-14.0, 6.0)  # decades of lambda, for data scaled to unit spacing, that are searched


@dataclass(frozen=True)
class SmoothedFunction:
    """A smooth function through noisy points."""

    spline: Any  # the function, a BSpline of scipy
    residual: float  # root mean square of (points - function)
    ends: tuple[float, float]  # where the points begin and end

    def evaluate(self, places: FloatArray, derivative: int = 0) -> FloatArray:
        """Return the function or one of its derivatives; constant beyond the ends."""
        inside = np.clip(places, *self.ends)
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
    return SmoothedFunction(moved, float(np.sqrt(np.mean((moved(places) - values) ** 2))), (low, high))


def _choose_spline(x: FloatArray, values: FloatArray, noise: float) -> Any:
    """Return the spline in units of the spacing."""
    from scipy.interpolate import make_interp_spline, make_smoothing_spline
    from scipy.optimize import brentq

    if noise == 0:
        return make_interp_spline(x, values)
    # Values in units of the noise: the numbers that scipy works with are then of order one.
    scaled, (low, high) = values / noise, LOG_LAMBDA_RANGE

    def excess(decade: float) -> float:
        return float(np.mean((make_smoothing_spline(x, scaled, lam=10.0**decade)(x) - scaled) ** 2)) - 1.0

    if excess(low) >= 0:
        return make_interp_spline(x, values)
    decade = high if excess(high) <= 0 else brentq(excess, low, high, xtol=1e-3)
    spline = make_smoothing_spline(x, scaled, lam=10.0**decade)
    spline.c = spline.c * noise
    return spline

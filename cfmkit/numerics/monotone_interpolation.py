"""A function through points that neither overshoots nor rings: straight lines, or monotone cubics (PCHIP).

Beyond its first and last point a function keeps its end values. Values, slopes and integrals are those of the same
polynomials, so that an integral differentiates back to the value to rounding.

Reference
---------
F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
SIAM J. Sci. Stat. Comput. 5 (1984): what scipy's ``PchipInterpolator`` does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


NEWTON_STEPS = 6
"""Towards an integral within one piece: the first guess is that of a straight line, which most curves are made of."""


@dataclass(frozen=True)
class ThroughPoints:
    """A function through points.

    Examples
    --------
    >>> step = ThroughPoints((0.0, 1.0, 2.0, 3.0), (1.0, 1.0, 2.0, 2.0))
    >>> [float(step.evaluate(x)) for x in (-1.0, 0.5, 1.5, 9.0)]
    [1.0, 1.0, 1.5, 2.0]
    >>> float(step.integral(3.0))
    4.5
    """

    places: tuple[float, ...]  # increasing, at least two
    values: tuple[float, ...]  # one for each place
    smooth: bool = True  # monotone cubics with a continuous slope; else straight lines

    @cached_property
    def _knots(self) -> FloatArray:
        return np.array(self.places)

    @cached_property
    def _terms(self) -> tuple[FloatArray, ...]:
        """Coefficients of 1, t, t^2, t^3 on each piece, t from its start, (n - 1,) each."""
        y, h = np.array(self.values), np.diff(self._knots)
        rise = np.diff(y) / h
        if not self.smooth or len(y) == 2:
            return y[:-1], rise, 0.0 * rise, 0.0 * rise
        from scipy.interpolate import PchipInterpolator

        slope = PchipInterpolator(self._knots, y).derivative()(self._knots)
        second = (3.0 * rise - 2.0 * slope[:-1] - slope[1:]) / h
        third = (slope[:-1] + slope[1:] - 2.0 * rise) / (h * h)
        return y[:-1], slope[:-1], second, third

    @cached_property
    def _before(self) -> FloatArray:
        """Integral up to the start of each piece."""
        h, (a, b, c, d) = np.diff(self._knots), self._terms
        pieces = h * (a + h * (b / 2.0 + h * (c / 3.0 + h * d / 4.0)))
        return np.concatenate([[0.0], np.cumsum(pieces)])[:-1]

    def _piece(self, x: Any) -> tuple[Any, Any]:
        """Return which piece places belong to, and how far into it they are, ends kept."""
        inside = np.clip(x, self._knots[0], self._knots[-1])
        piece = np.clip(np.searchsorted(self._knots, inside, side="right") - 1, 0, len(self._knots) - 2)
        return piece, inside - self._knots[piece]

    def evaluate(self, x: Any) -> Any:
        """Return values at places, a number or an array."""
        piece, t = self._piece(x)
        a, b, c, d = (term[piece] for term in self._terms)
        return a + t * (b + t * (c + t * d))

    def slope(self, x: Any) -> Any:
        """Return derivatives at places; at and beyond the ends those of the first and the last piece."""
        piece, t = self._piece(x)
        _, b, c, d = (term[piece] for term in self._terms)
        return b + t * (2.0 * c + t * 3.0 * d)

    def integral(self, x: Any) -> Any:
        """Return integrals from the first place."""
        piece, t = self._piece(x)
        a, b, c, d = (term[piece] for term in self._terms)
        beyond = np.asarray(x) - np.clip(x, self._knots[0], self._knots[-1])
        own = t * (a + t * (b / 2.0 + t * (c / 3.0 + t * d / 4.0)))
        return self._before[piece] + own + beyond * (a + t * (b + t * (c + t * d)))

    def invert_integral(
        self,
        values: FloatArray,  # wanted
        less: float = 0.0,  # below the function, or little above where that is near zero
    ) -> FloatArray:
        """Return places up to which the integral of the function less a constant is as wanted.

        By Newton's method on the piece of each value: exact in the digits of the way into the piece. Where a piece
        bends much, or a value is beyond the ends, it may not get there: the integral tells.

        Examples
        --------
        >>> ramp = ThroughPoints((0.0, 2.0), (0.0, 4.0))
        >>> ramp.invert_integral(np.array([0.0, 1.0, 4.0])).tolist()
        [0.0, 1.0, 2.0]
        """
        starts, widths = self._before - less * self._knots[:-1], np.diff(self._knots)
        piece = np.clip(np.searchsorted(starts, values, side="right") - 1, 0, len(widths) - 1)
        a, b, c, d = (term[piece] for term in self._terms)
        a, left, width = a - less, np.maximum(values - starts[piece], 0.0), widths[piece]
        root = np.sqrt(np.maximum(a * a + 2.0 * b * left, 0.0))  # of a straight line it is this
        way = np.minimum(2.0 * left / np.maximum(a + root, 1e-300), width)
        for _ in range(NEWTON_STEPS):
            rate = np.maximum(a + way * (b + way * (c + way * d)), 1e-300)
            excess = way * (a + way * (b / 2.0 + way * (c / 3.0 + way * d / 4.0))) - left
            way = np.minimum(np.maximum(way - excess / rate, 0.0), width)
        return self._knots[piece] + way

    def extremes(self, low: float, high: float) -> tuple[float, float]:
        """Return the smallest and the largest value between two places: these functions have no extreme off a point."""
        between = self._knots[(self._knots > low) & (self._knots < high)]
        values = self.evaluate(np.concatenate([[low], between, [high]]))
        return float(values.min()), float(values.max())

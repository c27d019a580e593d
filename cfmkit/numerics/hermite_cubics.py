"""A function of one variable by the cubics through values and slopes at its knots.

Between two knots the error of a smooth function is the fourth power of their distance [deBoor, ch. IV]. It is what
scipy's `CubicHermiteSpline` and `PchipInterpolator` do; importing those takes a fifth of a second.

References
----------
[deBoor] C. de Boor, A Practical Guide to Splines, Springer 1978.
[FB] F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
SIAM J. Sci. Stat. Comput. 5 (1984) 300-304.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

HALVINGS = 60
"""Of a piece, until a place has no more digits."""


@dataclass(frozen=True, eq=False)
class HermiteCubics:
    """Cubics, piece by piece; beyond the ends the first and the last one go on.

    Attributes
    ----------
    x : (n,) array
        Increasing, at least two.
    y, slope : (n,) or (n, k) array
        Values there, and derivatives.

    Examples
    --------
    >>> x = np.array([-2.0, 0.5, 2.0])
    >>> cubic = HermiteCubics(x, x**3 - 3 * x, 3 * x**2 - 3)
    >>> float(cubic(1.5)), cubic.turning_points().tolist(), cubic.where(0.0).round(12).tolist()
    (-1.125, [-1.0, 1.0], [-1.732050807569, 0.0, 1.732050807569])
    """

    x: FloatArray
    y: FloatArray
    slope: FloatArray

    @property
    def _terms(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Coefficients of 1, t, t^2, t^3, t from the start of each piece."""
        h = np.diff(self.x).reshape(-1, *[1] * (self.y.ndim - 1))
        rise, first, last = np.diff(self.y, axis=0) / h, self.slope[:-1], self.slope[1:]
        return self.y[:-1], first, (3.0 * rise - 2.0 * first - last) / h, (first + last - 2.0 * rise) / (h * h)

    def _piece(self, places: FloatArray) -> tuple[Any, FloatArray]:
        """Return the piece of each place, and how far behind its start that is, shaped as the values are."""
        piece = np.clip(np.searchsorted(self.x, places, side="right") - 1, 0, len(self.x) - 2)
        return piece, np.reshape(places - self.x[piece], (*places.shape, *[1] * (self.y.ndim - 1)))

    def __call__(self, places: float | FloatArray) -> FloatArray:
        """Return values at places, a number or an array (m,)."""
        piece, t = self._piece(np.asarray(places, float))
        a, b, c, d = (term[piece] for term in self._terms)
        return np.asarray(a + t * (b + t * (c + t * d)))

    def derivative(self, places: float | FloatArray) -> FloatArray:
        """Return derivatives at places, a number or an array (m,)."""
        piece, t = self._piece(np.asarray(places, float))
        _, b, c, d = (term[piece] for term in self._terms)
        return np.asarray(b + t * (2.0 * c + t * 3.0 * d))

    def turning_points(self) -> FloatArray:
        """Return where the derivative of a single function is zero between the ends, increasing."""
        _, b, c, d = self._terms
        with np.errstate(invalid="ignore", divide="ignore"):
            root = -(c + np.copysign(np.sqrt(c * c - 3.0 * b * d), c))
            t = np.stack([root / (3.0 * d), b / root])  # neither form cancels
        inside = np.isfinite(t) & (t >= 0.0) & (t <= np.diff(self.x))
        return np.unique((self.x[:-1] + np.where(inside, t, 0.0))[inside])

    def where(self, level: float) -> FloatArray:
        """Return where a single function has a value between its ends, increasing."""
        knots = np.unique(np.concatenate([self.x, self.turning_points()]))
        over = self(knots) - level
        crossed = over[:-1] * over[1:] < 0.0
        low, high, rising = knots[:-1][crossed], knots[1:][crossed], over[1:][crossed] > 0.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            beyond = (self(middle) >= level) == rising
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return np.unique(np.concatenate([knots[over == 0.0], high]))


def monotone_cubics(x: FloatArray, y: FloatArray) -> HermiteCubics:
    """Return cubics that rise and fall only where the values (n,) at places (n,) do [FB]; of two a straight line.

    Examples
    --------
    >>> x = np.arange(4.0)
    >>> monotone_cubics(x, np.array([1.0, 1.0, 2.0, 2.0]))(np.array([0.5, 1.5, 2.5])).tolist()
    [1.0, 1.5, 2.0]
    """
    h = np.diff(x)
    rise = np.diff(y) / h
    if len(x) == 2:
        return HermiteCubics(x, y, np.repeat(rise, 2))
    one, other = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    before, after = rise[:-1], rise[1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (one + other) / (one / before + other / after)
    inner = np.where(before * after > 0.0, mean, 0.0)
    ends = [_end(h[0], h[1], rise[0], rise[1]), _end(h[-1], h[-2], rise[-1], rise[-2])]
    return HermiteCubics(x, y, np.concatenate([ends[:1], inner, ends[1:]]))


def _end(own: float, next_: float, rise: float, further: float) -> float:
    """Return the slope at an end: the parabola's, as far as that is monotone."""
    found = float(((2.0 * own + next_) * rise - own * further) / (own + next_))
    if np.sign(found) != np.sign(rise):
        return 0.0
    return float(3.0 * rise) if np.sign(rise) != np.sign(further) and abs(found) > abs(3.0 * rise) else found

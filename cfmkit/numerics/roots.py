"""Root finding for many targets at once, safeguarded: Newton inside a shrinking bracket."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.curves import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
EPS = float(np.finfo(float).eps)
_PARTS = 48


def invert_increasing(
    evaluate: Evaluate, targets: FloatArray, bracket: tuple[float, float], guess: FloatArray, iterations: int = 80
) -> FloatArray:
    """Return x in the bracket with value(x) = target for an increasing function, element by element.

    Newton steps are taken where they stay inside the bracket of their element and
    bisection where they do not, so that a vanishing derivative at an end does no harm.

    Parameters
    ----------
    evaluate : callable
        ``evaluate(x) -> (value, derivative)`` for an array x; value increasing.
    targets : (n,) array
        Values wanted; those outside the function's range end at the nearer bracket end, NaN stays NaN.
    bracket : (float, float)
        Where to look.
    guess : (n,) array
        First estimates; clipped to the bracket.
    iterations : int
        At most so many steps.

    Returns
    -------
    (n,) array
        Accurate to a few units in the last place of the bracket's size, or better; where the
        derivative vanishes, as far as the value tells: to the square root of that.

    Examples
    --------
    >>> square = lambda x: (x**2, 2 * x)
    >>> invert_increasing(square, np.array([0.25, 2.0]), (0.0, 2.0), np.array([1.0, 1.0])).round(12)
    array([0.5       , 1.41421356])
    """
    low, high = np.full(targets.shape, bracket[0]), np.full(targets.shape, bracket[1])
    x = np.minimum(np.maximum(guess, bracket[0]), bracket[1])
    fine = 16.0 * EPS * np.maximum(np.abs(targets), np.abs(targets).max(initial=0.0))
    tolerance = 16.0 * EPS * max(abs(bracket[0]), abs(bracket[1]))
    before = np.zeros(targets.shape)
    for _ in range(iterations):
        value, slope = evaluate(x)
        error = value - targets
        low, high = np.where(error <= 0, x, low), np.where(error >= 0, x, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            new = np.minimum(np.maximum(x - error / slope, bracket[0]), bracket[1])
        inside = (new >= low) & (new <= high)
        new = np.where(inside, new, 0.5 * (low + high))
        size = np.abs(error)
        # Newton's errors square: the step about to be taken leaves less than size^2 / before.
        done = (size <= fine) | (np.abs(new - x) <= tolerance) | (inside & (size * size <= fine * before))
        x, before = np.where(error == 0, x, new), size
        if done.all():
            break
    return np.where(np.isnan(targets), np.nan, x)


def bracketed_root(evaluate: Callable[[float], float], low: float, high: float, iterations: int = 200) -> float:
    """Return a root of a scalar function that changes sign between `low` and `high`.

    Chandrupatla's method: inverse quadratic interpolation where it is safe, else bisection;
    it stops when the bracket is down to rounding.

    Raises
    ------
    ValueError
        If the function has the same sign at both ends, or is NaN on the way.

    References
    ----------
    T. R. Chandrupatla, Adv. Eng. Softw. 28 (1997) 145.

    Examples
    --------
    >>> round(bracketed_root(lambda x: x**3 - 2.0, 0.0, 2.0), 12)
    1.259921049895
    """
    a, b = high, low
    fa, fb = float(evaluate(a)), float(evaluate(b))
    if fa == 0 or fb == 0:
        return a if fa == 0 else b
    if (fa > 0) == (fb > 0) or math.isnan(fa) or math.isnan(fb):
        raise ValueError(f"no change of sign between {low} and {high}")
    share = 0.5
    for _ in range(iterations):
        x = a + share * (b - a)
        fx = float(evaluate(x))
        if math.isnan(fx):
            raise ValueError(f"the function is not a number at {x}")
        if (fx > 0) == (fa > 0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        limit = 2.0 * EPS * abs(best) / abs(b - a) if b != a else 1.0
        if limit > 0.5 or fx == 0:
            return float(best if fx else a)
        share = _next_share(a, b, c, fa, fb, fc)
        share = min(max(share, limit), 1.0 - limit)
    return best


def _next_share(a: float, b: float, c: float, fa: float, fb: float, fc: float) -> float:
    """Return where in [a, b] to look next: inverse quadratic if the three points allow it, else the middle."""
    xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
    if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
        return fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return 0.5


def boundary(
    holds: Callable[[FloatArray], NDArray[np.bool_]], inside: FloatArray, outside: FloatArray, rounds: int = 7
) -> FloatArray:
    """Return how far a condition holds from places inside towards places outside, row by row.

    Each round cuts the way into parts and keeps the first in which the condition is lost, so
    that it ends at the loss nearest to `inside`, and where the condition is not a number as well.

    Parameters
    ----------
    holds : callable
        ``holds(places)``, (d, m) -> (d, m) of bool.
    inside, outside : (d,) array
        Where it holds, and where it does not; equal where there is nothing to look for.
    rounds : int
        Each makes the way 48 times as short: seven make a millimetre as short as rounding.

    Returns
    -------
    (d,) array
        The last place at which it still holds.

    Examples
    --------
    >>> boundary(lambda x: x * x <= 2.0, np.array([0.0]), np.array([2.0])).round(12)
    array([1.41421356])
    """
    share, rows = np.arange(1, _PARTS) / _PARTS, np.arange(len(inside))
    near, far = np.array(inside), np.array(outside)
    for _ in range(rounds):
        places = near[:, None] + (far - near)[:, None] * share
        lost = ~holds(places)
        first = np.where(lost.any(axis=1), lost.argmax(axis=1), _PARTS - 1)
        near, far = (
            np.where(first > 0, places[rows, np.maximum(first - 1, 0)], near),
            np.where(first < _PARTS - 1, places[rows, np.minimum(first, _PARTS - 2)], far),
        )
    return near

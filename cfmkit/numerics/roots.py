"""Root finding for many targets at once, safeguarded: Newton inside a shrinking bracket."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cfmkit.arrays import FloatArray

Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
FLOAT_EPS = float(np.finfo(float).eps)


def invert_increasing(
    evaluate: Evaluate,
    targets: FloatArray,
    bracket: tuple[float | FloatArray, float | FloatArray],
    guess: FloatArray,
    iterations: int = 80,
    before: FloatArray | None = None,
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
    bracket : (float, float) or pair of (n,) array
        Where to look.
    guess : (n,) array
        First estimates; clipped to the bracket.
    iterations : int
        At most so many steps.
    before : (n,) array, optional
        How far off the values were a step before the guess, where that step was at least one of Newton's.

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
    fine = 16.0 * FLOAT_EPS * np.maximum(np.abs(targets), np.abs(targets).max(initial=0.0))
    tolerance = 16.0 * FLOAT_EPS * np.maximum(np.abs(bracket[0]), np.abs(bracket[1]))
    before = np.zeros(targets.shape) if before is None else before
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

    Raises ValueError if the function has the same sign at both ends, or is NaN on the way.

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
        limit = 2.0 * FLOAT_EPS * abs(best) / abs(b - a) if b != a else 1.0
        if limit > 0.5 or fx == 0:
            return float(best if fx else a)
        share = _next_share(a, b, c, fa, fb, fc)
        share = min(max(share, limit), 1.0 - limit)
    return best


def bracketed_roots(
    evaluate: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray, iterations: int = 200
) -> FloatArray:
    """Return `bracketed_root` of many functions at once, element by element, with the same steps.

    NaN where a function does not change sign, or is NaN on the way.

    Examples
    --------
    >>> bracketed_roots(lambda x: x**3 - np.array([2.0, 9.0]), np.zeros(2), np.full(2, 2.0)).round(12)
    array([1.25992105,        nan])
    """
    with np.errstate(all="ignore"):
        a, b, fa, fb = np.broadcast_arrays(high, low, evaluate(high), evaluate(low))
        root = np.where(fa == 0, a, np.where(fb == 0, b, np.nan))
        searched, share = np.isnan(root) & ((fa > 0) != (fb > 0)) & ~np.isnan(fa + fb), np.full(root.shape, 0.5)
        for _ in range(iterations):
            x = a + share * (b - a)
            fx = evaluate(x)
            stays = (fx > 0) == (fa > 0)
            c, fc = np.where(stays, a, b), np.where(stays, fa, fb)
            b, fb, a, fa = np.where(stays, b, a), np.where(stays, fb, fa), x, fx
            best = np.where(np.abs(fa) < np.abs(fb), a, b)
            limit = np.where(b == a, 1.0, 2.0 * FLOAT_EPS * np.abs(best) / np.abs(b - a))
            ends = searched & ((limit > 0.5) | (fx == 0) | np.isnan(fx))
            root = np.where(ends, np.where(fx == 0, a, best + 0.0 * fx), root)
            searched &= ~ends
            if not searched.any():
                return root
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            inverse = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            share = np.where((phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi), inverse, 0.5)
            share = np.minimum(np.maximum(share, limit), 1.0 - limit)
    return np.where(searched, best, root)


def _next_share(a: float, b: float, c: float, fa: float, fb: float, fc: float) -> float:
    """Return where in [a, b] to look next: inverse quadratic if the three points allow it, else the middle."""
    xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
    if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
        return fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return 0.5

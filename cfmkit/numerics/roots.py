"""Root finding for many targets or functions at once, and the last places at which conditions hold.

Roots are safeguarded: Newton inside a shrinking bracket.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Excess = Callable[[FloatArray, NDArray[np.intp]], FloatArray]


Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
FLOAT_EPS = float(np.finfo(float).eps)
MAX_NEWTON_STEPS, MAX_BRACKETINGS = 80, 200


def invert_increasing(
    evaluate: Evaluate,
    targets: FloatArray,
    bracket: tuple[float | FloatArray, float | FloatArray],
    guess: FloatArray,
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
    before = np.zeros(targets.shape)
    for _ in range(MAX_NEWTON_STEPS):
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


def bracketed_root(evaluate: Callable[[float], float], low: float, high: float) -> float:
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
    for _ in range(MAX_BRACKETINGS):
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


def bracketed_roots(evaluate: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
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
        for _ in range(MAX_BRACKETINGS):
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


_FLOAT_EPS, _FLOAT_TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)
_BRACKET_GRID = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8.0)
_BRACKET_GRID[0], _BRACKET_GRID[4], _BRACKET_GRID[8] = 0.0, 0.5, 1.0
_EVEN_GRID = np.arange(1, 18) / 18.0
_NEAR_OFFSETS = np.array([3e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 0.1, 0.4])
_OFFSETS_AROUND = np.concatenate([-_NEAR_OFFSETS[::-1], [0.0], _NEAR_OFFSETS])
"""Where an end is looked for, as shares of its bracket: first; where nothing is known of it; where it is expected."""
_NEIGHBOUR_OFFSETS = np.arange(-2, 2)
BRACKET_RTOL = 1e-12
"""Share of its first bracket to which an end is found: less is rounding wherever the bracket is a step of a grid."""


@np.errstate(all="ignore")
def last_places(
    # (e, m) -> (e, m): at m places for each of some ends, which are counted along the rows of `inside`. At most zero
    # where the condition holds, as a share of what it is compared with; minus infinity where it holds and nothing more
    # is known, NaN where it is lost
    excess: Excess,
    # (d, k) each: where it holds, and where it does not; equal where there is nothing to look for
    inside: FloatArray,
    outside: FloatArray,
) -> FloatArray:
    """Return the last places at which a condition still holds from places inside towards places outside, (d, k).

    If it is lost more than once on the way, one of these.

    For all of them together, in as few calls as can be: some places all over the bracket, the end expected where
    inverse interpolation through these has it, and then places closer and closer around that. Where the
    excess jumps, brackets are cut into even parts.

    References
    ----------
    T. R. Chandrupatla, Adv. Eng. Softw. 28 (1997) 145: when inverse quadratic interpolation is safe.

    Examples
    --------
    >>> last_places(lambda x, _ends: x * x - 2.0, np.array([[0.0]]), np.array([[2.0]])).round(12)
    array([[1.41421356]])
    """
    roots = np.array(inside).ravel()
    ends = np.flatnonzero(inside != outside)
    inner, far = roots[ends, None], np.ravel(outside)[ends, None]
    least = BRACKET_RTOL * np.abs(far - inner) + 2.0 * _FLOAT_EPS * np.maximum(np.abs(inner), np.abs(far))
    places = inner + (far - inner) * _BRACKET_GRID
    places[:, -1:] = far
    heights = np.array(excess(places, ends)) if len(ends) else places
    # What is known of both ends holds, whatever the last bit is here.
    heights[:, 0] = np.where(heights[:, 0] <= 0.0, heights[:, 0], 0.0)
    heights[:, -1] = np.where(heights[:, -1] <= 0.0, _FLOAT_TINY, heights[:, -1])
    expected = _inverse_interpolation(places, heights)
    places, heights = (np.concatenate([values[:, :1], values, values[:, -1:]], axis=1) for values in (places, heights))
    for _ in range(MAX_BRACKETINGS):
        # The last place that holds, the first that does not, and their neighbours outside of these.
        first = (~(heights <= 0.0)).argmax(axis=1)[:, None] + _NEIGHBOUR_OFFSETS
        places, heights = (np.take_along_axis(values, first, axis=1) for values in (places, heights))
        roots[ends] = places[:, 1]
        width = places[:, 2:3] - places[:, 1:2]
        going = ((np.abs(width) > least) & (heights[:, 1:2] < -4.0 * _FLOAT_EPS))[:, 0]
        if not going.any():
            break
        ends, least, places, heights, width = (values[going] for values in (ends, least, places, heights, width))
        share = (expected[going] - places[:, 1:2]) / width
        share = np.where((share > 0.0) & (share < 1.0), share, _expected_share(places, heights))
        # A step that is at least so long leads across the end, and so narrows the bracket from both sides.
        margin = np.minimum(0.5 * least / np.abs(width), 0.5)
        share = np.where((share > 0.0) & (share < 1.0), share + _OFFSETS_AROUND, _EVEN_GRID)
        more = places[:, 1:2] + width * np.minimum(np.maximum(share, margin), 1.0 - margin)
        computed = excess(more, ends)
        places = np.concatenate([places[:, :2], more, places[:, 2:]], axis=1)
        heights = np.concatenate([heights[:, :2], computed, heights[:, 2:]], axis=1)
        expected = np.full((len(ends), 1), np.nan)
    return roots.reshape(inside.shape)


def _inverse_interpolation(places: FloatArray, heights: FloatArray) -> FloatArray:
    """Return where the polynomials through (height, place), (e, m), are at a height of zero, (e, 1)."""
    apart = heights[:, :, None] - heights[:, None, :] + np.eye(places.shape[1])
    weight = 1.0 / (apart.prod(axis=2) * heights)
    return np.asarray((weight * places).sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True))


def _expected_share(places: FloatArray, heights: FloatArray) -> FloatArray:
    """Return where between the second and the third of four places the end is expected; NaN: nothing is known."""
    (before, inner, far, beyond), (low, under, over, high) = (
        [values[:, k : k + 1] for k in range(4)] for values in (places, heights)
    )
    to_before, to_beyond = np.abs(inner - before), np.abs(beyond - far)
    ahead = (to_before == 0.0) | ((to_beyond > 0.0) & (to_beyond < to_before))
    # Chandrupatla's rule: a and the third point c on one side, b on the other.
    a, b, c = np.where(ahead, far, inner), np.where(ahead, inner, far), np.where(ahead, beyond, before)
    fa, fb, fc = np.where(ahead, over, under), np.where(ahead, under, over), np.where(ahead, high, low)
    xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
    safe = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
    share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    share = np.where(safe, np.where(ahead, 1.0 - share, share), np.nan)
    # Towards a pole it is the reciprocal that runs straight.
    pole = far - (beyond - far) * high / (over - high)
    return np.where(np.isinf(under), (pole - inner) / (far - inner), share)

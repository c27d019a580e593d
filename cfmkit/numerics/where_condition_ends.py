"""End of a condition between a place where it holds and one where it does not, for many ends at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Excess = Callable[[FloatArray, NDArray[np.intp]], FloatArray]

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
    rounds: int = 100,  # calls at most
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
    found = np.array(inside).ravel()
    ends = np.flatnonzero(inside != outside)
    near, far = found[ends, None], np.ravel(outside)[ends, None]
    least = BRACKET_RTOL * np.abs(far - near) + 2.0 * _FLOAT_EPS * np.maximum(np.abs(near), np.abs(far))
    places = near + (far - near) * _BRACKET_GRID
    places[:, -1:] = far
    heights = np.array(excess(places, ends)) if len(ends) else places
    # What is known of both ends holds, whatever the last bit is here.
    heights[:, 0] = np.where(heights[:, 0] <= 0.0, heights[:, 0], 0.0)
    heights[:, -1] = np.where(heights[:, -1] <= 0.0, _FLOAT_TINY, heights[:, -1])
    expected = _inverse(places, heights)
    places, heights = (np.concatenate([one[:, :1], one, one[:, -1:]], axis=1) for one in (places, heights))
    for _ in range(rounds):
        # The last place that holds, the first that does not, and their neighbours outside of these.
        first = (~(heights <= 0.0)).argmax(axis=1)[:, None] + _NEIGHBOUR_OFFSETS
        places, heights = (np.take_along_axis(one, first, axis=1) for one in (places, heights))
        found[ends] = places[:, 1]
        way = places[:, 2:3] - places[:, 1:2]
        going = ((np.abs(way) > least) & (heights[:, 1:2] < -4.0 * _FLOAT_EPS))[:, 0]
        if not going.any():
            break
        ends, least, places, heights, way = (one[going] for one in (ends, least, places, heights, way))
        share = (expected[going] - places[:, 1:2]) / way
        share = np.where((share > 0.0) & (share < 1.0), share, _share(places, heights))
        # A step that is at least so long leads across the end, and so narrows the bracket from both sides.
        margin = np.minimum(0.5 * least / np.abs(way), 0.5)
        share = np.where((share > 0.0) & (share < 1.0), share + _OFFSETS_AROUND, _EVEN_GRID)
        more = places[:, 1:2] + way * np.minimum(np.maximum(share, margin), 1.0 - margin)
        known = excess(more, ends)
        places = np.concatenate([places[:, :2], more, places[:, 2:]], axis=1)
        heights = np.concatenate([heights[:, :2], known, heights[:, 2:]], axis=1)
        expected = np.full((len(ends), 1), np.nan)
    return found.reshape(inside.shape)


def _inverse(places: FloatArray, heights: FloatArray) -> FloatArray:
    """Return where the polynomials through (height, place), (e, m), are at a height of zero, (e, 1)."""
    apart = heights[:, :, None] - heights[:, None, :] + np.eye(places.shape[1])
    weight = 1.0 / (apart.prod(axis=2) * heights)
    return np.asarray((weight * places).sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True))


def _share(places: FloatArray, heights: FloatArray) -> FloatArray:
    """Return where between the second and the third of four places the end is expected; NaN: nothing is known."""
    (before, near, far, beyond), (low, under, over, high) = (
        [one[:, k : k + 1] for k in range(4)] for one in (places, heights)
    )
    to_before, to_beyond = np.abs(near - before), np.abs(beyond - far)
    ahead = (to_before == 0.0) | ((to_beyond > 0.0) & (to_beyond < to_before))
    # Chandrupatla's rule: a and the third point c on one side, b on the other.
    a, b, c = np.where(ahead, far, near), np.where(ahead, near, far), np.where(ahead, beyond, before)
    fa, fb, fc = np.where(ahead, over, under), np.where(ahead, under, over), np.where(ahead, high, low)
    xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
    safe = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
    share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    share = np.where(safe, np.where(ahead, 1.0 - share, share), np.nan)
    # Towards a pole it is the reciprocal that runs straight.
    pole = far - (beyond - far) * high / (over - high)
    return np.where(np.isinf(under), (pole - near) / (far - near), share)

"""Constant bands of many designs side by side, on the closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.solution import EDGE

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly


Sampled = tuple["FloatArray", "FloatArray"]


def _nearest(outside: NDArray[np.bool_], here: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the last place outside before `here` and the first behind it; -1 where there is none."""
    left, right = outside[:, :here][:, ::-1], outside[:, here:]
    low = np.where(left.any(axis=1), here - 1 - left.argmax(axis=1), -1) if here else np.full(len(outside), -1)
    return low, np.where(right.any(axis=1), here + right.argmax(axis=1), -1)


def edges(
    assembly: Assembly, rates: FloatArray, curves: Sampled, around: tuple[float, FloatArray], tolerance: float
) -> Sampled:
    """Return the ends of the band around a reference, sharpened on the closed form.

    Parameters
    ----------
    assembly : Assembly
        Shared by all designs.
    rates : (m, 4) array
        Of the designs.
    curves : (n,) array and (m, n) array
        Places of a grid, and efforts that include the heights of the turning points.
    around : float and (m,) array
        The reference, and the efforts there; NaN where there is no band.
    tolerance : float
        Half width as a fraction.
    """
    (places, effort), (reference, level) = curves, around
    with np.errstate(invalid="ignore"):
        outside = ~(np.abs(effort / level[:, None] - 1.0) <= tolerance * EDGE)
    here = int(places.searchsorted(reference))
    low, high = _nearest(outside, here)

    def end(bad: NDArray[np.intp], inward: int) -> FloatArray:
        whole = np.full(len(rates), places[0] if inward > 0 else places[-1])
        rows = np.flatnonzero((bad >= 0) & np.isfinite(level))
        if len(rows):
            inner = np.clip(bad[rows] + inward, 0, len(places) - 1)
            good = np.maximum if inward < 0 else np.minimum
            ends = places[bad[rows]], good(places[inner], reference)
            whole[rows] = _crossing(_excess(assembly, rates[rows], level[rows], tolerance), ends)
        whole[~np.isfinite(level)] = np.nan
        return whole

    return end(low, 1), end(high, -1)


def _excess(
    assembly: Assembly, rates: FloatArray, level: FloatArray, tolerance: float
) -> Callable[[FloatArray], FloatArray]:
    def excess(motion: FloatArray) -> FloatArray:
        effort = (rates * assembly.units(motion).effort.T).sum(axis=1)
        found: FloatArray = np.abs(effort / level - 1.0) - tolerance * EDGE
        return found

    return excess


def _crossing(function: Callable[[FloatArray], FloatArray], ends: Sampled, steps: int = 60) -> FloatArray:
    """Return where a function of many variables changes sign, one by one, from outside (positive) to inside.

    Illinois' variant of false position; a place that is not outside after all, being
    next to a turning point, is the end itself.
    """
    a, b = (np.array(end, dtype=np.float64) for end in ends)
    fa, fb = function(a), function(b)
    lost = ~((fa > 0.0) & (fb <= 0.0))
    for _ in range(steps):
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.where(fa != fb, b - fb * (b - a) / (fb - fa), 0.5 * (a + b))
        fx = function(x)
        outside = fx > 0.0
        # The end that stays is made to count half, so that it does not stay for ever.
        fb_next = np.where(outside, 0.5 * fb, fx)
        fa_next = np.where(outside, fx, 0.5 * fa)
        a, b = np.where(outside, x, a), np.where(outside, b, x)
        fa, fb = fa_next, fb_next
        if (np.abs(b - a) <= 1e-13 * np.maximum(np.abs(a), np.abs(b))).all() or (np.abs(fx) <= 1e-15).all():
            break
    return np.where(lost, ends[1], np.where(np.abs(fa) < np.abs(fb), a, b))

"""What kind of stiffness a curve has, many curves at once, and where one kind turns into another.

Walking away from the unloaded position, the effort rises from zero. If it falls again by more than it had
risen, the mechanism has another equilibrium; how far it falls, as a fraction of the peak
before, is the drop D that separates the classes.

The limits between them need no tangent. With the torsion springs scaled together by k, the effort is k G + P, P that of
the slider's spring. It stays positive from k1 = max(-P/G) on, and rises everywhere from k2 = max(-P'/G') on.
Below k1 the mechanism is bistable, between k1 and k2 its stiffness is locally negative.

For small angles there is a law without geometry: with s = (t - t2)/(t2 - t0) the torque is
k phi (1 + s)(1 + p s (s - 1)); p > 4 is bistable, 1 < p < 4 local negative, p = 1 zero, p < 1 positive.

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 3.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, remainder, tau
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.numerics.hermite_cubic_turning_points import Monotone


CLASSES = ("positive", "zero", "local negative", "snap-through", "bistable", "tristable")
"""The classes; a curve's class is an index."""

POSITIVE, ZERO, NEGATIVE, SNAPS, BISTABLE, TRISTABLE = range(len(CLASSES))

ROUNDING = 1e-11
"""An effort so small, as a fraction of the largest, is zero; a fall so small, as a fraction of the peak, none."""

BOUNDARY = 1e-3
"""A drop so near to 1 may be on either side of it in a mechanism that is made."""


@dataclass(frozen=True)
class Classified:
    """The classes of m curves.

    Attributes
    ----------
    kind : (m,) array of int
        Index into `CLASSES`.
    drop : (m,) array
        D, the largest fall after a peak as a fraction of that peak; 1 where a second equilibrium begins to exist.
    stable, unstable : (m,) array of int
        Equilibria in the interval, the unloaded position included.
    """

    kind: NDArray[np.intp]
    drop: FloatArray
    stable: NDArray[np.intp]
    unstable: NDArray[np.intp]


def classify(
    curves: Monotone,
    start: float,
    tolerance: float,
    window: tuple[float, float] | None = None,
    rest: float | None = None,
) -> Classified:
    """Return the class of each curve.

    Parameters
    ----------
    curves : Monotone
        Efforts cut into monotonic pieces.
    start : float
        The unloaded position, where the effort is zero whatever rounding says.
    tolerance : float
        Half width of a band that counts as constant: a drop of no more than twice that is zero stiffness.
    window : tuple of (float, float), optional
        Where the effort is wanted constant: if it is, the stiffness is zero even without any fall.
    rest : float, optional
        Where the effort is known to be zero, NaN for nowhere; default: at the start.
    """
    place, value = curves.place, curves.value
    before, after = place <= start, place >= start
    drop = np.maximum(_drop(np.where(after, value, np.nan)), _drop(np.where(before, -value, np.nan)[:, ::-1]))
    stable, unstable = _equilibria(curves, start if rest is None else rest)
    falls = drop > 0.0
    if window is not None:
        falls = falls | _constant(curves, window, tolerance)
    kind = np.where(drop > 2.0 * tolerance, NEGATIVE, np.where(falls, ZERO, POSITIVE))
    kind = np.where(unstable > 0, SNAPS, kind)
    kind = np.where(stable == 2, BISTABLE, np.where(stable > 2, TRISTABLE, kind))
    return Classified(kind, drop, stable, unstable)


def _constant(curves: Monotone, window: tuple[float, float], tolerance: float) -> NDArray[np.bool_]:
    """Return whether (max - min)/|max + min| of each curve in a window is within the tolerance."""
    inside = (curves.place >= window[0]) & (curves.place <= window[1]) & np.isfinite(curves.value)
    high = np.where(inside, curves.value, -np.inf).max(axis=1)
    low = np.where(inside, curves.value, np.inf).min(axis=1)
    with np.errstate(invalid="ignore"):  # where no place is inside
        constant: NDArray[np.bool_] = inside.any(axis=1) & (high - low <= tolerance * np.abs(high + low))
    return constant


def _drop(walk: FloatArray) -> FloatArray:
    """Return the largest fall below the peak before, as a fraction of it, of walks that begin at the unloaded end."""
    with np.errstate(invalid="ignore", divide="ignore"):
        peak = np.fmax.accumulate(walk, axis=1)
        fall = np.where(peak > 0.0, 1.0 - walk / peak, 0.0)
    drop = np.fmax.reduce(fall, axis=1, initial=0.0)
    return np.where(drop > ROUNDING, drop, 0.0)


def signs(curves: Monotone, start: float) -> NDArray[np.int8]:
    """Return the signs of the efforts, (m, k): 0 in the unloaded position and where only rounding is left."""
    scale = np.nanmax(np.abs(curves.value), axis=1, initial=0.0, keepdims=True)
    sign = np.sign(curves.value).astype(np.int8)
    near = ROUNDING * np.maximum(np.ptp(curves.place, axis=1, keepdims=True), 1e-300)
    sign[(np.abs(curves.value) <= ROUNDING * scale) | (np.abs(curves.place - start) <= near)] = 0
    return sign


def _equilibria(curves: Monotone, start: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of stable and unstable equilibria, those at the ends included."""
    sign = signs(curves, start)
    ends = sign[:, [0]] == 0, sign[:, [-1]] == 0
    known = _filled(sign)
    ups = ((known[:, :-1] < 0) & (known[:, 1:] > 0)).sum(axis=1)
    downs = ((known[:, :-1] > 0) & (known[:, 1:] < 0)).sum(axis=1)
    first, last = known[:, 0], known[:, -1]
    # At an end of the interval the effort on the inner side alone says whether the equilibrium is stable.
    ups = ups + (ends[0][:, 0] & (first > 0)) + (ends[1][:, 0] & (last < 0))
    downs = downs + (ends[0][:, 0] & (first < 0)) + (ends[1][:, 0] & (last > 0))
    return ups, downs


def _filled(sign: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return signs with each 0 replaced by what comes before it, at the beginning by what follows."""
    index = np.where(sign != 0, np.arange(sign.shape[1]), 0)
    filled = np.take_along_axis(sign, np.maximum.accumulate(index, axis=1), axis=1)
    first = np.argmax(sign != 0, axis=1)
    opening = np.take_along_axis(sign, first[:, None], axis=1)
    return np.where(filled == 0, opening, filled)


SAMPLES, AROUND = 1001, 101
"""Places of the first look, and of each closer one around the highest of them."""


def scale_factors(assembly: Assembly, low: float, high: float) -> tuple[float, float] | None:
    """Return the factors k1 and k2 by which the torsion springs would have to be scaled, all alike.

    Parameters
    ----------
    assembly : Assembly
        Its rates are the springs for a factor of 1.
    low, high : float
        The motion that is looked at; the unloaded position is left out.

    Returns
    -------
    tuple of (float, float) or None
        None where there is no torsion spring or no spring at the slider; infinite where no factor is enough.
    """
    torsion, slider = assembly.rates[:3], float(assembly.rates[3])
    if not torsion.any() or slider == 0.0:
        return None

    def ratios(motion: FloatArray) -> tuple[FloatArray, FloatArray]:
        units = assembly.units(motion)
        with np.errstate(divide="ignore", invalid="ignore"):
            efforts = torsion @ units.effort[:3], slider * units.effort[3]
            slopes = torsion @ units.stiffness[:3], slider * units.stiffness[3]
        return _needed(*efforts, motion - assembly.start), _needed(*slopes, np.ones_like(motion))

    return _highest(lambda motion: ratios(motion)[0], low, high), _highest(lambda motion: ratios(motion)[1], low, high)


def _needed(torsion: FloatArray, slider: FloatArray, sign: FloatArray) -> FloatArray:
    """Return the factor with which sign * (factor * torsion + slider) is not negative; infinite where none is."""
    torsion, slider = np.sign(sign) * torsion, np.sign(sign) * slider
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.where(torsion > 0.0, -slider / torsion, np.where(slider < 0.0, np.inf, 0.0))
    return np.where(np.isfinite(slider) & (sign != 0.0), needed, -np.inf)


def _highest(function: Callable[[FloatArray], FloatArray], low: float, high: float) -> float:
    """Return the largest value in an interval: on a grid, then on ever finer ones around its highest place."""
    for count in (SAMPLES, AROUND, AROUND, AROUND):
        places = np.linspace(low, high, count)
        values = function(places)
        top = int(np.argmax(values))
        best, step = float(values[top]), places[1] - places[0]
        if not np.isfinite(best):
            return best
        low, high = max(low, float(places[top] - step)), min(high, float(places[top] + step))
    return max(best, 0.0)


def small_angle_number(assembly: Assembly) -> float | None:
    """Return p of the law for small angles; None where the springs are relaxed stretched, or there is no torsion."""
    link = assembly.linkage
    lead = remainder(link.stretched_angle - assembly.unloaded, tau)
    ratio = link.crank / link.coupler
    torsion = assembly.rates[0] + (1.0 + ratio) ** 2 * assembly.rates[1] + ratio**2 * assembly.rates[2]
    if lead == 0.0 or torsion == 0.0:
        return None
    bend = link.crank * (1.0 + ratio) / cos(link.stretched_angle)
    return float(assembly.rates[3] * bend**2 * lead**2 / (2.0 * torsion))

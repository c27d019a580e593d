"""Stability class of many curves at once, and the boundaries between classes.

Walking away from the unloaded position, the effort rises from zero. If it falls again by more than it had
risen, the mechanism has another equilibrium; how far it falls, as a fraction of the peak
before, is the drop D that separates the classes.

The limits between them need no tangent. With the torsion springs scaled together by k, the effort is k G + P, P that of
the slider's spring. It stays positive from k1 = max(-P/G) on, and rises everywhere from k2 = max(-P'/G') on.
Below k1 the mechanism is bistable, between k1 and k2 its stiffness is locally negative.

For small angles there is a law without geometry: with s = (t - t2)/(t2 - t0) the torque is
k phi (1 + s)(1 + p s (s - 1)); p > 4 is bistable, 1 < p < 4 local negative, p = 1 zero, p < 1 positive.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 3.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, remainder, tau
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import Several, ShortRepr

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.numerics.sampled_extremes import Monotone

    Ends = tuple[FloatArray, ...]


CLASS_NAMES = ("positive", "zero", "local negative", "snap-through", "bistable", "tristable")
"""The classes; a curve's class is an index."""
POSITIVE_CLASS, ZERO_CLASS, NEGATIVE_CLASS, SNAP_THROUGH_CLASS, BISTABLE_CLASS, TRISTABLE_CLASS = range(
    len(CLASS_NAMES)
)
EFFORT_RTOL = 1e-11
"""An effort so small, as a fraction of the largest, is zero; a fall so small, as a fraction of the peak, none."""
DROP_TOL = 1e-3  # a drop so near to 1 may be on either side of it in a mechanism that is made


@dataclass(frozen=True, repr=False)
class StabilityClasses(ShortRepr):
    """The classes of m curves."""

    kind: NDArray[np.intp]  # (m,), index into `CLASS_NAMES`
    drop: (
        FloatArray  # (m,), D, the largest fall after a peak as a fraction of it; from 1 on a second equilibrium exists
    )
    stable: NDArray[np.intp]  # (m,), equilibria in the interval, the unloaded position included
    unstable: NDArray[np.intp]  # (m,)


def classify(
    curves: Monotone,  # efforts cut into monotonic pieces
    # start, rest: (m, 1): the unloaded position, and where the effort is known to be zero whatever rounding says, NaN
    # for nowhere
    start: FloatArray,
    rest: FloatArray,
    # (m, 1): half width of a band that counts as constant: a drop of no more than twice that is zero stiffness
    tolerance: FloatArray,
    # pair of (m, 1): where the effort is wanted constant: if it is, the stiffness is zero even without any fall
    window: Ends | None,
) -> StabilityClasses:
    """Return the class of each curve."""
    place, value = curves.place, curves.value
    before, after = place <= start, place >= start
    drop = np.maximum(_drop(np.where(after, value, np.nan)), _drop(np.where(before, -value, np.nan)[:, ::-1]))
    stable, unstable = _equilibria(curves, rest)
    falls = drop > 0.0
    if window is not None:
        falls = falls | _constant(curves, window, tolerance)
    kind = np.where(drop > 2.0 * tolerance[:, 0], NEGATIVE_CLASS, np.where(falls, ZERO_CLASS, POSITIVE_CLASS))
    kind = np.where(unstable > 0, SNAP_THROUGH_CLASS, kind)
    kind = np.where(stable == 2, BISTABLE_CLASS, np.where(stable > 2, TRISTABLE_CLASS, kind))
    return StabilityClasses(kind, drop, stable, unstable)


def _constant(curves: Monotone, window: Ends, tolerance: FloatArray) -> NDArray[np.bool_]:
    """Return whether (max - min)/|max + min| of each curve in a window is within the tolerance."""
    inside = (curves.place >= window[0]) & (curves.place <= window[1]) & np.isfinite(curves.value)
    high = np.where(inside, curves.value, -np.inf).max(axis=1)
    low = np.where(inside, curves.value, np.inf).min(axis=1)
    with np.errstate(invalid="ignore"):  # where no place is inside
        constant: NDArray[np.bool_] = inside.any(axis=1) & (high - low <= tolerance[:, 0] * np.abs(high + low))
    return constant


def _drop(walk: FloatArray) -> FloatArray:
    """Return the largest fall below the peak before, as a fraction of it, of walks that begin at the unloaded end."""
    with np.errstate(invalid="ignore", divide="ignore"):
        peak = np.fmax.accumulate(walk, axis=1)
        fall = np.where(peak > 0.0, 1.0 - walk / peak, 0.0)
    drop = np.fmax.reduce(fall, axis=1, initial=0.0)
    return np.where(drop > EFFORT_RTOL, drop, 0.0)


def find_effort_signs(curves: Monotone, rest: FloatArray) -> NDArray[np.int8]:
    """Return the signs of the efforts, (m, k): 0 at `rest` (m, 1), NaN for nowhere, and where only rounding is left."""
    scale = np.nanmax(np.abs(curves.value), axis=1, initial=0.0, keepdims=True)
    sign = np.sign(curves.value).astype(np.int8)
    same_place = EFFORT_RTOL * np.maximum(np.ptp(curves.place, axis=1, keepdims=True), 1e-300)
    sign[(np.abs(curves.value) <= EFFORT_RTOL * scale) | (np.abs(curves.place - rest) <= same_place)] = 0
    return sign


def _equilibria(curves: Monotone, rest: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of stable and unstable equilibria, those at the ends included."""
    sign = find_effort_signs(curves, rest)
    ends = sign[:, [0]] == 0, sign[:, [-1]] == 0
    filled = _fill_zeros(sign)
    ups = ((filled[:, :-1] < 0) & (filled[:, 1:] > 0)).sum(axis=1)
    downs = ((filled[:, :-1] > 0) & (filled[:, 1:] < 0)).sum(axis=1)
    first, last = filled[:, 0], filled[:, -1]
    # At an end of the interval the effort on the inner side alone says whether the equilibrium is stable.
    ups = ups + (ends[0][:, 0] & (first > 0)) + (ends[1][:, 0] & (last < 0))
    downs = downs + (ends[0][:, 0] & (first < 0)) + (ends[1][:, 0] & (last > 0))
    return ups, downs


def _fill_zeros(sign: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return signs with each 0 replaced by what comes before it, at the beginning by what follows."""
    index = np.where(sign != 0, np.arange(sign.shape[1]), 0)
    filled = np.take_along_axis(sign, np.maximum.accumulate(index, axis=1), axis=1)
    first = np.argmax(sign != 0, axis=1)
    opening = np.take_along_axis(sign, first[:, None], axis=1)
    return np.where(filled == 0, opening, filled)


N_SAMPLES, N_CLOSER_SAMPLES = 1001, 101  # places of the first look, and of each closer one around the highest of them


def scale_factors(
    assembly: Assembly,  # its rates are the springs for a factor of 1; one mechanism, or m as rows
    # low, high: float or (m, 1): the motion that is looked at; the unloaded position is left out
    low: Any,
    high: Any,
) -> Ends:
    """Return the factors k1 and k2 by which the torsion springs would have to be scaled, all alike, (m,) each.

    NaN where there is no torsion spring or no spring at the slider; infinite where no factor is enough.
    """
    rates = assembly.rates.reshape(4, -1)
    none = ~rates[:3].any(axis=0) | (rates[3] == 0.0)

    def compute_factor(unit: FloatArray, sign: FloatArray | float) -> FloatArray:
        unit = assembly.rates_over(unit) * unit
        return _required_factor(unit[:3].sum(axis=0), unit[3], sign)

    with np.errstate(divide="ignore", invalid="ignore"):
        first = _highest(lambda motion: compute_factor(assembly.forces(motion), motion - assembly.start), low, high)
        second = _highest(lambda motion: compute_factor(assembly.units(motion).stiffness, 1.0), low, high)
    return Several((np.where(none, np.nan, first), np.where(none, np.nan, second)))


def _required_factor(torsion: FloatArray, slider: FloatArray, sign: FloatArray | float) -> FloatArray:
    """Return the factor with which sign * (factor * torsion + slider) is not negative; infinite where none is."""
    torsion, slider = np.sign(sign) * torsion, np.sign(sign) * slider
    needed = np.where(torsion > 0.0, -slider / torsion, np.where(slider < 0.0, np.inf, 0.0))
    return np.where(np.isfinite(slider) & (sign != 0.0), needed, -np.inf)


def _highest(function: Callable[[FloatArray], FloatArray], low: Any, high: Any) -> FloatArray:
    """Return the largest value in each interval: on a grid, then on ever finer ones around its highest place, (m,)."""
    low, high = np.reshape(low, (-1, 1)), np.reshape(high, (-1, 1))
    best = np.full(1, -np.inf)
    for count in (N_SAMPLES, N_CLOSER_SAMPLES, N_CLOSER_SAMPLES, N_CLOSER_SAMPLES):
        step = (high - low) / (count - 1)
        places = low + step * np.arange(count)
        values = function(places)
        top = values.argmax(axis=1)[:, None]
        place = np.take_along_axis(np.broadcast_to(places, values.shape), top, 1)
        highest = np.take_along_axis(values, top, 1)[:, 0]
        best = np.where(np.isinf(best) & (count < N_SAMPLES), best, highest)
        low, high = np.maximum(low, place - step), np.minimum(high, place + step)
    return np.where(np.isfinite(best), np.maximum(best, 0.0), best)


def small_angle_number(assembly: Assembly) -> float | None:
    """Return p of the law for small angles; None if the springs are relaxed stretched, or there is no torsion."""
    link = assembly.linkage
    lead = remainder(link.stretched_angle - assembly.unloaded, tau)
    ratio = link.crank / link.coupler
    torsion = assembly.rates[0] + (1.0 + ratio) ** 2 * assembly.rates[1] + ratio**2 * assembly.rates[2]
    if lead == 0.0 or torsion == 0.0:
        return None
    bend = link.crank * (1.0 + ratio) / cos(link.stretched_angle)
    return float(assembly.rates[3] * bend**2 * lead**2 / (2.0 * torsion))

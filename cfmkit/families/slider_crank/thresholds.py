"""Where one class of stiffness turns into another: without solving for a tangent.

With the torsion springs scaled together by k, the effort is k G + P, P that of the slider's spring.
It stays positive from k1 = max(-P/G) on, and rises everywhere from k2 = max(-P'/G') on.
Below k1 the mechanism is bistable, between k1 and k2 its stiffness is locally negative.

For small angles there is a law without geometry: with s = (t - t2)/(t2 - t0) the torque is
k phi (1 + s)(1 + p s (s - 1)); p > 4 is bistable, 1 < p < 4 local negative, p = 1 zero, p < 1 positive.
"""

from __future__ import annotations

from math import cos, remainder, tau
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.build import Assembly

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

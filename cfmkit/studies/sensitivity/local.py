"""Gradients at the nominal point: differences over steps that are halved, extrapolated, with an error estimate.

Ridders' scheme [R]: the differences over h, h/2, h/4, ... are extrapolated to h = 0, and
of all the values so found the one is taken that differs least from its neighbours. That
is the step control: large steps suffer from curvature, small ones from rounding, and
the difference that is left is the error estimate. Where one side has no values (a
friction cannot be negative), differences of the other side are extrapolated.

Reference
---------
[R] C. J. F. Ridders, Adv. Eng. Softw. 4 (1982) 75.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

LEVELS = 7
"""How often a step is halved, and one."""

FIRST_STEP = 0.5
"""The largest step, in half widths of the parameter's range."""


@dataclass(frozen=True)
class Slope:
    """A derivative and how far it may be off; NaN where it cannot be stated."""

    value: float
    error: float


UNKNOWN = Slope(float("nan"), float("nan"))


def steps() -> FloatArray:
    """Return the steps, largest first, in half widths of a range."""
    return np.asarray(FIRST_STEP * 0.5 ** np.arange(LEVELS), dtype=np.float64)


def sample(nominal: FloatArray, half_widths: FloatArray) -> FloatArray:
    """Return points, (parameters, 2, levels, parameters): one parameter a step up, then down.

    Parameters
    ----------
    nominal, half_widths : (d,) array
        Values of the parameters, and the scale of their steps.
    """
    count = len(nominal)
    points = np.broadcast_to(nominal, (count, 2, LEVELS, count)).copy()
    for k in range(count):
        points[k, 0, :, k] += half_widths[k] * steps()
        points[k, 1, :, k] -= half_widths[k] * steps()
    return points


def slope(up: FloatArray, down: FloatArray, at_nominal: float, half_width: float) -> Slope:
    """Return the derivative of one output by one parameter.

    Parameters
    ----------
    up, down : (levels,) array
        The output a step above and below the nominal point; NaN where it failed.
    at_nominal : float
        The output there.
    half_width : float
        The scale of the steps.
    """
    size = half_width * steps()
    both = ~(np.isnan(up) | np.isnan(down))
    scale = float(np.nanmax(np.abs([*up, *down, at_nominal]))) if both.any() or np.isfinite(at_nominal) else 0.0
    noise = 4.0 * np.finfo(np.float64).eps * scale / size
    if both.sum() >= 2:
        return _extrapolate(((up - down) / (2.0 * size))[both], noise[both], 4.0)
    for side, sign in ((up, 1.0), (down, -1.0)):
        there = ~np.isnan(side)
        if there.sum() >= 2 and np.isfinite(at_nominal):
            return _extrapolate((sign * (side - at_nominal) / size)[there], noise[there], 2.0)
    return UNKNOWN


def _extrapolate(differences: FloatArray, noise: FloatArray, factor: float) -> Slope:
    """Return Ridders' value: `factor` is by how much halving the step reduces the leading error."""
    best = UNKNOWN
    row = list(differences[:1])
    for level in range(1, len(differences)):
        before, row = row, [float(differences[level])]
        for order in range(1, level + 1):
            power = factor**order
            row.append((power * row[-1] - before[order - 1]) / (power - 1.0))
            error = max(abs(row[-1] - row[-2]), abs(row[-1] - before[order - 1]), float(noise[level]))
            if not error >= best.error:
                best = Slope(float(row[-1]), error)
    return best


def normalise(derivative: float, nominal: float, at_nominal: float) -> float:
    """Return the relative change of the output for a relative change of the parameter; NaN about zero."""
    return derivative * nominal / at_nominal if nominal and at_nominal else float("nan")

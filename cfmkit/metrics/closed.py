"""Means and extremes over a window of a model that is known at every place, whatever the samples of its curve.

A model's places stand so dense that it hides nothing between two of them: an extreme lies next to the
largest or smallest value there, and a few more places around that sharpen it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.curves import FloatArray

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
"""Of each step between two places: polynomials of degree seven are integrated exactly."""


def inside(places: FloatArray, low: float, high: float) -> FloatArray:
    """Return the ends of a window and the places between them, increasing."""
    between = places[(places > low) & (places < high)]
    return np.concatenate([[low], between, [high]])


def mean(function: Callable[[FloatArray], FloatArray], places: FloatArray, low: float, high: float) -> float:
    """Return the mean of a function over a window: its integral by Gauss' rule between places, over the width.

    Examples
    --------
    >>> round(mean(np.exp, np.linspace(0.0, 1.0, 9), 0.0, 1.0), 12)
    1.718281828459
    """
    ends = inside(places, low, high)
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * (ends[1:] - ends[:-1])
    values = function(middle[:, None] + half[:, None] * _NODES)
    return float((half * (values @ _WEIGHTS)).sum() / (high - low))

"""Integrals of smooth functions: running ones by Gauss-Legendre panels, refined where they need it, and means."""

from __future__ import annotations

from bisect import bisect_left
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import legendre

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

GAUSS_ORDER = 8
FIRST_PANELS = 16


@cache
def _gauss_rule() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the nodes on [-1, 1] and what turns values there into an antiderivative and a tail.

    Two matrices apply to values at the nodes: the first gives the coefficients (highest
    power first) of the antiderivative that vanishes at -1, the second the last four Legendre
    coefficients, whose decay says whether the panel is resolved.
    """
    nodes, weights = legendre.leggauss(GAUSS_ORDER)
    to_series = (np.arange(GAUSS_ORDER) + 0.5) * (legendre.legvander(nodes, GAUSS_ORDER - 1) * weights[:, None])
    powers = [legendre.leg2poly(legendre.legint(row, lbnd=-1))[::-1] for row in np.eye(GAUSS_ORDER)]
    padded = np.array([np.pad(row, (GAUSS_ORDER + 1 - len(row), 0)) for row in powers])
    return nodes, to_series @ padded, to_series[:, -4:]


class RunningIntegral:
    """The integral of a function from `start` to any point up to `stop`.

    On each panel the function is interpolated at its Gauss nodes, and that polynomial is integrated exactly. Panels
    whose last coefficients are not negligible are halved, so that a singularity near an end costs a few more panels and
    no accuracy. A query evaluates one polynomial: it does not call the function again.

    Examples
    --------
    >>> sine = RunningIntegral(np.cos, 0.0, 2.0)
    >>> bool(abs(sine(np.array([1.0]))[0] - np.sin(1.0)) < 1e-15)
    True
    """

    def __init__(
        self,
        function: Callable[[FloatArray], FloatArray],  # of an array of any shape
        start: float,
        stop: float,
        tolerance: float = 1e-14,  # size of the neglected part over the integral of the absolute value
        max_panels: int = 4096,  # a function that is singular inside the interval gets no further
    ) -> None:
        edges = np.linspace(start, stop, FIRST_PANELS + 1)
        middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
        powers, rough = _panel_antiderivatives(function, middle, half)
        while (split := rough > tolerance * np.abs(powers[-1]).sum()).any() and len(middle) < max_panels:
            quarter = np.repeat(0.5 * half[split], 2)
            centers = np.repeat(middle[split], 2) + quarter * np.tile([-1.0, 1.0], int(split.sum()))
            new_powers, new_rough = _panel_antiderivatives(function, centers, quarter)
            middle = np.concatenate([middle[~split], centers])
            half = np.concatenate([half[~split], quarter])
            powers = np.concatenate([powers[:, ~split], new_powers], axis=1)
            rough = np.concatenate([rough[~split], new_rough])
        order = np.argsort(middle)
        self._middle, self._half, self._powers = middle[order], half[order], powers[:, order]
        self._inner = (self._middle + self._half)[:-1]
        self._scale = 1.0 / np.where(self._half == 0, 1.0, self._half)
        whole = self._powers.sum(axis=0)
        self._powers[-1, 1:] += np.cumsum(whole)[:-1]

    def __call__(self, t: FloatArray | float) -> Any:
        """Return the integral from `start` to `t`, a number or an array inside the interval."""
        return self._evaluate_number(float(t)) if isinstance(t, float) else self._evaluate_array(t)

    def _evaluate_array(self, t: FloatArray) -> FloatArray:
        panel = np.searchsorted(self._inner, t)
        place = (t - self._middle[panel]) * self._scale[panel]
        powers = np.take(self._powers, panel, axis=1)
        result: FloatArray = powers[0] * place
        for power in powers[1:-1]:
            result = (result + power) * place
        result += powers[-1]
        return result

    @cached_property
    def _lists(self) -> tuple[list[float], list[float], list[float], list[list[float]]]:
        """The panels as plain numbers: for a single point they are faster than arrays."""
        return self._inner.tolist(), self._middle.tolist(), self._scale.tolist(), self._powers.T.tolist()

    def _evaluate_number(self, t: float) -> float:
        inner, middle, scale, powers = self._lists
        panel = bisect_left(inner, t)
        place, result = (t - middle[panel]) * scale[panel], 0.0
        for power in powers[panel]:
            result = result * place + power
        return result


def _panel_antiderivatives(
    function: Callable[[FloatArray], FloatArray], middle: FloatArray, half: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the antiderivative's coefficients on each panel (powers first), and what they neglect."""
    nodes, to_powers, to_tail = _gauss_rule()
    values = function(middle[:, None] + half[:, None] * nodes) * half[:, None]
    tail = np.abs(values @ to_tail)
    last, before = tail[:, 2] + tail[:, 3], tail[:, 0] + tail[:, 1]
    decay = np.minimum(last / np.maximum(before, np.finfo(float).tiny), 1.0)
    powers: FloatArray = np.ascontiguousarray((values @ to_powers).T)
    return powers, last * decay


def clenshaw_curtis(count: int) -> FloatArray:
    """Return the weights of the mean over an interval from its Chebyshev-Lobatto points; exact for polynomials.

    Examples
    --------
    >>> clenshaw_curtis(3).round(6).tolist()
    [0.166667, 0.666667, 0.166667]
    """
    turns = np.linspace(0, np.pi, count)
    even = np.arange(0, count, 2)
    means = 1.0 / (1.0 - even.astype(float) ** 2)  # of the even Chebyshev polynomials; the odd ones have none
    ends = np.where((even == 0) | (even == count - 1), 0.5, 1.0)
    weights: FloatArray = (2.0 / (count - 1)) * (np.cos(np.outer(turns, even)) @ (ends * means))
    weights[[0, -1]] *= 0.5
    return weights

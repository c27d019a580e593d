"""The bending law of a wide strip: its cross-section curls, and the more it is bent the less it can.

A strip that is bent by the change D of its curvature curls across its width by -nu D, freely where it is narrow. As its
present curvature K = D + K0 grows, curling would stretch its edges, and it flattens. Per length [A]

    U = EI D^2/2 (1 + n (1 - g)),  n = nu^2/(1 - nu^2),  g = 2/th (cosh th - cos th)/(sinh th + sin th),
    th^4 = 3 (1 - nu^2) b^4 K^2/t^2 = c K^2:

g falls from 1 (a narrow beam, EI) to 0 (plane strain). Ends that cannot curl are no part of it. D, K and c are taken by
an element's parameter here, as its rigidity is.

References
----------
[A] D. G. Ashwell, J. Roy. Aeron. Soc. 54 (1950) 708: the anticlastic curvature of rectangular beams and plates.
"""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.numerics.dual_array import DualArray, map_analytic

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import BeamElements

N_TERMS = 9  # of the power series, which converges for th^4 < 125: rounding at 1


class Bending(NamedTuple):
    """Energy of bending by the parameter of an element, and its derivatives by curvature and the tables of the law."""

    energy: Any
    moment: Any
    stiffness: Any
    by_rest: Any  # of the energy; zero of beams that are no wide strips
    by_curl: Any
    by_hindrance: Any


def bending(elements: BeamElements, curvature: Any) -> Bending:
    """Return the bending of elements at their points, (..., e, q) each, at changes of curvature of that shape."""
    narrow = elements.rigidity * curvature**2 / 2
    if elements.curl is None:
        return Bending(narrow, elements.rigidity * curvature, elements.rigidity + 0.0 * curvature, 0.0, 0.0, 0.0)
    n, whole = elements.hindrance, curvature + elements.rest
    g, first, second = _curling_share_or_dual(elements.curl * whole**2)
    stiff, by = 1 + n * (1 - g), 2 * elements.curl * whole
    rising, curved = -n * first * by, -n * (second * by**2 + 2 * elements.curl * first)
    moment = elements.rigidity * (curvature * stiff + curvature**2 / 2 * rising)
    stiffness = elements.rigidity * (stiff + 2 * curvature * rising + curvature**2 / 2 * curved)
    return Bending(narrow * stiff, moment, stiffness, narrow * rising, -narrow * n * first * whole**2, narrow * (1 - g))


def bending_moment(elements: BeamElements, curvature: Any) -> Any:
    """Return the moment of `bending` alone, which may be dual."""
    return elements.rigidity * curvature if elements.curl is None else bending(elements, curvature).moment


def _curling_share_or_dual(z: Any) -> tuple[Any, ...]:
    return map_analytic(curling_share, z) if isinstance(z, DualArray) else curling_share(z)


def curling_share(z: Any) -> tuple[Any, Any, Any]:
    """Return g and its first two derivatives by z = th^4, arrays.

    Examples
    --------
    >>> g, first, second = curling_share(np.array([0.0, 1.0, 1e8]))
    >>> g.round(6).tolist()
    [1.0, 0.994488, 0.02]
    """
    small = np.real(z) < 1.0
    series, far = _sum_series(np.where(small, z, 0.0)), _closed_form(np.where(small, 1.0, z))
    g, first, second = (np.where(small, *pair) for pair in zip(series, far, strict=True))
    return g, first, second


def _sum_series(z: Any) -> tuple[Any, Any, Any]:
    g, first, second = 0.0 * z, 0.0 * z, 0.0 * z
    for coefficient in reversed(SERIES_COEFFICIENTS):
        second = second * z + 2 * first
        first = first * z + g
        g = g * z + coefficient
    return g, first, second


def _closed_form(z: Any) -> tuple[Any, Any, Any]:
    th = np.sqrt(np.sqrt(z))
    e, c, s = np.exp(-th), np.cos(th), np.sin(th)
    below = 1 + 2 * e * s - e * e
    g = 2 / th * (1 - 2 * e * c + e * e) / below
    f = 2 * e * (1 - e * e) * s / below**2  # sinh sin / (sinh + sin)^2
    grows = 2 * e * ((1 + e * e) * s + (1 - e * e) * c) / below**2 - 2 * f * (1 + 2 * e * c + e * e) / below
    once = (4 * f - g) / th
    twice = (4 * grows - 2 * once) / th
    return g, once / (4 * th**3), (twice - 3 * once / th) / (16 * th**6)


def _divide_series(top: list[float], below: list[float]) -> tuple[float, ...]:
    """Return the power series of a quotient of two."""
    quotient: list[float] = []
    for k, value in enumerate(top):
        quotient.append((value - sum(quotient[j] * below[k - j] for j in range(k))) / below[0])
    return tuple(quotient)


SERIES_COEFFICIENTS = _divide_series(
    [2 / factorial(4 * k + 2) for k in range(N_TERMS)], [1 / factorial(4 * k + 1) for k in range(N_TERMS)]
)
"""Coefficients of g as a power series of th^4."""

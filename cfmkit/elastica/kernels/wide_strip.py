"""The bending law of a wide strip: its cross-section curls, and the more it is bent the less it can.

A strip that is bent by the change D of its curvature curls across its width by -nu D, freely where it is narrow. As its
present curvature K grows, curling would stretch its edges, and it flattens. With w(z) the lift of a fibre at z across
the width the energy per length is that of a shallow shell,

    U = int E t^3/24(1 - nu^2) (D^2 + 2 nu D w'' + w''^2) + E t K^2 w^2 / 2 dz,

and the w that makes it smallest gives [A]

    U = EI D^2/2 (1 + n (1 - g)),  n = nu^2/(1 - nu^2),  g = 2/th (cosh th - cos th)/(sinh th + sin th),
    th^4 = 3 (1 - nu^2) b^4 K^2/t^2:

g falls from 1 (a narrow beam, EI) to 0 (plane strain, EI/(1 - nu^2)). The moment is dU/dD, since K = D + K0. Ends that
cannot curl are no part of it.

Over half a drift of the splitting, of length L, the law is one between angles: turn = D L, rest = K0 L, and
th^4 = `curl` (turn + rest)^2.

References
----------
[A] D. G. Ashwell, J. Roy. Aeron. Soc. 54 (1950) 708: the anticlastic curvature of rectangular beams and plates.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.network_array_types import HALVES, SHARE

_ITERATIONS = 40  # of Newton's method, which takes three to five: the law is nearly a straight line
_CLOSE = 1e-13  # of the turn; two steps more end at rounding, also in an imaginary part


def _quotient(top: list[float], below: list[float]) -> tuple[float, ...]:
    """Return the power series of a quotient of two."""
    found: list[float] = []
    for k, value in enumerate(top):
        found.append((value - sum(found[j] * below[k - j] for j in range(k))) / below[0])
    return tuple(found)


_TERMS = 9  # the series converges for th^4 < 125, the first zero below: rounding at 1
SERIES = _quotient([2 / factorial(4 * k + 2) for k in range(_TERMS)], [1 / factorial(4 * k + 1) for k in range(_TERMS)])
"""Coefficients of g as a power series of th^4."""


@inlined
def curling(z):
    """Return g and its first two derivatives by z = th^4; z may be complex."""
    if z.real < 1.0:
        g, first, second = z * 0.0, z * 0.0, z * 0.0
        for k in range(_TERMS - 1, -1, -1):
            second = second * z + 2.0 * first
            first = first * z + g
            g = g * z + SERIES[k]
        return g, first, second
    th = np.sqrt(np.sqrt(z))
    e, c, s = np.exp(-th), np.cos(th), np.sin(th)
    below = 1.0 + 2.0 * e * s - e * e
    # no complex powers: they call a function of numba's, and code that needs it cannot be kept
    squared, cube = below * below, th * th * th
    g = 2.0 / th * (1.0 - 2.0 * e * c + e * e) / below
    f = 2.0 * e * (1.0 - e * e) * s / squared  # sinh sin / (sinh + sin)^2
    grows = 2.0 * e * ((1.0 + e * e) * s + (1.0 - e * e) * c) / squared - 2.0 * f * (1.0 + 2.0 * e * c + e * e) / below
    once = (4.0 * f - g) / th
    twice = (4.0 * grows - 2.0 * once) / th
    return g, once / (4.0 * cube), (twice - 3.0 * once / th) / (16.0 * cube * cube)


@inlined
def _law(turn, rest, curl, n):
    """Return the moment's share EI-free, turn (1 + n (1 - g)) + ..., its slope by the turn, and g and its slopes."""
    whole = rest + turn
    g, first, second = curling(curl * whole * whole)
    stiff, by = 1.0 + n * (1.0 - g), 2.0 * curl * whole
    rising = -n * first * by
    curved = -n * (second * by * by + 2.0 * curl * first)
    moment = turn * stiff + 0.5 * turn * turn * rising
    return moment, stiff + 2.0 * turn * rising + 0.5 * turn * turn * curved, (g, first, second)


@kernel
def bent(linear, rest, curl, n):
    """Return by how much a wide strip turns over a drift, and the slope of that by `linear`; not a number where none.

    linear: the turn of a narrow one, moment x length / EI. Where the moment falls as a strip is bent on (strips that
    were wound tightly and are bent back: tape springs) it would snap, fold by fold: there is no turn.
    """
    turn, more = linear, 2
    for _ in range(_ITERATIONS):
        moment, slope, _ = _law(turn, rest, curl, n)
        if not slope.real > 0.0:
            break
        change = (linear - moment) / slope
        turn = turn + change
        if abs(change) <= _CLOSE * abs(turn):
            more -= 1
            if more == 0:
                return turn, 1.0 / slope
    return linear * np.nan, linear * np.nan


@inlined
def strip_drift(table, step, i, moment):
    """Return the turn of the drift of a row, its derivative by the moment, and the energy."""
    turn, slope, energy = moment * 0.0, moment * 0.0, moment * 0.0
    share = table[step, i, SHARE]
    for half in HALVES:
        w, rest, curl = table[step, i, half], table[step, i, half + 1], table[step, i, half + 2]
        if w != 0.0:
            own, by = bent(w * moment, rest, curl, share)
            turn, slope = turn + own, slope + w * by
            energy += strain_energy(own, rest, curl, share, w)
    return turn, slope, energy


@kernel
def strain_energy(turn, rest, curl, n, w):
    """Return the energy of a drift, w its length over EI."""
    whole = rest + turn
    g, _, _ = curling(curl * whole * whole)
    return 0.5 * turn * turn * (1.0 + n * (1.0 - g)) / w


@kernel
def by_section(turn, rest, curl, n):
    """Return the derivatives of moment and energy, w times each, by rest, curl and n at a given turn."""
    whole = rest + turn
    _, slope, (g, first, second) = _law(turn, rest, curl, n)
    half, stiff = 0.5 * turn * turn, 1.0 + n * (1.0 - g)
    by = 2.0 * curl * whole
    rising = -n * first * by
    of_rest = slope - stiff - turn * rising
    of_curl = -n * whole * (turn * first * whole + half * 2.0 * (first + curl * whole * whole * second))
    of_n = turn * (1.0 - g) - half * first * by
    return (of_rest, of_curl, of_n), (half * rising, -n * half * first * whole * whole, half * (1.0 - g))

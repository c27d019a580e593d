"""Functions of one variable as a row of Chebyshev polynomials, one per panel.

A panel's polynomial goes through the values at its nodes, none of which is an end: a jump or a kink between two panels
does no harm. How fast the coefficients fall says whether a panel is short enough.

Reference
---------
L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM (2013), ch. 2-4.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import chebyshev

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray


N_PANEL_NODES = 16  # of a panel
MAX_PLACES = 1000
"""Places at which functions are requested at once, after which halving ends: strips and flexures need some hundreds,
and a force that is rounding alone, as that of a leg 100 m long, would never be resolved."""
_UNIT_NODES = chebyshev.chebpts1(N_PANEL_NODES)
_COEFFICIENT_TRANSFORM = (
    chebyshev.chebvander(_UNIT_NODES, N_PANEL_NODES - 1).T
    * (np.where(np.arange(N_PANEL_NODES), 2.0, 1.0) / N_PANEL_NODES)[:, None]
)


@dataclass(frozen=True, repr=False)
class ChebyshevPanels(ShortRepr):
    """A function that is one polynomial on each panel."""

    ends: FloatArray  # (k + 1,) of the panels, increasing
    # (k, 2) what each polynomial was made over: its panel, or the most of it where no value could be had at an end
    spans: FloatArray
    coefficients: FloatArray  # (k, N_PANEL_NODES) of the Chebyshev polynomials; NaN where a node is not known

    def evaluate(self, x: FloatArray) -> FloatArray:
        """Return the function at some places, by Clenshaw's recurrence; beyond the ends by the nearest panel's."""
        panel = np.searchsorted(self.ends[1:-1], x, side="right")
        low, high = self.spans[panel].T
        t = (2.0 * x - low - high) / (high - low)
        c, one, two = self.coefficients[panel], np.zeros(x.shape), np.zeros(x.shape)
        for k in range(N_PANEL_NODES - 1, 0, -1):
            one, two = c[..., k] + 2.0 * t * one - two, one
        return np.asarray(c[..., 0] + t * one - two)


def nodes_of(panel: tuple[float, float]) -> FloatArray:
    """Return the nodes of a panel between two ends, increasing."""
    low, high = panel
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * _UNIT_NODES)


def coefficients(panel: tuple[float, float], x: FloatArray, values: FloatArray) -> FloatArray:
    """Return the Chebyshev coefficients of a panel from values at places that hold its nodes; NaN if one is missing.

    Examples
    --------
    >>> x = nodes_of((0.0, 2.0))
    >>> coefficients((0.0, 2.0), x, x**2)[:3].round(12).tolist()
    [1.5, 2.0, 0.5]
    """
    nodes = nodes_of(panel)
    at = np.minimum(np.searchsorted(x, nodes), len(x) - 1)
    return np.asarray(_COEFFICIENT_TRANSFORM @ np.where(x[at] == nodes, values[at], np.nan))


def resolve_panels(
    # all functions at increasing places, (n,) -> (m, n). Where halves lack a value, their panel is kept as it is
    functions: Callable[[FloatArray], FloatArray],
    ends: FloatArray,  # (k + 1,): of the panels at first, increasing
    # size of the last coefficients of each function, relative to the largest value seen, at which it has converged
    close: Sequence[float],
    # at most so many of a panel, for functions with corners; none follows a round of more than `MAX_PLACES` places
    halvings: int,
) -> tuple[ChebyshevPanels, ...]:
    """Return functions as panels, each halved until the polynomials of all functions have converged on it.

    Examples
    --------
    >>> (bow,) = resolve_panels(lambda x: np.abs(x - 0.3)[None, :], np.array([0.0, 1.0]), (1e-6,), 12)
    >>> float(bow.evaluate(np.array([0.75]))[0].round(12)), len(bow.ends) > 4
    (0.45, True)
    """
    wanted = list(pairwise(np.asarray(ends).tolist()))
    parents: dict[tuple[float, float], list[FloatArray]] = {}
    done: dict[tuple[float, float], list[FloatArray]] = {}
    largest = np.zeros(len(close))
    for left in range(halvings, -1, -1):
        places = np.unique(np.concatenate([nodes_of(panel) for panel in wanted]))
        values = functions(places)
        if parents and not np.isfinite(values).all():
            done |= parents
            break
        largest = np.fmax(largest, np.nanmax(np.abs(values), axis=1, initial=0.0))
        rough: dict[tuple[float, float], list[FloatArray]] = {}
        for panel in wanted:
            found = [coefficients(panel, places, row) for row in values]
            tails = np.array([np.abs(one[-3:]).max() for one in found])
            (rough if left and len(places) <= MAX_PLACES and (tails > close * largest).any() else done)[panel] = found
        if not rough:
            break
        middles = {panel: 0.5 * (panel[0] + panel[1]) for panel in rough}
        parents = rough
        wanted = [half for (low, high), at in middles.items() for half in ((low, at), (at, high))]
    ordered = sorted(done)
    borders, spans = np.array([low for low, _ in ordered] + [ordered[-1][1]]), np.array(ordered)
    return tuple(
        ChebyshevPanels(borders, spans, np.array([done[panel][k] for panel in ordered])) for k in range(len(close))
    )

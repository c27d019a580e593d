"""The course of a pressed chain: its force and stress at every travel, whatever the points of its curve.

A nearly straight chain yields within a thousandth of its travel: over the logarithm of the travel its force is a row of
Chebyshev polynomials, each on a panel of its own. A panel whose polynomial has not converged is halved, and the chain
is pressed again at the nodes of the halves. Below the first node the force is proportional to the travel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.closed import mean
from cfmkit.numerics.panels import nodes_of, resolved
from cfmkit.numerics.roots import bracketed_root

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.panels import Panels

NEAREST = 1e-6
"""Share of the travel at which the first node stands: the force there is about a thousandth of its level."""

WIDE = 1.5
"""Width of a panel at first, in the logarithm of the travel: a path that has no corner is resolved at once."""

CLOSE = (1e-8, 1e-7)
"""Size of the last coefficients, relative to the largest, at which force and stress have converged: the force of a good
chain changes by a hundredth over its travel, and a place on it is to be right to a millionth of that."""

HALVINGS = 12
"""At most so many: the stress has a kink where its place jumps, and a chain without a kink has a sharp corner."""


@dataclass(frozen=True, eq=False)
class Course:
    """Force and stress of a chain at every travel (a `cfmkit.results.ClosedForm`).

    Attributes
    ----------
    ends : (float, float)
        Of the curve [m].
    first : (float, float)
        Force [N] and stress [Pa] where it begins.
    laws : (Panels, Panels)
        Force [N], of all legs, and stress [Pa] over the logarithm of the travel [m].
    """

    ends: tuple[float, float]
    first: tuple[float, float]
    laws: tuple[Panels, Panels]

    @cached_property
    def places(self) -> FloatArray:
        """Increasing travels: the nodes, and the ends of their panels [m]."""
        borders = self.laws[0].ends
        nodes = [nodes_of(ends) for ends in pairwise(borders.tolist())]
        own = np.exp(np.sort(np.concatenate([borders, *nodes])))
        low, high = self.ends
        return np.concatenate([[low], own[(own > low) & (own < high)], [high]])

    @property
    def peaks(self) -> FloatArray:
        """All places: a chain without a kink has its peak before the second point of a curve [m]."""
        return self.places

    def effort(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the force of all legs at travels of any shape [N]."""
        return self._at(places, 0)

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of a leg at travels of any shape [Pa]."""
        return self._at(places, 1)

    def force(self, places: FloatArray) -> FloatArray:
        """Return the force of all legs at travels of any shape [N]."""
        return self._at(places, 0)

    def _at(self, places: FloatArray, which: int) -> FloatArray:
        law, first = self.laws[which], self.first[which]
        nearest = float(np.exp(law.ends[0]))
        size = np.clip(np.ravel(places), *self.ends)
        found = law.at(np.clip(np.log(np.maximum(size, nearest)), law.ends[0], law.ends[-1]))
        share = np.minimum(size / nearest, 1.0)
        return np.asarray(np.where(size < nearest, first + (found - first) * share, found).reshape(np.shape(places)))

    def mean(self, window: tuple[float, float]) -> float:
        """Return the mean force in a window of the travel [N]."""
        return mean(self.force, self.places, *window)

    def first_at(self, level: float, which: int = 0) -> float | None:
        """Return the travel at which the force [N], or the stress [Pa] (1), first reaches a level; None if nowhere."""
        places = self.places
        above = np.flatnonzero(self._at(places, which) >= level)
        if not len(above) or above[0] == 0:
            return float(places[0]) if len(above) else None

        def off(travel: float) -> float:
            return float(self._at(np.array([travel]), which)[0]) - level

        return bracketed_root(off, float(places[above[0] - 1]), float(places[above[0]]))


def course(
    pressed: Callable[[FloatArray], tuple[FloatArray, FloatArray] | None],
    ends: tuple[float, float],
    first: tuple[float, float],
) -> Course | None:
    """Return the course between two travels; None where the chain cannot be pressed to every node.

    Parameters
    ----------
    pressed : callable
        Force [N] and stress [Pa] at increasing travels [m]; None where one of them is not reached.
    ends : (float, float)
        Of the curve [m].
    first : (float, float)
        Force and stress where it begins.
    """
    low, high = np.log(max(ends[0], NEAREST * ends[1])), np.log(ends[1])

    def values(places: FloatArray) -> FloatArray:
        found = pressed(np.exp(places))
        return np.full((2, len(places)), np.nan) if found is None else np.array(found)

    borders = np.linspace(low, high, int(np.ceil((high - low) / WIDE)) + 1)
    force, stress = resolved(values, borders, CLOSE, HALVINGS)
    whole = np.isfinite(force.coefficients).all() and np.isfinite(stress.coefficients).all()
    return Course(ends, first, (force, stress)) if whole else None

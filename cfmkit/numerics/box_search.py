"""Smallest value of a function of a few bounded variables: a grid, then the best cell, one variable inside another.

Deterministic, without derivatives, and safe in narrow curved valleys, because the inner variables are
always optimised for the outer ones. A bound is met exactly where it is the best.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable


ZERO_END_RATIO = 1e-6
"""A logarithmic axis that ends at zero goes on to this fraction of its other end, and then to zero itself."""
MAX_VALUE_RATIO = 10.0
"""On the grid of the first variable the others are not refined where they are so many times worse than the best."""


@dataclass(frozen=True)
class BoxAxis:
    """A variable: its bounds, and whether its size matters rather than its difference."""

    # low, high: bounds; of a logarithmic axis they have one sign, or one of them is zero
    low: float
    high: float
    log: bool = False  # whether steps are ratios. From a bound of zero it starts at `ZERO_END_RATIO` of the other

    def value(self, share: float) -> float:
        """Return the value at a share of the way, 0 to 1; the bounds exactly."""
        if share <= 0.0 or share >= 1.0:
            return self.low if share <= 0.0 else self.high
        if not self.log:
            return self.low + share * (self.high - self.low)
        far = max(abs(self.low), abs(self.high))
        first, last = (
            math.copysign(max(abs(end), ZERO_END_RATIO * far), self.low + self.high) for end in (self.low, self.high)
        )
        return float(first * (last / first) ** share)


@dataclass(frozen=True)
class Lowest:
    """Smallest value found, and its place."""

    place: tuple[float, ...]  # the variables
    value: float  # the function there; infinite if it is so everywhere
    # the best place and value for each grid value of the first variable
    profile: tuple[tuple[tuple[float, ...], float], ...] = ()


def lowest(
    # of a tuple of as many values as there are axes; infinite where it does not exist
    function: Callable[[tuple[float, ...]], float],
    axes: tuple[BoxAxis, ...],  # the first is the outermost
    grid: int = 15,  # values of each variable on the grid
    fine: int = 30,  # at most so many more around the best of them
) -> Lowest:
    """Return where a function of bounded variables is smallest.

    Examples
    --------
    >>> found = lowest(lambda at: (at[0] - 0.3) ** 2 + (at[1] * at[0] - 1.0) ** 2, (BoxAxis(0, 1), BoxAxis(1, 9)))
    >>> [round(value, 5) for value in found.place]
    [0.3, 3.33333]
    """
    lowest_value, is_rough = math.inf, True  # until the grid of the first variable is known

    def search(outer: tuple[float, ...]) -> Lowest:
        """Return the smallest value for some outer variables."""
        nonlocal lowest_value, is_rough
        if len(outer) == len(axes):
            value = function(outer)
            lowest_value = min(lowest_value, value)
            return Lowest(outer, value)
        axis, seen = axes[len(outer)], dict[float, Lowest]()

        def search_share(share: float) -> float:
            seen[share] = search((*outer, axis.value(share)))
            return seen[share].value

        shares = np.linspace(0.0, 1.0, grid).tolist()
        heights = [search_share(share) for share in shares]
        profile = tuple((seen[share].place, seen[share].value) for share in shares)
        best = int(np.argmin(heights))
        is_rough &= bool(outer)
        if math.isfinite(heights[best]) and (not is_rough or heights[best] <= MAX_VALUE_RATIO * lowest_value):
            from scipy.optimize import minimize_scalar

            minimize_scalar(
                lambda share: min(search_share(float(share)), 1e300),
                bounds=(shares[max(best - 1, 0)], shares[min(best + 1, len(shares) - 1)]),
                method="bounded",
                options={"xatol": 1e-7, "maxiter": fine},
            )
        smallest = min(seen.values(), key=lambda item: item.value)
        return Lowest(smallest.place, smallest.value, profile)

    return search(())

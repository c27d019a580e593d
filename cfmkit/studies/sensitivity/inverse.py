"""The inverse of a tolerance study: which tolerance on each parameter keeps the yield at what is asked.

Requirements become rows of force and stress at a few poses, which move in proportion to the errors (`studies.margins`).
With them the yield of any set of tolerances is known to first order without one more solution. Three answers follow:

- alone: how wide one tolerance may be while all others stay as they are stated;
- together: all of them by one factor;
- allocated: by cost. With c / tolerance for the cost of each, the cheapest set whose spread of the critical limits is
  the same has tolerances in proportion to (c / s^2)^(1/3), s being what a parameter adds to that spread (Lagrange's
  multiplier of sum c/t under sum (t s)^2).

The allocated set is then drawn and analysed part by part: the yield that is reported is that of those parts.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

WIDEST = 20.0
"""A tolerance is not made wider than so many times what is stated: first order does not reach farther."""

ROUNDS = 40
"""Bisections."""


@dataclass(frozen=True)
class ToleranceFactors:
    """Factors on the stated tolerances; NaN where even none of that error leaves the yield too low.

    Attributes
    ----------
    alone, together, allocated : (d,) array
        For each parameter.
    share : float
        Yield as stated, to first order.
    perfect : float
        Yield without errors, 0 or 1.
    """

    alone: FloatArray
    together: FloatArray
    allocated: FloatArray
    share: float
    perfect: float


def answered(
    rows: FloatArray, by_error: FloatArray, errors: FloatArray, costs: FloatArray, wanted: float
) -> ToleranceFactors:
    """Return the factors on tolerances that keep a yield.

    Parameters
    ----------
    rows : (m,) array
        Limits of a perfect part; at least zero where they hold.
    by_error : (m, d) array
        Their derivatives by the errors.
    errors : (k, d) array
        Errors of parts as the tolerances are stated.
    costs : (d,) array
        Cost of each tolerance: c over its width.
    wanted : float
        The yield.
    """

    def share(factors: FloatArray) -> float:
        return float((rows + (errors * factors) @ by_error.T >= 0).all(axis=1).mean())

    ones = np.ones(errors.shape[1])

    def one(k: int) -> Callable[[float], float]:
        return lambda f: share(np.where(np.arange(len(ones)) == k, f, 1.0))

    alone = np.array([_largest(one(k), wanted) for k in range(len(ones))])
    shape = _shape(rows, by_error, errors, costs)
    together = _largest(lambda f: share(f * ones), wanted)
    allocated = _largest(lambda f: share(np.minimum(f * shape, WIDEST)), wanted)
    return ToleranceFactors(
        alone, together * ones, np.minimum(allocated * shape, WIDEST), share(ones), share(0.0 * ones)
    )


def _largest(share: Callable[[float], float], wanted: float) -> float:
    """Return the largest factor with which a yield is kept; NaN where none does."""
    if share(0.0) < wanted:
        return float("nan")
    low, high = 0.0, WIDEST
    if share(high) >= wanted:
        return high
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if share(middle) >= wanted else (low, middle)
    return low


def _shape(rows: FloatArray, by_error: FloatArray, errors: FloatArray, costs: FloatArray) -> FloatArray:
    """Return in which proportion tolerances of least cost stand, their mean 1."""
    moved = by_error[:, None, :] * errors.std(axis=0)
    spread = np.sqrt((moved**2).sum(axis=(1, 2)))
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.where(spread > 0, np.exp(-0.5 * np.clip(rows / spread, 0.0, 30.0) ** 2), 0.0)
    # what a limit loses counts as often as it is missed
    weights = near / near.sum() if near.sum() > 0 else np.full(len(rows), 1.0 / len(rows))
    scaled = np.where(spread[:, None] > 0, (moved[:, 0, :] / np.maximum(spread, 1e-300)[:, None]) ** 2, 0.0)
    adds = np.maximum(weights @ scaled, 1e-9)
    found: FloatArray = (costs / adds) ** (1.0 / 3.0)
    return np.asarray(found / found.mean())

"""Parts near a design by linear estimate: their numbers move in proportion to their errors.

Derivatives are exact where they are known, and central differences elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

SIGMA_STEP = 0.5
"""Step of a difference by an error, in standard deviations: so small that its own curvature does not count."""


def differentiate(
    numbers: Callable[[int, float], FloatArray | None], ends: FloatArray, known: FloatArray | None = None
) -> FloatArray | None:
    """Return the derivatives of numbers of a part by some of its values, (q, d); None if a part has no numbers.

    `numbers(k, value)`: those of a part whose k-th value is so, (q,); `ends`, (d, 2): the values between which a
    difference is taken; `known`, (q, d): exact derivatives, NaN where one is not known.
    """
    columns = []
    for k, (low, high) in enumerate(ends.tolist()):
        if known is not None and np.isfinite(known[:, k]).all():
            columns.append(known[:, k])
            continue
        above, below = numbers(k, high), numbers(k, low)
        if above is None or below is None or not (np.isfinite(above).all() and np.isfinite(below).all()):
            return None
        columns.append((above - below) / (high - low))
    return np.array(columns).T


@dataclass(frozen=True)
class NearParts:
    """Numbers of a perfect part, and their derivatives by the errors of parts."""

    middle: FloatArray  # (q,)
    by_error: FloatArray  # (q, d)

    def numbers(self, errors: FloatArray) -> FloatArray:
        """Return the numbers of parts with errors (k, d), (k, q)."""
        return np.asarray(self.middle + errors @ self.by_error.T)

    def share(self, errors: FloatArray) -> float:
        """Return the share of parts all of whose numbers are at least zero: of limits, those that keep every one."""
        return float((self.numbers(errors) >= 0).all(axis=1).mean())

    def spread(self, deviations: FloatArray) -> FloatArray:
        """Return the standard deviation of each number, (q,), for errors of so large ones (d,)."""
        return np.asarray(np.sqrt(((self.by_error * deviations) ** 2).sum(axis=1)))

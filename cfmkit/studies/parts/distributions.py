"""Distributions of parameters, alone and together.

A parameter is uniform or normal, perhaps truncated. Several are joined by a Gaussian copula: correlation is that of the
normal scores, so that each parameter keeps its own distribution whatever it is correlated with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cfmkit.arrays import FloatArray

COVERED_DEVIATIONS = 3.0  # standard deviations on either side that stand for the range of a normal parameter


class Incompatible(ValueError):
    """Correlations that no set of variables can have together."""


@dataclass(frozen=True)
class ParameterSpread:
    """The distribution of one parameter."""

    kind: Literal["uniform", "normal"]  # its shape
    nominal: float  # where a perfect part would be
    # low, high: ends of a uniform distribution; truncation of a normal one, infinite for none
    low: float
    high: float
    deviation: float = 0.0  # standard deviation of the normal distribution before truncation

    @property
    def standard_deviation(self) -> float:
        """Of the distribution: that of the normal one before truncation, or of a range [SI]."""
        return self.deviation if self.kind == "normal" else (self.high - self.low) / 12.0**0.5

    @property
    def ends(self) -> tuple[float, float]:
        """The range that it covers: three standard deviations where it has no ends."""
        if self.kind == "uniform":
            return self.low, self.high
        reach = COVERED_DEVIATIONS * self.deviation
        return max(self.low, self.nominal - reach), min(self.high, self.nominal + reach)

    def tighten(self, factor: float) -> ParameterSpread:
        """Return the same distribution narrower about the nominal value."""
        low, high = (self.nominal + factor * (end - self.nominal) for end in (self.low, self.high))
        return replace(self, low=low, high=high, deviation=factor * self.deviation)

    def evaluate_quantiles(self, unit: FloatArray) -> FloatArray:
        """Return the values below which the shares `unit`, in (0, 1), of all parts lie."""
        if self.kind == "uniform":
            return self.low + unit * (self.high - self.low)
        from scipy.special import ndtr, ndtri

        below, above = (float(ndtr((end - self.nominal) / self.deviation)) for end in (self.low, self.high))
        inside = np.clip(below + unit * (above - below), _FLOAT_TINY, 1.0 - _FLOAT_EPSNEG)
        values = self.nominal + self.deviation * ndtri(inside)
        return np.asarray(np.clip(values, self.low, self.high))


_FLOAT_TINY = np.finfo(np.float64).tiny
_FLOAT_EPSNEG = float(np.finfo(np.float64).epsneg)


def values_at(spreads: Sequence[ParameterSpread], unit: FloatArray) -> FloatArray:
    """Return points in the unit cube, (n, d), as values of the parameters."""
    return np.stack([one.evaluate_quantiles(unit[:, k]) for k, one in enumerate(spreads)], axis=1)


def values_across(spreads: Sequence[ParameterSpread], unit: FloatArray) -> FloatArray:
    """Return points in the unit cube, (n, d), spread evenly over the ranges of the parameters."""
    ends = np.array([one.ends for one in spreads])
    return np.asarray(ends[:, 0] + unit * (ends[:, 1] - ends[:, 0]))


def correlation_matrix(count: int, groups: Iterable[tuple[Sequence[int], float]]) -> FloatArray:
    """Return the correlations of so many parameters, from groups of them and the correlation of each two of a group.

    Raises Incompatible if no variables can be correlated so.
    """
    matrix = np.eye(count)
    for members, correlation in groups:
        for one in members:
            for other in members:
                if one != other:
                    matrix[one, other] = correlation
    if np.linalg.eigvalsh(matrix).min() < -1e-9:
        raise Incompatible(
            "these correlations are impossible together: of three parameters not all pairs can be opposed"
        )
    return matrix


def draw(matrix: FloatArray, count: int, generator: np.random.Generator) -> FloatArray:
    """Return points in the unit cube, (count, d), whose normal scores have these correlations."""
    from scipy.special import ndtr

    values, vectors = np.linalg.eigh(matrix)
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    scores = generator.standard_normal((count, len(matrix)))
    # Without correlations the scores stay what was drawn, to the last bit.
    joined = scores if np.array_equal(matrix, np.eye(len(matrix))) else scores @ root.T
    return np.asarray(ndtr(joined))

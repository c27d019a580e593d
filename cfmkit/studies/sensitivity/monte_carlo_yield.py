"""Monte Carlo over tolerances: how many parts are good, and which tolerance to tighten first.

Every sample is one made mechanism. It is evaluated as drawn, and again with each
tolerance (or group of correlated ones) halved about its nominal value while all random
numbers stay: the differences are those of the tolerance alone. ``yield_gain`` says how
many more parts would be good, ``variance_drop`` which share of an output's variance
would go away.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.studies.sensitivity.failed_sample_policy import Analysis, Index
from cfmkit.studies.sensitivity.probability_confidence_intervals import (
    LEVEL,
    clopper_pearson,
    paired_difference,
    wilson,
)
from cfmkit.studies.sensitivity.sobol import RESAMPLES, varies_not

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.sensitivity.distributions import ParameterSpread
    from cfmkit.studies.sensitivity.failed_sample_policy import Policy
    from cfmkit.studies.sensitivity.probability_confidence_intervals import Interval

YIELD_GAIN, VARIANCE_DROP = "yield_gain_when_halved", "variance_drop_when_halved"
TIGHTER = 0.5
"""By which factor a tolerance is tightened."""

Groups = tuple[tuple[int, ...], ...]


def sample(unit: FloatArray, spreads: Sequence[ParameterSpread], groups: Groups) -> FloatArray:
    """Return made mechanisms, (n, 1 + groups, d): as drawn, then with one group tightened each.

    Parameters
    ----------
    unit : (n, d) array
        Drawn, in the unit cube.
    spreads : sequence of ParameterSpread
        The d tolerances.
    groups : tuple of tuple of int
        Tolerances that are tightened together.
    """
    drawn = _values(unit, spreads)
    tight = _values(unit, [one.tightened(TIGHTER) for one in spreads])
    blocks = [drawn]
    for group in groups:
        changed = drawn.copy()
        changed[:, group] = tight[:, group]
        blocks.append(changed)
    return np.stack(blocks, axis=1)


def _values(unit: FloatArray, spreads: Sequence[ParameterSpread]) -> FloatArray:
    return np.stack([one.at(unit[:, k]) for k, one in enumerate(spreads)], axis=1)


@dataclass(frozen=True)
class Yield:
    """The share of good parts among those made."""

    value: float  # between the extremes if failed samples may be either; NaN if it cannot be stated
    # wilson, clopper_pearson: its confidence intervals; under ``bound`` they hold every fate of the failed samples
    wilson: Interval
    clopper_pearson: Interval
    # good, failed, count: samples that meet everything, that failed, and all
    good: int
    failed: int
    count: int

    @property
    def ends(self) -> Interval:
        """The shares of good parts if all failed samples are bad ones, and if all are good ones."""
        return self.good / self.count, (self.good + self.failed) / self.count


def yield_of(met: NDArray[np.bool_], failed: NDArray[np.bool_], policy: Policy) -> Yield:
    """Return the share of samples that are good.

    Parameters
    ----------
    met : (n,) array of bool
        Whether a sample meets what it should.
    failed : (n,) array of bool
        Whether nobody knows.
    policy : {"fail", "resample", "bound"}
        What a failed sample means.
    """
    count, unknown = len(met), int(failed.sum())
    good = int((met & ~failed).sum())
    if not count or (unknown and policy != "bound"):
        gap = (float("nan"), float("nan"))
        return Yield(float("nan"), gap, gap, good, unknown, count)
    ends = good, good + unknown
    value = (ends[0] + ends[1]) / (2.0 * count)
    score = wilson(ends[0], count)[0], wilson(ends[1], count)[1]
    exact = clopper_pearson(ends[0], count)[0], clopper_pearson(ends[1], count)[1]
    return Yield(value, score, exact, good, unknown, count)


def yield_gains(met: NDArray[np.bool_], failed: NDArray[np.bool_], policy: Policy) -> Index:
    """Return how much the yield gains when each group is tightened.

    Parameters
    ----------
    met, failed : (n, 1 + groups) array of bool
        As drawn, then tightened. Under ``bound`` a failed sample is a bad part.
    policy : {"fail", "resample", "bound"}
        What a failed sample means.
    """
    count = len(met)
    gains = []
    for group in range(1, met.shape[1]):
        if not count or (policy != "bound" and failed[:, (0, group)].any()):
            gains.append((np.nan, np.nan, np.nan))
            continue
        before, after = met[:, 0] & ~failed[:, 0], met[:, group] & ~failed[:, group]
        gained, lost = int((after & ~before).sum()), int((before & ~after).sum())
        gains.append(((gained - lost) / count, *paired_difference(gained, lost, count)))
    value, low, high = np.array(gains, dtype=np.float64).reshape(-1, 3).T
    return Index(YIELD_GAIN, value, low, high)


def variance_drops(outputs: FloatArray, seed: int) -> Analysis:
    """Return by which share the variance of an output falls when each group is tightened.

    Parameters
    ----------
    outputs : (n, 1 + groups) array
        Complete: as drawn, then tightened.
    seed : int
        Of the bootstrap.
    """
    groups = outputs.shape[1] - 1
    if len(outputs) < 2 or varies_not(outputs[:, 0]):
        gap = np.full(groups, np.nan)
        return (Index(VARIANCE_DROP, gap, gap, gap),)
    count, generator = len(outputs), np.random.default_rng([seed, 2])
    again = np.array([_drops(outputs[generator.integers(count, size=count)]) for _ in range(RESAMPLES)])
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.nanpercentile(again, (tail, 100.0 - tail), axis=0)
    return (Index(VARIANCE_DROP, _drops(outputs), low, high),)


def _drops(outputs: FloatArray) -> FloatArray:
    variance = outputs.var(axis=0)
    # A bootstrap sample may hold one point many times and nothing else.
    with np.errstate(all="ignore"):
        return np.asarray(1.0 - variance[1:] / variance[0])

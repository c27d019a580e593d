"""Monte Carlo over tolerances: how many parts are good, and which tolerance to tighten first.

Every sample is one made mechanism. It is evaluated as drawn, and again with each tolerance (or group of correlated
ones) halved about its nominal value while all random numbers stay: the differences are those of the tolerance alone.
``yield_gain`` says how many more parts would be good, ``variance_drop`` which share of an output's variance would go
away.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.studies.parts.share import CONFIDENCE_LEVEL, Share, paired_difference
from cfmkit.studies.parts.uncertain_values import values_at
from cfmkit.studies.point_evaluation import Metric
from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.result_types import (
    N_RESAMPLES,
    Analysis,
    Findings,
    Index,
    IndexLine,
    analyze_complete,
    is_constant,
    lines_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.parts.uncertain_values import ParameterSpread
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup


YIELD_GAIN, VARIANCE_DROP = "yield_gain_when_halved", "variance_drop_when_halved"
TIGHTENING_FACTOR = 0.5  # by which factor a tolerance is tightened

Groups = tuple[tuple[int, ...], ...]


def sample(
    unit: FloatArray,  # (n, d): drawn, in the unit cube
    spreads: Sequence[ParameterSpread],  # the d tolerances
    groups: Groups,  # tolerances that are tightened together
) -> FloatArray:
    """Return made mechanisms, (n, 1 + groups, d): as drawn, then with one group tightened each."""
    drawn = values_at(spreads, unit)
    tight = values_at([spread.tighten(TIGHTENING_FACTOR) for spread in spreads], unit)
    blocks = [drawn]
    for group in groups:
        changed = drawn.copy()
        changed[:, group] = tight[:, group]
        blocks.append(changed)
    return np.stack(blocks, axis=1)


def yield_gains(
    # met, failed: (n, 1 + groups) of bool: as drawn, then tightened. A failed sample is a bad part
    met: NDArray[np.bool_],
    failed: NDArray[np.bool_],
) -> Index:
    """Return how much the yield gains when each group is tightened."""
    count = len(met)
    gains = []
    for group in range(1, met.shape[1]):
        if not count:
            gains.append((np.nan, np.nan, np.nan))
            continue
        before, after = met[:, 0] & ~failed[:, 0], met[:, group] & ~failed[:, group]
        gained, lost = int((after & ~before).sum()), int((before & ~after).sum())
        gains.append(((gained - lost) / count, *paired_difference(gained, lost, count)))
    value, low, high = np.array(gains, dtype=np.float64).reshape(-1, 3).T
    return Index(YIELD_GAIN, value, low, high)


def variance_drops(
    outputs: FloatArray,  # (n, 1 + groups): complete: as drawn, then tightened
    seed: int,  # of the bootstrap
) -> Analysis:
    """Return by which share the variance of an output falls when each group is tightened."""
    groups = outputs.shape[1] - 1
    if len(outputs) < 2 or is_constant(outputs[:, 0]):
        gap = np.full(groups, np.nan)
        return (Index(VARIANCE_DROP, gap, gap, gap),)
    count, generator = len(outputs), np.random.default_rng([seed, 2])
    again = np.array([_variance_drops(outputs[generator.integers(count, size=count)]) for _ in range(N_RESAMPLES)])
    tail = 50.0 * (1.0 - CONFIDENCE_LEVEL)
    low, high = np.nanpercentile(again, (tail, 100.0 - tail), axis=0)
    return (Index(VARIANCE_DROP, _variance_drops(outputs), low, high),)


def _variance_drops(outputs: FloatArray) -> FloatArray:
    variance = outputs.var(axis=0)
    # A bootstrap sample may hold one point many times and nothing else.
    with np.errstate(all="ignore"):
        return np.asarray(1.0 - variance[1:] / variance[0])


DRAWN_ROLE = "drawn"  # the role of a sample of a Monte Carlo run
YIELD_METRIC = Metric("yield", "ratio", "share of parts that meet every requirement")


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """Return shares of good parts, and what tighter tolerances gain."""
    count, groups = len(setup.parameters), setup.together
    spreads = [parameter.spread for parameter in setup.parameters]
    unit = setup.parts.unit(setup.samples, setup.seed).reshape(setup.samples, count)
    points = sample(unit, spreads, groups)
    names = tuple(", ".join(setup.paths[k] for k in group) for group in groups)
    outputs = evaluator.outputs(points, [DRAWN_ROLE, *(f"halved {name}" for name in names)])
    drops = partial(variance_drops, seed=setup.seed)
    lines: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        analysis = analyze_complete(outputs[..., m], drops, (VARIANCE_DROP,), len(names))
        lines += lines_of(metric, names, analysis, len(outputs))
    plain = Findings(setup, evaluator, tuple(lines), points=points, outputs=outputs)
    return _with_yield(plain, names) if setup.study.spec.part_requirements else plain


def judge_samples(setup: Setup, outputs: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which samples meet which requirement (b, s, r), and of which that is not known (b, s)."""
    met = outputs[..., len(setup.study.metrics) :]
    return np.asarray(~np.isnan(met) & (met > 0.5)), np.asarray(np.isnan(met).any(axis=-1))


def with_shares(findings: Findings, met: NDArray[np.bool_], failed: NDArray[np.bool_]) -> Findings:
    """Return findings with the shares of parts, as drawn, that meet all requirements and each of them."""
    shares = tuple(Share.from_outcomes(met[:, 0, k], failed[:, 0]) for k in range(met.shape[-1]))
    return replace(
        findings, all_met=Share.from_outcomes(np.asarray(met[:, 0].all(axis=-1)), failed[:, 0]), each_met=shares
    )


def _with_yield(findings: Findings, names: tuple[str, ...]) -> Findings:
    """Return findings with the yield, and what it gains from tighter tolerances."""
    setup, outputs = findings.setup, findings.outputs
    if outputs is None:
        return findings
    met, failed = judge_samples(setup, outputs)
    gains = yield_gains(np.asarray(met.all(axis=-1)), failed)
    lines = (*lines_of(YIELD_METRIC, names, (gains,), len(outputs)), *findings.lines)
    return replace(with_shares(findings, met, failed), lines=lines)


SENSITIVITY_METHOD = Method(
    run,
    lambda samples, _, groups: samples * (groups + 1),
    (YIELD_GAIN, VARIANCE_DROP),
    {"": "draw_histogram"},
    draws_parts=True,
    by_role=True,
)

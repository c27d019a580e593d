"""Monte Carlo over tolerances: the yield, and what it gains from each tolerance that is tightened."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.studies.parts.share import Share
from cfmkit.studies.point_evaluation import Metric
from cfmkit.studies.sensitivity import monte_carlo_yield
from cfmkit.studies.sensitivity.indices import analyze_complete
from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.result_types import Findings, IndexLine, lines_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup

DRAWN_ROLE = "drawn"  # the role of a sample of a Monte Carlo run
YIELD_METRIC = Metric("yield", "ratio", "share of parts that meet every requirement")


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """Return shares of good parts, and what tighter tolerances gain."""
    count, groups = len(setup.parameters), setup.together
    spreads = [one.spread for one in setup.parameters]
    unit = setup.parts.unit(setup.samples, setup.seed).reshape(setup.samples, count)
    points = monte_carlo_yield.sample(unit, spreads, groups)
    names = tuple(", ".join(setup.paths[k] for k in group) for group in groups)
    outputs = evaluator.outputs(points, [DRAWN_ROLE, *(f"halved {name}" for name in names)])
    drops = partial(monte_carlo_yield.variance_drops, seed=setup.seed)
    found: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        analysis = analyze_complete(outputs[..., m], drops, (monte_carlo_yield.VARIANCE_DROP,), len(names))
        found += lines_of(metric, names, analysis, len(outputs))
    plain = Findings(setup, evaluator, tuple(found), points=points, outputs=outputs)
    return _with_yield(plain, names) if setup.study.spec.part_requirements else plain


def judge_samples(setup: Setup, outputs: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which samples meet which requirement (b, s, r), and of which that is not known (b, s)."""
    met = outputs[..., len(setup.study.metrics) :]
    return np.asarray(~np.isnan(met) & (met > 0.5)), np.asarray(np.isnan(met).any(axis=-1))


def with_shares(found: Findings, met: NDArray[np.bool_], failed: NDArray[np.bool_]) -> Findings:
    """Return findings with the shares of parts, as drawn, that meet all requirements and each of them."""
    each = tuple(Share.from_outcomes(met[:, 0, k], failed[:, 0]) for k in range(met.shape[-1]))
    return replace(found, all_met=Share.from_outcomes(np.asarray(met[:, 0].all(axis=-1)), failed[:, 0]), each_met=each)


def _with_yield(found: Findings, names: tuple[str, ...]) -> Findings:
    """Return findings with the yield, and what it gains from tighter tolerances."""
    setup, outputs = found.setup, found.outputs
    if outputs is None:
        return found
    met, failed = judge_samples(setup, outputs)
    gains = monte_carlo_yield.yield_gains(np.asarray(met.all(axis=-1)), failed)
    lines = (*lines_of(YIELD_METRIC, names, (gains,), len(outputs)), *found.lines)
    return replace(with_shares(found, met, failed), lines=lines)


SENSITIVITY_METHOD = Method(
    run,
    lambda samples, _, groups: samples * (groups + 1),
    (monte_carlo_yield.YIELD_GAIN, monte_carlo_yield.VARIANCE_DROP),
    {"": "draw_histogram"},
    draws_parts=True,
    by_role=True,
)

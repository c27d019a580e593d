"""The six methods over an evaluator: draw, evaluate, analyse, state."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families import family
from cfmkit.specs.units import border_unit, to_border
from cfmkit.studies.parts.allowed_tolerances import LEAST_FACTOR, allowed_tolerances
from cfmkit.studies.parts.distributions import values_across, values_at
from cfmkit.studies.parts.share import Share
from cfmkit.studies.point_evaluation import Metric
from cfmkit.studies.sensitivity import local, monte_carlo_yield, morris, oat, sobol
from cfmkit.studies.sensitivity.evaluation import Evaluator, Interrupted
from cfmkit.studies.sensitivity.indices import analyze_complete
from cfmkit.studies.sensitivity.result_types import Findings, IndexLine, lines_of
from cfmkit.studies.sensitivity.result_types import to_stated_value as reported

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.parts.allowed_tolerances import ToleranceFactors
    from cfmkit.studies.parts.uncertain_values import Parameter
    from cfmkit.studies.sensitivity.setup import Setup

DEFAULT_YIELD, ESTIMATED = 0.95, 4000
"""What `inverse` keeps where `min_yield` says nothing, and the parts of its estimate of first order."""

DRAWN = "drawn"
"""The role of a sample of a Monte Carlo run."""

YIELD = Metric("yield", "ratio", "share of parts that meet every requirement")


def carry_out(setup: Setup, compute: Callable[[Work], Records]) -> Findings:
    """Return what a study finds.

    Parameters
    ----------
    setup : Setup
        What to do.
    compute : callable
        From `Work` to `Records`: serial, in processes, on a cluster.
    """
    evaluator = Evaluator(setup.study, setup.parameters, compute, by_role=setup.method == "tolerance")
    try:
        return METHODS[setup.method](setup, evaluator)
    except Interrupted:
        return Findings(setup, evaluator, interrupted=True)


def _oat(setup: Setup, evaluator: Evaluator) -> Findings:
    points = oat.sample(setup.values, setup.ends, setup.samples)
    outputs = evaluator.outputs(points, [[path] * setup.samples for path in setup.paths])
    found: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        nominal = float(setup.nominal.values[m])
        analysis = oat.analyze(setup.values, setup.ends, outputs[..., m], nominal)
        found += lines_of(metric, setup.paths, analysis, setup.samples)
    return Findings(setup, evaluator, tuple(found), points=points, outputs=outputs)


def _local(setup: Setup, evaluator: Evaluator) -> Findings:
    half = (setup.ends[:, 1] - setup.ends[:, 0]) / 2.0
    points = local.sample(setup.values, half)
    count = len(half)
    exact = _exact(setup)
    width = len(setup.study.metrics) + len(setup.study.spec.part_requirements)
    outputs = np.full((count, 2, local.LEVELS, width), np.nan)
    if not _all_known(setup, exact):
        sides = [side for side in ("up", "down") for _ in range(local.LEVELS)]
        roles = [[f"{path} {side}" for side in sides] for path in setup.paths]
        outputs = evaluator.outputs(points.reshape(count, -1, count), roles).reshape(outputs.shape)
    found: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        nominal = float(setup.nominal.values[m])
        for k, one in enumerate(setup.parameters):
            known = exact.get(metric.name, {}).get(one.path) if metric.over is None else None
            if known is not None:
                slope = local.Slope(known, 0.0)
            else:
                slope = local.slope(outputs[k, 0, :, m], outputs[k, 1, :, m], nominal, float(half[k]))
            found += _gradient_lines(metric, one, slope, nominal)
    return Findings(setup, evaluator, tuple(found), points=points, outputs=outputs)


def _exact(setup: Setup) -> Mapping[str, Mapping[str, float]]:
    """Return the derivatives that the family knows in closed form: metric -> path -> SI value."""
    gradient = family(setup.study.spec.family).gradient
    if gradient is None or setup.study.design:
        return {}
    found: Mapping[str, Mapping[str, float]] = gradient(setup.study.spec, setup.paths)
    return found


def _all_known(setup: Setup, exact: Mapping[str, Mapping[str, float]]) -> bool:
    wanted = ((one, path) for one in setup.study.metrics for path in setup.paths)
    return all(one.over is None and path in exact.get(one.name, {}) for one, path in wanted)


def _gradient_lines(metric: Metric, one: Parameter, slope: local.Slope, at_nominal: float) -> Iterator[IndexLine]:
    above, below = border_unit(metric.dimension), border_unit(one.dimension)
    scale = float(to_border(1.0, metric.dimension)) / float(to_border(1.0, one.dimension))
    unit = above if below == "1" else f"{above}/{below}" if below.isalpha() else f"{above}/({below})"
    value, low, high = (reported(end * scale, "ratio") for end in _neighbours(slope.value, slope.error))
    yield IndexLine(metric.label, one.path, "gradient", value, low, high, unit, local.LEVELS)
    relative = local.normalise(1.0, one.spread.nominal, at_nominal)
    value, low, high = (
        reported(end, "ratio") for end in _neighbours(slope.value * relative, slope.error * abs(relative))
    )
    yield IndexLine(metric.label, one.path, oat.SLOPE, value, low, high, "1", local.LEVELS)


def _neighbours(value: float, reach: float) -> tuple[float, float, float]:
    return value, value - reach, value + reach


def _morris(setup: Setup, evaluator: Evaluator) -> Findings:
    count, seed = len(setup.parameters), setup.seed
    spreads = [one.spread for one in setup.parameters]

    unit = morris.sample(0, setup.samples, count, seed)
    points = values_across(spreads, unit.reshape(-1, count)).reshape(unit.shape)
    roles = [f"step {k}" for k in range(count + 1)]
    outputs = evaluator.outputs(points, roles)
    low, high = setup.ends.T
    grid = np.rint((points - low) / (high - low) * (morris.LEVELS - 1)) / (morris.LEVELS - 1)
    found: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        analysis = analyze_complete(outputs[..., m], lambda one: morris.analyze(grid, one, seed), morris.NAMES, count)
        found += lines_of(metric, setup.paths, analysis, len(grid))
    return Findings(setup, evaluator, tuple(found), points=points, outputs=outputs)


def _sobol(setup: Setup, evaluator: Evaluator) -> Findings:
    count, seed = len(setup.parameters), setup.seed
    spreads = [one.spread for one in setup.parameters]

    unit = sobol.sample(0, setup.samples, count, seed)
    points = values_at(spreads, unit.reshape(-1, count)).reshape(unit.shape)
    roles = ["A", *(f"A with {path} of B" for path in setup.paths), "B"]
    outputs = evaluator.outputs(points, roles)
    found: list[IndexLine] = []
    on_the_way: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        for size in sobol.stages(len(outputs)):
            known = outputs[:size, ..., m]
            analysis = analyze_complete(known, lambda one: sobol.analyze(one, seed), sobol.NAMES, count)
            lines = list(lines_of(metric, setup.paths, analysis, size))
            on_the_way += lines
        found += lines
    return Findings(setup, evaluator, tuple(found), tuple(on_the_way), points=points, outputs=outputs)


def _tolerance(setup: Setup, evaluator: Evaluator) -> Findings:
    count, groups = len(setup.parameters), setup.together
    spreads = [one.spread for one in setup.parameters]
    unit = setup.parts.unit(setup.samples, setup.seed).reshape(setup.samples, count)
    points = monte_carlo_yield.sample(unit, spreads, groups)
    names = tuple(", ".join(setup.paths[k] for k in group) for group in groups)
    outputs = evaluator.outputs(points, [DRAWN, *(f"halved {name}" for name in names)])
    drops = partial(monte_carlo_yield.variance_drops, seed=setup.seed)
    found: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        analysis = analyze_complete(outputs[..., m], drops, (monte_carlo_yield.VARIANCE_DROP,), len(names))
        found += lines_of(metric, names, analysis, len(outputs))
    plain = Findings(setup, evaluator, tuple(found), points=points, outputs=outputs)
    return _with_yield(plain, names) if setup.study.spec.part_requirements else plain


def _inverse(setup: Setup, evaluator: Evaluator) -> Findings:
    """State which tolerances keep the yield, and draw parts within those that are allocated."""
    wanted = setup.block.min_yield or DEFAULT_YIELD
    spreads = [one.spread for one in setup.parameters]
    errors = setup.parts.draw(ESTIMATED, [setup.seed, 3]) - setup.values
    costs = np.array([setup.block.costs.get(path, 1.0) for path in setup.paths])
    answer = allowed_tolerances(setup.parts, setup.nominal.result, errors, costs, wanted)
    found = list(_tolerance_lines(setup, answer))
    factors = np.where(np.isfinite(answer.allocated), np.maximum(answer.allocated, LEAST_FACTOR), 1.0)
    tight = [one.tightened(float(factor)) for one, factor in zip(spreads, factors, strict=True)]

    points = values_at(tight, setup.parts.unit(setup.samples, setup.seed))[:, None, :]
    outputs = evaluator.outputs(points, [DRAWN])
    plain = Findings(setup, evaluator, tuple(found), points=points, outputs=outputs)
    return _with_shares(plain, *_judge_samples(setup, outputs))


def _tolerance_lines(setup: Setup, answer: ToleranceFactors) -> Iterator[IndexLine]:
    """Yield what each tolerance may be, in its own unit: a standard deviation, or the half width of a range."""
    for k, one in enumerate(setup.parameters):
        spread = one.spread
        stated_width = spread.deviation if spread.kind == "normal" else 0.5 * (spread.high - spread.low)
        for name in ("alone", "together", "allocated"):
            width = float(getattr(answer, name)[k]) * stated_width
            value = reported(float(to_border(width, one.dimension)), "ratio")
            unit = border_unit(one.dimension)
            yield IndexLine("yield", one.path, f"tolerance_{name}", value, None, None, unit, ESTIMATED)


def _judge_samples(setup: Setup, outputs: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which samples meet which requirement (b, s, r), and of which that is not known (b, s)."""
    met = outputs[..., len(setup.study.metrics) :]
    return np.asarray(~np.isnan(met) & (met > 0.5)), np.asarray(np.isnan(met).any(axis=-1))


def _with_shares(found: Findings, met: NDArray[np.bool_], failed: NDArray[np.bool_]) -> Findings:
    """Return findings with the shares of parts, as drawn, that meet all requirements and each of them."""
    each = tuple(Share.of(met[:, 0, k], failed[:, 0]) for k in range(met.shape[-1]))
    return replace(found, all_met=Share.of(np.asarray(met[:, 0].all(axis=-1)), failed[:, 0]), each_met=each)


def _with_yield(found: Findings, names: tuple[str, ...]) -> Findings:
    """Return findings with the yield, and what it gains from tighter tolerances."""
    setup, outputs = found.setup, found.outputs
    if outputs is None:
        return found
    met, failed = _judge_samples(setup, outputs)
    gains = monte_carlo_yield.yield_gains(np.asarray(met.all(axis=-1)), failed)
    lines = (*lines_of(YIELD, names, (gains,), len(outputs)), *found.lines)
    return replace(_with_shares(found, met, failed), lines=lines)


METHODS: dict[str, Callable[[Setup, Evaluator], Findings]] = {
    "oat": _oat,
    "local": _local,
    "morris": _morris,
    "sobol": _sobol,
    "tolerance": _tolerance,
    "inverse": _inverse,
}

__all__ = ["DRAWN", "METHODS", "carry_out"]

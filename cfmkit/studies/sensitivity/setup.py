"""Task of a sensitivity study: read off a specification, checked before anything is computed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import Problem, SolutionError, SpecError, UsageError
from cfmkit.families import family
from cfmkit.metrics.requirements import Bounds
from cfmkit.numerics.unit_cube_samples import SAMPLE_KINDS
from cfmkit.results import Finding
from cfmkit.specs.sensitivity_methods import METHOD_NAMES
from cfmkit.specs.units import TravelShare, border_unit, format_short, to_border
from cfmkit.studies.delivered_design import run_design
from cfmkit.studies.parts.parts import Parts
from cfmkit.studies.parts.uncertain_values import together
from cfmkit.studies.plan import MOST_POINTS, refuse_too_many
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.sensitivity.method import method_named
from cfmkit.studies.variants_in_rows import evaluate_result
from cfmkit.studies.variations import length_to_vary

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.metrics import Outcome
    from cfmkit.results import Quantity, Result
    from cfmkit.specs.spec import Requirement, Spec
    from cfmkit.specs.study_spec import Sensitivity
    from cfmkit.specs.units import Ends
    from cfmkit.studies.parts.uncertain_values import Parameter
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.sensitivity.method import Method

NOTHING_TO_VARY = (
    "nothing to vary: add a block 'sensitivity: {parameters: {...}}' to the spec, "
    "or give --vary '{path}=normal:0.05 mm'"
)


@dataclass(frozen=True)
class Nominal:
    """The specification itself: its result, and its requirements."""

    result: Result
    outcomes: tuple[Outcome, ...]
    values: FloatArray


@dataclass(frozen=True)
class Setup:
    """Everything that a sensitivity study needs."""

    block: Sensitivity  # what was requested
    parts: Parts  # what varies, how many samples are drawn and from where
    study: Study  # what is noted at each sample
    nominal: Nominal  # what comes out without any deviation
    together: tuple[tuple[int, ...], ...]  # parameters whose tolerances are tightened together
    warnings: tuple[Finding, ...] = ()  # what the user must know

    @property
    def method(self) -> str:
        """Name of the method by which the indices or tolerances are computed."""
        return self.block.method

    @property
    def record(self) -> Method:
        """That method."""
        return method_named(self.block.method)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The values that vary."""
        return self.parts.parameters

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.parts.samples

    @property
    def seed(self) -> int:
        """Seed of the samples."""
        return self.parts.seed

    @property
    def sampling(self) -> str:
        """Way to draw samples: one of `SAMPLE_KINDS`, ``random``, or nothing of a method with points of its own."""
        return self.block.sampling or METHOD_NAMES[self.block.method].sampling

    @property
    def paths(self) -> tuple[str, ...]:
        """Of the parameters."""
        return self.parts.paths

    @property
    def values(self) -> FloatArray:
        """Nominal values of the parameters, (d,)."""
        return self.parts.nominal

    @property
    def ends(self) -> FloatArray:
        """Ranges of the parameters, (d, 2)."""
        return np.array([parameter.spread.ends for parameter in self.parameters])

    def limits(self, metric: Metric) -> tuple[Bounds, ...]:
        """Return the requirements on a metric over its window, as bounds."""
        mine = [
            requirement
            for requirement in self.study.spec.part_requirements
            if _metric_and_window(requirement) == (metric.name, metric.over)
        ]
        return tuple(Bounds.from_requirement(requirement, metric.dimension) for requirement in mine)


def prepare(
    spec: Spec,  # with a block `sensitivity`
    seed: int | None = None,  # takes precedence over the one of the specification
    most: int = MOST_POINTS,  # samples that are allowed
) -> Setup:
    """Return what a study of a specification has to do.

    Raises UsageError if there is nothing to vary, too much, or a metric that does not exist; SpecError if a path or
    value is wrong; SolutionError if the specification itself has no solution.
    """
    block = spec.sensitivity
    if block is None:
        raise UsageError(NOTHING_TO_VARY.replace("{path}", length_to_vary(spec)[0]))
    chosen = seed if seed is not None else block.seed or 0
    samples = block.samples or METHOD_NAMES[block.method].default_samples
    parts = Parts.from_block(spec, block, samples, chosen)
    parameters, paths = parts.parameters, parts.paths
    _check_method(spec, block, parameters)
    groups = together(block, paths)
    method = method_named(block.method)
    refuse_too_many(method.count_points(samples, len(paths), len(groups)), most)
    study = Study(spec, paths, (), block.design, seed=chosen, make_design=run_design, manufactured=method.draws_parts)
    result = _solve_nominal(study)
    study = replace(study, metrics=_metrics(spec, block, result.curves[0] if result.curves else None))
    study, nominal, unvalued = _with_nominal(study, result)
    warnings = (*unvalued, *_list_cautions(spec, block, parameters, samples))
    return Setup(block, parts, study, nominal, groups, warnings)


def _check_method(spec: Spec, block: Sensitivity, parameters: tuple[Parameter, ...]) -> None:
    """Raise if method and parameters do not go together."""
    if block.method == "inverse" and not spec.part_requirements:
        lacking = "finds the tolerances that keep a yield: give 'requirements' that a part meets or misses"
        raise SpecError([Problem("", 0, 0, "sensitivity.method", lacking)])
    unknown = [path for path in block.costs if path not in {parameter.path for parameter in parameters}]
    if unknown:
        paths = ", ".join(parameter.path for parameter in parameters)
        missing = f"no such parameter; there are {paths}"
        raise SpecError([Problem("", 0, 0, f"sensitivity.costs.{path}", missing) for path in unknown])
    outside = [
        parameter
        for parameter in parameters
        if not parameter.spread.low <= parameter.spread.nominal <= parameter.spread.high
    ]
    if method_named(block.method).draws_parts and outside:
        reported = "the nominal value is outside the range; tolerances are tightened towards it"
        raise SpecError(
            [Problem("", 0, 0, f"sensitivity.parameters.{parameter.path}", reported) for parameter in outside]
        )


def _metric_and_window(requirement: Requirement) -> tuple[str, Ends | None]:
    return requirement.metric, requirement.over


def _metrics(spec: Spec, block: Sensitivity, sample: Curve | None) -> tuple[Metric, ...]:
    """Return the metrics that are requested; else those of the requirements, over their windows; else all."""
    if block.metrics or not spec.part_requirements:
        return _numeric(metrics_of(spec, block.metrics, sample), block)
    wanted = dict.fromkeys(map(_metric_and_window, spec.part_requirements))
    plain = {metric.name: metric for metric in metrics_of(spec, [name for name, _ in wanted], sample)}
    motion = sample.motion_dimension if sample is not None else "length"
    labels = {
        name_and_window: _label_metric(plain[name_and_window[0]].label, name_and_window[1], motion)
        for name_and_window in wanted
    }
    return tuple(
        replace(plain[name_and_window[0]], over=name_and_window[1], label=labels[name_and_window])
        for name_and_window in wanted
    )


def _numeric(metrics: tuple[Metric, ...], block: Sensitivity) -> tuple[Metric, ...]:
    """Return the metrics that are numbers: of a word there is no derivative and no variance."""
    words = [metric.name for metric in metrics if metric.words]
    if words and block.metrics:
        reported = f"{words[0]!r} is a word, and a sensitivity is about numbers; name another metric"
        raise SpecError([Problem("", 0, 0, "sensitivity.metrics", reported)])
    return tuple(metric for metric in metrics if not metric.words)


def _label_metric(name: str, over: Ends | None, motion: str) -> str:
    if over is None:
        return name
    if any(isinstance(end, TravelShare) for end in over):
        low, high = (format_short(end, getattr(end, "dimension", motion), 6) for end in over)
        return f"{name} over {low} ... {high}"
    low, high = (f"{float(to_border(end, motion)):.6g}" for end in over)
    return f"{name} over {low} ... {high} {border_unit(motion)}"


def _solve_nominal(study: Study) -> Result:
    """Return the result without any deviation."""
    result = study.solve(study.spec)
    if not result.status.usable:
        reported = "the specification itself has no solution, so deviations from it cannot be studied"
        raise SolutionError(f"{reported}: {result.message}")
    return result


def _with_nominal(study: Study, result: Result) -> tuple[Study, Nominal, tuple[Finding, ...]]:
    """Return the study of those metrics that have a value, and the result without deviations as it sees it."""
    rows = evaluate_result(study, result)
    valued = np.flatnonzero(np.isfinite(rows.values[0])).tolist()
    reported = {metric.label: item.reason or "there is none" for metric, item in _valueless(study, result)}
    if not valued:
        reasons = "; ".join(dict.fromkeys(rows.status(0)[1] or reason for reason in reported.values()))
        raise SolutionError(f"none of the metrics has a value for the specification itself: {reasons}")
    without = tuple(
        Finding("no_value", f"{label} has no value for the specification itself ({reason}): left out")
        for label, reason in reported.items()
    )
    kept = replace(study, metrics=tuple(study.metrics[k] for k in valued))
    return kept, Nominal(result, family(study.spec.family).check(result), rows.values[0, valued]), without


def _valueless(study: Study, result: Result) -> Iterator[tuple[Metric, Quantity]]:
    """Yield the metrics without a value, with what is known instead."""
    for metric, item in zip(study.metrics, study.quantities(result), strict=True):
        if item.value is None or not isfinite(item.value):
            yield metric, item


def _list_cautions(
    spec: Spec, block: Sensitivity, parameters: tuple[Parameter, ...], samples: int
) -> Iterator[Finding]:
    if block.correlated and not method_named(block.method).draws_parts:
        reported = f"{block.method} varies every parameter by itself: 'correlated' is for the method tolerance"
        yield Finding("correlation_not_used", reported)
    kind = SAMPLE_KINDS.get(block.sampling or METHOD_NAMES[block.method].sampling)
    if kind and kind.is_balanced_at_powers_of_two and samples & (samples - 1):
        yield Finding("unbalanced", f"{samples} is not a power of two: Sobol sequences are balanced at 64, 128, 256")
    if method_named(block.method).draws_parts and not spec.part_requirements:
        yield Finding("no_requirements", "without requirements there is no yield, only distributions")
    yield from _warn_of_derived_values(spec, parameters)


def _warn_of_derived_values(spec: Spec, parameters: tuple[Parameter, ...]) -> Iterator[Finding]:
    """Yield what is derived from a parameter: not a deviation of one made part, but another part each time."""
    resolve = family(spec.family).resolve
    base = dict(resolve(spec).leaves())
    for parameter in parameters:
        low, high = parameter.spread.ends
        try:
            moved = dict(resolve(spec.replace({parameter.path: low + 0.75 * (high - low)})).leaves())
        except SpecError:
            continue
        follow = [path for path, value in moved.items() if path != parameter.path and base.get(path) != value]
        if follow:
            reported = (
                f"{', '.join(follow)} follow {parameter.path}: every sample is another part, made for its own value"
            )
            yield Finding("derived_part", f"{reported}; `cfmkit design` writes a design.yaml in which they are fixed")

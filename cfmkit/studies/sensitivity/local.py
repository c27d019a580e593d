"""Gradients at the nominal point: differences over steps that are halved, extrapolated, with an error estimate.

Ridders' scheme [R]: the differences over h, h/2, h/4, ... are extrapolated to h = 0, and of all the values so found the
one is taken that differs least from its neighbours. That is the step control: large steps suffer from curvature, small
ones from rounding, and the difference that is left is the error estimate. Where one side has no values (a friction
cannot be negative), differences of the other side are extrapolated.

Reference
---------
[R] C. J. F. Ridders, Adv. Eng. Softw. 4 (1982) 75.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families import family
from cfmkit.specs.units import border_unit, to_border
from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.oat import SLOPE_INDEX
from cfmkit.studies.sensitivity.result_types import Findings, IndexLine
from cfmkit.studies.sensitivity.result_types import to_stated_value as reported

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.parts.uncertain_values import Parameter
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup

N_STEP_LEVELS = 7  # how often a step is halved, and one
FIRST_STEP = 0.5  # the largest step, in half widths of the parameter's range


@dataclass(frozen=True)
class Slope:
    """A derivative and how far it may be off; NaN where it cannot be stated."""

    value: float
    error: float


UNKNOWN_SLOPE = Slope(float("nan"), float("nan"))


def steps() -> FloatArray:
    """Return the steps, largest first, in half widths of a range."""
    return np.asarray(FIRST_STEP * 0.5 ** np.arange(N_STEP_LEVELS), dtype=np.float64)


def sample(
    # nominal, half_widths: (d,): values of the parameters, and the scale of their steps
    nominal: FloatArray,
    half_widths: FloatArray,
) -> FloatArray:
    """Return points, (parameters, 2, levels, parameters): one parameter a step up, then down."""
    count = len(nominal)
    points = np.broadcast_to(nominal, (count, 2, N_STEP_LEVELS, count)).copy()
    for k in range(count):
        points[k, 0, :, k] += half_widths[k] * steps()
        points[k, 1, :, k] -= half_widths[k] * steps()
    return points


def slope(
    # up, down: (levels,): the output a step above and below the nominal point; NaN where it failed
    up: FloatArray,
    down: FloatArray,
    at_nominal: float,  # the output there
    half_width: float,  # the scale of the steps
) -> Slope:
    """Return the derivative of one output by one parameter."""
    size = half_width * steps()
    both = ~(np.isnan(up) | np.isnan(down))
    scale = float(np.nanmax(np.abs([*up, *down, at_nominal]))) if both.any() or np.isfinite(at_nominal) else 0.0
    noise = 4.0 * np.finfo(np.float64).eps * scale / size
    if both.sum() >= 2:
        return _extrapolate(((up - down) / (2.0 * size))[both], noise[both], 4.0)
    for side, sign in ((up, 1.0), (down, -1.0)):
        is_known = ~np.isnan(side)
        if is_known.sum() >= 2 and np.isfinite(at_nominal):
            return _extrapolate((sign * (side - at_nominal) / size)[is_known], noise[is_known], 2.0)
    return UNKNOWN_SLOPE


def _extrapolate(differences: FloatArray, noise: FloatArray, factor: float) -> Slope:
    """Return Ridders' value: `factor` is by how much halving the step reduces the leading error."""
    best = UNKNOWN_SLOPE
    row = list(differences[:1])
    for level in range(1, len(differences)):
        before, row = row, [float(differences[level])]
        for order in range(1, level + 1):
            power = factor**order
            row.append((power * row[-1] - before[order - 1]) / (power - 1.0))
            error = max(abs(row[-1] - row[-2]), abs(row[-1] - before[order - 1]), float(noise[level]))
            if not error >= best.error:
                best = Slope(float(row[-1]), error)
    return best


def normalise(derivative: float, nominal: float, at_nominal: float) -> float:
    """Return the relative change of the output for a relative change of the parameter; NaN about zero."""
    return derivative * nominal / at_nominal if nominal and at_nominal else float("nan")


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """Return the gradients: those that the family knows, else by differences."""
    half = (setup.ends[:, 1] - setup.ends[:, 0]) / 2.0
    points = sample(setup.values, half)
    count = len(half)
    exact = _known_derivatives(setup)
    width = len(setup.study.metrics) + len(setup.study.spec.part_requirements)
    outputs = np.full((count, 2, N_STEP_LEVELS, width), np.nan)
    if not _all_known(setup, exact):
        sides = [side for side in ("up", "down") for _ in range(N_STEP_LEVELS)]
        roles = [[f"{path} {side}" for side in sides] for path in setup.paths]
        outputs = evaluator.outputs(points.reshape(count, -1, count), roles).reshape(outputs.shape)
    index_lines: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        nominal = float(setup.nominal.values[m])
        for k, parameter in enumerate(setup.parameters):
            exact_slope = exact.get(metric.name, {}).get(parameter.path) if metric.over is None else None
            if exact_slope is not None:
                derivative = Slope(exact_slope, 0.0)
            else:
                derivative = slope(outputs[k, 0, :, m], outputs[k, 1, :, m], nominal, float(half[k]))
            index_lines += _gradient_lines(metric, parameter, derivative, nominal)
    return Findings(setup, evaluator, tuple(index_lines), points=points, outputs=outputs)


def _known_derivatives(setup: Setup) -> Mapping[str, Mapping[str, float]]:
    """Return the derivatives that the family knows in closed form: metric -> path -> SI value."""
    gradient = family(setup.study.spec.family).gradient
    if gradient is None or setup.study.design:
        return {}
    gradients: Mapping[str, Mapping[str, float]] = gradient(setup.study.spec, setup.paths)
    return gradients


def _all_known(setup: Setup, exact: Mapping[str, Mapping[str, float]]) -> bool:
    wanted = ((metric, path) for metric in setup.study.metrics for path in setup.paths)
    return all(metric.over is None and path in exact.get(metric.name, {}) for metric, path in wanted)


def _gradient_lines(metric: Metric, parameter: Parameter, slope: Slope, at_nominal: float) -> Iterator[IndexLine]:
    above, below = border_unit(metric.dimension), border_unit(parameter.dimension)
    scale = float(to_border(1.0, metric.dimension)) / float(to_border(1.0, parameter.dimension))
    unit = above if below == "1" else f"{above}/{below}" if below.isalpha() else f"{above}/({below})"
    value, low, high = (reported(end * scale, "ratio") for end in _value_and_ends(slope.value, slope.error))
    yield IndexLine(metric.label, parameter.path, "gradient", value, low, high, unit, N_STEP_LEVELS)
    relative = normalise(1.0, parameter.spread.nominal, at_nominal)
    value, low, high = (
        reported(end, "ratio") for end in _value_and_ends(slope.value * relative, slope.error * abs(relative))
    )
    yield IndexLine(metric.label, parameter.path, SLOPE_INDEX, value, low, high, "1", N_STEP_LEVELS)


def _value_and_ends(value: float, reach: float) -> tuple[float, float, float]:
    return value, value - reach, value + reach


SENSITIVITY_METHOD = Method(
    run, lambda _, parameters, __: 2 * N_STEP_LEVELS * parameters, (SLOPE_INDEX, "gradient"), {"": "draw_bars"}
)

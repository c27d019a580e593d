"""Values of a specification fitted to a measured curve, with what the data cannot determine.

The specification is resolved first: the built part keeps its shape while the values
around it are fitted. Parameters that the data do not determine are named and nothing
is fitted; those that they determine badly are fitted and named as such.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError, SolutionError, UsageError
from cfmkit.experiment.comparison import Comparison, Samples, Zeros, compare, model_at
from cfmkit.experiment.parameters_to_fit import DATA_PREFIX, ZERO_OFFSETS
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.metrics import Window
from cfmkit.numerics.least_squares import (
    FittedValues,
    LeastSquares,
    Loss,
    NotFinite,
    evaluate_start,
    lack_of_fit,
    solve,
    unidentifiable,
)
from cfmkit.results import Finding
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.experiment.parameters_to_fit import FitParameter
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

POORLY_DETERMINED = 0.3
"""Parameters whose half interval exceeds this part of their size are reported as poorly determined."""
BY_CHANCE = 1e-3  # residuals are not random where chance makes their means as large less often than that
NEGLIGIBLE_SWING = 0.2
"""Swings of the residuals that are smaller than this part of their noise are left alone, however certain."""
MAX_HALF_INTERVAL = 1.0  # parameters whose half interval exceeds this part of their size cannot be determined
ALIKE_RTOL = 1e-7  # branches of a model that differ by less than this part of the force are one: it has no losses
TIED_CORRELATION = 0.999  # parameters more correlated than this are reported as poorly distinguished
UNDETERMINED_MESSAGE = "cannot be determined from this recording"
CALIBRATION_FINDINGS = {
    "weakly_identified": "the data determine a fitted value poorly",
    "at_bound": "a fitted value is at its bound: the data require a value beyond",
    "lack_of_fit": "the residuals are not random: the model does not describe the measurement",
    "not_converged": "the fit stopped before it converged",
}


@dataclass(frozen=True, repr=False)
class Calibration:
    """A fitted specification."""

    spec: Spec  # with the fitted values, complete
    parameters: tuple[FitParameter, ...]  # what was fitted
    fit: FittedValues  # values and their uncertainty, in the order of the parameters
    # before, after: model and measurement at the start and at the end; the latter less the fitted zeros
    before: Comparison
    after: Comparison
    result: Result  # of the fitted specification
    zeros: Zeros = field(default_factory=Zeros)  # of the recording, as fitted
    warnings: tuple[Finding, ...] = ()  # what the user must know about the fit

    def __repr__(self) -> str:
        """Return the fitted values [SI] with their 95 % intervals, and the names of the warnings."""
        pairs = zip(self.parameters, self.fit.values, self.fit.half_widths(), strict=True)
        fitted = ", ".join(f"{item.path} = {value:.6g} ± {width:.2g}" for item, value, width in pairs)
        names = ", ".join(dict.fromkeys(item.name for item in self.warnings)) or "none"
        return f"<Calibration of {self.spec.name!r}: {fitted} (SI, 95 %); warnings: {names}>"


class ModelCurves:
    """Curves of a specification with some of its values changed; each is solved once."""

    def __init__(self, spec: Spec, as_made: bool = False) -> None:
        """Keep the specification to be changed; `as_made`: see `Spec.replace`."""
        self.spec = spec
        self.as_made = as_made
        self._solved: dict[tuple[tuple[str, float], ...], Curve] = {}

    def spec_with(self, parameters: Sequence[FitParameter], values: FloatArray) -> Spec:
        """Return the specification with the values of parameters; zeros of the recording change nothing in it.

        Raises SpecError if they are not valid together.
        """
        changes = self._spec_changes(parameters, values)
        return self.spec.replace(changes, self.as_made) if changes else self.spec

    def solve_at(self, parameters: Sequence[FitParameter], values: FloatArray) -> Curve:
        """Return the curve of that specification.

        Raises CfmError if there is none.
        """
        key = tuple(sorted(self._spec_changes(parameters, values).items()))
        if key not in self._solved:
            self._solved[key] = analyze_part(self.spec_with(parameters, values)).curve
        return self._solved[key]

    def _spec_changes(self, parameters: Sequence[FitParameter], values: FloatArray) -> dict[str, float]:
        changes: dict[str, float] = {}
        for item, value in zip(parameters, values, strict=True):
            if not item.path.startswith(DATA_PREFIX):
                changes |= item.changes(self.spec, float(value))
        return changes


def calibrate(
    spec: Spec,
    source: MeasuredCurves,
    parameters: Sequence[FitParameter],
    loss: Loss = "soft_l1",
    window: Window | None = None,
) -> Calibration:
    """Return a specification whose model fits a measured curve.

    Parameters
    ----------
    spec : Spec
        Resolved; its values are the start.
    source : MeasuredCurves
        What was measured.
    parameters : sequence of FitParameter
        What to fit.
    loss : {"linear", "soft_l1", "huber", "cauchy"}
        Robust ones give outliers less weight.
    window : Window, optional
        Default: ``analysis.window``, where model and measurement exist.

    Raises
    ------
    cfmkit.errors.SolutionError
        If the start has no solution, or the data do not determine the parameters, which are named.
    """
    before, curves = _compare_start(spec, source, parameters, window), ModelCurves(spec)
    if has_no_loss(curves, before, parameters):
        before = before.compare_mean()
    return fit_samples(before, curves, parameters, loss)


def fit_samples(
    before: Comparison,  # the samples beside the start
    curves: ModelCurves,  # of the specification that is fitted
    # parameters, loss: as for `calibrate`
    parameters: Sequence[FitParameter],
    loss: Loss = "soft_l1",
    tolerance: float = LeastSquares.tolerance,  # relative change of values at which the search ends
) -> Calibration:
    """Return a specification whose model fits measured samples.

    Raises SolutionError if the data do not determine the parameters, which are named.
    """
    problem = replace(_least_squares_problem(curves, before, parameters), tolerance=tolerance)
    _require_determined(problem, problem.start, parameters)
    fit = solve(problem, loss) if parameters else evaluate_start(problem)
    _require_determined(problem, fit.values, parameters)
    fitted = curves.spec_with(parameters, fit.values)
    result = analyze_part(fitted)
    zeros = _zeros_of(parameters, fit.values)
    samples, branches = (
        tuple(item.correct_zeros(zeros) for item in measured) for measured in (before.samples, before.branches)
    )
    after = Comparison(samples, before.window, result.curve, before.holes, branches)
    warnings = (*_fit_warnings(parameters, fit), *_misfit_warnings(parameters, fit, after))
    return Calibration(fitted, tuple(parameters), fit, before, after, result, zeros, warnings)


def _compare_start(
    spec: Spec, source: MeasuredCurves, parameters: Sequence[FitParameter], window: Window | None
) -> Comparison:
    """Return the start beside the measurement, where the model exists for every zero that is tried."""
    result = analyze_part(spec)
    comparison = compare(result, source, window)
    shift = next((item for item in parameters if _is_motion_offset(item)), None)
    if shift is None:
        return comparison
    parts = [comparison.curve.select_branch(item.model_branch).motion for item in comparison.samples]
    low = max(comparison.window.lo, max(float(part.min()) for part in parts) + shift.high)
    high = min(comparison.window.hi, min(float(part.max()) for part in parts) + shift.low)
    if not low < high:
        raise UsageError(
            f"--bounds: within the bounds of {shift.path} there is no travel that the model covers for every value"
        )
    return compare(result, source, Window(low, high))


def has_no_loss(curves: ModelCurves, before: Comparison, parameters: Sequence[FitParameter]) -> bool:
    """Return whether the model has one force at each place where the measurement has two, whatever is fitted.

    Then the branches say together where the model must be, which is between them, and their gap what it leaves out.
    """
    if before.loop is None:
        return False
    branches = {item.model_branch for item in before.samples}
    if len(branches) == 1:
        return True
    trials = (curves.solve_at([item], np.array([item.start + _small_change(item)])) for item in parameters)
    places = np.linspace(before.window.lo, before.window.hi, 65)[1:-1]
    for curve in (before.curve, *trials):
        up, down = (model_at(curve, branch, places) for branch in sorted(branches))
        if not np.nanmax(np.abs(up - down)) <= ALIKE_RTOL * np.nanmax(np.abs(up)):
            return False
    return True


def _small_change(item: FitParameter) -> float:
    """Return a small change of a parameter inside its bounds."""
    step = 1e-3 * item.size
    return step if item.start + step <= item.high else -min(step, item.start - item.low)


def _is_motion_offset(item: FitParameter) -> bool:
    return item.path in (f"{DATA_PREFIX}displacement_offset", f"{DATA_PREFIX}angle_offset")


def _zeros_of(parameters: Sequence[FitParameter], values: FloatArray) -> Zeros:
    """Return what the parameters say of the recording."""
    totals = {"effort": 0.0, "motion": 0.0, "drift": 0.0}
    for item, value in zip(parameters, values, strict=True):
        if item.path.startswith(DATA_PREFIX):
            name = "motion" if _is_motion_offset(item) else "drift" if item.path.endswith("drift") else "effort"
            totals[name] = float(value)
    return Zeros(**totals)


def analyze_part(spec: Spec) -> Result:
    """Return the result of a part.

    Raises SolutionError if it has no curve.
    """
    result: Result = family(spec.family).analyze(spec, Run())
    if not result.curves:
        raise SolutionError(f"there is no curve to compare with: {result.message}")
    return result


def _least_squares_problem(curves: ModelCurves, before: Comparison, parameters: Sequence[FitParameter]) -> LeastSquares:
    columns = np.array([(item.start, item.low, item.high, item.size) for item in parameters]).reshape(-1, 4).T
    level = float(np.abs(np.concatenate([item.effort for item in before.samples])).max())
    weight = np.concatenate([item.weight for item in before.samples])
    nothing, root = np.full(len(weight), np.nan), np.sqrt(weight)

    def residuals(values: FloatArray) -> FloatArray:
        try:
            curve = curves.solve_at(parameters, values)
        except CfmError:
            return nothing  # the solver then takes a shorter step
        zeros = _zeros_of(parameters, values)
        errors: FloatArray = root * np.concatenate([item.correct_zeros(zeros).errors(curve) for item in before.samples])
        return errors

    effect = float(np.mean(weight**2) / np.mean(weight) ** 2)
    return LeastSquares(residuals, columns[0], columns[1], columns[2], columns[3], level, effect)


def scaled_jacobian(curves: ModelCurves, before: Comparison, parameters: Sequence[FitParameter]) -> FloatArray:
    """Return the derivatives of the errors at the start by the parameters in their sizes, (n, p) [N or N m].

    Raises SolutionError if the model has no value at some of the samples.
    """
    problem = _least_squares_problem(curves, before, parameters)
    if not np.isfinite(problem.residuals(problem.start)).all():
        raise SolutionError("the model has no equilibrium at some of the measured points")
    return problem.jacobian(problem.start)


def _require_determined(problem: LeastSquares, values: FloatArray, parameters: Sequence[FitParameter]) -> None:
    """Raise if the data do not determine the parameters at some values."""
    try:
        groups = unidentifiable(problem, values)
    except NotFinite:
        raise SolutionError(
            "the model has no equilibrium at some of the measured points; narrow the window (analysis.window), or "
            "start from other values"
        ) from None
    if groups:
        raise SolutionError("; ".join(_name_undetermined([parameters[k].label for k in group]) for group in groups))


def _name_undetermined(paths: Sequence[str]) -> str:
    if len(paths) == 1:
        return f"the measured curve does not determine {paths[0]}: changing it changes no force; leave it out of --fit"
    reported = f"{', '.join(paths[:-1])} and {paths[-1]}"
    return f"the measured curve cannot distinguish {reported}: one compensates for the other; fit only one of them"


def _fit_warnings(parameters: Sequence[FitParameter], fit: FittedValues) -> list[Finding]:
    """Return what is doubtful about a fit."""
    warnings, half = [], fit.half_widths()
    for k, item in enumerate(parameters):
        if fit.at_bound[k]:
            warnings.append(Finding("at_bound", f"{item.label} is at its bound: the data require a value beyond"))
        elif half[k] > MAX_HALF_INTERVAL * item.size:
            warnings.append(
                Finding(
                    "weakly_identified", f"{item.label} {UNDETERMINED_MESSAGE}: fit fewer values, or give it with --set"
                )
            )
        elif half[k] > POORLY_DETERMINED * item.size:
            warnings.append(
                Finding(
                    "weakly_identified",
                    f"{item.label} cannot be determined from this recording (± {100 * half[k] / item.size:.0f} %)",
                )
            )
        for earlier in range(k):
            if abs(fit.correlation[k, earlier]) > TIED_CORRELATION:
                reported = f"{parameters[earlier].label} and {item.label} are poorly distinguished"
                warnings.append(
                    Finding("weakly_identified", f"{reported} (correlation {fit.correlation[k, earlier]:.5f})")
                )
    if not fit.converged:
        warnings.append(Finding("not_converged", "the fit stopped before it converged; start from other values"))
    return warnings


def _misfit_warnings(parameters: Sequence[FitParameter], fit: FittedValues, after: Comparison) -> list[Finding]:
    """Return whether the residuals are random; a value on its bound explains by itself why not."""
    if fit.at_bound.any() or not len(fit.residuals):
        return []
    ordered = [item.errors(after.curve)[np.argsort(item.motion, kind="stable")] for item in after.samples]
    lack = lack_of_fit(ordered, len(parameters))
    level = float(np.abs(np.concatenate([item.effort for item in after.samples])).max())
    if lack.chance > BY_CHANCE or lack.swing < max(NEGLIGIBLE_SWING * lack.noise, 1e-5 * level):
        return []
    kind = after.curve.kind
    swing, noise = (format_short(value, kind, 3) for value in (lack.swing, lack.noise))
    fitted = {item.path for item in parameters}
    unfitted = ", ".join(path for path in (DATA_PREFIX + name for name in ZERO_OFFSETS[kind]) if path not in fitted)
    cure = (
        f"zeros of the recording can be fitted, too: {unfitted}" if unfitted else "another value or the model is wrong"
    )
    return [
        Finding(
            "lack_of_fit",
            f"systematic residual {swing} (rms) along the travel, noise {noise}: what was fitted does not describe "
            f"the measurement, and the intervals hold only where it does; {cure}",
        )
    ]


def table(calibration: Calibration) -> list[dict[str, Any]]:
    """Return one record per parameter in border units: value, 95 % interval, standard deviation, start."""
    from cfmkit.specs.units import border_unit, to_border

    half, spread = calibration.fit.half_widths(), calibration.fit.deviations
    records = []
    for k, item in enumerate(calibration.parameters):
        value = float(calibration.fit.values[k])
        numbers = {
            "value": value, "low_95": max(value - float(half[k]), item.low),
            "high_95": min(value + float(half[k]), item.high),
            "standard_deviation": float(spread[k]), "start": item.start,
        }  # fmt: skip
        shown = {name: float(to_border(number, item.dimension)) for name, number in numbers.items()}
        records.append({"path": item.label, "unit": border_unit(item.dimension)} | shown)
    return records


__all__ = [
    "CALIBRATION_FINDINGS",
    "MAX_HALF_INTERVAL",
    "POORLY_DETERMINED",
    "UNDETERMINED_MESSAGE",
    "Calibration",
    "ModelCurves",
    "Samples",
    "analyze_part",
    "calibrate",
    "fit_samples",
    "has_no_loss",
    "scaled_jacobian",
    "table",
]  # fmt: skip

"""Errors with which a part was made (modulus, thickness, friction, rates), fitted to its recording and compared.

Candidates are what errs in a part of that family: the moduli of its materials, one error of thickness all over the
part, one coefficient of friction, and the rates of springs. All sets of them are fitted, with the zero of the force,
the smaller sets first. They are compared by Schwarz's criterion, n ln(S / n) + k ln n, for n independent residuals with
the sum of squares S and k fitted values; errors larger than usual of material and process add their squares over the
usual ones. Sets within `STRONG_EVIDENCE` of the best one explain the recording as well: the
recording cannot tell them apart, and whoever corrects the part must allow for each.

Reference
---------
R. E. Kass, A. E. Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: a difference of 10 is very strong evidence.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError, DataError, SolutionError
from cfmkit.experiment.calibration import (
    POORLY_DETERMINED,
    ModelCurves,
    analyze_part,
    fit_samples,
    has_no_loss,
    scaled_jacobian,
)
from cfmkit.experiment.comparison import compare
from cfmkit.experiment.parameters_to_fit import DATA_PREFIX, ZERO_OFFSETS, FitParameter, parameters
from cfmkit.families import family
from cfmkit.metrics import Window
from cfmkit.numerics.robust_statistics import robust_scale
from cfmkit.specs.units import format_short
from cfmkit.studies.parts.parts import assume_errors
from cfmkit.studies.variations import leaf

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.calibration import Calibration
    from cfmkit.experiment.comparison import Comparison
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.parts.parts import Assumed

STRONG_EVIDENCE = 10.0  # difference of Schwarz's criterion from which one explanation is preferred to another
MOST_ERRORS = 3  # errors that are fitted at once: a force curve has hardly more independent features
FORCE_RESOLUTION = 1e-4
"""Part of the largest force below which residuals say nothing: curves are linear between their points."""
LARGEST_FACTOR = 3.0  # of a modulus or a rate: farther off it is another material or another part
LARGEST_THICKNESS_ERROR = 0.25  # of the thinnest leaf: farther off it is another part
LARGEST_MISFIT = 0.1
"""Root mean square of the residuals of the best explanation, over the largest force: beyond it is another part."""
LARGEST_OVERTRAVEL = 1.25  # recorded travel over that of the mechanism: beyond it is another part
LARGEST_UNCERTAINTY_OF_ZERO = 0.01
"""Standard deviation of the zero of the force, over the largest force, beyond which it is not fitted: an unknown zero
is taken to be off by as much."""
USUAL_DEVIATION = 0.1  # standard deviation of a modulus or a rate of which nothing else is known, as a share of it
FIT_TOLERANCE = 1e-7  # relative change of values at which fits end: far below their intervals
LEAST_FRICTION = 1e-6  # where a model without friction is compared with a loop: with it the model has both branches


@dataclass(frozen=True)
class Explanation:
    """Errors of a part with which the model fits its recording."""

    calibration: Calibration
    criterion: float  # Schwarz's, smaller is better

    @cached_property
    def _error_indices(self) -> list[int]:
        return [k for k, item in enumerate(self.calibration.parameters) if not item.path.startswith(DATA_PREFIX)]

    @property
    def errors(self) -> tuple[FitParameter, ...]:
        """Fitted errors of the part, without the zeros of the recording."""
        return tuple(self.calibration.parameters[k] for k in self._error_indices)

    @property
    def values(self) -> FloatArray:
        """Fitted values of the errors, (n,) [SI]."""
        values: FloatArray = self.calibration.fit.values[self._error_indices]
        return values

    @property
    def covariance(self) -> FloatArray:
        """Covariance of these values, the zeros of the recording being unknown, too, (n, n) [SI]."""
        covariance: FloatArray = self.calibration.fit.covariance[np.ix_(self._error_indices, self._error_indices)]
        return covariance

    @property
    def quantile(self) -> float:
        """Standard deviations of half a 95 % interval, by Student's t."""
        from scipy.special import stdtrit

        return float(stdtrit(self.calibration.fit.freedom, 0.975))

    def part_of(self, drawn: Spec, values: FloatArray | None = None) -> Spec:
        """Return the part that is made of a drawing with these errors, or with other values of them.

        Raises SpecError if no such part can exist.
        """
        changes: dict[str, float] = {}
        for item, value in zip(self.errors, self.values if values is None else values, strict=True):
            changes |= item.changes(drawn, float(value))
        return drawn.replace(changes, as_made=True) if changes else drawn

    @property
    def sentences(self) -> Iterator[str]:
        """Each error in words, with its 95 % interval."""
        half = self.calibration.fit.half_widths()
        for k, value in zip(self._error_indices, self.values, strict=True):
            item = self.calibration.parameters[k]
            shown = value - item.start if is_thickness(item) else value
            stated = "than drawn" if is_thickness(item) else f"stated {item.format_value(item.start)}"
            yield f"{name_of(item)} {item.format_value(shown)} ± {item.format_value(float(half[k]), 2)}, {stated}"


def is_thickness(item: FitParameter) -> bool:
    """Return True if a parameter is one error of the thickness all over a part."""
    return bool(item.joint) and item.dimension == "length" and not item.by_factor


def name_of(item: FitParameter) -> str:
    """Return the name of what is off, for sentences: a material, a thickness, friction or a rate."""
    if is_thickness(item):
        return "thickness"
    where, _, last = item.path.removeprefix("mechanism.").rpartition(".")
    if last == "youngs_modulus":
        return "modulus"
    if item.by_factor:
        return f"rate of {where}.{last}"
    return last.replace("_", " ") if "_" in last else f"{last} of {where}"


def errors_that_can_be_told(spec: Spec) -> tuple[FitParameter, ...]:
    """Return the errors that are tried of a part: moduli, thickness, friction and rates, the likeliest first.

    Values that err together are one parameter: moduli of one size by a factor, all thicknesses by one amount, the
    rates of a list of springs by a factor.
    """
    kinds = dict(family(spec.family).errors(spec))
    groups: dict[tuple[str, float | str], list[str]] = {}
    for path, value in spec.leaves():
        if path.startswith("mechanism.") and path.endswith(".material.youngs_modulus"):
            groups.setdefault(("modulus", float(value)), []).append(path)
    for path, kind in kinds.items():
        if kind == "thickness":
            groups.setdefault((kind, ""), []).append(path)
        elif kind == "friction":
            groups.setdefault((kind, path), []).append(path)
        elif kind == "rate":
            stem, _, last = path.rpartition(".")
            groups.setdefault((kind, stem if last.isdecimal() else path), []).append(path)
    return tuple(_joint_parameter(spec, kind, tuple(paths)) for (kind, _), paths in groups.items())


def _joint_parameter(spec: Spec, kind: str, paths: tuple[str, ...]) -> FitParameter:
    first = paths[0]
    quantity = leaf(type(spec), first).quantity
    dimension = quantity.dimensions[0] if quantity else "ratio"
    start = float(spec.get_value(first))
    if kind in ("modulus", "rate"):
        ends = (start / LARGEST_FACTOR, start * LARGEST_FACTOR)
        return FitParameter(first, dimension, start, *ends, start, paths, by_factor=True)
    if kind == "friction":
        return FitParameter(first, dimension, start, 0.0, 0.5, max(start, 0.01), paths)
    most = LARGEST_THICKNESS_ERROR * _smallest_thickness(spec, paths)
    return FitParameter(first, dimension, start, start - most, start + most, 0.2 * most, paths)


def _smallest_thickness(spec: Spec, paths: tuple[str, ...]) -> float:
    """Return the smallest thickness of those at some paths, or beside them where they are errors from zero."""
    values = [float(spec.get_value(path)) for path in paths]
    if min(values) > 0.0:
        return min(values)
    beside = spec.get_value(paths[0].rpartition(".")[0] + ".thickness")
    return float(min(beside) if isinstance(beside, tuple) else beside)


def explain(
    spec: Spec,  # what was drawn, resolved
    source: MeasuredCurves,  # what was measured of the part
    # what errs, by the paths of `calibrate`; default: what the recording tells apart of `errors_that_can_be_told`
    fit: Sequence[str] | None = None,
    tared: bool = False,  # whether the zero of the force is known; else it is fitted
    report: Callable[[str], None] = lambda _: None,  # is called with a sentence on what is being fitted
) -> tuple[Explanation, ...]:
    """Return the errors with which the model fits a recording as well as with any others, the best first.

    One without errors is among them where the recording cannot be told from that of a perfect part.

    Raises DataError if the recording is not of such a part; SolutionError if the specification has no curve, or the
    recording determines nothing.
    """
    _check_travel(analyze_part(spec).curve.motion, source, spec)
    candidates = errors_that_can_be_told(spec) if fit is None else parameters(spec, fit, None, source.recording)
    spec, candidates = _give_friction(spec, candidates, source)
    curves, result = ModelCurves(spec, as_made=True), analyze_part(spec)
    ends = Window(float(result.curve.motion.min()), float(result.curve.motion.max()))
    before = compare(result, source, ends)
    if has_no_loss(curves, before, candidates):
        before = before.compare_mean()
        candidates = tuple(item for item in candidates if not item.path.endswith("friction"))
    if fit is not None:
        fits = [fit_samples(before, curves, candidates, "linear", FIT_TOLERANCE)]
    else:
        zeros = () if tared else _force_zero(spec, source, before)
        distinction = Distinction.estimate(curves, before, (*candidates, *zeros))
        fitted_zeros = zeros if distinction.separates_zero(zeros) else ()
        fits = list(_fit_sets(before, curves, candidates, fitted_zeros, distinction, report))
    if not fits:
        raise SolutionError("the recording determines neither modulus nor thickness nor friction of this part")
    explanations = _rank_explanations(fits, before, assume_errors(curves.spec))
    best = explanations[0]
    _check_best(best, before, source, float(np.median(np.abs(result.curve.effort[np.isfinite(result.curve.effort)]))))
    return tuple(_drop_supersets([item for item in explanations if item.criterion <= best.criterion + STRONG_EVIDENCE]))


def _check_travel(motion: FloatArray, source: MeasuredCurves, spec: Spec) -> None:
    """Raise if the recording goes over another travel than the mechanism's."""
    recorded, kind = source.recording.motion, source.recording.motion_dimension
    (low, high), travel = (float(motion.min()), float(motion.max())), float(np.ptp(motion))
    beyond = max(float(recorded.max()) - high, low - float(recorded.min()))
    inside = min(float(recorded.max()), high) - max(float(recorded.min()), low)
    if beyond <= (LARGEST_OVERTRAVEL - 1.0) * travel and inside >= 0.5 * travel:
        return
    ends = " to ".join(format_short(float(end), kind, 4) for end in (recorded.min(), recorded.max()))
    spanned = " to ".join(format_short(end, kind, 4) for end in (low, high))
    raise DataError(
        f"{source.recording.name}: goes over {ends}, {spec.name!r} over {spanned}: a recording of another part? Else "
        "set --zero or --units"
    )


def _give_friction(
    spec: Spec, candidates: tuple[FitParameter, ...], source: MeasuredCurves
) -> tuple[Spec, tuple[FitParameter, ...]]:
    """Return a specification whose model has both branches of a loop, where friction can give it two."""
    still = {item.path for item in candidates if item.path.endswith("friction") and item.start == 0.0}
    if not still or len(source.raw[0].branches) < 2:
        return spec, candidates
    return spec.replace(dict.fromkeys(still, LEAST_FRICTION)), tuple(
        replace(item, start=LEAST_FRICTION) if item.path in still else item for item in candidates
    )


def _force_zero(spec: Spec, source: MeasuredCurves, before: Comparison) -> tuple[FitParameter, ...]:
    """Return the zero of the force as a parameter."""
    return parameters(spec, [f"{DATA_PREFIX}{next(iter(ZERO_OFFSETS[before.curve.kind]))}"], None, source.recording)


@dataclass(frozen=True)
class Distinction:
    """Distinction of parameters by a recording, by linear estimate at the start."""

    parameters: tuple[FitParameter, ...]
    jacobian: FloatArray  # (n, p) derivatives of the residuals by the parameters in their sizes [N or N m]
    noise: float  # standard deviation of a residual [N or N m]
    level: float  # largest force or torque [N or N m]

    @classmethod
    def estimate(cls, curves: ModelCurves, before: Comparison, parameters: tuple[FitParameter, ...]) -> Distinction:
        """Return the distinction of parameters by the samples of a recording, beside the start.

        Raises SolutionError if the model has no value at some of the samples.
        """
        level = float(np.abs(np.concatenate([item.effort for item in before.samples])).max())
        noise = max(_neighbour_noise(before), FORCE_RESOLUTION * level)
        return cls(parameters, scaled_jacobian(curves, before, parameters), noise, level)

    def deviations(self, chosen: Sequence[FitParameter]) -> FloatArray:
        """Return the standard deviations of parameters that are fitted together, in their sizes, (m,)."""
        columns = self.jacobian[:, [self.parameters.index(item) for item in chosen]]
        _, singular, right = np.linalg.svd(columns, full_matrices=False)
        least = 1e-12 * float(singular.max(initial=0.0)) or 1e-300
        deviations: FloatArray = self.noise * np.sqrt((right.T**2 / np.maximum(singular, least) ** 2).sum(axis=1))
        return deviations

    def separates_zero(self, zeros: Sequence[FitParameter]) -> bool:
        """Return True if the recording separates the zero of the force from the errors of a part that act."""
        if not zeros:
            return False
        having = [item for item, column in zip(self.parameters, self.jacobian.T, strict=True) if column.any()]
        uncertain = float(self.deviations(having)[-1]) * zeros[0].size
        return uncertain <= LARGEST_UNCERTAINTY_OF_ZERO * self.level

    def separates(self, errors: Sequence[FitParameter], zeros: Sequence[FitParameter]) -> bool:
        """Return True if the recording determines each of some errors beside the others and the zeros."""
        deviations = self.deviations((*errors, *zeros))[: len(errors)]
        return bool((2.0 * deviations <= POORLY_DETERMINED).all())


def _neighbour_noise(before: Comparison) -> float:
    """Return the standard deviation of neighbouring samples about the line through them [N or N m]."""
    efforts = []
    for item in before.samples:
        for cycle in np.unique(item.cycle):
            effort = item.effort[item.cycle == cycle]
            efforts.append(effort[np.argsort(item.motion[item.cycle == cycle], kind="stable")])
    bends = np.concatenate([np.diff(effort, 2) for effort in efforts])
    return float(robust_scale(bends)) / sqrt(6.0)


def _fit_sets(
    before: Comparison,
    curves: ModelCurves,
    candidates: tuple[FitParameter, ...],
    zeros: tuple[FitParameter, ...],
    distinction: Distinction,
    report: Callable[[str], None],
) -> Iterator[Calibration]:
    """Yield the fits of the sets of errors that the recording determines; larger sets while they fit better."""
    best = np.inf
    for count in range(min(MOST_ERRORS, len(candidates)) + 1):
        level = best
        for chosen in combinations(candidates, count):
            if chosen and not distinction.separates(chosen, zeros):
                continue
            report(" and ".join(name_of(item) for item in chosen) or "no error")
            try:
                fit = fit_samples(before, curves, (*chosen, *zeros), "linear", FIT_TOLERANCE)
            except CfmError:  # no such part exists, or none that could be measured so
                continue
            level = min(level, _criterion(fit, before, 1.0))
            yield fit
        if count and level >= best - STRONG_EVIDENCE:
            return
        best = level


def _penalty(fit: Calibration, expected: Assumed | None) -> float:
    """Return the squares of fitted errors over what is usual of material and process, added up."""
    total = 0.0
    for item, value in zip(fit.parameters, fit.fit.values, strict=True):
        usual = item.size if item.path.endswith("friction") else USUAL_DEVIATION * item.size
        if item.path.endswith(".youngs_modulus") and expected is not None and expected.modulus is not None:
            usual = max(abs(end - item.start) for end in expected.modulus) / 2.0
        elif is_thickness(item) and expected is not None:
            usual = expected.process.thickness
        total += 0.0 if item.path.startswith(DATA_PREFIX) else ((float(value) - item.start) / usual) ** 2
    return total


def _criterion(fit: Calibration, before: Comparison, inflation: float) -> float:
    """Return Schwarz's criterion, residuals counting as one in groups of `inflation`."""
    residuals = fit.fit.residuals
    count, level = len(residuals), float(np.abs(np.concatenate([item.effort for item in before.samples])).max())
    power = float(residuals @ residuals) / count + (FORCE_RESOLUTION * level) ** 2
    independent = count / inflation
    return independent * float(np.log(power / level**2)) + len(fit.parameters) * float(np.log(independent))


def _rank_explanations(fits: list[Calibration], before: Comparison, expected: Assumed | None) -> list[Explanation]:
    """Return explanations in the order of their criterion, in which errors that are unusually large count, too.

    How many residuals count as one says the closest fit.
    """
    closest = min(fits, key=lambda fit: float(fit.fit.residuals @ fit.fit.residuals))
    inflation = closest.fit.inflation
    ranked = [Explanation(fit, _criterion(fit, before, inflation) + _penalty(fit, expected)) for fit in fits]
    return sorted(ranked, key=lambda item: item.criterion)


def _drop_supersets(explanations: Sequence[Explanation]) -> Iterator[Explanation]:
    """Yield the explanations of which no part explains as much."""
    for explanation in explanations:
        paths = {item.path for item in explanation.errors}
        if not any({item.path for item in smaller.errors} < paths for smaller in explanations):
            yield explanation


def _check_best(best: Explanation, before: Comparison, source: MeasuredCurves, usual_force: float) -> None:
    """Raise if even the best explanation says that another part was measured; `usual_force` is that of the part."""
    calibration, name = best.calibration, source.recording.name
    bounds = calibration.fit.at_bound
    zero = f"{DATA_PREFIX}{next(iter(ZERO_OFFSETS[before.curve.kind]))}"
    for k, item in enumerate(calibration.parameters):
        value = abs(float(calibration.fit.values[k]))
        if item.path == zero and value > usual_force:
            shown, usual = (format_short(force, before.curve.kind, 3) for force in (value, usual_force))
            raise DataError(
                f"{name}: without load the sensor would show {shown}, more than the {usual} of the part: a recording "
                "of another part? If it does, state it with --tare"
            )
        if bounds[k] and item in best.errors and not item.path.endswith("friction"):
            low, high = (item.format_value(end) for end in (item.low, item.high))
            raise DataError(
                f"{name}: no {name_of(item)} from {low} to {high} explains it: a recording of another part, or of "
                "another unit or sign (--units, --flip)?"
            )
    level = float(np.abs(np.concatenate([item.effort for item in before.samples])).max())
    misfit = float(np.sqrt(np.mean(calibration.fit.residuals**2)))
    if misfit > LARGEST_MISFIT * level:
        raise DataError(
            f"{name}: the model misses it by {100 * misfit / level:.0f} % of its force (rms) whatever is fitted: a "
            "recording of another part, or with another zero (--zero, --tare)?"
        )

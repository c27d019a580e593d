"""A drawing corrected by the recording of a part that was made of it, with the force predicted for the next part.

What differs in the part is fitted (`errors_of_made_part`); the next part is assumed to be made with the same errors.
Then values that are drawn, not what is bought, are moved as little as possible until the part that will be made has the
curve that the drawn one was to have, at the force that is requested. Where the recording does not tell several errors
apart, the values suit all of them, and the interval of the predicted force contains each.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.experiment.calibration import analyze_part
from cfmkit.experiment.errors_of_made_part import explain, name_of
from cfmkit.experiment.parameters_to_fit import DATA_PREFIX
from cfmkit.experiment.redrawn_values import Redesign, aim_of, largest_miss, limits_of
from cfmkit.families.run_control import Run
from cfmkit.results import Finding
from cfmkit.specs.units import format_short
from cfmkit.stock.materials import MATERIALS_BY_NAME

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.experiment.errors_of_made_part import Explanation
    from cfmkit.experiment.redrawn_values import AimedCurve
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

UNKNOWN_ZERO = 0.01
"""Standard deviation of a zero of the force that neither the recording nor the user tells, over the largest force."""
LEAST_CORRECTION = 0.005
"""Deviation of the mean force that is not corrected: the error of a testing machine of class 0.5 (ISO 7500-1)."""
LARGEST_REMAINDER = 0.01  # deviation of the mean force that a corrected part may still have
CORRECTION_FINDINGS = {
    "not_told_apart": "the recording does not tell errors of the part apart: the correction allows for each",
    "modulus_outside": "the fitted modulus is outside the range that is known of the material",
}


@dataclass(frozen=True)
class PredictedForce:
    """Mean force over the window with its 95 % interval [N or N m]."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, repr=False)
class DesignCorrection(ShortRepr):
    """A corrected drawing."""

    drawn: Spec  # that the part was made of, resolved
    corrected: Spec  # to make the next part of
    # made, will_be_made: the parts of both with their errors
    made: Spec
    will_be_made: Spec
    explanations: tuple[Explanation, ...]  # what differs in the part, the best first
    aim: AimedCurve  # the curve that is to be reached
    nominal: Result  # of a perfect part of the old drawing
    built: Result  # of the part that was made
    predicted: Result  # of the part that will be made
    before: PredictedForce  # of the part that was made
    after: PredictedForce  # of the part that will be made
    changes: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # path -> drawn before, and now [SI]
    warnings: tuple[Finding, ...] = ()

    @property
    def explanation(self) -> Explanation:
        """The best one."""
        return self.explanations[0]

    @property
    def target(self) -> float:
        """Mean force that was to be reached [N or N m]."""
        return self.aim.mean_effort


def correct(
    spec: Spec,
    source: MeasuredCurves,
    fit: Sequence[str] | None = None,
    tared: bool = False,
    run: Run | None = None,
) -> DesignCorrection:
    """Return a drawing corrected by the recording of a part that was made of it.

    Parameters
    ----------
    spec : Spec
        What the part was made of, resolved.
    source : MeasuredCurves
        What was measured of it.
    fit : sequence of str, optional
        What errs in the part; default: what the recording tells apart.
    tared : bool
        Whether the zero of the force is known; else it is fitted.
    run : Run, optional
        Progress report.

    Raises
    ------
    cfmkit.errors.DataError
        If the recording is not of such a part.
    cfmkit.errors.SolutionError
        If there is no curve, the recording determines nothing, or no part that can be made has the force
        (`NotMakeable`).
    """
    run = run or Run()
    explanations = explain(spec, source, fit, tared, lambda text: run.progress(0.2, f"fitting {text}"))
    best = explanations[0]
    nominal = analyze_part(spec)
    aim = aim_of(nominal)
    made = best.part_of(spec)
    built = analyze_part(made)
    zero_known = (
        tared or fit is not None or any(item.path.startswith(DATA_PREFIX) for item in best.calibration.parameters)
    )
    zero = 0.0 if zero_known else UNKNOWN_ZERO * float(np.abs(source.recording.effort).max())
    before = _predict_force(explanations, spec, aim, zero)
    off = _largest_departure(explanations, spec, aim)
    if any(not item.errors for item in explanations) or off <= LEAST_CORRECTION:
        return DesignCorrection(spec, spec, made, made, explanations, aim, nominal, built, built, before, before)
    run.progress(0.6, "moving what is drawn")
    redesign = Redesign(spec, explanations, aim, limits_of(spec), largest_miss(nominal))
    x = redesign.solve()
    if _largest_departure(explanations[:1], redesign.drawing(x), aim) > LEAST_CORRECTION:
        # a requirement stands in the way: the force comes first, but the part stays in its envelope
        envelope = replace(redesign, missed_before=largest_miss(nominal, of_envelope=True), of_envelope=True)
        x = envelope.solve()
    corrected = redesign.drawing(x)
    after = _predict_force(explanations, corrected, aim, zero)
    will_be_made = best.part_of(corrected)
    predicted = analyze_part(will_be_made)
    if _largest_departure(explanations[:1], corrected, aim) > LARGEST_REMAINDER:
        raise redesign.not_makeable(x, after.value)
    changes = {
        path: (float(spec.get_value(path)), float(value))
        for path, value in zip(redesign.limits, x, strict=True)
        if abs(value / float(spec.get_value(path)) - 1.0) > 1e-5
    }
    stated = _state_modulus(corrected, best) if len(explanations) == 1 else corrected
    return DesignCorrection(
        spec, stated, made, will_be_made, explanations, aim, nominal, built, predicted, before, after, changes,
        tuple(_correction_warnings(spec, explanations)),
    )  # fmt: skip


def _largest_departure(explanations: Sequence[Explanation], drawn: Spec, aim: AimedCurve) -> float:
    """Return by how much the mean force of parts departs from the aim at most, over its level."""
    return max(abs(float(np.nanmean(aim.departure(analyze_part(item.part_of(drawn)).curves)))) for item in explanations)


def _predict_force(explanations: Sequence[Explanation], drawn: Spec, aim: AimedCurve, zero: float) -> PredictedForce:
    """Return the mean force of the part of a drawing, with an interval that contains that of every explanation.

    `zero`: standard deviation of a zero of the sensor that is not known [N or N m].
    """
    forces = [_predict_interval(item, drawn, aim, zero) for item in explanations]
    return PredictedForce(forces[0].value, min(item.low for item in forces), max(item.high for item in forces))


def _predict_interval(explanation: Explanation, drawn: Spec, aim: AimedCurve, zero: float) -> PredictedForce:
    """Return the mean force of a part with one set of errors, and its interval by linear estimate."""

    def mean(values: FloatArray) -> float:
        return aim.mean(analyze_part(explanation.part_of(drawn, values)).curves)

    values, spread = explanation.values, np.sqrt(np.diag(explanation.covariance))
    mean_now = mean(values)
    slopes = np.zeros(len(values))
    for k, item in enumerate(explanation.errors):
        step = float(np.clip(spread[k], 1e-5 * item.size, 0.02 * item.size))
        step = -step if values[k] + step > item.high else step
        moved = values.copy()
        moved[k] += step
        slopes[k] = (mean(moved) - mean_now) / step
    half = explanation.quantile * float(np.sqrt(slopes @ explanation.covariance @ slopes + zero**2))
    return PredictedForce(mean_now, mean_now - half, mean_now + half)


def _state_modulus(corrected: Spec, best: Explanation) -> Spec:
    """Return a corrected drawing that states the fitted moduli; the other errors belong to the process."""
    changes: dict[str, float] = {}
    for item, value in zip(best.errors, best.values, strict=True):
        if item.path.endswith(".youngs_modulus"):
            changes |= item.changes(corrected, float(value))
    return corrected.replace(changes) if changes else corrected


def _correction_warnings(spec: Spec, explanations: Sequence[Explanation]) -> Iterator[Finding]:
    sets = [" with ".join(name_of(item) for item in explanation.errors) for explanation in explanations]
    if len(sets) > 1:
        reported = f"the recording cannot tell {' from '.join(sets)}: the correction suits each, the interval has all"
        yield Finding("not_told_apart", reported)
    best = explanations[0]
    for item, value in zip(best.errors, best.values, strict=True):
        material = spec.get_value(item.path.rpartition(".")[0]) if item.path.endswith(".youngs_modulus") else None
        usual = MATERIALS_BY_NAME.get(getattr(material, "name", None) or "")
        if usual is None or usual.scatter.youngs_modulus[0] <= value <= usual.scatter.youngs_modulus[1]:
            continue
        low, high = (format_short(end, "stress", 4) for end in usual.scatter.youngs_modulus)
        modulus = format_short(float(value), "stress", 4)
        reported = f"a modulus of {modulus} is fitted, and {usual.name} has {low} to {high}"
        yield Finding("modulus_outside", f"{reported}: is it that material, and are the sizes those of the drawing?")

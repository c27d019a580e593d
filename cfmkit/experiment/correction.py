"""A drawing corrected by the recording of a part that was made of it.

What differs in the part is fitted (`errors_of_made_part`); the next part is assumed to be made with the same errors.
Then values that are drawn, not what is bought, are moved as little as possible until the part that will be made has the
curve that the drawn one was to have, at the force that is asked for. Where the recording does not tell several errors
apart, the values suit all of them, and the interval of the predicted force contains each.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.designing.bounds_and_rounding import around
from cfmkit.errors import CfmError, SolutionError
from cfmkit.experiment.branches import LOAD, UNLOAD
from cfmkit.experiment.errors_of_made_part import explain, is_thickness, name_of
from cfmkit.experiment.parameters_to_fit import DATA
from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.families.run_control import Run
from cfmkit.metrics import Undefined, Window, check, frame_of, values_of_family, window_of
from cfmkit.metrics.compare import effort_at
from cfmkit.results import Finding
from cfmkit.specs.units import format_short
from cfmkit.stock.material_and_part_spec import sheet_of
from cfmkit.stock.materials import MATERIALS
from cfmkit.studies.parts.assumed_errors import assumed
from cfmkit.studies.parts.redesign import free_of
from cfmkit.studies.variable_paths import leaf

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.experiment.errors_of_made_part import Explanation
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

UNKNOWN_ZERO = 0.01
"""Standard deviation of a zero of the force that neither the recording nor the user tells, over the largest force."""

N_PLACES = 65
"""Places of the window at which the corrected curve is to be the one that was designed."""

LEAST_CORRECTION = 0.005
"""Deviation of the mean force that is not corrected: the error of a testing machine of class 0.5 (ISO 7500-1)."""

LARGEST_RESCALING = 0.03
"""Deviation of the designed mean from the target up to which it is taken for rounding and removed, too."""

MOST_CHANGE = 3.0
"""Factor by which a drawn value may change where the design does not limit it."""

RELUCTANCE = {"width": 1e-4, "thickness": 1e-3}
"""Deviation of the force that is accepted for not changing a value at all: widths do not change stress or shape."""

OTHER_RELUCTANCE = 1e-2

DIGITS = 5
"""Digits of a corrected value: a leaf of 0.25 mm to 10 nm, a millionth of its force."""

CLOSE = 2e-3
"""Root mean square departure from the aim, over its level, with which no more values are changed."""

MEAN_WEIGHT = 3.0
"""How much a departure of the mean force counts, over one of the same size from the curve."""

MISSED_WEIGHT = 3.0
"""How much missing another requirement by a share counts, over missing the force by as much."""

MARGIN = 1e-3
"""Part of its bound by which a requirement is to be met: values are rounded afterwards."""

NO_CURVE = 10.0
"""Deviation that stands for a part that has no curve."""

FINDINGS = {
    "not_told_apart": "the recording does not tell errors of the part apart: the correction allows for each",
    "modulus_outside": "the fitted modulus is outside the range that is known of the material",
}


@dataclass(frozen=True)
class Aim:
    """The curve that a corrected part is to have."""

    places: FloatArray  # (n,) [m or rad]
    efforts: tuple[FloatArray, ...]  # (n,) of each curve [N or N m]
    branches: tuple[str, ...]  # whose mean it is

    @property
    def level(self) -> float:
        """Root mean square [N or N m]."""
        return float(np.sqrt(np.mean(np.square(self.efforts))))

    def departure(self, curves: Sequence[Curve]) -> FloatArray:
        """Return by how much curves are above the aim, over its level, (m n,); NaN where they have no value."""
        found: FloatArray = np.concatenate(
            [middle(curve, self.branches, self.places) - effort for curve, effort in zip(curves, self.efforts, strict=True)]
        )
        return found / self.level

    def mean(self, curves: Sequence[Curve]) -> float:
        """Return the mean of the first curve [N or N m]."""
        return float(np.nanmean(middle(curves[0], self.branches, self.places)))


def middle(curve: Curve, branches: Sequence[str], places: FloatArray) -> FloatArray:
    """Return the mean of some branches of a curve at some places; branches that it does not have are left out.

    Raises
    ------
    cfmkit.errors.SolutionError
        If a branch turns back.
    """
    own = [name for name in branches if name in curve.branches] or list(curve.branches[:1])
    try:
        found: FloatArray = np.mean([effort_at(curve, name, places) for name in own], axis=0)
    except Undefined:
        raise SolutionError("the force has several values at one place: such a curve is not corrected") from None
    return found


@dataclass(frozen=True)
class PredictedForce:
    """Mean force over the window with its 95 % interval [N or N m]."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, repr=False)
class Correction(ShortRepr):
    """A corrected drawing."""

    drawn: Spec  # that the part was made of, resolved
    corrected: Spec  # to make the next part of
    # made, will_be_made: the parts of both with their errors
    made: Spec
    will_be_made: Spec
    explanations: tuple[Explanation, ...]  # what differs in the part, the best first
    aim: Aim
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
        return float(np.mean(self.aim.efforts[0]))


class NotMakeable(SolutionError):
    """No part within the limits of process, stock and design has the force."""

    def __init__(self, message: str, nearest: Mapping[str, str]) -> None:
        """Keep the values with which there is one."""
        super().__init__(message)
        self.nearest = dict(nearest)


def correct(
    spec: Spec,
    source: MeasuredCurves,
    fit: Sequence[str] | None = None,
    tared: bool = False,
    run: Run | None = None,
) -> Correction:
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
    nominal = _analyzed(spec)
    aim = aim_of(nominal)
    made = best.part_of(spec)
    built = _analyzed(made)
    told = tared or fit is not None or any(item.path.startswith(DATA) for item in best.calibration.parameters)
    zero = 0.0 if told else UNKNOWN_ZERO * float(np.abs(source.recording.effort).max())
    before = _force(explanations, spec, aim, zero)
    off = _largest_departure(explanations, spec, aim)
    if any(not one.errors for one in explanations) or off <= LEAST_CORRECTION:
        return Correction(spec, spec, made, made, explanations, aim, nominal, built, built, before, before)
    run.progress(0.6, "moving what is drawn")
    redesign = Redesign(spec, explanations, aim, limits_of(spec), _missed(nominal))
    x = redesign.solve()
    if _largest_departure(explanations[:1], redesign.drawing(x), aim) > LEAST_CORRECTION:
        # a requirement stands in the way: the force comes first, and the page says what is missed
        x = replace(redesign, missed_before=np.inf).solve()
    corrected = redesign.drawing(x)
    after = _force(explanations, corrected, aim, zero)
    will_be_made = best.part_of(corrected)
    predicted = _analyzed(will_be_made)
    if _largest_departure(explanations[:1], corrected, aim) > LEAST_CORRECTION:
        raise redesign.not_makeable(x, after)
    changes = {
        path: (float(spec.at(path)), float(value))
        for path, value in zip(redesign.limits, x, strict=True)
        if abs(value / float(spec.at(path)) - 1.0) > 1e-5
    }
    stated = _with_modulus(corrected, best) if len(explanations) == 1 else corrected
    return Correction(
        spec, stated, made, will_be_made, explanations, aim, nominal, built, predicted, before, after, changes,
        tuple(_warnings(spec, explanations)),
    )  # fmt: skip


def _analyzed(spec: Spec) -> Result:
    found: Result = family(spec.family).analyze(spec, Run())
    if not found.curves:
        raise SolutionError(f"there is no curve to correct: {found.message}")
    return found


def aim_of(nominal: Result) -> Aim:
    """Return the curve that a perfect part of a drawing has, at the force that is asked for.

    A target may hold between the branches or on one of them: it holds where it is met.
    """
    curve, target = nominal.curve, frame_of(nominal).target
    window = window_of(nominal) or Window(float(curve.motion.min()), float(curve.motion.max()))
    places = np.linspace(window.lo, window.hi, N_PLACES)
    each = [curve.branches, *((name,) for name in curve.branches)] if len(curve.branches) > 1 else [curve.branches]
    branches, scale = tuple(each[0]), 1.0
    if target and nominal.target_curve is None and nominal.spec.target_curve is None and len(nominal.curves) == 1:
        means = [float(np.nanmean(middle(curve, names, places))) for names in each]
        nearest = min(range(len(each)), key=lambda k: (round(abs(means[k] / target - 1.0), 3), k))
        branches = tuple(each[nearest])
        scale = target / means[nearest] if abs(target / means[nearest] - 1.0) <= LARGEST_RESCALING else 1.0
    efforts = [scale * middle(one, branches, places) for one in nominal.curves]
    known = np.all(np.isfinite(efforts), axis=0)
    return Aim(places[known], tuple(effort[known] for effort in efforts), branches)


def _largest_departure(explanations: Sequence[Explanation], drawn: Spec, aim: Aim) -> float:
    """Return by how much the mean force of parts departs from the aim at most, over its level."""
    return max(
        abs(float(np.nanmean(aim.departure(_analyzed(one.part_of(drawn)).curves)))) for one in explanations
    )


def _force(explanations: Sequence[Explanation], drawn: Spec, aim: Aim, zero: float) -> PredictedForce:
    """Return the mean force of the part of a drawing, with an interval that contains that of every explanation.

    `zero`: standard deviation of a zero of the sensor that is not known [N or N m].
    """
    each = [_interval(one, drawn, aim, zero) for one in explanations]
    return PredictedForce(each[0].value, min(one.low for one in each), max(one.high for one in each))


def _interval(explanation: Explanation, drawn: Spec, aim: Aim, zero: float) -> PredictedForce:
    """Return the mean force of a part with one set of errors, and its interval by linear estimate."""

    def mean(values: FloatArray) -> float:
        return aim.mean(_analyzed(explanation.part_of(drawn, values)).curves)

    values, spread = explanation.values, np.sqrt(np.diag(explanation.covariance))
    here = mean(values)
    slopes = np.zeros(len(values))
    for k, item in enumerate(explanation.errors):
        step = float(np.clip(spread[k], 1e-5 * item.size, 0.02 * item.size))
        step = -step if values[k] + step > item.high else step
        moved = values.copy()
        moved[k] += step
        slopes[k] = (mean(moved) - here) / step
    half = explanation.quantile * float(np.sqrt(slopes @ explanation.covariance @ slopes + zero**2))
    return PredictedForce(here, here - half, here + half)


# --- what may be drawn anew -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Limit:
    """Within which limits a drawn value may move, and what sets them."""

    low: float
    high: float
    least: str = "the design's own limit"  # what the lower one is


def limits_of(spec: Spec) -> dict[str, Limit]:
    """Return which values of a drawing may change, each with its limits [SI].

    These are the values that the design chooses, and widths and thicknesses; not widths that a sheet decides, nor what
    is bought. Where nothing of that is there, the places of joints.

    Raises
    ------
    cfmkit.errors.SpecError
        If a path of `design.free` is not in the specification.
    """
    stated = family(spec.family).errors
    kinds: dict[str, str] = {} if stated is None else dict(function_named(stated)(spec))
    design = getattr(spec, "design", None)
    ranges = {path: _widened(float(spec.at(path)), *ends) for path, ends in free_of(spec, spec).items()}
    if not getattr(design, "free", None):
        for path in _sections(spec):
            value = float(spec.at(path))
            ranges.setdefault(path, (value / MOST_CHANGE, value * MOST_CHANGE))
    ranges = {path: ends for path, ends in ranges.items() if kinds.get(path) not in ("rate", "friction")}
    if not ranges:
        places = [path for path, kind in kinds.items() if kind == "position"]
        ranges = {path: around(float(spec.at(path))) for path in places if float(spec.at(path))}
    sheet, process = sheet_of(getattr(spec.at("mechanism"), "part", None)), assumed(spec)
    fixed = {f"mechanism.{key}" for key in spec.out_of_plane_widths} if sheet is not None else set()
    found = {}
    for path, (low, high) in ranges.items():
        if path in fixed:
            continue
        limit = Limit(low, high)
        if process is not None and _is_section(path) and process.process.least_feature > low:
            thinnest = min(process.process.least_feature, float(spec.at(path)))
            limit = Limit(thinnest, max(high, thinnest), f"the least that {process.process.name} makes")
        if limit.low < limit.high:
            found[path] = limit
    return found


def _widened(value: float, low: float, high: float) -> tuple[float, float]:
    """Return a range in which a value may be corrected: limits that a design states hold, others are wider."""
    least, most = around(value)
    return (
        value / MOST_CHANGE if np.isclose(low, least) and value > 0.0 else low,
        value * MOST_CHANGE if np.isclose(high, most) and value > 0.0 else high,
    )


def _sections(spec: Spec) -> list[str]:
    """Return the paths of widths and thicknesses of what bends."""
    made = {f"mechanism.{key}" for key, value in spec.out_of_plane_widths.items() if value is not None}
    beside = {path.removesuffix("width") + "thickness" for path in made}
    known = dict(spec.leaves())
    return [path for path in known if path in made or path.removesuffix(_index(path)) in beside]


def _index(path: str) -> str:
    """Return the number of an item at the end of a path with its dot; "" if it has none."""
    last = path.rpartition(".")[2]
    return f".{last}" if last.isdecimal() else ""


def _is_section(path: str) -> bool:
    return _kind(path) in RELUCTANCE


def _kind(path: str) -> str:
    return path.removesuffix(_index(path)).rpartition(".")[2]


@dataclass(frozen=True)
class Redesign:
    """The drawn values with which the parts of every explanation have the curve that is aimed at."""

    drawn: Spec
    explanations: tuple[Explanation, ...]
    aim: Aim
    limits: Mapping[str, Limit]
    # by what share of its bound a requirement is missed by the design itself; infinite: requirements do not matter
    missed_before: float = 0.0

    @cached_property
    def start(self) -> FloatArray:
        """The values as drawn, (n,) [SI]."""
        return np.array([float(self.drawn.at(path)) for path in self.limits])

    def drawing(self, x: FloatArray) -> Spec:
        """Return the drawing with other values.

        Raises
        ------
        cfmkit.errors.SpecError
            If they are not valid together.
        """
        return self.drawn.replace(dict(zip(self.limits, x.tolist(), strict=True)))

    def solve(self) -> FloatArray:
        """Return the values, with the digits that are written, (n,) [SI].

        Widths change alone if that is enough: neither shape nor stress change with them. Then thicknesses change, too,
        then all.

        Raises
        ------
        cfmkit.errors.SolutionError
            If nothing may change.
        """
        if not self.limits:
            raise SolutionError(
                "nothing that is made may change: the design says of no value that it is free; state 'design.free'"
            )
        kinds = [_kind(path) for path in self.limits]
        stages = [[k for k, kind in enumerate(kinds) if kind in names] for names in (("width",), tuple(RELUCTANCE))]
        best = self._compensated()
        if self._cost(best) <= CLOSE:
            return best
        for free in dict.fromkeys((*map(tuple, stages), tuple(range(len(kinds))))):
            if free:
                best = min(self._solved(list(free), best), best, key=self._cost)
                if self._cost(best) <= CLOSE:
                    break
        return best

    def _compensated(self) -> FloatArray:
        """Return the values of leaves that are drawn thinner by as much as they are made thicker, (n,) [SI].

        As drawn where the recording may be explained without an error of the thickness.
        """
        if not all(any(is_thickness(item) for item in one.errors) for one in self.explanations):
            return self.start
        changes: dict[str, float] = {}
        for item, value in zip(self.explanations[0].errors, self.explanations[0].values, strict=True):
            if is_thickness(item):
                changes |= item.changes(self.drawn, 2.0 * item.start - float(value))
        x = [changes.get(path, value) for path, value in zip(self.limits, self.start.tolist(), strict=True)]
        return self._written(np.array(x))

    def _written(self, x: FloatArray) -> FloatArray:
        """Return values with the digits that are written, within their limits, (n,) [SI]."""
        low, high = (np.array([getattr(limit, end) for limit in self.limits.values()]) for end in ("low", "high"))
        digits = np.array([float(f"{value:.{DIGITS}g}") for value in x])
        return np.where(np.isclose(x, self.start), self.start, np.clip(digits, low, high))

    def _solved(self, free: list[int], start: FloatArray) -> FloatArray:
        """Return the values of which some have been moved from a start, (n,) [SI]."""
        from scipy.optimize import least_squares

        size = np.abs(self.start)
        low, high = (np.array([getattr(limit, end) for limit in self.limits.values()]) / size for end in ("low", "high"))

        def whole(z: FloatArray) -> FloatArray:
            x = start / size
            x[free] = z
            return x * size

        inside = np.clip((start / size)[free], low[free] + 1e-9, high[free] - 1e-9)
        found = least_squares(
            lambda z: self._residuals(whole(z)), inside, bounds=(low[free], high[free]), diff_step=1e-4,
            xtol=1e-8, ftol=1e-8, max_nfev=40,
        )  # fmt: skip
        return self._written(whole(found.x))

    def _cost(self, x: FloatArray) -> float:
        """Return the root mean square departure from the aim, with what is missed of requirements."""
        return float(np.linalg.norm(self._residuals(x)[: -len(self.limits)]))

    def _residuals(self, x: FloatArray) -> FloatArray:
        count = N_PLACES * len(self.aim.efforts)
        share = (len(self.aim.places) * len(self.aim.efforts) * len(self.explanations)) ** -0.5
        departures, missed = [], 0.0
        for number, one in enumerate(self.explanations):
            try:
                result = _analyzed(one.part_of(self.drawing(x)))
                departure = share * self.aim.departure(result.curves)
                departures += [departure, [MEAN_WEIGHT * float(np.nanmean(departure)) / share * len(self.explanations) ** -0.5]]
                if number == 0 and np.isfinite(self.missed_before):
                    missed = max(missed, _missed(result) - self.missed_before)
            except (CfmError, ValueError):
                departures.append(np.full(len(self.aim.places) * len(self.aim.efforts) + 1, NO_CURVE * share))
        found = np.nan_to_num(np.concatenate(departures), nan=NO_CURVE * count**-0.5)
        reluctance = np.array([RELUCTANCE.get(_kind(path), OTHER_RELUCTANCE) for path in self.limits])
        moved: FloatArray = reluctance * (x / self.start - 1.0)
        return np.concatenate([found, [MISSED_WEIGHT * missed], moved])

    def not_makeable(self, x: FloatArray, after: PredictedForce) -> NotMakeable:
        """Return why no part has the force, and the nearest force that one has."""
        kind = "torque" if self.drawn.motion == "angle" else "force"
        wanted, reached = (format_short(value, kind, 4) for value in (float(np.mean(self.aim.efforts[0])), after.value))
        held = []
        for path, value, limit in zip(self.limits, x.tolist(), self.limits.values(), strict=True):
            dimension = _dimension(self.drawn, path)
            if np.isclose(value, limit.low, rtol=1e-4):
                held.append(f"{path} {format_short(limit.low, dimension, 4)} ({limit.least})")
            elif np.isclose(value, limit.high, rtol=1e-4):
                held.append(f"{path} {format_short(limit.high, dimension, 4)} (the most that the design allows)")
        why = f", held by {' and '.join(held)}" if held else ""
        message = f"no part that can be made has {wanted}: the nearest has {reached}{why}"
        levels = [path for path in family(self.drawn.family).levels if _has(self.drawn, path)]
        return NotMakeable(message, {path: reached for path in levels[:1]})


def _has(spec: Spec, path: str) -> bool:
    try:
        return isinstance(spec.at(path), float)
    except KeyError:
        return False


def _dimension(spec: Spec, path: str) -> str:
    quantity = leaf(type(spec), path).quantity
    return quantity.dimensions[0] if quantity else "ratio"


def _missed(result: Result) -> float:
    """Return by what share of its bound a requirement is missed, or met by less than `MARGIN`, the largest."""
    values = values_of_family(family(result.spec.family).values)
    shares = [0.0]
    for outcome in check(result.spec.part_requirements, result, values):
        if outcome.value is None:
            continue
        for bound, way in ((outcome.max, 1.0), (outcome.min, -1.0)):
            if bound is not None:
                shares.append(way * (outcome.value - bound) / (abs(bound) or 1.0) + MARGIN)
    return max(shares)


# --- what is said of it -----------------------------------------------------------------------------------------------


def _with_modulus(corrected: Spec, best: Explanation) -> Spec:
    """Return a corrected drawing with the fitted moduli: the other errors are those of the process, not of the design."""
    changes: dict[str, float] = {}
    for item, value in zip(best.errors, best.values, strict=True):
        if item.path.endswith(".youngs_modulus"):
            changes |= item.changes(corrected, float(value))
    return corrected.replace(changes) if changes else corrected


def _warnings(spec: Spec, explanations: Sequence[Explanation]) -> Iterator[Finding]:
    sets = [" with ".join(name_of(item) for item in one.errors) for one in explanations]
    if len(sets) > 1:
        reported = f"the recording cannot tell {' from '.join(sets)}: the correction suits each, the interval has all"
        yield Finding("not_told_apart", reported)
    best = explanations[0]
    for item, value in zip(best.errors, best.values, strict=True):
        material = spec.at(item.path.rpartition(".")[0]) if item.path.endswith(".youngs_modulus") else None
        known = MATERIALS.get(getattr(material, "name", None) or "")
        if known is None or known.scatter.youngs_modulus[0] <= value <= known.scatter.youngs_modulus[1]:
            continue
        low, high = (format_short(end, "stress", 4) for end in known.scatter.youngs_modulus)
        reported = f"a modulus of {format_short(float(value), 'stress', 4)} is fitted, and {known.name} has {low} to {high}"
        yield Finding("modulus_outside", f"{reported}: is it that material, and are the sizes those of the drawing?")

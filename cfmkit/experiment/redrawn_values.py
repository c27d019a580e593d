"""Drawn values moved as little as possible until the part that is made of them has the curve that is aimed at.

That curve is the one of a perfect part of the design, at the force that is requested. Values of what is made may move:
those that the design chooses, widths and thicknesses; not what is bought, and not the widths that a sheet decides. They
move as little as possible, widths before thicknesses before all others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from cfmkit.designing.rounded_and_reported_values import range_about
from cfmkit.errors import CfmError, SolutionError
from cfmkit.experiment.calibration import analyze_part
from cfmkit.experiment.errors_of_made_part import is_thickness
from cfmkit.families import family
from cfmkit.families.base import ENVELOPE_METRICS
from cfmkit.metrics import Undefined, Window, frame_of, window_of
from cfmkit.metrics.compare import effort_at
from cfmkit.specs.units import format_short, from_border, to_border
from cfmkit.specs.yamlio.paths import read_item_suffix
from cfmkit.stock.material_and_part_spec import sheet_of
from cfmkit.studies.parts.parts import accuracy_of, assume_errors
from cfmkit.studies.parts.redesign import free_of
from cfmkit.studies.stock_and_digits import decimals_of
from cfmkit.studies.variations import leaf

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.experiment.parameters_to_fit import FitParameter
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec


N_PLACES = 65  # places of the window at which the corrected curve is to be the one that was designed
LARGEST_RESCALING = 0.03
"""Deviation of the designed mean from the target up to which it is taken for rounding and removed, too."""


@dataclass(frozen=True)
class AimedCurve:
    """The curve that a corrected part is to have."""

    places: FloatArray  # (n,) [m or rad]
    efforts: tuple[FloatArray, ...]  # (n,) of each curve [N or N m]
    branches: tuple[str, ...]  # whose mean it is

    @property
    def level(self) -> float:
        """Root mean square [N or N m]."""
        return float(np.sqrt(np.mean(np.square(self.efforts))))

    @property
    def mean_effort(self) -> float:
        """Mean of the first curve that is aimed at [N or N m]."""
        return float(np.mean(self.efforts[0]))

    def departure(self, curves: Sequence[Curve]) -> FloatArray:
        """Return by how much curves are above the aim, over its level, (m n,); NaN where they have no value."""
        departure: FloatArray = np.concatenate(
            [
                middle(curve, self.branches, self.places) - effort
                for curve, effort in zip(curves, self.efforts, strict=True)
            ]
        )
        return departure / self.level

    def mean(self, curves: Sequence[Curve]) -> float:
        """Return the mean of the first curve [N or N m]."""
        return float(np.nanmean(middle(curves[0], self.branches, self.places)))


def middle(curve: Curve, branches: Sequence[str], places: FloatArray) -> FloatArray:
    """Return the mean of some branches of a curve at some places; branches that it does not have are left out.

    Raises SolutionError if a branch turns back.
    """
    names = [name for name in branches if name in curve.branches] or list(curve.branches[:1])
    try:
        effort: FloatArray = np.mean([effort_at(curve, name, places) for name in names], axis=0)
    except Undefined:
        raise SolutionError("the force has several values at one place: such a curve is not corrected") from None
    return effort


def aim_of(nominal: Result) -> AimedCurve:
    """Return the curve that a perfect part of a drawing has, at the force that is requested.

    A target may hold between the branches or on one of them: it holds where it is met.
    """
    curve, target = nominal.curve, frame_of(nominal).target
    window = window_of(nominal) or Window(float(curve.motion.min()), float(curve.motion.max()))
    places = np.linspace(window.lo, window.hi, N_PLACES)
    choices = [curve.branches, *((name,) for name in curve.branches)] if len(curve.branches) > 1 else [curve.branches]
    branches, scale = tuple(choices[0]), 1.0
    if target and nominal.target_curve is None and nominal.spec.target_curve is None and len(nominal.curves) == 1:
        means = [float(np.nanmean(middle(curve, names, places))) for names in choices]
        nearest = min(range(len(choices)), key=lambda k: (round(abs(means[k] / target - 1.0), 3), k))
        branches = tuple(choices[nearest])
        scale = target / means[nearest] if abs(target / means[nearest] - 1.0) <= LARGEST_RESCALING else 1.0
    efforts = [scale * middle(item, branches, places) for item in nominal.curves]
    is_known = np.all(np.isfinite(efforts), axis=0)
    return AimedCurve(places[is_known], tuple(effort[is_known] for effort in efforts), branches)


MOST_CHANGE = 3.0  # factor by which a drawn value may change where the design does not limit it
SECTION_RELUCTANCE = {"width": 1e-4, "thickness": 1e-3}
"""Deviation of the force that is accepted for not changing a value at all: widths do not change stress or shape."""
OTHER_RELUCTANCE = 1e-2  # the same of any other value
N_DIGITS = 5  # digits of a corrected value that is no length or angle
CLOSE_DEPARTURE = 2e-3  # root mean square departure from the aim, over its level, with which no more values are changed
MEAN_WEIGHT = 10.0  # how much a departure of the mean force counts, over one of the same size from the curve
MISSED_WEIGHT = 3.0  # how much missing another requirement by a share counts, over missing the force by as much
REQUIREMENT_MARGIN = 1e-3  # part of its bound by which a requirement is to be met: values are rounded afterwards
RELATIVE_STEP, MAX_STEPS = 1e-4, 40
"""Relative change of a value for derivatives, and steps of a search, which usually takes five."""
NO_CURVE = 10.0  # deviation that stands for a part that has no curve


class NotMakeable(SolutionError):
    """No part within the limits of process, stock and design has the force."""

    def __init__(self, message: str, nearest: Mapping[str, str]) -> None:
        """Keep the values with which there is one."""
        super().__init__(message)
        self.nearest = dict(nearest)


@dataclass(frozen=True)
class DrawnRange:
    """Limits within which a drawn value may move, and what sets the lower one."""

    low: float
    high: float
    least: str = "the design's own limit"  # what the lower one is


def limits_of(spec: Spec) -> dict[str, DrawnRange]:
    """Return which values of a drawing may change, each with its limits [SI].

    These are the values that the design chooses, and widths and thicknesses; not widths that a sheet decides, nor what
    is bought. Where nothing of that is there, the places of joints.

    Raises SpecError if a path of `design.free` is not in the specification.
    """
    kinds = dict(family(spec.family).errors(spec))
    design = getattr(spec, "design", None)
    ranges = {path: _widen(float(spec.get_value(path)), *ends) for path, ends in free_of(spec, spec).items()}
    if not getattr(design, "free", None):
        for path in section_paths(spec):
            value = float(spec.get_value(path))
            ranges.setdefault(path, (value / MOST_CHANGE, value * MOST_CHANGE))
    ranges = {path: ends for path, ends in ranges.items() if kinds.get(path) not in ("rate", "friction")}
    if not ranges:
        places = [path for path, kind in kinds.items() if kind == "position"]
        ranges = {path: range_about(float(spec.get_value(path))) for path in places if float(spec.get_value(path))}
    sheet, process = sheet_of(getattr(spec.get_value("mechanism"), "part", None)), assume_errors(spec)
    fixed = {f"mechanism.{key}" for key in spec.out_of_plane_widths} if sheet is not None else set()
    limits = {}
    for path, (low, high) in ranges.items():
        if path in fixed:
            continue
        limit = DrawnRange(low, high)
        if process is not None and _last_key(path) in SECTION_RELUCTANCE and process.process.least_feature > low:
            thinnest = min(process.process.least_feature, float(spec.get_value(path)))
            limit = DrawnRange(thinnest, max(high, thinnest), f"the least that {process.process.name} makes")
        if limit.low < limit.high:
            limits[path] = limit
    return limits


def _widen(value: float, low: float, high: float) -> tuple[float, float]:
    """Return a range in which a value may be corrected: limits that a design states hold, others are wider."""
    least, most = range_about(value)
    return (
        value / MOST_CHANGE if np.isclose(low, least) and value > 0.0 else low,
        value * MOST_CHANGE if np.isclose(high, most) and value > 0.0 else high,
    )


def section_paths(spec: Spec) -> list[str]:
    """Return the paths of widths and thicknesses of what bends."""
    made = {f"mechanism.{key}" for key, value in spec.out_of_plane_widths.items() if value is not None}
    beside = {path.removesuffix("width") + "thickness" for path in made}
    leaves = dict(spec.leaves())
    return [path for path in leaves if path in made or path.removesuffix(read_item_suffix(path)) in beside]


def _last_key(path: str) -> str:
    return path.removesuffix(read_item_suffix(path)).rpartition(".")[2]


class MadeAs(Protocol):
    """Errors with which parts are made of a drawing."""

    @property
    def errors(self) -> tuple[FitParameter, ...]:
        """The values that err."""

    @property
    def values(self) -> FloatArray:
        """The values themselves, (n,) [SI]."""

    def part_of(self, drawn: Spec) -> Spec:
        """Return the part that is made of a drawing."""


@dataclass(frozen=True)
class Redesign:
    """The drawn values with which the parts of every explanation have the curve that is aimed at."""

    drawn: Spec
    explanations: tuple[MadeAs, ...]
    aim: AimedCurve
    limits: Mapping[str, DrawnRange]
    missed_before: float = 0.0  # by what share of its bound a requirement is missed by the design itself
    of_envelope: bool = False  # whether of all requirements those on the envelope matter alone

    @cached_property
    def start(self) -> FloatArray:
        """The values as drawn, (n,) [SI]."""
        return np.array([float(self.drawn.get_value(path)) for path in self.limits])

    @property
    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper limits of the values, (n,) [SI]."""
        limits = self.limits.values()
        return np.array([limit.low for limit in limits]), np.array([limit.high for limit in limits])

    @property
    def _size(self) -> FloatArray:
        """Typical sizes of the values, (n,) [SI]: the values; of zeros their ranges."""
        return np.where(self.start == 0.0, self._ends[1] - self._ends[0], np.abs(self.start))

    def drawing(self, x: FloatArray) -> Spec:
        """Return the drawing with other values.

        Raises SpecError if they are not valid together.
        """
        return self.drawn.replace(dict(zip(self.limits, x.tolist(), strict=True)))

    def solve(self) -> FloatArray:
        """Return the values, with the digits that the process can hold, (n,) [SI].

        Widths change alone if that is enough: neither shape nor stress change with them. Then thicknesses change, too,
        then all. At last widths make up for the rounding of the others.

        Raises SolutionError if nothing may change.
        """
        if not self.limits:
            raise SolutionError(
                "nothing that is made may change: the design says of no value that it is free; state 'design.free'"
            )
        kinds = [_last_key(path) for path in self.limits]
        stages = [
            [k for k, kind in enumerate(kinds) if kind in names] for names in (("width",), tuple(SECTION_RELUCTANCE))
        ]
        best = self._compensate()
        if self._cost(best) <= CLOSE_DEPARTURE:
            return best
        for free in dict.fromkeys((*map(tuple, stages), tuple(range(len(kinds))))):
            if free:
                best = min(self._solve_for(list(free), best), best, key=self._cost)
                if self._cost(best) <= CLOSE_DEPARTURE:
                    break
        if self._cost(best) > CLOSE_DEPARTURE and not any(stages):
            best = min(self._solve_for(list(range(len(kinds))), self._scaled_links()), best, key=self._cost)
        return min(self._solve_for(stages[0], best), best, key=self._cost) if stages[0] else best

    def _scaled_links(self) -> FloatArray:
        """Return the places of joints, scaled so that springs at them have the force, (n,) [SI].

        It goes with one over all lengths; where a link is stretched it jumps, and a search from the start ends there.
        """
        low, high = self._ends
        curves = analyze_part(self.explanations[0].part_of(self.drawn)).curves
        return np.clip(self.start * self.aim.mean(curves) / self.aim.mean_effort, low, high)

    def _compensate(self) -> FloatArray:
        """Return values in which leaves are drawn thinner by the error that makes them thicker, (n,) [SI].

        As drawn where the recording may be explained without an error of the thickness.
        """
        if not all(any(is_thickness(item) for item in explanation.errors) for explanation in self.explanations):
            return self.start
        changes: dict[str, float] = {}
        for item, value in zip(self.explanations[0].errors, self.explanations[0].values, strict=True):
            if is_thickness(item):
                changes |= item.changes(self.drawn, 2.0 * item.start - float(value))
        x = [changes.get(path, value) for path, value in zip(self.limits, self.start.tolist(), strict=True)]
        return self._round(np.array(x))

    def _round(self, x: FloatArray) -> FloatArray:
        """Return values with the digits that the process can hold, within their limits, (n,) [SI]."""
        low, high = self._ends
        decimals = decimals_of(accuracy_of(self.drawn))
        dimensions = [dimension_of(self.drawn, path) for path in self.limits]
        digits = [
            from_border(round(to_border(value, dimension), decimals), dimension)
            if dimension in ("length", "angle")
            else float(f"{value:.{N_DIGITS}g}")
            for value, dimension in zip(x.tolist(), dimensions, strict=True)
        ]
        return np.where(np.isclose(x, self.start), self.start, np.clip(digits, low, high))

    def _solve_for(self, free: list[int], start: FloatArray) -> FloatArray:
        """Return the values of which some have been moved from a start, (n,) [SI]."""
        from scipy.optimize import least_squares

        size = self._size
        low, high = (end[free] / size[free] for end in self._ends)

        def whole(z: FloatArray) -> FloatArray:
            x = start.copy()
            x[free] = z * size[free]
            return x

        def residuals(z: FloatArray) -> FloatArray:
            return self._residuals(whole(z))

        inside = np.clip(start[free] / size[free], low + 1e-9, high - 1e-9)
        steps = np.full(len(free), RELATIVE_STEP)
        solution = least_squares(
            residuals, inside, bounds=(low, high), diff_step=steps, xtol=1e-8, ftol=1e-8, max_nfev=MAX_STEPS
        )
        return self._round(whole(solution.x))

    def _cost(self, x: FloatArray) -> float:
        """Return the root mean square departure from the aim, with what is missed of requirements."""
        return float(np.linalg.norm(self._residuals(x)[: -len(self.limits)]))

    def _residuals(self, x: FloatArray) -> FloatArray:
        count = N_PLACES * len(self.aim.efforts)
        share = (len(self.aim.places) * len(self.aim.efforts) * len(self.explanations)) ** -0.5
        mean_weight = MEAN_WEIGHT * len(self.explanations) ** -0.5
        departures, missed = [], 0.0
        for number, explanation in enumerate(self.explanations):
            try:
                result = analyze_part(explanation.part_of(self.drawing(x)))
                departure = self.aim.departure(result.curves)
                departures += [share * departure, np.array([mean_weight * float(np.nanmean(departure))])]
                if number == 0:
                    missed = max(0.0, largest_miss(result, self.of_envelope) - self.missed_before)
            except (CfmError, ValueError):
                departures.append(np.full(len(self.aim.places) * len(self.aim.efforts) + 1, NO_CURVE * share))
        curve_errors = np.nan_to_num(np.concatenate(departures), nan=NO_CURVE * count**-0.5)
        reluctance = np.array([SECTION_RELUCTANCE.get(_last_key(path), OTHER_RELUCTANCE) for path in self.limits])
        moved: FloatArray = reluctance * (x - self.start) / self._size
        return np.concatenate([curve_errors, [MISSED_WEIGHT * missed], moved])

    def not_makeable(self, x: FloatArray, force: float) -> NotMakeable:
        """Return why no part has the force, and the nearest force that one has."""
        kind = "torque" if self.drawn.motion == "angle" else "force"
        wanted, reached = (format_short(value, kind, 4) for value in (self.aim.mean_effort, force))
        held = []
        for path, value, limit in zip(self.limits, x.tolist(), self.limits.values(), strict=True):
            dimension = dimension_of(self.drawn, path)
            if np.isclose(value, limit.low, rtol=1e-4):
                held.append(f"{path} {format_short(limit.low, dimension, 4)} ({limit.least})")
            elif np.isclose(value, limit.high, rtol=1e-4):
                held.append(f"{path} {format_short(limit.high, dimension, 4)} (the most that the design allows)")
        why = f", held by {' and '.join(held)}" if held else ""
        message = f"no part that can be made has {wanted}: the nearest has {reached}{why}"
        method = family(self.drawn.family).design
        levels = [path for path in method.levels if _has_number(self.drawn, path)] if method else []
        return NotMakeable(message, {path: reached for path in levels[:1]})


def _has_number(spec: Spec, path: str) -> bool:
    try:
        return isinstance(spec.get_value(path), float)
    except KeyError:
        return False


def dimension_of(spec: Spec, path: str) -> str:
    """Return the dimension of the value at a path."""
    quantity = leaf(type(spec), path).quantity
    return quantity.dimensions[0] if quantity else "ratio"


def largest_miss(result: Result, of_envelope: bool = False) -> float:
    """Return by what share of its bound a requirement is missed, or met by less than `REQUIREMENT_MARGIN`, the largest.

    `of_envelope`: of the requirements on the envelope alone.
    """
    shares = [0.0]
    for outcome in family(result.spec.family).check(result):
        if outcome.value is None or (of_envelope and outcome.metric not in ENVELOPE_METRICS):
            continue
        for bound, sign in ((outcome.max, 1.0), (outcome.min, -1.0)):
            if bound is not None:
                shares.append(sign * (outcome.value - bound) / (abs(bound) or 1.0) + REQUIREMENT_MARGIN)
    return max(shares)

"""Requirements on one manufactured part as inequalities, linear in its force (or torque) and stress at a few poses.

Metrics are largest and smallest values over a window, which have corners. A requirement on one holds if a row of
inequalities does, one for each pose of the window: matrix @ values + constant >= 0. Other metrics are values of their
own. The values of many parts come from the family's rows, or from one analysis each.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import ENVELOPE_METRICS, Sampled
from cfmkit.families.rows import Variants
from cfmkit.families.variant_rows import SingleRow
from cfmkit.metrics import check, split_name, window_of
from cfmkit.metrics.requirements import Bounds
from cfmkit.results import Status
from cfmkit.specs.units import TravelShare
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.variants_in_rows import SolvedVariants

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.metrics.curve_rows import CurveRows, RowSamples
    from cfmkit.results import Result
    from cfmkit.specs.spec import Requirement, Spec
    from cfmkit.studies.point_evaluation import Metric

N_WINDOW_POSES = 15
"""Chebyshev-Lobatto poses in a window; between them the force of a mechanism that is worth making is smooth."""
CONTRADICTION_SHARE = 0.01
"""By so much of its terms a row is below zero where it contradicts the analysis, and not only by rounding."""
NARROW_WINDOW_SHARE = 0.02  # a window that is a smaller share of the whole span has its ends only


@dataclass(frozen=True)
class RequirementRows:
    """Requirements as inequalities in a part's values (efforts, stresses, metrics): matrix @ values + constant >= 0."""

    places: FloatArray  # (p,) poses at which effort and stress are looked at [m or rad]
    branches: tuple[str, ...]  # of the curve
    stresses: int  # rows of stress
    # matrix, constant, (m, q), (m,): ``matrix @ numbers + constant`` is at least zero where all requirements hold
    matrix: FloatArray
    constant: FloatArray
    metrics: tuple[Metric, ...]  # those that are numbers of their own: the last ones
    about: tuple[int, ...]  # to which requirement each row belongs

    @property
    def efforts(self) -> int:
        """Number of the first values that are efforts."""
        return len(self.branches) * len(self.places)

    def limits(self, numbers: FloatArray) -> FloatArray:
        """Return what parts with numbers (..., q) leave of each limit, (..., m)."""
        return np.asarray(numbers @ self.matrix.T + self.constant)


class _RowsOfMargins:
    """Gathers rows over the numbers: each branch at all places, then each stress at all places, then metrics."""

    def __init__(self, nominal: Result, places: FloatArray, first: Sampled) -> None:
        self.nominal, self.places = nominal, places
        self.branches, self.stresses = tuple(first.effort), len(first.stress)
        self.first = first
        self.metrics: list[Metric] = []
        self.rows: list[tuple[dict[int, float], float, int]] = []

    def select_window(self, over: Any) -> Any:
        """Return the numbers of the places in a window."""
        low, high = _window(self.nominal, over)
        slack = 1e-9 * (self.places[-1] - self.places[0])
        return np.flatnonzero((self.places >= low - slack) & (self.places <= high + slack))

    def add(self, requirement: Requirement, number: int) -> None:
        """Add the rows of a requirement."""
        name, branch = split_name(requirement.metric)
        if name in ENVELOPE_METRICS:  # tolerances move the box by next to nothing, and it takes a drawing of each part
            return
        (metric,) = metrics_of(self.nominal.spec, [requirement.metric], self.nominal.curve)
        limits = Bounds.from_requirement(requirement, metric.dimension)
        plain = name.replace("torque_", "force_", 1)
        if plain in _OF_STRESS and self.stresses and self._stress(plain, limits, requirement.over, number):
            return
        if plain in _OF_EFFORT:
            rows_by_branch = [
                rows
                for k, name in enumerate(self.branches)
                if branch in (None, name)
                for rows in [self._effort(plain, limits, requirement.over, k)]
            ]
            if rows_by_branch and all(rows is not None for rows in rows_by_branch):
                added = [(row, constant, number) for rows in rows_by_branch for row, constant in rows or ()]
                if not self._contradicts_analysis(added, requirement):
                    self.rows += added
                    return
        column = self._n_numbers + len(self.metrics)
        self.metrics.append(replace(metric, over=requirement.over, label=str(number)))
        if limits.min is not None:
            self.rows.append(({column: 1.0}, -limits.min, number))
        if limits.max is not None:
            self.rows.append(({column: -1.0}, limits.max, number))

    def _contradicts_analysis(self, rows: list[tuple[dict[int, float], float, int]], requirement: Requirement) -> bool:
        """Return True if rows say that a requirement is missed which the analysis finds met: its points are too few."""
        values = np.concatenate([*self.first.effort.values(), *self.first.stress])
        for row, constant, _ in rows:
            terms = [constant, *(weight * values[column] for column, weight in row.items())]
            if sum(terms) < -CONTRADICTION_SHARE * sum(map(abs, terms)):
                return all(outcome.ok for outcome in check((requirement,), self.nominal))
        return False

    @property
    def _n_numbers(self) -> int:
        return (len(self.branches) + self.stresses) * len(self.places)

    def _stress(self, name: str, limits: Bounds, over: Any, number: int) -> bool:
        """Add rows of the stress; False where they would not say it."""
        allowed = self.nominal.allowable_stress
        most = limits.max if name == "stress_max" else None
        if name == "safety_factor" and allowed is not None and limits.min and limits.max is None:
            most = allowed / limits.min
        if most is None or (limits.min is not None and name == "stress_max"):
            return False
        count, first = len(self.places), len(self.branches) * len(self.places)
        for s in range(self.stresses):
            self.rows += [({first + s * count + int(k): -1.0}, most, number) for k in self.select_window(over)]
        return True

    def _effort(self, name: str, limits: Bounds, over: Any, k: int) -> list[tuple[dict[int, float], float]] | None:
        """Return rows of the effort on one branch; None if they would not say it."""
        at, first = self.select_window(over), k * len(self.places)
        values = self.first.effort[self.branches[k]][at]
        if not len(at) or not np.isfinite(values).all():
            return None
        columns, sign = (first + at).tolist(), float(np.sign(values.mean())) or 1.0
        return _OF_EFFORT[name](_WindowEffort(columns, values, sign, self.places[at], self.nominal.target), limits)

    def rows_of(self) -> RequirementRows:
        """Return all rows."""
        size = self._n_numbers + len(self.metrics)
        matrix = np.zeros((len(self.rows), size))
        for r, (row, _, _) in enumerate(self.rows):
            for column, weight in row.items():
                matrix[r, column] += weight
        constant = np.array([constant for _, constant, _ in self.rows])
        about = tuple(number for _, _, number in self.rows)
        return RequirementRows(self.places, self.branches, self.stresses, matrix, constant, tuple(self.metrics), about)


@dataclass(frozen=True)
class _WindowEffort:
    """The effort on one branch in one window: its columns, its values in the design and its sign."""

    columns: list[int]
    values: FloatArray
    sign: float
    places: FloatArray
    target: float | None

    @cached_property
    def weights(self) -> FloatArray:
        """Weights of the mean over the window."""
        if len(self.places) == 1:
            return np.ones(1)
        widths = np.diff(self.places)
        weights = np.zeros(len(self.places))
        weights[:-1] += 0.5 * widths
        weights[1:] += 0.5 * widths
        return np.asarray(weights / widths.sum())


_Inequalities = list[tuple[dict[int, float], float]]


def _pairs(view: _WindowEffort, above: float, below: float) -> _Inequalities:
    """Return sign (above F_j - below F_i) >= 0 for all pairs."""
    return [({i: -view.sign * below, j: view.sign * above}, 0.0) for i in view.columns for j in view.columns if i != j]


def _half_band(view: _WindowEffort, limits: Bounds) -> _Inequalities | None:
    return None if limits.max is None or limits.min else _pairs(view, 1.0 + limits.max, 1.0 - limits.max)


def _ripple(view: _WindowEffort, limits: Bounds) -> _Inequalities | None:
    return None if limits.max is None or limits.min else _pairs(view, 1.0, 1.0 - limits.max)


def _from_target(view: _WindowEffort, limits: Bounds) -> _Inequalities | None:
    if limits.max is None or limits.min or not view.target:
        return None
    reach, target = limits.max * abs(view.target), view.target
    return [({i: -sign}, reach + sign * target) for i in view.columns for sign in (1.0, -1.0)]


def _from_mean(view: _WindowEffort, limits: Bounds) -> _Inequalities | None:
    if limits.max is None or limits.min:
        return None
    lines: _Inequalities = []
    for i in view.columns:
        for sign in (1.0, -1.0):
            row = {
                j: view.sign * float(w) * (limits.max + sign) for j, w in zip(view.columns, view.weights, strict=True)
            }
            row[i] -= sign * view.sign
            lines.append((row, 0.0))
    return lines


def _mean(view: _WindowEffort, limits: Bounds) -> _Inequalities:
    row = dict(zip(view.columns, view.weights.tolist(), strict=True))
    lines: _Inequalities = [] if limits.min is None else [(row, -limits.min)]
    return lines if limits.max is None else [*lines, ({j: -w for j, w in row.items()}, limits.max)]


def _largest(view: _WindowEffort, limits: Bounds) -> _Inequalities:
    top = view.columns[int(view.values.argmax())]
    lines: _Inequalities = [] if limits.max is None else [({i: -1.0}, limits.max) for i in view.columns]
    return lines if limits.min is None else [*lines, ({top: 1.0}, -limits.min)]


def _smallest(view: _WindowEffort, limits: Bounds) -> _Inequalities:
    bottom = view.columns[int(view.values.argmin())]
    lines: _Inequalities = [] if limits.min is None else [({i: 1.0}, -limits.min) for i in view.columns]
    return lines if limits.max is None else [*lines, ({bottom: -1.0}, limits.max)]


_OF_EFFORT: Mapping[str, Callable[[_WindowEffort, Bounds], _Inequalities | None]] = {
    "half_band": _half_band,
    "force_ripple": _ripple,
    "deviation_from_target": _from_target,
    "deviation_from_mean": _from_mean,
    "force_mean": _mean,
    "force_max": _largest,
    "force_min": _smallest,
}
_OF_STRESS = ("stress_max", "safety_factor")


def _window(nominal: Result, over: Any) -> tuple[float, float]:
    window = window_of(nominal, over)
    motion = nominal.curve.motion
    return (window.lo, window.hi) if window else (float(motion.min()), float(motion.max()))


def stated_places(spec: Spec) -> tuple[float, ...]:
    """Return the places at which windows of requirements are stated to end, which a shorter part may not reach.

    Shares of the travel, and windows that are not stated, are those of each part.
    """
    usual = getattr(getattr(spec, "analysis", None), "window", None)
    windows = [requirement.over or usual for requirement in spec.part_requirements]
    return tuple(float(end) for window in windows if window for end in window if not isinstance(end, TravelShare))


def places_of(nominal: Result) -> FloatArray:
    """Return the poses at which a part is looked at: those of the windows of all requirements."""
    wanted: list[FloatArray] = []
    spans = [_window(nominal, requirement.over) for requirement in nominal.spec.part_requirements]
    whole = max(high for _, high in spans) - min(low for low, _ in spans)
    for low, high in dict.fromkeys(spans):
        share = 0.5 * (
            1.0 - np.cos(np.linspace(0.0, np.pi, N_WINDOW_POSES if high - low > NARROW_WINDOW_SHARE * whole else 2))
        )
        wanted.append(low + (high - low) * share)
        wanted[-1][-1] = high
    places = np.unique(np.concatenate(wanted))
    is_apart = np.append(True, np.diff(places) > 1e-9 * max(whole, 1e-12))
    return np.asarray(places[is_apart])


def requirement_rows(nominal: Result, spec: Spec, run: Run) -> RequirementRows | None:
    """Return the requirements on a specification, whose result is known; None if it is not followed at a few poses."""
    places = places_of(nominal)
    first = sample_part(spec, places, run)
    return None if first is None else rows_of(nominal, first, places)


def rows_of(nominal: Result, first: Sampled, places: FloatArray) -> RequirementRows:
    """Return the requirements on a result as rows of what is seen of its parts."""
    builder = _RowsOfMargins(nominal, places, first)
    for number, requirement in enumerate(nominal.spec.part_requirements):
        builder.add(requirement, number)
    return builder.rows_of()


def sample_part(spec: Spec, places: FloatArray, run: Run, reached: tuple[float, ...] = ()) -> Sampled | None:
    """Return effort and stress of a part at places: by the family's quick way, else from its analysis.

    Where its curve ends a little earlier they are those at its end; None if it does not get to what must be reached.
    """
    sampled = sample_quickly(spec, places)
    if sampled is not None:
        return sampled
    return sample_curves(family(spec.family).analyze(spec, run), places, reached)


def sample_quickly(spec: Spec, places: FloatArray) -> Sampled | None:
    """Return effort and stress of a part at places by the family's quick way; None if it has none."""
    quick = family(spec.family).sample
    return None if quick is None else quick(spec, places)


def sample_curves(result: Result, places: FloatArray, reached: tuple[float, ...]) -> Sampled | None:
    """Return effort and stress at places of the curves of a part, as `sample_part` does."""
    branches = SingleRow(result).branches
    if result.status is not Status.COMPLETE or not _reach(branches, places, reached).all():
        return None
    if any((np.diff(curves.samples.motion[0]) <= 0).any() for curves in branches.values()):
        return None
    sampled = _sample_rows(branches, places)
    if sampled is None:
        return None
    effort, stress = sampled
    largest = np.array([values[0] for values in stress]).reshape(-1, len(places))
    return Sampled({name: values[0] for name, values in effort.items()}, largest)


def _reach(branches: Mapping[str, CurveRows], places: FloatArray, reached: tuple[float, ...]) -> NDArray[np.bool_]:
    """Return which curves have points, and get to all places that must be reached, on every branch."""
    slack = 1e-9 * float(places[-1] - places[0])
    is_reached = np.array([bool(branches)])
    for curves in branches.values():
        low, high = curves.extent
        is_reached = is_reached & (curves.samples.count > 1)
        for place in reached:
            is_reached = is_reached & (low - slack <= place) & (place <= high + slack)
    return is_reached


def _sample_rows(
    branches: Mapping[str, CurveRows], places: FloatArray
) -> tuple[dict[str, FloatArray], list[FloatArray]] | None:
    """Return effort (m, p) by branch and stresses, (m, p) each, of curves at places, or at the nearer end of each.

    None if the stress is not known at points: of traced paths a part alone is solved at these places.
    """
    effort, stress = {}, []
    for name, curves in branches.items():
        low, high = curves.extent
        with np.errstate(all="ignore"):
            values = curves.all_at(
                np.clip(np.broadcast_to(places, (len(low), len(places))), low[:, None], high[:, None])
            )
        if not np.isfinite(values).all():
            values = np.where(np.isfinite(values), values, _interpolate(curves.samples, places))
        effort[name] = values
        if curves.stress is not None:
            if not curves.stress.samples:
                return None
            stress.append(_interpolate(curves.stress.samples[0], places))
    return effort, stress


def _interpolate(samples: RowSamples, places: FloatArray) -> FloatArray:
    """Return values at places between the points of each row, (m, p)."""
    rows = zip(samples.motion, samples.values, samples.count.tolist(), strict=True)
    return np.array([np.interp(places, motion[:count], values[:count]) for motion, values, count in rows])


def numbers_in(seen: Sampled) -> FloatArray:
    """Return efforts and stresses one after the other, as the columns of rows have them."""
    return np.concatenate([*seen.effort.values(), *seen.stress])


def numbers_of(spec: Spec, rows: RequirementRows, run: Run, reached: tuple[float, ...] = ()) -> FloatArray | None:
    """Return what rows look at of a part, (q,); None if it has no such numbers; `reached`: see `sample_part`."""
    sampled, result = sample_quickly(spec, rows.places), None
    if sampled is None:
        result = _analyze_part(spec, rows, run)
        sampled = sample_curves(result, rows.places, reached)
    if not _has_columns(sampled, rows):
        return None
    if not rows.metrics:
        return numbers_in(sampled)
    metrics = metrics_of_part(spec, rows, run) if result is None else metrics_in(result, rows)
    return None if metrics is None else np.concatenate([numbers_in(sampled), metrics])


def numbers_of_parts(
    spec: Spec, values: Mapping[str, FloatArray], rows: RequirementRows, run: Run, reached: tuple[float, ...] = ()
) -> list[FloatArray | None]:
    """Return `numbers_of` many parts, as rows of one solution where the family has them; None of an invalid part.

    `values`: dotted path -> values of the parts, (k,) [SI].
    """
    columns = {path: np.asarray(column) for path, column in values.items()}
    count = min(map(len, columns.values()), default=0)

    def part(k: int) -> Spec:
        return spec.replace({path: column[k].item() for path, column in columns.items()}, as_made=True)

    parts = Variants(spec.model_copy(update={"requirements": ()}), columns, part, count)
    numbers_by_part = dict(_numbers_in_rows(parts, rows, reached))

    def alone(k: int) -> FloatArray | None:
        try:
            return numbers_of(part(k), rows, run, reached)
        except CfmError:
            return None

    return [numbers_by_part[k] if k in numbers_by_part else alone(k) for k in range(count)]


def _numbers_in_rows(
    parts: Variants, rows: RequirementRows, reached: tuple[float, ...]
) -> Iterator[tuple[int, FloatArray | None]]:
    """Yield (index, numbers) of those parts that are solved together and have complete curves."""
    record = family(parts.spec.family)
    if record.rows is None or not len(parts):
        return
    study = Study(parts.spec, tuple(parts.values), rows.metrics, findings=False)
    with suppress(CfmError):  # each part says by itself what is wrong with it
        for members, solved in record.rows(parts):
            variants = SolvedVariants(study, parts, members, solved)
            sampled = _sample_rows(solved.branches, rows.places) if variants.known else None
            if sampled is None or tuple(sampled[0]) != rows.branches or len(sampled[1]) != rows.stresses:
                continue
            noted = variants.rows()
            numbers = np.hstack([*sampled[0].values(), *sampled[1], noted.values])
            good = solved.complete & np.isfinite(numbers).all(axis=1)
            good[list(noted.odd)] = False
            is_reached = _reach(solved.branches, rows.places, reached)
            for row in np.flatnonzero(good).tolist():
                yield int(members[row]), numbers[row] if is_reached[row] else None


def numbers_of_known(result: Result, quick: Sampled | None, rows: RequirementRows) -> FloatArray | None:
    """Return `numbers_of` a part whose analysis is known: nothing is solved again; stated windows must be reached.

    `quick`: what `sample_quickly` says of it at the places of the rows; None of a family without a quick way.
    """
    sampled = sample_curves(result, rows.places, stated_places(result.spec)) if quick is None else quick
    if not _has_columns(sampled, rows):
        return None
    return np.concatenate([numbers_in(sampled), metrics_in(result, rows)]) if rows.metrics else numbers_in(sampled)


def exact_derivatives(spec: Spec, places: FloatArray, paths: Sequence[str]) -> dict[str, Sampled]:
    """Return the derivatives of effort and stress at places, by those values of a design by which they are known."""
    quick = family(spec.family).sample
    try:
        sampled = None if quick is None else quick(spec, places, tuple(paths))
    except CfmError:
        return {}
    return {} if sampled is None else dict(sampled.slopes)


def _has_columns(sampled: Sampled | None, rows: RequirementRows) -> TypeGuard[Sampled]:
    """Return whether a part was seen, with the branches and stresses that rows look at."""
    return sampled is not None and tuple(sampled.effort) == rows.branches and len(sampled.stress) == rows.stresses


def _analyze_part(spec: Spec, rows: RequirementRows, run: Run) -> Result:
    """Return the analysis of a part, with the sizes of its box if rows look at them."""
    record = family(spec.family)
    return record.with_envelope(record.analyze(spec, run), [metric.name for metric in rows.metrics])


def metrics_of_part(spec: Spec, rows: RequirementRows, run: Run) -> FloatArray | None:
    """Return the last of these numbers alone, metrics of a whole analysis; None of a part without a curve."""
    result = _analyze_part(spec, rows, run)
    return metrics_in(result, rows) if result.curves else None


def metrics_in(result: Result, rows: RequirementRows) -> FloatArray:
    """Return those metrics of a result that are numbers of their own in rows; nan where one has no value."""
    values = Study(result.spec, (), rows.metrics).quantities(result)
    return np.array([np.nan if metric_value.value is None else metric_value.value for metric_value in values])

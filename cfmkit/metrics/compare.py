"""Comparison of a mechanism with a reference: the difference of their curves, branch by branch, and changed metrics.

The reference may be a measurement, the finest model or an earlier batch. Nothing is extrapolated, and a branch that
turns back is not compared: it is many-valued.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from cfmkit.metrics.branches import Undefined, Window, traces
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve

    Measure = tuple[Callable[["Difference"], float], str]
    Metrics = Mapping[str, Mapping[str, Any]]

N_COMPARED_PLACES = 1001
"""Where two curves are compared: so many places, evenly over the motion that they have in common."""
COMPARISON_RTOL = 1e-6
"""Relative change that is none: other versions of the libraries round in the last digits, and searches stop there."""
NO_CHANGE = 1e-9
"""Values in border units between which there is no difference: what should be zero is rounding, and rounding varies."""


@dataclass(frozen=True, eq=False)
class Points:
    """Effort of a reference at places of one branch."""

    motion: FloatArray  # (n,) [m or rad]
    effort: FloatArray  # (n,) [N or N m]
    counterpart: str  # the branch that it is compared with
    # (n,) how much each place counts, such as the way that it stands for; None: all alike
    weights: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ComparedSide:
    """One side of a comparison: what is known of a mechanism."""

    name: str  # as sentences call it
    curve: Curve | None = None
    points: Mapping[str, Points] = field(default_factory=dict)  # of a reference without a curve, by branch
    metrics: Metrics = field(default_factory=dict)  # as metrics.json has them, in border units


@dataclass(frozen=True, eq=False)
class Difference:
    """Difference of two curves on one branch."""

    values: FloatArray  # (n,) one less the other at each place [N or N m]; NaN where one of them has no value
    reason: str  # why they cannot be summed up, should one of them be NaN
    # (n,) how much each place counts, such as the way that it stands for; None: all alike
    weights: FloatArray | None = None


def rms(difference: Difference) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.average(difference.values**2, weights=difference.weights)))


def largest(difference: Difference) -> float:
    """Return the value that is largest in magnitude, with its sign."""
    return float(difference.values[np.argmax(np.abs(difference.values))])


def mean(difference: Difference) -> float:
    """Return the mean."""
    return float(np.average(difference.values, weights=difference.weights))


@dataclass(frozen=True)
class MetricChange:
    """One value that is not what it was."""

    # spec, name: the specification, and the metric; ``status`` for how it ended
    spec: str
    name: str
    # before, after: in border units; None if there was no value
    before: float | str | None
    after: float | str | None
    unit: str  # of both
    # the difference over what it was: 1 where it doubled; None if they are not numbers, or it was zero
    relative: float | None
    beyond: bool  # whether it is more than the tolerance

    @property
    def sentence(self) -> str:
        """The change in words."""
        share = "" if self.relative is None else f" ({100 * self.relative:+.3g} %)"
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return f"{self.name}: {_report_change(self.before)} -> {_report_change(self.after)}{unit}{share}"


def _report_change(value: float | str | None) -> str:
    return "no value" if value is None else value if isinstance(value, str) else f"{value:.8g}"


@dataclass(frozen=True, eq=False)
class Differences:
    """One thing less its reference."""

    curves: Mapping[str, Difference]  # by branch of the reference; under "" why there is none
    places: FloatArray  # (n,) where two curves are compared [m or rad]; empty elsewhere
    window: Window | None  # from where to where that is; None if they have no motion in common
    changes: tuple[MetricChange, ...]  # numbers and words that are not those of the reference

    def summarize(self, measures: Mapping[str, Measure], kind: str, tag: str = "") -> dict[str, Quantity]:
        """Return numbers about the curves by branch, and over all where there are several, by name.

        `measures`: name -> (function of a difference, definition; ``{}`` in it becomes the kind); `tag`: which curve,
        where there are several: ``name[tag]`` and ``name[tag,branch]``.
        """
        several, changes = len(self.curves) > 1, {}
        whole = {"": _join_differences(self.curves)} if several else {}
        for branch, item in (whole | dict(self.curves)).items():
            inside = ",".join(part for part in (tag, branch if several else "") if part)
            for name, (function, words) in measures.items():
                value = function(item) if len(item.values) and np.isfinite(item.values).all() else None
                reason = item.reason if value is None else ""
                changes[f"{name}[{inside}]" if inside else name] = Quantity(value, kind, words.format(kind), reason)
        return changes


def compare(
    reference: ComparedSide, compared: ComparedSide, over: Window | None = None, tolerance: float = COMPARISON_RTOL
) -> Differences:
    """Return what something has more than its reference: its curve inside a window, and its metrics.

    `tolerance`: relative change of a metric up to which it counts as the same.
    """
    changes = tuple(_list_changes(reference.metrics, compared, tolerance))
    nothing: FloatArray = np.empty(0)
    if reference.points and compared.curve is not None:
        gap = f"the {compared.name} has no equilibrium at some of the points"
        curves = {
            branch: _subtract_reference(points, compared.curve, gap) for branch, points in reference.points.items()
        }
        return Differences(curves, nothing, over, changes)
    if reference.curve is None or compared.curve is None:
        missing = next((side for side in (compared, reference) if side.curve is None and not side.points), compared)
        return Differences({"": Difference(nothing, f"there is no {missing.name} curve")}, nothing, None, changes)
    fine, coarse = reference.curve, compared.curve
    pairs = {name: counterpart(coarse, name, _direction_of_branch(fine, name)) for name in fine.branches}
    parts = [part for name, its in pairs.items() for part in (fine.select_branch(name), coarse.select_branch(its))]
    window = overlap([(float(part.motion.min()), float(part.motion.max())) for part in parts], over)
    if window is None:
        return Differences({"": Difference(nothing, "they have no travel in common")}, nothing, None, changes)
    places = np.linspace(window.lo, window.hi, N_COMPARED_PLACES)
    curves = {name: _difference_between((fine, name), (coarse, its), places) for name, its in pairs.items()}
    return Differences(curves, places, window, changes)


def _direction_of_branch(curve: Curve, branch: str) -> float:
    motion = curve.select_branch(branch).motion
    return float(motion[-1] - motion[0])


def _difference_between(fine: tuple[Curve, str], coarse: tuple[Curve, str], places: FloatArray) -> Difference:
    try:
        points = Points(places, effort_at(*fine, places), coarse[1])
        return _subtract_reference(points, coarse[0], "there is no equilibrium at some of the places")
    except Undefined as problem:
        return Difference(np.full(len(places), np.nan), problem.reason)


def _subtract_reference(points: Points, curve: Curve, gap: str) -> Difference:
    """Return a curve less its reference at the places of that."""
    try:
        values = effort_at(curve, points.counterpart, points.motion) - points.effort
    except Undefined as problem:
        return Difference(np.full(len(points.motion), np.nan), problem.reason, points.weights)
    return Difference(values, gap, points.weights)


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and math.isfinite(value)


def _list_changes(before: Metrics, compared: ComparedSide, tolerance: float) -> Iterator[MetricChange]:
    after = compared.metrics
    for name in dict.fromkeys((*before, *after)):
        old, new = (side.get(name, {}).get("value") for side in (before, after))
        unit = str((after.get(name) or before.get(name) or {}).get("unit", ""))
        if old == new:
            continue
        if not (_is_number(old) and _is_number(new)):
            yield MetricChange(compared.name, name, old, new, unit, None, True)
        elif abs(new - old) > NO_CHANGE:
            relative = (new - old) / abs(old) if old else None
            beyond = relative is None or abs(relative) > tolerance
            yield MetricChange(compared.name, name, old, new, unit, relative, beyond)


def _join_differences(differences: Mapping[str, Difference]) -> Difference:
    """Return the differences of all branches, with the reason of the first that has a gap."""
    items = list(differences.values())
    gaps = [item.reason for item in items if not np.isfinite(item.values).all()]
    weights = [np.ones(len(item.values)) if item.weights is None else item.weights for item in items]
    values = np.concatenate([item.values for item in items])
    return Difference(values, gaps[0] if gaps else items[0].reason, np.concatenate(weights))


def counterpart(
    curve: Curve,  # where the branch is looked for
    branch: str,  # name of the other curve's branch
    direction: float,  # positive if the motion grows along the other curve's branch
) -> str:
    """Return the branch of a curve to compare with one of another: by name, else by its direction."""
    if branch in curve.branches or len(curve.branches) == 1:
        return branch if branch in curve.branches else curve.branches[0]
    for name in curve.branches:
        motion = curve.select_branch(name).motion
        if direction * (motion[-1] - motion[0]) > 0:
            return name
    return curve.branches[0]


def effort_at(curve: Curve, branch: str, places: FloatArray) -> FloatArray:
    """Return the effort of a branch at some places, linearly between its points; NaN where it has none.

    Raises Undefined if the branch turns back.
    """
    trace = next(item for item in traces(curve) if item.name == branch)
    if not trace.way:
        raise Undefined(f"branch {branch!r} turns back: its {curve.kind} is many-valued")
    motion, effort = trace.motion[:: trace.way], trace.effort[:: trace.way]
    values: FloatArray = np.interp(places, motion, effort, left=np.nan, right=np.nan)
    return values


def overlap(extents: Iterable[tuple[float, float]], wanted: Window | None = None) -> Window | None:
    """Return where all of several intervals of the motion exist, inside the window that is wanted; None if nowhere.

    Examples
    --------
    >>> overlap([(0.0, 0.2), (0.05, 0.3)], Window(0.1, 0.4))
    Window(lo=0.1, hi=0.2)
    """
    ends = [*extents, *([(wanted.lo, wanted.hi)] if wanted else [])]
    lo, hi = max(end[0] for end in ends), min(end[1] for end in ends)
    return Window(lo, hi) if lo < hi else None

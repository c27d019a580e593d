"""Values of metrics on a curve: per branch, and the worst branch where none is named; as numbers, and for files.

Nothing is measured over a window that the curve does not cover, and the user hears of it. Files have one record for
each, in border units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import LazySequence
from cfmkit.errors import UsageError
from cfmkit.metrics.branches import Undefined, Window, covers, span_text, traces
from cfmkit.metrics.curve_rows import rows_of_curve
from cfmkit.metrics.fatigue_and_relaxation import hold_text
from cfmkit.metrics.measuring_frame import MeasuringFrame
from cfmkit.metrics.metric_definitions import (
    definitions,
    metrics_by_name,
    split_name,
    time_of,
    unknown_metric,
)
from cfmkit.metrics.usable_interval_of_all_branches import CycleRows
from cfmkit.results import WINDOW_OUTSIDE, Finding, Quantity, Status
from cfmkit.specs.units import TravelShare, border_unit, to_border, window_places

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve, Kind
    from cfmkit.metrics.definition import Definition
    from cfmkit.results import Result, Searched
    from cfmkit.specs.units import Ends


def as_json(quantity: Quantity) -> dict[str, Any]:
    """Return ``{"value", "unit", "definition"}`` in border units; without a value also the reason.

    Examples
    --------
    >>> from cfmkit.results import Quantity
    >>> as_json(Quantity(0.24, "length", "usable travel"))
    {'value': 240.0, 'unit': 'mm', 'definition': 'usable travel'}
    """
    unit, definition = border_unit(quantity.dimension), quantity.definition
    if quantity.value is None:
        entry: dict[str, Any] = {"value": None, "unit": unit, "definition": definition}
        return entry | {"reason": quantity.reason} if quantity.reason else entry
    value = finite_border(quantity.value, quantity.dimension) if quantity.word is None else quantity.word
    return {"value": value, "unit": unit, "definition": definition}


def finite_border(value: float, dimension: str) -> float | None:
    """Return an SI value in its border unit; None if it is beyond what a float, and so JSON, can hold."""
    number = float(to_border(value, dimension))
    return number if math.isfinite(number) else None


def metrics_json(quantities: Mapping[str, Quantity]) -> dict[str, dict[str, Any]]:
    """Return the block ``metrics`` of metrics.json: the worst of all branches, under it those that differ.

    Examples
    --------
    >>> from cfmkit.results import Quantity
    >>> values = {"force_max": 2.0, "force_max[load]": 2.0, "force_max[unload]": 1.0}
    >>> metrics_json({name: Quantity(value, "force", "largest") for name, value in values.items()})["force_max"]
    {'value': 2.0, 'unit': 'N', 'definition': 'largest', 'branches': {'load': {'value': 2.0}, 'unload': {'value': 1.0}}}
    """
    entries: dict[str, dict[str, Any]] = {}
    branches: dict[str, dict[str, dict[str, Any]]] = {}
    for name, quantity in quantities.items():
        metric, branch = split_name(name)
        if branch is None or metric not in quantities:
            entries[name] = as_json(quantity)
        else:
            shown = as_json(quantity)
            branches.setdefault(metric, {})[branch] = {key: shown[key] for key in OF_BRANCH if key in shown}
    for metric, entries_of_branches in branches.items():
        plain = {key: entries[metric][key] for key in OF_BRANCH if key in entries[metric]}
        if any(entry != plain for entry in entries_of_branches.values()):
            entries[metric]["branches"] = entries_of_branches
    return entries


OF_BRANCH = ("value", "reason")  # keys of a metric that may differ between branches


def flat_metrics(block: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the block ``metrics`` of metrics.json with one entry for each metric and branch.

    Examples
    --------
    >>> found = flat_metrics({"force_max": {"value": 2.0, "unit": "N", "branches": {"unload": {"value": 1.0}}}})
    >>> {name: one["value"] for name, one in found.items()}
    {'force_max': 2.0, 'force_max[unload]': 1.0}
    """
    metrics: dict[str, dict[str, Any]] = {}
    for name, entry in block.items():
        plain = {key: value for key, value in entry.items() if key != "branches"}
        metrics[name] = plain
        for branch, branch_entry in entry.get("branches", {}).items():
            metrics[f"{name}[{branch}]"] = {
                key: value for key, value in plain.items() if key not in OF_BRANCH
            } | branch_entry
    return metrics


def search_json(searched: Mapping[str, Searched]) -> dict[str, dict[str, Any]]:
    """Return the block ``search`` of metrics.json: what a design search knows, with its model and window.

    Examples
    --------
    >>> from cfmkit.results import Quantity, Searched
    >>> search_json({"starts": Searched(Quantity(20.0, "count", "random starts"), "inextensible", (0.0, 0.01))})
    {'starts': {'value': 20.0, 'unit': '1', 'definition': 'random starts', 'model': 'inextensible', \
'window': [0.0, 10.0], 'window_unit': 'mm'}}
    """
    return {name: as_json(item.quantity) | _model_and_window(item) for name, item in searched.items()}


def _model_and_window(searched: Searched) -> dict[str, Any]:
    """Return model and window in border units."""
    window = None if searched.window is None else [finite_border(end, searched.motion) for end in searched.window]
    return {"model": searched.model, "window": window, "window_unit": window and border_unit(searched.motion)}


class Value(NamedTuple):
    """A value in SI, or why there is none."""

    value: float | None
    reason: str = ""


@dataclass(frozen=True)
class Survey:
    """All metrics of one curve over one window; each is computed when it is needed."""

    subject: CycleRows
    frame: MeasuringFrame
    _known: dict[tuple[Definition, str | None], tuple[Value, ...]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def branches(self) -> tuple[str, ...]:
        """The names of the branches."""
        return tuple(self.subject.branches)

    def evaluate_each(self, definition: Definition, branch: str | None = None) -> tuple[Value, ...]:
        """Return the values of a metric: of one branch, of every branch, or of the cycle as a whole."""
        if (definition, branch) not in self._known:
            self._known[definition, branch] = self._compute_values(definition, branch)
        return self._known[definition, branch]

    def _compute_values(self, definition: Definition, branch: str | None) -> tuple[Value, ...]:
        function = definition.function
        if function is None:
            return (Value(None, "it was not computed"),)
        chosen = self.subject.branches
        if definition.argument:
            if branch is None:
                return (Value(None, f"it needs a {definition.argument} in brackets: {definition.name}[1000 h]"),)
            function = partial(function, time=time_of(branch))
        elif branch is not None:
            chosen = {name: rows for name, rows in chosen.items() if name == branch}
        if not chosen:
            return (Value(None, self._explain_no_branch(branch)),)
        if definition.scope == "branch":
            return tuple(_compute_value(function, rows) for rows in chosen.values())
        return (_compute_value(function, self.subject if branch is None else CycleRows(chosen)),)

    def _explain_no_branch(self, name: str | None) -> str:
        if not self.branches:
            return "the curve has no points"
        return f"there is no branch {name!r}; there are {', '.join(map(repr, self.branches))}"

    def worst(self, definition: Definition, values: tuple[Value, ...]) -> Value:
        """Return the value that counts where no branch is named; undefined if it is so on any branch."""
        if len(values) == 1:
            return values[0]
        with_value = [item for item in values if item.value is not None]
        if len(with_value) < len(values):
            return next(item for item in values if item.value is None)
        heights = np.array([[item.value] for item in with_value])
        return with_value[worst_branch(definition.worst, heights, self.frame.target).item()]


def worst_branch(
    rule: str,  # `Definition.worst`; without a target the smallest is the farthest from it
    values: FloatArray,  # (b, n): of b branches of n curves; a NaN counts first
    target: FloatArray | float | None,  # (n,), float or None: of the force or torque
) -> NDArray[np.intp]:
    """Return which branch of each curve counts where none is named, (n,)."""
    if rule == "largest":
        return np.asarray(values.argmax(axis=0))
    if rule == "smallest" or target is None:
        return np.asarray(values.argmin(axis=0))
    return np.asarray(np.abs(values - target).argmax(axis=0))


def _compute_value(function: Callable[..., FloatArray], subject: object) -> Value:
    try:
        (value,) = function(subject).tolist()
    except Undefined as gap:
        return Value(None, gap.reason)
    return Value(value) if isfinite(value) else Value(None, "it is not finite")


def survey(curve: Curve, frame: MeasuringFrame, window: Window | None = None) -> Survey:
    """Return the metrics of a curve, measured in a frame over a window."""
    ends = None if window is None else (np.array([window.lo]), np.array([window.hi]))
    return Survey(CycleRows.from_curves(rows_of_curve(curve, frame), ends), frame)


def measure(
    curve: Curve, frame: MeasuringFrame, window: Window | None = None, extra: Iterable[Definition] = ()
) -> dict[str, Quantity]:
    """Return every metric of a curve by name, with ``[branch]`` variants where there are several branches.

    Parameters
    ----------
    curve : Curve
        Computed or measured.
    frame : MeasuringFrame
        Target, reference pose, allowable stress, band.
    window : Window, optional
        Where to measure; default: the whole of each branch.
    extra : iterable of Definition
        More metrics, computed by their functions.
    """
    return _measure_all(survey(curve, frame, window), definitions(curve.kind, extra))


@np.errstate(all="ignore")
def _measure_all(view: Survey, table: Iterable[Definition]) -> dict[str, Quantity]:
    return dict(item for definition in table for item in _entries(view, definition))


def _entries(view: Survey, definition: Definition) -> Iterator[tuple[str, Quantity]]:
    """Yield the worst branch's value under the plain name, then each branch's."""
    durability = view.frame.durability
    if definition.function is None or (definition.of_material and durability is None):
        return
    if definition.of_curve and view.frame.curve is None:
        return
    if definition.of_parts and view.frame.part_efforts is None:
        return
    if definition.argument:
        for text in map(hold_text, durability.holds if durability else ()):
            worst = view.worst(definition, view.evaluate_each(definition, text))
            yield f"{definition.name}[{text}]", _quantity(definition, worst)
        return
    values = view.evaluate_each(definition)
    yield definition.name, _quantity(definition, view.worst(definition, values))
    if len(values) > 1:
        for branch, value in zip(view.branches, values, strict=True):
            yield f"{definition.name}[{branch}]", _quantity(definition, value)


def _quantity(definition: Definition, value: Value) -> Quantity:
    return Quantity(value.value, definition.dimension, definition.definition, value.reason)


def frame_of(result: Result) -> MeasuringFrame:
    """Return what the curves of a result are measured against."""
    band = getattr(getattr(result.spec, "analysis", None), "band", MeasuringFrame.band)
    return MeasuringFrame(
        result.target,
        result.reference,
        result.allowable_stress,
        band,
        result.valid,
        result.load_cases,
        result.closed,
        winding=result.winding,
        durability=getattr(result.spec, "durability", None),
        ends=result.ends,
        curve=result.target_curve or getattr(result.spec, "target_curve", None),
        effort_error=result.effort_error,
        part_efforts=result.part_efforts,
    )


def travel_of(result: Result) -> tuple[float, float] | None:
    """Return where the motion was to start and to end [m or rad]; None if that is not known."""
    if result.travel is not None or not result.curves or not len(result.curves[0]):
        return result.travel
    first = traces(result.curves[0])[0]
    low, high = first.extent
    return (low, high) if first.motion[0] - low <= high - first.motion[0] else (high, low)


def window_of(result: Result, over: Ends | None = None) -> Window | None:
    """Return a window in places, by default ``analysis.window``; None for the full travel.

    Raises
    ------
    cfmkit.errors.InputError
        If it has no width.
    """
    # a family need not have this block, and no family is named here
    ends = over if over is not None else getattr(getattr(result.spec, "analysis", None), "window", None)
    travel = travel_of(result)
    if ends is None or (travel is None and any(isinstance(end, TravelShare) for end in ends)):
        return None
    return Window(*window_places(ends, travel or (0.0, 0.0)))


def kind_of(result: Result) -> Kind | None:
    """Return the kind of the nominal curve; None without a curve."""
    return result.curves[0].kind if result.curves else None


Surveys = dict[Window | None, Survey | None]
"""What is known of the nominal curve of one result: whoever asks again, asks the same."""


def survey_of(result: Result, window: Window | None, surveys: Surveys | None = None) -> Survey | None:
    """Return the metrics of the nominal curve over a window; None without a curve."""
    known_surveys: Surveys = {} if surveys is None else surveys
    if window not in known_surveys:
        known_surveys[window] = survey(result.curves[0], frame_of(result), window) if result.curves else None
    return known_surveys[window]


def shorten_window(window: Window | None, result: Result) -> Window | None:
    """Return what is left of a window inside which the curve of a partial result ends; else the window itself."""
    if window is None or result.status is not Status.PARTIAL or not result.curves or not len(result.curves[0]):
        return window
    extents = [trace.extent for trace in traces(result.curves[0])]
    low, high = max(window.lo, *(low for low, _ in extents)), min(window.hi, *(high for _, high in extents))
    return Window(low, high) if low < high else window


def evaluate(
    result: Result,
    names: Iterable[str] | None = None,
    window: Window | None = None,
    extra_definitions: Iterable[Definition] = (),
    surveys: Surveys | None = None,
) -> dict[str, Quantity]:
    """Return the metrics of the nominal curve and the family's own values, by name.

    Parameters
    ----------
    result : Result
        Of any status; without a curve only the family's values exist.
    names : iterable of str, optional
        Only these (``force_mean``, ``force_mean[load]``, a family's value); default: all.
    window : Window, optional
        Default: ``analysis.window``, else the full travel. Of a partial result whose curve ends
        inside it, what is left of it (requirements over it are missed all the same).
    extra_definitions : iterable of Definition
        A family's metrics beside those of the contract.
    surveys : dict, optional
        What is known of this result already, and where to note what is found out.

    Returns
    -------
    dict of str to Quantity
        SI; a value of None carries its reason. A family's own value replaces a metric of the same name.

    Raises
    ------
    cfmkit.errors.UsageError
        If one of `names` exists neither as a metric nor as a value of the family.
    """
    view = survey_of(result, shorten_window(window or window_of(result), result), surveys)
    kind, extra = kind_of(result), tuple(extra_definitions)
    if names is not None:
        by_name = metrics_by_name(kind, extra)
        return {name: result.values.get(name) or _named_quantity(view, name, by_name, result) for name in names}
    return ({} if view is None else _measure_all(view, definitions(kind, extra))) | dict(result.values)


def mean_effort(result: Result) -> float | None:
    """Return the mean force or torque over the window [N or N m]; None without a curve, or where it has none."""
    if not result.curves:
        return None
    name = f"{result.curve.kind}_mean"
    return evaluate(result, [name])[name].value


@np.errstate(all="ignore")
def _named_quantity(view: Survey | None, name: str, definitions: Mapping[str, Definition], result: Result) -> Quantity:
    metric, branch = split_name(name)
    if metric not in definitions:
        raise UsageError(unknown_metric(metric, [*definitions, *result.values]))
    definition = definitions[metric]
    if view is None:
        return Quantity(None, definition.dimension, definition.definition, result.message)
    return _quantity(definition, view.worst(definition, view.evaluate_each(definition, branch)))


@dataclass(frozen=True)
class UncoveredWindow:
    """A window that some branch of the nominal curve does not cover."""

    window: Window  # in places
    paths: tuple[str, ...]  # where the specification states it
    common: tuple[float, float]  # what all branches cover [m or rad]
    kind: Kind  # of the curve

    @property
    def short(self) -> str:
        """Why there is no value, for the row of a table."""
        wanted, covered = span_text(self.window.lo, self.window.hi, self.kind), span_text(*self.common, self.kind)
        return f"no value over {wanted} ({', '.join(self.paths)}): the curve covers only {covered}"


def gaps(result: Result) -> tuple[UncoveredWindow, ...]:
    """Return each window of the specification that some branch of the nominal curve does not cover."""
    if not result.curves or not len(result.curves[0]):
        return ()
    windows = ((path, window_of(result, ends)) for path, ends in result.spec.windows())
    return find_uncovered(windows, [trace.extent for trace in traces(result.curves[0])], result.curves[0].kind)


def find_uncovered(
    windows: Iterable[tuple[Sequence[Any], Window | None]],  # path in the specification, and the window in places
    extents: Sequence[tuple[float, float]],  # of the branches of a curve
    kind: Kind,  # of the curve
) -> tuple[UncoveredWindow, ...]:
    """Return each window that some branch of a curve does not cover."""
    paths: dict[Window, list[str]] = {}
    for path, window in windows:
        if window is not None and not all(covers(extent, window) for extent in extents):
            paths.setdefault(window, []).append(".".join(map(str, path)))
    common = max(low for low, _ in extents), min(high for _, high in extents)
    return tuple(UncoveredWindow(window, tuple(where), common, kind) for window, where in paths.items())


def warn_of_uncovered_windows(result: Result) -> Result:
    """Return a result that warns of windows that its nominal curve does not cover."""
    warnings = tuple(Finding(WINDOW_OUTSIDE, _report_gap(gap, result)) for gap in gaps(result))
    return replace(result, warnings=LazySequence(lambda: (*result.warnings, *warnings))) if warnings else result


def _report_gap(gap: UncoveredWindow, result: Result) -> str:
    (low, high), window, kind = gap.common, gap.window, gap.kind
    text = f"{' and '.join(gap.paths)}: the window {span_text(window.lo, window.hi, kind)} is not within the curve, "
    text += span_text(low, high, kind)
    travel = travel_of(result)
    if result.status is Status.PARTIAL and travel is not None and min(travel) <= window.lo and window.hi <= max(travel):
        text += f", which ends before the requested travel does ({span_text(min(travel), max(travel), kind)})"
    if (left := shorten_window(window, result)) != window and left is not None:
        return (
            f"{text}: metrics are taken over {span_text(left.lo, left.hi, kind)}, and requirements over the window are "
            "missed"
        )
    return (
        f"{text}; metrics over it have no value. Choose a window inside the curve, or shares of the travel: [1 %, "
        "100 %]"
    )

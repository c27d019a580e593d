"""Requirements of a specification: are they well put, does a result meet them, and how a value stands to its bounds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.errors import Problem, QuantityError, SpecError
from cfmkit.metrics.branches import span_text
from cfmkit.metrics.metric_definitions import (
    branch_fault,
    known_metrics,
    split_name,
    unknown_metric,
    values_of_family,
    words,
)
from cfmkit.metrics.metric_values import Survey, Surveys, Value, finite_border, kind_of, survey_of, window_of
from cfmkit.specs.further_metrics import OF_MANY_PARTS
from cfmkit.specs.units import (
    DIMENSIONS_BY_NAME,
    SHARE_DIMENSION,
    border_unit,
    format_short,
    meant_as_percent,
    read_one_of,
    to_border,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.metrics.branches import Window
    from cfmkit.metrics.definition import Definition
    from cfmkit.results import Quantity, Result
    from cfmkit.specs.spec import Requirement


BOUND_RTOL = 1e-9
"""A value on its bound is within it, whatever the conversion of units does to the last bits (relative)."""


@lru_cache(maxsize=256)
def bound(text: str | None, dimensions: tuple[str, ...]) -> float | None:
    """Return a bound in SI from its text, read in one of some dimensions; None if there is none."""
    return None if text is None else read_one_of(text, dimensions)[0]


@dataclass(frozen=True)
class Bounds:
    """The bounds of one requirement, as numbers and as they were written."""

    dimension: str
    min: float | None
    max: float | None
    text: str

    @classmethod
    def from_requirement(cls, requirement: Requirement, dimension: str) -> Bounds:
        """Return the bounds of a requirement that has been validated."""
        low, high = bound(requirement.min, (dimension,)), bound(requirement.max, (dimension,))
        if requirement.min is None:
            text = f"allowed <= {requirement.max}"
        elif requirement.max is None:
            text = f"required >= {requirement.min}"
        else:
            text = f"required {requirement.min} ... {requirement.max}"
        return cls(dimension, low, high, text)

    def is_met(self, value: float | None) -> bool:
        """Return whether a value keeps both bounds."""
        return value is not None and bool(self.met_by(np.array(value)))

    def met_by(self, values: FloatArray) -> NDArray[np.bool_]:
        """Return which of many values keep both bounds; NaN does not."""
        high = np.inf if self.max is None else self.max + BOUND_RTOL * abs(self.max)
        low = -np.inf if self.min is None else self.min - BOUND_RTOL * abs(self.min)
        return np.asarray((values <= high) & (values >= low))

    def margin(self, item: Value) -> float:
        """Return how far a value is inside the bounds; least for none."""
        if item.value is None:
            return -float("inf")
        gaps = [item.value - self.min] if self.min is not None else []
        return min([*gaps, self.max - item.value] if self.max is not None else gaps)

    def sentence(self, metric: str, item: Value, over: str) -> str:
        """Return the outcome in one line."""
        name = words(metric)
        if item.value is None:
            return f"{name}{over}: no value ({item.reason}), {self.text}: missed"
        return (
            f"{name} {self.format_value(item.value)}{over}, {self.text}: "
            f"{'ok' if self.is_met(item.value) else 'missed'}"
        )

    def format_value(self, value: float) -> str:
        """Return a value rounded for reading, but never so far that it seems to be on the other side of a bound."""
        for digits in range(4, 18):
            rounded = float(f"{to_border(value, self.dimension):.{digits}g}") / float(to_border(1.0, self.dimension))
            if self.is_met(rounded) == self.is_met(value):
                break
        if self.dimension == "ratio" and "%" not in self.text:
            return f"{value:.{digits}g}"
        return format_short(value, self.dimension, digits)


_MOTION_DIMENSIONS = {"force": "length", "torque": "angle"}


@dataclass(frozen=True, repr=False)
class Outcome(ShortRepr):
    """Outcome of one requirement; SI throughout."""

    metric: str  # as written in the requirement
    dimension: str  # of the metric
    value: float | None  # the branch that is closest to breaking the requirement, or breaks it most; None: no value
    # min, max: the bounds
    min: float | None
    max: float | None
    # the window it was measured over; None: the full travel, or not a matter of a window
    over: tuple[float, float] | None
    kind: Kind  # of the curve, which says whether `over` is a length or an angle
    ok: bool  # whether it is met. Without a value it is not
    sentence: str  # all of that in one line

    @property
    def unit(self) -> str:
        """The border unit of value and bounds."""
        return border_unit(self.dimension)

    def as_json(self) -> dict[str, Any]:
        """Return a JSON-ready record in border units."""
        numbers = {key: self._border(getattr(self, key), self.dimension) for key in ("value", "min", "max")}
        motion = _MOTION_DIMENSIONS[self.kind]
        over = None if self.over is None else [self._border(end, motion) for end in self.over]
        window = {"over": over, "over_unit": None if over is None else border_unit(motion)}
        return {"metric": self.metric, **numbers, "unit": self.unit, **window, "ok": self.ok, "sentence": self.sentence}

    @staticmethod
    def _border(value: float | None, dimension: str) -> float | None:
        return None if value is None else finite_border(value, dimension)


def requirement_problems(
    requirements: Sequence[Requirement],
    definitions: Iterable[Definition],
    kind: Kind | None = None,
    branches: Sequence[str] = (),
) -> Iterator[Problem]:
    """Yield what is wrong with requirements: unknown metrics or branches, bounds and windows of the wrong dimension."""
    table = _group_by_name(definitions)
    for index, requirement in enumerate(requirements):
        for key, message in _faults(requirement, table, kind, branches):
            yield Problem("", 0, 0, f"requirements.{index}.{key}", message)


def _group_by_name(definitions: Iterable[Definition]) -> dict[str, list[Definition]]:
    table: dict[str, list[Definition]] = {}
    for item in definitions:
        table.setdefault(item.name, []).append(item)
    return table


def _faults(
    requirement: Requirement,
    table: Mapping[str, Sequence[Definition]],
    kind: Kind | None,
    branches: Sequence[str],
) -> Iterator[tuple[str, str]]:
    """Yield (key, what is wrong) for one requirement."""
    name, branch = split_name(requirement.metric)
    if requirement.metric in OF_MANY_PARTS:
        faults = tuple(_bound_faults(requirement, ("ratio",)))
        bounds = {} if faults else {"min": requirement.min, "max": requirement.max}
        yield from faults
        for key, text in bounds.items():
            if (bound(text, ("ratio",)) or 0.0) > 1:
                yield key, f"{name!r} is a share of parts, at most 100 %: {text} cannot be reached"
        if requirement.over is not None:
            yield "over", f"{name!r} is a share of parts, which has no window; remove 'over'"
        return
    if name not in table:
        yield "metric", unknown_metric(name, table)
        return
    meant = table[name]
    if branch is not None and (reported := branch_fault(meant[0], branch, branches)):
        yield "metric", reported
    yield from _bound_faults(requirement, tuple(dict.fromkeys(item.dimension for item in meant)))
    if requirement.over is not None:
        yield from _window_faults(requirement.over, meant[0], kind)


def _bound_faults(requirement: Requirement, dimensions: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    bounds = []
    for key, text in (("min", requirement.min), ("max", requirement.max)):
        try:
            bounds.append(bound(text, dimensions))
        except QuantityError as problem:
            yield key, f"a bound of {requirement.metric!r}: {problem}"
            return
        if text is not None and dimensions == ("ratio",) and (meant := meant_as_percent(text)):
            share = format_short(bounds[-1] or 0.0, "ratio")
            yield key, f"a bound of {requirement.metric!r}: {text} is {share}; did you mean {meant}?"
            return
    low, high = bounds
    if low is not None and high is not None and low > high:
        yield "max", f"'max' ({requirement.max}) is below 'min' ({requirement.min})"


def _window_faults(over: tuple[float, float], meant: Definition, kind: Kind | None) -> Iterator[tuple[str, str]]:
    if meant.scope == "value":
        yield "over", f"{meant.name!r} is not measured over a window; remove 'over'"
        return
    dimensions = {getattr(end, "dimension", _MOTION_DIMENSIONS.get(kind or "", "length")) for end in over} - {
        SHARE_DIMENSION
    }
    if len(dimensions) > 1:
        yield "over", "one end is a length and the other an angle"
    elif kind is not None and dimensions - {_MOTION_DIMENSIONS[kind]}:
        right, wrong = DIMENSIONS_BY_NAME[_MOTION_DIMENSIONS[kind]].phrase, DIMENSIONS_BY_NAME[dimensions.pop()].phrase
        yield "over", f"the curve is a {kind} curve: its window is {right}, not {wrong}"


def check(
    requirements: Sequence[Requirement],
    result: Result,
    extra_definitions: Iterable[Definition] = (),
) -> tuple[Outcome, ...]:
    """Return the outcome of every requirement on a result, in their order.

    Where no branch is named, all branches must meet it. A metric that has no value (the curve ends before the window
    does, there is no target) is missed.

    Raises
    ------
    cfmkit.errors.SpecError
        If a requirement is not well put: see `requirement_problems`.
    """
    kind = kind_of(result)
    extra = tuple(extra_definitions)
    named = {definition.name for definition in extra}  # of these the value need not be computed to know its dimension
    family_values = {name: result.values[name] for name in result.values if name not in named}
    values = values_of_family(
        {name: (quantity.dimension, quantity.definition) for name, quantity in family_values.items()}
    )
    definitions = [*known_metrics(kind, extra), *values]
    problems = tuple(requirement_problems(requirements, definitions, kind))
    if problems:
        raise SpecError(problems)
    table = _group_by_name(definitions)
    surveys: Surveys = {}
    return tuple(_judge_requirement(requirement, result, table, surveys) for requirement in requirements)


def judge_part_metric(requirement: Requirement, quantity: Quantity) -> Outcome:
    """Return the outcome of a requirement on a metric of many parts, such as their yield."""
    limits = Bounds.from_requirement(requirement, quantity.dimension)
    value = Value(quantity.value, quantity.reason)
    reported = limits.sentence(requirement.metric, value, "")
    ends = limits.min, limits.max
    return Outcome(
        requirement.metric,
        quantity.dimension,
        quantity.value,
        *ends,
        None,
        "force",
        limits.is_met(quantity.value),
        reported,
    )


@np.errstate(all="ignore")
def _judge_requirement(
    requirement: Requirement,
    result: Result,
    table: Mapping[str, Sequence[Definition]],
    surveys: Surveys,
) -> Outcome:
    definition = _intended_definition(requirement, table[split_name(requirement.metric)[0]])
    window = window_of(result, requirement.over)
    values = _values(requirement.metric, definition, survey_of(result, window, surveys), result)
    limits = Bounds.from_requirement(requirement, definition.dimension)
    value = min(values, key=limits.margin)
    kind = kind_of(result) or "force"
    measured = window if definition.scope != "value" else None
    return Outcome(
        requirement.metric,
        definition.dimension,
        value.value,
        limits.min,
        limits.max,
        (measured.lo, measured.hi) if measured else None,
        kind,
        limits.is_met(value.value),
        limits.sentence(requirement.metric, value, _format_window(definition, window, kind)),
    )


def _intended_definition(requirement: Requirement, items: Sequence[Definition]) -> Definition:
    """Return the definition in whose dimension the bounds are: without a curve nothing else tells angle from length."""
    return next((item for item in items if not list(_bound_faults(requirement, (item.dimension,)))), items[0])


def _values(name: str, definition: Definition, view: Survey | None, result: Result) -> tuple[Value, ...]:
    """Return the values that must all keep the bounds."""
    if name in result.values:
        quantity = result.values[name]
        return (Value(quantity.value, quantity.reason or "the mechanism has none"),)
    return (Value(None, result.message),) if view is None else view.evaluate_each(definition, split_name(name)[1])


def _format_window(definition: Definition, window: Window | None, kind: Kind) -> str:
    if not definition.windowed:
        return ""
    return f" over {span_text(window.lo, window.hi, kind)}" if window else " over the full travel"

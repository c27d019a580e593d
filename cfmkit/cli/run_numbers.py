"""Which numbers a run shows, and how each is worded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit import api
from cfmkit.families import family
from cfmkit.metrics import Window, known_metrics, left_of, split_name, window_of
from cfmkit.specs.many_parts_metrics import OF_MANY_PARTS
from cfmkit.specs.units import border_unit, format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.metrics import Outcome
    from cfmkit.results import Quantity, Searched
    from cfmkit.runs.run_findings import Report
    from cfmkit.specs.spec import Requirement, Spec

HEADLINE = (
    "force_mean",
    "torque_mean",
    "usable_stroke",
    "force_ripple",
    "torque_ripple",
    "hysteresis_area",
    "stress_max",
    "allowable_stress",
    "safety_factor",
)
"""Metrics that are shown of every family, as far as they have a value."""


@dataclass(frozen=True)
class NumberRow:
    """One line: what it is, its value, and the bound that it had to keep."""

    label: str
    value: str
    bound: str = ""
    ok: bool | None = None


def rows(report: Report, everything: bool = False) -> list[NumberRow]:
    """Return the lines of a report: numbers first, then what was required.

    Parameters
    ----------
    report : Report
        Of any status; without a curve there are none.
    everything : bool
        Every metric that has a value, not only those that matter most.
    """
    if not report.result.status.usable:
        return []
    asked = {outcome.metric for outcome in report.requirements}
    wanted = report.metrics if everything else (*family(report.result.spec.family).headline, *HEADLINE)
    plain = [name for name in dict.fromkeys(wanted) if name not in asked and "[" not in name]
    found = [_number(report, name) for name in plain if _has_value(report, name)]
    spec = report.result.spec
    judged = spec.requirements if len(report.requirements) == len(spec.requirements) else spec.part_requirements
    required = zip(judged, report.requirements, strict=True)
    return [*found, *(_requirement(report, *pair) for pair in required)]


def searched(found: Mapping[str, Searched]) -> list[str]:
    """Return what only a design search knows: one paragraph for each model and window, which it names first."""
    groups: dict[str, list[str]] = {}
    for name, one in found.items():
        if one.quantity.value is not None:
            over = "" if one.window is None else f", {span(*one.window, one.motion)}"
            groups.setdefault(one.model + over, []).append(f"{words(name)} {_short(one.quantity)}")
    return [f"{about}: {', '.join(told)}" for about, told in groups.items()]


def words(name: str) -> str:
    """Return a metric's name as people say it.

    Examples
    --------
    >>> words("force_mean[load]")
    'force mean on load'
    """
    metric, branch = split_name(name)
    return metric.replace("_", " ") + (f" on {branch}" if branch else "")


def span(low: float, high: float, dimension: str) -> str:
    """Return an interval with one unit, rounded for reading.

    Examples
    --------
    >>> span(0.002, 0.24, "length")
    '2 ... 240 mm'
    """
    numbers = (f"{float(to_border(value, dimension)):.4g}" for value in (low, high))
    return f"{' ... '.join(numbers)} {border_unit(dimension)}"


def _has_value(report: Report, name: str) -> bool:
    quantity = report.metrics.get(name)
    return quantity is not None and quantity.value is not None


def _number(report: Report, name: str) -> NumberRow:
    if name == "usable_stroke":
        return NumberRow(words(name), _stroke(report))
    if name == "allowable_stress":
        return NumberRow(words(name), _short(report.metrics[name]) + _rule(report.result.spec))
    window = left_of(window_of(report.result), report.result)
    return NumberRow(words(name), _branches(report, name, report.metrics) + _over(report, name, window))


def _stroke(report: Report) -> str:
    """Return the usable stroke with its ends and the travel that was run."""
    stroke, start, end = (report.metrics[name] for name in ("usable_stroke", "usable_start", "usable_end"))
    length, motion = _short(stroke), report.result.curve.motion
    if start.value is None or end.value is None:
        return length
    run = span(float(motion.min()), float(motion.max()), stroke.dimension)
    return f"{length}: {span(start.value, end.value, stroke.dimension)} of {run}"


def _rule(spec: Spec) -> str:
    """Return by which rule a stress is allowed, where the mechanism says how much of its strength may be used."""
    try:
        return f": yield strength / {spec.at('mechanism.safety_factor'):.4g}"
    except KeyError:
        return ""


def _branches(report: Report, name: str, metrics: Mapping[str, Quantity]) -> str:
    """Return the value on each branch where they differ, else the one value."""
    each = {branch: metrics.get(f"{name}[{branch}]") for branch in report.result.curve.branches}
    texts = {branch: _short(item, 3) for branch, item in each.items() if item is not None and item.value is not None}
    if len(texts) == len(each) and len(set(texts.values())) > 1:
        return ", ".join(f"{text} {branch}" for branch, text in texts.items())
    return _short(metrics[name])


def _short(quantity: Quantity, digits: int = 4) -> str:
    if quantity.word is not None:
        return quantity.word
    return "no value" if quantity.value is None else format_short(quantity.value, quantity.dimension, digits)


def _over(report: Report, name: str, window: Window | None) -> str:
    """Return the window, if there is one and the metric looks only inside."""
    curve = report.result.curve
    windowed = {item.name for item in known_metrics(curve.kind) if item.windowed}
    if window is None or split_name(name)[0] not in windowed:
        return ""
    return f" over {span(window.lo, window.hi, curve.motion_dimension)}"


def _requirement(report: Report, requirement: Requirement, outcome: Outcome) -> NumberRow:
    label = words(outcome.metric)
    if outcome.value is None:
        reason = outcome.sentence.partition("no value (")[2].rpartition("), ")[0]
        return NumberRow(label, f"no value: {reason}", _bound(requirement), False)
    if outcome.ok:
        return NumberRow(label, _kept(report, outcome), _bound(requirement), True)
    # The sentence rounds so that the value stays on its side of the bound.
    missed = outcome.sentence.rpartition(", ")[0].removeprefix(label).strip()
    return NumberRow(label, missed, _bound(requirement), False)


def _kept(report: Report, outcome: Outcome) -> str:
    """Return the value of a metric that keeps its bound, branch by branch, over the window it was measured in."""
    if outcome.metric in OF_MANY_PARTS:
        return _short(report.metrics[outcome.metric], 3)
    window = Window(*outcome.over) if outcome.over else None
    measured = api.evaluate(report.result, window=window)
    return _branches(report, outcome.metric, measured) + _over(report, outcome.metric, window)


def _bound(requirement: Requirement) -> str:
    if requirement.min is None:
        return f"<= {requirement.max}"
    return f">= {requirement.min}" if requirement.max is None else f"{requirement.min} ... {requirement.max}"

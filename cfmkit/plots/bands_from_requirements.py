"""Requirements on the force or a value of the family as bands and limits for figures.

A requirement that bounds the force is a band of force over a window. One on the ripple says how wide the force may
spread below its largest value, one on a deviation how far it may be from its mean or target: each is a band once the
branch that it is judged on is known. Without a branch in its name that is the worst one, as in the metrics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.metrics import Undefined, Window, check, frame_of, split_name, survey
from cfmkit.plots.axis_labels_and_headings import value_text
from cfmkit.plots.stacked_line_diagrams import Limit

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.metrics import Outcome
    from cfmkit.metrics.rows_in_window import RowsInWindow
    from cfmkit.results import Result

Bounds = tuple[float | None, float | None]
OneSpread = tuple[float, float, float]  # mean, largest and smallest effort in the effort's own direction
BandNeed = tuple[float, float, float]  # the ends of a band, and what ranks branches: how much of it they need


@dataclass(frozen=True)
class Band:
    """Band in which a force or torque must be, in SI."""

    # low, high: bounds of the effort [N or N m]; None if there is none
    low: float | None
    high: float | None
    # start, stop: window of the motion [m or rad]
    start: float
    stop: float
    text: str  # what the requirement says and what the curve does
    met: bool  # whether the curve keeps it


def bands_of(result: Result) -> tuple[Band, ...]:
    """Return the bands of every requirement on the force or torque of the nominal curve."""
    if not result.curves:
        return ()
    kind = result.curves[0].kind
    wanted = [item for item in result.spec.requirements if _quantity_of_metric(item.metric, kind) in _BAND_LABELS]
    bands = (_band_of_outcome(outcome, result) for outcome in check(wanted, result))
    return tuple(band for band in bands if band is not None)


def limits_on(result: Result, metric: str) -> tuple[Limit, ...]:
    """Return what the requirements allow of one of the family's values, as lines for a diagram of it."""
    wanted = [item for item in result.spec.requirements if item.metric == metric]
    limits = []
    for outcome in check(wanted, result):
        for bound, sign in ((outcome.min, "≥"), (outcome.max, "≤")):
            if bound is not None:
                text = f"required {sign} {value_text(bound, outcome.dimension)}"
                limits.append(Limit(bound, text, trouble=not outcome.ok))
    return tuple(limits)


def _quantity_of_metric(metric: str, kind: str) -> str:
    """Return ``ripple`` for ``force_ripple[load]``."""
    return split_name(metric)[0].removeprefix(f"{kind}_")


def _band_of_outcome(outcome: Outcome, result: Result) -> Band | None:
    metric, branch = split_name(outcome.metric)
    metric = _quantity_of_metric(metric, outcome.kind)
    window = Window(*outcome.over) if outcome.over else None
    subjects = survey(result.curves[0], frame_of(result), window).subject.branches
    chosen = {name: rows for name, rows in subjects.items() if branch in (None, name)}
    if not chosen:
        return None
    rule = _BAND_RULES.get(metric)
    worst = None
    if metric in ("min", "max"):
        bounds: Bounds | None = outcome.min, outcome.max
    elif outcome.max is None:
        return None
    elif rule is None:
        bounds = _band_about_target(result.target, outcome.max)
    else:
        bounds, worst = _worst_branch(chosen, rule, outcome.max)
    if bounds is None:
        return None
    which = f" ({worst})" if worst and len(subjects) > 1 else ""
    start, stop = (float(end[0]) for end in next(iter(chosen.values())).ends)
    return Band(
        *bounds, start, stop, _describe_outcome(outcome, _BAND_LABELS[metric].format(outcome.kind) + which), outcome.ok
    )


def _band_of_ripple(spread: OneSpread, limit: float) -> BandNeed:
    _, high, low = spread
    return (1.0 - limit) * high, high, (high - low) / high


def _band_of_half_width(spread: OneSpread, limit: float) -> BandNeed:
    _, high, low = spread
    middle = 0.5 * (high + low)
    return (1.0 - limit) * middle, (1.0 + limit) * middle, (high - low) / high


def _band_about_mean(spread: OneSpread, limit: float) -> BandNeed:
    mean, high, low = spread
    return (1.0 - limit) * mean, (1.0 + limit) * mean, max(high - mean, mean - low) / mean


_BAND_LABELS = {
    "min": "smallest {}",
    "max": "largest {}",
    "ripple": "ripple",
    "half_band": "half band",
    "deviation_from_mean": "deviation from mean",
    "deviation_from_target": "deviation from target",
}  # metrics that are bands, and what they are called on a picture
_BAND_RULES = {"ripple": _band_of_ripple, "half_band": _band_of_half_width, "deviation_from_mean": _band_about_mean}
"""Bounds of the band, and what ranks the branches."""


def _worst_branch(
    subjects: Mapping[str, RowsInWindow], rule: Callable[[OneSpread, float], BandNeed], limit: float
) -> tuple[Bounds | None, str]:
    """Return the band of the branch that needs most of it, and that branch's name."""
    candidates = []
    for name, rows in subjects.items():
        try:
            mean, largest, least, sign = (value.item() for value in rows.spread)
        except Undefined:
            continue
        if largest > 0:
            low, high, need = rule((mean, largest, least), limit)
            candidates.append((need, sorted((sign * low, sign * high)), name))
    if not candidates:
        return None, ""
    _, (low, high), name = max(candidates, key=lambda item: item[0])
    return (low, high), name


def _band_about_target(target: float | None, limit: float) -> Bounds | None:
    """Return the band about the target; it is there even where the curve does not reach."""
    if not target:
        return None
    low, high = sorted((target * (1.0 - limit), target * (1.0 + limit)))
    return low, high


def _describe_outcome(outcome: Outcome, name: str) -> str:
    """Return ``ripple (load) 3.1 % ≤ 5 %``, or that it is missed."""
    ends = (outcome.min, outcome.max)
    low, high = (None if bound is None else value_text(bound, outcome.dimension) for bound in ends)
    allowed = f"{low} … {high}" if low and high else f"≤ {high}" if high else f"≥ {low}"
    if outcome.value is None:
        return f"{name} {allowed}: no value"
    value = value_text(outcome.value, outcome.dimension)
    if low and high:
        allowed = f"within {allowed}"
    return f"{name} {value} {allowed}" if outcome.ok else f"{name} {value}, allowed {allowed}: missed"

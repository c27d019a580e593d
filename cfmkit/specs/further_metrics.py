"""Metrics that no single analysis gives: shares of many parts, and functions of a user that a program registers.

The table of the user's metrics is empty unless a program fills it. Whoever lists metrics or values of a family adds
what is in it (`cfmkit.families.family`), so that a metric of the user is in every place where one of cfmkit is.
"""

from __future__ import annotations

import re
import secrets
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


OF_MANY_PARTS = {
    "yield": "share of parts drawn from `design.tolerances` that meet every other requirement",
    "yield_low": "lower end of the 95 % interval of the yield [Clopper, Pearson 1934]",
    "yield_high": "upper end of that interval",
    "yield_before": "yield of the specification that the design began with",
    "yield_with_common_frozen": "yield without the errors that scale the force of a whole part, such as that of the "
    "modulus: those that a test coupon and a trim remove",
    "yield_after_trim": "yield where the mean force of each part is adjusted to that of the design, by a trim or by "
    "its width; stresses do not change",
}
"""Name -> definition; all are shares of parts."""


NAME_PATTERN = re.compile("[a-z][a-z_0-9]*")  # names that a requirement may have
PLAIN_NUMBER = "factor"  # dimension of a metric that states none


@dataclass(frozen=True)
class OwnMetric:
    """A metric of the user."""

    name: str
    dimension: str  # of `cfmkit.specs.units`
    definition: str
    function: Callable[[Any], Any]  # of a `Result`; SI, None or NaN where there is no value


_METRICS_BY_NAME: dict[str, OwnMetric] = {}
_TABLE_STAMP = [""]  # changes with the table: nothing that was computed with other functions is reused


def own_metrics() -> Mapping[str, OwnMetric]:
    """Return the metrics of the user by name."""
    return _METRICS_BY_NAME


def stamp() -> str:
    """Return a text that no other state of the table, and no other process, has; empty if there are no metrics."""
    return _TABLE_STAMP[0]


def register_metric(
    function: Callable[[Any], Any],  # returns the value of a `Result` [SI]
    name: str | None = None,  # default: that of the function
    dimension: str | None = None,  # such as ``"force"``; default: a plain number
    definition: str | None = None,  # one sentence; default: the first line of the function's docstring
) -> OwnMetric:
    """Enter a function into the table, in place of one of the same name, and return the metric.

    Raises UsageError if the name cannot stand in a requirement, or there is no such dimension.
    """
    from cfmkit.specs.units import DIMENSIONS_BY_NAME

    name = getattr(function, "__name__", type(function).__name__) if name is None else name
    if not NAME_PATTERN.fullmatch(name):
        raise UsageError(
            f"{visible(name)!r} cannot be the name of a metric: small letters, digits and _; "
            "name it: cfmkit.metric(name='...')"
        )
    dimension = PLAIN_NUMBER if dimension is None else dimension
    if dimension not in DIMENSIONS_BY_NAME:
        raise UsageError(
            f"metric {name!r}: there is no dimension {dimension!r}; there are {', '.join(DIMENSIONS_BY_NAME)}"
        )
    described = (getattr(function, "__doc__", "") or "").strip().partition("\n")[0]
    metric = OwnMetric(name, dimension, definition or described or f"the user's function {name}", function)
    return enter(metric)


def enter(metric: OwnMetric) -> OwnMetric:
    """Put a metric into the table; what is there already stays, so that its results remain valid."""
    entered = _METRICS_BY_NAME.get(metric.name)
    if entered is None or replace(entered, definition="") != replace(metric, definition=""):
        _METRICS_BY_NAME[metric.name] = metric
        _TABLE_STAMP[0] = secrets.token_hex(16)
    return _METRICS_BY_NAME[metric.name]


def name_of(metric: Any) -> Any:
    """Return the name of a metric; a function is registered and named, anything else returned as it is.

    Examples
    --------
    >>> name_of("force_mean")
    'force_mean'
    """
    if isinstance(metric, str) or not callable(metric):
        return metric
    for entered in _METRICS_BY_NAME.values():
        if entered.function is metric:
            return entered.name
    return register_metric(metric).name


def names_of(metrics: Any) -> Any:
    """Return the names of several metrics, or of one; anything else is returned for others to refuse."""
    if isinstance(metrics, str) or callable(metrics):
        return (name_of(metrics),)
    return tuple(map(name_of, metrics)) if isinstance(metrics, list | tuple | set | frozenset) else metrics

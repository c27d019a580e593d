"""Metrics for files: border units, one record each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from cfmkit.metrics.metric_definitions import split_name
from cfmkit.specs.units import border_unit, to_border

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.results import Quantity, Searched


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

"""Metrics for files: border units, one record each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

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
        found: dict[str, Any] = {"value": None, "unit": unit, "definition": definition}
        return found | {"reason": quantity.reason} if quantity.reason else found
    value = finite_border(quantity.value, quantity.dimension) if quantity.word is None else quantity.word
    return {"value": value, "unit": unit, "definition": definition}


def finite_border(value: float, dimension: str) -> float | None:
    """Return an SI value in its border unit; None if it is beyond what a float, and so JSON, can hold."""
    number = float(to_border(value, dimension))
    return number if math.isfinite(number) else None


def metrics_json(quantities: Mapping[str, Quantity]) -> dict[str, dict[str, Any]]:
    """Return the block ``metrics`` of metrics.json."""
    return {name: as_json(quantity) for name, quantity in quantities.items()}


def search_json(found: Mapping[str, Searched]) -> dict[str, dict[str, Any]]:
    """Return the block ``search`` of metrics.json: what a design search knows, with its model and window.

    Examples
    --------
    >>> from cfmkit.results import Quantity, Searched
    >>> search_json({"starts": Searched(Quantity(20.0, "count", "random starts"), "inextensible", (0.0, 0.01))})
    {'starts': {'value': 20.0, 'unit': '1', 'definition': 'random starts', 'model': 'inextensible', \
'window': [0.0, 10.0], 'window_unit': 'mm'}}
    """
    return {name: as_json(one.quantity) | _of(one) for name, one in found.items()}


def _of(found: Searched) -> dict[str, Any]:
    """Return model and window in border units."""
    window = None if found.window is None else [finite_border(end, found.motion) for end in found.window]
    return {"model": found.model, "window": window, "window_unit": window and border_unit(found.motion)}

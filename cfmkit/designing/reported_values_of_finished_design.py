"""Audit of a search: the reported values of a design are those of the analysis of its specification."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.metrics import Window, evaluate
from cfmkit.results import Quantity, Searched

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.results import Result


def measure_metrics(result: Result, window: tuple[float, float], *names: str) -> list[float | None]:
    """Return metrics [SI] that the analysis of a design measures over a window [m or rad]; None if it cannot."""
    if not result.curves:
        return [None] * len(names)
    found = evaluate(result, names, Window(*window))
    return [found[name].value for name in names]


def search_values(
    numbers: Mapping[str, tuple[float | None, str, str]],
    model: str,
    window: tuple[float, float],
    motion: str = "length",
) -> dict[str, Searched]:
    """Return what only a search knows, (value, dimension, definition) by name, with the model and window it is of."""
    return {name: Searched(Quantity(*about), model, window, motion) for name, about in numbers.items()}

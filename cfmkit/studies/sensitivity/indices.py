"""Indices of sensitivity: one value a parameter, with its interval; not stated where a sample has no value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray


N_RESAMPLES = 200  # bootstrap samples behind an interval
CONSTANT_OUTPUT_RTOL = 1e-12
"""An output that varies less than so much of its size does not vary: it has no variance to share out."""


@dataclass(frozen=True)
class Index:
    """One index of every parameter, with its interval; NaN where it cannot be stated."""

    name: str
    value: FloatArray
    low: FloatArray
    high: FloatArray


Analysis = tuple[Index, ...]


def unstated_indices(names: tuple[str, ...], count: int) -> Analysis:
    """Return indices of so many parameters that are not stated."""
    gap = np.full(count, np.nan)
    return tuple(Index(name, gap, gap, gap) for name in names)


def analyze_complete(
    outputs: FloatArray, analyze: Callable[[FloatArray], Analysis], names: tuple[str, ...], count: int
) -> Analysis:
    """Return the indices of one output; not stated where one of its samples failed, whose output is NaN."""
    return unstated_indices(names, count) if np.isnan(outputs).any() else analyze(outputs)


def problem(count: int) -> dict[str, Any]:
    """Return a unit cube as SALib wants it described."""
    return {"num_vars": count, "names": [str(k) for k in range(count)], "bounds": [[0.0, 1.0]] * count}


def varies_not(outputs: FloatArray) -> bool:
    """Return whether all outputs are the same, but for rounding."""
    return bool(np.ptp(outputs) <= CONSTANT_OUTPUT_RTOL * np.abs(outputs).max())

"""Outcome of a sensitivity study: indices as lines of a tidy table, the yield, and how many samples failed.

An index is one value a parameter, with its interval; it is not stated where a sample has no value.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.specs.units import border_unit, to_border

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.parts.share import Share
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup


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


def salib_problem(count: int) -> dict[str, Any]:
    """Return a unit cube as SALib wants it described."""
    return {"num_vars": count, "names": [str(k) for k in range(count)], "bounds": [[0.0, 1.0]] * count}


def is_constant(outputs: FloatArray) -> bool:
    """Return whether all outputs are the same, but for rounding."""
    return bool(np.ptp(outputs) <= CONSTANT_OUTPUT_RTOL * np.abs(outputs).max())


IN_UNITS = ("at_low_end", "at_high_end", "swing", "mu_star", "mu", "sigma")
"""Indices that are amounts of the metric; others are ratios."""


@dataclass(frozen=True)
class IndexLine:
    """One index of one parameter, in border units; None if it cannot be stated."""

    metric: str  # the label of a column of results.csv; or ``yield``
    parameter: str  # its path, or several with commas that are tightened together
    index: str  # ``first_order``, ``mu_star``, ``swing``, ..
    # value, low, high: the index and its interval. A missing `high` beside a `low` is open: "at least"
    value: float | None
    low: float | None
    high: float | None
    unit: str  # of all three
    samples: int  # blocks that it was found from


@dataclass(frozen=True)
class Findings:
    """The outcome of a study."""

    setup: Setup  # what was to be done
    evaluator: Evaluator  # what was evaluated
    lines: tuple[IndexLine, ...] = ()  # the indices
    convergence: tuple[IndexLine, ...] = ()  # the same from fewer samples
    # points, outputs: blocks of samples, (b, s, d) and (b, s, m + r)
    points: FloatArray | None = None
    outputs: FloatArray | None = None
    all_met: Share | None = None  # of parts that meet all requirements
    each_met: tuple[Share, ...] = ()  # of parts that meet one
    interrupted: bool = False  # whether the user stopped it: there are no indices
    fresh: bool = False  # whether it was to reuse nothing: then the same command would begin anew

    @property
    def unstated(self) -> int:
        """Number of indices that need a value that is missing."""
        return sum(line.value is None for line in self.lines if line.index not in OPTIONAL_INDICES)

    @cached_property
    def constant(self) -> tuple[str, ...]:
        """Metrics that have the same value in every sample: no share of a variance belongs to any parameter."""
        if self.outputs is None:
            return ()
        columns = self.outputs.reshape(-1, self.outputs.shape[-1]).T
        pairs = zip(self.setup.study.metrics, columns, strict=False)
        return tuple(metric.label for metric, column in pairs if is_constant(column))

    @property
    def lacking(self) -> int:
        """Number of indices that are not stated because samples have no value, not because nothing varies."""
        gone = (line for line in self.lines if line.value is None and line.index not in OPTIONAL_INDICES)
        return sum(line.metric not in self.constant for line in gone)


OPTIONAL_INDICES = ("normalised_slope",)
"""Indices that may be missing though all samples are there: nothing is relative to zero."""


def lines_of(metric: Metric, names: tuple[str, ...], analysis: Analysis, samples: int) -> Iterator[IndexLine]:
    """Yield the indices of one metric, parameter by parameter."""
    for k, name in enumerate(names):
        for index in analysis:
            amount = index.name in IN_UNITS
            ends = (index.value[k], index.low[k], index.high[k])
            value, low, high = (to_stated_value(float(end), metric.dimension if amount else "ratio") for end in ends)
            unit = border_unit(metric.dimension) if amount else "1"
            yield IndexLine(metric.label, name, index.name, value, low, high, unit, samples)


def to_stated_value(value: float, dimension: str) -> float | None:
    """Return an SI value in border units; None if it is not finite."""
    return float(to_border(value, dimension)) if isfinite(value) else None

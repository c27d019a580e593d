"""Variants of a specification, solved together where the family can, else one by one; studies read both alike.

A row is the solution of one variant at one preload or branch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families.rows import valid
from cfmkit.metrics import frame_of, travel_of
from cfmkit.metrics.curve_rows import rows_of_curve

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.rows import SolvedRows, Variants
    from cfmkit.metrics.curve_rows import CurveRows
    from cfmkit.results import Result

    BatchSolver = Callable[[Any], Iterator[tuple[NDArray[Any], SolvedRows[Any]]]]  # `Family.rows`
    Knows = Callable[[SolvedRows[Any]], bool]
    Rows: TypeAlias = "SolvedRows[Any] | SingleRow"

MIN_BLOCK_SIZES, SMALLEST_TRACED = 64, 8
"""Mechanisms that are solved together at least, of closed forms and of traced models, which take milliseconds each."""


LARGEST_KEPT_ARRAY = 32_000_000  # [bytes], of those that glibc may keep
np.empty(LARGEST_KEPT_ARRAY, dtype=np.uint8)
"""Freed at once and never written to: from then on glibc keeps arrays up to this size, twice as much together, for the
next ones. Else it gives each back to the system, and cleared pages from there take longer than most operations on them.
"""


@dataclass(frozen=True, eq=False)
class SingleRow:
    """A mechanism that is analysed by itself, or what is wrong with it: read as `SolvedRows` of one mechanism."""

    result: Result | None
    error: Exception | None = None  # why there is no result

    def __len__(self) -> int:
        """Return 1."""
        return 1

    @property
    def complete(self) -> NDArray[np.bool_]:
        """True: nothing else knows more of it."""
        return np.array([True])

    @cached_property
    def branches(self) -> Mapping[str, CurveRows]:
        """The nominal curve, by branch; empty without one."""
        result = self.result
        travel = None if result is None else travel_of(result)
        if result is None or travel is None:
            return {}
        ends = np.array(travel[:1]), np.array(travel[1:])
        rows = rows_of_curve(result.curves[0], frame_of(result))
        return {name: replace(curves, travel=ends) for name, curves in rows.items()}

    def value(self, name: str) -> FloatArray | None:
        """Return a scalar result, (1,) [SI], NaN where it has no value; None for an unknown name."""
        if self.result is None or name not in self.result.values:
            return None
        value = self.result.values[name].value
        return np.array([np.nan if value is None else value])

    def findings(self) -> dict[str, NDArray[np.bool_]]:
        """Return the findings, (1,) each by name."""
        return {} if self.result is None else {item.name: np.array([True]) for item in self.result.warnings}


def solve_variants(
    variants: Variants,
    batches: BatchSolver | None,  # the family's `rows`; None: every variant is analysed by itself
    analyze: Callable[[Any], Result],
    knows: Knows,  # whether rows have all that is asked of them
) -> Iterator[tuple[NDArray[np.intp], Rows]]:
    """Yield (indices, rows) of all variants; of rows those that are not complete come again by themselves."""
    rest = set(range(len(variants)))
    try:
        for members, solved in () if batches is None else batches(variants):
            if knows(solved):
                rest -= set(members[solved.complete].tolist())
                yield members, solved
            del members, solved  # it is large, and ends before the next one begins
    except CfmError:  # each of the others says by itself what is wrong with it
        pass
    for index in sorted(rest):
        yield np.array([index]), analyze_alone(variants, index, analyze)


def analyze_alone(variants: Variants, index: int, analyze: Callable[[Any], Result]) -> SingleRow:
    """Return one variant that is analysed by itself, whatever goes wrong with it."""
    try:
        return SingleRow(analyze(variants[index]))
    except Exception as error:
        return SingleRow(None, error)


def count_together(variants: Variants, batches: BatchSolver | None, knows: Knows) -> int:
    """Return of how many mechanisms rows are at least; 1 if one of some variants is analysed by itself."""
    if batches is None:
        return 1
    try:
        n_valid = sum(1 for _ in valid(variants))  # of those that are not valid each says so by itself
        groups = [(len(members), knows(solved), solved.traced) for members, solved in batches(variants)]
    except CfmError:
        return 1
    if not n_valid or sum(count for count, _, _ in groups) != n_valid or not all(told for _, told, _ in groups):
        return 1
    return SMALLEST_TRACED if any(traced for _, _, traced in groups) else MIN_BLOCK_SIZES

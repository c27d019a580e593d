"""A design problem as a program of `cfmkit.numerics.sqp`: objective, limits as rows >= 0; limits missed or active.

A family says what is seen at a point; here that becomes the vectors and matrices that the solver wants. Limits may be
let give way, all by the same amount, which is then the last variable and is minimised in place of the objective: zero
where the limits can be met together, and where they cannot, the least by which they are missed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class LimitRows:
    """Some rows of one limit; each must be at least zero, all are of order one."""

    name: str  # the limit
    values: FloatArray  # (m,) by how much it holds
    slopes: FloatArray | None = None  # (m, k) derivatives by the first k variables, if requested; others: zero
    about: Callable[[], list[str]] = list  # what each row is about; nothing: no report speaks of these rows


MIN_ROW_SLOPE = 1e-9
"""A row that no variable moves by more than this is met or missed whatever the design: it holds nothing."""


@dataclass(frozen=True)
class Missed:
    """A limit that is missed: its name, by how much at the worst row (in its own scale), and that row's label."""

    name: str
    by: float
    about: str


def find_largest_violation(rows: Iterable[LimitRows]) -> float:
    """Return the largest amount by which a row is missed; zero if all hold."""
    return max((-float(row.values.min(initial=0.0)) for row in rows), default=0.0)


def list_missed_limits(rows: Iterable[LimitRows], allowed: float) -> list[Missed]:
    """Return the limits that are missed by more than what counts as nothing, the worst first."""
    missed_by_name: dict[str, Missed] = {}
    for row in rows:
        at = int(row.values.argmin()) if len(row.values) else 0
        if len(row.values) and row.values[at] < -allowed:
            before = missed_by_name.get(row.name)
            if before is None or -row.values[at] > before.by:
                missed_by_name[row.name] = Missed(row.name, -float(row.values[at]), row.about()[at])
    return sorted(missed_by_name.values(), key=lambda missed: (-missed.by, missed.name, missed.about))


def list_active_rows(rows: Iterable[LimitRows], close: float) -> Iterator[str]:
    """Yield the active rows, nearly zero and dependent on the variables, as ``limit: about``."""
    for row in rows:
        about = row.about()
        moves = row.values < 1 if row.slopes is None else abs(row.slopes).max(axis=1, initial=0.0) > MIN_ROW_SLOPE
        yield from (f"{row.name}: {about[k]}" for k in np.flatnonzero((row.values < close) & moves))


@dataclass(frozen=True)
class SeenPoint:
    """Values at a point: the objective with its derivatives (k,), if they were requested, and all rows."""

    objective: float
    slope: FloatArray | None
    rows: Sequence[LimitRows]


class DesignProgram(ABC):
    """A program of `cfmkit.numerics.sqp` whose objective and limits a family evaluates at a point."""

    elastic: tuple[str, ...] = ()  # limits that give way, by the last variable

    @abstractmethod
    def evaluate(self, z: FloatArray, sloped: bool) -> SeenPoint | None:
        """Return objective and rows at z, with derivatives or without; None if the model has no answer."""

    def values(self, z: FloatArray) -> tuple[float, FloatArray] | None:
        """Return the objective and the constraints (m,) at z (n,); None if the model has no answer."""
        elastic = self.elastic
        seen = self.evaluate(z[:-1] if elastic else z, False)
        if seen is None:
            return None
        rows = [row.values + z[-1] if row.name in elastic else row.values for row in seen.rows]
        return (float(z[-1]) if elastic else seen.objective), np.concatenate([np.zeros(0), *rows])

    def slopes(self, z: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return the derivatives (n,) and (m, n) of objective and constraints at z."""
        elastic = self.elastic
        seen = self.evaluate(z[:-1] if elastic else z, True)
        if seen is None:
            return None
        objective = np.zeros(len(z))
        if elastic:
            objective[-1] = 1.0
        elif seen.slope is not None:
            objective[: len(seen.slope)] = seen.slope
        return objective, np.concatenate([np.zeros((0, len(z))), *(_wide(row, len(z), elastic) for row in seen.rows)])


def _wide(rows: LimitRows, count: int, elastic: tuple[str, ...]) -> FloatArray:
    """Return the derivatives of rows by all variables."""
    wide = np.zeros((len(rows.values), count))
    if rows.slopes is not None:
        wide[:, : rows.slopes.shape[1]] = rows.slopes
    if rows.name in elastic:
        wide[:, -1] = 1.0
    return wide

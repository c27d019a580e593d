"""Limits of a design as rows that must be at least zero: which it misses, by how much and where, and which hold it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cfmkit.arrays import FloatArray


def _unnamed() -> list[str]:
    """Return nothing: rows that no report speaks of."""
    return []


@dataclass(frozen=True)
class LimitRows:
    """Some rows of one limit; each must be at least zero, all are of order one.

    Attributes
    ----------
    name : str
        The limit.
    values : (m,) array
        By how much it holds.
    slopes : (m, k) array or None
        Derivatives by the first k variables, if they were requested; by all others they are zero.
    about : callable
        Returns what each row is about.
    """

    name: str
    values: FloatArray
    slopes: FloatArray | None = None
    about: Callable[[], list[str]] = _unnamed


STILL = 1e-9
"""A row that no variable moves by more than this is met or missed whatever the design: it holds nothing."""


@dataclass(frozen=True)
class Missed:
    """A limit that is missed: by how much at its worst, in its own scale, and what that row is about."""

    name: str
    by: float
    about: str


def worst(rows: Iterable[LimitRows]) -> float:
    """Return by how much the worst row is missed; zero or less where all hold."""
    return max((-float(one.values.min(initial=0.0)) for one in rows), default=0.0)


def missed(rows: Iterable[LimitRows], allowed: float) -> list[Missed]:
    """Return the limits that are missed by more than what counts as nothing, the worst first."""
    found: dict[str, Missed] = {}
    for one in rows:
        at = int(one.values.argmin()) if len(one.values) else 0
        if len(one.values) and one.values[at] < -allowed:
            before = found.get(one.name)
            if before is None or -one.values[at] > before.by:
                found[one.name] = Missed(one.name, -float(one.values[at]), one.about()[at])
    return sorted(found.values(), key=lambda one: (-one.by, one.name, one.about))


def held(rows: Iterable[LimitRows], close: float) -> Iterator[str]:
    """Yield what holds a design: the rows that are nearly zero and move with it, as ``limit: about``."""
    for one in rows:
        about = one.about()
        moves = one.values < 1 if one.slopes is None else abs(one.slopes).max(axis=1, initial=0.0) > STILL
        yield from (f"{one.name}: {about[k]}" for k in np.flatnonzero((one.values < close) & moves))

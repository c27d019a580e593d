"""What a sample without a value means: never that a parameter has no influence.

Points are drawn in blocks (a trajectory, a row of Sobol's matrices, one sample of a
Monte Carlo run): the smallest part of a design that may be replaced without spoiling
the rest. Three policies:

- ``fail``: an index that needs the missing value is not stated.
- ``resample``: a block with a missing value is drawn again, whole. The indices are then
  those of the part of the parameters' space where the mechanism works.
- ``bound``: the index is stated as an interval, from the missing values being the
  smallest, and then the largest, of those that were found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

Policy = Literal["fail", "resample", "bound"]

MOST_DRAWN = 10
"""Blocks are drawn at most so many times as often as they are wanted."""


@dataclass(frozen=True)
class Index:
    """One index of every parameter, with its interval; NaN where it cannot be stated."""

    name: str
    value: FloatArray
    low: FloatArray
    high: FloatArray


Analysis = tuple[Index, ...]


def nothing(names: tuple[str, ...], count: int) -> Analysis:
    """Return indices that are not stated."""
    gap = np.full(count, np.nan)
    return tuple(Index(name, gap, gap, gap) for name in names)


def stated(analyze: Callable[[FloatArray], Analysis], outputs: FloatArray, policy: Policy, empty: Analysis) -> Analysis:
    """Return the indices of one output, as far as its values allow.

    Parameters
    ----------
    analyze : callable
        From complete outputs to indices.
    outputs : array
        NaN where a sample failed.
    policy : {"fail", "resample", "bound"}
        After ``resample`` nothing is missing, or too much was.
    empty : tuple of Index
        What to return if they cannot be stated.
    """
    missing = np.isnan(outputs)
    if not missing.any():
        return analyze(outputs)
    if policy != "bound" or missing.all():
        return empty
    ends = float(np.nanmin(outputs)), float(np.nanmax(outputs))
    return envelope(*(analyze(np.where(missing, end, outputs)) for end in ends))


def envelope(one: Analysis, other: Analysis) -> Analysis:
    """Return intervals that hold both analyses; each value is the middle of the two."""
    pairs = zip(one, other, strict=True)
    return tuple(
        Index(a.name, (a.value + b.value) / 2.0, np.minimum(a.low, b.low), np.maximum(a.high, b.high)) for a, b in pairs
    )


@dataclass(frozen=True)
class Blocks:
    """Evaluated samples."""

    points: FloatArray  # (b, s, d) blocks of points
    outputs: FloatArray  # (b, s, m) NaN where there is no value
    failed: int = 0  # samples that failed, those that were drawn again included
    replaced: int = 0  # blocks that were drawn again


def evaluated(
    draw: Callable[[int, int], FloatArray],
    evaluate: Callable[[FloatArray], FloatArray],
    count: int,
    policy: Policy,
    deciding: int = 0,
) -> Blocks:
    """Return `count` blocks and what came of them; under ``resample`` complete ones, as far as they can be had.

    Parameters
    ----------
    draw : callable
        ``draw(start, count)``: blocks `start`, `start` + 1, ... of an endless sequence, (count, s, d).
    evaluate : callable
        From (b, s, d) points to (b, s, m) outputs.
    count : int
        Blocks wanted.
    policy : {"fail", "resample", "bound"}
        What to do about missing values.
    deciding : int
        Outputs before this one may be missing: their blocks are not drawn again.
    """
    points = draw(0, count)
    outputs = evaluate(points)
    failed = _failures(outputs)
    if policy != "resample":
        return Blocks(points, outputs, failed)
    drawn, replaced = count, 0
    while (bad := np.asarray(np.isnan(outputs[..., deciding:]).any(axis=(1, 2)))).any() and drawn < MOST_DRAWN * count:
        wanted = int(bad.sum())
        fresh = draw(drawn, wanted)
        drawn, replaced = drawn + wanted, replaced + wanted
        new = evaluate(fresh)
        failed += _failures(new)
        points, outputs = points.copy(), outputs.copy()
        points[bad], outputs[bad] = fresh, new
    return Blocks(points, outputs, failed, replaced)


def _failures(outputs: FloatArray) -> int:
    return int(np.isnan(outputs).any(axis=2).sum())

"""Which part of a window a recording covers: holes in it, and the weight of each sample.

A recording's samples stand where machine and clock put them. A mean over them is a mean over the displacement only if
each counts for the way that it stands for. Where the way to the next sample is far longer than is usual there, nothing
is known of what the force did: a hole. What holds over a window with a large hole in it cannot be told.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import QuantityError, UsageError
from cfmkit.metrics.branch_views import span_text
from cfmkit.specs.units import read_quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve, Kind
    from cfmkit.metrics import Window

LARGEST_HOLE = 0.02
"""Part of the window: with a larger hole in it no number over the window can be known."""

STEPS = 3.0
"""Samples that are farther apart than so many usual steps leave a hole: a spike or two that are left out do not."""

NEIGHBOURS = 10
"""Steps to either side of one that say what is usual there: recorders change their step on the way."""

USUAL = 80.0
"""Percentile of those: of 21 steps four may be larger, as where single samples stand in a hole."""


@dataclass(frozen=True)
class Hole:
    """A part of the travel without samples [m or rad]."""

    low: float
    high: float
    branch: str = ""
    cycle: int | None = None  # None where there is one only

    @property
    def width(self) -> float:
        """Its length [m or rad]."""
        return self.high - self.low

    def text(self, kind: Kind) -> str:
        """Return where it is, for messages: ``9 ... 18 mm on 'load'``."""
        cycle = "" if self.cycle is None else f" of cycle {self.cycle}"
        return span_text(self.low, self.high, kind) + (f" on {self.branch!r}{cycle}" if self.branch else "")


def usual_steps(places: FloatArray) -> FloatArray:
    """Return what is usual around each step, (n - 1,), between (n,) places in increasing order [m or rad]."""
    from scipy.ndimage import percentile_filter

    steps = np.diff(places)
    if len(steps) <= 2 * NEIGHBOURS:
        return np.full(len(steps), np.percentile(steps, USUAL) if len(steps) else 0.0)
    found: FloatArray = percentile_filter(steps, USUAL, 2 * NEIGHBOURS + 1, mode="reflect")
    return found


def _is_hole(places: FloatArray) -> NDArray[np.bool_]:
    """Return after which places there is a hole, (n - 1,) bool; repeated places have no step of their own."""
    distinct, last = np.unique(places[::-1], return_index=True)
    found = np.zeros(max(len(places) - 1, 0), dtype=bool)
    steps = np.diff(distinct)
    found[len(places) - 1 - last[:-1]] = steps > STEPS * usual_steps(distinct)
    return found


def holes_between(places: FloatArray, window: Window) -> list[tuple[float, float]]:
    """Return the holes between places in increasing order, as far as they are in a window [m or rad]."""
    after = np.flatnonzero(_is_hole(places))
    ends = zip(places[after].tolist(), places[after + 1].tolist(), strict=True)
    inside = [(max(low, window.lo), min(high, window.hi)) for low, high in ends]
    return [(low, high) for low, high in inside if low < high]


def holes_of(curves: Sequence[Curve], window: Window) -> tuple[Hole, ...]:
    """Return the holes of all branches of all cycles in a window, in their order."""
    found = []
    for curve in curves:
        cycle = int(curve.label["cycle"][0]) if len(curves) > 1 else None
        for branch in curve.branches:
            places = np.sort(curve.on(branch).motion)
            found += [Hole(low, high, branch, cycle) for low, high in holes_between(places, window)]
    return tuple(found)


def share_covered(holes: Sequence[Hole], window: Window) -> float:
    """Return which part of a window one branch of one cycle covers."""
    return 1.0 - sum(hole.width for hole in holes) / (window.hi - window.lo)


def weights(places: FloatArray) -> FloatArray:
    """Return the way that each sample stands for, half of that to each neighbour, (n,); holes count as usual steps.

    Parameters
    ----------
    places : (n,) array
        In increasing order [m or rad].
    """
    steps = np.diff(places)
    found = np.zeros(len(places))
    if len(steps):
        steps = np.where(_is_hole(places), np.minimum(steps, usual_steps(places)), steps)
        found[1:] += 0.5 * steps
        found[:-1] += 0.5 * steps
    return found


def read_largest_hole(text: str | float | None) -> float:
    """Return which part of a window a hole may take, from text such as ``5 %``; by default `LARGEST_HOLE`.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is no share.
    """
    if text is None:
        return LARGEST_HOLE
    try:
        share = read_quantity(text, "ratio") if isinstance(text, str) else float(text)
    except QuantityError as error:
        raise UsageError(f"--max-hole: {error}") from None
    if not 0 < share <= 1:
        raise UsageError(f"--max-hole: {text} is not allowed: must be above 0 and at most 100 %")
    return share

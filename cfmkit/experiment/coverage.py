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
from cfmkit.numerics.holes_in_samples import LARGEST_HOLE, holes_between
from cfmkit.specs.units import read_quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.curves import Curve, Kind
    from cfmkit.metrics import Window


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


def holes_of(curves: Sequence[Curve], window: Window) -> tuple[Hole, ...]:
    """Return the holes of all branches of all cycles in a window, in their order."""
    found = []
    for curve in curves:
        cycle = int(curve.label["cycle"][0]) if len(curves) > 1 else None
        for branch in curve.branches:
            places = np.sort(curve.on(branch).motion)
            found += [Hole(low, high, branch, cycle) for low, high in holes_between(places, window.lo, window.hi)]
    return tuple(found)


def share_covered(holes: Sequence[Hole], window: Window) -> float:
    """Return which part of a window one branch of one cycle covers."""
    return 1.0 - sum(hole.width for hole in holes) / (window.hi - window.lo)


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

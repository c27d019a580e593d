"""Metrics of a mechanism in use: cycles to failure, and the effort that is left after a hold.

The laws are those of the material (`cfmkit.metrics.fatigue_and_relaxation`); here they meet a curve and its window.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.branch_windows import Undefined
from cfmkit.metrics.window_metrics import stress_range

if TYPE_CHECKING:
    from cfmkit.metrics.branch_views import Branch


def fatigue_life(branch: Branch) -> float:
    """Return the cycles to failure between the least and the largest stress in the window, of all load cases."""
    known = branch.frame.durability
    if known is None or known.fatigue is None:
        raise Undefined("the material has no fatigue data: add 'fatigue' to it")
    ranges = [stress_range(branch)]
    for part in branch.inside_beside:
        if part.stress is None or np.isnan(part.stress).any():
            raise Undefined("the stress of another load case is not known everywhere in the window")
        ranges.append((float(part.stress.min()), float(part.stress.max())))
    return min(known.fatigue.life(largest, least) for least, largest in ranges)


def effort_after(branch: Branch, time: float) -> float:
    """Return the mean effort in the window after a hold of a time [s]."""
    known = branch.frame.durability
    if known is None or known.relaxation is None:
        raise Undefined("the material has no relaxation data: add 'relaxation' to it")
    return float(branch.spread.mean * branch.spread.sign * known.relaxation.ratio(time))

"""Metrics that are lengths of travel: how far the force stays constant.

Here the window only says what to compare with (its end, its centre, its mean);
the travel that is looked at is the whole branch. The formulas are those for many
branches (`cfmkit.metrics.ranges_many`), of which one is a single row; here stands when there is nothing to measure.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics import ranges_many
from cfmkit.metrics.branches_cut_to_window import Undefined
from cfmkit.metrics.definition import Definition

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.branch_views import Branch
    from cfmkit.metrics.ranges_many import ManyBranches
    from cfmkit.metrics.usable_interval_of_all_branches import Cycle, Interval


@np.errstate(all="ignore")
def range_95(branch: Branch) -> float:
    """Return d - c, with d the end of the window and c where F first reaches 0.95 F(d)."""
    return _value_of_branch(ranges_many.range_95(_rising(branch)))


@np.errstate(all="ignore")
def range_95_fraction(branch: Branch) -> float:
    """Return (d - c) / d."""
    if branch.ends[1] <= 0:
        raise Undefined("the displacement at the end is not positive")
    return _value_of_branch(ranges_many.range_95_fraction(_rising(branch)))


def _rising(branch: Branch) -> ManyBranches:
    """Return a branch whose effort at the end of the window is something to compare with."""
    if abs(branch.evaluate(branch.ends[1])) <= branch.error:
        raise Undefined(f"the {branch.kind} at the end is zero within its numerical error, {branch.error_text}")
    return branch.many


@np.errstate(all="ignore")
def band_range(branch: Branch, tolerance: float) -> float:
    """Return the widest interval around the reference pose in which ``|F / F_ref - 1|`` is within the tolerance."""
    branch.effort_at_reference  # noqa: B018  (raises where there is nothing to compare with)
    return _value_of_branch(ranges_many.band_range(branch.many, tolerance))


def _value_of_branch(values: FloatArray) -> float:
    """Return the value of one branch.

    Raises Undefined if it is none: the model gives no force at the places that are asked about.
    """
    value = float(values[0])
    if not isfinite(value):
        raise Undefined("there is no equilibrium at the place that it is compared with")
    return value


def band_range_05pct(branch: Branch) -> float:
    """Return `band_range` for 0.5 %."""
    return band_range(branch, 0.005)


def band_range_1pct(branch: Branch) -> float:
    """Return `band_range` for 1 %."""
    return band_range(branch, 0.01)


def band_range_5pct(branch: Branch) -> float:
    """Return `band_range` for 5 %."""
    return band_range(branch, 0.05)


def usable_stroke(cycle: Cycle) -> float:
    """Return the length of the largest usable interval; zero where there is none."""
    start, end = cycle.usable or (0.0, 0.0)
    return end - start


def usable_start(cycle: Cycle) -> float:
    """Return where the largest usable interval starts."""
    return _usable(cycle)[0]


def usable_end(cycle: Cycle) -> float:
    """Return where the largest usable interval ends."""
    return _usable(cycle)[1]


def _usable(cycle: Cycle) -> Interval:
    if cycle.usable is None:
        raise Undefined("no part of the travel is usable")
    return cycle.usable


_RANGE_MEANING = "d is the end of the window, c where the {effort} first reaches 0.95 of that at d [Lan 2010, sec. 2]"
TRAVEL_METRICS = (
    Definition("range_95", "motion", f"d - c: {_RANGE_MEANING}", range_95, worst="smallest", windowed=False),
    Definition(
        "range_95_fraction",
        "ratio",
        f"(d - c)/d: {_RANGE_MEANING}",
        range_95_fraction,
        worst="smallest",
        windowed=False,
    ),
    *(
        Definition(
            name,
            "motion",
            f"widest interval around the reference pose (default: the centre of the window; for the springs of a "
            f"slider-crank the stretched position, or half the travel of a force) in which the {{effort}} "
            f"is within {percent} % of that at the pose [Li, Hao 2019, eq. 32]",
            function,
            worst="smallest",
            windowed=False,
        )
        for name, percent, function in (
            ("band_range_05pct", "0.5", band_range_05pct),
            ("band_range_1pct", "1", band_range_1pct),
            ("band_range_5pct", "5", band_range_5pct),
        )
    ),
    *(
        Definition(
            name,
            "motion",
            f"{what} of the longest part of the travel on which every branch stays within the {{effort}} band (around "
            "the target, else around the mean in the window), the allowable stress and its valid range",
            function,
            worst="smallest",
            scope="cycle",
            windowed=False,
        )
        for name, what, function in (
            ("usable_stroke", "length", usable_stroke),
            ("usable_start", "start", usable_start),
            ("usable_end", "end", usable_end),
        )
    ),
)
"""Metrics that are lengths of travel, in the order in which they are shown."""

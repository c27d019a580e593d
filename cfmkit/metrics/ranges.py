"""Metrics that are lengths of travel: how far the force stays constant.

Here the window only says what to compare with (its end, its centre, its mean);
the travel that is looked at is the whole branch. The formulas are those for many
branches (`cfmkit.metrics.ranges_many`), of which one is a single row; here stands when there is nothing to measure.
"""

from __future__ import annotations

from functools import partial
from math import isfinite
from operator import attrgetter, methodcaller
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics import ranges_many
from cfmkit.metrics.branches import Undefined
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
    *(
        Definition(
            name,
            dimension,
            f"{formula}: {_RANGE_MEANING}",
            function,
            methodcaller("rise_to_end", of_rows),
            worst="smallest",
            windowed=False,
        )
        for name, dimension, formula, function, of_rows in (
            ("range_95", "motion", "d - c", range_95, ranges_many.range_95),
            ("range_95_fraction", "ratio", "(d - c)/d", range_95_fraction, ranges_many.range_95_fraction),
        )
    ),
    *(
        Definition(
            name,
            "motion",
            f"widest interval around the reference pose (default: the centre of the window; for the springs of a "
            f"slider-crank the stretched position, or half the travel of a force) in which the {{effort}} "
            f"is within {100 * tolerance:g} % of that at the pose [Li, Hao 2019, eq. 32]",
            partial(band_range, tolerance=tolerance),
            methodcaller("band_range", tolerance),
            worst="smallest",
            windowed=False,
        )
        for name, tolerance in ranges_many.BAND_RANGES.items()
    ),
    *(
        Definition(
            name,
            "motion",
            f"{what} of the longest part of the travel on which every branch stays within the {{effort}} band (around "
            "the target, else around the mean in the window), the allowable stress and its valid range",
            function,
            attrgetter(f"usable.{name.removeprefix('usable_')}"),
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

"""Metrics of what lies inside the window: statistics, deviations, hysteresis, stress, cycles to failure.

Each has its function and, in the tables at the end, its definition.

A branch whose mean is negative is judged in its own direction (the opposite sign convention gives the same ripple).
Each function takes `RowsInWindow` (or `CycleRows`) and returns SI, (d,): NaN where a row has no value. One row by
itself raises `Undefined` with the reason. A share of something that is not above the numerical error of the effort is
NaN: rounding over rounding says nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.branches import Undefined
from cfmkit.metrics.definition import Definition
from cfmkit.metrics.ranges import rms_about, uniform_places
from cfmkit.metrics.rows_in_window import restrict_to_window

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.rows_in_window import RowsInWindow
    from cfmkit.metrics.usable_interval_of_all_branches import CycleRows


EXTREME_RTOL = 1e-7
"""A sum of both extremes that is smaller than this part of their distance is what their search leaves, with room."""
NO_STRESS = 1e-12  # share of the allowable stress that rounding leaves where nothing is stressed
STATIC_BALANCE = "static_balance"


def mean(rows: RowsInWindow) -> FloatArray:
    """Return the mean effort over the points in the window."""
    return rows.mean


def standard_deviation(rows: RowsInWindow) -> FloatArray:
    """Return the sample standard deviation (n - 1) of the effort over the points in the window."""
    rows.require(rows.inside.count > 1, "a standard deviation needs two points")
    return rows.deviation


def largest(rows: RowsInWindow) -> FloatArray:
    """Return the largest effort in the window."""
    return rows.extremes[0]


def smallest(rows: RowsInWindow) -> FloatArray:
    """Return the smallest effort in the window."""
    return rows.extremes[1]


def ripple(rows: RowsInWindow) -> FloatArray:
    """Return (max - min) / max."""
    return _divide_by_whole(rows, rows.spread.max - rows.spread.min, rows.spread.max)


def half_band(rows: RowsInWindow) -> FloatArray:
    """Return (max - min) / (max + min)."""
    width, whole = rows.spread.max - rows.spread.min, rows.spread.max + rows.spread.min
    return _divide_by_whole(rows, width, np.where(whole > EXTREME_RTOL * width, whole, 0.0))


def deviation_from_mean(rows: RowsInWindow) -> FloatArray:
    """Return the largest ``|F - mean| / mean``."""
    middle, high, low, _ = rows.spread
    return _divide_by_whole(rows, np.maximum(high - middle, middle - low), middle)


def _divide_by_whole(rows: RowsInWindow, part: FloatArray, whole: FloatArray) -> FloatArray:
    is_known = rows.require(whole > rows.curves.error, rows.describe_gap)
    return np.where(is_known, part / np.where(is_known, whole, 1.0), np.nan)


def static_balance(rows: RowsInWindow) -> FloatArray:
    """Return the largest ``|F|`` over the largest of one spring or member in the window."""
    part = rows.largest_part
    text = "no spring or member bears more than the numerical error"
    is_known = rows.require(part > rows.curves.error, lambda: f"{text}, {rows.error_text}")
    return np.where(is_known, np.abs(rows.extremes).max(axis=0) / np.where(is_known, part, 1.0), np.nan)


def deviation_from_target(rows: RowsInWindow) -> FloatArray:
    """Return the largest ``|F - target| / target``."""
    extremes, target = rows.extremes, rows.require_target()
    return np.asarray(np.abs(np.subtract(extremes, target)).max(axis=0) / np.abs(target))


def rms_to_target(rows: RowsInWindow) -> FloatArray:
    """Return the root mean square of F - target at places uniform in the motion, the window's start excluded."""
    target = rows.require_target()
    rows.inside  # noqa: B018  (raises where the window is not covered)
    return rms_about(rows, target[:, None])


def deviation_from_curve(rows: RowsInWindow) -> FloatArray:
    """Return the largest ``|F - F*|`` over the largest ``|F*|`` in the window; of a model, next to the points, too."""
    inside, curve, curves = rows.inside, rows.require_followed(), rows.curves
    size = rows.largest_followed(*rows.ends)
    rows.require(~np.isnan(size), "the target curve is zero in the window")
    if curve is None:
        return size
    offsets = inside.change(inside.values - curve.evaluate(inside.motion))
    if curves.effort is None:
        top, bottom = offsets.values.max(axis=1), offsets.values.min(axis=1)
    else:
        top, bottom = offsets.extremes(lambda places: curves.all_at(places) - curve.evaluate(places))
    return np.asarray(np.maximum(top, -bottom) / size)


def rms_to_curve(rows: RowsInWindow) -> FloatArray:
    """Return the root mean square of F - F* at places uniform in the motion, the window's start excluded."""
    rows.inside  # noqa: B018  (raises where the window is not covered)
    rows.require_straight()
    curve = rows.require_followed()
    if curve is None:
        return np.full(len(rows), np.nan)
    return np.where(rows.is_followed(*rows.ends), rms_about(rows, curve.evaluate(uniform_places(rows))), np.nan)


def hysteresis_area(cycle: CycleRows) -> FloatArray:
    """Return the area between the branches ``load`` and ``unload`` in the window, positive where load lies above.

    The trapezoids of each branch on its own points add up to those of their
    difference on the union of the points, so no common grid is needed.
    """
    if not {"load", "unload"} <= set(cycle.branches):
        raise Undefined("a hysteresis loop needs the branches 'load' and 'unload'")
    load, unload = (cycle.branches[name] for name in ("load", "unload"))
    if load.window is None and not np.array_equal(load.ends, unload.ends):
        common = np.maximum(load.ends[0], unload.ends[0]), np.minimum(load.ends[1], unload.ends[1])
        load.require(common[0] < common[1], "the branches 'load' and 'unload' have no travel in common")
        load, unload = (restrict_to_window(rows.curves, common) for rows in (load, unload))
    return np.where(load.covered & unload.covered, load.work - unload.work, np.nan)


def stress_max(rows: RowsInWindow) -> FloatArray:
    """Return the largest stress in the window, in whatever load case it is; of a model, next to the points, too."""
    return rows.largest_stress()


def safety_factor(rows: RowsInWindow) -> FloatArray:
    """Return the allowable stress over the largest stress in the window."""
    stress, stated = rows.curves.stress, rows.curves.frame.allowable_stress
    allowable = np.array([np.nan if stated is None else stated]) if stress is None else stress.allowable
    rows.require(~np.isnan(allowable), "there is no allowable stress to compare with")
    top = rows.largest_stress()
    return np.where(rows.require(top > NO_STRESS * allowable, "nothing is stressed"), allowable / top, np.nan)


def fatigue_life(rows: RowsInWindow) -> FloatArray:
    """Return the cycles to failure between the least and the largest stress in the window, of all load cases."""
    durability = rows.curves.frame.durability
    if durability is None or durability.fatigue is None:
        raise Undefined("the material has no fatigue data: add 'fatigue' to it")
    ranges = [rows.find_stress_range(alone=True), *rows.list_stress_ranges_beside()]
    return np.array([min(durability.fatigue.life(most, least) for (least,), (most,) in ranges if least <= most)])


def effort_after(rows: RowsInWindow, time: float) -> FloatArray:
    """Return the mean effort in the window after a hold of a time [s]."""
    durability = rows.curves.frame.durability
    if durability is None or durability.relaxation is None:
        raise Undefined("the material has no relaxation data: add 'relaxation' to it")
    return np.asarray(rows.mean * durability.relaxation.ratio(time))


_TABLE_3 = "[Sanchez-Salinas 2022, Table 3]"
_DING_SECTION = "[Ding 2022, sec. 6.2]"
IN_WINDOW = (
    Definition(
        "force_mean",
        "effort",
        f"mean {{effort}} over the points in the window, its ends included {_TABLE_3}",
        mean,
        worst="farthest-from-target",
    ),
    Definition(
        "force_sd",
        "effort",
        f"standard deviation (n - 1) of the {{effort}} over the points in the window {_TABLE_3}",
        standard_deviation,
    ),
    Definition(
        "force_max",
        "effort",
        f"largest {{effort}} in the window {_TABLE_3}",
        largest,
    ),
    Definition(
        "force_min",
        "effort",
        f"smallest {{effort}} in the window {_TABLE_3}",
        smallest,
        worst="smallest",
    ),
    Definition(
        "force_ripple",
        "ratio",
        f"(max - min)/max of the {{effort}} in the window: the fluctuation of {_DING_SECTION}",
        ripple,
    ),
    Definition(
        "half_band",
        "ratio",
        "(max - min)/(max + min) of the {effort} in the window: half the width of the narrowest band that holds it",
        half_band,
    ),
    Definition(
        "deviation_from_mean",
        "ratio",
        f"largest |F - mean|/mean of the {{effort}} in the window {_DING_SECTION}",
        deviation_from_mean,
    ),
    Definition(
        "deviation_from_target",
        "ratio",
        "largest |F - target|/target of the {effort} in the window",
        deviation_from_target,
    ),
    Definition(
        "rms_to_target",
        "effort",
        "sqrt(mean((F - target)^2)) of the {effort} at 100 places uniform in the {motion}, "
        "the start of the window excluded [Bilancia 2019, eq. 8]",
        rms_to_target,
    ),
    Definition(
        "deviation_from_curve",
        "ratio",
        "largest |F - F*| of the {effort} over the largest |F*| in the window, F* the curve of `design.target` or "
        "`analysis.target`",
        deviation_from_curve,
        of_curve=True,
    ),
    Definition(
        "rms_to_curve",
        "effort",
        "sqrt(mean((F - F*)^2)) of the {effort} at 100 places uniform in the {motion}, the start of the window "
        "excluded, F* the curve of `design.target` or `analysis.target`",
        rms_to_curve,
        of_curve=True,
    ),
    Definition(
        STATIC_BALANCE,
        "ratio",
        "largest |F| of the {effort} in the window over the largest {effort} of one spring or member there, which is "
        "the derivative of its energy by the {motion}; 0 is a perfect balancer",
        static_balance,
        of_parts=True,
    ),
)
"""Metrics of the effort in the window, in the order in which they are shown."""
LOSS_AND_STRESS_METRICS = (
    Definition(
        "hysteresis_area",
        "work",
        "closed integral of the {effort} over the {motion} in the window, positive where 'load' lies above 'unload' "
        "[Sanchez-Salinas 2022, sec. 3]",
        hysteresis_area,
        scope="loop",
    ),
    Definition(
        "stress_max",
        "stress",
        "largest stress in the window, of all load cases",
        stress_max,
    ),
    Definition(
        "safety_factor",
        "factor",
        "allowable stress over the largest stress in the window, of all load cases; 1 or more is within the limit",
        safety_factor,
        worst="smallest",
    ),
)
"""Metrics of loss and stress."""
LONG_TERM = (
    Definition(
        "fatigue_life",
        "count",
        "cycles to failure between the least and the largest stress in the window, of all load cases, by the "
        "material's `fatigue` with Goodman's line",
        fatigue_life,
        worst="smallest",
        of_material=True,
    ),
    Definition(
        "force_after",
        "effort",
        "mean {effort} in the window after a hold of the time in brackets, as in `force_after[1000 h]`: it follows "
        "the material's `relaxation`",
        effort_after,
        worst="smallest",
        argument="time",
        of_material=True,
    ),
)
"""Metrics of fatigue and relaxation, of materials that say something about them."""

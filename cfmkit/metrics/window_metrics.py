"""Metrics of what lies inside the window: statistics, deviations, hysteresis, stress, cycles to failure.

Each has its function and, in the tables at the end, its definition.

A branch whose mean is negative is judged in its own direction (the opposite sign
convention gives the same ripple). Each function takes a `Branch` (or the
`Cycle`) and returns SI, or raises `Undefined` with the reason.
"""

from __future__ import annotations

from functools import partial
from math import isnan, sqrt
from operator import attrgetter, methodcaller
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.metrics import branches, ranges_many, spread
from cfmkit.metrics.branches import BranchTrace, Undefined, Window
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.metrics.definition import Definition
from cfmkit.metrics.ranges_many import UNIFORM_POINTS
from cfmkit.results import LargestStress, OwnStress

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.branch_views import Branch
    from cfmkit.metrics.usable_interval_of_all_branches import Cycle


NO_STRESS = 1e-12  # share of the allowable stress that rounding leaves where nothing is stressed
UNKNOWN_BESIDE = "the stress of another load case is not known everywhere in the window"
"""Why there is no largest stress, and no life."""


def mean(branch: Branch) -> float:
    """Return the mean effort over the points in the window."""
    return float(spread.level(branch.spread))


def standard_deviation(branch: Branch) -> float:
    """Return the sample standard deviation (n - 1) of the effort over the points in the window."""
    effort = branch.inside.effort
    if len(effort) < 2:
        raise Undefined("a standard deviation needs two points")
    if branch.frame.over_motion:
        return sqrt(branch.mean_over_motion((effort - mean(branch)) ** 2))
    return float(spread.deviation(effort, mean(branch)))


def largest(branch: Branch) -> float:
    """Return the largest effort in the window."""
    return float(spread.largest(branch.spread))


def smallest(branch: Branch) -> float:
    """Return the smallest effort in the window."""
    return float(spread.smallest(branch.spread))


def ripple(branch: Branch) -> float:
    """Return (max - min) / max."""
    return _require_value(spread.ripple(branch.spread), branch)


def half_band(branch: Branch) -> float:
    """Return (max - min) / (max + min)."""
    return _require_value(spread.half_band(branch.spread), branch)


def deviation_from_mean(branch: Branch) -> float:
    """Return the largest ``|F - mean| / mean``."""
    return _require_value(spread.deviation_from_mean(branch.spread), branch)


def _require_value(share: float, branch: Branch) -> float:
    if isnan(share):
        raise Undefined(branch.vanishes)
    return float(share)


def static_balance(branch: Branch) -> float:
    """Return the largest ``|F|`` over the largest of one spring or member in the window."""
    part = branch.largest_part
    if part <= branch.error:
        raise Undefined(f"no spring or member bears more than the numerical error, {branch.error_text}")
    return float(spread.static_balance(branch.spread, part))


def deviation_from_target(branch: Branch) -> float:
    """Return the largest ``|F - target| / target``."""
    return float(spread.deviation_from_target(branch.spread, branch.frame.needed_target()))


@np.errstate(all="ignore")
def rms_to_target(branch: Branch) -> float:
    """Return the root mean square of F - target at places uniform in the motion, the window's start excluded."""
    target = np.array([branch.frame.needed_target()])
    branch.inside  # noqa: B018  (raises where the window is not covered)
    return float(ranges_many.rms_to_target(branch.many, target)[0])


@np.errstate(all="ignore")
def _uniform(branch: Branch) -> tuple[FloatArray, FloatArray]:
    """Return places uniform in the motion, the start of the window left out, and the efforts there."""
    branch.inside  # noqa: B018  (raises where the window is not covered)
    places = ranges_many.uniform_places(branch.many)
    return places[0], branch.many.interpolate(places)[0]


def deviation_from_curve(branch: Branch) -> float:
    """Return the largest ``|F - F*|`` over the largest ``|F*|`` in the window; of a model, next to the points, too."""
    (low, high), part, model = branch.ends, branch.inside, branch.frame.closed
    curve = branch.frame.needed_curve(low, high, branch.kind)
    size = curve.largest(low, high)
    if size <= branch.error:
        raise Undefined("the target curve is zero in the window")
    offset = part.effort - curve.evaluate(part.motion)
    top, bottom = offset.max(), offset.min()
    if model is not None:

        def measure_deviation(places: FloatArray) -> FloatArray:
            return np.asarray(model.effort(branch.name, places) - curve.evaluate(places))

        top, bottom = (float(one[0]) for one in extremes(measure_deviation, part.motion[None, :], offset[None, :]))
    return float(max(top, -bottom)) / size


def rms_to_curve(branch: Branch) -> float:
    """Return the root mean square of F - F* at places uniform in the motion, the window's start excluded."""
    places, effort = _uniform(branch)
    offset = effort - branch.frame.needed_curve(*branch.ends, branch.kind).evaluate(places)
    return sqrt(float(offset @ offset) / UNIFORM_POINTS)


def hysteresis_area(cycle: Cycle) -> float:
    """Return the area between the branches ``load`` and ``unload`` in the window, positive where load lies above.

    The trapezoids of each branch on its own points add up to those of their
    difference on the union of the points, so no common grid is needed.
    """
    by_name = {branch.name: branch for branch in cycle.branches}
    if not {"load", "unload"} <= set(by_name):
        raise Undefined("a hysteresis loop needs the branches 'load' and 'unload'")
    load, unload = by_name["load"], by_name["unload"]
    window = load.window or _common(load, unload)
    return _area(load, window) - _area(unload, window)


def _common(one: Branch, other: Branch) -> Window:
    """Return the travel that both branches cover."""
    lo, hi = max(one.extent[0], other.extent[0]), min(one.extent[1], other.extent[1])
    if not lo < hi:
        raise Undefined("the branches 'load' and 'unload' have no travel in common")
    return Window(lo, hi)


def _area(branch: Branch, window: Window) -> float:
    """Return the area under a branch, whichever way it runs."""
    part = branch.inside if window == branch.window else branch.part(window)
    if not isinstance(part, BranchTrace):
        raise Undefined(part)
    way = np.sign(branch.trace.motion[-1] - branch.trace.motion[0])
    return float(way) * part.work()


def stress_max(branch: Branch) -> float:
    """Return the largest stress in the window, in whatever load case it is; of a model, next to the points, too."""
    model, beside = branch.frame.closed, [one.stress for one in branch.inside_beside if one.stress is not None]
    if any(np.isnan(one).any() for one in beside):
        raise Undefined(UNKNOWN_BESIDE)
    branch.inside  # noqa: B018  (raises where the window is not covered)
    own: float | None = None
    if isinstance(model, LargestStress):
        own = model.largest_stress(branch.name, *branch.ends)
    return max([_stress_range(branch)[1] if own is None else own, *(float(one.max()) for one in beside)])


def _stress_range(branch: Branch, alone: bool = False) -> tuple[float, float]:
    """Return the least and the largest stress of a branch in the window [Pa].

    `alone`: its own load case only, where a model knows the largest stress of all of them.
    """
    own, model = _stress(branch.inside), branch.frame.closed
    if (path := branch.frame.winding) is not None:
        top, bottom = branches.stress_extremes(path, *branch.ends_on_way)
        return bottom, top
    if model is None:
        return float(own.min()), float(own.max())
    law, motion = partial(model.stress, branch.name), branch.inside.motion
    if alone and branch.frame.load_cases and isinstance(model, OwnStress):
        law = partial(model.own_stress, branch.name)
        own = law(motion)  # ends of the window between two points have the stress of all load cases
    tops, bottoms = extremes(law, motion[None, :], own[None, :])
    return float(bottoms[0]), float(tops[0])


def safety_factor(branch: Branch) -> float:
    """Return the allowable stress over the largest stress in the window."""
    allowable = branch.frame.allowable_stress
    if allowable is None:
        raise Undefined("there is no allowable stress to compare with")
    stress = stress_max(branch)
    if stress <= NO_STRESS * allowable:
        raise Undefined("nothing is stressed")
    return allowable / stress


def _stress(trace: BranchTrace) -> FloatArray:
    if trace.stress is None:
        raise Undefined("the curve has no column 'max_stress'")
    if unknown := int(np.isnan(trace.stress).sum()):
        raise Undefined(f"the stress is unbounded at {unknown} of {len(trace.stress)} points in the window")
    return trace.stress


def fatigue_life(branch: Branch) -> float:
    """Return the cycles to failure between the least and the largest stress in the window, of all load cases."""
    known = branch.frame.durability
    if known is None or known.fatigue is None:
        raise Undefined("the material has no fatigue data: add 'fatigue' to it")
    ranges = [_stress_range(branch, alone=True)]
    for part in branch.inside_beside:
        if part.stress is None or np.isnan(part.stress).any():
            raise Undefined(UNKNOWN_BESIDE)
        ranges.append((float(part.stress.min()), float(part.stress.max())))
    return min(known.fatigue.life(largest, least) for least, largest in ranges)


def effort_after(branch: Branch, time: float) -> float:
    """Return the mean effort in the window after a hold of a time [s]."""
    known = branch.frame.durability
    if known is None or known.relaxation is None:
        raise Undefined("the material has no relaxation data: add 'relaxation' to it")
    return float(branch.spread.mean * branch.spread.sign * known.relaxation.ratio(time))


# --- the same of many curves, `RowsInWindow`, (d,) each; functions with names, since studies are pickled --------------


def _extreme(which: int, rows: Any) -> FloatArray:
    return np.asarray(rows.many.extremes[which])


def _read_spread(function: Callable[[spread.Spread], FloatArray], rows: Any) -> FloatArray:
    return function(rows.many.spread)


def _deviations_from_target(rows: Any) -> FloatArray:
    return np.asarray(spread.deviation_from_target(rows.many.spread, rows.curves.target))


def _where_known(function: Callable[[Any], FloatArray], rows: Any) -> FloatArray:
    return np.asarray(rows.where_known(function(rows)))


_TABLE_3 = "[Sanchez-Salinas 2022, Table 3]"
_DING_SECTION = "[Ding 2022, sec. 6.2]"
IN_WINDOW = (
    Definition(
        "force_mean",
        "effort",
        f"mean {{effort}} over the points in the window, its ends included {_TABLE_3}",
        mean,
        attrgetter("many.mean"),
        worst="farthest-from-target",
    ),
    Definition(
        "force_sd",
        "effort",
        f"standard deviation (n - 1) of the {{effort}} over the points in the window {_TABLE_3}",
        standard_deviation,
        attrgetter("many.deviation"),
    ),
    Definition(
        "force_max",
        "effort",
        f"largest {{effort}} in the window {_TABLE_3}",
        largest,
        partial(_extreme, 0),
    ),
    Definition(
        "force_min",
        "effort",
        f"smallest {{effort}} in the window {_TABLE_3}",
        smallest,
        partial(_extreme, 1),
        worst="smallest",
    ),
    Definition(
        "force_ripple",
        "ratio",
        f"(max - min)/max of the {{effort}} in the window: the fluctuation of {_DING_SECTION}",
        ripple,
        partial(_read_spread, spread.ripple),
    ),
    Definition(
        "half_band",
        "ratio",
        "(max - min)/(max + min) of the {effort} in the window: half the width of the narrowest band that holds it",
        half_band,
        partial(_read_spread, spread.half_band),
    ),
    Definition(
        "deviation_from_mean",
        "ratio",
        f"largest |F - mean|/mean of the {{effort}} in the window {_DING_SECTION}",
        deviation_from_mean,
        partial(_read_spread, spread.deviation_from_mean),
    ),
    Definition(
        "deviation_from_target",
        "ratio",
        "largest |F - target|/target of the {effort} in the window",
        deviation_from_target,
        _deviations_from_target,
    ),
    Definition(
        "rms_to_target",
        "effort",
        "sqrt(mean((F - target)^2)) of the {effort} at 100 places uniform in the {motion}, "
        "the start of the window excluded [Bilancia 2019, eq. 8]",
        rms_to_target,
        partial(_where_known, methodcaller("rms_to_target")),
    ),
    Definition(
        "deviation_from_curve",
        "ratio",
        "largest |F - F*| of the {effort} over the largest |F*| in the window, F* the curve of `design.target` or "
        "`analysis.target`",
        deviation_from_curve,
        partial(_where_known, methodcaller("deviation_from_curve")),
        of_curve=True,
    ),
    Definition(
        "rms_to_curve",
        "effort",
        "sqrt(mean((F - F*)^2)) of the {effort} at 100 places uniform in the {motion}, the start of the window "
        "excluded, F* the curve of `design.target` or `analysis.target`",
        rms_to_curve,
        partial(_where_known, methodcaller("rms_to_curve")),
        of_curve=True,
    ),
    Definition(
        spread.STATIC_BALANCE,
        "ratio",
        "largest |F| of the {effort} in the window over the largest {effort} of one spring or member there, which is "
        "the derivative of its energy by the {motion}; 0 is a perfect balancer",
        static_balance,
        partial(_where_known, methodcaller("static_balance")),
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
        attrgetter("loop_area"),
        scope="loop",
    ),
    Definition(
        "stress_max",
        "stress",
        "largest stress in the window, of all load cases",
        stress_max,
        partial(_where_known, methodcaller("stress_max")),
    ),
    Definition(
        "safety_factor",
        "factor",
        "allowable stress over the largest stress in the window, of all load cases; 1 or more is within the limit",
        safety_factor,
        partial(_where_known, methodcaller("safety_factor")),
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

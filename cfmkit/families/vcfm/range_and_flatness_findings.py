"""Findings about the range of the closed forms, and remedies for a force that is not flat over its window.

Predicates take the solution of any number of mechanisms, sentences that of one. Remedies are other widths, or another
window; only what was tried is named. Forces are linear in the widths, so that other widths need no other solution.
"""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import format_at_least, format_at_most, mm, percent
from cfmkit.families.vcfm.leaves.v_beam import MAX_LEAF_ANGLE, MAX_TRAVEL_RATIO, STOCKY_LEAF_RATIO, THICK_LEAF_RATIO
from cfmkit.families.vcfm.solution import LIMIT_RTOL, goes_beyond

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Solution

    Sentence = tuple[Any, ...]


def _slimness(solution: Solution) -> FloatArray:
    """Return thickness over length of the leaves, (m,)."""
    return solution.spread_over_mechanisms(solution.parts.strip.thickness / solution.parts.strip.length)


def is_stocky(solution: Solution) -> Any:
    """Return which leaves are so thick that no model here is for them, (m,)."""
    return (_slimness(solution) > STOCKY_LEAF_RATIO) & (solution.fidelity != "truss")


def leaves_out_of_range(solution: Solution) -> Any:
    """Return which leaves the closed form is not for, (m,)."""
    if solution.fidelity != "analytic":
        return False
    if solution.leaf_kind.shortcoming is not None:
        return ~is_stocky(solution)
    reach = MAX_TRAVEL_RATIO * solution.spread_over_mechanisms(solution.parts.balance)
    steep = solution.spread_over_mechanisms(solution.parts.strip.angle) > MAX_LEAF_ANGLE
    far = goes_beyond(solution.nominal.ends[1], reach)
    return ~is_stocky(solution) & ((_slimness(solution) > THICK_LEAF_RATIO) | steep | far)


def range_of_leaves(solution: Solution) -> Sentence:
    """Return why the closed form is not for these leaves."""
    strip, share, cure = solution.parts.strip, float(_slimness(solution)[0]), "analysis.fidelity=exact"
    verify = "verify with 'analysis.fidelity: exact'"
    if (shortcoming := solution.leaf_kind.shortcoming) is not None:
        return f"{shortcoming(solution.parts.leaf)}. V{verify[1:]}", cure
    if share > THICK_LEAF_RATIO:
        return (
            f"the thickness of the leaves is {percent(share)} of their length: the closed forms are for thin leaves, "
            f"and are off by 5 to 10 % or more here; {verify}",
            cure,
        )
    if float(strip.angle) > MAX_LEAF_ANGLE:
        text = f"leaves at {degrees(strip.angle):.3g} deg: the closed forms hold for small angles, up to 15 deg"
        return f"{text}; {verify}", cure
    return (
        f"the travel goes to {mm(float(solution.first.travel[-1]))}, beyond {MAX_TRAVEL_RATIO} times the rise "
        f"({mm(MAX_TRAVEL_RATIO * float(solution.parts.balance))}): the force there is off by several per "
        f"cent; {verify}",
        cure,
    )


def range_of_leaves_in_short(solution: Solution) -> str:
    """Return the same in short; empty where the sentence is short enough."""
    if (
        solution.leaf_kind.shortcoming is not None
        or _slimness(solution)[0] > THICK_LEAF_RATIO
        or float(solution.parts.strip.angle) > MAX_LEAF_ANGLE
    ):
        return ""
    return (
        f"closed forms are off by several per cent beyond "
        f"{mm(MAX_TRAVEL_RATIO * float(solution.parts.balance))} of travel"
    )


def _worst_compression(solution: Solution, limits: tuple[float, float]) -> FloatArray:
    """Return by how much the spring is compressed, or negative stretched, where that matters most, (m,) [m]."""
    pressed, stretched = limits
    ends = np.stack([end + solution.curves.preload[:, 0] for end in solution.curves.ends], axis=1)
    ends = solution.split_by_mechanism(ends).reshape(len(solution), -1)
    worst = np.where(ends > 0, ends / pressed, -ends / stretched).argmax(axis=1)
    return np.asarray(ends[np.arange(len(ends)), worst])


def spring_out_of_range(solution: Solution) -> Any:
    """Return which springs the closed form is not for, (m,)."""
    spring: Any = solution.parts.spring
    limits = getattr(spring, "deflection_limits", None)
    if solution.fidelity != "analytic" or limits is None:
        return False
    worst = _worst_compression(solution, limits)
    share = np.abs(worst) / (2.0 * solution.spread_over_mechanisms(spring.strip.length))
    steep = solution.spread_over_mechanisms(spring.strip.angle) > MAX_LEAF_ANGLE
    return ~is_stocky(solution) & (steep | (share > np.where(worst > 0, *limits)))


def range_of_spring(solution: Solution) -> Sentence:
    """Return why the closed form is not for this spring."""
    spring: Any = solution.parts.spring
    worst = float(_worst_compression(solution, spring.deflection_limits)[0])
    if spring.strip.angle > MAX_LEAF_ANGLE:
        angle = degrees(spring.strip.angle)
        text = f"the leaves of the spring are at {angle:.3g} deg: its stiffness changes with its compression"
    else:
        what, share = "compressed" if worst > 0 else "stretched", abs(worst) / (2.0 * float(spring.strip.length))
        text = f"the spring is {what} by {mm(abs(worst))}, each leaf by {percent(share)} of its length"
    return (
        f"{text}; the closed form's constant stiffness is off by several per cent: verify with "
        "'analysis.fidelity: exact'",
        "analysis.fidelity=exact",
    )


def stocky_leaves(solution: Solution) -> Sentence:
    """Return how thick these leaves are."""
    return (
        f"leaves whose thickness is {percent(float(_slimness(solution)[0]))} of their length are not beams: no model "
        "here predicts their force or stress; use longer or thinner leaves",
    )


FLATNESS_SHARES = (0.998, 0.99, 0.97, 0.94, 0.9)
"""Shares of the flatness that are looked for where a window is proposed: by the samples of a curve, with a corner cut
off, the whole must be kept."""
MAX_WIDTH_FACTOR = 50.0  # factor on a width up to which one is looked for that makes the force flat


def find_flattening(solution: Solution, ripple: float) -> tuple[str, tuple[str, ...]]:
    """Return what makes the force flat, in words and as changes of the specification: only what has been tried.

    Where no width makes the force flat over the window, the window is wrong: then the flat part is named.
    """
    factor, left = _better_width(solution)
    allowed = solution.spec.analysis.flatness
    if left <= allowed and left < ripple:
        by_spring = "as wide" if solution.spec.mechanism.springs is None else "as stiff"
        text = f"; leaves {factor:.3g} times as wide, or a spring {1.0 / factor:.3g} times {by_spring}, make them equal"
        return text, ()
    (first, last), (low, high) = (float(end[0]) for end in solution.linear_range), solution.window_of_one
    why = ""
    if np.isfinite(first) and (low < first or high > last):
        why = f"; the leaves are buckled from {mm(first)} to {mm(last)} only"
    for share in FLATNESS_SHARES:
        flat = solution.nominal.flat_parts(share * allowed)
        if np.isfinite(flat[0][0]) and ripple_inside(solution, flat) <= (1.0 - LIMIT_RTOL) * allowed:
            start, end = format_at_least(float(flat[0][0])), format_at_most(float(flat[1][0]))
            cure = f"analysis.window=[{start}, {end}]"
            return f"{why}; the force is flat from {start} to {end}: use that as the window", (cure,)
    return f"{why}; no width of leaves or spring makes it flat", ()


def ripple_inside(solution: Solution, window: tuple[FloatArray, FloatArray]) -> float:
    """Return (max - min)/max of the force of one mechanism in a window; infinite where none is positive."""
    top, bottom = (float(end[0]) for end in solution.nominal.extremes_inside(window))
    return (top - bottom) / top if 0 < top < np.inf else np.inf


def _better_width(solution: Solution) -> tuple[float, float]:
    """Return the factor on the leaves' width that makes the force flattest in the window, and the ripple left."""
    low, high = solution.window_of_one
    travel = solution.first.travel
    places = np.unique(np.concatenate([np.linspace(low, high, 201), travel[(travel > low) & (travel < high)]]))
    leaves = solution.sampler.leaf_force(places)
    spring = solution.sampler.spring(places + solution.first.preload)[0]
    if not np.isfinite(leaves + spring).all():
        return 1.0, np.inf
    character = solution.character
    factors = np.geomspace(1.0 / MAX_WIDTH_FACTOR, MAX_WIDTH_FACTOR, 801)
    if character.negative_stiffness > 0:  # the nearest at hand where the slopes are constant
        factors = np.append(factors, character.positive_stiffness / character.negative_stiffness)
    top, bottom = (extreme_sums(factors, leaves, spring, sign) for sign in (1.0, -1.0))
    with np.errstate(all="ignore"):
        left = np.where(bottom > 0, (top - bottom) / top, np.inf)
    # stiffnesses that cancel are what a reader expects: another factor only where that one does not do
    best = len(factors) - 1 if left[-1] <= solution.spec.analysis.flatness else int(left.argmin())
    return float(factors[best]), float(left[best])


def extreme_sums(factors: FloatArray, slopes: FloatArray, offsets: FloatArray, sign: float) -> FloatArray:
    """Return the largest (`sign` 1) or smallest (-1) of factor * slope + offset over many lines, for each factor.

    Only lines of the convex hull of (slope, offset) are ever extreme: some dozen of hundreds.

    Examples
    --------
    >>> extreme_sums(np.array([0.0, 2.0]), np.array([1.0, -1.0, 0.5]), np.array([0.0, 3.0, 1.0]), 1.0).tolist()
    [3.0, 2.0]
    """
    hull: list[int] = []
    # Where leaves are buckled the lines meet in one point: without a margin, rounding keeps all of them.
    margin = 1e-14 * float(np.ptp(slopes)) * float(np.abs(offsets).max(initial=0.0))
    x, y = (sign * slopes).tolist(), (sign * offsets).tolist()
    for k in np.lexsort((-sign * offsets, sign * slopes)).tolist():
        if hull and x[k] == x[hull[-1]]:
            continue
        while len(hull) > 1:
            i, j = hull[-2:]
            if (x[j] - x[i]) * (y[k] - y[i]) < (y[j] - y[i]) * (x[k] - x[i]) - margin:
                break
            hull.pop()
        hull.append(k)
    sums = factors[:, None] * slopes[hull] + offsets[hull]
    return np.asarray(sign * (sign * sums).max(axis=1))

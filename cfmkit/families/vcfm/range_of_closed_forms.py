"""Range of the closed forms of leaves and spring, and warnings beyond it.

Predicates take the solution of any number of mechanisms, sentences that of one.
"""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import mm, percent
from cfmkit.families.vcfm.leaves.v_beam import MAX_LEAF_ANGLE, MAX_TRAVEL_RATIO, STOCKY_LEAF_RATIO, THICK_LEAF_RATIO
from cfmkit.families.vcfm.solution import goes_beyond

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

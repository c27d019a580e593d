"""Designs that are as good as the best one: how far rates and lengths may move, and which to prefer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.rates import preferred, ranges
from cfmkit.families.slider_crank.targets import FREE, task_of, with_lengths
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.rates import Goal
    from cfmkit.families.slider_crank.solved import Solved
    from cfmkit.families.slider_crank.spec import CrankDesign, SliderCrankSpec
    from cfmkit.numerics.boxes import Lowest
    from cfmkit.results import Finding

NEGLIGIBLE = 5e-4
"""More deviation, as a fraction of the target, that nobody would notice: such designs are told of as equals."""

PLACES = 60
"""Places of the window for the programmes that say how far the rates may move."""


def chosen_rates(goal: Goal, best: FloatArray, wanted: CrankDesign) -> FloatArray:
    """Return the rates preferred among those whose deviation is worse than the best by no more than the slack."""
    if wanted.prefer == "small-rotation":  # a matter of lengths only
        return best
    found = preferred(goal, goal.deviation(best) + wanted.slack, wanted.prefer)
    return best if found is None else found


def even_best(spec: SliderCrankSpec, names: tuple[str, ...], search: Lowest) -> tuple[float, ...]:
    """Return the lengths preferred among those on the search's first axis that are worse by no more than the slack."""
    wanted = spec.design
    if wanted is None or wanted.window is None or wanted.prefer != "small-rotation":
        return search.place
    good = [place for place, value in search.profile if value <= search.value + wanted.slack]

    def rotation(place: tuple[float, ...]) -> float:
        task = task_of(with_lengths(spec, dict(zip(names, place, strict=True))))
        return task.rotation(wanted.window or (0.0, 0.0))

    return min([search.place, *good], key=rotation)


def alternatives(solved: Solved, search: Lowest | None) -> tuple[Finding, ...]:
    """Return how far rates and lengths may move without harm, if they may move far."""
    told = [text for text in (_of_lengths(solved, search), _of_rates(solved)) if text]
    if not told:
        return ()
    wanted = solved.task.wanted
    extra = max(wanted.slack, NEGLIGIBLE)
    cure = "" if wanted.slack else "; 'design.slack' and 'design.prefer' choose among them"
    text = f"within another {100 * extra:.2g} % of deviation lie many designs: {'; '.join(told)}{cure}"
    return (finding("near_optima", text),)


def _of_rates(solved: Solved) -> str:
    """Return the range of each rate with nearly the same deviation; empty if all are well determined."""
    goal = solved.task.goal(solved.window, PLACES)
    if goal is None:
        return ""
    span = ranges(goal, goal.deviation(solved.rates) + max(solved.task.wanted.slack, NEGLIGIBLE))
    if np.isnan(span).any():
        return ""
    wide = span[:, 1] - span[:, 0] > 0.2 * np.maximum(solved.rates, 1e-300)
    told = []
    for k, name in enumerate(JOINTS):
        if name in solved.task.wanted.springs and wide[k] and math.isfinite(span[k, 1]):
            dimension = "stiffness" if name == "slider" else "rotational_stiffness"
            low, high = (format_short(float(end), dimension) for end in span[k])
            told.append(f"{name.replace('_', ' ')} {low} to {high}")
    return ", ".join(told) if len(told) > 1 else ""


def _of_lengths(solved: Solved, search: Lowest | None) -> str:
    """Return the range of the first free length with nearly the same deviation; empty if it is well determined."""
    wanted = solved.task.wanted
    if search is None or wanted.window is None:
        return ""
    good = [place[0] for place, value in search.profile if value <= search.value + max(wanted.slack, NEGLIGIBLE)]
    if len(good) < 2:
        return ""
    name = next(name for name in FREE if getattr(wanted, name) is not None)
    dimension = "angle" if name == "unloaded_offset" else "length"
    low, high = (format_short(end, dimension) for end in (min(good), max(good)))
    return f"{name.replace('_', ' ')} {low} to {high}"

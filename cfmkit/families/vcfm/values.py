"""Scalar results of a mechanism, beside the constant-force metrics of every family."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.vcfm.tables import forces
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.vcfm.model import Push, Solution

DEFINITIONS = {
    "positive_stiffness": ("stiffness", "K_p of the spring as made"),
    "negative_stiffness": ("stiffness", "size of the leaves' negative stiffness: constant where they are buckled"),
    "first_stiffness": ("stiffness", "K_b1 of the leaves as made"),
    "rise": ("length", "h of the leaves: travel to the flat pose"),
    "slenderness": (
        "ratio",
        "rise over thickness of the leaves, Q: above pi they buckle, above 3.195 they are bistable",
    ),
    "linear_start": ("length", "travel at which the leaves buckle"),
    "linear_end": ("length", "travel at which they straighten again"),
    "linear_stroke": ("length", "length of the linear negative stiffness"),
    "constant_force": ("force", "force of the spring where the leaves carry nothing, K_p (h + dr) for straight leaves"),
    "window_start": ("length", "start of the longest stretch within analysis.flatness"),
    "window_end": ("length", "end of it"),
    "window_length": ("length", "length of it; 0 if there is none"),
    "window_force": ("force", "mean force in it"),
    "rest_position": ("length", "where the shuttle rests at the nominal preload, from the as-made pose"),
    "rest_shift_max": ("length", "largest distance of a rest position from the as-made pose, over all preloads"),
    "force_change_max": ("force", "largest change of the mean force by a preload, against the nominal one"),
    "force_per_preload": ("stiffness", "that change over the change of the preload"),
    "least_force": ("force", "least force once the leaves are past their peak: positive if it returns by itself"),
    "stiffness_mismatch": ("ratio", "|K_p - K_n| times the length of the window over the constant force"),
    "allowable_stress": ("stress", "yield strength over `mechanism.safety_factor`"),
    "spring_stress_max": ("stress", "largest stress of the spring up to the end of the window, over all preloads"),
    "bistable_stress_max": ("stress", "largest stress of the leaves up to the end of the window, over all preloads"),
    "travel_stress_max": (
        "stress",
        "largest stress of leaves and spring over the whole travel and all preloads: unless a stop ends the travel "
        "with the window, this one counts",
    ),
    "travel_safety_factor": ("factor", "allowable stress over that"),
}


def values_of(solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; None where a value does not exist."""
    one, strip = solution.character, solution.parts.strip
    low, high = one.linear
    nominal, window = solution.nominal, solution.windows[0]
    force = solution.constant_force
    span = solution.window[1] - solution.window[0]
    end = solution.window[1]
    leaves, spring = np.max([solution.largest_stress(push, end) for push in solution.pushes], axis=0).tolist()
    over_travel = max(max(solution.largest_stress(push)) for push in solution.pushes)
    allowed = solution.spec.mechanism.allowable_stress
    numbers: dict[str, float | None] = {
        "positive_stiffness": one.positive_stiffness,
        "negative_stiffness": one.negative_stiffness,
        "first_stiffness": one.first_stiffness,
        "rise": float(strip.rise),
        "slenderness": float(strip.slenderness),
        "linear_start": low,
        "linear_end": high,
        "linear_stroke": high - low if np.isfinite(high - low) else 0.0,
        "constant_force": force,
        "window_start": window[0] if window else None,
        "window_end": window[1] if window else None,
        "window_length": window[1] - window[0] if window else 0.0,
        "window_force": solution.window_force,
        "rest_position": nominal.rest,
        "rest_shift_max": max((abs(push.rest) for push in solution.pushes if push.rest is not None), default=None),
        "least_force": solution.least[1] if solution.least else None,
        "stiffness_mismatch": abs(one.positive_stiffness - one.negative_stiffness) * span / force if force else None,
        "allowable_stress": allowed,
        "spring_stress_max": spring,
        "bistable_stress_max": leaves,
        "travel_stress_max": over_travel,
        "travel_safety_factor": allowed / over_travel if allowed and over_travel else None,
    } | _adjustment(solution)
    return {name: _quantity(name, value) for name, value in numbers.items()}


def _quantity(name: str, value: float | None) -> Quantity:
    known = value is not None and np.isfinite(value)
    return Quantity(value if known else None, *DEFINITIONS[name], reason="" if known else "there is none")


def mean_force(solution: Solution, push: Push) -> float | None:
    """Return the mean force of a curve at even places of the solution's window [N]; None if it does not cover it."""
    force = forces(solution, push)
    return float(force.mean()) if np.isfinite(force).all() else None


def _adjustment(solution: Solution) -> dict[str, float | None]:
    nominal = mean_force(solution, solution.nominal)
    changes = []
    for push in solution.pushes[1:]:
        mean = mean_force(solution, push)
        if mean is not None and nominal is not None:
            changes.append((mean - nominal, push.preload - solution.nominal.preload))
    if not changes:
        return {"force_change_max": None, "force_per_preload": None}
    change, preload = max(changes, key=lambda pair: abs(pair[0]))
    return {"force_change_max": change, "force_per_preload": change / preload}

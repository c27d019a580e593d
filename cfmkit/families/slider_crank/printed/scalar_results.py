"""Scalar results of flexures and strips."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.fem_results import DEFINITIONS as OF_SOLIDS
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import kink

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.printed.solution import Solution


DEFINITIONS = {
    "kink": (
        "length",
        "offset of the crank pin from the line between pivot and slider pin, unloaded; left is positive",
    ),
    "run_in_95": ("length", "travel at which the force first reaches 95 % of its mean in the window"),
    "run_in_98": ("length", "travel at which the force first reaches 98 % of its mean in the window"),
    "side_force_max": ("force", "largest transverse force of the slider on its guide"),
    "guide_moment_max": ("torque", "largest moment of the slider on its guide"),
    "allowable_stress": ("stress", "yield strength over `mechanism.safety_factor`"),
    "stress_place": ("length", "position of the largest stress along the centre line from the clamped end"),
    "stress_stroke": ("length", "travel at which the allowable stress is reached"),
    "width_ratio": ("factor", "smallest width over thickness"),
    **OF_SOLIDS,
}


def numbers(solution: Solution) -> Iterator[tuple[str, float | None, str]]:
    """Yield name, value and, where there is none, the reason."""
    yield "kink", kink(solution.chain.pins), ""
    level = solution.level
    for name, share in (("run_in_95", 0.95), ("run_in_98", 0.98)):
        place = solution.first_at(share * level)
        yield name, place, "" if place is not None else "the force does not reach it"
    yield "side_force_max", _largest(solution.side_force), ""
    yield "guide_moment_max", _largest(solution.guide_moment), ""
    last = int(np.argmax(solution.stress))
    yield "allowable_stress", solution.material.allowable_stress, "the material has no 'yield_strength'"
    yield "stress_place", float(solution.place[last]), ""
    yield "stress_stroke", *stress_stroke(solution)
    yield "width_ratio", solution.width_ratio, ""
    yield "energy_max", float(solution.energy.max()), ""
    for name in OF_SOLIDS:
        yield name, None, "only the model of the part as a solid has it"


def stress_stroke(solution: Solution) -> tuple[float | None, str]:
    """Return the travel at which the allowable stress is reached [m]; None with the reason."""
    limit = solution.material.allowable_stress
    if limit is None:
        return None, "the material has no 'yield_strength'"
    place = solution.first_at(limit, stress=True)
    return place, "" if place is not None else "the stress stays below the allowable one"


def _largest(values: FloatArray) -> float:
    return float(np.abs(values).max())

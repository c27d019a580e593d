"""Scalar results of a printed slider-crank: flexures or a strip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.fem_results import FEM_DEFINITIONS as OF_SOLIDS
from cfmkit.families.rows import ScalarQuantity, or_nan
from cfmkit.families.slider_crank.springs.scalar_results import SCALAR_DEFINITIONS as OF_SPRINGS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.printed.solution import Solution

NO_STRENGTH = "the material has no 'yield_strength'"
OF_PINS = "it belongs to springs at pins: see fidelity 'prb'"


def _absent(dimension: str, definition: str, reason: str) -> ScalarQuantity[Solution]:
    return ScalarQuantity(dimension, definition, lambda _: math.nan, reason)


def _run_in_quantity(share: float) -> ScalarQuantity[Solution]:
    return ScalarQuantity(
        "length",
        f"travel at which the force first reaches {100 * share:.0f} % of its mean in the window",
        lambda solution: or_nan(solution.run_in(share)),
        "the force does not reach it",
    )


def _largest_magnitude(values: FloatArray) -> float:
    return float(np.abs(values).max())


def stress_stroke(solution: Solution) -> float:
    """Return the travel at which the allowable stress is reached [m]; NaN if it is not, or not known."""
    limit = solution.material.allowable_stress
    return math.nan if limit is None else or_nan(solution.first_at(limit, stress=True))


def _why_no_stroke(solution: Solution) -> str:
    return NO_STRENGTH if solution.material.allowable_stress is None else "the stress stays below the allowable one"


SCALAR_QUANTITIES: Mapping[str, ScalarQuantity[Solution]] = {
    "kink": ScalarQuantity(
        "length",
        "offset of the crank pin from the line between pivot and slider pin, unloaded; left is positive",
        lambda solution: solution.chain.kink,
    ),
    "run_in_95": _run_in_quantity(0.95),
    "run_in_98": _run_in_quantity(0.98),
    "side_force_max": ScalarQuantity(
        "force",
        "largest transverse force of the slider on its guide",
        lambda solution: _largest_magnitude(solution.side_force),
    ),
    "guide_moment_max": ScalarQuantity(
        "torque",
        "largest moment of the slider on its guide",
        lambda solution: _largest_magnitude(solution.guide_moment),
    ),
    "allowable_stress": ScalarQuantity(
        "stress",
        "yield strength over `mechanism.safety_factor`",
        lambda solution: or_nan(solution.material.allowable_stress),
        NO_STRENGTH,
    ),
    "stress_place": ScalarQuantity(
        "length",
        "position of the largest stress along the centre line from the clamped end",
        lambda solution: solution.place[solution.stress.argmax()],
    ),
    "stress_stroke": ScalarQuantity(
        "length", "travel at which the allowable stress is reached", stress_stroke, _why_no_stroke
    ),
    "width_ratio": ScalarQuantity("factor", "smallest width over thickness", lambda solution: solution.width_ratio),
    "energy_max": ScalarQuantity(*OF_SPRINGS["energy_max"], lambda solution: solution.energy.max()),
    **{name: _absent(*about, "only the model of the part as a solid has it") for name, about in OF_SOLIDS.items()},
    "stiffness_class": _absent(*OF_SPRINGS["stiffness_class"], OF_PINS),
    "crank_pin_rotation_max": _absent(*OF_SPRINGS["crank_pin_rotation_max"], OF_PINS),
}
"""Every scalar result of the model, in the order in which they are shown."""
SCALAR_DEFINITIONS = {name: quantity.about for name, quantity in SCALAR_QUANTITIES.items()}
"""Name -> dimension and definition."""

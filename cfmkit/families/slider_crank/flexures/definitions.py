"""Scalar results of flexures and strips: name -> (dimension, definition)."""

from __future__ import annotations

DEFINITIONS = {
    "kink": (
        "length",
        "offset of the crank pin from the line between pivot and slider pin, unloaded; left is positive",
    ),
    "run_in_95": ("length", "travel at which the force first reaches 95 % of its mean in the window"),
    "run_in_98": ("length", "travel at which the force first reaches 98 % of its mean in the window"),
    "side_force_max": ("force", "largest force of the slider on its guide, across its way"),
    "guide_moment_max": ("torque", "largest moment of the slider on its guide"),
    "allowable_stress": ("stress", "yield strength over `mechanism.safety_factor`"),
    "stress_place": ("length", "where the stress is largest: along the centre line from the clamped end"),
    "stress_stroke": ("length", "travel at which the allowable stress is reached"),
    "width_ratio": ("ratio", "smallest width over thickness"),
    "recheck_force": ("ratio", "largest difference of the force by corotational elements, as a share"),
    "recheck_stress": ("ratio", "largest difference of the stress by corotational elements, as a share"),
}

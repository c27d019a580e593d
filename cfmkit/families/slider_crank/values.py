"""Scalar results of a slider-crank, beside the constant-force metrics of every family."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.slider_crank.model import Solution

DEFINITIONS = {
    "stretched_angle": ("angle", "crank angle at which crank and coupler are in one line, theta_A2 [LH, eq. 13b]"),
    "unloaded_angle": ("angle", "crank angle with all springs relaxed, theta_A0"),
    "energy_max": ("energy", "largest energy in the springs"),
    "pivot_rotation_max": ("angle", "largest rotation of the spring at the pivot"),
    "crank_pin_rotation_max": ("angle", "largest rotation of the spring at the crank pin"),
    "slider_pin_rotation_max": ("angle", "largest rotation of the spring at the slider pin"),
    "slider_travel_max": ("length", "largest travel of the slider from the unloaded position"),
}


def values_of(solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results by name."""
    turn = np.nanmax(np.abs(solution.units.turn), axis=1)
    numbers: dict[str, float] = {
        "stretched_angle": solution.assembly.linkage.stretched_angle,
        "unloaded_angle": solution.assembly.unloaded,
        "energy_max": float(np.nanmax(solution.energy)),
        "pivot_rotation_max": float(turn[0]),
        "crank_pin_rotation_max": float(turn[1]),
        "slider_pin_rotation_max": float(turn[2]),
        "slider_travel_max": float(turn[3]),
    }
    return {name: Quantity(value, *DEFINITIONS[name]) for name, value in numbers.items()}

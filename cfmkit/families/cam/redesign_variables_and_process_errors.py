"""Values that may vary when a design is changed to raise its yield of good parts, and values with process errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.designing.rounded_and_reported_values import range_about

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import CamSpec


def free(spec: CamSpec, designed: CamSpec) -> dict[str, tuple[float, float]]:
    """Return the force constant of the cut, and the rate of the springs where the design may choose it."""
    wanted, mechanism = spec.design, designed.mechanism
    ranges = {"mechanism.profile.force_constant": range_about(mechanism.profile.force_constant)}
    rate = mechanism.springs.stiffness
    if wanted is not None and wanted.choose == "stiffness" and isinstance(rate, float):
        ranges["mechanism.springs.stiffness"] = range_about(rate)
    return ranges


PLACE_KEYS = "mechanism.brace_length", "mechanism.rest_half_width", "mechanism.roller_radius"
"""Holes of the braces and the slider, and the contour: one that lies farther out by e meets a roller larger by e."""


def errors(spec: CamSpec) -> dict[str, str]:
    """Return which values err: where the process puts holes and the contour, rates of bought springs, and friction."""
    rate = spec.mechanism.springs.stiffness
    listed = [f".{number}" for number in range(len(rate))] if isinstance(rate, tuple) else [""]
    rates = {f"mechanism.springs.stiffness{item}": "rate" for item in listed}
    return dict.fromkeys(PLACE_KEYS, "position") | rates | {"mechanism.rolling_friction": "friction"}

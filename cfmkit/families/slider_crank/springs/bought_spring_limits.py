"""Limits of bought springs at the joints, whatever their rates: stand without a guide, or turn on a thick pin."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import deg, mm
from cfmkit.stock.springs.guides import guide_cure, guide_needed

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def fault_of_bought_spring(spec: SliderCrankSpec, number: int, moved: float) -> tuple[Any, ...] | None:
    """Return what is wrong with a bought spring over a motion, and settings that cure it; None if nothing is.

    Parameters
    ----------
    spec : SliderCrankSpec
        With bought springs.
    number : int
        Which of them.
    moved : float
        Size of the largest turn of its joint, of the slider its travel [rad or m].
    """
    spring, pins = spec.mechanism.springs.bought[number], spec.mechanism.pins
    coil, key = spring.coil, f"mechanism.springs.bought.{number}"
    if spring.kind == "compression":
        if spring.is_guided or not moved > spring.unguided * (1 + 1e-9):
            return None
        return (
            f"{spring.name} buckles when it is deflected by {mm(spring.unguided)} (ends {spring.seats}), and "
            f"is deflected by {mm(moved)}; {guide_needed(spring, coil, key)}",
            *guide_cure(coil, key),
        )
    if spring.kind != "torsion" or coil is None or pins is None or not np.isfinite(moved):
        return None
    inside = coil.inner_diameter_wound_up(moved)
    if inside >= pins.diameter:
        return None
    return (
        f"{spring.name} at the {spring.at.replace('_', ' ')} is {mm(coil.inner_diameter)} wide inside, "
        f"wound up by {deg(moved)} {mm(max(inside, 0.0))}: it binds on its pin of {mm(pins.diameter)}; use "
        "a wider spring, or a thinner pin ('mechanism.pins.diameter')",
    )

"""What bought springs at the joints cannot do, whatever their rates: stand without a guide, or turn on a thick pin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import deg, mm
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.stock.springs.guides import guide_cure, guide_needed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def bought_spring_faults(spec: SliderCrankSpec, turns: FloatArray) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield (name, what is wrong, settings that cure it) of springs over a motion.

    Parameters
    ----------
    spec : SliderCrankSpec
        With bought springs.
    turns : (4,) array
        Sizes of the largest turns at the joints, of the slider its travel [rad; the last m].
    """
    pins = spec.mechanism.pins
    for number, spring in enumerate(spec.mechanism.springs.bought):
        moved, key = float(turns[JOINTS.index(spring.at)]), f"mechanism.springs.bought.{number}"
        coil = spring.coil
        if spring.kind == "compression":
            if not spring.is_guided and moved > spring.unguided * (1 + 1e-9):
                yield (
                    "spring_buckles",
                    f"{spring.name} buckles when it is deflected by {mm(spring.unguided)} (ends {spring.seats}), and "
                    f"is deflected by {mm(moved)}; {guide_needed(spring, coil, key)}",
                    guide_cure(coil, key),
                )
        elif spring.kind == "torsion" and coil is not None and pins is not None and np.isfinite(moved):
            inside = coil.inner_diameter_wound_up(moved)
            if inside < pins.diameter:
                yield (
                    "spring_binds_on_pin",
                    f"{spring.name} at the {spring.at.replace('_', ' ')} is {mm(coil.inner_diameter)} wide inside, "
                    f"wound up by {deg(moved)} {mm(max(inside, 0.0))}: it binds on its pin of {mm(pins.diameter)}; use "
                    "a wider spring, or a thinner pin ('mechanism.pins.diameter')",
                    (),
                )

"""Extension springs: close-wound, with full loops at both ends, and perhaps with an initial tension.

References: those of `helical_spring_formulas`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring, inner_curvature


class ExtensionSpring(HelicalSpring):
    """Spring that is pulled."""

    kind = "extension"
    lengthening = 1.0
    has_initial_tension = True

    def free_length_for(self, _largest: Any) -> Any:
        """Return the relaxed length with both loops, which are as high as the inside of the coil [m]."""
        return self.body_length + 2.0 * (self.coil - self.wire)

    def loop_stress(self, load: float) -> float:
        """Return the largest bending stress in the full loops [Pa] under a force [N].

        The loops are as wide as the coil: [Sh, eq. 10-34] with the factor of curvature of eq. 10-35 for r1 = D/2.

        Examples
        --------
        >>> spring = ExtensionSpring(2e-3, 12e-3, 20.0)
        >>> round(spring.loop_stress(80.0) / 1e6, 1), round(spring.stress(80.0) / 1e6, 1)
        (723.2, 382.7)
        """
        curved = inner_curvature(self.index)
        return load * (curved * 16.0 * self.coil / (math.pi * self.wire**3) + 4.0 / (math.pi * self.wire**2))

    def yield_load(self) -> Any:
        """Return the force at which turns or loops yield [N]; of an array of coils, of each.

        Raises WireOutOfRange as `strength` does.

        Examples
        --------
        >>> spring = ExtensionSpring(2e-3, 12e-3, 20.0)
        >>> load, (strength, _) = spring.yield_load(), spring.strength
        >>> round(float(load)), round(float(spring.stress(load)) / strength, 3)
        (166, 0.397)
        """
        strength, shares = self.strength
        return np.minimum(super().yield_load(), shares.loops * strength / self.loop_stress(1.0))

    @property
    def usual_initial_tension(self) -> tuple[float, float]:
        """Range of initial tension that springs of this index are easily wound with [N] [Sh, eq. 10-41].

        Examples
        --------
        >>> low, high = ExtensionSpring(1e-3, 10e-3, 20.0).usual_initial_tension
        >>> round(low, 2), round(high, 2)
        (2.38, 3.97)
        """
        stress = 231e6 / math.exp(0.105 * self.index)
        spread = max(6.9e6 * (4.0 - (self.index - 3.0) / 6.5), 0.0)
        load = math.pi * self.wire**3 / (8.0 * self.coil)
        return load * max(stress - spread, 0.0), load * (stress + spread)

"""Torsion springs, which are wound up by a couple around their axis.

    k = E d^4 / (64 D n),     sigma = K_i 32 M / (pi d^3),     K_i = (4c^2-c-1)/(4c(c-1))

K_i is the factor of the inner side of a bent bar. The rate is that of beam theory, as in EN 13906-3; [Sh, eq. 10-51]
has 10.8 for 64/(2 pi) = 10.2 in the rate per turn, a spring that rubs on its pin and is 6 % softer. Wound up by the
angle theta it has the mean diameter D n/(n + theta/(2 pi)) and as much more length in turns [Sh, eq. 10-53].

Assumes: its legs do not bend, or are counted in n with (l1 + l2)/(3 pi D) [Sh, eq. 10-48]. References: those of
`helical_spring_formulas`.
"""

from __future__ import annotations

import math
from typing import Any

from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring, inner_curvature


class HelicalTorsionSpring(HelicalSpring):
    """Spring that is wound up; deflections are angles [rad], loads couples [N m]."""

    kind = "torsion"
    dimension = "angle"
    rate_key = "rate"
    largest_keys = ("max_angle", "max_torque")
    wire_stress = "bending"
    series_turns = (3, 4, 5, 6, 8, 10, 12)

    @property
    def rate(self) -> float:
        """Couple per angle [N m/rad]."""
        return self.youngs_modulus * self.wire**4 / (64.0 * self.coil * self.turns)

    def stress(self, load: float) -> float:
        """Return the largest bending stress in the turns under a couple [Pa]."""
        return inner_curvature(self.index) * 32.0 * load / (math.pi * self.wire**3)

    def room_for(self, deflection: Any) -> Any:
        """Return the length when it is wound up, close-wound as it is [m]."""
        return self.body_length + self.wire * abs(deflection) / (2.0 * math.pi)

    def inner_diameter_at(self, deflection: float) -> float:
        """Return the inner diameter when it is wound up [m].

        Examples
        --------
        >>> spring = HelicalTorsionSpring(1e-3, 10e-3, 5.0)
        >>> round(1e3 * spring.inner_diameter_at(math.pi), 4)
        8.0909
        """
        return self.coil * self.turns / (self.turns + abs(deflection) / (2.0 * math.pi)) - self.wire

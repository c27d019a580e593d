"""Values of a designed cam that may change for a yield: its force constant, its springs, its profile."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.designing.variables import around

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import CamSpec


def free(given: CamSpec, designed: CamSpec) -> dict[str, tuple[float, float]]:
    """Return the force constant of the cut, and the rate of the springs where the design may choose it.

    Parameters
    ----------
    given : CamSpec
        With the `design` block.
    designed : CamSpec
        What came out.
    """
    wanted, mechanism = given.design, designed.mechanism
    if wanted is None:
        return {}
    found = {}
    found["mechanism.profile.force_constant"] = around(mechanism.profile.force_constant)
    rate = mechanism.springs.stiffness
    if wanted.choose == "stiffness" and isinstance(rate, float):
        found["mechanism.springs.stiffness"] = around(rate)
    return found

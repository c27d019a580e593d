"""Which values of a designed cam may move for a yield: its force constant, its springs, what it is cut for."""

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
    profile, springs = mechanism.profile, mechanism.springs
    if isinstance(getattr(profile, "force_constant", None), float):
        found["mechanism.profile.force_constant"] = around(profile.force_constant)
    if wanted.choose == "stiffness" and isinstance(getattr(springs, "stiffness", None), float):
        found["mechanism.springs.stiffness"] = around(springs.stiffness)
    return found

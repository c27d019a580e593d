"""A cam mechanism put together: its parts, and the force that its profile is cut for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import Track
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.cam.statics import Loads
    from cfmkit.results import Finding

TRAVEL_RTOL = 1e-6
"""A travel that is short by so little is not short: on a nearly vertical path rounding in x alone costs 1e-8."""


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together; several of one kind have columns (m, 1) for numbers that differ."""

    spec: CamSpec  # with every derived value written out
    profile: CamProfile  # the cam as cut
    track: Track  # where the roller runs
    loads: Loads  # springs and weights
    # travel that the cut profile offers with its own brace [m]; short of the specified stroke where the geometry ends
    # first
    stroke: float
    shortfall: Finding | None = None  # why `stroke` is short, if it is


def constant_force(assembly: Assembly) -> float:
    """Return the force that the profile is cut for, with the springs and weights built in [N]."""
    law, loads = assembly.profile.path.law, assembly.loads
    return 4.0 * loads.stiffness * law.force_constant + loads.slider_weight


def target_force(spec: CamSpec, assembly: Assembly) -> float | None:
    """Return the constant force that is wanted or that the profile is cut for [N]; None if it follows a curve."""
    if spec.target_curve is not None or assembly.spec.mechanism.profile.curve is not None:
        return None
    return spec.design.force if spec.design else constant_force(assembly)

"""What is known of a cam mechanism that went through a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.build import Build
    from cfmkit.families.cam.dynamics.history import History
    from cfmkit.families.cam.spec import CamSpec


@dataclass(frozen=True)
class Moved:
    """A mechanism that went through a motion, as checks, values and pictures need it.

    Attributes
    ----------
    spec : CamSpec
        Resolved.
    build : Build
        The parts.
    history : History
        Forces and speeds over time.
    static : (n,) array
        Force on the slider at rest in the same places [N].
    displacement : (n,) array
        Of the slider, from the origin that the analysis asks for [m].
    """

    spec: CamSpec
    build: Build
    history: History
    static: FloatArray
    displacement: FloatArray

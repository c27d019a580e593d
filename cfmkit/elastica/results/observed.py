"""Protocol of what a family observes of a path: motion, effort and stresses at its points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray


class Observed(Protocol):
    """Values that a family observes along a path."""

    @property
    def motion(self) -> FloatArray:
        """Motion at every point [m or rad]."""

    @property
    def effort(self) -> FloatArray:
        """Force or torque at every point; NaN where the tolerance is not reached."""

    @property
    def stress(self) -> FloatArray:
        """The largest stress at every point [Pa]; NaN where the tolerance is not reached."""

    @property
    def stresses(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Of each beam, the largest stress [Pa] and its place."""

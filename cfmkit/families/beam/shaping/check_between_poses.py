"""A design at many more poses than the search looks at: what its force and stress are between those poses.

The search sees the force at a few poses of the window, and the polynomial through them. Where the force bends more
sharply than that polynomial can, it leaves the band between two poses; here it is seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import Control, Displacement, PathStatus, trace
from cfmkit.errors import CfmError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.task import Task

POSES = 241
"""From rest to the end of the window: of a travel of 13.6 mm one every 0.06 mm."""

_BETWEEN = 8  # places of the interpolated force from pose to pose
_CONTROL = Control(tolerance=1e-7, branch="stop")


@dataclass(frozen=True)
class CloseView:
    """Force of the mechanism [N] and largest stress [Pa] at even poses from rest to the end of the window [m]."""

    at: FloatArray
    force: FloatArray
    stress: FloatArray

    @cached_property
    def _between(self) -> tuple[FloatArray, FloatArray]:
        """Displacements and forces between the poses, too."""
        from scipy.interpolate import CubicSpline

        fine = np.linspace(self.at[0], self.at[-1], _BETWEEN * (len(self.at) - 1) + 1)
        return fine, CubicSpline(self.at, self.force)(fine)

    @cached_property
    def bands(self) -> FloatArray:
        """Half band of the force from each place to the end [1]; infinite where it is not positive."""
        force = self._between[1][::-1]
        top, bottom = np.maximum.accumulate(force), np.minimum.accumulate(force)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(bottom > 0, (top - bottom) / (top + bottom), np.inf)[::-1]

    def half_band(self, start: float) -> float:
        """Return (max - min)/(max + min) of the force from `start` [m] to the end."""
        return float(np.interp(start, self._between[0], self.bands))

    def widest(self, half_band: float) -> float:
        """Return where the widest window begins that ends with the last pose and keeps a half band [m]."""
        kept = np.flatnonzero(self.bands > half_band)
        return float(self._between[0][min(kept[-1] + 1, len(self.bands) - 1) if len(kept) else 0])


def looked_at(task: Task, network: Network) -> CloseView | None:
    """Return a network at many poses; None where it does not reach the end, or loses stability on the way."""
    at = np.linspace(0.0, task.window[1], POSES)
    try:
        path = trace(network, Displacement(task.driven, task.direction, at), _CONTROL)
    except CfmError:
        return None
    if path.status is not PathStatus.COMPLETE:
        return None
    keep = path.at_requested
    stress = path.peak_stress(axial=task.total_stress).value[keep]
    return CloseView(at, path.effort[keep] * task.copies, stress)

"""Corners of a traced path: at a bifurcation it changes to another branch, and its curves have a kink.

Nothing may be interpolated across one. On the branch that parts from a path the change of shape grows with the root of
the drive from there on: in that root it is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Corner:
    """A bifurcation between two points of a path."""

    drive: float  # where, dimensionless
    y: FloatArray  # (unknowns,) the equilibrium there
    # below, above: whether a branch that parts from the other one is at smaller, and at larger values of the drive
    below: bool
    above: bool


@dataclass(frozen=True, eq=False)
class SmoothStretch:
    """A path between two corners, or up to an end of the path: None."""

    low: Corner | None
    high: Corner | None

    @property
    def _roots(self) -> tuple[float | None, float | None]:
        """The ends [dimensionless] from which the change of shape grows with a root."""
        opens = self.low.drive if self.low is not None and self.low.above else None
        return opens, self.high.drive if self.high is not None and self.high.below else None

    def smooth(self, drive: FloatArray) -> FloatArray:
        """Return the variable in which the path is smooth, increasing with the drive: the drive where no root is."""
        low, high = self._roots
        if low is not None and high is not None:
            return np.asarray(np.arccos(1.0 - 2.0 * np.clip((drive - low) / (high - low), 0.0, 1.0)))
        if low is not None:
            return np.sqrt(np.maximum(drive - low, 0.0))
        if high is not None:
            return np.asarray(-np.sqrt(np.maximum(high - drive, 0.0)))
        return drive

    def drive(self, smooth: FloatArray) -> FloatArray:
        """Return the drive where the smooth variable has some values."""
        low, high = self._roots
        if low is not None and high is not None:
            return np.asarray(low + 0.5 * (high - low) * (1.0 - np.cos(smooth)))
        if low is not None:
            return np.asarray(low + smooth**2)
        if high is not None:
            return np.asarray(high - smooth**2)
        return smooth

    def with_ends(
        self, drive: FloatArray, values: FloatArray, at_low: FloatArray | None, at_high: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Return points on the stretch and values there, (n, k), with those at the corners, which may be points.

        Where the path ends at a corner there may be no point besides it: `drive` is then empty.
        """
        if self.low is not None and at_low is not None and self.low.drive not in drive[:1]:
            drive, values = np.append(self.low.drive, drive), np.vstack([at_low, values])
        if self.high is not None and at_high is not None and self.high.drive not in drive[-1:]:
            drive, values = np.append(drive, self.high.drive), np.vstack([values, at_high])
        return drive, values

"""Flanks of a cam as smooth curves: designed ones, exactly, and built ones, by how far they are off the design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.rigid_point_registration import CurveFrame

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.numerics.smoothing_spline import SmoothedFunction


@dataclass(frozen=True)
class DesignFlank:
    """One flank of a designed cam, over the path coordinate."""

    profile: CamProfile  # the cam as designed
    side: float  # 1 for the right flank, -1 for the left

    @property
    def ends(self) -> tuple[float, float]:
        """First and last path coordinate of the flank [m]."""
        return self.profile.start, self.profile.end

    def frame(self, parameter: FloatArray) -> CurveFrame:
        """Return the flank at path coordinates: the path's parallel at one roller radius."""
        law, radius = self.profile.path.law, self.profile.roller_radius
        slope, bend = law.slope(parameter), law.curvature_radius(parameter)
        length = np.hypot(1.0, slope)
        x, y = self.profile.flank(parameter)
        return CurveFrame(
            np.column_stack([self.side * x, y]),
            np.column_stack([self.side / length, slope / length]),
            np.column_stack([self.side * slope / length, -1.0 / length]),
            length * (1.0 - radius / bend),
            1.0 / (bend - radius),
        )


@dataclass(frozen=True)
class BuiltFlank:
    """A flank as it was measured: the design, moved along its normal by a smooth error.

    Mirrored to the right where it is the left one, so that both are treated alike.
    """

    design: DesignFlank  # the right flank of the design
    error: SmoothedFunction  # distance from it over the arc length [m], positive outside
    arc: tuple[FloatArray, FloatArray]  # ((m,), (m,): path coordinate and arc length of the design, both increasing [m]

    @property
    def ends(self) -> tuple[float, float]:
        """First and last arc length that was measured [m]."""
        return self.error.ends

    def frame(self, parameter: FloatArray) -> CurveFrame:
        """Return the built flank at arc lengths of the design."""
        base = self.design.frame(np.interp(parameter, self.arc[1], self.arc[0]))
        error, slope, bend = (self.error.evaluate(parameter, order) for order in range(3))
        along, length = 1.0 + base.curvature * error, np.hypot(1.0 + base.curvature * error, slope)
        tangents = (along[:, None] * base.tangents + slope[:, None] * base.normals) / length[:, None]
        # The change of the design's curvature along the flank is small beside the error's own bend.
        curvature = base.curvature / along - bend
        return CurveFrame(
            base.points + error[:, None] * base.normals,
            tangents,
            np.column_stack([tangents[:, 1], -tangents[:, 0]]),
            length,
            curvature,
        )


def arc_lengths(flank: DesignFlank, count: int = 20_001) -> tuple[FloatArray, FloatArray]:
    """Return path coordinates and arc lengths of a designed flank, by trapezoids of its speed [m]."""
    parameter = np.linspace(*flank.ends, count)
    speed = flank.frame(parameter).speed
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(parameter)
    return parameter, np.concatenate([[0.0], np.cumsum(steps)])

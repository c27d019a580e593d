"""The cam as it is cut: the roller path shifted by the roller radius, where that fails, and its flanks as curves.

The cam's flank is the roller-centre path shifted by the roller radius along the normal. Where the path is curved more
tightly than the roller the shifted curve turns back on itself: material that another position of the roller needs is
gone, the cam ends in a corner, and the roller pivots on that corner instead of following the path (undercut). The
published design does so at its start.

The path begins at x0, so the shifted curve does not cross itself there: the corner is the point of it that is one
roller radius from the path's first point. Elsewhere there is no undercut: where the slider rises, paths are curved most
at their start (`SlopeLaw.curvature_radius`), for rollers smaller than the brace. Paths that weights help or whose force
follows a curve may be curved more elsewhere: `mechanism_from_spec.cut_profile` refuses these.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.families.rows import root_between
from cfmkit.numerics.rigid_point_registration import CurveFrame

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.path import RollerPath
    from cfmkit.families.cam.geometry.slope_law import Real
    from cfmkit.numerics.smoothing_spline import SmoothedFunction


@dataclass(frozen=True)
class CamCorner:
    """The corner at which an undercut cam begins."""

    point: tuple[float, float]  # where it is [m], right flank
    first_contact: float  # path coordinate x at which the roller leaves the corner for the flank [m]
    cusp: float  # path coordinate x at which the path's radius of curvature equals the roller's [m]


@dataclass(frozen=True)
class CamProfile:
    """A flank cut for one roller radius along one path, up to path coordinate `end` [m]."""

    path: RollerPath
    roller_radius: float
    end: float
    corner: CamCorner | None = None

    def normal(self, x: Real) -> tuple[Real, Real]:
        """Return the unit normal from cam to roller on the right flank, (f, -1)/sqrt(1 + f^2)."""
        f = self.path.law.slope(x)
        length = (1.0 + f * f) ** 0.5
        return f / length, -1.0 / length

    def offset_points(self, x: Real, offset: float) -> tuple[Real, Real]:
        """Return the points at a distance `offset` [m] from the path along the normal, towards the roller."""
        nx, ny = self.normal(x)
        return x + offset * nx, self.path.height(x) + offset * ny

    def parallel(self, u: Any, distance: float) -> ParallelPoints:
        """Return the line at a distance [m] from the path, towards the roller, with its slope and curvature."""
        slope, bend = self.path.law.slopes(u)
        square = 1.0 + slope * slope
        length = square**0.5
        curvature = bend / (square * length)
        x, y = u + distance * slope / length, self.path.height(u) - distance / length
        return ParallelPoints(x, y, slope, length, 1.0 + distance * curvature, curvature)

    def flank(self, x: Real) -> tuple[Real, Real]:
        """Return the flank's points for path coordinates x; part of the cam only from `start` on."""
        return self.offset_points(x, -self.roller_radius)

    @property
    def start(self) -> float:
        """Path coordinate of the first point of the flank that is part of the cam [m]."""
        return self.corner.first_contact if self.corner else self.path.law.rest_half_width


class ParallelPoints(NamedTuple):
    """Points of the line at a distance from a roller path, for path coordinates."""

    # x, y [m]
    x: Any
    y: Any
    slope: Any  # dy/dx, of the path and of the line
    length: Any  # sqrt(1 + slope^2)
    stretch: Any  # length of the line over that of the path
    curvature: Any  # of the path [1/m]


class WholeCamUndercut(ValueError):
    """The roller is so large that no part of the flank is left."""


def cut_cam(path: RollerPath, roller_radius: float, end: float) -> CamProfile:
    """Return the cam that a roller path gives up to path coordinate `end`, trimmed where the roller undercuts it [m].

    Raises WholeCamUndercut if every point of the flank would be cut away.
    """
    profile = CamProfile(path, roller_radius, end)
    law, x0 = path.law, path.law.rest_half_width
    if not law.undercuts(roller_radius):
        return profile
    if law.constant:
        cusp = _find_root(lambda x: law.curvature_radius(x) - roller_radius, x0, end)
    else:  # a path that may become hollow has a curvature through zero
        cusp = _find_root(lambda x: 1.0 / roller_radius - 1.0 / law.curvature_radius(x), x0, end)

    def clear_of_start(x: float) -> float:
        cx, cy = profile.flank(x)
        return np.hypot(cx - x0, cy) - roller_radius

    contact = _find_root(clear_of_start, cusp, end)
    cx, cy = profile.flank(contact)
    return CamProfile(path, roller_radius, end, CamCorner((cx, cy), contact, cusp))


def _find_root(function: Callable[[Any], Any], low: Any, high: Any) -> Any:
    try:
        return root_between(function, low, high)
    except ValueError:
        raise WholeCamUndercut from None


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
        at = self.profile.parallel(parameter, -self.profile.roller_radius)
        return CurveFrame(
            np.column_stack([self.side * at.x, at.y]),
            np.column_stack([self.side / at.length, at.slope / at.length]),
            np.column_stack([self.side * at.slope / at.length, -1.0 / at.length]),
            at.length * at.stretch,
            at.curvature / at.stretch,
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


def arc_lengths(flank: DesignFlank) -> tuple[FloatArray, FloatArray]:
    """Return path coordinates and arc lengths of a designed flank, by trapezoids of its speed [m]."""
    parameter = np.linspace(*flank.ends, 20_001)
    speed = flank.frame(parameter).speed
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(parameter)
    return parameter, np.concatenate([[0.0], np.cumsum(steps)])

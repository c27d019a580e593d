"""Solution of a mechanism with a measured cam: both sides, and the parts of the force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.statics import levers, load_on_contact, load_on_slider

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.assembly import Assembly
    from cfmkit.families.cam.statics import Loads
    from cfmkit.numerics.rigid_point_registration import Registration


@dataclass(frozen=True)
class Sides:
    """Right and left roller at some slider positions: x [m] and slope of the track, each (n,)."""

    x: tuple[FloatArray, FloatArray]
    slope: tuple[FloatArray, FloatArray]

    def spring(self, loads: Loads, rest: float) -> FloatArray:
        """Return the spring force on each roller [N]; springs do not push."""
        return loads.stiffness * np.maximum(self.x[0] + self.x[1] - 2.0 * rest, 0.0)

    def forces(
        self,
        loads: Loads,  # springs and weights
        friction: float,  # positive on the way up, negative on the way down
        rest: float,  # half width at which the springs are at rest [m]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at the right and left contact [N]; NaN where nothing moves a side."""
        pull, contacts = np.full_like(self.x[0], loads.slider_weight), []
        spring, weight = self.spring(loads, rest), loads.roller_weight
        for x, slope in zip(self.x, self.slope, strict=True):
            tangent = brace_tangent(x, loads.brace_length)
            turn, lever = levers(slope, tangent, friction)
            lever = np.where(lever > 0, lever, np.nan)
            pull = pull + load_on_slider(turn, slope, friction, spring, weight) / lever
            contacts.append(load_on_contact(slope, tangent, spring, weight) / lever)
        return pull, contacts[0], contacts[1]


@dataclass(frozen=True, repr=False)
class MeasuredCam(ShortRepr):
    """Solution of a mechanism whose cam profile was measured after manufacture."""

    assembly: Assembly  # the design and the loads
    registration: Registration  # of the right and the left flank
    across: tuple[FloatArray, FloatArray]  # errors in x at the same y, positive outside [m]
    travel: FloatArray  # (n,) from the start of the design's roller path [m]
    sides: Sides  # where the rollers are
    # parts of the force [N]: design, rest, profile, friction_up, friction_down, each (n,)
    shares: dict[str, FloatArray]
    origin: float  # what is added to the travel to give the displacement [m]
    # travels between which a contact is where nothing was measured, of either flank [m]
    holes: tuple[tuple[float, float], ...] = ()

    @property
    def unmeasured(self) -> tuple[tuple[float, float], ...]:
        """Travels between which the force is not known, in their order, those that overlap joined [m]."""
        joined: list[tuple[float, float]] = []
        for low, high in sorted(self.holes):
            low, high = max(low, float(self.travel[0])), min(high, float(self.travel[-1]))
            if joined and low <= joined[-1][1]:
                joined[-1] = joined[-1][0], max(joined[-1][1], high)
            elif low < high:
                joined.append((low, high))
        return tuple(joined)

    @property
    def elongation(self) -> FloatArray:
        """Elongation of the springs, (n,) [m]."""
        opened = self.assembly.spec.mechanism.springs.tension_stretch
        return self.sides.x[0] + self.sides.x[1] - 2.0 * self.assembly.loads.rest_half_width - opened

    def forces(self, way: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at both contacts on the way up (1) or down (-1), each (n,) [N]."""
        loads, friction = self.assembly.loads, self.assembly.spec.mechanism.rolling_friction
        return self.sides.forces(loads, way * friction, loads.rest_half_width)

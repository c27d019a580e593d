"""Solution of a mechanism with a measured cam: both sides, parts of the force, how much of a window was measured.

`MeasuredCam` is the solved cam as built, with its measured flanks. It is computed over travels that count from its own
start; `MeasuredCam.origin` added to one gives the displacement of the specification. Where a flank was not measured the
force is not known (`MeasuredCam.unmeasured`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.contact_pressure import flank_pressure
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.statics import levers, load_on_contact, load_on_slider
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.statics import Assembly, Loads
    from cfmkit.numerics.rigid_point_registration import Registration


@dataclass(frozen=True)
class Sides:
    """Right and left roller at some slider positions: x [m] and slope of the track, each (n,)."""

    x: tuple[FloatArray, FloatArray]
    slope: tuple[FloatArray, FloatArray]

    def spring(self, loads: Loads, rest: float) -> FloatArray:
        """Return the spring force on each roller [N]; springs do not push."""
        return loads.stiffness * np.maximum(self.x[0] + self.x[1] - 2.0 * rest, 0.0)

    def forces(self, loads: Loads, friction: float, rest: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at the right and left contact [N]; NaN where nothing moves a side.

        Friction is negative on the way down; the springs are at rest at a half width [m].
        """
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
    def measured(self) -> tuple[tuple[float, float], ...]:
        """Travels between which both contacts are on measured points [m]."""
        ends = [float(self.travel[0]), *(place for hole in self.unmeasured for place in hole), float(self.travel[-1])]
        return tuple((low, high) for low, high in zip(ends[::2], ends[1::2], strict=True) if low < high)

    @property
    def elongation(self) -> FloatArray:
        """Elongation of the springs, (n,) [m]."""
        opened = self.assembly.spec.mechanism.springs.tension_stretch
        return self.sides.x[0] + self.sides.x[1] - 2.0 * self.assembly.loads.rest_half_width - opened

    def forces(self, direction: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at both contacts on the way up (1) or down (-1), each (n,) [N]."""
        loads, friction = self.assembly.loads, self.assembly.spec.mechanism.rolling_friction
        return self.sides.forces(loads, direction * friction, loads.rest_half_width)

    @property
    def requested(self) -> tuple[float, float]:
        """Displacements at which the motion starts, and at which it was to end [m]."""
        start, end = float(self.travel[0]), self.assembly.spec.analysis.travel or float(self.travel[-1])
        return start + self.origin, end + self.origin

    @property
    def window(self) -> tuple[float, float]:
        """Displacements at which the window begins and ends, by default those of the whole travel [m]."""
        stated = self.assembly.spec.analysis.window
        if stated is not None:
            return window_places(stated, self.requested)
        return float(self.travel[0] + self.origin), float(self.travel[-1] + self.origin)

    @property
    def in_window(self) -> NDArray[np.bool_]:
        """Which travels lie in the window, (n,); all if it holds fewer than 3."""
        (low, high), places = self.window, self.travel + self.origin
        inside: NDArray[np.bool_] = (places >= low) & (places <= high)
        return inside if inside.sum() > 2 else np.ones(len(places), dtype=bool)

    @property
    def hole_shares(self) -> list[float]:
        """Widths of the intervals in the window that were not measured, over that of the window."""
        low, high = self.window
        ends = ((start + self.origin, stop + self.origin) for start, stop in self.unmeasured)
        return [max(min(stop, high) - max(start, low), 0.0) / (high - low) for start, stop in ends]

    @property
    def has_large_hole(self) -> bool:
        """Whether so much of the window was not measured that what holds over all of it is not known."""
        return any(share > MAX_HOLE_SHARE for share in self.hole_shares)

    @property
    def half_extent(self) -> float:
        """Half the height of the measured part [m]: where an angle is felt."""
        return 0.5 * float(np.ptp(np.concatenate([points[:, 1] for points in self.registration.points])))

    def used(self, values: Iterable[FloatArray]) -> FloatArray:
        """Return values of the points of both flanks that count."""
        return np.concatenate([item[keep] for item, keep in zip(values, self.registration.used, strict=True)])

    @cached_property
    def errors(self) -> FloatArray:
        """Errors of the points that count, of both flanks [m]."""
        return self.used(self.registration.errors)

    def pressure(self, direction: float) -> FloatArray:
        """Return the larger pressure of both contacts on the way up (1) or down (-1), the flank as designed [Pa]."""
        track, forces = self.assembly.track, self.forces(direction)
        states = track.states(track.start + self.travel)
        return flank_pressure(self.assembly, states, np.maximum(forces[1], forces[2]))


def root_mean_square(*parts: FloatArray) -> float:
    """Return the root mean square of all values of some arrays."""
    return float(np.sqrt(np.mean(np.square(np.concatenate(parts)))))

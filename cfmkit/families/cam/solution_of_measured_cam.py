"""Solution of a mechanism with a measured cam: both sides, parts of the force, how much of a window was measured.

`MeasuredCam` is the solved cam as built, with its measured flanks. It is computed over travels that count from its own
start; `MeasuredCam.origin` added to one gives the displacement of the specification. Where a flank was not measured the
force is not known (`MeasuredCam.unmeasured`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.statics import levers, load_on_contact, load_on_slider
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
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

    def forces(self, direction: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at both contacts on the way up (1) or down (-1), each (n,) [N]."""
        loads, friction = self.assembly.loads, self.assembly.spec.mechanism.rolling_friction
        return self.sides.forces(loads, direction * friction, loads.rest_half_width)


def travel_window(built: MeasuredCam) -> tuple[float, float]:
    """Return the travels at which the window begins and ends, by default the whole travel [m]."""
    window = built.assembly.spec.analysis.window
    if window is None:
        return float(built.travel[0]), float(built.travel[-1])
    low, high = window_places(window, requested_travel(built))
    return low - built.origin, high - built.origin


def large_holes(built: MeasuredCam) -> tuple[tuple[float, float], ...]:
    """Return the intervals of travel in the window that were not measured, unless they are very small [m]."""
    start, stop = travel_window(built)
    inside = ((max(low, start), min(high, stop)) for low, high in built.unmeasured)
    return tuple((low, high) for low, high in inside if high - low > MAX_HOLE_SHARE * (stop - start))


def profile_coverage(built: MeasuredCam) -> float:
    """Return the share of the window that was measured, 0 to 1."""
    start, stop = travel_window(built)
    missing = sum(max(min(high, stop) - max(low, start), 0.0) for low, high in built.unmeasured)
    return 1.0 - missing / (stop - start)


def window_mask(built: MeasuredCam) -> NDArray[np.bool_]:
    """Return which travels lie in ``analysis.window``, (n,); all if there is no window, or if it holds fewer than 3."""
    place, window = built.travel + built.origin, built.assembly.spec.analysis.window
    if window is None:
        return np.ones(len(place), dtype=bool)
    low, high = window_places(window, requested_travel(built))
    inside: NDArray[np.bool_] = (place >= low) & (place <= high)
    return inside if inside.sum() > 2 else np.ones(len(place), dtype=bool)


def requested_travel(built: MeasuredCam) -> tuple[float, float]:
    """Return where the displacement starts and where it was to end [m]."""
    start, end = float(built.travel[0]), built.assembly.spec.analysis.travel or float(built.travel[-1])
    return start + built.origin, end + built.origin

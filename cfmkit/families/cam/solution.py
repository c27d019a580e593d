"""What is known of a cam mechanism that was put together and solved.

Values are computed when they are first read; figures, findings and results import these types.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.statics import Forces, Loads, jams, levers, load_on_contact, load_on_slider
from cfmkit.results import round_off

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import Track, TrackStates
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.numerics.rigid_point_registration import Registration
    from cfmkit.results import Finding


FEW = 100
"""Of fewer samples than these all are looked at for jams; of more, only places between which a jam may begin."""

ON_CORNER = np.linspace(0.0, 1.0, 34)[1:]
"""Shares of the travel on a corner next to which an extreme of the force is looked for: its end is a kink."""


def pressure_angle(states: TrackStates, brace_length: float) -> FloatArray:
    """Return the angle between a brace's pull and its roller's motion [rad]; at 90 deg the slider moves nothing."""
    slope, tangent = states.slope, brace_tangent(states.x, brace_length)
    angle: FloatArray = np.arctan2(1.0 + slope * tangent, slope - tangent)
    return angle


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together."""

    spec: CamSpec  # with every derived value written out
    profile: CamProfile  # the cam as cut
    track: Track  # where the roller runs
    loads: Loads  # springs and weights
    # travel that the cut profile offers with its own brace [m]; short of the specified stroke where the geometry ends
    # first
    stroke: float
    shortfall: Finding | None = None  # why `stroke` is short, if it is


@dataclass(frozen=True)
class ForceBand:
    """Forces of all drawn cams over the travel."""

    travel: FloatArray  # (n,) [m]
    forces: FloatArray  # (samples, n) without friction [N]
    design: FloatArray  # (n,) force of the design [N]

    def quantile(self, share: float) -> FloatArray:
        """Return the force that a share of the cams stays below at each travel [N]; NaN where not all have a flank."""
        found, all_there = np.full(len(self.travel), np.nan), np.isfinite(self.forces).all(axis=0)
        found[all_there] = np.quantile(self.forces[:, all_there], share, axis=0)
        return found

    def deviations(self) -> FloatArray:
        """Return every cam's standard deviation of the error along the travel, over the mean force [SS, fig. 13]."""
        errors = self.forces - self.design
        found: FloatArray = np.nanstd(errors, axis=1, ddof=1) / float(np.nanmean(self.design))
        return found


@dataclass(frozen=True, repr=False)
class Solution(ShortRepr):
    """A solved mechanism, as the checks, the scalar values and the pictures need it."""

    assembly: Assembly  # the parts
    travel: FloatArray  # (n,) slider travel from the start of the roller path, increasing [m]
    states: TrackStates  # where the rollers are at those travels
    # up, down: on the way up and on the way down, both ordered by increasing travel
    up: Forces
    down: Forces
    origin: float  # what is added to the travel to give the displacement [m]
    band: ForceBand | None = None  # forces of cams that are cut with errors

    @cached_property
    def pressure_angle(self) -> FloatArray:
        """Angle between the brace's pull and the roller's motion [rad]; at 90 deg the slider moves nothing."""
        return pressure_angle(self.states, self.assembly.track.brace_length)

    @cached_property
    def elongation(self) -> FloatArray:
        """Elongation of the springs [m]."""
        opened = self.assembly.spec.mechanism.springs.tension_stretch
        return 2.0 * (self.states.x - self.assembly.loads.rest_half_width) - opened

    @property
    def effort_error(self) -> float:
        """Rounding of the sum of springs and weights on the slider [N]."""
        weight = self.assembly.loads.slider_weight
        both = np.concatenate([self.up.slider, self.down.slider])
        return round_off(np.stack([both - weight, np.full(len(both), weight)]))

    @property
    def corner_travel(self) -> float:
        """Travel at which the roller leaves the corner [m]; 0 if there is none."""
        track = self.assembly.track
        corner = max(track.corner_end - track.start, 0.0)
        return corner if corner > float(self.travel[0]) else 0.0

    @cached_property
    def jams(self) -> tuple[tuple[float, float], ...]:
        """Intervals of travel in which no force moves the slider up [m]."""
        track, friction = self.assembly.track, self.assembly.spec.mechanism.rolling_friction
        losses = self.assembly.loads.losses
        if not friction and losses is None:
            return ()
        total = float(self.travel[-1])
        missing = bool(np.isnan(self.up.slider).any())
        states = self.states if missing or len(self.travel) < FEW else None
        found = ((low - track.start, high - track.start) for low, high in jams(track, friction, states, losses))
        return tuple((max(low, 0.0), min(high, total)) for low, high in found if low < total)


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

        Parameters
        ----------
        loads : Loads
            Springs and weights.
        friction : float
            Positive on the way up, negative on the way down.
        rest : float
            Half width at which the springs are at rest [m].
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
class Built(ShortRepr):
    """A solved mechanism with a measured cam."""

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

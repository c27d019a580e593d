"""Contacts of rollers on the flank of the cam, and the largest values next to samples, of one mechanism or of many."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.contact_pressure import flank_pressure
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.statics import Forces
from cfmkit.metrics.continuous_means_and_extremes import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution import Solution


def pressure_angle(states: TrackStates, brace_length: Any) -> FloatArray:
    """Return the angle between a brace's pull and its roller's motion [rad]; at 90 deg the slider moves nothing."""
    slope, tangent = states.slope, brace_tangent(states.x, brace_length)
    angle: FloatArray = np.arctan2(1.0 + slope * tangent, slope - tangent)
    return angle


@dataclass(frozen=True, eq=False)
class FlankSamples:
    """Contacts on the flank: the samples there, and before them the place at which the roller leaves the corner."""

    solution: Solution  # the mechanisms
    travel: FloatArray  # (..., n) increasing [m]
    there: NDArray[np.bool_]  # (..., n) which of the places are on the flank
    states: TrackStates  # where the rollers are, (..., n)
    # up, down: on the way up and on the way down, (..., n) each
    up: Forces
    down: Forces

    @classmethod
    def of(cls, solution: Solution) -> FlankSamples:
        """Return those of solved mechanisms."""
        corner, travel, states = np.atleast_1d(solution.corner_travel), solution.travel, solution.states
        leaves = (corner > 0) & (corner <= travel[..., -1:])
        there = ~states.on_corner & (~leaves | (travel > corner))
        if not leaves.any():
            return cls(solution, travel, there, states, solution.up, solution.down)
        (first, up), (_, down) = (solution.at_travel(corner, way, flank=True) for way in (1.0, -1.0))
        return cls(
            solution,
            _behind(corner, travel),
            _behind(leaves, there),
            TrackStates(*map(_behind, first.fields(), states.fields())),
            _forces_behind(up, solution.up),
            _forces_behind(down, solution.down),
        )

    @property
    def pressure_angle(self) -> FloatArray:
        """Angle between the brace's pull and the roller's motion [rad]; NaN elsewhere."""
        angle = pressure_angle(self.states, self.solution.assembly.track.brace_length)
        return np.where(self.there, angle, np.nan)

    def pressure(self, travel: FloatArray) -> FloatArray:
        """Return the pressure of the contact on the way up at travels [Pa]; NaN where there is none."""
        states, found = self.solution.at_travel(travel, 1.0, flank=True)
        return flank_pressure(self.solution.assembly, states, found.contact)

    @cached_property
    def largest_pressure(self) -> tuple[FloatArray, FloatArray]:
        """Largest pressure of the contact on the way up [Pa], NaN without one, and about where it is [m], (m, 1)."""
        pressed = flank_pressure(self.solution.assembly, self.states, self.up.contact)
        return extreme_next_to(self.pressure, self.travel, np.where(self.there, pressed, np.nan), len(self.solution))

    @property
    def half_gap(self) -> FloatArray:
        """Largest (up - down)/(up + down), (..., 1)."""
        up, down = self.up.slider, self.down.slider
        usable = self.there & np.isfinite(up) & np.isfinite(down) & (up + down > self.solution.effort_error)
        return largest_of_each(np.where(usable, (up - down) / np.where(usable, up + down, 1.0), np.nan))


def _forces_behind(first: Forces, rest: Forces) -> Forces:
    def inside() -> tuple[FloatArray, FloatArray]:
        return _behind(first.contact, rest.contact), _behind(first.brace, rest.brace)

    return Forces(_behind(first.slider, rest.slider), inside)


def _behind(first: Any, rest: Any) -> Any:
    """Return (..., 1) and (..., n) as (..., n + 1)."""
    shape = np.broadcast_shapes(np.shape(first)[:-1], rest.shape[:-1])
    return np.concatenate([np.broadcast_to(one, (*shape, one.shape[-1])) for one in (first, rest)], axis=-1)


def extreme_next_to(
    function: Callable[[FloatArray], FloatArray], travel: FloatArray, values: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return the largest value next to the samples that are finite, and the travel of the largest of these, (m, 1)."""
    travel, values = (np.broadcast_to(one, (count, values.shape[-1])) for one in (travel, values))
    known = np.isfinite(values)
    number = known.sum(axis=1)
    order = np.argsort(~known, axis=1, kind="stable")
    order = np.take_along_axis(order, np.minimum(np.arange(order.shape[1]), np.maximum(number - 1, 0)[:, None]), axis=1)
    travel, values = (np.take_along_axis(one, order, axis=1) for one in (travel, values))
    top, _ = extremes(function, travel, values, uneven=True, last=np.maximum(number - 1, 0))
    highest = np.argmax(np.where(np.isfinite(values), values, -np.inf), axis=1)[:, None]
    return np.where(number > 0, top, np.nan)[:, None], np.take_along_axis(travel, highest, axis=1)


def _largest(values: FloatArray) -> FloatArray:
    most = np.fmax.reduce(values, axis=-1, keepdims=True, initial=-np.inf)
    if np.isposinf(most).any():
        most = np.where(np.isfinite(values), values, -np.inf).max(axis=-1, keepdims=True, initial=-np.inf)
    return np.asarray(most)


def largest_of_each(*arrays: FloatArray) -> FloatArray:
    """Return the largest finite value of each row of all arrays, (..., 1); NaN where there is none."""
    found = reduce(np.maximum, map(_largest, arrays))
    return np.where(np.isfinite(found), found, np.nan)

"""Solution of one cam mechanism, or of several as rows: travel, rollers, forces both ways, and results read from them.

Values are computed when they are first read; figures, findings and results import these types.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import Several, ShortRepr
from cfmkit.families.cam.contact_pressure import allowable_stress, flank_pressure, stress
from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
from cfmkit.families.cam.geometry.path import RollerPath
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackRows, TrackStates
from cfmkit.families.cam.statics import TRAVEL_RTOL, Forces, forces, jams, target_force
from cfmkit.families.largest_next_to_samples import extreme_next_to, largest_of_each
from cfmkit.families.rows import PlacesKept, is_column, row_of, rows_of
from cfmkit.metrics.curve_rows import CurveRows, RowSamples, StressRows
from cfmkit.results import ROUND_OFF
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.statics import Assembly
    from cfmkit.specs.units import Ends


FEW_SAMPLES = 100
"""Of fewer samples than these all are looked at for jams; of more, only places between which a jam may begin."""
ON_CORNER = np.linspace(0.0, 1.0, 34)[1:]
"""Shares of the travel on a corner next to which an extreme of the force is looked for: its end is a kink."""


@dataclass(frozen=True)
class ForceBand:
    """Forces of all drawn cams over the travel."""

    travel: FloatArray  # (n,) [m]
    forces: FloatArray  # (samples, n) without friction [N]
    design: FloatArray  # (n,) force of the design [N]

    def quantile(self, share: float) -> FloatArray:
        """Return the force that a share of the cams stays below at each travel [N]; NaN where not all have a flank."""
        forces, all_there = np.full(len(self.travel), np.nan), np.isfinite(self.forces).all(axis=0)
        forces[all_there] = np.quantile(self.forces[:, all_there], share, axis=0)
        return forces

    def deviations(self) -> FloatArray:
        """Return every cam's standard deviation of the error along the travel, over the mean force [SS, fig. 13]."""
        errors = self.forces - self.design
        deviations: FloatArray = np.nanstd(errors, axis=1, ddof=1) / float(np.nanmean(self.design))
        return deviations


@dataclass(frozen=True, eq=False, repr=False)
class Solution(ShortRepr):
    """A solved mechanism, as the checks, the scalar values and the pictures need it; or several of one kind as rows.

    Of one mechanism arrays are (n,). Of m the numbers that differ are columns (m, 1), also those in `assembly` and its
    specification, and curves that differ are (m, n). Mechanisms around one cam with rollers and braces alike share its
    track, and where the rollers are on it.
    """

    assembly: Assembly  # the parts
    travel: FloatArray  # slider travel from the start of the roller path, increasing [m]
    states: TrackStates  # where the rollers are at those travels
    # up, down: on the way up and on the way down, both ordered by increasing travel
    up: Forces
    down: Forces
    origin: float  # what is added to the travel to give the displacement [m]
    band: ForceBand | None = None  # forces of cams that are cut with errors
    count: int = 1  # number of mechanisms
    windows: Sequence[Ends] = ()  # of each mechanism, where the specification does not state the same for all

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        return self.count

    @property
    def mechanism(self) -> Any:
        """Block `mechanism` of the specification."""
        return self.assembly.spec.mechanism

    def read_each_cam(self, read: Callable[[CamProfile], float]) -> FloatArray:
        """Return a number of each different cam, (m, 1), or (1, 1) where all are alike."""
        cam = self.assembly.profile
        if not isinstance(self.assembly.track, TrackRows):
            return np.array([[read(cam)]])
        numbers = *cam.path.law.numbers, cam.roller_radius, cam.end
        table = np.stack([self.column(number) for number in numbers], axis=1)
        _, first, which = np.unique(table, axis=0, return_index=True, return_inverse=True)
        parts = (row_of((cam.path.law, cam.roller_radius, cam.end), row) for row in first.tolist())
        values = [read(CamProfile(RollerPath(law, end), radius, end)) for law, radius, end in parts]
        return np.array(values)[which.ravel(), None]

    @cached_property
    def displacement(self) -> FloatArray:
        """Displacement of the slider, the travel from the origin that is requested [m]."""
        return np.asarray(self.travel + self.origin)

    @cached_property
    def roller_path(self) -> FloatArray:
        """Positions of the right roller's axis, of one mechanism, (n, 2) [m]."""
        return np.column_stack([self.states.x, self.states.y])

    @cached_property
    def pin_path(self) -> FloatArray:
        """Positions of the slider's pin, of one mechanism, (n, 2) [m]."""
        (x, y), length = self.roller_path.T, self.assembly.track.brace_length
        return np.column_stack([0.0 * x, y + np.sqrt((length - x) * (length + x))])

    def column(self, value: Any) -> FloatArray:
        """Return a number of each mechanism, (m,)."""
        return np.broadcast_to(np.ravel(value), self.count)

    @cached_property
    def elongation(self) -> FloatArray:
        """Elongation of the springs [m]."""
        opened: Any = self.mechanism.springs.tension_stretch
        return np.asarray(2.0 * (self.states.x - self.assembly.loads.rest_half_width) - opened)

    @property
    def _ways(self) -> tuple[Forces, ...]:
        """Up and down; one where they are alike."""
        return (self.up,) if self.up is self.down else (self.up, self.down)

    def contact_pressure(self, state: Forces) -> FloatArray:
        """Return the pressure of the line contact on the way up or down [Pa]; NaN on the corner."""
        return flank_pressure(self.assembly, self.states, state.contact)

    @cached_property
    def effort_error(self) -> Any:
        """Rounding of the sum of springs and weights on the slider [N]."""
        weight = self.assembly.loads.slider_weight
        most = largest_of_each(*(np.abs(state.slider - weight) for state in self._ways)) + np.abs(weight)
        return ROUND_OFF * (np.nan_to_num(most) if self.count > 1 else float(np.nan_to_num(most)[0]))

    @cached_property
    def corner_travel(self) -> Any:
        """Travel at which the roller leaves the corner [m]; 0 if there is none."""
        track = self.assembly.track
        corner = np.maximum(track.corner_end - track.start, 0.0)
        corner_travel = np.where(corner > self.travel[..., :1], corner, 0.0)
        return corner_travel if self.count > 1 else float(corner_travel[0])

    @cached_property
    def _flank(self) -> tuple[FlankSamples, ...]:
        """Contacts on the flank: those at the samples, and before them that with which the roller leaves the corner."""
        corner, travel, states = np.atleast_1d(self.corner_travel), self.travel, self.states
        leaves = (corner > 0) & (corner <= travel[..., -1:])
        samples = FlankSamples(travel, ~states.on_corner & (~leaves | (travel > corner)), states, self.up, self.down)
        if not leaves.any():
            return (samples,)
        (first, up), (_, down) = (self.evaluate_travel(corner, sign, flank=True) for sign in (1.0, -1.0))
        return FlankSamples(corner, leaves, first, up, down), samples

    @property
    def largest_angle_on_flank(self) -> FloatArray:
        """Largest angle between a brace's pull and its roller's motion on the flank, (..., 1) [rad]."""
        return largest_of_each(*(np.where(at.is_on_flank, at.states.pressure_angle, np.nan) for at in self._flank))

    @property
    def largest_half_gap(self) -> FloatArray:
        """Largest (up - down)/(up + down) on the flank, (..., 1)."""

        def half_gap(at: FlankSamples) -> FloatArray:
            up, down = at.up.slider, at.down.slider
            usable = at.is_on_flank & np.isfinite(up) & np.isfinite(down) & (up + down > self.effort_error)
            return np.where(usable, (up - down) / np.where(usable, up + down, 1.0), np.nan)

        return largest_of_each(*map(half_gap, self._flank))

    @property
    def largest_pressure(self) -> FloatArray:
        """Largest pressure on the flank on the way up, (m, 1) [Pa]; NaN without a contact."""
        return self._largest_pressure[0]

    @property
    def travel_of_largest_pressure(self) -> FloatArray:
        """Travel at which about it is, (m, 1) [m]."""
        return self._largest_pressure[1]

    @cached_property
    def _largest_pressure(self) -> tuple[FloatArray, FloatArray]:

        def pressure(states: TrackStates, up: Forces) -> FloatArray:
            return flank_pressure(self.assembly, states, up.contact)

        def evaluate(travel: FloatArray) -> FloatArray:
            return pressure(*self.evaluate_travel(travel, 1.0, flank=True))

        pressed = (np.where(at.is_on_flank, pressure(at.states, at.up), np.nan) for at in self._flank)
        travel, values = (reduce(_append_column, parts) for parts in ((at.travel for at in self._flank), pressed))
        return extreme_next_to(evaluate, travel, values, self.count)

    # --- at any travel ----------------------------------------------------------------------------------------------

    def evaluate_travel(
        self, travel: FloatArray, sign: float, rows: Any = None, flank: bool = False
    ) -> tuple[TrackStates, Forces]:
        """Return where the rollers are, and the forces on the way up (1) or down (-1), at travels [m].

        Of all mechanisms, or of `rows` (k,); `flank`: rounding must not take its first place to the corner.
        """
        track = self.assembly.track if rows is None else self.assembly.track.select_rows(rows)
        slider = track.start + travel
        if rows is None and not flank:
            states = self._states_at(slider)
        else:
            states = track.states(np.maximum(slider, track.corner_end) if flank else slider)
        return states, self.forces_at(states, sign, rows)

    def forces_at(self, states: TrackStates, sign: float, rows: Any = None) -> Forces:
        """Return the forces on the way up (1) or down (-1) where the rollers of all, or of some, are."""
        acting = self.assembly.loads, self.mechanism.rolling_friction
        loads, friction = acting if rows is None else rows_of(acting, rows)
        return forces(states, loads, sign * friction, sign)

    @cached_property
    def _states_at(self) -> PlacesKept[TrackStates]:
        return PlacesKept(self.assembly.track.states)

    def evaluate_places(self, places: FloatArray, sign: float, rows: Any = None) -> tuple[TrackStates, Forces]:
        """Return the same at displacements, which end with the travel [m]; what is alike for all is computed once."""
        shared = rows is None and places.ndim == 2 and not isinstance(self.assembly.track, TrackRows)
        places = places[:1] if shared and places.strides[0] == 0 else places
        origin, last = self.origin, self.travel[..., -1:]
        if rows is not None:
            origin, last = rows_of((origin, last), rows)
        return self.evaluate_travel(np.clip(places - origin, 0.0, last), sign, rows)

    # --- jams -------------------------------------------------------------------------------------------------------

    @property
    def jams(self) -> tuple[tuple[float, float], ...]:
        """Intervals of travel in which no force moves the slider of the first mechanism up [m]."""
        return self.all_jams[0]

    @cached_property
    def all_jams(self) -> list[tuple[tuple[float, float], ...]]:
        """Intervals of travel in which no force moves the slider up, of each mechanism [m]."""
        friction, losses = self.mechanism.rolling_friction, self.assembly.loads.losses
        intervals: list[tuple[tuple[float, float], ...]] = [()] * self.count
        if not np.any(friction) and losses is None:
            return intervals
        is_looked_at = np.isnan(self.up.slider).any(axis=-1) | (self.travel.shape[-1] < FEW_SAMPLES)
        is_looked_at = np.broadcast_to(is_looked_at, self.count)
        total, track = self.column(self.travel[..., -1:]), self.assembly.track
        # springs and weights do not change leverage
        are_alike = losses is None and not is_column(friction, self.travel[..., 0]) and not isinstance(track, TrackRows)
        for states, some in ((None, ~is_looked_at), (self.states, is_looked_at)):
            rows, parts = np.flatnonzero(some), (track, friction, states, losses)
            if not len(rows):
                continue
            if are_alike:
                jams_of_rows = jams(*parts) * len(rows)
            else:
                if len(rows) < self.count:
                    row_states = states and states.combine(partial(rows_of, rows=rows))
                    parts = track.select_rows(rows), rows_of(friction, rows), row_states, rows_of(losses, rows)
                jams_of_rows = jams(*parts, len(rows))
            for row, of_row, end in zip(rows.tolist(), jams_of_rows, total[rows].tolist(), strict=True):
                intervals[row] = tuple((max(low, 0.0), min(high, end)) for low, high in of_row if low < end)
        return intervals

    @property
    def jam_travel(self) -> FloatArray:
        """Travel at the start over which no force moves the slider up [m], (m,)."""
        return np.array([next((high for low, high in intervals if low == 0), 0.0) for intervals in self.all_jams])

    @property
    def is_held_on_corner(self) -> NDArray[np.bool_]:
        """Whether no force moves the slider up somewhere on the corner, (m, 1)."""
        corner = self.column(self.corner_travel).tolist()
        return np.array(
            [[any(low < end for low, _ in intervals)] for intervals, end in zip(self.all_jams, corner, strict=True)]
        )

    # --- as metrics see it ------------------------------------------------------------------------------------------

    @property
    def window(self) -> Several[Any]:
        """Both ends of the window of the analysis, else of the travel [m], numbers or (m, 1)."""
        places, stated = self.travel + self.origin, self.assembly.spec.analysis.window
        low, high = places[..., :1], places[..., -1:]
        if stated is None:
            return Several((low, high))
        windows = self.windows or [stated]
        which, lows, highs = np.broadcast_arrays(np.arange(len(windows)), low.ravel(), high.ravel())
        ends_of_rows = zip(which.tolist(), zip(lows.tolist(), highs.tolist(), strict=True), strict=True)
        ends = np.array([window_places(windows[row], pair) for row, pair in ends_of_rows]).T
        return Several(ends[..., None] if low.ndim > 1 or self.windows else ends)

    @property
    def requested_travel(self) -> Any:
        """Requested travel of the sliders [m]; without a request, as far as the flank was to be cut."""
        analysis, stroke, last = self.assembly.spec.analysis, self.mechanism.profile.stroke, self.travel[..., -1:]
        if analysis.travel is not None:
            return analysis.travel
        # the whole stroke but for rounding is the stroke: shares of the travel are then the same places in every run
        is_whole = np.abs(last - stroke) <= TRAVEL_RTOL * np.maximum(np.abs(last), np.abs(stroke))
        requested = np.where(is_whole, stroke, last)
        return requested if self.count > 1 else float(requested[0])

    @cached_property
    def places(self) -> FloatArray:
        """Increasing displacements so dense that the force hides nothing between two, (m, q), or (q,) for all [m]."""
        low, high = self.travel[..., :1], self.travel[..., -1:]
        return np.asarray(low + nodes(high - low, np.maximum(self.corner_travel - low, 0.0)) + self.origin)

    @cached_property
    def peaks(self) -> FloatArray:
        """Places all over the corner of an undercut cam, where the force has a peak between two samples [m].

        (m, k), or (k,) for all.
        """
        corner = np.minimum(self.corner_travel, self.travel[..., -1:])
        return np.asarray(corner * (ON_CORNER if corner.any() else ON_CORNER[:0]) + self.origin)

    def effort(self, branch: str, places: FloatArray, rows: Any = None) -> FloatArray:
        """Return the force on the way up or down at displacements of each mechanism, or of some, (k, n) [N]."""
        return self.evaluate_places(places, BRANCH_DIRECTIONS[branch], rows)[1].slider

    def stress(self, branch: str, places: FloatArray, rows: Any = None) -> FloatArray:
        """Return the stress below the contact at displacements, likewise [Pa]; NaN on the corner."""
        states, contact_forces = self.evaluate_places(places, BRANCH_DIRECTIONS[branch], rows)
        return stress(flank_pressure(self.assembly, states, contact_forces.contact, rows))

    def part_efforts(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the force of the strongest spring on the slider, without any weight, at displacements [N]."""
        share = self.mechanism.springs.stiffest / self.assembly.loads.stiffness
        return np.asarray(share * np.abs(self._without_weight.effort(branch, places)))

    @cached_property
    def _without_weight(self) -> Solution:
        loads = self.assembly.loads
        alone = replace(loads, roller_weight=0.0, slider_weight=0.0, sideways=(0.0, 0.0), off_plane=0.0)
        return replace(self, assembly=replace(self.assembly, loads=alone))

    @property
    def branches(self) -> dict[str, CurveRows]:
        """The curves by branch, up and down."""
        motion = self._spread_over_rows(self.displacement)
        corner, first = self.column(self.corner_travel), self.column(self.travel[..., :1])
        valid = np.maximum(corner, first) + self.column(self.origin), motion[:, -1]
        target = target_force(self.assembly.spec, self.assembly)
        return {
            name: CurveRows(
                self._samples_of(state.slider),
                lambda: self._spread_over_rows(self.places),
                partial(self._effort_in_rows, name),
                self.column(self.effort_error),
                np.full(self.count, np.nan) if target is None else self.column(target),
                self.column(self.assembly.spec.analysis.band),
                valid,
                partial(self._part_efforts_in_rows, name),
                self._stress_rows(name, state),
                peaks=self._spread_over_rows(self.peaks),
                travel=(motion[:, 0], self.column(self.requested_travel) + self.column(self.origin)),
                followed=self.assembly.spec.target_curve,
            )
            for name, state in (("load", self.up), ("unload", self.down))
        }

    def _samples_of(self, values: FloatArray) -> RowSamples:
        motion, values = (self._spread_over_rows(item) for item in (self.displacement, values))
        return RowSamples(motion, values, np.full(self.count, motion.shape[1]))

    def _spread_over_rows(self, values: FloatArray) -> FloatArray:
        return np.broadcast_to(values, (self.count, values.shape[-1]))

    def _effort_in_rows(self, name: str, places: FloatArray, rows: Any) -> FloatArray:
        effort = self.effort(name, places, rows)
        return np.broadcast_to(effort, (len(places), places.shape[1]))

    def _part_efforts_in_rows(self, name: str, places: FloatArray) -> FloatArray:
        return np.broadcast_to(self.part_efforts(name, places), places.shape)

    def _stress_rows(self, name: str, state: Forces) -> StressRows | None:
        if self.mechanism.contact is None:
            return None
        allowable = allowable_stress(self.mechanism)

        def read() -> list[RowSamples]:
            return [self._samples_of(stress(self.contact_pressure(state)))]

        def evaluate(places: FloatArray, rows: Any) -> FloatArray:
            return np.broadcast_to(self.stress(name, places, rows), places.shape)

        return StressRows(read, evaluate, self.column(np.nan if allowable is None else allowable))


class FlankSamples(NamedTuple):
    """Places of which some are on the flank, (..., n) each."""

    travel: FloatArray  # increasing [m]
    is_on_flank: NDArray[np.bool_]  # which of the places are on the flank
    states: TrackStates
    # up, down: on the way up and on the way down
    up: Forces
    down: Forces


def _append_column(first: Any, rest: Any) -> Any:
    """Return (..., 1) and (..., n) as (..., n + 1)."""
    shape = np.broadcast_shapes(np.shape(first)[:-1], rest.shape[:-1])
    return np.concatenate([np.broadcast_to(column, (*shape, column.shape[-1])) for column in (first, rest)], axis=-1)


BRANCH_DIRECTIONS = {"load": 1.0, "unload": -1.0}  # up and down, by branch
_TRAVEL_SHARES = np.concatenate(
    [np.geomspace(1e-14, 1e-4, 51), np.linspace(0.0, 1.0, 181) ** 2, 1.0 - np.geomspace(1e-9, 0.03, 24)]
)
"""Shares of the travel at which the force is looked at.

With friction it rises from zero to its constant value within nanometres: nodes stand at even shares of the logarithm
there, at even steps of the springs' stretch beyond, and close together before the end, where a brace may come near
horizontal.
"""
_SORTED_SHARES = np.sort(_TRAVEL_SHARES)
_ON_CORNER = np.concatenate([np.geomspace(1e-9, 0.02, 30), np.linspace(0.0, 1.0, 61)])
"""The same on a corner, where it rises within a tenth of a millimetre."""


def nodes(total: FloatArray, corner: FloatArray) -> FloatArray:
    """Return travels so dense that the force hides nothing between two of them, (..., n), increasing [m].

    `total` is the travel of each cam, `corner` that at which its roller leaves the corner, 0 without one, (..., 1) [m].
    """
    if not corner.any():
        return np.asarray(total * _SORTED_SHARES)
    total, on_corner = np.broadcast_arrays(total, np.minimum(corner, total))
    return np.sort(np.concatenate([total * _TRAVEL_SHARES, on_corner * _ON_CORNER], axis=-1), axis=-1)

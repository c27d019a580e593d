"""Many mechanisms at once around one cut cam: other braces, rollers, springs and weights than those it is cut for.

The cam is put together once. Where a roller of another radius or a brace of another length runs on it is
solved for all mechanisms and samples together; the formulas are those of `roller_track_on_cut_cam.Track`, `statics` and
`contact`. A mechanism whose curve is not complete, or whose force changes sign, is left to the model of one cam.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cfmkit.families.cam.contact_pressure import YIELD_PRESSURE, allowable_stress, pressure_between
from cfmkit.families.cam.findings import is_slack, sinks_first, yields
from cfmkit.families.cam.geometry.many_tracks_one_cam import Poses, sign_changes
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.many_designs.forces import ForcesOfCams, Pose, Slab
from cfmkit.families.cam.many_designs.means_and_extremes_in_window import CutWindows, SampledBranch
from cfmkit.families.cam.mechanism_from_spec import CLOSE
from cfmkit.families.cam.model import nodes
from cfmkit.families.cam.scalar_results import largest_roller
from cfmkit.families.cam.solution import FEW
from cfmkit.families.cam.statics import JAM_SHARES, at_dead_point, levers, load_on_contact, load_on_slider, over
from cfmkit.metrics.branches_cut_to_window import ROUNDING, TOLERANCE
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.results import WINDOW_OUTSIDE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.many_tracks_one_cam import ManyTracks
    from cfmkit.families.cam.solution import Assembly
    from cfmkit.specs.units import Ends

    Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Around:
    """Parts that are built around one cam: (d,) arrays."""

    cam: Assembly  # the cam, with the parts of the specification
    tracks: ManyTracks  # of the different pairs of roller and brace, (t,)
    which: Rows  # (d,) which of them each mechanism has
    asked: float | None  # requested travel [m]; None: as far as the flank goes
    # roller_weight, slider_weight, (d,): weight that hangs on one roller, and on the slider [N]
    roller_weight: FloatArray
    slider_weight: FloatArray
    # roller_radius, width, (d,): of the rollers without the material left on the flank, and of the line contact [m]
    roller_radius: FloatArray
    width: FloatArray

    def take(self, rows: Rows) -> Around:
        """Return what some of the mechanisms have."""
        some = (self.roller_weight, self.slider_weight, self.roller_radius, self.width)
        return Around(self.cam, self.tracks, self.which[rows], self.asked, *(each[rows] for each in some))


class BuiltSlab(Slab):
    """Some mechanisms around one cam at all their samples; `designs.x0` is where their springs are at rest."""

    around: Around
    windows: Sequence[Ends]

    def built(self, around: Around, windows: Sequence[Ends]) -> BuiltSlab:
        """Return the slab itself, with what its mechanisms are built of, and the windows of the specification."""
        self.around, self.windows = around, windows
        return self

    @cached_property
    def _every(self) -> Rows:
        return np.arange(len(self.designs))

    @cached_property
    def _kinds(self) -> tuple[Rows, Rows]:
        """Return the different tracks in this slab, and which of these each mechanism has."""
        found, which = np.unique(self.around.which, return_inverse=True)
        return found, which.ravel()

    @property
    def _pressed(self) -> bool:
        return self.around.cam.spec.mechanism.contact is not None

    @cached_property
    def _reach(self) -> FloatArray:
        """Travel of each different track, (k,) [m]."""
        tracks, kinds = self.around.tracks, self._kinds[0]
        available = (tracks.end - tracks.start)[kinds, 0]
        return available if self.around.asked is None else np.full(len(kinds), self.around.asked)

    @cached_property
    def requested(self) -> FloatArray:
        """Travel of which windows may be shares, (d,) [m]: as `Result.travel` has it."""
        reached, stroke = self.travel[:, -1], self.around.cam.spec.mechanism.profile.stroke or 0.0
        if self.around.asked is not None:
            return np.full(len(reached), self.around.asked)
        return np.where(np.abs(reached - stroke) <= CLOSE * np.maximum(np.abs(reached), stroke), stroke, reached)

    def _of_kinds(self, travel: FloatArray) -> Poses:
        """Return the poses of all mechanisms at travels of the different tracks, (k, n) [m]."""
        kinds, which = self._kinds
        tracks = self.around.tracks
        return tracks.poses(tracks.start[kinds] + travel, kinds).take(which)

    @cached_property
    def travel(self) -> FloatArray:
        """Travel of the slider [m]."""
        return np.linspace(0.0, self._reach, self.points, axis=1)[self._kinds[1]]

    @cached_property
    def _poses(self) -> Poses:
        """Positions of the rollers at all samples."""
        return self._of_kinds(np.linspace(0.0, self._reach, self.points, axis=1))

    def _poses_at(self, travel: FloatArray, rows: Rows) -> Poses:
        """Return how the rollers stand at travels of some mechanisms, (r, m) [m]."""
        tracks, which = self.around.tracks, self.around.which[rows]
        travel = np.minimum(np.maximum(travel, 0.0), self.travel[rows, -1:])
        return tracks.poses(tracks.start[which] + travel, which)

    def pose(self, travel: FloatArray, rows: Rows) -> Pose:
        """Return how the rollers stand at travels of some mechanisms, (r, m) [m]."""
        found, cams = self._poses_at(travel, rows), self.designs.take(rows)
        return Pose(found.x - cams.x0[:, None], found.slope, brace_tangent(found.x, cams.brace[:, None]))

    @property
    def half_width(self) -> FloatArray:
        """x of the right roller's centre [m]."""
        return self._poses.x

    @property
    def slope(self) -> FloatArray:
        """Slope of the track."""
        return self._poses.slope

    @property
    def flank(self) -> NDArray[np.bool_]:
        """Whether the roller runs on the flank."""
        return ~self._poses.on_corner

    @cached_property
    def stretch(self) -> FloatArray:
        """x less the half width at which the springs are at rest [m]."""
        return self.half_width - self.designs.x0[:, None]

    @cached_property
    def corner_travel(self) -> FloatArray:
        """Travel at which the roller leaves the corner [m]."""
        tracks = self.around.tracks
        return np.asarray(np.maximum((tracks.corner_end - tracks.start)[self.around.which, 0], 0.0))

    @cached_property
    def places(self) -> FloatArray:
        """Travels at which metrics that are places look at the force, (designs, n) [m]."""
        return nodes(self.travel[:, -1], self.corner_travel)

    @cached_property
    def everywhere(self) -> tuple[FloatArray, FloatArray]:
        """Force at `places` on the way up, and on the way down [N]."""
        kinds, which = self._kinds
        first = np.zeros(len(kinds), dtype=np.intp)
        first[which] = self._every
        poses = self._of_kinds(nodes(self.travel[first, -1], self.corner_travel[first]))
        return self._slider(poses, self._every, 1.0), self._slider(poses, self._every, -1.0)

    def somewhere(self, way: float | FloatArray, travel: FloatArray, rows: Rows) -> FloatArray:
        """Return the force at travels of some mechanisms, (r, m) [N]; NaN where friction holds a roller."""
        return self._slider(self._poses_at(travel, rows), rows, way)

    def _forces(self, friction: FloatArray) -> ForcesOfCams:
        way = -1.0 if (friction < 0).any() else 1.0
        contact = self._contact(self._poses, self._every, way) if self.contacts or self._pressed else None
        slider = self._slider(self._poses, self._every, way)
        return ForcesOfCams(slider, contact, np.asarray(np.isfinite(slider[:, 1:]).all(axis=1)))

    def _levers(self, poses: Poses, rows: Rows, way: float | FloatArray) -> tuple[FloatArray, ...]:
        """Return friction, tangent, 1 + mu f, the lever, and the spring force on one roller [N]."""
        cams = self.designs.take(rows)
        mu, tangent = way * cams.friction[:, None], brace_tangent(poses.x, cams.brace[:, None])
        turn, lever = levers(poses.slope, tangent, mu)
        spring = 2.0 * cams.stiffness[:, None] * np.maximum(poses.x - cams.x0[:, None], 0.0)
        return mu, tangent, turn, lever, spring

    def _slider(self, poses: Poses, rows: Rows, way: float | FloatArray) -> FloatArray:
        """Return the force on the slider [N], as `statics.forces` does."""
        mu, _, turn, lever, spring = self._levers(poses, rows, way)
        pull = over(2.0 * load_on_slider(turn, poses.slope, mu, spring, self._weight(rows)), lever)
        for at in self._idle(poses, rows, lever):
            pull[at] = self._limit(poses, rows, way, at)
        return pull + self.around.slider_weight[rows, None]

    def _contact(self, poses: Poses, rows: Rows, way: float | FloatArray) -> FloatArray:
        """Return the force at a contact [N], as `statics.forces` does."""
        _, tangent, turn, lever, spring = self._levers(poses, rows, way)
        contact = over(load_on_contact(poses.slope, tangent, spring, self._weight(rows)), lever)
        for at in self._idle(poses, rows, lever):
            pull = 0.5 * self._limit(poses, rows, way, at)
            contact[at] = load_on_contact(poses.slope[at], tangent[at], pull) / turn[at]
        return contact

    def _weight(self, rows: Rows) -> FloatArray | None:
        """Return the weight on each roller, (r, 1) [N]; None if none weighs anything."""
        weight = self.around.roller_weight[rows, None]
        return weight if weight.any() else None

    def _idle(self, poses: Poses, rows: Rows, lever: FloatArray) -> list[tuple[int, int]]:
        """Return where nothing is loaded and nothing has a lever, so that the force is a limit."""
        rest, weight = self.designs.x0[rows, None], self.around.roller_weight[rows, None]
        found = (np.abs(lever) < 1e-13) & (np.abs(poses.x - rest) <= 1e-15 * rest) & (weight == 0)
        return [(int(row), int(column)) for row, column in np.argwhere(found)] if found.any() else []

    def _limit(self, poses: Poses, rows: Rows, way: float | FloatArray, at: tuple[int, int]) -> float:
        tracks, law = self.around.tracks, self.around.tracks.profile.path.law
        row, slope, u = int(rows[at[0]]), poses.slope[at], poses.parameter[at]
        if poses.on_corner[at]:
            cosine = (1.0 + slope * slope) ** -0.5
            bend = 1.0 / (float(tracks.radius[self.around.which[row]]) * cosine**3)
        else:
            shift = float(tracks.shift[self.around.which[row], 0])
            bend = law.slope_derivative(u) / (1.0 + shift / law.curvature_radius(u) if shift else 1.0)
        cams = self.designs
        friction = float(np.broadcast_to(way, (len(rows), 1))[at[0], 0] * cams.friction[row])
        return at_dead_point(
            float(slope),
            float(bend),
            (float(cams.x0[row]), float(cams.brace[row]), float(cams.stiffness[row])),
            friction,
        )

    @cached_property
    def _jams(self) -> tuple[NDArray[np.bool_], FloatArray, NDArray[np.bool_]]:
        """Return who is jammed at the start, up to which travel [m], and of whom it is known."""
        tracks, count = self.around.tracks, len(self.designs)
        ends, known = np.zeros(count), np.ones(count, dtype=bool)
        rows = np.flatnonzero(self.designs.friction)
        if not rows.size:
            return np.zeros(count, dtype=bool), ends, known
        start, which = tracks.start[self.around.which], self.around.which
        passed = start > tracks.dead_point[which]
        first = self._poses_at(np.zeros((count, 1)), self._every)
        corner, (low, high), pivot = self.corner_travel > 0, tracks.flank_range, tracks.pivot
        turn = np.where(passed, np.arctan(first.slope), pivot.low)
        begin = np.where(passed & ~corner[:, None], first.parameter, low[which])
        ranges = ((turn, np.full((count, 1), pivot.high)), (begin, high[which]))
        samples = np.isnan(self.up.slider).any(axis=1) | (self.points < FEW)
        held = []
        for on_corner, (below, above) in zip((True, False), ranges, strict=True):
            grid = np.minimum(np.maximum(below + (above - below) * JAM_SHARES, below), above)
            short = self._lever_at(on_corner, grid, self._every) < 0
            # `statics.jams` looks between the ends of a stretch if one of them is held, or a force is missing.
            looked = samples | short[:, 0] | short[:, -1]
            there = corner if on_corner else np.ones(count, dtype=bool)
            held.append(short & (looked & there)[:, None])
        both = np.hstack(held)
        both[~corner, : len(JAM_SHARES)] = both[~corner, len(JAM_SHARES), None]
        both[~self.designs.friction.astype(bool)] = False
        jammed, last = np.asarray(both.any(axis=1)), both.sum(axis=1) - 1
        known &= ~jammed | (both[:, 0] & (last == both.shape[1] - 1 - both[:, ::-1].argmax(axis=1)))
        known &= ~jammed | ((last < both.shape[1] - 1) & (last != len(JAM_SHARES) - 1))
        for on_corner, (below, above), offset in zip((True, False), ranges, (0, len(JAM_SHARES)), strict=True):
            inside = (last >= offset) & (last < offset + len(JAM_SHARES) - 1)
            some = np.flatnonzero(jammed & known & inside)
            if some.size:
                shares = JAM_SHARES[last[some] - offset], JAM_SHARES[last[some] - offset + 1]
                near, far = (below[some] + (above - below)[some] * share[:, None] for share in shares)
                at = sign_changes(partial(self._lever_at, on_corner), near, far, some)
                slider = tracks.on_corner(at, which[some])[0] if on_corner else tracks.on_flank(at, which[some])[0]
                ends[some] = np.minimum(slider - start[some], self.travel[some, -1:])[:, 0]
        return jammed, ends, known

    def _lever_at(self, on_corner: bool, place: FloatArray, rows: Rows) -> FloatArray:
        """Return the lever of the slider on the way up, rounding added, at angles or path coordinates of a stretch."""
        tracks, which = self.around.tracks, self.around.which[rows]
        x, slope = tracks.on_corner(place, which)[1:] if on_corner else tracks.on_flank(place, which)[2:]
        mu, brace = self.designs.friction[rows, None], self.designs.brace[rows, None]
        return levers(slope, brace_tangent(x, brace), mu)[1] + 1e-12

    @property
    def jammed(self) -> NDArray[np.bool_]:
        """Whether friction lets no force move the slider up somewhere on the travel."""
        return self._jams[0]

    @property
    def held_on_corner(self) -> NDArray[np.bool_]:
        """Whether friction lets no force move the slider up somewhere on the corner: where it does, at the start."""
        return self._jams[0]

    @property
    def jam_travel(self) -> FloatArray:
        """Travel at the start over which friction lets no force move the slider up [m]."""
        return self._jams[1]

    @cached_property
    def _dead(self) -> NDArray[np.bool_]:
        """Whether the slider has no leverage on the rollers at the start, or must go down first."""
        tracks, which = self.around.tracks, self.around.which
        down = sinks_first(tracks.dead_point, tracks.start, tracks.brace[:, None])[which, 0]
        return np.asarray(down | np.isnan(self.up.slider[:, 0]) | np.isnan(self.down.slider[:, 0]))

    def warned(self, max_elongation: float | None) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield the findings that `findings.findings_of` has of such mechanisms, in its order."""
        found = dict(super().warned(max_elongation))
        yield from ((name, found[name]) for name in ("undercut", "contact_not_single_valued"))
        if self._pressed:
            yield "corner_pressure", found["undercut"]
        yield "up_jam", found["up_jam"]
        yield "dead_point", self._dead
        yield "spring_slack", np.asarray(is_slack(2.0 * self.stretch).any(axis=1))
        yield from ((name, found[name]) for name in ("spring_overstretched", "slack_cable") if name in found)
        if self._allowable is not None:
            yield "overstressed", yields(self.pressure_max, self._allowable)
        reached, windows = self.travel[:, -1], [self.ends(window) for window in self.windows]
        short = [reached < found[1] - TOLERANCE * (found[1] - found[0]) for found in windows if found is not None]
        yield WINDOW_OUTSIDE, np.logical_or.reduce(short) if short else np.zeros(len(reached), dtype=bool)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Whether the curve is complete, its force is nowhere negative, and all is known of it that is asked."""
        tracks, which, mechanism = self.around.tracks, self.around.which, self.around.cam.spec.mechanism
        x0, profile = self.designs.x0, tracks.profile
        reached = (tracks.end - tracks.start)[which, 0] >= self.travel[:, -1]
        if self.around.asked is None:
            reached &= ~tracks.turns_back[which]
        room = self.half_width[:, 0] - self.around.roller_radius >= -0.5e-12 * self.designs.brace
        crossed = (
            float(profile.shifted(profile.start, max(mechanism.profile.offset, 0.0) - profile.roller_radius)[0]) <= 0
        )
        held = self.stretch.max(axis=1) >= 0
        pulls = np.minimum(self.up.slider[:, 1:].min(axis=1), self.down.slider[:, 1:].min(axis=1)) >= 0
        ends = np.minimum(self.up.slider[:, -1], self.down.slider[:, -1]) > 0
        good = tracks.fits[which] & reached & room & held & pulls & ends & self._jams[2] & (x0 > 0) & (not crossed)
        return np.asarray(good & self.up.moves & self.down.moves)

    @property
    def _allowable(self) -> float | None:
        return allowable_stress(self.around.cam.spec.mechanism)

    @property
    def allowable_stress(self) -> float:
        """Allowed stress of contacts [Pa]; NaN: no limit."""
        return np.nan if self._allowable is None else self._allowable

    def _pressure(self, poses: Poses, rows: Rows, contact: FloatArray) -> FloatArray:
        """Return the pressure of contacts on the flank [Pa]; NaN on the corner."""
        pressing, cam = self.around.cam.spec.mechanism.contact, self.around.cam.profile
        if pressing is None:
            return np.full_like(contact, np.nan)
        law, offset = cam.path.law, self.around.cam.spec.mechanism.profile.offset
        curvature = 1.0 / self.around.roller_radius[rows, None]
        curvature = curvature + 1.0 / (law.curvature_radius(poses.parameter) - cam.roller_radius + offset)
        found = pressure_between(contact, curvature, pressing.material, self.around.width[rows, None])
        return np.where(poses.on_corner, np.nan, found)

    def stress_at(self, way: float, travel: FloatArray, rows: Rows) -> FloatArray:
        """Return the stress below the contact at travels of some mechanisms, (r, m) [Pa]; NaN on the corner."""
        poses = self._poses_at(travel, rows)
        return self._pressure(poses, rows, self._contact(poses, rows, way)) / YIELD_PRESSURE

    def excess(self, way: float) -> Callable[[FloatArray, Rows], FloatArray] | None:
        """Return by what share the stress exceeds what is allowed; None: it is not judged."""
        allowed = self._allowable
        if allowed is None:
            return None
        return lambda travel, rows: self.stress_at(way, travel, rows) / allowed - (1 + ROUNDING)

    def stressed(self, branch: str, window: tuple[float, float] | None) -> FloatArray:
        """Return the largest stress of a branch inside a window [Pa]; NaN where it is unbounded."""
        way, forces = (1.0, self.up) if branch == "load" else (-1.0, self.down)
        if forces.contact is None:
            return np.full(len(self.designs), np.nan)
        values = self._pressure(self._poses, self._every, forces.contact) / YIELD_PRESSURE
        known = np.isfinite(self.inside(branch, window).mean)
        sampled = SampledBranch(self.travel, values, partial(self.stress_at, way))
        return np.where(known, CutWindows(sampled, self.ends(window)).extremes[0], np.nan)

    @cached_property
    def pressure_max(self) -> FloatArray:
        """Largest pressure of the contact on the flank, on the way up [Pa]; NaN where none is asked about."""
        if not self._pressed:
            return np.full(len(self.designs), np.nan)
        travel = np.concatenate([self.corner_travel[:, None], self.travel], axis=1)
        first = self._poses_at(self.corner_travel[:, None], self._every)
        poses = Poses(*(np.concatenate(pair, axis=1) for pair in zip(first, self._poses, strict=True)))
        pressed = self._pressure(poses, self._every, self._contact(poses, self._every, 1.0))
        known = np.isfinite(pressed)
        # Where the roller leaves a corner on the travel, that place comes before the samples on the flank.
        known[:, :1] &= self.begin_there
        known[:, 1:] &= ~self.begin_there | (travel[:, 1:] > travel[:, :1])
        order = np.argsort(~known, axis=1, kind="stable")
        travel, pressed = (np.take_along_axis(each, order, axis=1) for each in (travel, pressed))
        counts, found = known.sum(axis=1), np.full(len(travel), np.nan)
        for count in np.unique(counts[counts > 0]).tolist():
            rows = np.flatnonzero(counts == count)
            high, _ = extremes(self._pressed_on(rows), travel[rows, :count], pressed[rows, :count], uneven=True)
            found[rows] = high
        return found

    def _pressed_on(self, rows: Rows) -> Callable[[FloatArray], FloatArray]:
        return lambda travel: YIELD_PRESSURE * self.stress_at(1.0, travel, rows)

    @property
    def begin_there(self) -> NDArray[np.bool_]:
        """Whether each roller leaves a corner on the travel, (d, 1)."""
        return np.zeros((len(self.designs), 1), dtype=bool) if self.begin is None else self.begin.there

    @property
    def _law(self) -> Any:
        return self.around.cam.profile.path.law

    own: ClassVar[Mapping[str, Callable[[Any], FloatArray]]] = {
        "theoretical_force": lambda cams: (
            4.0 * cams.designs.stiffness * cams.designs.constant + cams.around.slider_weight
        ),
        "roller_radius_max": lambda cams: cams.same(largest_roller(cams.around.cam)),
        "force_constant_min": lambda cams: cams.same(
            cams._law.smallest_force_constant(cams.around.cam.profile.roller_radius)
        ),
        "contact_pressure_max": lambda cams: cams.pressure_max,
    }
    """Values of the family that are not those of a cam with its own brace and roller."""

    def same(self, value: float | None) -> FloatArray:
        """Return one value for every mechanism; NaN where there is none."""
        return np.full(len(self.designs), np.nan if value is None else float(value))

"""Many undercut cams at once: the roller starts on the cam's corner.

Where the corner is and when the roller leaves it is found once for each different shape, by
the model of one cam; the forces of all designs that share it are one array operation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.geometry.flank_from_roller_path import WholeCamUndercut, cut
from cfmkit.families.cam.geometry.path import reach
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import NoTrack, Pivot, Track, pivot_angle
from cfmkit.families.cam.geometry.slope_law import SlopeLaw, brace_tangent
from cfmkit.families.cam.many_designs.forces import Begin, ForcesOfCams, Pose, Slab, force_at
from cfmkit.families.cam.mechanism_from_spec import CLOSE
from cfmkit.families.cam.solution import FEW
from cfmkit.families.cam.statics import jams, levers, load_on_contact, load_on_slider, over

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
    from cfmkit.families.cam.many_designs.forces import Designs

SHAPE = ("constant", "x0", "brace", "radius", "stroke")
"""What decides where the corner is, in the order of `shape`."""

_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Shape:
    """One cam with its roller's states at all samples, and where it leaves the corner."""

    track: Track
    travel: FloatArray
    states: TrackStates
    begin: TrackStates

    @property
    def corner_travel(self) -> float:
        """Travel at which the roller leaves the corner [m]."""
        return self.track.corner_end - self.track.start


def shape(law: SlopeLaw, radius: float, stroke: float, points: int) -> Shape | None:
    """Return a cam that the roller climbs from its corner to the end of the stroke; None if there is none [m]."""
    path, end = reach(law, stroke)
    try:
        profile = cut(path, radius, end)
        track = Track(profile, radius, law.brace_length)
    except (WholeCamUndercut, NoTrack):
        return None
    total = track.end - track.start
    rises = not track.turns_back and float(path.travel(end)) >= stroke * (1 - CLOSE)
    if profile.corner is None or not rises or abs(total - stroke) > _SAME * stroke or track.corner_end <= track.start:
        return None
    travel = np.linspace(0.0, total, points)
    begin = track.states(np.array([track.corner_end]))
    return Shape(track, travel, track.states(track.start + travel), begin)


def shapes(designs: Designs, points: int) -> tuple[list[Shape | None], NDArray[np.intp]]:
    """Return the different cams among some designs, and which of them each design has, (n,)."""
    rows, which = np.unique(np.stack([getattr(designs, name) for name in SHAPE], axis=1), axis=0, return_inverse=True)
    laws = [(SlopeLaw(*row[:3]), row[3], row[4]) for row in rows.tolist()]
    return [shape(law, radius, stroke, points) for law, radius, stroke in laws], which.reshape(-1)


class CornerSlab(Slab):
    """Some undercut designs whose shapes exist, at all their samples."""

    found: list[Shape]  # different cams
    which: NDArray[np.intp]  # (d,) which of them each design has

    def with_shapes(self, found: list[Shape], which: NDArray[np.intp]) -> CornerSlab:
        """Return the slab itself, with the shapes of its designs."""
        self.found, self.which = found, which
        return self

    def _states(self, name: str) -> FloatArray:
        return np.asarray(np.stack([getattr(one.states, name) for one in self.found])[self.which])

    @cached_property
    def travel(self) -> FloatArray:
        """Travel of the slider [m]."""
        return np.asarray(np.stack([one.travel for one in self.found])[self.which])

    @cached_property
    def half_width(self) -> FloatArray:
        """x of the right roller's centre [m]."""
        return self._states("x")

    @cached_property
    def stretch(self) -> FloatArray:
        """x - x0 [m]."""
        return self.half_width - self.designs.x0[:, None]

    @cached_property
    def slope(self) -> FloatArray:
        """Slope of the track."""
        return self._states("slope")

    @cached_property
    def flank(self) -> NDArray[np.bool_]:
        """Whether the roller runs on the flank."""
        return ~self._states("on_corner").astype(bool)

    @cached_property
    def corner_travel(self) -> FloatArray:
        """Travel at which the roller leaves the corner [m]."""
        return np.array([one.corner_travel for one in self.found])[self.which]

    @cached_property
    def jams(self) -> list[tuple[tuple[float, float], ...]]:
        """Intervals of travel in which no force moves the slider up [m], of each design."""
        known: dict[tuple[int, float], tuple[tuple[float, float], ...]] = {}
        for at, friction in zip(self.which.tolist(), self.designs.friction.tolist(), strict=True):
            if friction and (at, friction) not in known:
                one = self.found[at]
                intervals = jams(one.track, friction, one.states if self.points < FEW else None)
                known[at, friction] = tuple((low - one.track.start, high - one.track.start) for low, high in intervals)
        pairs = zip(self.which.tolist(), self.designs.friction.tolist(), strict=True)
        return [known.get(pair, ()) for pair in pairs]

    @cached_property
    def jam_travel(self) -> FloatArray:
        """Travel at the start over which friction lets no force move the slider up [m]."""
        return np.array([next((high for low, high in each if low <= 0), 0.0) for each in self.jams])

    def pose(self, travel: FloatArray, rows: NDArray[np.intp]) -> Pose:
        """Return how the rollers stand at travels of some designs, on the corner or the flank, (r, m) [m]."""
        flank, corner = super().pose(travel, rows), travel < self.corner_travel[rows, None]
        few = np.flatnonzero(corner.any(axis=1))
        if not few.size:
            return flank
        chosen = rows[few]
        cams, pivot = self.designs.take(chosen), Pivot(*(part[chosen, None] for part in self.pivots))
        angle = pivot_angle(self.starts[chosen, None] + np.maximum(travel[few], 0.0), pivot)
        angle = np.where(travel[few] <= 0.0, pivot.low, angle)
        stretch = pivot.x + pivot.radius * np.sin(angle) - cams.x0[:, None]
        tangent = brace_tangent(cams.x0[:, None] + stretch, cams.brace[:, None])
        for whole, part in zip(flank, (stretch, np.tan(angle), tangent), strict=True):
            whole[few] = np.where(corner[few], part, whole[few])
        return flank

    @cached_property
    def begin(self) -> Begin:
        """States of rollers that leave the corner, as the tracks have it: next to a jam the last digits decide."""
        x, slope = (np.array([getattr(one.begin, name)[0] for one in self.found]) for name in ("x", "slope"))
        x, slope = x[self.which, None], slope[self.which, None]
        tangent = brace_tangent(x, self.designs.brace[:, None])
        pose = Pose(x - self.designs.x0[:, None], slope, tangent)
        up, down = (force_at(self.designs, pose, way) for way in (1.0, -1.0))
        return Begin(up, down, slope, tangent, self.corner_travel[:, None] <= self.travel[:, -1:])

    @cached_property
    def pivots(self) -> Pivot:
        """Pivoting of the roller of each design on its corner."""
        return Pivot(*np.array([one.track.pivot for one in self.found]).T[:, self.which])

    @cached_property
    def starts(self) -> FloatArray:
        """Position of the slider at the start of each design's track [m]."""
        return np.array([one.track.start for one in self.found])[self.which]

    @property
    def jammed(self) -> NDArray[np.bool_]:
        """Whether friction lets no force move the slider up somewhere on the travel."""
        total = self.travel[:, -1]
        return np.array([any(low < end for low, _ in each) for each, end in zip(self.jams, total, strict=True)])

    @cached_property
    def held_on_corner(self) -> NDArray[np.bool_]:
        """Whether friction lets no force move the slider up somewhere on the corner."""
        return np.array(
            [any(low < end for low, _ in each) for each, end in zip(self.jams, self.corner_travel, strict=True)]
        )

    def _forces(self, friction: FloatArray) -> ForcesOfCams:
        """Return the forces at all samples, as `statics.forces` does without weight."""
        stretch, slope, mu = self.stretch, self.slope, friction[:, None]
        tangent = brace_tangent(self.half_width, self.designs.brace[:, None])
        turn, lever = levers(slope, tangent, mu)
        spring = 2.0 * self.designs.stiffness[:, None] * np.maximum(stretch, 0.0)
        contact = over(load_on_contact(slope, tangent, spring), lever) if self.contacts else None
        slider = over(2.0 * load_on_slider(turn, slope, mu, spring), lever)
        return ForcesOfCams(slider, contact, np.asarray(np.isfinite(slider).all(axis=1)))

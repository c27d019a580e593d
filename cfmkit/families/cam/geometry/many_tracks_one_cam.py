"""Tracks of many rollers and braces on one cam, solved together.

The formulas are those of `roller_track_on_cut_cam.Track`, in the same order; whatever that finds by a root of one cam
is found here for all of them at once. Which of the parts cannot run on the cam is an array, no exception.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.families.cam.geometry.path import ideal_position
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import KNOTS, Pivot, pivot_angle
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.numerics.roots import invert_increasing

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile

HALVINGS = 60
"""Bisections of a bracket between two knots: what is left of it is rounding."""


def sign_changes(
    function: Callable[[FloatArray, NDArray[np.intp]], FloatArray],
    below: FloatArray,
    above: FloatArray,
    rows: NDArray[np.intp],
) -> FloatArray:
    """Return where functions change from not positive to positive between two places of each row, (r, 1).

    Parameters
    ----------
    function : callable
        ``function(places, rows)``, (r, 1) -> (r, 1).
    below, above : (r, 1) array
        Where it is not positive, and where it is; in either order.
    rows : (r,) array of int
        Which rows these are.
    """
    for _ in range(HALVINGS):
        middle = 0.5 * (below + above)
        positive = function(middle, rows) > 0
        below, above = np.where(positive, below, middle), np.where(positive, middle, above)
    return 0.5 * (below + above)


class Poses(NamedTuple):
    """Positions of rollers: x of the centre [m], slope of its track, path coordinate [m] and whether on the corner."""

    x: FloatArray
    slope: FloatArray
    parameter: FloatArray
    on_corner: NDArray[np.bool_]

    def take(self, rows: NDArray[np.intp]) -> Poses:
        """Return those of some rows."""
        return Poses(self.x[rows], self.slope[rows], self.parameter[rows], self.on_corner[rows])


@dataclass(frozen=True, eq=False)
class ManyTracks:
    """Tracks on one cam, (d,) each [m]."""

    profile: CamProfile  # the cam as cut
    radius: FloatArray  # (d,) of the rollers that run on it, with the material that is left on the flank
    brace: FloatArray  # (d,) of the braces built in

    def __len__(self) -> int:
        """Return the number of tracks."""
        return len(self.radius)

    @cached_property
    def _every(self) -> NDArray[np.intp]:
        return np.arange(len(self))

    @cached_property
    def shift(self) -> FloatArray:
        """Difference of the radius of each roller from the one that the cam is cut for, (d, 1)."""
        return (self.radius - self.profile.roller_radius)[:, None]

    @cached_property
    def follows(self) -> NDArray[np.bool_]:
        """Whether the track is the path that the cam is cut for, (d, 1)."""
        return (self.shift == 0.0) & (self.brace[:, None] == self.profile.path.law.brace_length)

    def slider(self, x: FloatArray, y: FloatArray | float, rows: NDArray[np.intp]) -> FloatArray:
        """Return the slider's position above a roller centre, (r, n)."""
        brace = self.brace[rows, None]
        return y + ((brace - x) * (brace + x)) ** 0.5

    def on_flank(self, u: FloatArray, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return slider position, its derivative along the flank, x and slope at path coordinates, (r, n) each."""
        slider, rate, x, slope, _ = self._bent(u, rows)
        return slider, rate, x, slope

    def _bent(
        self, u: FloatArray, rows: NDArray[np.intp]
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return `on_flank`, and the second derivative of the slider's position, roughly: as on a circle."""
        shift, brace = self.shift[rows], self.brace[rows, None]
        slope, bend = self.profile.path.law.slopes(u)
        length = (1.0 + slope * slope) ** 0.5
        longer = 1.0 + shift * (bend / (length * length * length))
        x, y = u + shift * (slope / length), self.profile.path.height(u) + shift * (-1.0 / length)
        across = (brace - x) * (brace + x)
        level = across**0.5
        lever = slope - x / level
        turned = bend - brace * brace / (across * level) * longer
        return y + level, lever * longer, x, slope, turned * longer

    def on_corner(self, turn: FloatArray | float, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return slider position, x and slope where the contact normal on the corner is turned by an angle [rad]."""
        pivot, radius = self.pivot, self.radius[rows, None]
        sin, cos = np.sin(turn), np.cos(turn)
        x = pivot.x + radius * sin
        return self.slider(x, pivot.y - radius * cos, rows), x, sin / cos + np.zeros_like(x)

    @cached_property
    def pivot(self) -> Pivot:
        """Pivoting of the rollers about the corner, (d, 1) each; without one it is a point that no roller touches."""
        (xc, yc), law = self.profile.corner.point if self.profile.corner else (0.0, 0.0), self.profile.path.law
        low = float(np.arctan2(law.rest_half_width - xc, yc))
        high = float(np.arctan(law.slope(self.profile.start)))
        return Pivot(xc, yc, self.radius[:, None], self.brace[:, None], low, high)

    def _first(self, u: float) -> FloatArray:
        return np.full((len(self), 1), u)

    @cached_property
    def fits(self) -> NDArray[np.bool_]:
        """Which rollers and braces can run on the cam, (d,)."""
        x_first = self.on_flank(self._first(self.profile.start), self._every)[2][:, 0]
        begins = self.on_corner(self.pivot.low, self._every)[1][:, 0] if self.profile.corner else x_first
        reaches = np.maximum(x_first, begins) < self.brace * (1 - 1e-6)
        rises = (self.end - self.start)[:, 0] > 1e-11 * self.brace
        return np.asarray((np.minimum(x_first, begins) > 0) & reaches & rises & self._rising[2])

    @cached_property
    def _turns(self) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return the slider's first position, the sign of its first derivative, and who turns about the corner."""
        if self.profile.corner is None:
            first, rate, _, _ = self.on_flank(self._first(self.profile.start), self._every)
            return first, rate, np.zeros((len(self), 1), dtype=bool)
        first, x, slope = self.on_corner(self.pivot.low, self._every)
        _, x_last, steep = self.on_corner(self.pivot.high, self._every)
        brace = self.brace[:, None]
        return first, slope - brace_tangent(x, brace), steep - brace_tangent(x_last, brace) > 0

    @cached_property
    def start(self) -> FloatArray:
        """Position of the slider at the start of each track, (d, 1)."""
        return self._turns[0]

    @cached_property
    def corner_end(self) -> FloatArray:
        """Position of the slider at which each roller leaves the corner, (d, 1); that of the start without one."""
        leaves = self.on_flank(self.flank_range[0], self._every)[0]
        return np.where(self._turns[2], leaves, self.start)

    @cached_property
    def dead_point(self) -> FloatArray:
        """Smallest position of the slider on each track, (d, 1)."""
        (_, rate, turns), pivot = self._turns, self.pivot
        low = np.minimum(self.on_flank(self.flank_range[0], self._every)[0], self.start)
        across = self.brace[:, None] - self.radius[:, None]
        in_line = pivot.y + ((across - pivot.x) * (across + pivot.x)) ** 0.5
        return np.where(turns, np.where(rate >= 0, self.start, in_line), low)

    @cached_property
    def end(self) -> FloatArray:
        """Position of the slider at the end of each track, (d, 1)."""
        return self.on_flank(self.flank_range[1], self._every)[0]

    @property
    def flank_range(self) -> tuple[FloatArray, FloatArray]:
        """Path coordinates between which the slider rises on the flank, (d, 1) each."""
        return self._rising[0]

    @property
    def turns_back(self) -> NDArray[np.bool_]:
        """Whether the slider would fall before the flank ends, (d,)."""
        return self._rising[1]

    @cached_property
    def _rising(self) -> tuple[tuple[FloatArray, FloatArray], NDArray[np.bool_], NDArray[np.bool_]]:
        """Return `flank_range`, `turns_back`, and whether the slider rises anywhere, (d,)."""
        low, high, every = self._first(self.profile.start), self._brace_limit, self._every

        def rate(u: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
            return self.on_flank(u, rows)[1]

        knots = np.linspace(low[:, 0], high[:, 0], KNOTS, axis=1)
        rising = rate(knots, every) > 0
        rising[:, 0] |= self._turns[2][:, 0] | (rate(low, every)[:, 0] >= -1e-12)
        if self.profile.path.law.always_rises:
            rising |= self.follows
        anywhere, first = np.asarray(rising.any(axis=1)), rising.argmax(axis=1)
        falling = ~rising & (np.arange(KNOTS) > first[:, None])
        falls = np.where(falling.any(axis=1), falling.argmax(axis=1), 0)
        begin, end = low.copy(), high.copy()
        for ends, which, step in ((begin, first, -1), (end, falls, 0)):
            rows = np.flatnonzero(which > 0)
            if rows.size:
                before, after = knots[rows, which[rows] - 1, None], knots[rows, which[rows], None]
                ends[rows] = sign_changes(rate, *((before, after) if step else (after, before)), rows)
        return (begin, end), falls > 0, anywhere

    @cached_property
    def _brace_limit(self) -> FloatArray:
        """Return the largest path coordinates at which the braces still reach the axis, (d, 1)."""
        limit = self._first(self.profile.end)

        def margin(u: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
            slope = self.profile.path.law.slope(u)
            x = u + self.shift[rows] * (slope / (1.0 + slope * slope) ** 0.5)
            return self.brace[rows, None] * (1 - 1e-12) - x

        rows = np.flatnonzero(margin(limit, self._every)[:, 0] < 0)
        if rows.size:
            limit[rows] = sign_changes(margin, limit[rows], self._first(self.profile.start)[rows], rows)
        return limit

    def poses(self, slider: FloatArray, rows: NDArray[np.intp]) -> Poses:
        """Return how rollers stand at slider positions on some of the tracks, (r, n)."""
        corner = slider < self.corner_end[rows]
        if corner.all():
            _, x, slope = self.on_corner(self.turn(slider, rows), rows)
            return Poses(x, slope, np.full_like(x, self.profile.start), corner)
        u = self._flank_parameter(np.where(corner, self.corner_end[rows], slider), rows)
        slope = self.profile.path.law.slope(u)
        x = u + self.shift[rows] * (slope / (1.0 + slope * slope) ** 0.5)
        if corner.any():
            few = np.flatnonzero(corner.any(axis=1))
            some, on = rows[few], corner[few]
            _, x_corner, steep = self.on_corner(self.turn(slider[few], some), some)
            x[few], slope[few] = np.where(on, x_corner, x[few]), np.where(on, steep, slope[few])
            u[few] = np.where(on, self.profile.start, u[few])
        return Poses(x, slope, u, corner)

    def turn(self, slider: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        """Return the angles of the contact normal on the corner at slider positions, (r, n) [rad]."""
        pivot = self.pivot._replace(radius=self.radius[rows, None], brace=self.brace[rows, None])
        first = (self.dead_point[rows] == self.start[rows]) & (slider <= self.start[rows])
        return np.where(first, pivot.low, pivot_angle(slider, pivot))

    def _flank_parameter(self, slider: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        """Return the path coordinates of the contacts on the flank, (r, n)."""
        law, (low, high) = self.profile.path.law, (end[rows] for end in self.flank_range)
        plain = self.follows[rows] & (not law.friction and law.slope_factor == 1)
        first = self.slider(np.full((len(rows), 1), law.rest_half_width), 0.0, rows)
        ideal = np.minimum(np.maximum(ideal_position(law, np.maximum(slider - first, 0.0)), low), high)
        few = np.flatnonzero(~plain[:, 0])
        if not few.size:
            return ideal
        chosen, wanted = rows[few], slider[few]
        begin, lowest = self.start[chosen], self.on_flank(low[few], chosen)[0]
        guess = ideal_position(law, np.maximum(wanted - np.minimum(begin, lowest), 0.0))
        # Beyond a dead point the slider rises from there: a guess on it would have no slope to go by.
        guess = guess + np.where(lowest < begin, low[few] - law.rest_half_width, 0.0)

        def evaluate(u: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self.on_flank(u, chosen)[:2]

        bracket = low[few], high[few]
        nearer, off = self._nearer(wanted, chosen, np.minimum(np.maximum(guess, bracket[0]), bracket[1]))
        ideal[few] = invert_increasing(evaluate, wanted, bracket, nearer, before=off)
        return ideal

    def _nearer(self, slider: FloatArray, rows: NDArray[np.intp], guess: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return path coordinates nearer than a guess to those of slider positions, and how far off these are there.

        By Chebyshev's step, which cubes the error: the parts are a little off those that the guess is right for, and
        one step of Newton's does the rest.
        """
        position, rate, *_, bend = self._bent(guess, rows)
        off = position - slider
        with np.errstate(all="ignore"):
            step = off / rate
            skew = 0.5 * step * bend / rate
            nearer = guess - step * (1.0 + skew)
        near = np.abs(skew) < 0.5
        return np.where(near, nearer, guess), np.where(near, np.abs(off), 0.0)

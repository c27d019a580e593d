"""A path whose motion turns back, at every place of its way: what is stated of it does not depend on its points.

The way counts the points of the path: 2.5 is where the plane half-way between its points 2 and 3, across the line from
one to the other, cuts the path. There the equilibrium is solved for, from the polynomial through the nearest four
points of the branch.

Assumes: points so dense that the path goes once through each of these planes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import distinct, read_only
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.results.between_points import (
    MAX_RELATIVE_STRAY,
    MIN_PATH_POINTS,
    MIN_STRAY_DISTANCE,
    N_EXTREME_ROUNDS,
)
from cfmkit.numerics.continuation.problem import Border
from cfmkit.numerics.interpolation import inner_extremes, values_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.observed import Observed
    from cfmkit.elastica.results.path import EquilibriumPath


@dataclass(frozen=True, eq=False)
class AlongTheWay:
    """Motion, effort and stress at every place of the way (a `cfmkit.results.WindingPath`)."""

    path: EquilibriumPath  # of at least four accurate points
    observe: Callable[[EquilibriumPath], Observed]  # returns what is looked at on equilibria of this network

    @cached_property
    def _seen(self) -> Observed:
        return self.observe(self.path)

    @cached_property
    def ways(self) -> FloatArray:
        """The points, and between them extremes of the motion, of the effort and of each beam's stress, increasing."""
        seen, points = self._seen, np.arange(float(len(self.path)))
        found = {*points.tolist()}
        for number in range(2):
            found |= self._turns(number)
        largest = seen.stress.max()
        for values, _ in seen.stresses.values():
            turns = inner_extremes(self.arc, values)
            near = np.interp(turns, self.arc, points)
            found |= {*near[np.interp(near, points, values) > 0.5 * largest].tolist()}
        return read_only(sorted(found))

    def _turns(self, which: int) -> set[float]:
        """Return where one of the states has extremes between points: of polynomials, with what is solved there."""
        points = np.arange(float(len(self.path)))
        ways, values = points, self._states_at_points[which]
        for _ in range(N_EXTREME_ROUNDS):
            extremes = inner_extremes(np.interp(ways, points, self.arc), values)
            more = np.array(sorted({*np.interp(extremes, self.arc, points).tolist()} - {*ways.tolist()}))
            if not len(more):
                break
            at = np.searchsorted(ways, more)
            ways, values = np.insert(ways, at, more), np.insert(values, at, self.states(more)[which])
        return {*ways.tolist()}

    @cached_property
    def _states_at_points(self) -> tuple[FloatArray, FloatArray]:
        return self._seen.motion, self._seen.effort

    def states(self, ways: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return motion [m or rad] and effort [N or N m] at places of the way of any shape."""
        flat = np.ravel(ways)
        known = self._known.get(flat.tobytes())
        if known is None:
            there = self.solve_at(flat)
            seen, points = self.observe(there), np.arange(float(len(self.path)))
            rows = zip((seen.motion, seen.effort), self._states_at_points, strict=True)
            known = [np.where(there.accurate, new, np.interp(flat, points, own)) for new, own in rows]
            self._known[flat.tobytes()] = known
        motion, effort = (one.reshape(np.shape(ways)) for one in known)
        return motion, effort

    @cached_property
    def _known(self) -> dict[bytes, list[FloatArray]]:
        """Solved places, for every metric asks for the same ones."""
        return {}

    def stress(self, ways: FloatArray) -> FloatArray:
        """Return the largest stress at places of the way of any shape [Pa]."""
        flat, own = np.ravel(ways), self._seen.stress
        stress = np.interp(flat, np.arange(float(len(self.path))), own)
        between = np.flatnonzero(flat % 1.0)
        there = self.solve_at(flat[between])
        stress[between] = np.where(there.accurate, self.observe(there).stress, stress[between])
        return np.asarray(stress.reshape(np.shape(ways)))

    def solve_at(self, ways: FloatArray) -> EquilibriumPath:
        """Return the equilibria at places of the way (n,); `accurate` is False where none was found."""
        path, known_y, known_drive = self.path, self.path.free, self.path.at.drive
        own = equations(path.mesh)
        left = np.clip(ways.astype(np.int64), 0, len(path) - 2)
        share = ways - left
        y, drive = self._guesses(left, share)
        near = np.where(share > 0.5, left + 1, left)
        known = (share == 0.0) | (share == 1.0)
        y[known], drive[known] = known_y[near[known]], known_drive[near[known]]
        found = known.copy()
        for number in np.flatnonzero(~known).tolist():
            at = int(left[number])
            step = self._places[at + 1] - self._places[at]
            border = step * self._metric
            goal = float(border @ (self._places[at] + share[number] * step))
            spot = own.solve(y[number], float(drive[number]), Border(border, goal))
            if spot is None or spot.unstable not in path.unstable[at : at + 2].tolist():
                continue
            moved = _largest(path, spot.x - y[number])
            if moved <= max(MIN_STRAY_DISTANCE, MAX_RELATIVE_STRAY * _largest(path, known_y[at + 1] - known_y[at])):
                y[number], drive[number], found[number] = spot.x, spot.drive, True
        return path.with_states(near, y, drive, found)

    @cached_property
    def _places(self) -> FloatArray:
        """Free unknowns and drive of every point, (n, free + 1)."""
        return np.column_stack([self.path.free, self.path.at.drive])

    @cached_property
    def _metric(self) -> FloatArray:
        """Weight of the square of each unknown and of the drive: the ranges of both count alike, (free + 1,)."""
        reach = np.ptp(self._places, axis=0)
        weights = np.ones(len(reach))
        weights[-1] = (reach[:-1] @ reach[:-1]) / reach[-1] ** 2 if reach[-1] else 1.0
        return weights

    @cached_property
    def arc(self) -> FloatArray:
        """Length of the way up to every point, (n,)."""
        steps = np.diff(self._places, axis=0)
        return np.concatenate([[0.0], np.cumsum(np.sqrt(steps**2 @ self._metric))])

    @cached_property
    def _stretch(self) -> Any:
        """The number of the branch that each point is on, in the order of the path, (n,)."""
        branch = self.path.branch
        return np.cumsum(np.concatenate([[False], branch[1:] != branch[:-1]]))

    def _guesses(self, left: Any, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the polynomials through up to four points of the branch at shares of the way behind some points."""
        near = np.where(share > 0.5, left + 1, left)
        arc = self.arc[left] + share * (self.arc[left + 1] - self.arc[left])
        rows = self._places
        found = np.empty((len(left), rows.shape[1]))
        for number in distinct(self._stretch[near]).tolist():
            own, here = self._stretch == number, self._stretch[near] == number
            found[here] = values_at(self.arc[own], rows[own], arc[here])
        return found[:, :-1].copy(), found[:, -1].copy()


def _largest(path: EquilibriumPath, change: FloatArray) -> float:
    """Return the largest change of positions and rotations in a change of the unknowns."""
    mesh = path.mesh
    return float(np.abs(change[mesh.free < mesh.n_motions]).max(initial=0.0))


def interpolate_folding_path(
    path: EquilibriumPath, observe: Callable[[EquilibriumPath], Observed]
) -> AlongTheWay | None:
    """Return a path at every place of its way; None of one that is too short, or misses its tolerance."""
    return AlongTheWay(path, observe) if len(path) >= MIN_PATH_POINTS and np.all(path.accurate) else None

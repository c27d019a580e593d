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
        places = {*points.tolist(), *self._turns(0), *self._turns(1)}
        for values, _ in seen.stresses.values():
            beside = np.interp(inner_extremes(self.arc, values), self.arc, points)
            places |= {*beside[np.interp(beside, points, values) > 0.5 * seen.stress.max()].tolist()}
        return read_only(sorted(places))

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
        solved_states = self._known.get(flat.tobytes())
        if solved_states is None:
            equilibria = self.solve_at(flat)
            seen, points = self.observe(equilibria), np.arange(float(len(self.path)))
            rows = zip((seen.motion, seen.effort), self._states_at_points, strict=True)
            solved_states = [
                np.where(equilibria.accurate, new, np.interp(flat, points, at_points)) for new, at_points in rows
            ]
            self._known[flat.tobytes()] = solved_states
        motion, effort = (values.reshape(np.shape(ways)) for values in solved_states)
        return motion, effort

    @cached_property
    def _known(self) -> dict[bytes, list[FloatArray]]:
        """Motions and efforts at solved places, kept because every metric asks for the same places."""
        return {}

    def stress(self, ways: FloatArray) -> FloatArray:
        """Return the largest stress at places of the way of any shape [Pa]."""
        flat, point_stress = np.ravel(ways), self._seen.stress
        stress = np.interp(flat, np.arange(float(len(self.path))), point_stress)
        between = np.flatnonzero(flat % 1.0)
        equilibria = self.solve_at(flat[between])
        stress[between] = np.where(equilibria.accurate, self.observe(equilibria).stress, stress[between])
        return np.asarray(stress.reshape(np.shape(ways)))

    def solve_at(self, ways: FloatArray) -> EquilibriumPath:
        """Return the equilibria at places of the way (n,); `accurate` is False where none was found."""
        path, places, system = self.path, self._places, equations(self.path.mesh)
        left = np.clip(ways.astype(np.int64), 0, len(path) - 2)
        share = ways - left
        nearest = np.where(share > 0.5, left + 1, left)
        rows, solved = self._guess(left, share, nearest), (share == 0.0) | (share == 1.0)
        rows[solved] = places[nearest[solved]]
        for number in np.flatnonzero(~solved).tolist():
            at, guess = int(left[number]), rows[number]
            step = places[at + 1] - places[at]
            border = step * self._metric
            goal = float(border @ (places[at] + share[number] * step))
            spot = system.solve(guess[:-1], float(guess[-1]), Border(border, goal))
            if spot is None or spot.unstable not in path.unstable[at : at + 2].tolist():
                continue
            if self._measure(spot.place - guess) <= max(MIN_STRAY_DISTANCE, MAX_RELATIVE_STRAY * self._measure(step)):
                rows[number], solved[number] = spot.place, True
        return path.with_states(nearest, rows[:, :-1], rows[:, -1], solved)

    def _measure(self, change: FloatArray) -> float:
        """Return the largest change of positions and rotations in a change of unknowns and drive."""
        mesh = self.path.mesh
        return float(np.abs(change[:-1][mesh.free < mesh.n_motions]).max(initial=0.0))

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

    def _guess(self, left: Any, share: FloatArray, nearest: Any) -> FloatArray:
        """Return the polynomials through up to four points of the branch at shares of the way behind some points."""
        arc = self.arc[left] + share * (self.arc[left + 1] - self.arc[left])
        rows = np.empty((len(left), self._places.shape[1]))
        for number in distinct(self._stretch[nearest]).tolist():
            on_stretch, of_stretch = self._stretch == number, self._stretch[nearest] == number
            rows[of_stretch] = values_at(self.arc[on_stretch], self._places[on_stretch], arc[of_stretch])
        return rows


def interpolate_folding_path(
    path: EquilibriumPath, observe: Callable[[EquilibriumPath], Observed]
) -> AlongTheWay | None:
    """Return a path at every place of its way; None of one that is too short, or misses its tolerance."""
    return AlongTheWay(path, observe) if len(path) >= MIN_PATH_POINTS and np.all(path.accurate) else None

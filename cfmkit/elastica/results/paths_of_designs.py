"""Paths of designs of one topology at every place of their drives, as rows of arrays (`between_points` has one).

Equilibria between points are solved design by design in compiled code; what leads to them and what follows from them,
first guesses, checks and stresses, is computed for all designs at once.

Assumes: paths without corners under a drive by a motion, on discretisations of one degree and shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import Several, read_only
from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.results.between_points import MAX_RELATIVE_STRAY, MIN_STRAY_DISTANCE, N_EXTREME_ROUNDS, PLACE_RTOL
from cfmkit.elastica.results.stress_extremes import (
    choose_few_points,
    find_near_largest,
    insert_knots,
    largest_of_runs,
    largest_stresses_of_designs,
    runs_of_points,
    solve_all_extremes,
)
from cfmkit.numerics.interpolation import inner_extremes_of_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.between_points import BetweenPoints

    Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PathsOfDesigns:
    """Effort and stress of d paths at every place."""

    laws: Sequence[BetweenPoints]

    def solve_knots(self) -> None:
        """Let the extremes of all paths between their points be known: as each would solve for them by itself."""
        every = [(law.own_points, law.point_efforts) for law in self.laws]
        for _ in range(N_EXTREME_ROUNDS):
            more = inner_extremes_of_rows(every)
            rows = np.flatnonzero([len(places) for places in more])
            if not len(rows):
                break
            most = max(map(len, more))
            places = np.array([np.append(more[k], np.full(most - len(more[k]), every[k][0][0])) for k in rows.tolist()])
            efforts = self.effort(places, rows)
            for k, solved in zip(rows.tolist(), efforts, strict=True):
                every[k] = insert_knots(*every[k], more[k], solved[: len(more[k])])
        for law, (x, effort) in zip(self.laws, every, strict=True):
            vars(law)["knots"] = Several((read_only(x), read_only(effort)))

    @cached_property
    def _counts(self) -> Rows:
        """Points of each path, (d,)."""
        return np.array([len(law.path) for law in self.laws])

    def _pad(self, columns: Sequence[FloatArray]) -> FloatArray:
        """Return the points of every path in the order of increasing drives, (d, n, ...); the last is repeated."""
        most = int(self._counts.max())
        return np.array([column[np.minimum(np.arange(most), len(column) - 1)] for column in columns])

    @cached_property
    def _drive(self) -> FloatArray:
        return self._pad([law.own_drive for law in self.laws])

    @cached_property
    def _unknowns(self) -> FloatArray:
        """Free unknowns at the points of every path, (d, n, free), padded."""
        return self._pad([law.own_unknowns for law in self.laws])

    @cached_property
    def _efforts(self) -> FloatArray:
        return self._pad([law.point_efforts for law in self.laws])

    @cached_property
    def _scale(self) -> FloatArray:
        return np.array([law.path.mesh.scales.drive for law in self.laws])

    @cached_property
    def _moves(self) -> NDArray[np.bool_]:
        mesh = self.laws[0].path.mesh
        return np.asarray(mesh.free < mesh.n_motions)

    def effort(self, places: FloatArray, rows: Rows | None = None) -> FloatArray:
        """Return the efforts of some designs at places of each, (k, m) [N or N m]."""
        chosen = np.arange(len(self.laws)) if rows is None else np.asarray(rows)
        return self._solve(chosen, places / self._scale[chosen, None])[2]

    def _solve(self, rows: Rows, wanted: FloatArray) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
        """Return unknowns (k, m, n), whether they are equilibria, and efforts, at dimensionless places (k, m)."""
        drive, every = self._drive[rows], rows[:, None]
        wanted = np.clip(wanted, drive[:, :1], drive[:, -1:])
        last = self._counts[rows, None] - 1
        left = np.clip((drive[:, None, :] <= wanted[..., None]).sum(axis=-1) - 1, 0, last - 1)
        before, behind = (np.take_along_axis(drive, at, 1) for at in (left, left + 1))
        nearest = left + (wanted - before > behind - wanted)
        guess, efforts = self._guess(rows, wanted, last), self._efforts[every, nearest]
        is_known = np.abs(wanted - np.take_along_axis(drive, nearest, 1)) <= PLACE_RTOL * (drive[:, -1:] - drive[:, :1])
        guess[is_known] = self._unknowns[every, nearest][is_known]
        change = np.abs(self._unknowns[every, left + 1] - self._unknowns[every, left])[..., self._moves].max(axis=-1)
        is_solved, solved = is_known.copy(), np.where(is_known, efforts, np.nan)
        for k in np.flatnonzero(~is_known.all(axis=1)).tolist():
            law, asked = self.laws[rows[k]], np.flatnonzero(~is_known[k])
            system = equations(law.path.mesh)
            states = system.solve_each(guess[k, asked], wanted[k, asked])
            moved = np.abs(states.free - guess[k, asked])[:, self._moves].max(axis=-1)
            good = (
                states.converged
                & (states.unstable == 0)
                & (moved <= np.maximum(MIN_STRAY_DISTANCE, MAX_RELATIVE_STRAY * change[k, asked]))
            )
            chosen = asked[good]
            guess[k, chosen], is_solved[k, chosen] = states.free[good], True
            solved[k, chosen] = law.unit * system.effort_unit * states.effort[good]
        for k, m in np.argwhere(~is_solved):
            solved[k, m] = np.interp(wanted[k, m], drive[k], self._efforts[rows[k]])
        return guess, is_solved, solved

    def _guess(self, rows: Rows, wanted: FloatArray, last: Any) -> FloatArray:
        """Return the cubics through the four nearest points at some places, (k, m, n)."""
        drive = self._drive[rows]
        first = np.clip((drive[:, None, :] < wanted[..., None]).sum(axis=-1) - 2, 0, last - 3)
        nodes = first[..., None] + np.arange(4)
        x = np.take_along_axis(drive[:, None, :], nodes, 2)
        weights = np.ones(nodes.shape)
        for i in range(4):
            for j in range(4):
                if j != i:
                    weights[..., i] *= (wanted - x[..., j]) / (x[..., i] - x[..., j])
        return np.asarray(np.einsum("kmi,kmin->kmn", weights, self._unknowns[rows[:, None, None], nodes]))

    # -- stress --------------------------------------------------------------------------------------------------------
    def _stresses(self, rows: Rows, free: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the stress of each beam at equilibria (p, n), one design a row, (b, p) [Pa]."""
        used, row = np.unique(rows, return_inverse=True)
        laws = [self.laws[number] for number in used.tolist()]
        meshes = [law.path.mesh for law in laws]
        z = np.array([mesh.base for mesh in meshes])[row] + drive[:, None] * meshes[0].rate
        z[:, meshes[0].free] = free
        networks = [law.path.network for law in laws]
        return largest_stresses_of_designs(networks, meshes, Equilibria(meshes[0], z, drive), row, self.laws[0].axial)

    def largest_stress(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return the largest stress of each design between two places, (d,) each [Pa]."""
        ends = np.stack([low, high], axis=1) / self._scale[:, None]
        every = range(len(self.laws))
        free, is_solved, _ = self._solve(np.arange(len(self.laws)), ends)
        chosen = [choose_few_points(self._get_drive(k), *ends[k]) for k in every]
        few_stresses = self._evaluate_stresses(chosen)
        more = [find_near_largest(self._get_drive(k), few, few_stresses[k], *ends[k]) for k, few in enumerate(chosen)]
        dense = self._evaluate_stresses(more)
        both = [self._merge_points(*pairs) for pairs in zip(chosen, few_stresses, more, dense, strict=True)]
        at_ends = self._stresses(np.repeat(every, 2), free.reshape(2 * len(every), -1), ends.ravel())
        stress_at_ends = at_ends.max(axis=0).reshape(-1, 2)
        for k, m in np.argwhere(~is_solved).tolist():
            stress_at_ends[k, m] = self.laws[k].stress("", np.array([(low, high)[m][k]]))[0]
        tops = stress_at_ends.max(axis=1)
        runs = [runs_of_points(self._get_drive(k), *both[k], ends[k]) for k in every]
        row = [k for k in every for _ in runs[k]]
        pieces = [run for k in every for run in runs[k]]
        knots = iter(solve_all_extremes(pieces, partial(self._stresses_at, row)))
        for k in every:
            top = largest_of_runs(self._get_drive(k), *both[k], ends[k], [next(knots) for _ in runs[k]])
            tops[k] = max(tops[k], top)
        return np.asarray(tops)

    def _stresses_at(self, rows: Sequence[int], places: Sequence[FloatArray]) -> list[tuple[FloatArray, Any]]:
        """Return the stress of each beam (b, m) at some dimensionless places of designs, and where it was solved."""
        count = np.array(list(map(len, places)))
        requested = np.arange(count.max()) < count[:, None]
        padded = np.zeros(requested.shape)
        padded[requested] = np.concatenate(places)
        padded = np.where(requested, padded, self._drive[list(rows), :1])  # which is known
        free, is_solved, _ = self._solve(np.array(rows), padded)
        stresses = self._stresses(np.repeat(rows, count), free[requested], padded[requested])
        ends = np.cumsum(count)[:-1]
        return list(zip(np.split(stresses, ends, axis=1), np.split(is_solved[requested], ends), strict=True))

    def _get_drive(self, number: int) -> FloatArray:
        return np.asarray(self._drive[number, : self._counts[number]])

    def _evaluate_stresses(self, points: Sequence[Rows]) -> list[FloatArray]:
        """Return the stress of each beam at points of every path, (b, m) each [Pa]."""
        rows, chosen = np.repeat(np.arange(len(points)), list(map(len, points))), np.concatenate(points)
        if not len(chosen):
            return [np.empty((0, 0)) for _ in points]
        stresses = self._stresses(rows, self._unknowns[rows, chosen], self._drive[rows, chosen])
        return np.split(stresses, np.cumsum(list(map(len, points)))[:-1], axis=1)

    @staticmethod
    def _merge_points(few: Rows, few_stresses: FloatArray, more: Rows, dense: FloatArray) -> tuple[Rows, FloatArray]:
        points = np.concatenate([few, more])
        order = np.argsort(points, kind="stable")
        return points[order], np.concatenate([few_stresses, dense] if len(more) else [few_stresses], axis=1)[:, order]

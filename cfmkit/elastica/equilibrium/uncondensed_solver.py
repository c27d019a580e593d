"""The same equilibria with nothing eliminated: every segment boundary is a node of the global system.

Eliminating the inside of a beam passes through cantilevers, and a cantilever may be critical just where the whole
network is (a clamped column). Where singular points are looked for, their null vectors must be seen in full.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.equilibrium.mesh import assemble_model
from cfmkit.elastica.equilibrium.network_solver import Points, Solver, Spot

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.network_solver import MarchOptions
    from cfmkit.elastica.kernels.network_array_types import DiscreteNetwork


_POSE = np.array([0, 1, 2, 2])  # degrees of freedom of a node, as in `DiscreteNetwork.place_dof`
_LEVEL = np.array([1.0, 0.0])  # cos and sin of a frame that is not turned


class ExpandedSolver(Solver):
    """Equilibria with the inside of the beams among the global unknowns; slower, and regular in more cases."""

    def _build(self) -> DiscreteNetwork:
        plain = assemble_model(self.layout, self.cut, self.table, self.ramped)
        self.plain_free = self.layout.plan.n_free
        segments = len(plain.segment_step) - 1
        firsts, begins = plain.beam_segment[:-1], np.zeros(segments, dtype=np.bool_)
        begins[firsts] = True
        inner = np.flatnonzero(~begins)  # segments that begin inside a beam
        self.inner, self.lasts = inner, plain.beam_segment[1:] - 1
        old_dofs, old_places = len(plain.slot), len(plain.place_dof)
        dof = old_dofs + 3 * np.arange(len(inner))
        ends = np.empty((segments, 2), np.int64)
        ends[firsts, 0], ends[self.lasts, 1] = plain.beam_end[:, 0], plain.beam_end[:, 1]
        ends[inner, 0] = ends[inner - 1, 1] = old_places + np.arange(len(inner))
        owner = np.cumsum(begins) - 1
        extra = 3 * len(inner)
        nowhere, held = np.zeros((len(inner), 2)), np.zeros(extra)
        return plain._replace(
            beam_segment=np.arange(segments + 1, dtype=np.int64),
            beam_end=ends,
            line_load=np.ascontiguousarray(plain.line_load[owner]),
            place_dof=np.concatenate([plain.place_dof, dof[:, None] + _POSE]),
            place_frame=np.concatenate([plain.place_frame, nowhere + _LEVEL]),
            place_origin=np.concatenate([plain.place_origin, nowhere]),
            place_arm=np.concatenate([plain.place_arm, nowhere]),
            base=np.concatenate([plain.base, held]),
            rate=np.concatenate([plain.rate, held]),
            slot=np.concatenate([plain.slot, self.plain_free + np.arange(extra)]),
        )

    def _count_free(self) -> int:
        return self.plain_free + 3 * len(self.inner)

    def expand(self, y: FloatArray) -> FloatArray:
        """Return the expanded unknowns for those of a plain solver with the same segments."""
        expanded: FloatArray = y[self._in_plain]
        return expanded

    @cached_property
    def _in_plain(self) -> Any:
        """Where the expanded unknowns are found among those of a plain solver."""
        free, whole = self.plain_free, self.plain_free + 3 * len(self.lasts)
        parts = np.arange(whole, whole + 6 * self.n_segments).reshape(-1, 6)
        last = np.empty((self.n_segments, 3), np.int64)
        last[self.inner - 1] = parts[self.inner, 3:]
        last[self.lasts] = np.arange(free, whole).reshape(-1, 3)
        return np.concatenate([np.arange(free), parts[self.inner, :3].ravel(), last.ravel(), parts.ravel()])

    @cached_property
    def _in_expanded(self) -> Any:
        """Where the unknowns of a plain solver are found among the expanded ones."""
        lasts = np.arange(self.n_free, self.n).reshape(-1, 3)[self.lasts]
        return np.concatenate([np.arange(self.plain_free), lasts.ravel(), np.arange(self.n, self.size)])

    def spread(self, tangent: FloatArray) -> FloatArray:
        """Return a tangent or bordering row of a plain solver in the place of these unknowns, zero for all others."""
        whole, beams = np.zeros(self.n + 1), len(self.lasts)
        whole[: self.plain_free], whole[-1] = tangent[: self.plain_free], tangent[-1]
        ends = whole[self.n_free : self.n].reshape(-1, 3)
        ends[self.lasts] = tangent[self.plain_free : self.plain_free + 3 * beams].reshape(-1, 3)
        return whole

    def reduce(self, spot: Spot) -> Spot:
        """Return an equilibrium with the unknowns of a plain solver; its tangent is not kept."""
        return Spot(spot.y[self._in_expanded], spot.drive, np.zeros(0), spot.unstable, spot.shortness)

    def shifted(self, y: FloatArray, drive: float, change: FloatArray) -> FloatArray:
        """Return the unknowns with z changed, and the segments' start forces as equilibrium of each asks for."""
        new = y.copy()
        new[: self.n] += change
        (start, end), (old_start, old_end) = self._poses(new, drive), self._poses(y, drive)
        last, old_last = (z[self.n_free : self.n].reshape(-1, 3) for z in (new, y))
        parts = new[self.n :].reshape(-1, 6)
        parts[:, :3] = start
        parts[:, 3:] += last - old_last
        parts[:, 5] += _turning(start, end, last) - _turning(old_start, old_end, old_last)
        return new

    def _poses(self, y: FloatArray, drive: float) -> tuple[FloatArray, FloatArray]:
        """Return the poses of both ends of every segment."""
        m = self.model
        values = np.where(m.slot >= 0, y[m.slot], m.base + drive * m.rate)
        a, b, arm, turn = values[m.place_dof.T]
        (c, s), (ox, oy), (x, yy) = m.place_frame.T, m.place_arm.T, m.place_origin.T
        co, si = np.cos(arm), np.sin(arm)
        poses = np.empty((len(a), 3))
        poses[:, 0] = x + c * a - s * b + co * ox - si * oy
        poses[:, 1] = yy + s * a + c * b + si * ox + co * oy
        poses[:, 2] = turn
        return poses[m.beam_end[:, 0]], poses[m.beam_end[:, 1]]


def _turning(start: FloatArray, end: FloatArray, force: FloatArray) -> FloatArray:
    """Return the moment that a force at the end exerts about the start."""
    reach = end - start
    turning: FloatArray = reach[:, 0] * force[:, 1] - reach[:, 1] * force[:, 0]
    return turning


class UncondensedSolver(Solver):
    """Equilibria in the unknowns of a plain solver, found with nothing eliminated."""

    def __init__(self, plain: Solver) -> None:
        """Take over the arrays of a plain solver."""
        vars(self).update(vars(plain))
        self.wide = ExpandedSolver(plain.layout, plain.mesh, plain.tolerance, plain.ramped)

    def finer(self, tolerance: float) -> UncondensedSolver:
        """Return a solver with twice as many steps in every segment."""
        return UncondensedSolver(super().finer(tolerance))

    def solve(
        self,
        y: FloatArray,
        drive: float,
        border: FloatArray | None = None,
        target: float | None = None,
        model: DiscreteNetwork | None = None,
    ) -> Spot | None:
        """Return the equilibrium near (y, drive) where border . (z, drive) = target; at this drive by default."""
        if model is not None:
            return super().solve(y, drive, border, target, model)
        across = None if border is None else self.wide.spread(border)
        found = self.wide.solve(self.wide.expand(y), drive, across, target)
        return None if found is None else self._reduced(found)

    def march(
        self, spot: Spot, targets: FloatArray, options: MarchOptions, room: int, model: DiscreteNetwork | None = None
    ) -> tuple[int, Points]:
        """Follow the path from `spot`; return why the march ended and its points."""
        if model is not None:
            return super().march(spot, targets, options, room, model)
        wide = Spot(self.wide.expand(spot.y), spot.drive, self.wide.spread(spot.tangent), spot.unstable)
        code, points = self.wide.march(wide, targets, options, room)
        ys = [self._reduced(Spot(y, 0.0, self.wide.unit)).y for y in points.y]
        return code, Points(np.array(ys).reshape(len(points), self.size), points.drive, points.info)

    def solve_each(self, ys: FloatArray, drives: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the equilibria near ys (k, unknowns) at these drives (k,), and how far they are, (k, 3)."""
        new, changes, free = ys.copy(), np.full((len(ys), 3), np.inf), self.wide.plain_free
        for k, drive in enumerate(drives.tolist()):
            spot = self.solve(ys[k], drive)
            if spot is not None:
                new[k], change = spot.y, np.abs(spot.y - ys[k])
                parts = change[:free], change[free : self.n], change
                changes[k] = [part.max(initial=0.0) for part in parts]
        return new, changes

    def _reduced(self, spot: Spot) -> Spot:
        """Return an equilibrium with the unknowns and the tangent of a plain solver."""
        plain, wide = self.wide.reduce(spot), self.wide
        ends = spot.tangent[wide.n_free : wide.n].reshape(-1, 3)[wide.lasts]
        tangent = np.concatenate([spot.tangent[: wide.plain_free], ends.ravel(), spot.tangent[-1:]])
        return Spot(plain.y, spot.drive, tangent, spot.unstable, spot.shortness, spot.increment)

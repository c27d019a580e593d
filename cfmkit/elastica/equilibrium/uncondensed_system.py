"""The same equilibria with nothing eliminated: every segment boundary is a node of the global system.

Eliminating the inside of a beam passes through cantilevers, and a cantilever may be critical just where the whole
network is (a clamped column). Where singular points are looked for, their null vectors must be seen in full.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.equilibrium.mesh import assemble_model
from cfmkit.elastica.equilibrium.meshed_network import Points, Solver, Spot

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.meshed_network import MarchOptions
    from cfmkit.elastica.kernels.model import DiscreteNetwork


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
        begin, end = np.empty(segments, np.int64), np.empty(segments, np.int64)
        begin[firsts], end[self.lasts] = plain.beam_end[:, 0], plain.beam_end[:, 1]
        begin[inner] = old_places + np.arange(len(inner))
        end[inner - 1] = begin[inner]
        owner = np.cumsum(begins) - 1
        extra = 3 * len(inner)
        return plain._replace(
            beam_segment=np.arange(segments + 1, dtype=np.int64),
            beam_end=np.stack([begin, end], axis=1),
            line_load=np.ascontiguousarray(plain.line_load[owner]),
            place_dof=np.concatenate([plain.place_dof, np.stack([dof, dof + 1, dof + 2, dof + 2], axis=1)]),
            place_frame=np.concatenate([plain.place_frame, np.tile([1.0, 0.0], (len(inner), 1))]),
            place_origin=np.concatenate([plain.place_origin, np.zeros((len(inner), 2))]),
            place_arm=np.concatenate([plain.place_arm, np.zeros((len(inner), 2))]),
            base=np.concatenate([plain.base, np.zeros(extra)]),
            rate=np.concatenate([plain.rate, np.zeros(extra)]),
            slot=np.concatenate([plain.slot, self.plain_free + np.arange(extra)]),
        )

    def _count_free(self) -> int:
        return self.plain_free + 3 * len(self.inner)

    def expand(self, y: FloatArray) -> FloatArray:
        """Return the expanded unknowns for those of a plain solver with the same segments."""
        beams = len(self.lasts)
        parts = y[self.plain_free + 3 * beams :].reshape(-1, 6)
        moved = parts[self.inner, :3]
        last = np.empty((self.n_segments, 3))
        last[self.inner - 1] = parts[self.inner, 3:]
        last[self.lasts] = y[self.plain_free : self.plain_free + 3 * beams].reshape(-1, 3)
        return np.concatenate([y[: self.plain_free], moved.ravel(), last.ravel(), parts.ravel()])

    def spread(self, tangent: FloatArray) -> FloatArray:
        """Return a tangent or bordering row of a plain solver in the place of these unknowns, zero for all others."""
        whole, beams = np.zeros(self.n + 1), len(self.lasts)
        whole[: self.plain_free], whole[-1] = tangent[: self.plain_free], tangent[-1]
        ends = whole[self.n_free : self.n].reshape(-1, 3)
        ends[self.lasts] = tangent[self.plain_free : self.plain_free + 3 * beams].reshape(-1, 3)
        return whole

    def reduce(self, spot: Spot) -> Spot:
        """Return an equilibrium with the unknowns of a plain solver; its tangent is not kept."""
        forces = spot.y[self.n_free : self.n].reshape(-1, 3)[self.lasts]
        y = np.concatenate([spot.y[: self.plain_free], forces.ravel(), spot.y[self.n :]])
        return Spot(y, spot.drive, np.zeros(0), spot.unstable, spot.shortness)

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
        a, b, arm, turn = (values[m.place_dof[:, k]] for k in range(4))
        (c, s), (ox, oy) = m.place_frame.T, m.place_arm.T
        x = m.place_origin[:, 0] + c * a - s * b + np.cos(arm) * ox - np.sin(arm) * oy
        yy = m.place_origin[:, 1] + s * a + c * b + np.sin(arm) * ox + np.cos(arm) * oy
        poses = np.stack([x, yy, turn], axis=1)
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

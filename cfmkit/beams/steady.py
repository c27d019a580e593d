"""A solver for paths on which the inside of beams cannot be eliminated.

Eliminating it passes through cantilevers. Half a pinned column is a critical one all along its buckled path: the
tangent then has entries beyond all bounds, and Newton's method and the slopes of the path are at the mercy of
rounding. With nothing eliminated they are not; it takes longer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.expanded import ExpandedSolver
from cfmkit.beams.solver import Points, Solver, Spot

if TYPE_CHECKING:
    from typing import Any

    from cfmkit.beams.kernels.model import Model
    from cfmkit.beams.run import Run
    from cfmkit.curves import FloatArray


_TAUT = 1e3  # largest dimensionless force of beams that are not drawn taut
_SHORT = 1e-4  # share of the drive's range that is a short step


def taut(run: Run) -> bool:
    """Tell whether a path has come to where a beam is drawn taut: eliminating is steady there, and forces soar.

    Where all beams stretch forces do not soar.
    """
    if all(beam.section.axial for beam in run.layout.network.beams.values()):
        return False
    forces = run.points.y[-1:, run.solver.n_free : run.solver.n]
    return bool(np.abs(forces).max(initial=0.0) > _TAUT)


def steadier(run: Run, wrong: int = 0) -> bool:
    """Let a run go on with nothing eliminated; False where it does so already, is only judged, or drawn taut.

    The last points that are `wrong` are taken back, and short steps before: what they led to may be a limit point, not
    to be jumped over.
    """
    if taut(run) or isinstance(run.solver, SteadySolver) or run.control.branch == "stop":
        return False
    run.solver = SteadySolver(run.solver)
    for _ in range(wrong):
        run.drop_last()
    while _may_be_shorter(run):
        run.drop_last()
    run.entry = 0.5 * _last_step(run)
    return True


def _may_be_shorter(run: Run) -> bool:
    """Tell whether a path ends with a short step on its branch, in which nothing happened that was told."""
    if len(run.points) < 3 or run.branches[-2] != run.branch or not 0.0 < _last_step(run) < _SHORT * run.span:
        return False
    low, high = sorted(run.points.drive[-2:].tolist())
    return not any(low <= event.drive / run.unit <= high for event in run.events)


def _last_step(run: Run) -> float:
    return abs(float(run.points.drive[-1] - run.points.drive[-2])) if len(run.points) > 1 else np.inf


class SteadySolver(Solver):
    """Equilibria in the unknowns of a plain solver, found with nothing eliminated."""

    def __init__(self, plain: Solver) -> None:
        """Take over the arrays of a plain solver."""
        vars(self).update(vars(plain))
        self.wide = ExpandedSolver(plain.layout, plain.mesh, plain.tolerance, plain.ramped)

    def finer(self, tolerance: float) -> SteadySolver:
        """Return a solver with twice as many steps in every segment."""
        return SteadySolver(super().finer(tolerance))

    def solve(
        self,
        y: FloatArray,
        drive: float,
        border: FloatArray | None = None,
        target: float | None = None,
        model: Model | None = None,
    ) -> Spot | None:
        """Return the equilibrium near (y, drive) where border . (z, drive) = target; at this drive by default."""
        if model is not None:
            return super().solve(y, drive, border, target, model)
        across = None if border is None else self.wide.spread(border)
        found = self.wide.solve(self.wide.expand(y), drive, across, target)
        return None if found is None else self._reduced(found)

    def march(
        self, spot: Spot, targets: FloatArray, options: FloatArray, room: int, model: Model | None = None
    ) -> tuple[int, Points]:
        """Follow the path from `spot`; return why the march ended and its points."""
        if model is not None:
            return super().march(spot, targets, options, room, model)
        wide = Spot(self.wide.expand(spot.y), spot.drive, self.wide.spread(spot.tangent), spot.unstable)
        code, points = self.wide.march(wide, targets, options, room)
        ys = [self._reduced(Spot(y, 0.0, self.wide.unit)).y for y in points.y]
        return code, Points(np.array(ys).reshape(len(points), self.size), points.drive, points.info)

    def solve_each(self, ys: FloatArray, drives: FloatArray) -> tuple[FloatArray, Any]:
        """Return the equilibria near ys (k, unknowns) at these drives (k,), and where there are any, (k,) bool."""
        spots = [self.solve(y, drive) for y, drive in zip(ys, drives.tolist(), strict=True)]
        new = np.array([y if spot is None else spot.y for y, spot in zip(ys, spots, strict=True)])
        return new.reshape(ys.shape), np.array([spot is not None for spot in spots])

    def _reduced(self, spot: Spot) -> Spot:
        """Return an equilibrium with the unknowns and the tangent of a plain solver."""
        plain, wide = self.wide.reduce(spot), self.wide
        ends = spot.tangent[wide.n_free : wide.n].reshape(-1, 3)[wide.lasts]
        tangent = np.concatenate([spot.tangent[: wide.plain_free], ends.ravel(), spot.tangent[-1:]])
        return Spot(plain.y, spot.drive, tangent, spot.unstable, spot.shortness, spot.increment)

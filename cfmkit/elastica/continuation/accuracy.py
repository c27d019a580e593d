"""How accurate the points of a path are: the same equilibria on a mesh with half the step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.state import PathProblem, Trail
    from cfmkit.elastica.equilibrium.meshed_network import Solver


_ROUNDING = (
    30 * np.finfo(float).eps
)  # share of the stiffest segment's force for one unit of motion: rounding, with room
_NOISE = 0.1  # change of forces that small, by half the step, as a share of themselves: there is no force


def largest_force(trail: Trail) -> FloatArray:
    """Return the largest dimensionless force or moment at the end of a beam at every point."""
    forces: FloatArray = np.abs(trail.points.y[:, trail.solver.n_free : trail.solver.n]).max(axis=1)
    return forces


def estimate(problem: PathProblem, trail: Trail) -> float:
    """Return the largest of `errors` at up to three points: middle, last, and where the forces are largest."""
    count = len(trail.points)
    if not count:
        return 0.0
    forces = largest_force(trail)
    hardest = int(forces.argmax())
    chosen = {count // 2, count - 1, hardest}
    if trail.pinned:  # at a bifurcation no mesh is near another
        chosen = {k for k in chosen if float(trail.points.drive[k]) not in trail.pinned} or {0}
    return max(errors(problem, trail, sorted(chosen), float(forces[hardest])))


def errors(problem: PathProblem, trail: Trail, indices: list[int], largest: float) -> list[float]:
    """Return the difference to a mesh of twice the steps at points: forces and positions, relative to the path.

    `largest` is the path's largest force. Infinite where the finer mesh has no equilibrium nearby.
    """
    tolerance = max(trail.solver.tolerance, 0.02 * problem.control.tolerance)
    fine, scale = trail.solver.finer(tolerance), max(1e-12, largest)
    ys, drives, far = trail.points.y[indices], trail.points.drive[indices], 0.1 * max(1.0, scale)
    found = []
    changes = fine.solve_each(ys, drives)[1]
    if changes[:, 1].max() > _NOISE * scale and largest < _ROUNDING * _stiffest(fine):
        scale = 1.0  # nothing bears a load: forces are errors themselves
    for k, (pose, force, most) in zip(indices, changes.tolist(), strict=True):
        found.append(max(pose, force / scale) if most <= far else _across(trail, fine, k, scale, far))
    return found


def _stiffest(solver: Solver) -> float:
    """Return the largest force on the end of a segment that is moved by a unit length, dimensionless."""
    whole = np.add.reduceat(solver.table[:, :, 1:4].sum(axis=1), solver.cut.segment_step[:-1])
    length, turn, stretch = whole.T
    bent = 12.0 / (length**2 * turn)
    return float(np.where(stretch > 0.0, 1.0 / np.where(stretch > 0.0, stretch, 1.0), bent).max())


def _across(trail: Trail, fine: Solver, index: int, scale: float, far: float) -> float:
    """Return the difference at a point that has no equilibrium nearby at its own drive: where the path turns back."""
    n, free, y, drive = trail.solver.n, trail.solver.n_free, trail.points.y[index], float(trail.points.drive[index])
    border = trail.spot(index).tangent
    across = fine.solve(y, drive, border, float(border[:-1] @ y[:n] + border[-1] * drive))
    if across is None:
        return np.inf
    change = np.abs(across.y - y)
    if change.max() > far:
        return np.inf
    poses, forces = change[:free].max(initial=0.0), change[free:n].max() / scale
    return float(max(poses, forces, abs(across.drive - drive)))

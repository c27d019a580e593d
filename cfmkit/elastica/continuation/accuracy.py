"""How accurate the points of a path are: the same equilibria on a mesh with half the step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.state import Problem, Trail
    from cfmkit.elastica.equilibrium.solver import Solver


def largest_force(trail: Trail) -> FloatArray:
    """Return the largest dimensionless force or moment at the end of a beam at every point."""
    forces: FloatArray = np.abs(trail.points.y[:, trail.solver.n_free : trail.solver.n]).max(axis=1)
    return forces


def estimate(problem: Problem, trail: Trail) -> float:
    """Return the largest of `errors` at up to three points: middle, last, and where the forces are largest."""
    count = len(trail.points)
    if not count:
        return 0.0
    forces = largest_force(trail)
    hardest = int(forces.argmax())
    chosen = {count // 2, count - 1, hardest}
    if trail.pinned:  # at a bifurcation no mesh is near another
        chosen = {k for k in chosen if float(trail.points.drive[k]) not in trail.pinned} or {0}
    return float(errors(problem, trail, chosen, float(forces[hardest])).max())


def errors(problem: Problem, trail: Trail, indices: Iterable[int], largest: float) -> FloatArray:
    """Return the difference to a mesh of twice the steps at points: forces and positions, relative to the path.

    `largest` is the path's largest force. Infinite where the finer mesh has no equilibrium nearby.
    """
    tolerance = max(trail.solver.tolerance, 0.02 * problem.control.tolerance)
    fine = trail.solver.finer(tolerance)
    n, free = trail.solver.n, trail.solver.n_free
    scale = max(1e-12, largest)
    chosen = np.array(sorted(indices))
    ys, drives = trail.points.y[chosen], trail.points.drive[chosen]
    near, solved = fine.solve_each(ys, drives)
    change, far = np.abs(near - ys), 0.1 * max(1.0, scale)
    moved: Any = 0.0
    if not (solved.all() and change.max() <= far):
        moved = np.zeros(len(drives))
        _across(trail, fine, chosen, ~solved | (change.max(axis=1) > far), (ys, drives, change, moved, far))
    change[:, free:n] /= scale
    found: FloatArray = np.maximum(change[:, :n].max(axis=1), moved)
    return found


def _across(trail: Trail, fine: Solver, chosen: Any, lost: Any, arrays: tuple[Any, ...]) -> None:
    """Set the differences at points that have no equilibrium nearby at their own drive: where the path turns back."""
    ys, drives, change, moved, far = arrays
    n = trail.solver.n
    for k in np.flatnonzero(lost):
        border = trail.spot(int(chosen[k])).tangent
        level = float(border[:-1] @ ys[k, :n] + border[-1] * drives[k])
        across = fine.solve(ys[k], float(drives[k]), border, level)
        there = across is not None and np.abs(across.y - ys[k]).max() <= far
        change[k], moved[k] = np.inf, np.inf
        if there and across is not None:
            change[k], moved[k] = np.abs(across.y - ys[k]), abs(across.drive - drives[k])

"""Starts that are nearly rigid: beams that do not stretch, and are hardly bent, at rest under a drive by a motion.

Let a column be bent by a share a of its length. A shortening d then bends it further by d / (5 a) at first, and like
the root of d later on: the drive turns the corner within a^2, steps of 1e-9 of its range miss it, and without an
imperfection nothing moves. The force at the drive grows evenly meanwhile. So the path is entered by its arc length, in
which forces count, along the null vector of the tangent with the drive among the unknowns, and left to the drive where
it is gently curved.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.path_and_moves import Resume, Stop
from cfmkit.elastica.equilibrium.network_solver import FORCE_WEIGHT, Spot
from cfmkit.elastica.kernels.status_codes import DONE, LONG

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.path_and_moves import Move, PathProblem, Trail
    from cfmkit.elastica.equilibrium.network_solver import Points

_ENTRY = 1e-6
"""Share of the drive's range at which the drive takes over.

Steps are 1e-9 of it at least, so that a thousand of them fit in; columns come here that are bent by up to 1e-5 of their
length, whose corner lies within 1e-10 of it."""

_BEFORE = 0.5  # of the way to the first requested point, where that is nearer
_CROOKED = 1e-13
"""Change of poses in the first step that is one: 1e-9 for a column bent by 2e-7 of its length; rounding is 1e-16."""

_COARSE = 16  # segments of a beam below which shorter ones are tried: 4 bear the buckling load of a clamped column
_ROOM = 200  # points on the way: columns bent by 1e-8 of their length take 50
_FIRST = 0.02  # first step [rad or mean beam lengths]: that around limit points


def left(problem: PathProblem, trail: Trail, spot: Spot) -> Move | None:
    """Leave a start that is nearly rigid, near `spot`, by the arc length; None where it is none.

    Stop, for shorter segments, where they are too long for the force that bends them.
    """
    beams = problem.layout.network.beams.values()
    if problem.ramp or not trail.stretch.natural or trail.events or all(beam.section.axial for beam in beams):
        return None
    first = next(abs(target) for target in trail.stretch.targets.tolist() if target)
    goal = problem.sense * min(_ENTRY * problem.span, _BEFORE * first)
    if np.abs(trail.points.drive).max(initial=0.0) >= abs(goal):
        return None
    solver = problem.solver
    y = trail.points.y[0] if len(trail.points) else spot.y
    y = y if y.any() else solver.unstressed()
    null = _null(solver.tangent_at(y, 0.0), solver.n_free)
    for tangent in (null, -null):
        start = Spot(y, 0.0, tangent)
        options = problem.options(trail, start, _FIRST, longest=1.0)._replace(natural=False, inertia=None)
        code, points = solver.march(start, np.array([goal]), options, _ROOM)
        if not len(points) or solver.pose_change(points.y[0], y) < _CROOKED:
            continue
        if code == LONG and problem.mesh.segments < _COARSE:
            return Stop(trail.changed(ending=trail.ending._replace(too_long=True)))
        if code == DONE and points.drive[-1] == goal:
            return _entered(trail, start, points)
    return None


def _null(tangent: tuple[FloatArray, FloatArray], n_free: int) -> FloatArray:
    """Return the direction in which the unknowns and the drive change along the path, of unit arc length."""
    matrix = np.column_stack(tangent)
    weights = np.ones(matrix.shape[1])
    weights[n_free:-1] = np.sqrt(FORCE_WEIGHT)
    null: FloatArray = np.linalg.svd(matrix / weights)[2][-1] / weights
    return null


def _entered(trail: Trail, start: Spot, points: Points) -> Resume | None:
    """Go on by the drive from the last of the points along the arc; None where stability changed on the way."""
    if not (points.unstable == points.unstable[0]).all():
        return None
    last = points.take([-1])
    last.requested[0] = -1.0
    start = replace(start, unstable=int(points.unstable[0]))
    trail = trail.up_to(0).with_spot(start, 0 if trail.stretch.targets[0] == 0.0 else -1).with_points(last)
    spot = trail.spot(-1)
    return Resume(trail, spot, 0.5 * abs(spot.drive))

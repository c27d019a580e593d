"""Starts that are critical: prestress, loads or displacements end just where stability is lost.

There the tangent is singular, or so nearly that no step of the drive is short enough: a force across a column under its
critical load bends it like the cube root. The path is entered as a branch is, along the null vector, to the one side
that the drive leads to; or a little ahead, where the drive leads to neither.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.critical_points import Curvature, Singular, entered
from cfmkit.elastica.continuation.path_and_moves import PRIMARY, Resume
from cfmkit.elastica.equilibrium.mesh import LOADS
from cfmkit.elastica.equilibrium.network_solver import Spot
from cfmkit.elastica.outcome.path import Event

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.path_and_moves import PathProblem, Trail

_JUST = 1e-10  # share of the prestress or the constant loads that the start is just critical at
_NEAR = 1e-4  # share of the drive's range in which there is nothing but the start
_SIZES = (0.06 * 0.25 ** np.arange(4)).tolist()  # how far from the start the path is entered [rad]
_BEFORE = 0.9  # share of the way to the first requested point up to which it is
_STRAIGHT = 1e-3  # share of the way to the first requested point after which a path that goes straight on is met


def left(problem: PathProblem, trail: Trail, spot: Spot) -> Resume | None:
    """Leave a critical start, near `spot`, that no march got away from; None where that cannot be."""
    far = np.abs(trail.points.drive).max(initial=0.0) > _NEAR * problem.span
    if not _done_before(problem) or 0.0 in trail.pinned or far:
        return None
    fine, branch, targets = problem.fine, problem.control.branch, trail.stretch.targets
    start = trail.spot(0) if len(trail.points) else replace(spot, drive=0.0)
    goal = next(float(value) for value in targets if value)
    found = _sides(problem, start, goal)
    wide = found[0] or found[1]
    if wide is None or (all(found) and branch != "stable"):
        wide = fine.solve(fine.expand(start.y), _STRAIGHT * goal)
    if wide is None or (wide.unstable > 0 and branch != "primary"):
        return None
    near = trail.settled(fine.reduce(wide))
    if near is None:
        return None
    if trail.branch != PRIMARY and wide is not found[0]:
        trail = trail.with_event(Event("unresolved", 0.0, start.unstable, near.unstable)).changed(branch=PRIMARY)
    start = replace(start, unstable=min(start.unstable, near.unstable))
    # the start is the only point of the path so far: no mesh is near another there
    trail = trail.up_to(0).with_spot(start, 0 if targets[0] == 0.0 else -1).with_spot(near, -1)
    trail = trail.changed(pinned=(*trail.pinned, 0.0), closed=True)
    return Resume(trail, near, 0.5 * abs(near.drive))


def left_again(problem: PathProblem, trail: Trail) -> Resume | None:
    """Leave a critical start from which a march went straight on, unstable; None where it was not so."""
    control = problem.control
    if control.branch != "stable" or control.through_folds or not len(trail.points) or not trail.events:
        return None
    before = trail.events[-1]
    just = before.after > before.before and abs(before.drive - 1.0) <= _JUST and " under " in before.kind
    if not just or trail.points.unstable[0] == 0:
        return None
    only = trail.up_to(1)
    return left(problem, only, only.spot(0))


def _done_before(problem: PathProblem) -> bool:
    """Tell whether anything was done to a network before: one that is critical at rest is rigid, or loose."""
    network = problem.layout.network
    if problem.ramp:
        return problem.ramp == LOADS and bool(network.springs)
    return bool(network.springs or network.loads or problem.layout.held)


def _sides(problem: PathProblem, start: Spot, goal: float) -> list[Spot | None]:
    """Return equilibria on both sides of the start, before the first requested point, where the drive leads there.

    Both are equally far from it, as far as possible. The side that the control asks for comes first.
    """
    fine, control = problem.fine, problem.control
    y, most = fine.expand(start.y), start.unstable if control.branch == "primary" else 0
    curvature = Curvature(fine, y, 0.0)
    null = curvature.null(np.abs(curvature.values).argsort()[:1])
    at = Singular(Spot(y, 0.0, fine.unit), null, False, most, most)
    senses = (control.sign, -control.sign)
    for size in _SIZES:
        found = [entered(fine, at, sense * at.null, float(np.sign(goal)), (size,)) for sense in senses]
        found = [one if one is not None and abs(one.drive) < _BEFORE * abs(goal) else None for one in found]
        if any(found):
            return found
    return [None, None]

"""Branch switching: from a bifurcation to a stable equilibrium on a branch that opens there.

Where one mode is critical the branch is entered along its null vector
(`cfmkit.elastica.continuation.critical_points.leave`).
Where several are critical at once, or nearly so, many branches cross and most of them are unstable. Which one is stable
need not be known to get there: the path a little beyond is a saddle of the energy, and the way down from it, at a fixed
drive, ends on a stable branch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.critical_points import Curvature, leave
from cfmkit.elastica.continuation.path_and_moves import fine_spot

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import PathProblem, Trail
    from cfmkit.elastica.equilibrium.network_solver import Spot
    from cfmkit.elastica.equilibrium.uncondensed_solver import ExpandedSolver

_STEPS = 100  # on the way down at most: ten of the longest go as far as is near, the first ones are short
_KICK, _LONGEST = 1e-3, 0.05  # first and longest step along one mode [rad]
_FAR = 0.5  # change of a pose behind which an equilibrium is no more nearby [rad]
_STILL = 1e-6  # step to an equilibrium from where Newton's method gets there [rad]

_TOGETHER = (1e-3, 1e-4, 1e-2)  # shares of the drive's range within which bifurcations are near each other
_APART = 1e-4  # and from which they are met one by one
_BACK = (0.5, 0.1, 0.02)  # shares of the way back to the point before: either is located best from far away


def descend(solver: ExpandedSolver, saddle: Spot, sign: int) -> Spot | None:
    """Return a stable equilibrium below an unstable one, at the same drive; None if the way down leads far away.

    `sign` says to which side the saddle is left; the other sign leads to the mirror image in a symmetric network.
    """
    y, reach = saddle.y, _KICK
    for _ in range(_STEPS):
        here = Curvature(solver, y, saddle.drive)
        steps = here.down()
        if np.abs(steps).max() < _STILL:
            if here.values[0] > 0:
                return solver.solve(y, saddle.drive)
            steps = sign * _KICK * here.aside(np.flatnonzero(here.values < 0))
        y, reach = here.moved(np.clip(steps, -reach, reach)), min(2.0 * reach, _LONGEST)
        if solver.pose_change(y, saddle.y) > _FAR:
            return None
    return None


def first_of_several(problem: PathProblem, trail: Trail, found: Singular, one: Spot) -> tuple[Trail, Singular]:
    """Return the first of several bifurcations, if the others are well behind it, and the path up to between them."""
    advance = trail.drive - found.spot.drive
    between = _ahead(problem, trail, found, one, float(np.copysign(_APART * problem.span, advance)))
    if between is None or abs(advance) < _APART * problem.span or not found.before < between.unstable < found.after:
        return trail, found
    near = trail.settled(problem.fine.reduce(between))
    if near is None:
        return trail, found
    return trail.up_to(-1).with_spot(near, -1), found._replace(after=between.unstable)


def before_last_of_several(problem: PathProblem, trail: Trail, found: Singular, one: Spot) -> Trail | None:
    """Return the path up to just before the last of several bifurcations behind which fewer directions are unstable.

    None if the others are not well before it: they are met together.
    """
    way, change, least = one.drive - found.spot.drive, one.y - found.spot.y, _APART * problem.span
    for share in (*_BACK, least / abs(way) if abs(way) > 2.0 * least else 0.0):
        if abs(share * way) < least:
            break
        between = problem.fine.solve(found.spot.y + share * change, found.spot.drive + share * way)
        if between is not None and found.after < between.unstable < found.before:
            near = trail.settled(problem.fine.reduce(between))
            same = near is not None and near.unstable == between.unstable
            return trail.up_to(-1).with_spot(near, -1) if near is not None and same else None
    return None


def switched(
    problem: PathProblem, trail: Trail, found: Singular, one: Spot, forward: float
) -> tuple[Singular, Spot | None]:
    """Return an equilibrium on the stable branch behind a bifurcation on the fine mesh, or None.

    And the bifurcation, together with those that are so near that nothing is stable for long between them: from the
    path a little behind all of them the way down leads to the branch.
    """
    sign, fine = problem.control.sign, problem.fine
    if found.after - found.before == 1:
        wide = leave(fine, found, sign, forward)
        if wide is not None:
            return found, wide
    for share in _TOGETHER:
        saddle = _ahead(problem, trail, found, one, forward * share * problem.span)
        if saddle is None or saddle.unstable < max(found.before + 2, found.after):
            continue
        wide = descend(fine, saddle, sign)
        if wide is not None and wide.unstable <= found.before and _opens(fine, found, wide):
            return found._replace(after=saddle.unstable), wide
    return found, None


def _ahead(problem: PathProblem, trail: Trail, found: Singular, one: Spot, advance: float) -> Spot | None:
    """Return the equilibrium on the path so far behind a bifurcation, on the fine mesh."""
    start = well_before(problem, trail, found, abs(advance)) or one
    if start.drive == found.spot.drive:
        return None
    change = (found.spot.y - start.y) * (advance / (found.spot.drive - start.drive))
    return problem.fine.solve(found.spot.y + change, found.spot.drive + advance)


def _opens(fine: ExpandedSolver, found: Singular, wide: Spot) -> bool:
    """Tell whether an equilibrium is on a branch that opens at a bifurcation, like the root of the distance."""
    start = found.spot
    near = fine.solve(start.y + 0.5 * (wide.y - start.y), start.drive + 0.25 * (wide.drive - start.drive))
    if near is None or near.unstable != wide.unstable:
        return False
    return 0.3 < fine.pose_change(near.y, start.y) / fine.pose_change(wide.y, start.y) < 0.7


def well_before(problem: PathProblem, trail: Trail, found: Singular, room: float) -> Spot | None:
    """Return the last point but two or earlier that is so far before a bifurcation, on the fine mesh."""
    far = np.flatnonzero(np.abs(trail.points.drive[:-2] - found.spot.drive) >= room)
    return fine_spot(problem, trail, int(far[-1])) if len(far) else None

"""Down the energy at a fixed drive: from an unstable equilibrium to a stable one nearby.

Where several modes are critical at once, or nearly so, many branches cross and most of them are unstable. Which one
is stable need not be known to get there: the path a little beyond is a saddle of the energy, and the way down from it
ends on a stable branch.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.curvature import Curvature
from cfmkit.beams.events import leave

if TYPE_CHECKING:
    from cfmkit.beams.events import Singular
    from cfmkit.beams.expanded import ExpandedSolver
    from cfmkit.beams.run import Run
    from cfmkit.beams.solver import Spot

_STEPS = 100
_KICK, _LONGEST = 1e-3, 0.05  # first and longest step along one mode [rad]
_FAR = 0.5  # change of a pose behind which an equilibrium is no more nearby [rad]
_STILL = 1e-6  # step to an equilibrium from where Newton's method gets there [rad]

_TOGETHER = (1e-3, 1e-4, 1e-2)  # shares of the drive's range within which bifurcations are near each other
_APART = 1e-4  # and from which they are met one by one


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


def alone(run: Run, found: Singular, one: Spot) -> Singular:
    """Return the first of several bifurcations, if the others are well behind it; the last point is put between."""
    ahead = float(run.points.drive[-1]) - found.spot.drive
    between = _ahead(run, found, one, float(np.copysign(_APART * run.span, ahead)))
    if between is None or abs(ahead) < _APART * run.span or not found.before < between.unstable < found.after:
        return found
    near = run.settled(run.fine.reduce(between))
    if near is None:
        return found
    run.drop_last()
    run.append(run.as_points(near, -1))
    return replace(found, after=between.unstable)


def left_behind(run: Run, found: Singular, one: Spot, forward: float) -> tuple[Singular, Spot | None]:
    """Return an equilibrium on the stable branch behind a bifurcation on the fine mesh, or None.

    And the bifurcation, together with those that are so near that nothing is stable for long between them: from the
    path a little behind all of them the way down leads to the branch.
    """
    if found.after - found.before == 1:
        wide = leave(run.fine, found, run.control.sign, forward)
        if wide is not None:
            return found, wide
    for share in _TOGETHER:
        saddle = _ahead(run, found, one, forward * share * run.span)
        if saddle is None or saddle.unstable < max(found.before + 2, found.after):
            continue
        wide = descend(run.fine, saddle, run.control.sign)
        if wide is not None and wide.unstable <= found.before and _opens(run, found, wide):
            return replace(found, after=saddle.unstable), wide
    return found, None


def _ahead(run: Run, found: Singular, one: Spot, ahead: float) -> Spot | None:
    """Return the equilibrium on the path so far behind a bifurcation, on the fine mesh."""
    start = well_before(run, found, abs(ahead)) or one
    if start.drive == found.spot.drive:
        return None
    change = (found.spot.y - start.y) * (ahead / (found.spot.drive - start.drive))
    return run.fine.solve(found.spot.y + change, found.spot.drive + ahead)


def _opens(run: Run, found: Singular, wide: Spot) -> bool:
    """Tell whether an equilibrium is on a branch that opens at a bifurcation, like the root of the distance."""
    start = found.spot
    near = run.fine.solve(start.y + 0.5 * (wide.y - start.y), start.drive + 0.25 * (wide.drive - start.drive))
    if near is None or near.unstable != wide.unstable:
        return False
    return 0.3 < run.fine.pose_change(near.y, start.y) / run.fine.pose_change(wide.y, start.y) < 0.7


def well_before(run: Run, found: Singular, room: float) -> Spot | None:
    """Return the last point but two or earlier that is so far before a bifurcation, on the fine mesh."""
    far = np.flatnonzero(np.abs(run.points.drive[:-2] - found.spot.drive) >= room)
    return run.fine_spot(int(far[-1])) if len(far) else None

"""Paths through limit points: by the drive as far as it leads, by the arc length around a limit point and back.

Where the drive leads, a path through its limit points is the one that ends there, with the same bifurcations and
branches. From a limit point on, where a path is unstable as it is, it stays on its curve; what it meets there is
reported. Once the drive goes on and the path is as stable as before, the drive takes over again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.path_and_moves import Resume, Stretch
from cfmkit.elastica.equilibrium.network_solver import FORCE_WEIGHT
from cfmkit.elastica.kernels.status_codes import INERTIA

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.path_and_moves import Move, PathProblem, Trail
    from cfmkit.elastica.equilibrium.network_solver import Spot

_WELL = 1e-3  # share of the drive's range before a limit point at which the arc length takes over
_ROOM = 60  # points in which a limit point is found


def is_near(problem: PathProblem, trail: Trail) -> bool:
    """Tell whether a march by the drive stalled at a limit point: along the arc it turns back, stability is lost."""
    if not problem.control.through_folds:
        return False
    last = _well_before(problem, trail)
    spot = _along(problem, trail, last)
    options = problem.options(trail, spot, first_step(problem))._replace(natural=False, longest=1.0)
    code, points = trail.solver.march(spot, np.array([np.inf]), options, _ROOM)
    if code != INERTIA:
        return False
    changed = int(points.unstable[-1]) - trail.unstable(last)
    return bool(points.drive_rate[-1] * spot.tangent[-1] < 0.0) and changed % 2 == 1


def around(problem: PathProblem, trail: Trail) -> Resume:
    """Go on by the arc length, from a little before the last point."""
    trail = trail.up_to(_well_before(problem, trail) + 1)
    start, stop = one_way(problem.values.tolist(), trail.requested)
    stretch = trail.stretch._replace(
        natural=False,
        before_fold=trail.unstable(-1),
        targets=problem.values[:stop],
        first_requested=max(trail.stretch.first_requested, start),
    )
    trail = trail.changed(stretch=stretch)
    return Resume(trail, _along(problem, trail, -1))


def one_way(values: list[float], requested: int) -> tuple[int, int]:
    """Return the numbers of the points between which a drive from zero goes one way: of the one requested next."""
    start, last, before = 0, 0.0, 0.0
    for number, value in enumerate(values):
        step = value - last
        if step * before < 0.0:
            if number > requested:
                return start, number
            start = number
        last, before = value, step
    return start, len(values)


def by_the_drive(problem: PathProblem, trail: Trail, first: int, step: float = np.inf) -> Resume:
    """Let the drive take over again, with a requested point. What was found before does not hold."""
    stretch = Stretch(problem.values, True, first, len(trail.points) - 1, trail.stretch.before_fold)
    cleared = trail.changed(stretch=stretch, visited={}, again_at=np.nan, without_branch=None, closed=True, ends=())
    return Resume(cleared, cleared.spot(-1), step)


def first_step(problem: PathProblem) -> float:
    """Return the first step along the arc."""
    return 0.02 * min(problem.span, 1.0)


def back_to_the_drive(problem: PathProblem, move: Move) -> Move:
    """Let the drive take over again where it goes on towards its last point and the path is as stable as before."""
    trail = move.trail
    if not isinstance(move, Resume) or trail.stretch.natural or not trail.events:
        return move
    spot, targets = move.spot, trail.stretch.targets
    move = move._replace(step=_last_step(trail))  # a longer one might lead to another path
    if spot.unstable > trail.stretch.before_fold:
        return move
    if spot.tangent[-1] * (targets[-1] - spot.drive) <= 0.0:
        return move
    passed = trail.events[-1].drive / problem.unit
    left = np.abs(targets - passed)[(targets - passed) * spot.tangent[-1] > 0.0]
    reach = min(_WELL * problem.span, 0.5 * float(left.min(initial=np.inf)))
    clear = _clear_of(problem, move, passed, reach)
    if clear is None:
        return move
    place = clear.spot.drive
    return by_the_drive(problem, clear.trail, _next(clear.trail, place), 0.5 * abs(place - passed))


def _last_step(trail: Trail) -> float:
    """Return the length of the last step along the arc; the length since a march began is stored with its points."""
    lengths = trail.points.reached[trail.points.reached >= 0.0][-2:]
    return float(lengths[1] - lengths[0] if lengths[1] > lengths[0] else lengths[1])


def _clear_of(problem: PathProblem, move: Resume, place: float, reach: float) -> Resume | None:
    """Go on so far behind a limit point that a march by the drive may start from there; None if there is no point."""
    trail, spot = move.trail, move.spot
    if abs(spot.drive - place) >= reach:
        return move
    options = problem.options(trail, spot, min(reach, move.step))
    along = options._replace(natural=False, longest=first_step(problem))
    _, points = trail.solver.march(spot, np.array([np.inf]), along, _ROOM)
    away = np.abs(points.drive - place)
    found = np.flatnonzero((away >= reach) & (away < 2.0 * reach) & (points.unstable == spot.unstable))
    if not len(found):
        return None
    trail = trail.with_points(points.take([found[0]]))
    return Resume(trail, trail.spot(-1))


def fine_spots(problem: PathProblem, trail: Trail, first: int) -> tuple[Spot | None, Spot | None]:
    """Return a point and the last one on the fine mesh, solved for along the chord between them.

    Near a limit point there may be none at the same drive.
    """
    fine, drives = problem.fine, trail.points.drive[[first, -1]].tolist()
    one, other = (fine.expand(trail.points.y[k]) for k in (first, -1))
    weights = np.where(np.arange(fine.n) < fine.n_free, 1.0, FORCE_WEIGHT)
    border = np.append(weights * (other - one)[: fine.n], drives[1] - drives[0])
    found = []
    for y, drive in zip((one, other), drives, strict=True):
        found.append(fine.solve(y, drive, border, float(border[:-1] @ y[: fine.n] + border[-1] * drive)))
    return found[0], found[1]


def _next(trail: Trail, place: float) -> int:
    """Return the number of the next requested point ahead of a place; those that were passed before are done again."""
    targets = trail.stretch.targets
    ahead = (targets - place) * (targets[-1] - place) > 0.0
    ahead[: trail.stretch.first_requested] = False
    return int(ahead.argmax())


def _along(problem: PathProblem, trail: Trail, index: int) -> Spot:
    """Return a point with its tangent in the sense of the drive."""
    spot = trail.spot(index)
    _, stop = one_way(problem.values.tolist(), trail.requested)
    return replace(spot, tangent=spot.tangent * np.sign(problem.values[stop - 1] - spot.drive))


def _well_before(problem: PathProblem, trail: Trail) -> int:
    """Return the index of a point a little before the last; nothing was requested or happened between."""
    points, drives = trail.points, trail.points.drive
    index = len(points) - 1
    while index > trail.stretch.begun and abs(drives[index] - drives[-1]) < _WELL * problem.span:
        same = trail.branches[index - 1] == trail.branch and points.unstable[index - 1] == points.unstable[-1]
        if points.requested[index] >= 0 or not same:
            break
        index -= 1
    return index

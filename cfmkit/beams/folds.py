"""Paths through limit points: by the drive as far as it leads, by the arc length around a limit point and back.

Where the drive leads, a path through its limit points is the one that ends there, with the same bifurcations and
branches. From a limit point on, where a path is unstable as it is, it stays on its curve; what it meets there is told.
Once the drive goes on and the path is as stable as before, the drive takes over again.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.kernels.codes import INERTIA
from cfmkit.beams.solver import FORCE_WEIGHT, LONGEST, NATURAL

if TYPE_CHECKING:
    from cfmkit.beams.run import Run
    from cfmkit.beams.solver import Spot

_WELL = 1e-3  # share of the drive's range before a limit point at which the arc length takes over
_ROOM = 60  # points in which a limit point is found


def near(run: Run) -> bool:
    """Tell whether a march by the drive stalled at a limit point: along the arc it turns back, stability is lost."""
    if not run.control.through_folds:
        return False
    last = _well_before(run)
    spot = _along(run, last)
    options = run.options(spot, first_step(run))
    options[NATURAL], options[LONGEST] = 0.0, 1.0
    code, points = run.solver.march(spot, np.array([np.inf]), options, _ROOM)
    if code != INERTIA:
        return False
    changed = int(points.info[-1, 0]) - int(run.points.info[last, 0])
    return bool(points.info[-1, 4] * spot.tangent[-1] < 0.0) and changed % 2 == 1


def follow(run: Run) -> Spot:
    """Go on by the arc length, from a little before the last point."""
    last = _well_before(run)
    while len(run.points) - 1 > last:
        run.drop_last()
    run.natural, run.before_fold = False, int(run.points.info[-1, 0])
    start, stop = stretch(run.values.tolist(), run.asked())
    run.targets, run.first_asked = run.values[:stop], max(run.first_asked, start)
    return _along(run, -1)


def stretch(values: list[float], asked: int) -> tuple[int, int]:
    """Return the numbers of the points between which a drive from zero goes one way: of the one asked for next."""
    start, last, before = 0, 0.0, 0.0
    for number, value in enumerate(values):
        step = value - last
        if step * before < 0.0:
            if number > asked:
                return start, number
            start = number
        last, before = value, step
    return start, len(values)


def turn(run: Run, first: int) -> Spot:
    """Let the drive take over again, with a point asked for; return where from. What was found before does not hold."""
    run.first_asked, run.begun, run.visited, run.again_at = first, len(run.points) - 1, Counter(), np.nan
    run.natural, run.without_branch, run.entry, run.closed, run.ends = True, None, np.inf, True, ()
    run.targets = run.values
    return run.spot(-1)


def first_step(run: Run) -> float:
    """Return the first step along the arc."""
    return 0.02 * min(run.span, 1.0)


def resumed(run: Run, spot: Spot | None) -> Spot | None:
    """Let the drive take over again where it goes on towards its last point and the path is as stable as before."""
    if spot is None or run.natural or not run.events:
        return spot
    run.entry = _last_step(run)  # a longer one might lead to another path
    if spot.unstable > run.before_fold:
        return spot
    if spot.tangent[-1] * (run.targets[-1] - spot.drive) <= 0.0:
        return spot
    passed = run.events[-1].drive / run.unit
    left = np.abs(run.targets - passed)[(run.targets - passed) * spot.tangent[-1] > 0.0]
    reach = min(_WELL * run.span, 0.5 * float(left.min(initial=np.inf)))
    clear = _clear_of(run, spot, passed, reach)
    if clear is None:
        return spot
    again = turn(run, _next(run, clear.drive))
    run.entry = 0.5 * abs(clear.drive - passed)
    return again


def _last_step(run: Run) -> float:
    """Return the length of the last step along the arc; the length since a march began is stored with its points."""
    lengths = run.points.info[run.points.info[:, 2] >= 0.0, 2][-2:]
    return float(lengths[1] - lengths[0] if lengths[1] > lengths[0] else lengths[1])


def _clear_of(run: Run, spot: Spot, place: float, reach: float) -> Spot | None:
    """Return a point so far behind a limit point that a march by the drive may start from it; None if there is none."""
    if abs(spot.drive - place) >= reach:
        return spot
    options = run.options(spot, min(reach, run.entry))
    options[NATURAL], options[LONGEST] = 0.0, first_step(run)
    _, points = run.solver.march(spot, np.array([np.inf]), options, _ROOM)
    away = np.abs(points.drive - place)
    found = np.flatnonzero((away >= reach) & (away < 2.0 * reach) & (points.info[:, 0] == spot.unstable))
    if not len(found):
        return None
    run.append(points.take([found[0]]))
    return run.spot(-1)


def fine_spots(run: Run, first: int) -> tuple[Spot | None, Spot | None]:
    """Return a point and the last one on the fine mesh, solved for along the chord between them.

    Near a limit point there may be none at the same drive.
    """
    fine, drives = run.fine, run.points.drive[[first, -1]].tolist()
    one, other = (fine.expand(run.points.y[k]) for k in (first, -1))
    weights = np.where(np.arange(fine.n) < fine.n_free, 1.0, FORCE_WEIGHT)
    border = np.append(weights * (other - one)[: fine.n], drives[1] - drives[0])
    found = []
    for y, drive in zip((one, other), drives, strict=True):
        found.append(fine.solve(y, drive, border, float(border[:-1] @ y[: fine.n] + border[-1] * drive)))
    return found[0], found[1]


def _next(run: Run, place: float) -> int:
    """Return the number of the next point asked for ahead of a place; those that were passed before are done again."""
    ahead = (run.targets - place) * (run.targets[-1] - place) > 0.0
    ahead[: run.first_asked] = False
    return int(ahead.argmax())


def _along(run: Run, index: int) -> Spot:
    """Return a point with its tangent in the sense of the drive."""
    spot = run.spot(index)
    _, stop = stretch(run.values.tolist(), run.asked())
    spot.tangent *= np.sign(run.values[stop - 1] - spot.drive)
    return spot


def _well_before(run: Run) -> int:
    """Return the index of a point a little before the last; nothing was asked for or happened between."""
    index, info, drives = len(run.points) - 1, run.points.info, run.points.drive
    while index > run.begun and abs(drives[index] - drives[-1]) < _WELL * run.span:
        same = run.branches[index - 1] == run.branch and info[index - 1, 0] == info[-1, 0]
        if info[index, 1] >= 0 or not same:
            break
        index -= 1
    return index

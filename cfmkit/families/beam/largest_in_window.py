"""Largest of some values along a path of equilibria in a window: an extreme between points is solved for, not sampled.

Where a cubic through the points may be higher than all of them, the equilibrium is solved for and looked at, and the
cubic is drawn again; so are the ends of the window and corners of the path.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import distinct
from cfmkit.metrics.branches import places_inside
from cfmkit.numerics.interpolation import inner_extremes, values_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.elastica.results.folding_path_between_points import AlongTheWay
    from cfmkit.families.beam.solution import Solution

N_EXTREME_ROUNDS = 4
"""Extremes are solved for, and looked for again with what was found: the last moves them by less than 1e-9."""
CANDIDATE_SHARE, MIN_RISE_SHARE = 0.05, 1e-10
"""Shares of a row's range: how much too low the first cubic may be, and what a later one is to add to count."""
MAX_MEDIAN_RATIO = 1e6
"""Values so many times as large as the middle one are in no cubic: a straight beam is nearly rigid lengthwise."""
PLACE_RTOL = 1e-12  # share of the largest place within which two places are one
WINDOW_SLACK = 1e-9
"""Share of the range of motion by which the ends of a window, where they were looked for, may be beside it."""


def largest(
    solution: Solution,  # a solved mechanism
    # from equilibria to rows of values that are smooth along the path, (rows, points); NaN where there is none
    observe: Callable[[Path], FloatArray],
    window: tuple[float, float],  # [m or rad]
) -> float | None:
    """Return the largest of some values along a path, where its motion is in a window; None if there is none."""
    path, law, winding = solution.path, solution.model_between_points, solution.winding
    points = solution.replace_path(path)
    rows, reached = observe(path), points.motion
    ask: Callable[[FloatArray], Path]
    if law is not None:
        order = np.argsort(reached)
        x, rows = reached[order], rows[:, order]
        wanted, ask = np.array([*np.clip(window, x[0], x[-1]), *law.corners]), law.solve_at
    elif winding is not None:
        x, wanted, ask = winding.arc, _arcs(winding, places_inside(winding, *window)), partial(_solve_lengths, winding)
    else:
        return _top(rows, points.accurate & _find_in_window(reached, window))
    top = None
    for number in range(N_EXTREME_ROUNDS):
        wanted = wanted[np.abs(wanted[:, None] - x).min(axis=1) > PLACE_RTOL * np.abs(x).max()]
        if len(wanted):
            poses = ask(wanted)
            solved = np.flatnonzero(poses.accurate)
            places = np.searchsorted(x, wanted[solved])
            x = np.insert(x, places, wanted[solved])
            rows = np.insert(rows, places, observe(poses)[:, solved], axis=1)
        reached = x if winding is None else winding.states(_ways(winding, x))[0]
        top = _top(rows, _find_in_window(reached, window))
        if top is None:
            break
        # what was missed by little is looked at once; then only what is higher is
        bounds = [
            top - (CANDIDATE_SHARE if number == 0 else -MIN_RISE_SHARE) * float(np.ptp(row[np.isfinite(row)]))
            for row in rows
        ]
        wanted = distinct(np.concatenate([_higher(x, row, bound) for row, bound in zip(rows, bounds, strict=True)]))
        if not len(wanted):
            break
    return top


def _arcs(winding: AlongTheWay, ways: FloatArray) -> FloatArray:
    """Return the lengths of the way at some of its places: over them values are smooth."""
    return np.asarray(np.interp(ways, np.arange(float(len(winding.arc))), winding.arc))


def _ways(winding: AlongTheWay, arcs: FloatArray) -> FloatArray:
    """Return the places at which the way has some lengths."""
    return np.asarray(np.interp(arcs, winding.arc, np.arange(float(len(winding.arc)))))


def _solve_lengths(winding: AlongTheWay, arcs: FloatArray) -> Path:
    """Return the equilibria after some lengths of the way."""
    return winding.solve_at(_ways(winding, arcs))


def _find_in_window(motion: FloatArray, window: tuple[float, float]) -> FloatArray:
    """Return which places are in a window, (n,) of bool."""
    slack = WINDOW_SLACK * float(np.ptp(motion)) if len(motion) else 0.0
    return np.asarray((motion >= window[0] - slack) & (motion <= window[1] + slack))


def _top(rows: FloatArray, kept: FloatArray) -> float | None:
    """Return the largest value of some columns, None without any."""
    values = rows[:, kept]
    finite = values[np.isfinite(values)]
    return float(finite.max()) + 0.0 if len(finite) else None  # not -0


def _higher(x: FloatArray, row: FloatArray, bound: float) -> FloatArray:
    """Return where the cubics between values have extremes above a bound."""
    size = np.abs(row)
    finite = np.sort(size[np.isfinite(size)])
    regular = size <= MAX_MEDIAN_RATIO * finite[len(finite) // 2]  # np.median would load numpy.ma
    regular[1:] &= np.diff(x) > 0.0  # a straight column does not move under a load
    x, row = x[regular], row[regular]
    places = inner_extremes(x, row)
    return places[values_at(x, row, places) > bound] if len(places) else places

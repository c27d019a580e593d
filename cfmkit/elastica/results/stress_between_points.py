"""Knots of the stress of each beam between the points of a path: its extremes, and where it passes a limit.

They are solved for: a cubic through the points alone has errors where the stress of a beam turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.numerics.cubic_interpolation import crossings, inner_extremes, values_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Knots = tuple[FloatArray, FloatArray]  # places, increasing, and stresses of one beam
    Solve = Callable[[FloatArray], tuple[FloatArray, Any]]

ROUNDS = 3
"""Extremes are solved for, and looked for again with what was found: the third moves them by less than rounding."""

NEARLY = 0.9
"""Share of the largest stress of all beams from which on an extreme of one beam may be the largest."""

N_FEW = 24  # points that are looked at first
CLOSE = 0.95  # share of the largest stress at these from which on the largest of all may be near
STENCIL = 4  # points on either side that a cubic, or the next one, may go through


def solve_extremes(t: FloatArray, rows: FloatArray, solve: Solve) -> tuple[Knots, ...]:
    """Return places and stresses of each beam, with extremes that may be the largest of all.

    Parameters
    ----------
    t, rows : (n,), (b, n) arrays
        Places of points, increasing, and the stress of each of b beams there [Pa].
    solve : callable
        From places (m,) to stresses (b, m) and whether they were found, (m,).
    """
    largest = rows.max(axis=0)
    found = [(t, row) for row in rows]
    for _ in range(ROUNDS):
        more = [_find_tops(knots, t, largest) for knots in found]
        if not any(map(len, more)):
            break
        found = _add_solved(solve, found, found, more)
    return tuple(found)


def largest_inside(x: FloatArray, stresses: Callable[[Any], FloatArray], solve: Solve, window: FloatArray) -> float:
    """Return the largest stress of all beams at and between points of a smooth path inside of a window [Pa].

    The stress is computed at few points first; then at all of those near which it may be the largest.

    Parameters
    ----------
    x : (n,) array
        Places of the points, increasing.
    stresses : callable
        From numbers of points to the stress of each of b beams there, (b, m) [Pa].
    solve : callable
        As of `solve_extremes`.
    window : (2,) array
        Minus infinity is returned if no point and no extreme between two is inside.
    """
    few = few_points(x, *window)
    known = stresses(few)
    more = near_largest(x, few, known, *window)
    if len(more):
        few = np.concatenate([few, more])
        known = np.concatenate([known, stresses(more)], axis=1)
        order = np.argsort(few, kind="stable")
        few, known = few[order], known[:, order]
    return largest_between(x, few, known, solve, window)


def few_points(x: FloatArray, low: float, high: float) -> NDArray[np.intp]:
    """Return the numbers of points of a path that are looked at first, in a window and next to it."""
    first = max(int(np.searchsorted(x, low)) - STENCIL, 0)
    last = min(int(np.searchsorted(x, high, side="right")) + STENCIL, len(x)) - 1
    return np.append(np.arange(first, last, max(1, (last - first) // N_FEW)), last)


def near_largest(
    x: FloatArray, few: NDArray[np.intp], stresses: FloatArray, low: float, high: float
) -> NDArray[np.intp]:
    """Return which other points are near the largest stress, from the stresses (b, m) at few of them."""
    first, last = int(few[0]), int(few[-1])
    inside = (x[few] >= low) & (x[few] <= high)
    top = stresses[:, inside].max(initial=0.0)
    guess = values_at(x[few], stresses.T, x[first : last + 1]).max(axis=1)
    near = first + np.flatnonzero(guess >= CLOSE * top)
    wanted = np.zeros(len(x), dtype=bool)
    for step in range(-STENCIL, STENCIL + 1):
        wanted[np.clip(near + step, first, last)] = True
    wanted[few] = False
    return np.flatnonzero(wanted)


def largest_between(
    x: FloatArray, points: NDArray[np.intp], stresses: FloatArray, solve: Solve, window: FloatArray
) -> float:
    """Return the largest stress at points in a window, and between neighbours among them, which is solved for [Pa]."""
    low, high = window
    inside = (x[points] >= low) & (x[points] <= high)
    largest = stresses[:, inside].max(initial=-np.inf)
    for own in np.split(np.arange(len(points)), np.flatnonzero(np.diff(points) > 1) + 1):
        rows = np.flatnonzero(stresses[:, own].max(axis=1) >= CLOSE * largest)
        if len(rows) and len(own) > STENCIL:

            def solve_rows(places: FloatArray, rows: Any = rows) -> tuple[FloatArray, Any]:
                found, accurate = solve(places)
                return found[rows], accurate

            for places, values in solve_extremes(x[points[own]], stresses[np.ix_(rows, own)], solve_rows):
                largest = max(largest, values[(places >= low) & (places <= high)].max(initial=-np.inf))
    return float(largest)


def solve_passes(knots: tuple[Knots, ...], t: FloatArray, solve: Solve, allowed: float) -> tuple[Knots, ...]:
    """Return knots of each beam with the places where its stress passes the allowable one [Pa].

    They are those of the last of some rounds only: knots that nearly coincide spoil a cubic.
    """
    found = list(knots)
    for _ in range(ROUNDS):
        more = [_find_passes(own, allowed, t) for own in found]
        if not any(map(len, more)):
            break
        found = _add_solved(solve, found, list(knots), more)
    return tuple(found)


def _find_tops(knots: Knots, t: FloatArray, largest: FloatArray) -> FloatArray:
    """Return where the stress of a beam has an extreme that may be the largest of all."""
    own, values = knots
    top = inner_extremes(own, values)
    beside = np.searchsorted(own, top)
    return top[np.maximum(values[beside - 1], values[beside]) >= NEARLY * np.interp(top, t, largest)]


def _find_passes(knots: Knots, allowed: float, known: FloatArray) -> FloatArray:
    """Return where the stress of a beam passes the allowable one, but for known places."""
    return np.array(sorted({*crossings(*knots, allowed)} - {*known.tolist()}))


def _add_solved(
    solve: Solve,
    cubics: list[Knots],
    knots: list[Knots],
    more: list[FloatArray],
) -> list[Knots]:
    """Return the knots of each beam with more places: stresses there are solved, or on its cubic where that fails."""
    stresses, accurate = solve(np.concatenate(more))
    found: list[Knots] = []
    end = 0
    for own, cubic, places, row in zip(knots, cubics, more, stresses, strict=True):
        mine = slice(end, end := end + len(places))
        stress = row[mine]
        if not accurate[mine].all():
            stress = np.where(accurate[mine], stress, values_at(*cubic, places))
        found.append(insert_knots(*own, places, stress) if len(places) else cubic)
    return found


def insert_knots(x: FloatArray, y: FloatArray, places: FloatArray, values: FloatArray) -> Knots:
    """Return increasing places with some more among them, and their values."""
    at = np.searchsorted(x, places)
    return np.insert(x, at, places), np.insert(y, at, values)

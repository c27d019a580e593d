"""Extremes of the stress of each beam between the points of an equilibrium path, and where it passes a limit.

A cubic through the points alone is wrong where the stress of a beam has an extreme, so the equilibrium is solved there.
The places and stresses of a beam, with those solved ones inserted, are called its knots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.numerics.cubic_interpolation import crossings, inner_extremes_of_rows, values_at

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Knots = tuple[FloatArray, FloatArray]  # places, increasing, and stresses of one beam
    Solve = Callable[[FloatArray], tuple[FloatArray, Any]]

N_EXTREME_ROUNDS = 3  # rounds in which extremes are located and solved for: the third moves them by less than rounding
CANDIDATE_SHARE = 0.9
"""Share of the largest stress of all beams from which on an extreme of one beam may be the largest."""
N_FIRST_POINTS = 24  # points at which the stress is computed first
NEIGHBOUR_SHARE = 0.95  # share of the largest stress at these from which on the largest of all may be near
STENCIL_REACH = 4  # points on either side that a cubic, or the next one, may go through


def solve_extremes(
    # t, rows: (n,), (b, n): places of points, increasing, and the stress of each of b beams there [Pa]
    t: FloatArray,
    rows: FloatArray,
    solve: Solve,  # from places (m,) to stresses (b, m) and whether they were found, (m,)
    bound: float = 0.0,  # beams that are stressed less at all points are left as they are [Pa]
) -> tuple[Knots, ...]:
    """Return places and stresses of each beam, with extremes that may be the largest of all."""
    return solve_all_extremes([(t, rows, bound)], lambda places: [solve(places[0])])[0]


def solve_all_extremes(
    curves: Sequence[tuple[FloatArray, FloatArray, float]],
    solve: Callable[[list[FloatArray]], list[tuple[FloatArray, Any]]],
) -> list[tuple[Knots, ...]]:
    """Return the results of `solve_extremes` for several curves; `solve` takes places, or none, of each in one call."""
    knots_by_curve = [[(t, row) for row in rows] for t, rows, _ in curves]
    largest = [rows.max(axis=0) for _, rows, _ in curves]
    for _ in range(N_EXTREME_ROUNDS):
        stressed = [
            [
                beam_knots if beam_knots[1].max() >= bound else (beam_knots[0][:0], beam_knots[1][:0])
                for beam_knots in knots
            ]
            for knots, (_, _, bound) in zip(knots_by_curve, curves, strict=True)
        ]
        places = iter(inner_extremes_of_rows([beam_knots for knots in stressed for beam_knots in knots]))
        more = [
            [_keep_tops(beam_knots, next(places), t, top) for beam_knots in knots]
            for knots, (t, _, _), top in zip(knots_by_curve, curves, largest, strict=True)
        ]
        if not any(len(places) for places_by_beam in more for places in places_by_beam):
            break
        solved = solve([np.concatenate(places_by_beam) for places_by_beam in more])
        knots_by_curve = [
            _add_solved(knots, knots, places_by_beam, *answer) if any(map(len, places_by_beam)) else knots
            for knots, places_by_beam, answer in zip(knots_by_curve, more, solved, strict=True)
        ]
    return [tuple(knots) for knots in knots_by_curve]


def largest_inside(
    x: FloatArray,  # (n,): places of the points, increasing
    stresses: Callable[[Any], FloatArray],  # from numbers of points to the stress of each of b beams there, (b, m) [Pa]
    solve: Solve,  # as of `solve_extremes`
    window: FloatArray,  # (2,): minus infinity is returned if no point and no extreme between two is inside
) -> float:
    """Return the largest stress of all beams at and between points of a smooth path inside of a window [Pa].

    The stress is computed at few points first; then at all of those near which it may be the largest.
    """
    few = choose_few_points(x, *window)
    known_stresses = stresses(few)
    more = find_near_largest(x, few, known_stresses, *window)
    if len(more):
        few = np.concatenate([few, more])
        known_stresses = np.concatenate([known_stresses, stresses(more)], axis=1)
        order = np.argsort(few, kind="stable")
        few, known_stresses = few[order], known_stresses[:, order]
    return largest_between(x, few, known_stresses, solve, window)


def choose_few_points(x: FloatArray, low: float, high: float) -> NDArray[np.intp]:
    """Return the numbers of points at which the stress is computed first, in a window and next to it."""
    first = max(int(np.searchsorted(x, low)) - STENCIL_REACH, 0)
    last = min(int(np.searchsorted(x, high, side="right")) + STENCIL_REACH, len(x)) - 1
    return np.append(np.arange(first, last, max(1, (last - first) // N_FIRST_POINTS)), last)


def find_near_largest(
    x: FloatArray, few: NDArray[np.intp], stresses: FloatArray, low: float, high: float
) -> NDArray[np.intp]:
    """Return which other points are near the largest stress, from the stresses (b, m) at few of them."""
    first, last = int(few[0]), int(few[-1])
    inside = (x[few] >= low) & (x[few] <= high)
    top = stresses[:, inside].max(initial=0.0)
    guess = values_at(x[few], stresses.T, x[first : last + 1]).max(axis=1)
    nearby = first + np.flatnonzero(guess >= NEIGHBOUR_SHARE * top)
    wanted = np.zeros(len(x), dtype=bool)
    for step in range(-STENCIL_REACH, STENCIL_REACH + 1):
        wanted[np.clip(nearby + step, first, last)] = True
    wanted[few] = False
    return np.flatnonzero(wanted)


def largest_between(
    x: FloatArray, points: NDArray[np.intp], stresses: FloatArray, solve: Solve, window: FloatArray
) -> float:
    """Return the largest stress at points in a window, and between neighbours among them, which is solved for [Pa]."""
    runs = runs_of_points(x, points, stresses, window)
    return largest_of_runs(
        x, points, stresses, window, [solve_extremes(t, rows, solve, bound) for t, rows, bound in runs]
    )


def runs_of_points(
    x: FloatArray, points: NDArray[np.intp], stresses: FloatArray, window: FloatArray
) -> list[tuple[FloatArray, FloatArray, float]]:
    """Return places and stresses (b, n) of neighbouring points between which the largest may be, and a bound to it."""
    inside = (x[points] >= window[0]) & (x[points] <= window[1])
    bound = NEIGHBOUR_SHARE * stresses[:, inside].max(initial=-np.inf)
    parts = np.split(np.arange(len(points)), np.flatnonzero(np.diff(points) > 1) + 1)
    runs = [(x[points[part]], stresses[:, part], bound) for part in parts if len(part) > 3]
    return [run for run in runs if run[1].max() >= bound]


def largest_of_runs(
    x: FloatArray, points: NDArray[np.intp], stresses: FloatArray, window: FloatArray, runs: Sequence[Sequence[Knots]]
) -> float:
    """Return the largest stress inside of a window, of points and of runs whose extremes are known [Pa]."""
    at_points = [(x[points], row) for row in stresses]
    every = [*at_points, *(knots for run in runs for knots in run)]
    tops = (y[(t >= window[0]) & (t <= window[1])].max(initial=-np.inf) for t, y in every)
    return float(max(tops))


def solve_passes(knots: tuple[Knots, ...], t: FloatArray, solve: Solve, allowed: float) -> tuple[Knots, ...]:
    """Return knots of each beam with the places where its stress passes the allowable one [Pa].

    They are those of the last of some rounds only: knots that nearly coincide spoil a cubic.
    """
    found = list(knots)
    for _ in range(N_EXTREME_ROUNDS):
        more = [_find_passes(own, allowed, t) for own in found]
        if not any(map(len, more)):
            break
        found = _add_solved(found, list(knots), more, *solve(np.concatenate(more)))
    return tuple(found)


def _keep_tops(knots: Knots, top: FloatArray, t: FloatArray, largest: FloatArray) -> FloatArray:
    """Return those of the extremes of the stress of a beam that may be the largest of all."""
    own, values = knots
    beside = np.searchsorted(own, top)
    return top[np.maximum(values[beside - 1], values[beside]) >= CANDIDATE_SHARE * np.interp(top, t, largest)]


def _find_passes(knots: Knots, allowed: float, known: FloatArray) -> FloatArray:
    """Return where the stress of a beam passes the allowable one, but for known places."""
    return np.array(sorted({*crossings(*knots, allowed)} - {*known.tolist()}))


def _add_solved(
    cubics: list[Knots], knots: list[Knots], more: list[FloatArray], stresses: FloatArray, accurate: Any
) -> list[Knots]:
    """Return the knots of each beam with more places: stresses as solved, or on its cubic where that failed."""
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

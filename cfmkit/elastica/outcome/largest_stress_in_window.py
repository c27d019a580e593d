"""The largest stress of a smooth path in a window: found without the stress of every beam at every point.

Samples along the beams tell at once which beams at which points can hold the largest stress. For those alone the
stress is solved for, between points only where the cubic through them may be higher than what is known.

Assumes: a path that does not turn back, without corners, all of whose points reach the tolerance.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.outcome.largest_stress_along_beam import extremes
from cfmkit.numerics.cubic_interpolation import inner_extremes, values_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.path import Path

UNSURE = 1e-3
"""Share of the largest stress by which a parabola through three samples along a beam may be too low at least; at most
by as much as it is above its samples."""

BETWEEN = 0.5
"""Share of the second difference of three points by which the stress beside them may be higher than at them: of a
parabola through evenly spaced points it is an eighth."""

MARGIN = 3
"""Points on either side of those for which the stress is solved for, too: cubics go through four."""

ROUNDS, NEARLY, RISE = 3, 0.05, 1e-10
"""Extremes are looked for again with what was found; by which shares of a row's range the first cubic may be too low,
and a later one is to add to count."""

SLACK = 1e-12
"""Share of the range of motion within which a place is that of a point."""


def largest_stress(
    path: Path, motion: FloatArray, at: Callable[[FloatArray], Path], axial: bool, window: tuple[float, float]
) -> float:
    """Return the largest stress of all beams in a window [Pa].

    Parameters
    ----------
    path : Path
        Equilibria.
    motion : (n,) array
        The place of each, increasing or decreasing [m or rad].
    at : callable
        From places (n,) [m or rad] to the equilibria there.
    axial : bool
        Whether the stress has its axial part.
    window : (float, float)
        In the range of the path [m or rad].
    """
    order = np.arange(len(path))[:: 1 if motion[-1] > motion[0] else -1]
    motion = motion[order]
    slack = SLACK * float(motion[-1] - motion[0])
    low, high = window
    before, behind = int(np.searchsorted(motion, low + slack)) - 1, int(np.searchsorted(motion, high - slack))
    near = np.arange(max(0, before), min(behind + 1, len(motion)))
    ends = np.array([end for end in (low, high) if np.abs(motion - end).min() > slack])
    best = _largest_at(at(ends), axial) if len(ends) else 0.0
    own = np.arange(max(0, near[0] - MARGIN), min(near[-1] + MARGIN + 1, len(motion)))
    x = motion[own]
    within = (x >= low - slack) & (x <= high + slack)
    some = order[own]
    near_by = replace(path, points=path.points.take(some), branch=path.branch[some], accurate=path.accurate[some])
    rows = _stresses(near_by, axial, (own >= near[0]) & (own <= near[-1]), within, best)
    best = float(np.nanmax(rows[:, within], initial=best))
    for name, row in zip(path.layout.network.beams, rows, strict=True):
        known = np.isfinite(row)
        for part in np.split(np.arange(len(x)), np.flatnonzero(known[1:] != known[:-1]) + 1):
            if known[part[0]]:
                best = max(best, _between(at, name, axial, (x[part], row[part]), window, best))
    return best


def _largest_at(path: Path, axial: bool) -> float:
    """Return the largest stress of all beams at all points [Pa]."""
    return max(float(path.beam_stress(name, axial)[0].max()) for name in path.layout.network.beams)


def _stresses(path: Path, axial: bool, near: NDArray[np.bool_], within: NDArray[np.bool_], known: float) -> FloatArray:
    """Return the stress of each beam at points (beams, n) [Pa].

    NaN where it is not solved for: neither there nor beside it the stress can be the largest in the window.

    Parameters
    ----------
    path : Path
        Points in the order of increasing motion.
    axial : bool
        Whether the stress has its axial part.
    near, within : (n,) array of bool
        Points in the window or next to it, and those in it.
    known : float
        A stress that occurs in the window [Pa].
    """
    sampler, names = path.sampler, path.layout.network.beams
    sampled, estimated = (
        np.array(rows) for rows in zip(*(_estimates(path, name, axial) for name in names), strict=True)
    )
    best = float(estimated[:, within].max(initial=known))
    bend = np.pad(BETWEEN * np.abs(np.diff(estimated, 2, axis=1)), ((0, 0), (2, 2)), mode="edge")
    between = np.maximum(np.maximum(bend[:, :-2], bend[:, 1:-1]), bend[:, 2:])
    high = near & (estimated + np.maximum(estimated - sampled, UNSURE * best) + between >= best)
    found = np.full(high.shape, np.nan)
    for beam in np.flatnonzero(high.any(axis=1)).tolist():
        own = np.flatnonzero(np.convolve(high[beam], np.ones(2 * MARGIN + 1))[MARGIN : MARGIN + len(path)] > 0)
        found[beam, own] = extremes(sampler, beam, axial, own)[0]
    return found


def _estimates(path: Path, name: str, axial: bool) -> tuple[FloatArray, FloatArray]:
    """Return the largest sample along a beam at points, and the top of a parabola through it, (n,) each [Pa]."""
    count = path.sampler.per_segment
    stress = path.sections(name).stress(axial)
    parts = stress.reshape(len(stress), -1, count)
    middle = np.clip(parts.argmax(axis=2), 1, count - 2)[..., None]
    a, b, c = (np.take_along_axis(parts, middle + k, axis=2)[..., 0] for k in (-1, 0, 1))
    slope, bend = 0.5 * (c - a), a - 2.0 * b + c
    at = np.clip(-slope / np.where(bend < 0, bend, -np.inf), -1.0, 1.0)
    sampled = stress.max(axis=1)
    return sampled, np.maximum(sampled, (b + at * (slope + 0.5 * at * bend)).max(axis=1))


def _between(
    at: Callable[[FloatArray], Path],
    name: str,
    axial: bool,
    row: tuple[FloatArray, FloatArray],
    window: tuple[float, float],
    best: float,
) -> float:
    """Return the largest stress of a beam [Pa] at extremes between places, where it is larger than the best known."""
    x, values = row
    for number in range(ROUNDS):
        tops = inner_extremes(x, values)
        tops = tops[(tops > window[0]) & (tops < window[1])]
        bound = best + (RISE if number else -NEARLY) * float(np.ptp(values))
        tops = tops[values_at(x, values, tops) > bound] if len(tops) else tops
        if not len(tops):
            break
        there = at(tops)
        solved = np.where(there.accurate, there.beam_stress(name, axial)[0], values_at(x, values, tops))
        places = np.searchsorted(x, tops)
        x, values = np.insert(x, places, tops), np.insert(values, places, solved)
        best = max(best, float(solved.max()))
    return best

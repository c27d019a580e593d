"""Where the stress along a beam is largest: an extreme between samples is found, not sampled.

Near the largest sample the stress is interpolated by a polynomial over nine samples of one smooth piece; at the
extreme of that polynomial the state is integrated, and the place is put right by the stress's exact slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.beams.recover import along_beam, sections, stress_slopes

if TYPE_CHECKING:
    from cfmkit.beams.recover import Rows, Sampler
    from cfmkit.curves import FloatArray

STENCIL = 9
_TO_POLYNOMIAL = np.linalg.inv(np.vander(np.arange(float(STENCIL)) - STENCIL // 2, increasing=True))
_END_SLOPE = np.linalg.inv(np.vander(np.arange(float(STENCIL)), increasing=True))[1]  # at the first of nine samples
_FIRST, _SECOND = np.arange(1.0, STENCIL), np.arange(1.0, STENCIL - 1) * np.arange(2.0, STENCIL)
_NEWTON, _POLISH = 6, 2


@dataclass(frozen=True)
class StressExtremes:
    """The highest and the lowest stress on both sides of a beam at n points, tension positive.

    The first axis after the points is the side: that of positive bending stress M t / 2I, then the other; the second
    is highest, lowest. The sides differ in the sign of bending only: without axial stress one tells all.

    Attributes
    ----------
    value : (n, 2, 2) array
        [Pa].
    place : (n, 2, 2) array
        Fraction of the arc length.
    parameter, row : (n, 2, 2) arrays
        Parameter of the shape, and the first row of the sampler that the place was interpolated from.
    """

    value: FloatArray
    place: FloatArray
    parameter: FloatArray
    row: Any


def extremes(sampler: Sampler, beam: int, axial: bool) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of a beam [Pa] at every point, and its place as a fraction of the arc length."""
    found = along_beam(sampler, beam)
    best = found.stress(axial).argmax(axis=1)[:, None]
    bends, pulls = (np.sign(np.take_along_axis(a, best, axis=1)) for a in (found.bending_stress, found.axial_stress))
    value, t, _ = _peaks(sampler, beam, found, bends, pulls if axial else 0.0 * pulls)
    return value[:, 0], sampler.place(beam, t)[:, 0]


def signed_extremes(sampler: Sampler, beam: int, axial: bool) -> StressExtremes:
    """Return the highest and lowest stress on both sides of a beam at every point."""
    found = along_beam(sampler, beam)
    shape = (len(found.moment), 4)
    sense = np.array([1.0, -1.0, 1.0, -1.0])  # of the stress, for highest and lowest
    bends, pulls = sense * np.array([1.0, 1.0, -1.0, -1.0]), sense * float(axial)
    value, t, row = _peaks(sampler, beam, found, np.broadcast_to(bends, shape), np.broadcast_to(pulls, shape))
    place = sampler.place(beam, t)
    return StressExtremes(*(a.reshape(-1, 2, 2) for a in (value * sense, place, t, row)))


def windows(sampler: Sampler, rows: Rows) -> Any:
    """Return for every row of a beam the first row of the stencil around it, on its own segment.

    Within a segment the rows are evenly spaced and the stress is smooth.
    """
    count = sampler.per_segment
    own = np.arange(len(rows.t)) % count
    return np.arange(len(rows.t)) - own + np.clip(own - STENCIL // 2, 0, count - STENCIL)


def _peaks(
    sampler: Sampler, beam: int, found: Any, bends: FloatArray, pulls: FloatArray
) -> tuple[FloatArray, FloatArray, Any]:
    """Return the largest of bends x bending + pulls x axial stress at n points for q choices each: arrays (n, q).

    Besides the values: parameters of the places and the first rows of the stencils.
    """
    rows = sampler.rows(beam)
    n, q = bends.shape
    stress = bends[..., None] * found.bending_stress[:, None] + pulls[..., None] * found.axial_stress[:, None]
    best = _side(stress, stress.argmax(axis=2), sampler.per_segment)
    first = windows(sampler, rows)[best]
    near = np.take_along_axis(stress, first[..., None] + np.arange(STENCIL), axis=2)
    middle = STENCIL // 2
    polynomial = near @ _TO_POLYNOMIAL.T
    low, high = (np.clip(best - first - middle + k, -middle, middle).astype(float) for k in (-1, 1))
    at = _top(polynomial, low, high)
    points = np.repeat(np.arange(n), q)
    for _ in range(_POLISH):
        value, slope = _exact(sampler, beam, (first, at + middle, points), bends, pulls)
        bend = _horner(polynomial[..., 2:] * _SECOND, at)
        spacing = rows.t[first + 1] - rows.t[first]
        inside = (at > low) & (at < high) & (bend < 0)
        at = np.where(inside, np.clip(at - spacing * slope / np.where(inside, bend, -1.0), low, high), at)
    sampled = np.take_along_axis(stress, best[..., None], axis=2)[..., 0]
    better = value >= sampled
    t = np.where(better, rows.t[first] + (at + middle) * spacing, rows.t[best])
    return np.where(better, value, sampled), t, first


def _side(stress: FloatArray, best: Any, count: int) -> Any:
    """Return the largest samples, or where two segments meet that sample's twin if the stress rises beyond it."""
    total = stress.shape[2]
    own = best % count
    twin = np.where(
        (own == 0) & (best > 0), best - 1, np.where((own == count - 1) & (best < total - 1), best + 1, best)
    )
    values = np.take_along_axis(stress, np.stack([best, twin], axis=2), axis=2)
    level = np.abs(values[..., 0] - values[..., 1]) <= 1e-9 * np.abs(values[..., 0])  # else it jumps: a corner
    outward = np.sign(twin - best)  # into the twin's segment
    ahead = twin[..., None] + outward[..., None] * np.arange(STENCIL)
    rise = np.take_along_axis(stress, np.clip(ahead, 0, total - 1), axis=2) @ _END_SLOPE
    return np.where(level & (outward != 0) & (rise > 0), twin, best)


def _exact(
    sampler: Sampler, beam: int, where: tuple[Any, FloatArray, Any], bends: FloatArray, pulls: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the stress and its derivative by the parameter, integrated; where: first rows, rows after them, points."""
    rows, (first, at, points) = sampler.rows(beam), where
    start = (np.clip(np.floor(at).astype(int), 0, STENCIL - 2) + first).ravel()
    t = (rows.t[first] + at * (rows.t[first + 1] - rows.t[first])).ravel()
    states = sampler.at(beam, rows, start, t, points)
    found = sections(sampler, beam, states, t, rows.step[start])
    slopes = stress_slopes(sampler, beam, states, (t, rows.step[start], points), found)
    value = bends.ravel() * found.bending_stress + pulls.ravel() * found.axial_stress
    slope = bends.ravel() * slopes[0] + pulls.ravel() * slopes[1]
    return value.reshape(bends.shape), slope.reshape(bends.shape)


def _top(polynomial: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return where polynomials (..., STENCIL) have their maximum between two places, by Newton's method."""
    slope, curve = polynomial[..., 1:] * _FIRST, polynomial[..., 2:] * _SECOND
    at = 0.5 * (low + high)
    for _ in range(_NEWTON):
        rise, bend = _horner(slope, at), _horner(curve, at)
        step = np.where(bend < 0, -rise / np.where(bend < 0, bend, -1.0), np.sign(rise))
        at = np.clip(at + step, low, high)
    return at


def _horner(polynomial: FloatArray, at: FloatArray) -> FloatArray:
    value = np.zeros_like(at)
    for k in range(polynomial.shape[-1] - 1, -1, -1):
        value = value * at + polynomial[..., k]
    return value

"""Where the stress along a beam is largest: an extreme between samples is found, not sampled.

Around every sample that is as high as its neighbours the stress is interpolated by a polynomial over nine samples of
one smooth piece; at the extreme of the highest polynomial the state is integrated, and the place is put right by the
stress's exact slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.outcome.sections import along_beam, sections, stress_slopes

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.sections import SampledRows, Sampler, Sections

STENCIL = 9
"""Samples of a polynomial: all that a segment has. Against more steps of Newton's method, the largest stresses of seven
shipped networks are at rounding (7e-16); with 7 samples one is off by 2e-11, with 5 by 2e-11 and others by 3e-14."""

_TO_POLYNOMIAL = np.linalg.inv(np.vander(np.arange(float(STENCIL)) - STENCIL // 2, increasing=True))
_FIRST, _SECOND = np.arange(1.0, STENCIL), np.arange(1.0, STENCIL - 1) * np.arange(2.0, STENCIL)
_NEWTON = 6
"""Steps of Newton's method on a polynomial: on those networks two end at rounding, one is off by 2e-11."""

_POLISH = 2
"""Steps with the exact slope: one leaves 1e-13, two leave rounding (7e-16)."""

_HUMPS = 6  # highest samples between lower neighbours of their segments that are looked at


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


def extremes(sampler: Sampler, beam: int, axial: bool, points: Any = None) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of a beam [Pa] at points, and its place as a fraction of the arc length.

    `points`: their numbers (n,), increasing; default: all.
    """
    found = along_beam(sampler, beam, points)
    points = np.arange(len(found.moment)) if points is None else points
    sides = np.array([(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] if axial else [(1.0, 0.0), (-1.0, 0.0)]).T
    bends, pulls = (np.broadcast_to(side, (len(found.moment), len(side))) for side in sides)
    humps = _highest(sampler, sampler.rows(beam), _combined(found, bends, pulls))
    side = humps.height.argmax(axis=1)[:, None]
    humps = Humps(*(np.take_along_axis(part, side, axis=1) for part in humps.parts))
    bends, pulls = (np.take_along_axis(a, side, axis=1) for a in (bends, pulls))
    value, t = _polished(sampler, beam, humps, (bends, pulls), points)
    return value[:, 0], sampler.place(beam, t)[:, 0]


def signed_extremes(sampler: Sampler, beam: int, axial: bool) -> StressExtremes:
    """Return the highest and lowest stress on both sides of a beam at every point."""
    found = along_beam(sampler, beam)
    shape = (len(found.moment), 4)
    sense = np.array([1.0, -1.0, 1.0, -1.0])  # of the stress, for highest and lowest
    bends, pulls = sense * np.array([1.0, 1.0, -1.0, -1.0]), sense * float(axial)
    bends, pulls = np.broadcast_to(bends, shape), np.broadcast_to(pulls, shape)
    humps = _highest(sampler, sampler.rows(beam), _combined(found, bends, pulls))
    value, t = _polished(sampler, beam, humps, (bends, pulls), np.arange(len(bends)))
    place = sampler.place(beam, t)
    return StressExtremes(*(a.reshape(-1, 2, 2) for a in (value * sense, place, t, humps.first)))


def windows(sampler: Sampler, rows: SampledRows) -> Any:
    """Return for every row of a beam the first row of the stencil around it, on its own segment.

    Within a segment the rows are evenly spaced and the stress is smooth.
    """
    count = sampler.per_segment
    own = np.arange(len(rows.t)) % count
    return np.arange(len(rows.t)) - own + np.clip(own - STENCIL // 2, 0, count - STENCIL)


@dataclass(frozen=True)
class Humps:
    """The highest hump of a stress along a beam at n points for q choices each, as interpolated.

    Attributes
    ----------
    height, at : (n, q) arrays
        Stress at the top, and its place in rows after the first of the stencil.
    low, high : (n, q) arrays
        The rows on both sides of the highest sample, likewise.
    bend : (n, q) array
        Second derivative by the row.
    best, first : (n, q) int arrays
        The highest sample's row and the first row of the stencil.
    sample : (n, q) array
        Stress at the highest sample.
    """

    height: FloatArray
    at: FloatArray
    low: FloatArray
    high: FloatArray
    bend: FloatArray
    best: Any
    first: Any
    sample: FloatArray

    @property
    def parts(self) -> tuple[Any, ...]:
        """All arrays in order."""
        return self.height, self.at, self.low, self.high, self.bend, self.best, self.first, self.sample


def _combined(found: Sections, bends: FloatArray, pulls: FloatArray) -> FloatArray:
    """Return bends x bending + pulls x axial stress at the rows, (n, q, rows)."""
    return bends[..., None] * found.bending_stress[:, None] + pulls[..., None] * found.axial_stress[:, None]


def _highest(sampler: Sampler, rows: SampledRows, stress: FloatArray) -> Humps:
    """Return the highest hump of stresses (n, q, rows), by interpolation around several samples.

    Of two humps of nearly one height the lower one may have the higher sample; where two segments meet, each has a
    hump of its own.
    """
    segments = stress.shape[2] // sampler.per_segment  # said, since a path may have no point
    parts = stress.reshape(*stress.shape[:2], segments, sampler.per_segment)
    rises, level = np.diff(parts, axis=3), np.zeros((*parts.shape[:3], 1))
    up = (np.concatenate([level, rises], axis=3) >= 0) & (np.concatenate([rises, level], axis=3) <= 0)
    ranked = np.where(up.reshape(stress.shape), stress, -np.inf)
    best = np.argsort(-ranked, axis=2, kind="stable")[..., :_HUMPS]
    first = windows(sampler, rows)[best]
    near = np.take_along_axis(stress[:, :, None], first[..., None] + np.arange(STENCIL), axis=3)
    middle = STENCIL // 2
    polynomial = near @ _TO_POLYNOMIAL.T
    low, high = (np.clip(best - first - middle + k, -middle, middle).astype(float) for k in (-1, 1))
    at = _top(polynomial, low, high)
    sample = np.take_along_axis(ranked, best, axis=2)
    height = np.where(np.isfinite(sample), np.maximum(_horner(polynomial, at), sample), -np.inf)
    bend = _horner(polynomial[..., 2:] * _SECOND, at)
    pick = height.argmax(axis=2)[..., None]
    found = (height, at + middle, low + middle, high + middle, bend, best, first, sample)
    return Humps(*(np.take_along_axis(part, pick, axis=2)[..., 0] for part in found))


def _polished(
    sampler: Sampler, beam: int, humps: Humps, signs: tuple[FloatArray, FloatArray], points: Any
) -> tuple[FloatArray, FloatArray]:
    """Return the stress at the tops of humps at points (n,), integrated, and the parameters there: arrays (n, q).

    signs: of bending and axial stress, (n, q) each.
    """
    rows, at, first, (bends, pulls) = sampler.rows(beam), humps.at, humps.first, signs
    points = np.repeat(points, bends.shape[1])
    spacing = rows.t[first + 1] - rows.t[first]
    for _ in range(_POLISH):
        value, slope = _exact(sampler, beam, (first, at, points), bends, pulls)
        inside = (at > humps.low) & (at < humps.high) & (humps.bend < 0)
        step = spacing * slope / np.where(inside, humps.bend, -1.0)
        at = np.where(inside, np.clip(at - step, humps.low, humps.high), at)
    better = value >= humps.sample
    t = np.where(better, rows.t[first] + at * spacing, rows.t[humps.best])
    return np.where(better, value, humps.sample), t


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

"""Registration of measured points to smooth curves by one rigid motion, robust against outliers; distances from them.

Iterative closest point: each point finds its foot on its curve by Newton's method, then a weighted point-to-line
Gauss-Newton step moves all points at once by an angle and a shift. Weights are Tukey's biweight of the normal
residuals, c = 4.685, in units of their robust standard deviation on their curve, 1.4826 MAD; the iteration starts
without weights. Several curves are registered jointly: one motion each would hide how they stand to each other.

A part that is wider by the same amount along all normals can be registered with that width as a fourth
unknown. Without it steep curves take the width for a shift along them, and where they are less
steep the points that contradict this look like outliers.

The motion is p -> R(angle) p + shift, about the origin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from cfmkit.numerics.least_squares import correlation_time
from cfmkit.numerics.robust_statistics import robust_scale, tukey

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray

_MAX_STEPS = 60  # the measured flanks of `configs/cam_as_built.yaml` take 23, those of built cams in the tests up to 45
_N_SAMPLES = 257
_N_FOOT_STEPS = 12


@dataclass(frozen=True)
class CurveFrame:
    """A smooth curve at some parameters."""

    # points, tangents, normals, (n, 2): unit tangents along increasing parameter; unit normals to the outside
    points: FloatArray
    tangents: FloatArray
    normals: FloatArray
    speed: FloatArray  # (n,) length per parameter
    curvature: FloatArray  # (n,) positive where the curve bends away from its normal (convex outside)


class SmoothCurve(Protocol):
    """Curve that points can be registered to."""

    @property
    def ends(self) -> tuple[float, float]:
        """First and last parameter."""

    def frame(self, parameter: FloatArray) -> CurveFrame:
        """Return the curve at parameters between its ends."""


@dataclass(frozen=True)
class Registration:
    """Places of measured points on their curves."""

    angle: float  # of the motion from measured to registered points [rad]
    shift: FloatArray  # (2,) of the motion, after the turn
    points: tuple[FloatArray, ...]  # registered points of each curve
    parameters: tuple[FloatArray, ...]  # of their feet
    errors: tuple[FloatArray, ...]  # distance from the curve along its normal; positive outside
    weights: tuple[FloatArray, ...]  # last weights; 0 for outliers and for points beyond the ends of their curve
    covariance: FloatArray  # (3, 3) of angle and shift, inflated where successive residuals are alike
    # (2,) shift, at the centre of the points, by which the registration would answer a part that is larger by one
    # along all normals: an error of width that it takes for a place. 0 where the width is fitted
    growth: FloatArray
    width: float = 0.0  # by how much the part is larger along all normals, as fitted; 0 where it was not
    width_deviation: float = 0.0  # its standard deviation

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of angle [rad] and shift."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def used(self) -> tuple[Any, ...]:
        """Which points count: neither beyond the ends nor outliers."""
        return tuple(weight > 0 for weight in self.weights)

    def weakest(self, size: float) -> tuple[FloatArray, float]:
        """Return the least certain motion about the centre of the points, (3,), and its standard deviation.

        The motion is a unit vector of (size times angle, shift x, shift y); size: where the angle is felt, such as half
        the part's extent.
        """
        x, y = np.concatenate(self.points).mean(axis=0)
        about = np.array([[size, 0.0, 0.0], [-y, 1.0, 0.0], [x, 0.0, 1.0]])
        values, vectors = np.linalg.eigh(about @ self.covariance @ about.T)
        direction = vectors[:, -1] * np.sign(vectors[np.argmax(np.abs(vectors[:, -1])), -1])
        return direction, float(np.sqrt(max(values[-1], 0.0)))


def turn_points(points: FloatArray, angle: float, shift: FloatArray) -> FloatArray:
    """Return R(angle) p + shift for points (n, 2)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + shift)


def feet(
    curve: SmoothCurve,  # between its ends
    points: FloatArray,  # (n, 2): near it
    guess: FloatArray | None = None,  # (n,): first estimates; default: the nearest of some samples
) -> FloatArray:
    """Return the parameters of the closest points on a curve, by Newton's method."""
    low, high = curve.ends
    if guess is None:
        samples = np.linspace(low, high, _N_SAMPLES)
        along = curve.frame(samples).points
        gaps = (points[:, :1] - along[:, 0]) ** 2 + (points[:, 1:] - along[:, 1]) ** 2
        guess = samples[np.argmin(gaps, axis=1)]
    u = np.array(guess)
    for _ in range(_N_FOOT_STEPS):
        at = curve.frame(u)
        gap = points - at.points
        # Beyond the centre of curvature Newton's step would turn round.
        bend = np.maximum(1.0 + at.curvature * _row_dot(gap, at.normals), 0.2)
        new = np.clip(u + _row_dot(gap, at.tangents) / (at.speed * bend), low, high)
        done = np.max(np.abs(new - u)) <= 1e-15 * (high - low)
        u = new
        if done:
            break
    return u


def register(
    points: Sequence[FloatArray],  # measured, (n, 2) for each curve
    curves: Sequence[SmoothCurve],  # where they belong
    robust: bool = True,  # whether outliers lose their weight
    start: FloatArray | None = None,  # (3,): angle [rad] and shift to start from; None: none
    width: bool = False,  # whether the part may be larger or smaller by one amount along all normals
) -> Registration:
    """Return points registered jointly to their curves."""
    state = np.zeros(4)
    state[:3] = 0.0 if start is None else start
    size = float(np.sqrt(np.mean(np.concatenate([(item - item.mean(axis=0)) ** 2 for item in points]).sum(axis=1))))
    guess: list[FloatArray | None] = [None] * len(points)
    for weighted in (False, True) if robust else (False,):
        for _ in range(_MAX_STEPS):
            moved = [turn_points(item, state[0], state[1:3]) for item in points]
            nearest = [feet(curve, item, u) for curve, item, u in zip(curves, moved, guess, strict=True)]
            guess = [*nearest]
            rows, residuals, weights = _linearised_rows(curves, moved, nearest, weighted, state[3])
            step = _weighted_step(rows[:, : 4 if width else 3], residuals - state[3], weights, size)
            state[:3] = state[0] + step[0], *turn_points(state[None, 1:3], step[0], step[1:3])[0]
            state[3] += step[3] if width else 0.0
            if np.abs(step[:3] * [size, 1.0, 1.0]).max() <= 1e-14 * size:
                break
    return _make_registration(state, points, curves, robust, width)


def registered_where_it_is(
    points: Sequence[FloatArray], curves: Sequence[SmoothCurve], like: Registration
) -> Registration:
    """Return points that are in the part's datum already: nothing is moved, outliers are those of `like`."""
    nearest = [feet(curve, item) for curve, item in zip(curves, points, strict=True)]
    _, residuals, weights = _linearised_rows(curves, points, nearest, False, 0.0)
    cuts = np.cumsum([len(item) for item in points])[:-1]
    inside = np.split(weights, cuts)
    return Registration(
        angle=0.0,
        shift=np.zeros(2),
        points=tuple(points),
        parameters=tuple(nearest),
        errors=tuple(np.split(residuals, cuts)),
        weights=tuple(weight * is_inside for weight, is_inside in zip(like.weights, inside, strict=True)),
        covariance=np.zeros((3, 3)),
        growth=np.zeros(2),
    )


def _linearised_rows(
    curves: Sequence[SmoothCurve],
    moved: Sequence[FloatArray],
    parameters: Sequence[FloatArray],
    weighted: bool,
    width: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the rows of the linearised problem, the normal residuals and the weights, all curves stacked.

    The last column is that of the width, which the residuals still hold.
    """
    frames = [curve.frame(u) for curve, u in zip(curves, parameters, strict=True)]
    points, normals = np.concatenate(moved), np.concatenate([item.normals for item in frames])
    residuals = _row_dot(points - np.concatenate([item.points for item in frames]), normals)
    lever = normals[:, 1] * points[:, 0] - normals[:, 0] * points[:, 1]
    rows = np.column_stack([lever, normals, -np.ones(len(normals))])
    inside = np.concatenate([_find_inside(curve, u) for curve, u in zip(curves, parameters, strict=True)])
    weights = inside.astype(float)
    if weighted:
        weights *= _weights_by_curve(residuals - width, inside, [len(item) for item in moved])
    return rows, residuals, weights


def _weights_by_curve(residuals: FloatArray, inside: Any, counts: Sequence[int]) -> FloatArray:
    """Return Tukey's weights, each curve by its own spread: one that was made worse is no outlier as a whole."""
    cuts = np.cumsum(counts)[:-1]
    parts = zip(np.split(residuals, cuts), np.split(inside, cuts), strict=True)
    return np.concatenate([tukey(part, robust_scale(part[good])) for part, good in parts])


def _find_inside(curve: SmoothCurve, u: FloatArray) -> Any:
    low, high = curve.ends
    margin = 1e-12 * (high - low)
    return (u > low + margin) & (u < high - margin)


def _weighted_step(rows: FloatArray, residuals: FloatArray, weights: FloatArray, size: float) -> FloatArray:
    root = np.sqrt(weights)[:, None]
    scale = np.array([size, 1.0, 1.0, 1.0])[: rows.shape[1]]
    solution = np.linalg.lstsq(root * rows / scale, -root[:, 0] * residuals, rcond=None)[0]
    return np.asarray(solution / scale)


def _make_registration(
    state: FloatArray, points: Sequence[FloatArray], curves: Sequence[SmoothCurve], robust: bool, width: bool
) -> Registration:
    moved = [turn_points(item, state[0], state[1:3]) for item in points]
    nearest = [feet(curve, item) for curve, item in zip(curves, moved, strict=True)]
    rows, residuals, weights = _linearised_rows(curves, moved, nearest, robust, state[3])
    rows = rows[:, : 4 if width else 3]
    cuts = np.cumsum([len(item) for item in points])[:-1]
    errors, shares = np.split(residuals, cuts), np.split(weights, cuts)
    inside, left = weights > 0, residuals - state[3]
    free = max(int(inside.sum()) - rows.shape[1], 1)
    variance = float((weights * left**2).sum() / free)
    seen = [error[share > 0] - state[3] for error, share in zip(errors, shares, strict=True)]
    alike = max([correlation_time(error) for error in seen if len(error)], default=1.0)
    normal = rows.T @ (weights[:, None] * rows)
    covariance: FloatArray = variance * alike * np.asarray(np.linalg.pinv(normal, rcond=1e-18), dtype=float)
    size = float(np.ptp(np.concatenate(moved), axis=0).max())
    answer = _weighted_step(rows, np.ones_like(residuals), weights, size)
    x, y = np.concatenate(moved).mean(axis=0)
    growth = answer[1:3] + answer[0] * np.array([-y, x])
    return Registration(
        float(state[0]), state[1:3], tuple(moved), tuple(nearest), tuple(errors), tuple(shares), covariance[:3, :3],
        growth, float(state[3]), float(np.sqrt(covariance[3, 3])) if width else 0.0,
    )  # fmt: skip


def gaps_across(
    curve: SmoothCurve,  # not parallel to the axis
    points: FloatArray,  # (n, 2): registered
    parameters: FloatArray,  # (n,): of their feet, to start from
    axis: int = 0,  # 0 for the distance in x at the same y
) -> FloatArray:
    """Return how far points are from a curve along one axis: point less curve, at the same other coordinate."""
    low, high = curve.ends
    u = np.array(parameters)
    for _ in range(_N_FOOT_STEPS):
        at = curve.frame(u)
        u = np.clip(
            u + (points[:, 1 - axis] - at.points[:, 1 - axis]) / (at.speed * at.tangents[:, 1 - axis]), low, high
        )
    return np.asarray(points[:, axis] - curve.frame(u).points[:, axis])


def _row_dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray((first * second).sum(axis=1))

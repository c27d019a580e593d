"""Reference shapes: how the angle of a beam runs along it before any load, in a frame of the shape's own.

A shape is made for a given chord and then turned and scaled into place (see `cfmkit.elastica.model.beam`). It is
described by its angle over a parameter t in [0, 1] and its speed ds/dt; both may be complex, for
derivatives by complex steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

_PARAMETER_TOL = 1e-12  # of the parameter: counts as on a piece

AngleLaw = Callable[[Any, float], Any]  # (t, a place inside the piece) -> angle [rad] or speed


@dataclass(frozen=True)
class FittedShape:
    """A shape made for a chord: angle [rad] and speed ds/dt [m] over t, smooth between `breaks`.

    Complex steps of a shape may move its breaks, which are then complex (see `Course.over`).
    """

    angle: AngleLaw
    speed: AngleLaw
    breaks: Any
    uniform: bool  # whether t is the fraction of the arc length

    def reparametrize(
        self,
        marks: FloatArray,  # (n,): ends of the linear pieces, increasing from 0 to 1: the breaks of the course returned
        moved: Any,  # (n,) complex: this course's parameters there: the marks plus imaginary steps
    ) -> FittedShape:
        """Return the course over another parameter, of which this one is a piecewise-linear function."""
        steps = np.imag(moved)
        rates = 1 + 1j * np.diff(steps) / np.diff(marks)

        def move(t: Any) -> Any:
            return t + 1j * np.interp(np.real(t), marks, steps)

        def speed(t: Any, inside: float) -> Any:
            piece = np.searchsorted(marks, inside, side="right") - 1
            return self.speed(move(t), inside) * rates[min(int(piece), len(rates) - 1)]

        return FittedShape(lambda t, inside: self.angle(move(t), inside), speed, read_only(marks), False)


@dataclass(frozen=True)
class Polynomial:
    """The angle is c0 + c1 u + c2 u^2 + ... over the fraction u of the arc length.

    Without coefficients the beam is straight; with two it is an arc. `length` [m] is the nominal one, used as it is
    by the closure "raw" and only reported on by "rotscale".
    """

    coefficients: tuple[float, ...] = ()
    length: float | None = None

    def course(self, chord: Any) -> FittedShape:
        """Return the course; its length is the nominal one, or the chord where there is none."""
        c = tuple(self.coefficients) or (0.0,)

        def angle(u: Any, inside: float) -> Any:
            value = 0.0 * u
            for coefficient in reversed(c):
                value = value * u + coefficient
            return value

        length = chord if self.length is None else self.length
        return FittedShape(angle, lambda u, inside: length + 0.0 * u, read_only([0.0, 1.0]), True)


STRAIGHT_SHAPE = Polynomial()  # the shape of a straight beam


def arc(sweep: float) -> Polynomial:
    """Return a circular arc whose angle grows by `sweep` [rad] from the first end to the last."""
    return Polynomial((-0.5 * sweep, sweep))


@dataclass(frozen=True)
class CosineArch:
    """y = rise (1 - cos(2 pi waves x / span)) / 2, to the left of the direction first end to last.

    `waves` = 1 is a whole arch between ends of one height; `waves` = 0.5 is half an arch, whose ends differ in height
    by the rise [m].
    """

    rise: float
    waves: float = 1.0

    def __post_init__(self) -> None:
        if self.waves not in (0.5, 1.0):
            raise InputError(f"a cosine arch has 0.5 or 1 waves, got {self.waves}")

    def course(self, chord: Any) -> FittedShape:
        """Return the course for a chord [m]."""
        span = chord if self.waves == 1.0 else (chord**2 - self.rise**2) ** 0.5
        k = 2 * np.pi * self.waves
        slope = 0.5 * self.rise * k / span

        def angle(t: Any, inside: float) -> Any:
            return np.arctan(slope * np.sin(k * t))

        def speed(t: Any, inside: float) -> Any:
            return span * np.sqrt(1 + (slope * np.sin(k * t)) ** 2)

        return FittedShape(angle, speed, read_only([0.0, 1.0]), False)


@dataclass(frozen=True)
class Polyline:
    """Straight pieces through points [m], (n, 2), in any frame; corners stay rigid."""

    points: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _check_points(self.points))

    def course(self, chord: Any) -> FittedShape:
        """Return the course; t is the fraction of the arc length."""
        steps = np.diff(self.points, axis=0)
        lengths = (steps[:, 0] ** 2 + steps[:, 1] ** 2) ** 0.5
        angles = direction(steps[:, 0], steps[:, 1])
        angles += np.unwrap(angles.real) - angles.real
        length = lengths.sum()
        breaks = np.concatenate([[0.0], np.cumsum(lengths) / length])
        breaks[-1] = 1.0

        def angle(t: Any, inside: float) -> Any:
            return angles[min(int(np.searchsorted(breaks.real, inside, side="right")) - 1, len(angles) - 1)] + 0.0 * t

        return FittedShape(angle, lambda t, inside: length + 0.0 * t, read_only(breaks, breaks.dtype), True)


@dataclass(frozen=True)
class Spline:
    """A smooth curve through points [m], (n, 2), in any frame: a cubic spline over the chord length."""

    points: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _check_points(self.points))

    def course(self, chord: Any) -> FittedShape:
        """Return the course; t is the fraction of the chord polygon's length."""
        steps = np.diff(self.points, axis=0)
        knots = np.concatenate([[0.0], np.cumsum((steps[:, 0] ** 2 + steps[:, 1] ** 2) ** 0.5)])
        knots = knots / knots[-1]
        velocity = _spline_velocity(knots, self.points)
        places = np.linspace(0, 1, 32 * len(knots))
        fine = velocity(places, 0.0).real
        turns = np.unwrap(np.arctan2(fine[:, 1], fine[:, 0]))

        def angle(t: Any, inside: float) -> Any:
            v = velocity(t, inside)
            nearby_angle = np.interp(np.real(t), places, turns)
            raw = direction(v[..., 0], v[..., 1])
            return raw + 2 * np.pi * np.round((nearby_angle - raw.real) / (2 * np.pi))

        def speed(t: Any, inside: float) -> Any:
            v = velocity(t, inside)
            return (v[..., 0] ** 2 + v[..., 1] ** 2) ** 0.5

        return FittedShape(angle, speed, read_only(knots, knots.dtype), False)


def _spline_velocity(knots: Any, points: Any) -> AngleLaw:
    """Return the derivative of the cubic spline through points (n, 2), by "not a knot" at its ends.

    Reference: C. de Boor, A Practical Guide to Splines, 1978, ch. IV.
    """
    gap, n = np.diff(knots), len(knots)
    slope = np.diff(points, axis=0) / gap[:, None]
    if n == 2:
        return lambda t, inside: slope[0] + 0.0 * np.asarray(t)[..., None]
    a, b = np.zeros((n, n), dtype=slope.dtype), np.zeros((n, 2), dtype=slope.dtype)
    for i in range(1, n - 1):
        a[i, i - 1 : i + 2] = gap[i], 2 * (gap[i - 1] + gap[i]), gap[i - 1]
        b[i] = 3 * (gap[i] * slope[i - 1] + gap[i - 1] * slope[i])
    for row, end_gap, two, s1, s2 in (
        (0, gap[0], gap[1], slope[0], slope[1]),
        (-1, gap[-1], gap[-2], slope[-1], slope[-2]),
    ):
        inner = 1 if row == 0 else -2
        if n == 3:
            a[row, row], a[row, inner], b[row] = 1.0, 1.0, 2 * s1
            continue
        both = end_gap + two
        a[row, row], a[row, inner] = two, both
        b[row] = ((end_gap + 2 * both) * two * s1 + end_gap**2 * s2) / both
    ends = np.linalg.solve(a, b)

    def velocity(t: Any, inside: float) -> Any:
        k = min(int(np.searchsorted(knots.real, inside, side="right")) - 1, n - 2)
        at = np.real(t)
        i = np.clip(np.searchsorted(knots.real, at, side="right") - 1, 0, n - 2)
        i = np.where((at >= knots.real[k] - _PARAMETER_TOL) & (at <= knots.real[k + 1] + _PARAMETER_TOL), k, i)
        u = ((t - knots[i]) / gap[i])[..., None]
        return 6 * u * (1 - u) * slope[i] + (1 - u) * (1 - 3 * u) * ends[i] + u * (3 * u - 2) * ends[i + 1]

    return velocity


def direction(x: Any, y: Any) -> Any:
    """Return the angles of vectors [rad], also where complex steps make them complex."""
    if isinstance(x, np.ndarray) and x.dtype.kind == y.dtype.kind == "f":
        return np.arctan2(y, x)
    rough = np.arctan2(np.real(y), np.real(x))
    c, s = np.cos(rough), np.sin(rough)
    return rough + np.arctan((y * c - x * s) / (x * c + y * s))


@dataclass(frozen=True)
class Bent:
    """Another shape with an angle added: a sum of Chebyshev polynomials over its parameter [rad]."""

    shape: Polynomial | CosineArch | Polyline | Spline | Bent
    coefficients: tuple[float, ...]

    def course(self, chord: Any) -> FittedShape:
        """Return the course of the shape, bent."""
        base = self.shape.course(chord)
        added = np.polynomial.Chebyshev(self.coefficients, domain=[0.0, 1.0])
        return FittedShape(lambda t, inside: base.angle(t, inside) + added(t), base.speed, base.breaks, base.uniform)


Shape = Polynomial | CosineArch | Polyline | Spline | Bent


def _check_points(points: Any) -> Any:
    array = np.asarray(points)
    array = read_only(array, complex if array.dtype.kind == "c" else float)
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 2:
        raise InputError(f"a shape by points needs at least two (x, y) pairs, got an array of shape {array.shape}")
    if not np.isfinite(array).all() or (np.hypot(*np.diff(array.real, axis=0).T) == 0).any():
        raise InputError("the points of a shape must be finite, and neighbours must differ")
    return array

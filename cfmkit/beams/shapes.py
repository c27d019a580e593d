"""Reference shapes: how the angle of a beam runs along it before any load, in a frame of the shape's own.

A shape is made for a given chord and then turned and scaled into place (see `cfmkit.beams.beam`). It is described
by its angle over a parameter t in [0, 1] and its speed ds/dt; both may be complex, for derivatives by complex steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import read_only
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.curves import FloatArray

AngleLaw = Callable[[Any, float], Any]  # (t, a place inside the piece) -> angle [rad] or speed


@dataclass(frozen=True)
class Course:
    """A shape made for a chord: angle [rad] and speed ds/dt [m] over t, smooth between `breaks`."""

    angle: AngleLaw
    speed: AngleLaw
    breaks: FloatArray
    uniform: bool  # whether t is the fraction of the arc length


@dataclass(frozen=True)
class Polynomial:
    """The angle is c0 + c1 u + c2 u^2 + ... over the fraction u of the arc length.

    Without coefficients the beam is straight; with two it is an arc. `length` [m] is the nominal one, used as it is
    by the closure "raw" and only reported on by "rotscale".
    """

    coefficients: tuple[float, ...] = ()
    length: float | None = None

    def course(self, chord: Any) -> Course:
        """Return the course; its length is the nominal one, or the chord where there is none."""
        c = tuple(self.coefficients) or (0.0,)

        def angle(u: Any, inside: float) -> Any:
            value = 0.0 * u
            for coefficient in reversed(c):
                value = value * u + coefficient
            return value

        length = chord if self.length is None else self.length
        return Course(angle, lambda u, inside: length + 0.0 * u, read_only([0.0, 1.0]), True)


STRAIGHT = Polynomial()
"""The shape of a straight beam."""


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
        """Check that the ends are level."""
        if self.waves not in (0.5, 1.0):
            raise InputError(f"a cosine arch has 0.5 or 1 waves, got {self.waves}")

    def course(self, chord: Any) -> Course:
        """Return the course for a chord [m]."""
        span = chord if self.waves == 1.0 else (chord**2 - self.rise**2) ** 0.5
        k = 2 * np.pi * self.waves
        slope = 0.5 * self.rise * k / span

        def angle(t: Any, inside: float) -> Any:
            return np.arctan(slope * np.sin(k * t))

        def speed(t: Any, inside: float) -> Any:
            return span * np.sqrt(1 + (slope * np.sin(k * t)) ** 2)

        return Course(angle, speed, read_only([0.0, 1.0]), False)


@dataclass(frozen=True)
class Polyline:
    """Straight pieces through points [m], (n, 2), in any frame; corners stay rigid."""

    points: FloatArray

    def __post_init__(self) -> None:
        """Freeze and check the points."""
        object.__setattr__(self, "points", _points(self.points))

    def course(self, chord: Any) -> Course:
        """Return the course; t is the fraction of the arc length."""
        steps = np.diff(self.points, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        angles = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        total = float(lengths.sum())
        breaks = np.concatenate([[0.0], np.cumsum(lengths) / total])
        breaks[-1] = 1.0

        def angle(t: Any, inside: float) -> Any:
            return angles[min(int(np.searchsorted(breaks, inside, side="right")) - 1, len(angles) - 1)] + 0.0 * t

        return Course(angle, lambda t, inside: total + 0.0 * t, read_only(breaks), True)


@dataclass(frozen=True)
class Spline:
    """A smooth curve through points [m], (n, 2), in any frame: a cubic spline over the chord length."""

    points: FloatArray

    def __post_init__(self) -> None:
        """Freeze and check the points."""
        object.__setattr__(self, "points", _points(self.points))

    def course(self, chord: Any) -> Course:
        """Return the course; t is the fraction of the chord polygon's length."""
        from scipy.interpolate import CubicSpline

        steps = np.diff(self.points, axis=0)
        knots = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
        knots /= knots[-1]
        curve = CubicSpline(knots, self.points)
        velocity = curve.derivative()
        fine = velocity(np.linspace(0, 1, 32 * len(knots)))
        turns = np.unwrap(np.arctan2(fine[:, 1], fine[:, 0]))
        places = np.linspace(0, 1, 32 * len(knots))

        def angle(t: Any, inside: float) -> Any:
            v = velocity(t)
            near = np.interp(t, places, turns)
            raw = np.arctan2(v[..., 1], v[..., 0])
            return raw + 2 * np.pi * np.round((near - raw) / (2 * np.pi))

        def speed(t: Any, inside: float) -> Any:
            v = velocity(t)
            return np.hypot(v[..., 0], v[..., 1])

        return Course(angle, speed, read_only(knots), False)


@dataclass(frozen=True)
class Bent:
    """Another shape with an angle added: a sum of Chebyshev polynomials over its parameter [rad]."""

    shape: Polynomial | CosineArch | Polyline | Spline | Bent
    coefficients: tuple[float, ...]

    def course(self, chord: Any) -> Course:
        """Return the course of the shape, bent."""
        base = self.shape.course(chord)
        added = np.polynomial.Chebyshev(self.coefficients, domain=[0.0, 1.0])
        return Course(lambda t, inside: base.angle(t, inside) + added(t), base.speed, base.breaks, base.uniform)


Shape = Polynomial | CosineArch | Polyline | Spline | Bent


def _points(points: Any) -> FloatArray:
    array = read_only(points)
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 2:
        raise InputError(f"a shape by points needs at least two (x, y) pairs, got an array of shape {array.shape}")
    if not np.isfinite(array).all() or (np.hypot(*np.diff(array, axis=0).T) == 0).any():
        raise InputError("the points of a shape must be finite, and neighbours must differ")
    return array

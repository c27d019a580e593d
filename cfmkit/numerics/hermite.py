"""The curve between samples: cubic Hermite interpolation of points and unit tangents.

Points and tangents are complex numbers x + iy. On a circle the cubic is nearly the
circle; on a smooth curve it is off by the fourth power of the samples' distance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.arcchain import ComplexArray

_STEP_TURN = 0.8  # of a tangent against the chord to the next sample [rad]


class CoarseDataError(GeometryError):
    """The samples do not determine the curve as closely as asked; `index` is the sample before the doubtful place."""

    def __init__(self, message: str, index: int) -> None:
        """Keep the index beside the message."""
        super().__init__(message)
        self.index = index

    def __reduce__(self) -> tuple[type[CoarseDataError], tuple[str, int]]:
        """Return what pickling needs."""
        return type(self), (str(self), self.index)


def checked(points: FloatArray, tangents: FloatArray, tolerance: float) -> tuple[ComplexArray, ComplexArray]:
    """Return the samples as complex numbers once they are known to run along a curve."""
    if len(points) < 2 or not tolerance > 0:
        raise ValueError("a fit needs two samples or more and a tolerance above zero")
    z, t = (np.asarray(values, dtype=np.float64) @ np.array([1, 1j]) for values in (points, tangents))
    if not (np.isfinite(z).all() and np.isfinite(t).all()):
        raise CoarseDataError("a point or tangent is not finite", int(np.argmin(np.isfinite(z) & np.isfinite(t))))
    if (wrong := np.abs(np.abs(t) - 1) > 1e-6).any():
        raise CoarseDataError("a tangent is not of length one", int(np.argmax(wrong)))
    chord = np.diff(z)
    if (same := np.abs(chord) <= 1e-12 * np.abs(z).max()).any():
        raise CoarseDataError("two neighbouring points coincide", int(np.argmax(same)))
    turn = np.maximum(np.abs(np.angle(chord / t[:-1])), np.abs(np.angle(t[1:] / chord)))
    worst = int(np.argmax(turn))
    if turn[worst] > _STEP_TURN:
        raise too_coarse(worst, len(z), f"the tangent is {np.degrees(turn[worst]):.0f} deg off their chord")
    return z, t / np.abs(t)


def too_coarse(index: int, count: int, why: str) -> CoarseDataError:
    """Return the error that says between which samples the curve is not known well enough, and why."""
    return CoarseDataError(
        f"points {index + 1} and {index + 2} of {count} are too far apart for the tolerance, or there is a corner "
        f"between them: {why}; give more points there, or split the curve at the corner",
        index,
    )


def cubic(p0: ComplexArray, t0: ComplexArray, p1: ComplexArray, t1: ComplexArray, f: FloatArray) -> ComplexArray:
    """Return the cubic between end points and unit tangents at fraction `f`."""
    length = _speed(p0, t0, p1, t1)
    g = 1 - f
    return np.asarray(p0 + (p1 - p0) * f * f * (3 - 2 * f) + length * f * g * (g * t0 - f * t1))


def slope(p0: ComplexArray, t0: ComplexArray, p1: ComplexArray, t1: ComplexArray, f: FloatArray) -> ComplexArray:
    """Return the derivative of `cubic` by `f`."""
    length = _speed(p0, t0, p1, t1)
    g = 1 - f
    return np.asarray(6 * f * g * (p1 - p0) + length * (g * (1 - 3 * f) * t0 + f * (3 * f - 2) * t1))


def _speed(p0: ComplexArray, t0: ComplexArray, p1: ComplexArray, t1: ComplexArray) -> FloatArray:
    """Return the length of the end derivatives with which the cubic is nearly the circle where there is one."""
    return np.asarray(2 * np.abs(p1 - p0) / (1 + np.sqrt((1 + (t0.conj() * t1).real) / 2)))


def doubt(z: ComplexArray, t: ComplexArray) -> FloatArray:
    """Return how far the curve may be from its interpolant between each two samples.

    The interpolant that skips a sample misses it by e = f'''' a^2 b^2 / 24, with a and b
    the distances to its neighbours; the one that does not is off by f'''' a^4 / 384 at
    most. It also misses the tangent there, by 2 e (1/a - 1/b); where it misses it by more,
    the curve is no smooth one: a corner by the angle q leaves q a / 8. Of two samples
    alone, the curve lies between the two arcs that touch it at one end.
    """
    step = np.abs(np.diff(z))
    if len(z) == 2:
        chord = z[1] - z[0]
        lens = np.tan(np.angle(chord / t[0]) / 2) - np.tan(np.angle(t[1] / chord) / 2)
        return np.asarray(np.abs(step / 2 * lens))
    before, after = step[:-1], step[1:]
    miss, turn = _miss(z, t, before / (before + after))
    corner = np.abs(turn - 2 * miss * (1 / before - 1 / after))
    off = np.zeros(len(step))
    off[1:] = np.abs(miss) / 16 * (after / before) ** 2 + corner * after
    off[:-1] = np.maximum(off[:-1], np.abs(miss) / 16 * (before / after) ** 2 + corner * before)
    return off


def _miss(z: ComplexArray, t: ComplexArray, fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far each inner sample lies to the left of the interpolant through its neighbours, and turns left."""
    ends = z[:-2], t[:-2], z[2:], t[2:]
    for _ in range(2):
        along = slope(*ends, fraction)
        gap = (z[1:-1] - cubic(*ends, fraction)) / along
        fraction = fraction + gap.real
    along = slope(*ends, fraction)
    return gap.imag * np.abs(along), np.angle(t[1:-1] / along)

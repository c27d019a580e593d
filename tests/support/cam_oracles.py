"""Cam mechanisms computed again from first principles, slowly: what the tests compare cfmkit with.

Nothing here uses cfmkit's formulas: free bodies as linear systems, the cam as a cloud of
points, contact by search, the path by somebody else's integrator.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from shapely import LineString, Point


def slope(x, constant, x0, brace, friction=0.0, factor=1.0):
    """Return dy/dx of the roller path: the direction p turned by the friction angle."""
    p = factor * ((x - x0) / constant + np.tan(np.arcsin(x / brace)))
    return np.tan(np.arctan(p) + np.arctan(friction))


def free_bodies(x, path_slope, brace, *, spring, radius, friction=0.0, up=True, weights=(0.0, 0.0)):
    """Return (slider force, contact force, brace force) from the equilibrium of right roller and slider.

    Unknowns N, R (rolling resistance along the flank), T, F; the roller's moment about its
    axis gives R r = N d with d = mu r.
    """
    length = np.hypot(1.0, path_slope)
    normal = np.array([path_slope, -1.0]) / length
    along = np.array([1.0, path_slope]) / length
    sin_a, cos_a = x / brace, np.sqrt(1 - (x / brace) ** 2)
    sense, lever = (1.0 if up else -1.0), friction * radius
    matrix = np.array(
        [
            [normal[0], -sense * along[0], -sin_a, 0.0],
            [normal[1], -sense * along[1], cos_a, 0.0],
            [-lever, radius, 0.0, 0.0],
            [0.0, 0.0, -2.0 * cos_a, 1.0],
        ]
    )
    contact, _, brace_force, slider = np.linalg.solve(matrix, [spring, weights[0], 0.0, weights[1]])
    return slider, contact, brace_force


@dataclass(frozen=True)
class PointCam:
    """The right flank as points: every point of the shifted path that no roller position cuts away."""

    points: np.ndarray

    def reach(self, center):
        """Return the distance of the line through the points from a centre."""
        nearest = int(np.hypot(self.points[:, 0] - center[0], self.points[:, 1] - center[1]).argmin())
        return float(LineString(self.points[max(nearest - 2, 0) : nearest + 3]).distance(Point(center)))

    def roller(self, slider, brace, radius, samples=400):
        """Return the roller's centre for a slider position: the first touch, coming from outside."""

        def center(x):
            return x, slider - np.sqrt(brace**2 - x**2)

        def gap(x):
            return self.reach(center(x)) - radius

        xs = np.linspace(brace * (1 - 1e-9), 0.05 * brace, samples)
        gaps = [gap(x) for x in xs]
        touch = next(i for i, value in enumerate(gaps) if value < 0)
        return center(brentq(gap, xs[touch], xs[touch - 1], xtol=1e-15))


def path_points(constant, x0, brace, end, *, friction=0.0, factor=1.0, count=30001):
    """Return x, y of the roller path by an integrator of scipy, dense where it is curved."""
    share = np.linspace(0, 1, count)
    x = x0 + (end - x0) * np.sort(np.concatenate([share[::2] ** 2, share[1::2] ** 0.5]))
    found = solve_ivp(
        lambda at, _y: [slope(at, constant, x0, brace, friction, factor)],
        (x0, end),
        [0.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
        dense_output=True,
    )
    return x, found.sol(x)[0]


def cut(x, y, slopes, radius):
    """Return the cam that a roller of a radius leaves: shifted points not nearer than the radius to any path point."""
    length = np.hypot(1.0, slopes)
    cx, cy = x - radius * slopes / length, y + radius / length
    coarse = slice(None, None, 10)
    px, py = np.append(x[coarse], x[-1]), np.append(y[coarse], y[-1])

    def clearance(i):
        return np.hypot(cx[i] - px, cy[i] - py).min() - radius

    keep = np.array([clearance(i) >= -1e-9 * radius for i in range(0, len(x), 50)])
    if keep.all():
        return PointCam(np.column_stack([cx, cy])), None
    # Cut away in one piece at the start: find its end among the points, then between two of them.
    last = 50 * int(np.flatnonzero(~keep)[-1])
    first = next(i for i in range(last, len(x)) if clearance(i) >= -1e-12 * radius)
    share = _between(cx, cy, (px, py), radius, first)
    corner = tuple(values[first - 1] + share * (values[first] - values[first - 1]) for values in (cx, cy))
    return PointCam(np.vstack([corner, np.column_stack([cx, cy])[first:]])), corner


def _between(cx, cy, path, radius, first):
    def clear(share):
        at = [v[first - 1] + share * (v[first] - v[first - 1]) for v in (cx, cy)]
        return np.hypot(at[0] - path[0], at[1] - path[1]).min() - radius * (1 - 1e-12)

    return brentq(clear, 0.0, 1.0) if clear(0.0) < 0 < clear(1.0) else 1.0

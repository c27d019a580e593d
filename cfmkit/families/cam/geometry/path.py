"""Roller-centre path of a cam: its height, the integral of the slope, and how far along it a slider travel reaches.

With x as the independent variable the height is one integral of the slope
(`cfmkit.families.cam.geometry.slope_law`); without friction it has a closed form,

    y = c ((D^2 - d0^2) / 2A + sqrt(l^2 - x0^2) - sqrt(l^2 - x^2)),      D = x - x0 + d0,

and the slider's travel is (D^2 - d0^2) / 2A if c = 1: the energy of the springs over the force; d0 is half of what
the springs are stretched by at the start.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.families.cam.geometry.slope_law import Real, brace_tangent, drop
from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.rows import agree, fails, refuse_columns, remember_plain, root_between
from cfmkit.numerics.quadrature import RunningIntegral
from cfmkit.numerics.roots import bracketed_root

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.slope_law import SlopeLaw

Method = Literal["quadrature", "ode"]

CAMS_KEPT = 8  # cams that are remembered: whoever builds other parts around one asks for the same again


class RollerPath:
    """The roller-centre path y(x) from (x0, 0) up to an x of `end` [m], by the closed form, a quadrature or the ODE.

    "quadrature" integrates the slope over x by Gauss-Legendre panels where there is no closed form; "ode" integrates
    [SS, eq. 2] over y with scipy's DOP853.
    """

    def __init__(self, law: SlopeLaw, end: float, method: Method = "quadrature") -> None:
        """Integrate the slope once."""
        self.law, self.end, self.method = law, end, method
        self.height: Callable[[Any], Any]  # y(x) [m] for x between x0 and `end` [m]
        if method == "ode":
            self.height = _OdeHeight(law, end)
        elif isinstance(law, CurveSlopeLaw):
            self.height = partial(_height_for_curve, law)
        elif law.friction:
            self.height = _QuadratureHeight(law, end)
        else:
            self.height = partial(_closed_height, law)

    def travel(self, x: Real) -> Real:
        """Return the slider's travel with the profile's own brace, y + sqrt(l^2 - x^2) less its start [m]."""
        law = self.law
        return self.height(x) + drop(x, law.rest_half_width, law.brace_length)


def _closed_height(law: SlopeLaw, x: Real) -> Real:
    """Return the height without friction: y = c ((D^2 - d0^2)/2A + sqrt(l^2 - x0^2) - sqrt(l^2 - x^2))."""
    out = x - law.rest_half_width
    stretch = out * (out + 2.0 * law.preload) / (2.0 * law.force_constant)
    return law.slope_factor * (stretch - drop(x, law.rest_half_width, law.brace_length))


def _height_for_curve(law: CurveSlopeLaw, x: Real) -> Any:
    """Return the height of a path whose force follows a curve: the travel less what the braces lower the slider by."""
    return law.travel(x) - drop(x, law.rest_half_width, law.brace_length)


class _QuadratureHeight:
    """Height by Gauss-Legendre panels over theta, x = l sin(theta): smooth up to x = l."""

    def __init__(self, law: SlopeLaw, end: float) -> None:
        self.law = law
        start = math.asin(law.rest_half_width / law.brace_length)
        self.integral = RunningIntegral(self._slope_by_angle, start, math.asin(min(end / law.brace_length, 1.0)))

    def _slope_by_angle(self, theta: FloatArray) -> FloatArray:
        """Return dy/dtheta [m]."""
        law = self.law
        cos, sin = np.cos(theta), np.sin(theta)
        stretch = (law.brace_length * sin - law.rest_half_width + law.preload) / law.force_constant
        p_cos = law.slope_factor * (stretch * cos + sin)
        return law.brace_length * cos * (p_cos + law.friction * cos) / (cos - law.friction * p_cos)

    def __call__(self, x: Real) -> Real:
        share: Any = x / self.law.brace_length
        height: Any = self.integral(math.asin(share) if isinstance(share, float) else np.arcsin(share))
        return height


class _OdeHeight:
    """Height from dx/dy = (1 - mu p)/(mu + p) [SS, eq. 2], integrated over y and inverted."""

    def __init__(self, law: SlopeLaw, end: float) -> None:
        from scipy.integrate import solve_ivp

        self.law = law

        def reach_end(_y: float, x: FloatArray) -> float:
            return float(x[0]) - end

        reach_end.terminal = True  # type: ignore[attr-defined]
        far, inside = 1e3 * law.brace_length, (law.rest_half_width, law.vertical_at * (1 - 1e-12))
        solution: Any = solve_ivp(
            lambda _y, x: 1.0 / law.slope(np.clip(x, *inside)),  # trial steps may go far outside
            (0.0, far),
            [law.rest_half_width],
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            dense_output=True,
            events=reach_end,
        )
        self.interpolant, self.knots = solution.sol, (solution.y[0], solution.t)

    def __call__(self, x: Real) -> Real:
        if not np.size(x):
            return x
        if np.ndim(x) > 1:  # scipy's interpolant takes rows only
            flat: Any = self(np.ravel(x)).reshape(np.shape(x))
            return flat
        at, heights = self.knots
        step = np.clip(np.searchsorted(at, x), 1, len(at) - 1)
        y: Any = np.interp(x, at, heights)
        for _ in range(12):
            change = (x - self.interpolant(y)[0]) * self.law.slope(x)
            y = np.clip(y + change, heights[step - 1], heights[step])
            if np.max(np.abs(change)) < 1e-15:
                break
        return y


def reach(law: SlopeLaw, travel: float, method: Method = "quadrature") -> tuple[RollerPath, float]:
    """Return the path up to a slider travel with the profile's own brace [m], and the x at its end.

    The path reaches at least that end. If the geometry cannot give the travel (the brace turns horizontal, the path
    vertical, or the slider stops rising first), the end is short of it: compare ``path.travel(end)``.
    """
    x0, ideal = law.rest_half_width, law.position(travel)
    if law.is_ideal:
        end = np.minimum(ideal, _farthest(law))
        return RollerPath(law, end, method), end
    high = x0 + 1.02 * (ideal - x0)
    nearly_level = agree(high > 0.99 * law.brace_length) or agree(law.slope_factor < 1)
    if nearly_level or agree(law.friction * law.frictionless(high) > 0.9):
        high = np.minimum(high, _farthest(law))
    path = RollerPath(law, high)
    if fails(path.travel(high) < travel):
        path, high = _farther(path, travel)
    end = _position(path, travel, (x0, high), x0 + 0.97 * (ideal - x0))
    return (path if method == "quadrature" else RollerPath(law, end, method)), end


@remember_plain(CAMS_KEPT)
def reached_path(law: SlopeLaw, travel: float, method: Method) -> tuple[RollerPath, float, float]:
    """Return `reach`, and how far the slider comes to its end [m]."""
    path, end = reach(law, travel, method)
    return path, end, path.travel(end)


def _farther(path: RollerPath, travel: float) -> tuple[RollerPath, float]:
    """Return a path that reaches a travel [m], or as far as any does, and its end."""
    law, limit = path.law, _farthest(path.law)
    high = min(path.end, limit)
    while high < limit and float(path.travel(high)) < travel:
        high = min(law.rest_half_width + 1.3 * (high - law.rest_half_width), limit)
        path = RollerPath(law, high)
    return path, high


def _position(path: RollerPath, travel: float, bracket: tuple[float, float], below: float) -> float:
    """Return x at a travel [m], or the bracket's end if that is short of it; `below` is a guess on the low side."""
    low, high = bracket

    def excess(x: Any) -> Any:
        return path.travel(x) - travel

    if agree(excess(high) <= 0):
        return high
    low = below if agree(below < high) and agree(excess(below) < 0) else low
    return root_between(excess, low, high)


def _farthest(law: SlopeLaw) -> float:
    """Return the x at which the path must end at the latest: vertical, at the brace's reach, or falling [m]."""
    x0 = law.rest_half_width
    room = np.maximum(1e-9 * (law.vertical_at - x0), 4e-15 * law.vertical_at)
    limit: Any = np.maximum(law.vertical_at - room, x0)
    if law.always_rises:
        return limit
    refuse_columns(*law.numbers)
    # Cut for the way down, or with weights that help, the slider falls at first (friction or the weights exceed the
    # springs) and again near x = l.
    x = law.brace_length * np.sin(
        np.linspace(math.asin(x0 / law.brace_length), math.asin(limit / law.brace_length), 257)
    )
    rising = law.slope(x) > brace_tangent(x, law.brace_length)
    if not rising.any():
        return x0
    first = int(np.argmax(rising))
    if rising[first:].all():
        return limit
    top = first + int(np.argmin(rising[first:]))
    margin = lambda u: float(law.slope(u) - brace_tangent(u, law.brace_length))  # noqa: E731
    return bracketed_root(margin, float(x[top - 1]), float(x[top]))

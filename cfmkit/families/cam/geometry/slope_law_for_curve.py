"""The slope that gives a cam any force F(s) on its slider, not a constant one.

Without friction the energy of the springs is that of the force: with F = 4 K A phi(s), A the force constant that
goes with phi = 1, and D half the elongation of the springs,

    (D^2 - d0^2) / 2A = Phi(s) - gamma (s - y(x)),      Phi = integral of phi,      D = x - x0 + d0

where gamma = 1 - 1/c is the weight that the profile carries (`slope_factor`), as a share of 4 K A, and s - y the way
that slider and roller are apart less that at the start. So s(x) is the root of a monotone function, and

    dy/dx = p = (D/A + gamma tan a) / (phi(s) - gamma) + tan a,

the constant-force slope of `slope_law` where phi = 1. Cut for a friction mu the slope is (p + mu)/(1 - mu p) as there,
and s(x) follows from ds/dx = dy/dx - tan a, integrated once.

Assumes: what `slope_law` assumes. phi is above 0 but at the very start, where it may begin at zero (springs at rest).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.geometry.slope_law import Real, SlopeLaw, brace_tangent, drop
from cfmkit.families.rows import agree
from cfmkit.numerics.roots import FLOAT_EPS, bracketed_root, invert_increasing

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.interpolation import ThroughPoints

NEAR_START = 1e-7  # share of the travel next to a start at zero force within which 0/0 is taken from a place beside it
PATH_END_FACTOR = 1.05  # times the curve's end: so far a path that is cut for friction is integrated
N_EVEN_PLACES = 2001
"""Places of a path among which the tightest one is looked for, beside those next to the points of the curve."""


@dataclass(frozen=True)
class CurveSlopeLaw(SlopeLaw):
    """The slope that makes the force follow a curve."""

    # phi: the force over travel [m], as a share of that which goes with `force_constant`
    shape: ThroughPoints = field(kw_only=True)

    @property
    def constant(self) -> bool:
        """Whether the force is the same everywhere: not that of a curve."""
        return False

    @property
    def carried(self) -> float:
        """gamma: weight that the profile carries, over 4 K A."""
        return 1.0 - 1.0 / self.slope_factor

    @property
    def begins_at_zero(self) -> bool:
        """Whether there is no force at the start, and springs at rest: the slope is a limit there."""
        return self.shape.values[0] == 0.0 and agree(np.equal(self.preload, 0.0))

    @property
    def travel_end(self) -> float:
        """Travel up to which the curve is known [m]."""
        return self.shape.places[-1]

    def position(self, travel: Any) -> Any:
        """Return x after a slider travel [m]: exact without friction and weight, else near it."""
        work = np.maximum(self.preload**2 + 2.0 * self.force_constant * self._work(travel), 0.0)
        return self.rest_half_width + (np.sqrt(work) - self.preload)

    def undercuts(self, roller_radius: float) -> bool:
        """Return whether the path is curved more tightly at its start than a roller [m]; it may be hollow there."""
        radius = self.curvature_radius(self.rest_half_width)
        return agree(np.logical_and(radius > 0.0, radius < roller_radius))

    def travel(self, x: Any) -> Any:
        """Return the travel with the roller at x [m]."""
        values = np.asarray(x if self.friction else self._energy(x), dtype=np.float64)
        flat = np.atleast_1d(values).ravel()
        travel = self._evaluate_travel(flat) if self.friction else self._from_energy(flat)
        return travel.reshape(values.shape) if values.ndim else float(travel[0])

    def _work(self, travel: Any) -> Any:
        """Return the integral of phi - gamma [m]."""
        return self.shape.integral(travel) - self.carried * travel

    def _energy(self, x: Any) -> Any:
        """Return the energy of the springs with the roller at x, less that of the weights, over 4 K A [m]."""
        out = x - self.rest_half_width
        energy: Any = out * (out + 2.0 * self.preload) / (2.0 * self.force_constant)
        return energy - self.carried * drop(x, self.rest_half_width, self.brace_length) if self.carried else energy

    def _from_energy(self, energy: FloatArray) -> FloatArray:
        """Return the travel at which work and energy agree [m]."""
        travel = self.shape.invert_integral(energy, self.carried)
        fine = 16.0 * FLOAT_EPS * float(np.abs(energy).max(initial=0.0))
        rest = np.flatnonzero(~(np.abs(self._work(travel) - energy) <= fine))
        if rest.size:
            travel[rest] = self._invert_work(energy[rest])
        return travel

    def _invert_work(self, energy: FloatArray) -> FloatArray:
        """Return the same from the whole curve: beyond its ends, too, and where a piece of it bends much [m]."""
        least = max(float(self.shape.evaluate(self.travel_end)) - self.carried, 1e-9)
        beyond = max(float(energy.max(initial=0.0)) - float(self._work(self.travel_end)), 0.0)
        far = self.travel_end + 1.01 * beyond / least

        def work(travel: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self._work(travel), self.shape.evaluate(travel) - self.carried

        places = self._work_table
        return invert_increasing(work, energy, (0.0, far), np.interp(energy, places[1], places[0]))

    @cached_property
    def _work_table(self) -> tuple[FloatArray, FloatArray]:
        travel = self.travel_end * np.linspace(0.0, 1.0, 257) ** 2
        return travel, self._work(travel)

    @cached_property
    def _solution(self) -> Any:
        """The travel over x with friction, from x0 to where the path turns vertical or the brace horizontal."""
        from scipy.integrate import solve_ivp

        x0, brace = self.rest_half_width, self.brace_length
        last = brace * (1 - 1e-6)

        def reach_vertical(x: float, travel: FloatArray) -> float:
            return float(self._vertical(x, travel[0]))

        def pass_travel_end(_x: float, travel: FloatArray) -> float:
            return float(travel[0]) - PATH_END_FACTOR * self.travel_end

        reach_vertical.terminal = pass_travel_end.terminal = True  # type: ignore[attr-defined]
        return solve_ivp(
            lambda x, travel: self._rate(x, travel),
            (x0, last),
            [0.0],
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
            max_step=(last - x0) / 64.0,
            dense_output=True,
            events=(reach_vertical, pass_travel_end),
        )

    def _vertical(self, x: Any, travel: Any) -> Any:
        """Return what sinks to zero where the path turns vertical, with some way left to it."""
        phi = self.shape.evaluate(travel)
        tangent = brace_tangent(x, self.brace_length)
        stretch = (x - self.rest_half_width + self.preload) / self.force_constant
        return phi - self.carried - self.friction * (stretch + phi * tangent) - 1e-9 * phi

    def _rate(self, x: Any, travel: Any) -> Any:
        """Return ds/dx."""
        phi, tangent = self.shape.evaluate(travel), brace_tangent(x, self.brace_length)
        pushed = (x - self.rest_half_width + self.preload) / self.force_constant + phi * tangent
        left = phi - self.carried
        over = pushed * (1.0 + self.friction * tangent) + left * (self.friction - tangent)
        return over / (left - self.friction * pushed)

    def _evaluate_travel(self, x: FloatArray) -> FloatArray:
        solution = self._solution
        return np.asarray(solution.sol(np.clip(x, self.rest_half_width, solution.t[-1]))[0])

    def _regular(self, x: Any) -> tuple[Any, Any, Any]:
        """Return x as an array, its travel, and phi there; next to a start at zero force those of a place beside it."""
        at = np.asarray(x, dtype=np.float64)
        if self.begins_at_zero:
            at = np.maximum(at, self.position(NEAR_START * self.travel_end))
        travel = np.asarray(self.travel(at))
        return at, travel, self.shape.evaluate(travel)

    def _slope_and_rise(self, x: Any) -> tuple[Any, Any]:
        """Return p(x), the slope before friction turns the contact normal, and dp/dx [1/m].

        The latter is below zero where the force grows so quickly that the flank is hollow.
        """
        at, travel, phi = self._regular(x)
        tangent, left = brace_tangent(at, self.brace_length), phi - self.carried
        rate = ((at - self.rest_half_width + self.preload) / self.force_constant + self.carried * tangent) / left
        along = self._rate(at, travel) if self.friction else rate
        across = (self.brace_length - x) * (self.brace_length + x)
        turn = self.brace_length**2 / (across * across**0.5)
        bend = (1.0 / self.force_constant + self.carried * turn) / left - rate * self.shape.slope(travel) * along / left
        return rate + brace_tangent(x, self.brace_length), bend + turn

    def frictionless(self, x: Real, tangent: Real | None = None) -> Real:
        """Return p(x), the slope before the contact normal is turned by friction."""
        slope: Any = self._slope_and_rise(x)[0]
        return slope

    def slopes(self, x: Real) -> tuple[Any, Any]:
        """Return dy/dx and d2y/dx2 [1/m] of the path."""
        p, rise = self._slope_and_rise(np.asarray(x))
        turn = 1.0 - self.friction * p
        return (p + self.friction) / turn, rise * (1.0 + self.friction**2) / (turn * turn)

    def curvature_radius(self, x: Real) -> Real:
        """Return the radius of curvature of the path [m], negative where it is hollow: no roller undercuts there."""
        p, rise = self._slope_and_rise(x)
        turn = (1.0 - self.friction * p) / (1.0 + self.friction**2) ** 0.5
        bend = np.asarray(turn * rise)
        radius: Any = np.asarray(1.0 + p * p) ** 1.5 / np.where(bend == 0.0, 1e-300, bend)
        curvature_radius: Any = radius if np.ndim(radius) else float(radius)
        return curvature_radius

    def tightest(self, end: Any, start: Any = 0.0) -> tuple[Any, Any]:
        """Return where the path is bent most of all convex places from `start` to `end` [m], and the radius there.

        That is infinite where none is convex.
        """
        start = np.maximum(start, self.rest_half_width)
        knots = np.asarray(self.position(np.array(self.shape.places)))
        width = end - start
        parts = [start + width * np.linspace(0.0, 1.0, N_EVEN_PLACES), knots - 1e-9 * width, knots + 1e-9 * width]
        rows = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
        x = np.concatenate([np.broadcast_to(part, (*rows, part.shape[-1])) for part in parts], axis=-1)
        x = np.sort(np.clip(x, start, end), axis=-1)
        radius = np.asarray(self.curvature_radius(x))
        radius = np.broadcast_to(np.where(radius > 0, radius, np.inf), x.shape)
        at = np.argmin(radius, axis=-1)[..., None]
        place, least = (np.take_along_axis(item, at, axis=-1) for item in (x, radius))
        return (place, least) if place.ndim > 1 else (place.item(), least.item())

    def smallest_force_constant(self, roller_radius: float) -> float | None:
        """Return the smallest A from which on the roller fits everywhere on the path; None if none is [m]."""
        from dataclasses import replace

        def margin(constant: float) -> float:
            law = replace(self, force_constant=constant)
            end = min(float(law.position(self.travel_end)), 0.999 * self.brace_length)
            radius = law.tightest(end)[1] if end > self.rest_half_width else 0.0
            return min(radius, 1e6 * roller_radius) - roller_radius

        grid = np.geomspace(1e-4, 1.0, 41) * self._largest_constant()
        good = [margin(float(constant)) >= 0 for constant in grid]
        if not good[-1]:
            return None
        first = len(good) - next((k for k, fits in enumerate(reversed(good)) if not fits), len(good))
        if first == 0:
            return float(grid[0])
        return bracketed_root(margin, float(grid[first - 1]), float(grid[first])) * (1 + 1e-9)

    def _largest_constant(self) -> float:
        """Return the A with which the rollers come near the reach of the braces at the end of the curve [m]."""
        room = 0.99 * self.brace_length - self.rest_half_width + self.preload
        return (room * room - self.preload**2) / (2.0 * float(self._work(self.travel_end)))

    def smallest_preload(self, roller_radius: float) -> float | None:
        """Return nothing: a preload widens the start only, and a curve may be bent elsewhere."""
        return None

    @cached_property
    def vertical_at(self) -> float:
        """The x at which the path turns vertical; the brace length if it never does [m]."""
        if self.friction <= 0 or not len(self._solution.t_events[0]):
            return self.brace_length
        return float(self._solution.t[-1])

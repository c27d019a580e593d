"""The slope that a constant-force cam gives the path of its rollers.

The rollers of a symmetric mechanism are pulled together by springs and up by two
braces that meet in a slider. The force on the slider is constant when the path of
the right roller's centre has the slope dy/dx = tan(atan p + atan mu) with

    p(x) = c ((x - x0) / A + tan alpha),      sin alpha = x / l

[SS, eq. 2 and 3, written for x as the independent variable]: A is the force
constant, mu the rolling friction that the profile is cut for, and c = 1 unless
the profile also carries the weight of the moving parts (`slope_factor`).

Assumes: massless parts but for dead weight, linear springs, point contact, one
rolling resistance. The paper's Delta x is half the spring's elongation and its A
contains it: A has the unit of a length.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from cfmkit.arrays import FloatArray
from cfmkit.numerics.roots import bracketed_root

Real = TypeVar("Real", float, FloatArray)
"""A number or an array of numbers: what the formulas take they give back."""


def brace_tangent(x: Real, brace_length: float) -> Real:
    """Return tan(alpha) of a brace whose roller is `x` [m] off the axis, sin(alpha) = x/l."""
    return x / ((brace_length - x) * (brace_length + x)) ** 0.5


def drop(x: Real, x0: float, brace_length: float) -> Real:
    """Return sqrt(l^2 - x^2) - sqrt(l^2 - x0^2) without cancellation [m]."""
    at_x = ((brace_length - x) * (brace_length + x)) ** 0.5
    at_x0 = ((brace_length - x0) * (brace_length + x0)) ** 0.5
    return -(x - x0) * (x + x0) / (at_x + at_x0)


@dataclass(frozen=True)
class SlopeLaw:
    """The slope that makes the force constant.

    Attributes
    ----------
    force_constant : float
        A [m]; the force is 4 K A, K the sum of all parallel springs.
    rest_half_width : float
        x0 [m]: the path starts here, with the springs at rest.
    brace_length : float
        l [m].
    friction : float
        Rolling friction the profile is cut for, positive for the way up, negative for the way down.
    slope_factor : float
        c: 1, or larger where the profile carries dead weight.
    """

    force_constant: float
    rest_half_width: float
    brace_length: float
    friction: float = 0.0
    slope_factor: float = 1.0

    def frictionless(self, x: Real) -> Real:
        """Return p(x), the slope before the contact normal is turned by friction [SS, eq. 3]."""
        stretch = (x - self.rest_half_width) / self.force_constant
        return self.slope_factor * (stretch + brace_tangent(x, self.brace_length))

    def slope(self, x: Real) -> Real:
        """Return dy/dx of the roller-centre path [SS, eq. 2]."""
        p = self.frictionless(x)
        return (p + self.friction) / (1.0 - self.friction * p)

    def slope_derivative(self, x: Real) -> Real:
        """Return d2y/dx2 of the path [1/m]."""
        turn = 1.0 - self.friction * self.frictionless(x)
        return self._rise(x) * (1.0 + self.friction**2) / (turn * turn)

    def slopes(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return dy/dx and d2y/dx2 [1/m] of the path: `slope` and `slope_derivative`, in half the time of both."""
        across = (self.brace_length - x) * (self.brace_length + x)
        root = across**0.5
        p = self.slope_factor * ((x - self.rest_half_width) / self.force_constant + x / root)
        rise = self.slope_factor * (1.0 / self.force_constant + self.brace_length**2 / (across * root))
        if not self.friction:
            return p, rise
        turn = 1.0 - self.friction * p
        return (p + self.friction) / turn, rise * (1.0 + self.friction**2) / (turn * turn)

    def _rise(self, x: Real) -> Real:
        """Return dp/dx [1/m]."""
        across = (self.brace_length - x) * (self.brace_length + x)
        return self.slope_factor * (1.0 / self.force_constant + self.brace_length**2 / (across * across**0.5))

    def curvature_radius(self, x: Real) -> Real:
        """Return the radius of curvature of the path [m]; a larger roller undercuts the cam.

        It is smallest at the start of any path with friction mu >= 0. Without friction it is at least
        l (cos^2 a + c^2 sin^2 a)^1.5 / c / (1 + l cos^3(a)/A), equal at the start, and for c >= 1 that bound
        grows with a. Friction multiplies it by sqrt(1 + mu^2)/(1 - mu p), which grows with p for mu > 0. For a
        profile cut for the way down (mu < 0) it shrinks, and near x = l such a path is curved more tightly than
        at its start; but there the slider falls, and the cam has ended before.
        """
        p = self.frictionless(x)
        length = 1.0 + p * p
        turn = (1.0 - self.friction * p) / (1.0 + self.friction**2) ** 0.5
        return length * length**0.5 / (turn * self._rise(x))

    def smallest_force_constant(self, roller_radius: float) -> float | None:
        """Return the smallest A whose path is not curved more tightly at its start than a roller; None if none is [m].

        Without friction and weight A = cos^3(a0) / (1/r - 1/l), sin(a0) = x0/l. In general
        p(x0) does not depend on A, so that the radius of curvature there can be solved for it.
        """
        tangent = float(brace_tangent(self.rest_half_width, self.brace_length))
        p = self.slope_factor * tangent
        turn = (1.0 - self.friction * p) * self.slope_factor / (1.0 + self.friction**2) ** 0.5
        inverse = (1.0 + p * p) ** 1.5 / (turn * roller_radius) - (1.0 + tangent**2) ** 1.5 / self.brace_length
        return 1.0 / inverse if inverse > 0 else None

    @cached_property
    def vertical_at(self) -> float:
        """The x at which the path turns vertical, where p = 1/mu; the brace length if it never does [m]."""
        if self.friction <= 0:
            return self.brace_length
        start = math.asin(self.rest_half_width / self.brace_length)
        if self._vertical_margin(start) <= 0:
            return self.rest_half_width
        if self._vertical_margin(0.5 * math.pi) >= 0:  # friction below rounding
            return self.brace_length
        turn = bracketed_root(self._vertical_margin, start, 0.5 * math.pi)
        return self.brace_length * math.sin(turn)

    def _vertical_margin(self, theta: float) -> float:
        """Return (1 - mu p) cos(theta): positive before the path turns vertical."""
        cos, sin = math.cos(theta), math.sin(theta)
        stretch = (self.brace_length * sin - self.rest_half_width) / self.force_constant
        return cos - self.friction * self.slope_factor * (stretch * cos + sin)

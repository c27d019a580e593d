"""Slope law of a constant-force cam's roller path: slope, curvature, and the smallest A or preload without undercut.

The rollers of a symmetric mechanism are pulled together by springs and up by two
braces that meet in a slider. The force on the slider is constant when the path of
the right roller's centre has the slope dy/dx = tan(atan p + atan mu) with

    p(x) = c ((x - x0 + d0) / A + tan alpha),      sin alpha = x / l

[SS, eq. 2 and 3, written for x as the independent variable, where d0 = 0]: d0 is half the
elongation that the springs have at the start already, A is the force constant, mu the
rolling friction that the profile is cut for, and c = 1 unless the profile also carries
the weight of the moving parts, or is helped by it (`slope_factor`).

Assumes: massless parts but for dead weight, linear springs, point contact, one rolling resistance. The paper's Delta x
is half the spring's elongation and its A contains it: A has the unit of a length.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from cfmkit.arrays import FloatArray
from cfmkit.families.rows import agree
from cfmkit.numerics.roots import bracketed_root

Real = TypeVar("Real", float, FloatArray)
"""A number or an array of numbers: what the formulas take they give back. Their parameters are numbers, or columns."""

N_PATH_PLACES = 257
"""Along a path, between which its radius of curvature has one smallest value at most: it has two on a whole path."""


def brace_tangent(x: Real, brace_length: Any) -> Real:
    """Return tan(alpha) of a brace whose roller is `x` [m] off the axis, sin(alpha) = x/l."""
    tangent: Real = x / ((brace_length - x) * (brace_length + x)) ** 0.5
    return tangent


def drop(x: Real, x0: Real | float, brace_length: Real | float) -> Real:
    """Return sqrt(l^2 - x^2) - sqrt(l^2 - x0^2) without cancellation [m]."""
    at_x = ((brace_length - x) * (brace_length + x)) ** 0.5
    at_x0 = ((brace_length - x0) * (brace_length + x0)) ** 0.5
    return -(x - x0) * (x + x0) / (at_x + at_x0)


@dataclass(frozen=True)
class SlopeLaw:
    """The slope that makes the force constant."""

    force_constant: float  # a [m]; the force is 4 K A, K the sum of all parallel springs
    rest_half_width: float  # x0 [m]: the path starts here
    brace_length: float  # l [m]
    friction: float = 0.0  # rolling friction the profile is cut for, positive for the way up, negative for the way down
    # c: 1, larger where the profile carries dead weight, smaller where weight that hangs down helps the springs
    slope_factor: float = 1.0
    # d0 [m]: half the elongation of the springs at the start; 0 for springs that are at rest there
    preload: float = 0.0

    @property
    def constant(self) -> bool:
        """Whether it is for a constant force."""
        return True

    @property
    def always_rises(self) -> bool:
        """Whether the slider rises all along the path, with the brace that it is cut for."""
        return agree(self.friction >= 0.0) and agree(self.slope_factor >= 1.0)

    @property
    def numbers(self) -> tuple[float, ...]:
        """Its parameters, of which some may be columns."""
        sizes = self.force_constant, self.rest_half_width, self.brace_length
        return *sizes, self.friction, self.slope_factor, self.preload

    @property
    def is_ideal(self) -> bool:
        """Whether it carries no weight, and is cut for no friction."""
        return agree(self.friction == 0.0) and agree(self.slope_factor == 1.0)

    def position(self, travel: Real) -> Real:
        """Return x after a slider travel [m]: exact without friction and weight, s = (D^2 - d0^2)/2A, else near it."""
        stretched = (self.preload**2 + 2.0 * self.force_constant * travel / self.slope_factor) ** 0.5
        return self.rest_half_width + (stretched - self.preload)

    def undercuts(self, roller_radius: float) -> bool:
        """Return whether the path is curved more tightly at its start than a roller [m]."""
        return not agree(self.curvature_radius(self.rest_half_width) >= roller_radius)

    def frictionless(self, x: Real, tangent: Real | None = None) -> Real:
        """Return p(x), the slope before the contact normal is turned by friction [SS, eq. 3].

        `tangent`: tan(alpha) of its brace, where that is known.
        """
        stretch = (x - self.rest_half_width + self.preload) / self.force_constant
        return self.slope_factor * (stretch + (brace_tangent(x, self.brace_length) if tangent is None else tangent))

    def slope(self, x: Real, tangent: Real | None = None) -> Real:
        """Return dy/dx of the roller-centre path [SS, eq. 2]."""
        p = self.frictionless(x, tangent)
        return (p + self.friction) / (1.0 - self.friction * p) if np.any(self.friction) else p

    def slopes(self, x: Real) -> tuple[Real, Real]:
        """Return dy/dx and d2y/dx2 [1/m] of the path; the first alone is `slope`."""
        across = (self.brace_length - x) * (self.brace_length + x)
        root = across**0.5
        p = self.slope_factor * ((x - self.rest_half_width + self.preload) / self.force_constant + x / root)
        rise = self.slope_factor * (1.0 / self.force_constant + self.brace_length**2 / (across * root))
        if not np.any(self.friction):
            return p, rise
        turn = 1.0 - self.friction * p
        return (p + self.friction) / turn, rise * (1.0 + self.friction**2) / (turn * turn)

    def rise_and_bow(self, x: Real) -> tuple[Real, Real]:
        """Return dp/dx [1/m] and d2p/dx2 [1/m^2], derivatives of [SS, eq. 3]."""
        across = (self.brace_length - x) * (self.brace_length + x)
        return self._rise(x), self.slope_factor * 3.0 * self.brace_length**2 * x / (across * across * across**0.5)

    def _rise(self, x: Real) -> Real:
        """Return dp/dx [1/m]."""
        across = (self.brace_length - x) * (self.brace_length + x)
        return self.slope_factor * (1.0 / self.force_constant + self.brace_length**2 / (across * across**0.5))

    def curvature_radius(self, x: Real) -> Real:
        """Return the radius of curvature of the path [m]; a larger roller undercuts the cam.

        For c >= 1 and springs at rest at the start it is smallest there, of any path with friction mu >= 0. Without
        friction it is at least l (cos^2 a + c^2 sin^2 a)^1.5 / c / (1 + l cos^3(a)/A), equal at the start, and
        for c >= 1 that bound grows with a. Friction multiplies it by sqrt(1 + mu^2)/(1 - mu p), which grows with p for
        mu > 0. For a profile cut for the way down (mu < 0) it shrinks, and near x = l such a path is curved more
        tightly than at its start; but there the slider falls, and the cam has ended before.

        Elsewhere `tightest` looks for it. With springs that are tight at the start the radius may sink along the path,
        for c >= 1 not below the brace's length or that of the start (20 000 drawn paths), and no roller is larger than
        the brace is long. For c < 1 it may sink below a roller that fits at the start.
        """
        p = self.frictionless(x)
        length = 1.0 + p * p
        turn = (1.0 - self.friction * p) / (1.0 + self.friction**2) ** 0.5
        return length * length**0.5 / (turn * self._rise(x))

    def tightest(self, end: float, start: float = 0.0) -> tuple[float, float]:
        """Return where the path is bent most from `start` to `end` [m], and the radius of curvature there [m].

        That is at an end, or at a zero of d(ln R)/dx = 3 p p'/(1 + p^2) + mu p'/(1 - mu p) - p''/p'.
        """
        start = max(start, self.rest_half_width)
        if start == self.rest_half_width and self.always_rises and not self.preload:
            return start, float(self.curvature_radius(start))
        angles = np.linspace(math.asin(start / self.brace_length), math.asin(end / self.brace_length), N_PATH_PLACES)
        x = np.clip(self.brace_length * np.sin(angles), start, end)
        growth = self._radius_growth(x)
        dips = np.flatnonzero((growth[:-1] < 0) & (growth[1:] > 0))
        places = [start, end, *(bracketed_root(self._radius_growth, float(x[k]), float(x[k + 1])) for k in dips)]
        radii = [float(self.curvature_radius(place)) for place in places]
        tight = int(np.argmin(radii))
        return places[tight], radii[tight]

    def _radius_growth(self, x: Real) -> Real:
        """Return d(ln R)/dx of the radius of curvature R [1/m]."""
        p, (rise, bow) = self.frictionless(x), self.rise_and_bow(x)
        return rise * (3.0 * p / (1.0 + p * p) + self.friction / (1.0 - self.friction * p)) - bow / rise

    def smallest_force_constant(self, roller_radius: float) -> float | None:
        """Return the smallest A whose path is not curved more tightly at its start than a roller; None if none is [m].

        Without friction and weight A = cos^3(a0) / (1/r - 1/l), sin(a0) = x0/l. In general
        p(x0) does not depend on A if the springs are at rest there, so that the radius of curvature there can be
        solved for it. With a preload small constants give steep starts without undercut, too: what is returned
        then is the least that is larger than all that undercut. With it the start decides for c < 1, too: behind it
        no path was bent more tightly than the roller where the slider is above its start (14 000 drawn paths).
        """
        tangent = float(brace_tangent(self.rest_half_width, self.brace_length))
        p = self.slope_factor * tangent
        turn = (1.0 - self.friction * p) * self.slope_factor / (1.0 + self.friction**2) ** 0.5
        inverse = (1.0 + p * p) ** 1.5 / (turn * roller_radius) - (1.0 + tangent**2) ** 1.5 / self.brace_length
        if inverse <= 0 or not self.preload:
            return 1.0 / inverse if inverse > 0 else None
        large = 1.0 / inverse
        # A preload makes the start steeper, which widens the radius: A without it is large enough.
        grid = np.geomspace(1e-6 * large, large, 601)
        undercut = np.flatnonzero([self._start_radius(constant) < roller_radius for constant in grid.tolist()])
        if not undercut.size:
            return float(grid[0])
        last = int(undercut[-1])
        if last == len(grid) - 1:
            return large
        return bracketed_root(
            lambda constant: self._start_radius(constant) - roller_radius, float(grid[last]), float(grid[last + 1])
        )

    def _start_radius(self, force_constant: float) -> float:
        """Return the radius of curvature at the start with another A, infinite where the start is vertical [m]."""
        law = replace(self, force_constant=force_constant)
        if law.friction * law.frictionless(law.rest_half_width) >= 1:
            return math.inf
        return float(law.curvature_radius(law.rest_half_width))

    def smallest_preload(self, roller_radius: float) -> float | None:
        """Return the smallest d0 whose path is not curved more tightly at its start than a roller [m]; None if none is.

        Without friction from (1 + p0^2)^1.5 / p0' = r, where p0' does not depend on d0; with friction solved for.
        """
        x0, rise = self.rest_half_width, self._rise(self.rest_half_width)
        tangent = float(brace_tangent(x0, self.brace_length))
        slope = max((roller_radius * rise) ** (2.0 / 3.0) - 1.0, 0.0) ** 0.5
        plain = max(self.force_constant * (slope / self.slope_factor - tangent), 0.0)
        if not self.friction:
            return plain

        def margin(preload: float) -> float:
            return float(replace(self, preload=preload).curvature_radius(x0)) - roller_radius

        if margin(0.0) >= 0:
            return 0.0
        steepest = (
            self.force_constant * (1.0 / (self.friction * self.slope_factor) - tangent) if self.friction > 0 else 0
        )
        high = max(plain, 1e-9 * x0)
        while margin(high) < 0:
            high *= 2.0
            if 0 < steepest <= high:
                high = steepest * (1 - 1e-12)
                break
            if high > 1e3 * self.brace_length:
                return None
        return bracketed_root(margin, 0.0, high) if margin(high) > 0 else None

    @cached_property
    def vertical_at(self) -> float:
        """The x at which the path turns vertical, where p = 1/mu; the brace length if it never does [m]."""
        if agree(self.friction <= 0):
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
        stretch = (self.brace_length * sin - self.rest_half_width + self.preload) / self.force_constant
        return cos - self.friction * self.slope_factor * (stretch * cos + sin)

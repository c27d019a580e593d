"""A shape task as an optimisation program: three goals (flattest, widest, force ratio) with their rows and all limits'.

Objectives: smooth forms with auxiliary variables beside the design variables. [Lan, eq. 1] compares the force at two
displacements, F(a)/F(b) - 1. Nothing bounds that from below: a mechanism that snaps through between b and a reaches
-1 and less. The flattest force over a window has no such escape: with s the half band and r its middle, s is least
subject to r (1 - s) <= F <= r (1 + s). That is asked of the polynomial through the poses of the window, at three
times as many places: a force that is out of the band between poses is out of the band.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010), eq. 1 and table 1.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.objective_and_constraints import DesignProgram, LimitRows, SeenPoint, find_largest_violation
from cfmkit.families.beam.shaping.limits import View
from cfmkit.families.beam.shaping.response import NoAnswer, poses_of, respond

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.shaping.task_and_variables import Variables


@dataclass(eq=False)
class Shaping(DesignProgram):
    """The design variables, then the goal's own ones: what `cfmkit.numerics.sqp.minimize` wants to know of them."""

    # variables, start, goal: what varies, where the window begins [m], what is minimised
    variables: Variables
    start: float
    goal: Goal
    # limits that may give way; the last variable is by how much, and is minimised in place of the goal
    elastic: tuple[str, ...] = ()
    cap: float | None = None  # largest value of the goal's last own variable
    slopes_below: float = np.inf  # as for `View`
    _last: View | None = field(default=None, repr=False)

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest values of all variables, (n, 2)."""
        bounds = self.goal.bounds.copy()
        if self.cap is not None:
            bounds[-1, 1] = self.cap
        return np.concatenate([self.variables.bounds, bounds, [(0.0, 100.0)] if self.elastic else np.zeros((0, 2))])

    def view(self, x: FloatArray, start: float | None = None) -> View | None:
        """Return the engine's answer for a design and a window; None without one. The last one is kept."""
        start = self.start if start is None else start
        if self._last is None or self._last.start != start or not np.array_equal(self._last.response.x, x):
            poses = poses_of(self.variables.task, start)
            response = respond(self.variables, x, poses.at)
            if response is None:
                return None
            self._last = View(response, poses, start, self.slopes_below)
        return self._last

    def begin(self, x: FloatArray) -> FloatArray | None:
        """Return all variables for a design x (k,), those of the goal fitted to it; None without an answer."""
        view = self.view(x)
        if view is None:
            return None
        z = np.concatenate([x, self.goal.start(view)])
        if not self.elastic:
            return z
        return np.append(z, find_largest_violation(rows for rows in view.list_limits() if rows.name in self.elastic))

    def evaluate(self, z: FloatArray, sloped: bool) -> SeenPoint | None:
        """Return the goal, its rows and those of all limits at the design and the goal's own variables."""
        x, values = np.split(z, [self.variables.count])
        view = self.view(x, self.goal.window_start(values, self.start))
        if view is None:
            return None
        try:
            aim = self.goal.aim(view, values, sloped)
            return replace(aim, rows=[*aim.rows, *view.list_limits(sloped)])
        except NoAnswer:
            return None


LEAST_MIDDLE = 1e-3
BAND_WEIGHT = 10.0
"""On the half band: a solver that begins with the identity for the Hessian takes too small a slope for none."""


class Goal(ABC):
    """A form of the objective."""

    bounds: FloatArray
    """Of its own variables, (o, 2)."""

    @abstractmethod
    def start(self, view: View) -> FloatArray:
        """Return its own variables that fit the design best."""

    def window_start(self, values: FloatArray, otherwise: float) -> float:
        """Return where the window begins [m]: `otherwise`, if that is not one of its own variables."""
        return otherwise

    @abstractmethod
    def aim(self, view: View, values: FloatArray, sloped: bool) -> SeenPoint:
        """Return objective and rows, with derivatives by the design variables and then by its own, or without."""


def unit_of_force(view: View) -> float:
    """Return the bending rigidity of the first beam over the square of the size [N], times the copies."""
    section = next(iter(view.task.network.beams.values())).section
    middle = section.rigidities(np.array([0.5]), 0.5)[0]
    return float(np.real(middle[0])) / view.task.size**2 * view.task.copies


@dataclass(frozen=True)
class Flattest(Goal):
    """The half band s about the level r over the window; its own variables are r [unit of force] and s."""

    bounds = np.array([(LEAST_MIDDLE, np.inf), (0.0, 10.0)])

    def start(self, view: View) -> FloatArray:
        """Return level and half band of the design."""
        force = view.window_force / unit_of_force(view)
        middle = max(0.5 * (force.max() + force.min()), 0.05 * abs(force).max(), LEAST_MIDDLE)
        return np.array([middle, min(10.0, abs(force / middle - 1).max())])

    def aim(self, view: View, values: FloatArray, sloped: bool) -> SeenPoint:
        """Return the half band and its rows."""
        level, band = values
        unit = unit_of_force(view) * level
        ratio = view.window_force / unit
        rows, objective = np.concatenate([1 + band - ratio, ratio - 1 + band]), BAND_WEIGHT * float(band)
        if not sloped:
            return SeenPoint(objective, None, [LimitRows("goal", rows)])
        force_slopes = view.response.force_slopes[view.poses.window] * np.reshape(view.levelling, (-1, 1))
        by_x = view.interpolate(force_slopes) / unit
        by_level = np.concatenate([ratio, -ratio]) / level
        slopes = np.column_stack([np.concatenate([-by_x, by_x]), by_level, np.ones(len(rows))])
        return SeenPoint(objective, _slope_of_last(slopes, BAND_WEIGHT), [LimitRows("goal", rows, slopes)])


def _slope_of_last(slopes: FloatArray, factor: float) -> FloatArray:
    """Return the derivatives of the last of all variables times a factor."""
    return np.append(np.zeros(slopes.shape[1] - 1), factor)


@dataclass(frozen=True)
class Widest(Goal):
    """The start of the window over its end, at a given half band; its own variables are the level r and that share.

    Limits are looked at in the poses of the window, which move with its start; their derivatives by it are left out:
    the largest stress is at its end, which stays.
    """

    end: float
    half_band: float
    bounds = np.array([(LEAST_MIDDLE, np.inf), (0.02, 0.98)])

    def start(self, view: View) -> FloatArray:
        """Return level and window of the design."""
        return np.array([Flattest().start(view)[0], view.poses.at[view.poses.window[0]] / self.end])

    def window_start(self, values: FloatArray, otherwise: float) -> float:
        """Return the start of the window that is wanted."""
        return float(values[1]) * self.end

    def aim(self, view: View, values: FloatArray, sloped: bool) -> SeenPoint:
        """Return the share of the travel before the window, and the rows of the half band."""
        level, share = values
        (rows,) = Flattest().aim(view, np.array([level, self.half_band]), sloped).rows
        if rows.slopes is None:
            return SeenPoint(float(share), None, [rows])
        at = view.poses.at[view.poses.window]
        force = view.response.force[view.poses.window] / (unit_of_force(view) * level)
        moves = (1 - (at - at[0]) / (at[-1] - at[0])) * self.end
        by_share = view.interpolate(_derivative(at, force) * moves)
        slopes = np.column_stack([rows.slopes[:, :-1], np.concatenate([-by_share, by_share])])
        return SeenPoint(float(share), _slope_of_last(slopes, 1.0), [replace(rows, slopes=slopes)])


def _derivative(at: FloatArray, values: FloatArray) -> FloatArray:
    """Return the derivative of the polynomial through values at Chebyshev-Lobatto points."""
    from numpy.polynomial import chebyshev

    t = 2 * (at - at[0]) / (at[-1] - at[0]) - 1
    terms = chebyshev.chebfit(t, values, len(t) - 1)
    return np.asarray(chebyshev.chebval(t, chebyshev.chebder(terms)) * 2 / (at[-1] - at[0]))


@dataclass(frozen=True)
class ForceRatio(Goal):
    """The objective of the paper, F(a)/F(b) - 1, literally; no variables of its own."""

    bounds = np.zeros((0, 2))

    def start(self, view: View) -> FloatArray:
        """Return nothing."""
        return np.zeros(0)

    def aim(self, view: View, values: FloatArray, sloped: bool) -> SeenPoint:
        """Return the objective; it has no rows."""
        at, from_ = view.response.force[view.poses.compared]
        if not sloped:
            return SeenPoint(at / from_ - 1, None, [])
        by_at, by_from = view.response.force_slopes[view.poses.compared]
        return SeenPoint(at / from_ - 1, by_at / from_ - at * by_from / from_**2, [])

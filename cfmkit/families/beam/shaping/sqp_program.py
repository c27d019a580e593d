"""A task for one order and one window as a program of `cfmkit.designing`: the goal's rows and those of all limits.

Objectives: smooth forms with auxiliary variables beside the design variables. [Lan, eq. 1] compares the force at two
displacements, F(a)/F(b) - 1. Nothing bounds that from below: a mechanism that snaps through between b and a reaches
-1 and less. The flattest force over a window has no such escape: with s the half band and r its middle, s is least
subject to r (1 - s) <= F <= r (1 + s). That is asked of the polynomial through the poses of the window, at three
times as many places: a force that is out of the band between poses is out of the band.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010), eq. 1 and table 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Protocol

import numpy as np

from cfmkit.designing.objective_and_constraints import DesignProgram, LimitRows, SeenPoint, worst
from cfmkit.families.beam.shaping.limits import rows_of
from cfmkit.families.beam.shaping.response import NoAnswer, PosePlan, View, poses_of, respond

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
    # derivatives of rows of stress, envelopes and clearance that hold by more than this are left out: no step that can
    # be trusted makes them miss. The rows themselves are all there
    slopes_below: float = np.inf
    _last: View | None = field(default=None, repr=False)

    @property
    def poses(self) -> PosePlan:
        """The poses for the window that begins at `start`."""
        return poses_of(self.variables.task, self.start)

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest values of all variables, (n, 2)."""
        bounds = self.goal.bounds.copy()
        if self.cap is not None:
            bounds[-1, 1] = self.cap
        parts = [self.variables.bounds, bounds]
        return np.concatenate([*parts, [(0.0, 100.0)]] if self.elastic else parts)

    def view(self, x: FloatArray, start: float | None = None, sloped: bool = False) -> View | None:
        """Return the engine's answer for a design and a window; None without one. The last one is kept."""
        start = self.start if start is None else start
        if self._last is None or self._last.start != start or not np.array_equal(self._last.response.x, x):
            poses = poses_of(self.variables.task, start)
            response = respond(self.variables, x, poses.at)
            if response is None:
                return None
            self._last = View(response, poses, start, slopes_below=self.slopes_below)
        return replace(self._last, sloped=sloped)

    def begin(self, x: FloatArray) -> FloatArray | None:
        """Return all variables for a design x (k,), those of the goal fitted to it; None without an answer."""
        view = self.view(x)
        if view is None:
            return None
        z = np.concatenate([x, self.goal.start(view)])
        if not self.elastic:
            return z
        return np.append(z, worst(rows for rows in self.limits(view) if rows.name in self.elastic))

    def evaluate(self, z: FloatArray, sloped: bool) -> SeenPoint | None:
        """Return the goal, its rows and those of all limits at the design and the goal's own variables."""
        goal_values = z[self.variables.count :]
        view = self.view(z[: self.variables.count], self.goal.window_start(goal_values, self.start), sloped)
        if view is None:
            return None
        try:
            aim, limits = self.goal.aim(view, goal_values), self.limits(view)
        except NoAnswer:
            return None
        if aim.by_x is None or aim.rows_by_x is None:
            return SeenPoint(aim.value, None, [LimitRows("goal", aim.rows), *limits])
        slopes = np.concatenate([aim.rows_by_x, aim.rows_by_own], axis=1)
        return SeenPoint(
            aim.value, np.concatenate([aim.by_x, aim.by_own]), [LimitRows("goal", aim.rows, slopes), *limits]
        )

    def limits(self, view: View) -> list[LimitRows]:
        """Return the rows of all limits."""
        return rows_of(view)


LEAST_MIDDLE = 1e-3
_REFINEMENT_FACTOR = 3  # a whole number, so that the points at which the force is solved are among the finer ones
BAND_WEIGHT = 10.0
"""On the half band: a solver that begins with the identity for the Hessian takes too small a slope for none."""


@dataclass(frozen=True)
class Aim:
    """Objective and rows at one point, with derivatives by the design variables and by the goal's own ones."""

    value: float
    by_x: FloatArray | None
    by_own: FloatArray
    rows: FloatArray
    rows_by_x: FloatArray | None
    rows_by_own: FloatArray


class Goal(Protocol):
    """A form of the objective."""

    bounds: FloatArray
    """Of its own variables, (o, 2)."""

    def start(self, view: View) -> FloatArray:
        """Return its own variables that fit the design best."""

    def window_start(self, values: FloatArray, otherwise: float) -> float:
        """Return where the window begins [m]: `otherwise`, if that is not one of its own variables."""

    def aim(self, view: View, values: FloatArray) -> Aim:
        """Return objective and rows."""


def window_force(view: View) -> FloatArray:
    """Return the force at many places of the window [N]: the polynomial through its poses.

    Where the force is to follow a curve it is divided by that, so that what is flat follows it.
    """
    return np.asarray(
        _finer(len(view.poses.window)) @ (view.response.state.force[view.poses.window] * _levelling(view))
    )


def _levelling(view: View) -> FloatArray | float:
    """Return what makes a force level that follows the task's curve, at the poses of the window; 1 without one."""
    task = view.response.variables.task
    return 1.0 if task.shape is None else 1.0 / task.shape.evaluate(view.poses.at[view.poses.window] * task.layers)


@cache
def _finer(count: int) -> FloatArray:
    """Return the matrix from values at Chebyshev-Lobatto points to values at three times as many, in order."""
    from numpy.polynomial import chebyshev

    coarse, fine = (-np.cos(np.linspace(0, np.pi, n)) for n in (count, _REFINEMENT_FACTOR * (count - 1) + 1))
    return np.asarray(chebyshev.chebvander(fine, count - 1) @ np.linalg.inv(chebyshev.chebvander(coarse, count - 1)))


def unit_of_force(view: View) -> float:
    """Return the bending rigidity of the first beam over the square of the size [N], times the copies."""
    task = view.response.variables.task
    section = next(iter(task.network.beams.values())).section
    middle = section.rigidities(np.array([0.5]), 0.5)[0]
    return float(np.real(middle[0])) / task.size**2 * task.copies


@dataclass(frozen=True)
class Flattest:
    """The half band s about the level r over the window; its own variables are r [unit of force] and s."""

    bounds = np.array([(LEAST_MIDDLE, np.inf), (0.0, 10.0)])

    def start(self, view: View) -> FloatArray:
        """Return level and half band of the design."""
        force = window_force(view) / unit_of_force(view)
        middle = max(0.5 * (force.max() + force.min()), 0.05 * abs(force).max(), LEAST_MIDDLE)
        return np.array([middle, min(10.0, abs(force / middle - 1).max())])

    def window_start(self, values: FloatArray, otherwise: float) -> float:
        """Return the given start."""
        return otherwise

    def aim(self, view: View, values: FloatArray) -> Aim:
        """Return the half band and its rows."""
        level, band = values
        unit = unit_of_force(view) * level
        ratio = window_force(view) / unit
        rows = np.concatenate([1 + band - ratio, ratio - 1 + band])
        by_own = np.ones((len(rows), 2))
        by_own[:, 0] = np.concatenate([ratio, -ratio]) / level
        if not view.sloped:
            return Aim(BAND_WEIGHT * float(band), None, np.array([0.0, BAND_WEIGHT]), rows, None, by_own)
        levelling = _levelling(view) if np.ndim(_levelling(view)) == 0 else np.asarray(_levelling(view))[:, None]
        slope = _finer(len(view.poses.window)) @ (view.response.force_slopes[view.poses.window] * levelling) / unit
        by_x = np.concatenate([-slope, slope])
        return Aim(BAND_WEIGHT * float(band), np.zeros(by_x.shape[1]), np.array([0.0, BAND_WEIGHT]), rows, by_x, by_own)


@dataclass(frozen=True)
class Widest:
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

    def aim(self, view: View, values: FloatArray) -> Aim:
        """Return the share of the travel before the window, and the rows of the half band."""
        flat = Flattest().aim(view, np.array([values[0], self.half_band]))
        level, share = values
        at = view.poses.at[view.poses.window]
        force = view.response.state.force[view.poses.window] / (unit_of_force(view) * level)
        moves = (1 - (at - at[0]) / (at[-1] - at[0])) * self.end
        by_share = _finer(len(at)) @ (_derivative(at, force) * moves)
        by_own = np.stack([flat.rows_by_own[:, 0], np.concatenate([-by_share, by_share])], axis=1)
        return Aim(float(share), flat.by_x, np.array([0.0, 1.0]), flat.rows, flat.rows_by_x, by_own)


def _derivative(at: FloatArray, values: FloatArray) -> FloatArray:
    """Return the derivative of the polynomial through values at Chebyshev-Lobatto points."""
    from numpy.polynomial import chebyshev

    t = 2 * (at - at[0]) / (at[-1] - at[0]) - 1
    terms = chebyshev.chebfit(t, values, len(t) - 1)
    return np.asarray(chebyshev.chebval(t, chebyshev.chebder(terms)) * 2 / (at[-1] - at[0]))


@dataclass(frozen=True)
class ForceRatio:
    """The objective of the paper, F(a)/F(b) - 1, literally; no variables of its own."""

    bounds = np.zeros((0, 2))

    def start(self, view: View) -> FloatArray:
        """Return nothing."""
        return np.zeros(0)

    def window_start(self, values: FloatArray, otherwise: float) -> float:
        """Return the given start."""
        return otherwise

    def aim(self, view: View, values: FloatArray) -> Aim:
        """Return the objective; it has no rows."""
        at, from_ = view.response.state.force[view.poses.compared]
        none = np.zeros((0, len(view.response.x)))
        if not view.sloped:
            return Aim(at / from_ - 1, None, values, values, None, np.zeros((0, 0)))
        by_at, by_from = view.response.force_slopes[view.poses.compared]
        return Aim(at / from_ - 1, by_at / from_ - at * by_from / from_**2, values, values, none, np.zeros((0, 0)))

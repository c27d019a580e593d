"""A task for one order and one window as a program of `cfmkit.numerics.sqp`: the goal's rows and those of all limits.

An elastic program lets some limits give way, all by the same amount, and minimises that amount: zero where the
limits can be met together, and where they cannot, the least by which they are missed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.beam.shaping.limits import LIMITS, Rows, View
from cfmkit.families.beam.shaping.poses import Poses, poses_of
from cfmkit.families.beam.shaping.response import NoAnswer, respond

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.shaping.goals import Aim, Goal
    from cfmkit.families.beam.shaping.variables import Variables


@dataclass(eq=False)
class Shaping:
    """The design variables, then the goal's own ones: what `cfmkit.numerics.sqp.minimize` wants to know of them.

    Attributes
    ----------
    variables, start, goal : Variables, float, Goal
        What varies, where the window begins [m], what is minimised.
    elastic : tuple of str
        Limits that may give way; the last variable is by how much, and is minimised in place of the goal.
    cap : float, optional
        Largest value of the goal's last own variable.
    """

    variables: Variables
    start: float
    goal: Goal
    elastic: tuple[str, ...] = ()
    cap: float | None = None
    _last: View | None = field(default=None, repr=False)

    @property
    def poses(self) -> Poses:
        """The poses for the window at the beginning."""
        return poses_of(self.variables.task, self.start)

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest values of all variables, (n, 2)."""
        own = self.goal.bounds.copy()
        if self.cap is not None:
            own[-1, 1] = self.cap
        parts = [self.variables.bounds, own]
        return np.concatenate([*parts, [(0.0, 100.0)]] if self.elastic else parts)

    def view(self, x: FloatArray, start: float | None = None, sloped: bool = False) -> View | None:
        """Return the engine's answer for a design and a window; None without one. The last one is kept."""
        start = self.start if start is None else start
        if self._last is None or self._last.start != start or not np.array_equal(self._last.response.x, x):
            poses = poses_of(self.variables.task, start)
            found = respond(self.variables, x, poses.at)
            if found is None:
                return None
            self._last = View(found, poses, start)
        return replace(self._last, sloped=sloped)

    def begin(self, x: FloatArray) -> FloatArray | None:
        """Return all variables for a design x (k,), those of the goal fitted to it; None without an answer."""
        view = self.view(x)
        if view is None:
            return None
        z = np.concatenate([x, self.goal.start(view)])
        if not self.elastic:
            return z
        worst = max((-rows.values.min(initial=0.0) for name in self.elastic for rows in LIMITS[name](view)), default=0)
        return np.append(z, worst)

    def at(self, z: FloatArray, sloped: bool) -> View | None:
        """Return what is seen at the point z."""
        own = z[self.variables.count : self.variables.count + len(self.goal.bounds)]
        return self.view(z[: self.variables.count], self.goal.window_start(own, self.start), sloped)

    def values(self, z: FloatArray) -> tuple[float, FloatArray] | None:
        """Return objective and constraints."""
        view = self.at(z, False)
        if view is None:
            return None
        aim, limits = self._aim(view, z), self.limits(view)
        slack = z[-1] if self.elastic else 0.0
        rows = [one.values + (slack if name in self.elastic else 0.0) for name, many in limits for one in many]
        return (slack if self.elastic else aim.value), np.concatenate([aim.rows, *rows])

    def slopes(self, z: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return their derivatives."""
        view = self.at(z, True)
        if view is None:
            return None
        try:
            aim, limits = self._aim(view, z), self.limits(view)
        except NoAnswer:
            return None
        k, n = self.variables.count, len(z)
        own = slice(k, k + len(self.goal.bounds))
        objective, top = np.zeros(n), np.zeros((len(aim.rows), n))
        top[:, :k], top[:, own] = aim.rows_by_x, aim.rows_by_own
        if self.elastic:
            objective[-1] = 1.0
        else:
            objective[:k], objective[own] = aim.by_x, aim.by_own
        rows = [self._wide(one, name in self.elastic, n) for name, many in limits for one in many]
        return objective, np.concatenate([top, *rows])

    def limits(self, view: View) -> list[tuple[str, list[Rows]]]:
        """Return the rows of all limits, by name."""
        return [(name, make(view)) for name, make in LIMITS.items()]

    def _aim(self, view: View, z: FloatArray) -> Aim:
        k = self.variables.count
        return self.goal.aim(view, z[k : k + len(self.goal.bounds)])

    def _wide(self, rows: Rows, gives: bool, n: int) -> FloatArray:
        """Return derivatives by all variables."""
        out = np.zeros((len(rows.values), n))
        out[:, : self.variables.count] = rows.slopes
        if gives:
            out[:, -1] = 1.0
        return out

"""A task for one order and one window as a program of `cfmkit.designing`: the goal's rows and those of all limits."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing import sqp_program
from cfmkit.designing.limits import worst
from cfmkit.designing.sqp_program import LimitRows, SeenPoint
from cfmkit.families.beam.shaping.limits import LIMITS
from cfmkit.families.beam.shaping.response import NoAnswer, PosePlan, View, poses_of, respond

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.shaping.goals import Goal
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
    def poses(self) -> PosePlan:
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
        return np.append(z, worst(rows for name in self.elastic for rows in LIMITS[name](view)))

    def values(self, z: FloatArray) -> tuple[float, FloatArray] | None:
        """Return objective and constraints."""
        return sqp_program.values(self, z, self.elastic)

    def slopes(self, z: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return their derivatives."""
        return sqp_program.slopes(self, z, self.elastic)

    def seen(self, z: FloatArray, sloped: bool) -> SeenPoint | None:
        """Return the goal, its rows and those of all limits at the design and the goal's own variables."""
        own = z[self.variables.count :]
        view = self.view(z[: self.variables.count], self.goal.window_start(own, self.start), sloped)
        if view is None:
            return None
        try:
            aim, limits = self.goal.aim(view, own), self.limits(view)
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
        return [rows for make in LIMITS.values() for rows in make(view)]

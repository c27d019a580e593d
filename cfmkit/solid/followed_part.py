"""A part as a problem of `cfmkit.numerics.continuation`: scaled unknowns, residual, tangent, modes.

Unknowns are in parts of the part's size, turns in radians. The drive is the travel, or the share of the constant loads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from cfmkit.numerics.continuation.problem import Border, PathEquilibrium
from cfmkit.solid.equilibrium import Balance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.equilibrium import Factors, LinearisedPart, SolidProblem

N_FIRST_POWERS, N_POWERS = 8, 3  # of the flexibility, for the softest mode from any vector and from one nearby
STIFF_SHARE = 1e-2  # flexibility, as a share of a critical one's, that is none
MAX_MODES = 6  # computed at once


class PathGuide(Protocol):
    """Unknowns known from elsewhere, from a coarser mesh."""

    @property
    def branch_steps(self) -> Sequence[FloatArray]:
        """Changes of the unknowns (q,) across bifurcations."""

    def __call__(self, travel: float) -> FloatArray | None:
        """Return the unknowns (q,) at a travel [m or rad]; None if they are not known there."""


@dataclass(frozen=True)
class ScaledTangent:
    """Residual and tangent of a part at one place, for scaled unknowns."""

    linear: LinearisedPart
    rate: FloatArray  # (q,) of the residual by the drive
    scale: FloatArray  # (q,)

    @property
    def residual(self) -> FloatArray:
        """Forces out of balance, (q,)."""
        return self.linear.residual

    @property
    def unstable(self) -> int:
        """Number of unstable directions while the drive is held."""
        return self.linear.factors.negative

    def solve(self, right: FloatArray) -> FloatArray | None:
        """Return the tangent's inverse times columns (q, k), or None if it is singular."""
        try:
            factors = self.linear.factors
        except RuntimeError:
            return None
        return np.column_stack([factors.solve(column) / self.scale for column in right.T])


@dataclass(eq=False)
class FollowedPart:
    """Equilibria of a part over its travel; over the share of its constant loads if the travel is held."""

    problem: SolidProblem
    held_at: float | None = None  # travel [m or rad] at which the constant loads grow
    guide: PathGuide | None = None
    drive_tolerance: float = 1e-7  # equilibria are iterated
    amplitude_slack: float = 0.7  # a mesh is an imperfection
    rest_stiffness: float = math.nan  # of the softest mode of the unloaded part
    recent: tuple[FloatArray, Factors] | None = None  # of a tangent close to that where it was solved last

    @cached_property
    def scale(self) -> FloatArray:
        """Sizes of the unknowns, (q,): [m], or 1 for turns."""
        supports = self.problem.supports
        free = [group.free[2] for group in supports.groups]
        turns = np.concatenate([np.zeros(len(supports.loose)), *free]) != 0.0
        return np.where(turns, 1.0, self.problem.size)

    @cached_property
    def unit(self) -> FloatArray:
        """Natural sizes of the scaled unknowns, (q,)."""
        return np.ones(self.problem.supports.size)

    @cached_property
    def motions(self) -> Any:
        """All unknowns are motions."""
        return np.ones(self.problem.supports.size, bool)

    @cached_property
    def arc_share(self) -> float:
        """Weight of the square of a motion in the arc length."""
        return 1.0 / self.problem.supports.size

    @cached_property
    def _load(self) -> FloatArray:
        """Constant loads on the free motions, (q,) [N or N m]."""
        supports = self.problem.supports
        loads = [group.free.T @ group.load for group in supports.groups]
        return np.concatenate([np.zeros(len(supports.loose)), *loads])

    # -- equilibria ----------------------------------------------------------------------------------------------------
    def equilibrium(self, pose: Balance) -> PathEquilibrium:
        """Return a pose as an equilibrium of the path over the travel."""
        x, rate = pose.unknowns / self.scale, pose.slope / self.scale
        return PathEquilibrium(x, pose.travel, rate, pose.unstable, pose.effort, pose.stiffness)

    def pose(self, at: PathEquilibrium) -> Balance:
        """Return an equilibrium of the path over the travel as a pose."""
        unknowns, slope = at.x * self.scale, at.rate * self.scale
        if math.isnan(at.effort) or math.isnan(at.stiffness):  # not quite at its drive, or singular
            balance = self.problem.solve(unknowns, at.drive)
            if balance is not None and balance.unstable <= at.unstable:
                return balance.drop_factors()
            return self.problem.measure(unknowns, at.drive, slope, at.unstable)
        return Balance(at.drive, unknowns, at.effort, at.stiffness, at.unstable, slope, None)

    def linearise(self, x: FloatArray, drive: float) -> ScaledTangent:
        """Return residual and tangent at any place."""
        if self.held_at is None:
            linear = self.problem.linearise(x * self.scale, drive)
            return ScaledTangent(linear, linear.slope, self.scale)
        linear = self.problem.scale_loads(drive).linearise(x * self.scale, self.held_at)
        return ScaledTangent(linear, -self._load, self.scale)

    def solve(self, x: FloatArray, drive: float, border: Border | None = None) -> PathEquilibrium | None:
        """Return the equilibrium near a guess; under growing loads at their share only."""
        if self.held_at is None:
            if border is not None:
                border = Border(np.append(border.row[:-1] / self.scale, border.row[-1]), border.level)
            balance = self.problem.solve(x * self.scale, drive, border)
        else:
            balance = None if border else self.problem.scale_loads(drive).solve(x * self.scale, self.held_at)
        if balance is None or balance.factors is None:
            return None
        at = self.equilibrium(balance)
        self.recent = at.x, balance.factors
        if self.held_at is None:
            return at
        return PathEquilibrium(at.x, drive, balance.factors.solve(self._load) / self.scale, at.unstable)

    def predict(self, at: PathEquilibrium, goal: float) -> FloatArray | None:
        """Return the unknowns at a drive by what they change by as the guide says; None if it does not know both."""
        if self.guide is None or (guessed := self.guide(at.drive)) is None or (target := self.guide(goal)) is None:
            return None
        return at.x + (target - guessed) / self.scale

    # -- modes ---------------------------------------------------------------------------------------------------------
    def _flexibility(self, at: PathEquilibrium) -> LinearOperator:
        """Return the inverse of the tangent for scaled unknowns, or of one as close as Newton's method ended with."""
        if self.recent is None or self.recent[0] is not at.x:
            tangent = self.linearise(at.x, at.drive)
            self.recent = at.x, tangent.linear.factors
        factors, size = self.recent[1], len(at.x)
        return LinearOperator((size, size), lambda v: factors.solve(v.ravel() / self.scale) / self.scale, dtype=float)

    def modes(self, at: PathEquilibrium, count: int) -> tuple[FloatArray, FloatArray]:
        """Return the eigenvalues nearest to zero, a few at most, and their modes."""
        count = min(count, MAX_MODES, len(at.x) - 1)
        inverse, vectors = eigsh(self._flexibility(at), count, which="LM", v0=self._any_vector)
        order = np.argsort(-np.abs(inverse))
        return 1.0 / inverse[order], vectors[:, order]

    def softest(self, at: PathEquilibrium, guess: FloatArray | None = None) -> tuple[float, FloatArray]:
        """Return the size of the smallest eigenvalue and its mode, better where another is known that is near."""
        operator = self._flexibility(at)
        mode = self._any_vector if guess is None else guess
        for _ in range(N_FIRST_POWERS if guess is None else N_POWERS):
            mode = mode / np.linalg.norm(mode)
            last, mode = mode, operator.matvec(mode)
        return 1.0 / abs(float(last @ mode)), mode

    def is_stiff(self, at: PathEquilibrium, stiffness: float) -> bool:
        """Return True if no eigenvalue is as small as a share of that of the unloaded part, by far."""
        return self.rest_stiffness * stiffness < STIFF_SHARE * self.softest(at)[0]

    @cached_property
    def _any_vector(self) -> FloatArray:
        """Unit vector that has a share of every mode."""
        count = self.problem.supports.size
        vector = np.cos(np.arange(count) * np.arange(1, count + 1))
        return np.asarray(vector / np.linalg.norm(vector))

    def orient(self, modes: FloatArray) -> FloatArray:
        """Return the sum of modes, each with its largest motion negative, or to the side of the guide's branch."""
        steps = [step / self.scale @ modes for step in (self.guide.branch_steps if self.guide else ())]
        sides = -modes[np.abs(modes).argmax(axis=0), np.arange(modes.shape[1])]
        if steps:
            sides = np.array(steps)[np.abs(steps).argmax(axis=0), np.arange(modes.shape[1])]
        return np.asarray(modes @ np.where(sides < 0.0, -1.0, 1.0))

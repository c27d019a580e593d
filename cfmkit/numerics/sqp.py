"""Constrained minimisation of smooth functions with exact slopes: sequential quadratic programming.

The work is done by SLSQP; added are what a model that cannot be evaluated everywhere needs (a step to where it has no
answer is shortened), and the best point seen in place of the last.

Reference
---------
[K] D. Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28 (1988).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

_MISSING_VALUE = 1e3  # what a point without an answer counts, in units of the objective and of the constraints
_MIN_VIOLATION_FALL = 1e-4  # share by which it falls in steps that get somewhere; where they are stuck by 1e-9


class SearchEnding(Enum):
    """Why a minimisation ended."""

    OPTIMUM = "converged to a local optimum"
    STEPS = "stopped after the steps allowed"
    STUCK = "stopped where no step improves it"
    INCOMPATIBLE = "stopped: the constraints contradict each other there"
    NO_ANSWER = "could not begin: the model has no answer at the start"
    OUT_OF_TIME = "stopped when the time was up"


class Program(Protocol):
    """Program to minimise: an objective, and constraints that are to be at least zero, both of order one."""

    def values(self, z: FloatArray) -> tuple[float, FloatArray] | None:
        """Return the objective and the constraints (m,) at z (n,); None if the model has no answer."""

    def slopes(self, z: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return their derivatives by z, (n,) and (m, n)."""


@dataclass(frozen=True)
class Effort:
    """Limits of rounds and time."""

    steps: int = 60  # at most so many
    tolerance: float = 1e-6  # a change of the objective that is small
    violation: float = 1e-5  # what counts as none
    stop: Callable[[], bool] = bool  # asked before each evaluation whether the time is up; `bool()` is False
    enough: float = -np.inf  # end at the first point without violation whose objective is this or less
    # whether to return the point where the steps end, though a better one was seen: of those without violation the best
    # is likely to be one that just counts as such, the last one has next to none if the steps converge
    last: bool = False
    # end where in so many evaluations no point without violation was seen and the worst violation has not fallen by
    # `_MIN_VIOLATION_FALL`: the constraints contradict each other there, and the steps are the rounding of a line
    # search
    patience: int | None = None
    # end where so many evaluations in a row brought no better point: the line search is among rounding, or at a kink
    idle: int | None = None


@dataclass(frozen=True)
class Optimum:
    """The point that was found."""

    z: FloatArray  # (n,) where
    # objective, constraints: there; infinite and none where the model has no answer
    objective: float
    constraints: FloatArray
    ending: SearchEnding  # why the search ended
    evaluations: int  # how often the model was evaluated
    allowed: float  # violation that counts as none

    @property
    def violation(self) -> float:
        """By how much the worst constraint is violated; infinite where the model has no answer."""
        return _largest_violation(self.constraints) if np.isfinite(self.objective) else np.inf

    @property
    def feasible(self) -> bool:
        """Whether all constraints hold but for what counts as none."""
        return self.violation <= self.allowed


def _largest_violation(constraints: FloatArray) -> float:
    return max(0.0, -float(constraints.min(initial=np.inf)))


def minimize(
    program: Program,  # what is minimised
    start: FloatArray,  # (n,): where to begin; moved into the bounds
    bounds: FloatArray,  # (n, 2): lowest and highest values; never left
    effort: Effort | None = None,  # when to end
) -> Optimum:
    """Return the best point found from a start, or the last one where that is requested."""
    effort = effort or Effort()
    z = np.clip(start, *bounds.T)
    memory = _Memory(program, effort)
    try:
        if memory.evaluate(z) is None:
            return memory.optimum(z, None, SearchEnding.NO_ANSWER)
        last, ending = _run_solver(memory, z, bounds)
        if effort.last:
            answer = memory.evaluate(last)
            return memory.optimum(last, answer, ending if answer is not None else SearchEnding.STUCK)
    except _Enough as end:
        ending = end.ending
    if memory.best is None:
        return memory.optimum(z, None, ending)
    _, z, *best = memory.best
    return memory.optimum(z, best, ending)


def _run_solver(memory: _Memory, z: FloatArray, bounds: FloatArray) -> tuple[FloatArray, SearchEnding]:
    """Run the solver; return where it ends and why. Its answers are in the memory."""
    from scipy.optimize import minimize as slsqp

    ending = slsqp(  # type: ignore[call-overload]
        memory.objective,
        z,
        jac=lambda z: memory.slopes_at(z)[0],
        method="SLSQP",
        bounds=[(float(low), float(high)) for low, high in bounds],
        constraints=[{"type": "ineq", "fun": memory.constraints, "jac": lambda z: memory.slopes_at(z)[1]}],
        options={"maxiter": memory.effort.steps, "ftol": memory.effort.tolerance},
    )
    return np.clip(ending.x, *bounds.T), _ENDING_BY_MODE.get(int(ending.status), SearchEnding.STUCK)


_ENDING_BY_MODE = {0: SearchEnding.OPTIMUM, 4: SearchEnding.INCOMPATIBLE, 9: SearchEnding.STEPS}


class _Enough(Exception):
    def __init__(self, ending: SearchEnding) -> None:
        self.ending = ending


class _Memory:
    """The program with its last answers, the best point, and numbers in place of missing answers."""

    def __init__(self, program: Program, effort: Effort) -> None:
        self.program, self.effort = program, effort
        self.evaluations = 0
        self.point: FloatArray | None = None
        self.answer: Any = None
        self.sloped: FloatArray | None = None
        self.slope: Any = None
        self.best: tuple[tuple[float, float], FloatArray, float, FloatArray] | None = None
        self.fell, self.since = np.inf, 0
        self.improved = 0  # evaluations up to the last point that was better

    def evaluate(self, z: FloatArray) -> Any:
        if self.point is None or not np.array_equal(z, self.point):
            if self.effort.stop():
                raise _Enough(SearchEnding.OUT_OF_TIME)
            self.point, self.answer = z.copy(), self.program.values(z)
            self.evaluations += 1
            if self.answer is not None:
                self._keep_best(z, *self.answer)
            if self.best is not None and self.best[0] <= (0.0, self.effort.enough):
                raise _Enough(SearchEnding.OPTIMUM)
        return self.answer

    def _keep_best(self, z: FloatArray, objective: float, constraints: FloatArray) -> None:
        excess = _largest_violation(constraints)
        self._stop_if_stalled(excess)
        rank = (0.0, objective) if excess <= self.effort.violation else (excess, objective)
        if self.best is None or self._is_better(rank):
            self.improved = self.evaluations
        if self.best is None or rank < self.best[0]:
            self.best = rank, z.copy(), objective, constraints
        if self.effort.idle is not None and self.evaluations - self.improved >= self.effort.idle:
            raise _Enough(SearchEnding.STUCK)

    def _is_better(self, rank: tuple[float, float]) -> bool:
        """Return True if a point is better than the best one by more than what counts as nothing."""
        assert self.best is not None
        excess, objective = self.best[0]
        if excess > 0:
            return rank[0] < (1.0 - _MIN_VIOLATION_FALL) * excess
        return rank[0] == 0 and rank[1] < objective - self.effort.tolerance

    def _stop_if_stalled(self, excess: float) -> None:
        patience = self.effort.patience
        if self.fell <= self.effort.violation or patience is None:
            return
        if excess < (1.0 - _MIN_VIOLATION_FALL) * self.fell:
            self.fell, self.since = excess, self.evaluations
        elif self.evaluations - self.since >= patience:
            raise _Enough(SearchEnding.STUCK)

    def optimum(self, z: FloatArray, answer: Any, ending: SearchEnding) -> Optimum:
        """Return a point with its answer, None if the model has none."""
        objective, constraints = (np.inf, np.zeros(0)) if answer is None else answer
        return Optimum(z, objective, constraints, ending, self.evaluations, self.effort.violation)

    def objective(self, z: FloatArray) -> float:
        answer = self.evaluate(z)
        if answer is not None:
            return float(answer[0])
        assert self.best is not None
        return abs(self.best[2]) + _MISSING_VALUE

    def constraints(self, z: FloatArray) -> FloatArray:
        answer = self.evaluate(z)
        if answer is not None:
            return np.asarray(answer[1])
        assert self.best is not None
        return np.asarray(np.minimum(self.best[3], 0.0) - 1.0)

    def slopes_at(self, z: FloatArray) -> Any:
        if self.sloped is None or not np.array_equal(z, self.sloped):
            slopes = self.program.slopes(z)
            if slopes is None and self.slope is None:
                raise _Enough(SearchEnding.STUCK)
            self.slope = self.slope if slopes is None else slopes
            self.sloped = z.copy()
        return self.slope

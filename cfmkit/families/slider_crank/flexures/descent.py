"""The optimiser's steps on a strip program: sequential quadratic programming with exact slopes.

Where a step leads to a strip that has no equilibrium, it is shortened: such a point counts as far outside.

Reference
---------
[K] D. Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28 (1988).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.curves import FloatArray
    from cfmkit.families.slider_crank.flexures.program import StripProgram

VIOLATION = 5e-3
"""Of a constraint that counts as none: 0.005 % of the force, 0.05 % of the stress allowed."""

_FAR = 50.0  # how far outside a point without an answer counts


class Ending(Enum):
    """Why the steps ended."""

    OPTIMUM = "converged to a local optimum"
    STEPS = "stopped after the steps allowed"
    STUCK = "stopped where no step improves it"
    INCOMPATIBLE = "stopped: the constraints contradict each other there"
    NO_ANSWER = "could not begin: the first strip has no equilibrium over the travel"


_ENDINGS = {0: Ending.OPTIMUM, 4: Ending.INCOMPATIBLE, 9: Ending.STEPS}


@dataclass(frozen=True)
class Descent:
    """Where the steps ended: variables, objective, largest violation, why, and how many strips were pressed."""

    z: FloatArray
    objective: float
    violation: float
    ending: Ending
    evaluations: int

    @property
    def feasible(self) -> bool:
        """Whether all constraints hold but for `VIOLATION`."""
        return self.violation <= VIOLATION


def descend(
    program: StripProgram, start: FloatArray, bounds: FloatArray, steps: int = 100, tolerance: float = 1e-6
) -> Descent:
    """Return the optimum found from a start.

    Parameters
    ----------
    program : StripProgram
        What is minimised.
    start : (n,) array
        Moved into the bounds first.
    bounds : (n, 2) array
        Smallest and largest values.
    steps : int
        At most.
    tolerance : float
        Change of the objective that ends the search.
    """
    from scipy.optimize import minimize

    z = np.clip(start, *bounds.T)
    if program.values(z) is None:
        return Descent(z, np.inf, np.inf, Ending.NO_ANSWER, program.solved)
    answers = _Answers(program, z)
    found: Any = minimize(  # type: ignore[call-overload]
        answers.objective,
        z,
        jac=lambda x: answers.slopes(x)[0],
        method="SLSQP",
        bounds=list(map(tuple, bounds)),
        constraints=[{"type": "ineq", "fun": answers.constraints, "jac": lambda x: answers.slopes(x)[1]}],
        options={"maxiter": steps, "ftol": tolerance},
    )
    z = np.clip(found.x, *bounds.T)
    answer = program.values(z)
    ending = _ENDINGS.get(int(found.status), Ending.STUCK)
    if answer is None:
        return Descent(z, np.inf, np.inf, Ending.STUCK, program.solved)
    return Descent(z, answer[0], max(0.0, -float(answer[1].min(initial=np.inf))), ending, program.solved)


class _Answers:
    """Values and slopes; where there are none, numbers that send the line search back."""

    def __init__(self, program: StripProgram, z: FloatArray) -> None:
        self.program = program
        self.good = program.values(z)
        self.slope, self.sloped = program.slopes(z), z.copy()

    def _at(self, z: FloatArray) -> Any:
        answer = self.program.values(z)
        if answer is not None:
            self.good = answer
        return answer

    def objective(self, z: FloatArray) -> float:
        answer = self._at(z)
        assert self.good is not None
        return float(answer[0]) if answer is not None else abs(float(self.good[0])) + _FAR

    def constraints(self, z: FloatArray) -> FloatArray:
        answer = self._at(z)
        assert self.good is not None
        return np.asarray(answer[1] if answer is not None else np.minimum(self.good[1], 0.0) - _FAR)

    def slopes(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        if not np.array_equal(z, self.sloped):
            self.slope, self.sloped = self.program.slopes(z) or self.slope, z.copy()
        assert self.slope is not None
        return self.slope

"""The optimiser's steps on a strip program: sequential quadratic programming with exact slopes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.numerics.sqp import Effort, Optimum, minimize

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.flexures.program import StripProgram

VIOLATION = 5e-3
"""Of a constraint that counts as none: 0.005 % of the force, 0.05 % of the stress allowed."""


def descend(
    program: StripProgram, start: FloatArray, bounds: FloatArray, steps: int = 100, tolerance: float = 1e-6
) -> Optimum:
    """Return where the steps from a start end.

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
    return minimize(program, start, bounds, Effort(steps, tolerance, VIOLATION, last=True))

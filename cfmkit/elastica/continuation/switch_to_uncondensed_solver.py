"""Paths on which the interior of beams cannot be condensed out: when to follow them with all unknowns.

Half a pinned column is a critical cantilever all along its buckled path, a quarter of a clamped one right before it
buckles. Newton's method with condensation is at the mercy of rounding there: a pivot that is not let go to zero makes
it converge, slowly. Clamped columns of slenderness 1000 and 3000, slightly bent, stall at an eighth of their critical
shortening without this.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.continuation.path_and_moves import Resume
from cfmkit.elastica.equilibrium.uncondensed_solver import UncondensedSolver

if TYPE_CHECKING:
    from cfmkit.elastica.continuation.path_and_moves import PathProblem, Trail

_STRAIGHT = 1e3  # largest dimensionless force of beams that are not pulled straight
_MOST_SEGMENTS = 600  # of a network: the tangent is full, 6 unknowns a segment; 2000 segments take minutes a solution
_SHORT = 1e-4  # share of the drive's range that is a short step


def pulled_straight(trail: Trail) -> bool:
    """Tell whether a path has come to where a beam is pulled straight: condensation is regular there, and forces soar.

    Where all beams stretch forces do not soar.
    """
    if all(beam.section.axial for beam in trail.solver.layout.network.beams.values()):
        return False
    forces = trail.points.y[-1:, trail.solver.n_free : trail.solver.n]
    return bool(np.abs(forces).max(initial=0.0) > _STRAIGHT)


def uncondensed(problem: PathProblem, trail: Trail, wrong: int = 0) -> Resume | None:
    """Go on with nothing condensed out; None where the path does so already, is only judged, or pulled straight.

    None, too, where that would take more than `_MOST_SEGMENTS`.

    The last points that are `wrong` are taken back, and short steps before: what they led to may be a limit point, not
    to be jumped over.
    """
    plain = trail.solver
    if pulled_straight(trail) or isinstance(plain, UncondensedSolver) or problem.control.branch == "stop":
        return None
    if plain.n_segments > _MOST_SEGMENTS:
        return None
    trail = trail.changed(solver=UncondensedSolver(plain)).up_to(len(trail.points) - wrong)
    while _may_be_shorter(problem, trail):
        trail = trail.up_to(-1)
    step = trail.last_step if len(trail.points) > 1 else np.inf
    return Resume(trail, trail.spot(-1), 0.5 * step)


def _may_be_shorter(problem: PathProblem, trail: Trail) -> bool:
    """Tell whether a path ends with a short step on its branch, in which nothing happened that was reported."""
    if len(trail.points) < 3 or trail.branches[-2] != trail.branch:
        return False
    if not 0.0 < trail.last_step < _SHORT * problem.span:
        return False
    low, high = sorted(trail.points.drive[-2:].tolist())
    return not any(low <= event.drive / problem.unit <= high for event in trail.events)

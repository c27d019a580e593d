"""Steps by the arc length, where the drive does not lead [Ri]."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.problem import Border, arc_weights, force_change, largest_motion
from cfmkit.numerics.continuation.steps import CHORD_COSINE, FORCE_SHARE, ROUNDING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.path import Options
    from cfmkit.numerics.continuation.problem import ContinuationProblem, PathEquilibrium

MISSED_SHARE = 0.4  # of a step by which the tangent may miss
GOOD_MISS = 0.05  # below which the next step is longer
GROWTH = 1.6
TURN_COSINE = 0.7  # between the tangents at both ends of a step: at least
SHORTEST_SHARE, SHORTEST = 1e-9, 1e-12  # of the first step, and at all


class ArcStep(NamedTuple):
    """An equilibrium at an arc length from another."""

    new: PathEquilibrium
    tangent: FloatArray  # (n + 1,) of unit length, in the sense of travel
    missed: float  # by the prediction


def unit_tangent(problem: ContinuationProblem, at: PathEquilibrium, along: FloatArray, span: float) -> FloatArray:
    """Return d(x, drive) of unit arc length at an equilibrium, in the sense of another direction, (n + 1,)."""
    weights, tangent = arc_weights(problem, span), np.append(at.rate, 1.0)
    tangent /= np.sqrt(weights @ tangent**2)
    return tangent if (weights * along) @ tangent >= 0 else -tangent


def step_along(
    problem: ContinuationProblem, here: PathEquilibrium, tangent: FloatArray, length: float, span: float
) -> ArcStep | None:
    """Return the equilibrium at a length along the unit tangent from here."""
    weights, place = arc_weights(problem, span), np.append(here.x, here.drive)
    guess, row = place + length * tangent, weights * tangent
    new = correct(problem, guess[:-1], float(guess[-1]), Border(row, float(row @ place) + length))
    if new is None:
        return None
    missed = np.sqrt(weights @ (np.append(new.x, new.drive) - guess) ** 2)
    return ArcStep(new, unit_tangent(problem, new, tangent, span), float(missed))


class ArcMove(NamedTuple):
    """An accepted step along the arc."""

    old: PathEquilibrium
    new: PathEquilibrium
    tangent_before: FloatArray
    tangent: FloatArray
    length: float

    @property
    def folds(self) -> bool:
        """True if the drive turns back within the step."""
        return bool(self.tangent[-1] * self.tangent_before[-1] < 0)


def follow_arc(
    problem: ContinuationProblem, here: PathEquilibrium, tangent: FloatArray, length: float, options: Options
) -> Iterator[ArcMove]:
    """Yield accepted steps along the arc from an equilibrium, until none is found."""
    first, weights = length, arc_weights(problem, options.span)
    while length > max(SHORTEST_SHARE * first, SHORTEST):
        step = step_along(problem, here, tangent, length, options.span)
        if (
            step is None
            or not _accept(problem, here, step, tangent, length, options)
            or ((weights * step.tangent) @ tangent < TURN_COSINE)
        ):
            length *= 0.5
            continue
        yield ArcMove(here, step.new, tangent, step.tangent, length)
        here, tangent = step.new, step.tangent
        if step.missed < GOOD_MISS * length:
            length *= GROWTH


def _accept(
    problem: ContinuationProblem,
    here: PathEquilibrium,
    step: ArcStep,
    before: FloatArray,
    length: float,
    options: Options,
) -> bool:
    """Return True if a step is short enough and its motions go the way that the tangents at both its ends say.

    Forces may lead the arc length: where they do, a step over a sharp corner to the mirror image is told by motions.
    """
    chord, motions = step.new.x - here.x, problem.motions
    moved = largest_motion(problem, chord)
    if step.missed > MISSED_SHARE * length or moved > options.largest_motion:
        return False
    if force_change(problem, here.x, step.new.x, options.largest_force, FORCE_SHARE) > 1.5:
        return False
    if moved <= ROUNDING:
        return True
    size = float(np.linalg.norm(chord[motions]))
    ends = (tangent[:-1][motions] for tangent in (before, step.tangent))
    return all(chord[motions] @ end >= CHORD_COSINE * size * np.linalg.norm(end) for end in ends)

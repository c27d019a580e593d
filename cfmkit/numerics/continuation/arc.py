"""Steps by the arc length, where the drive does not lead [Ri]: a single step, and the iterator of accepted ones."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.numerics.continuation.problem import Border, arc_weights, force_change, largest_motion
from cfmkit.numerics.continuation.steps import CHORD_COSINE, FORCE_SHARE, MOTION_ROUNDING, correct

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.path import Options
    from cfmkit.numerics.continuation.problem import ContinuationProblem, PathEquilibrium

MISSED_SHARE = 0.4  # of a step by which the tangent may miss
GOOD_MISS = 0.05  # below which the next step is longer
STEP_GROWTH = 1.6
LONGEST_BEND = 2.0  # times the step before, up to which the cubic through its ends says where the next one leads
N_HALVINGS = 12  # until a guess within a step lies at its drive
TURN_COSINE = 0.7  # between the tangents at both ends of a step: at least
SHORTEST_SHARE, MIN_STEP_LENGTHS = 1e-9, 1e-12  # of the first step, and at all


class ArcStep(NamedTuple):
    """An equilibrium at an arc length from another."""

    new: PathEquilibrium
    tangent: FloatArray  # (n + 1,) of unit length, in the sense of travel
    missed: float  # by the prediction


def unit_tangent(problem: ContinuationProblem, at: PathEquilibrium, along: FloatArray, span: float) -> FloatArray:
    """Return d(x, drive) of unit arc length at an equilibrium, in the sense of another direction, (n + 1,)."""
    weights, tangent = arc_weights(problem, span), np.empty(len(at.x) + 1)
    tangent[:-1], tangent[-1] = at.rate, 1.0
    weighted = weights * tangent
    return tangent * (math.copysign(1.0, weighted @ along) / math.sqrt(weighted @ tangent))


def step_along(
    problem: ContinuationProblem,
    start: PathEquilibrium,
    tangent: FloatArray,
    length: float,
    span: float,
    bend: FloatArray | None = None,
) -> ArcStep | None:
    """Return the equilibrium at a length along the unit tangent from here; `bend` is added to the first guess."""
    weights, place = arc_weights(problem, span), start.place
    guess, row = place + length * tangent, weights * tangent
    first = guess if bend is None else guess + bend
    new = correct(problem, first[:-1], float(first[-1]), Border(row, float(row @ place) + length))
    if new is None:
        return None
    missed = new.place - guess
    return ArcStep(new, unit_tangent(problem, new, tangent, span), math.sqrt(weights @ (missed * missed)))


class ArcMove(NamedTuple):
    """An accepted step along the arc."""

    old: PathEquilibrium
    new: PathEquilibrium
    tangent_before: FloatArray
    tangent: FloatArray
    length: float

    def interpolate(self, goal: float) -> FloatArray:
        """Return the unknowns at a drive between its ends by the cubic in the arc length through them."""
        first, last, starts, ends = self._ends
        drives = float(first[-1]), float(last[-1]), float(starts[-1]), float(ends[-1])
        low, high, rising = 0.0, 1.0, self.new.drive > self.old.drive
        for _ in range(N_HALVINGS):
            s = 0.5 * (low + high)
            drive = _cubic(*drives, s)
            low, high = (s, high) if (drive < goal) == rising else (low, s)
        return np.asarray(_cubic(first[:-1], last[:-1], starts[:-1], ends[:-1], 0.5 * (low + high)))

    def bend(self, length: float) -> FloatArray:
        """Return by how much the cubic through both ends leaves the last tangent at a length behind them."""
        cubic = _cubic(*self._ends, 1 + length / self.length)
        return np.asarray(cubic - self.new.place - length * self.tangent)

    @property
    def _ends(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Places and slopes at both ends."""
        return self.old.place, self.new.place, self.length * self.tangent_before, self.length * self.tangent

    @property
    def folds(self) -> bool:
        """True if the drive turns back within the step."""
        return bool(self.tangent[-1] * self.tangent_before[-1] < 0)


def _cubic(first: Any, last: Any, slope_first: Any, slope_last: Any, s: float) -> Any:
    """Return the cubic with these values and slopes at 0 and 1."""
    r = 1 - s
    return r * r * ((1 + 2 * s) * first + s * slope_first) + s * s * ((1 + 2 * r) * last - r * slope_last)


def follow_arc(
    problem: ContinuationProblem, current: PathEquilibrium, tangent: FloatArray, length: float, options: Options
) -> Iterator[ArcMove]:
    """Yield accepted steps along the arc from an equilibrium, until none is found."""
    first, weights = length, arc_weights(problem, options.span)
    before: ArcMove | None = None
    while length > max(SHORTEST_SHARE * first, MIN_STEP_LENGTHS):
        bend = before.bend(length) if before is not None and length <= LONGEST_BEND * before.length else None
        step = step_along(problem, current, tangent, length, options.span, bend)
        if (
            step is None
            or not _accept(problem, current, step, tangent, length, options)
            or ((weights * step.tangent) @ tangent < TURN_COSINE)
        ):
            length *= 0.5
            continue
        before = ArcMove(current, step.new, tangent, step.tangent, length)
        yield before
        current, tangent = step.new, step.tangent
        if step.missed < GOOD_MISS * length:
            length *= STEP_GROWTH


def _accept(
    problem: ContinuationProblem,
    start: PathEquilibrium,
    step: ArcStep,
    before: FloatArray,
    length: float,
    options: Options,
) -> bool:
    """Return True if a step is short enough and its motions go the way that the tangents at both its ends say.

    Forces may lead the arc length: where they do, a step over a sharp corner to the mirror image is told by motions.
    """
    chord, motions = step.new.x - start.x, problem.motions
    moved = largest_motion(problem, chord)
    if step.missed > MISSED_SHARE * length or moved > options.largest_motion:
        return False
    if force_change(problem, start.x, step.new.x, options.largest_force, FORCE_SHARE) > 1.5:
        return False
    if moved <= MOTION_ROUNDING:
        return True
    moving_chord, ends = chord[motions], [tangent[:-1][motions] for tangent in (before, step.tangent)]
    size = math.sqrt(moving_chord @ moving_chord)
    return all(moving_chord @ end >= CHORD_COSINE * size * math.sqrt(end @ end) for end in ends)

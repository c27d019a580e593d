"""The path between two points of a piece: sampled, and searched for where a condition is just met."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.contact.piece import FEWEST_SAMPLES, StepsOfPiece, cubic_weights
from cfmkit.numerics.continuation.problem import arc_weights, largest_motion
from cfmkit.numerics.continuation.steps import correct, hermite

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.piece import PieceOfPath
    from cfmkit.numerics.continuation.problem import PathEquilibrium

MAX_SAMPLES = 400  # of a step
MAX_HALVINGS = 30  # halvings of a step, in which it is looked for where a contact still sticks
MAX_MISS = 1.0  # motions of a step by which a located change may lie off its guess
BESIDE_STEP = 0.02  # of a step, by which a change may lie beside it: then it is at its end


@dataclass(frozen=True, eq=False)
class StepBetween:
    """Path between two points of a piece, by the cubic through them, or the chord where slopes are steep."""

    part: PieceOfPath
    first: PathEquilibrium
    last: PathEquilibrium

    @cached_property
    def _steps(self) -> StepsOfPiece:
        return StepsOfPiece.from_states(self.part, (self.first, self.last))

    @property
    def moved(self) -> float:
        """Largest motion of the step."""
        return float(self._steps.moved[0])

    @cached_property
    def shares(self) -> FloatArray:
        """Places at which gaps and forces are looked at, from 0 to 1: so dense that no obstacle is passed."""
        wanted = np.ceil(self._steps.wanted_samples[0])
        return cubic_weights(int(np.clip(wanted, FEWEST_SAMPLES, MAX_SAMPLES)))[:, 1]

    @cached_property
    def values(self) -> FloatArray:
        """Values of all conditions there, (rows, shares)."""
        seen = self.part.seen_between.pop((self.first.drive, self.last.drive), None)
        if seen is not None and seen.shape[-1] == len(self.shares):
            return seen
        return self._steps.values(len(self.shares) - 1)[:, 0]

    @cached_property
    def roundings(self) -> FloatArray:
        """By how much each condition may be negative, (rows,)."""
        return self.part.conditions.roundings(self.values)

    def find_negative(self, row: int) -> list[int]:
        """Return at which shares behind the first one a condition is violated."""
        return (np.flatnonzero(self.values[row, 1:] < -self.roundings[row]) + 1).tolist()

    @property
    def travel(self) -> float:
        """Sense in which the drive goes."""
        return 1.0 if self.last.drive >= self.first.drive else -1.0

    def interpolate(self, share: float) -> tuple[FloatArray, float]:
        """Return the unknowns (n,) and the drive at a share of the step."""
        if share == 1.0:
            return self.last.x, self.last.drive
        drive = self.first.drive + share * (self.last.drive - self.first.drive)
        if self._steps.are_smooth[0]:
            return hermite(self.first, self.last, drive), drive
        return self.first.x + share * (self.last.x - self.first.x), drive

    def guess(self, share: float) -> PathEquilibrium:
        """Return the interpolated place at a share of the step."""
        x, drive = self.interpolate(share)
        return self.first._replace(x=x, drive=drive)

    def solve(self, share: float) -> PathEquilibrium | None:
        """Return the equilibrium of the piece at a share of the step."""
        x, drive = self.interpolate(share)
        problem, guess = self.part.own_problem, x[self.part.own_mask]
        at = correct(problem, guess, drive)
        if at is None or largest_motion(problem, at.x - guess) > MAX_MISS * self.moved + 1e-9:
            return None
        return at

    def crossing(self, row: int) -> float | None:
        """Return the first share at which a condition is just met, by straight lines; None if it is not violated."""
        values, below = self.values[row], self.find_negative(row)
        if not below:
            return None
        before, after = values[below[0] - 1 : below[0] + 1].tolist()
        part = 0.0 if before <= 0 else before / (before - after)
        low, high = self.shares[below[0] - 1 : below[0] + 1].tolist()
        return low + part * (high - low)  # type: ignore[no-any-return]

    @cached_property
    def _follows_drive(self) -> bool:
        """True if motions go on with the drive at both ends: no limit point lies between them."""
        moves = self.part.whole.motions
        chord, travel = (self.last.x - self.first.x)[moves], self.last.drive - self.first.drive
        return bool(self._steps.are_smooth[0]) and all(
            float(at.rate[moves] @ chord) * travel > 0 for at in (self.first, self.last)
        )

    def find_share(self, at: PathEquilibrium, piece: PieceOfPath | None = None) -> float:
        """Return at which share of the step an equilibrium lies: by its drive, or by motions that do not follow it.

        It has the unknowns of another `piece` if that is given.
        """
        if self._follows_drive:
            return float((at.drive - self.first.drive) / (self.last.drive - self.first.drive))
        at = at if piece is None else piece.carry(at, self.part)
        weights = arc_weights(self.part.whole, self.part.options.span)
        chord, offset = self.last.place - self.first.place, at.place - self.first.place
        finite = np.isfinite(weights)
        return float((weights * chord)[finite] @ offset[finite] / ((weights * chord)[finite] @ chord[finite]))

    def contains(self, at: PathEquilibrium, guess: FloatArray) -> bool:
        """Return True if an equilibrium lies within the step, near a guess."""
        start = largest_motion(self.part.whole, at.x - guess) <= MAX_MISS * self.moved + 1e-9
        return start and -BESIDE_STEP <= self.find_share(at) <= 1 + BESIDE_STEP

    def bisect(self, row: int) -> PathEquilibrium | None:
        """Return the equilibrium of the piece at which a condition is just met, by its drive alone; None if lost."""
        from scipy.optimize import brentq

        part = self.part

        def value(share: float) -> float:
            at = self.solve(share)
            if at is None:
                raise ArithmeticError
            return part.measure_condition(part.grow(at), row, self.travel)

        try:
            end = next(iter(self.find_negative(row)), len(self.shares) - 1)
            begins = self.shares[end - 1 :: -1].tolist()
            if part.conditions.all[row].kind in ("grip", "slip"):
                # what sticks begins at its limit, where the drive turns, and may soon reach the other one
                begins += [float(self.shares[end]) * 0.5**k for k in range(1, MAX_HALVINGS)]
            begin = next((share for share in begins if value(share) > 0), None)
            if begin is None:
                return self.first
            last = next((k for k in range(end, len(self.shares)) if value(float(self.shares[k])) <= 0), None)
            if last is None:
                return None
            share = float(brentq(value, begin, self.shares[last], xtol=1e-15, rtol=1e-14))
        except ArithmeticError:
            return None
        at = self.solve(share)
        return None if at is None else part.grow(at)

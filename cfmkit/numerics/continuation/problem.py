"""Protocol that a structure offers to a solver which follows its equilibria; sizes of motions and forces."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

FORCE_WEIGHT = 1e-4  # of the square of a force, in its unit, in the arc length; a motion has 1


class LinearisedProblem(Protocol):
    """Residual, tangent and inertia at one place, for n unknowns."""

    @property
    def residual(self) -> FloatArray:
        """Forces out of balance, (n,)."""

    @property
    def rate(self) -> FloatArray:
        """Derivative of the residual by the drive, (n,)."""

    @property
    def unstable(self) -> int:
        """Number of directions in which the structure is unstable while the drive is held."""

    def solve(self, right: FloatArray) -> FloatArray | None:
        """Return the tangent's inverse times columns (n, k), or None if it is singular."""


class ScaledUnknowns(Protocol):
    """Sizes and kinds of n unknowns: motions, which are of size one, and forces."""

    @property
    def unit(self) -> FloatArray:
        """Natural sizes of the unknowns, (n,): 1 for motions."""

    @property
    def motions(self) -> Any:
        """Which unknowns are motions, (n,) of bool."""


class ContinuationProblem(ScaledUnknowns, Protocol):
    """A structure with n unknowns: motions, which are of size one, and forces.

    A mode is a direction in which the structure gives way, a column of n. A problem may have these numbers, too:
    `arc_share` (1), the weight of the square of a motion in the arc length, one over their number where there are
    thousands; `drive_tolerance` (1e-12), the share of a way up to which the drive can be found on a branch; and
    `amplitude_slack` (0.3), the share by which amplitudes near its begin may not be as those of a parabola. What its
    follower counts as a bifurcation is `Options.corner`.
    """

    def __hash__(self) -> int:
        """Return a number for this very object."""

    def linearise(self, x: FloatArray, drive: float) -> LinearisedProblem:
        """Return residual and tangent at any place."""

    def modes(self, at: PathEquilibrium, count: int) -> tuple[FloatArray, FloatArray]:
        """Return the eigenvalues nearest to zero, nearest first, and their modes, (k,) and (n, k)."""

    def orient(self, modes: FloatArray) -> FloatArray:
        """Return one vector in the span of modes, on the same side whatever vectors span it."""


class PathEquilibrium(NamedTuple):
    """A converged place on a path."""

    x: FloatArray  # (n,)
    drive: float
    rate: FloatArray  # (n,) dx/d(drive)
    unstable: int
    effort: float = math.nan  # what works with the drive, if the problem says so
    stiffness: float = math.nan  # derivative of the effort along the path, if the problem says so

    @property
    def place(self) -> FloatArray:
        """Unknowns and drive, (n + 1,)."""
        place = np.empty(len(self.x) + 1)
        place[:-1], place[-1] = self.x, self.drive
        return place

    def extrapolate(self, drive: float) -> FloatArray:
        """Return the unknowns at a drive by the slope here."""
        return self.x + (drive - self.drive) * self.rate


class Border(NamedTuple):
    """A linear condition in place of a held drive: row . (x, drive) = level."""

    row: FloatArray  # (n + 1,)
    level: float

    def find_drive_change(self, x: FloatArray, drive: float, rate: FloatArray) -> float:
        """Return the change of the drive that meets the border's condition while x changes at a rate."""
        row = self.row
        return float((self.level - row[:-1] @ x - row[-1] * drive) / (row[-1] + row[:-1] @ rate))


@lru_cache(maxsize=2)
def arc_weights(problem: ContinuationProblem, span: float) -> FloatArray:
    """Return the weights of the squares of (x, drive) in the arc length, (n + 1,)."""
    share = getattr(problem, "arc_share", 1.0)
    return np.append(np.where(problem.motions, share, FORCE_WEIGHT / problem.unit**2), 1.0 / span**2)


def largest_motion(problem: ScaledUnknowns, x: FloatArray) -> float:
    """Return the largest size of a motion."""
    return _largest(np.abs(x[problem.motions]))


def keep_motions(problem: ContinuationProblem, x: FloatArray) -> FloatArray:
    """Return x with its forces zero."""
    return np.where(problem.motions, x, 0.0)


def force_change(problem: ScaledUnknowns, old: FloatArray, new: FloatArray, largest: float, share: float) -> float:
    """Return the largest change of a force over what a step may change: `largest` units and a share of the force."""
    allowed = largest * problem.unit + share * np.abs(old)
    return _largest((np.abs(new - old) / allowed)[~problem.motions])


def _largest(sizes: FloatArray) -> float:
    """Return the largest of some sizes, 0 of none: of a few `max` takes twice the time."""
    return float(sizes[sizes.argmax()]) if len(sizes) else 0.0

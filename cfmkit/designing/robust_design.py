"""Robust design: values for which most parts meet all limits, by linear estimate or on drawn parts; costliest errors.

A limit is a row of numbers of a part, such as the force at some poses, that must be at least zero. Near a design the
numbers move in proportion to its values and to the errors of its parts. So the numbers of drawn parts are known by
linear estimate, without solving one of them, and so is how far each limit must be drawn in: none is guessed.
Derivatives are exact where the family has them, and central differences elsewhere.

A step minimises, over such parts, the mean of the worst share of them: the conditional value at risk of the row that is
missed most, counted in standard deviations of that row. To first order in the values of a design it is least where a
linear program is [RU]. That is followed as far as the numbers are trusted to be linear, judged anew where it ends, and
repeated until the share that was wanted is reached, or no step gains. Where first order does not do, a few drawn parts
are solved themselves, at every step (`optimise_on_samples`).

Reference
---------
[RU] R. T. Rockafellar, S. Uryasev, J. Risk 2 (2000) 21, eq. 9 and 17.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray


SIGMA_STEP = 0.5
"""Step of a difference by an error, in standard deviations: so small that its own curvature does not count."""


def differentiate(
    numbers: Callable[[int, float], FloatArray | None], ends: FloatArray, exact: FloatArray | None = None
) -> FloatArray | None:
    """Return the derivatives of numbers of a part by some of its values, (q, d); None if a part has no numbers.

    `numbers(k, value)`: those of a part whose k-th value is so, (q,); `ends`, (d, 2): the values between which a
    difference is taken; `exact`, (q, d): exact derivatives, NaN where one is not known.
    """
    columns = []
    for k, (low, high) in enumerate(ends.tolist()):
        if exact is not None and np.isfinite(exact[:, k]).all():
            columns.append(exact[:, k])
            continue
        above, below = numbers(k, high), numbers(k, low)
        if above is None or below is None or not (np.isfinite(above).all() and np.isfinite(below).all()):
            return None
        columns.append((above - below) / (high - low))
    return np.array(columns).T


@dataclass(frozen=True)
class NearParts:
    """Numbers of a perfect part, and their derivatives by the errors of parts."""

    middle: FloatArray  # (q,)
    by_error: FloatArray  # (q, d)

    def numbers(self, errors: FloatArray) -> FloatArray:
        """Return the estimated numbers (k, q) of parts with errors (k, d)."""
        return np.asarray(self.middle + errors @ self.by_error.T)

    def share(self, errors: FloatArray) -> float:
        """Return the share of parts with errors (k, d) all of whose numbers are at least zero."""
        return float((self.numbers(errors) >= 0).all(axis=1).mean())

    def spread(self, deviations: FloatArray) -> FloatArray:
        """Return the standard deviation of each number, (q,), for errors with standard deviations (d,)."""
        return np.asarray(np.sqrt(((self.by_error * deviations) ** 2).sum(axis=1)))


FIRST_ROWS, MORE_ROWS, MOST_PROGRAMS, ROW_SELECTION_LIMITS = 4, 2, 12, 1e-7
"""Rows of a part that a linear program begins with, those that may come in each time, how often, and what counts as
broken [standard deviations]: two or three programs are usual, of 192 parts and 306 rows each."""


def tail_risk(parts: FloatArray, share: float) -> float:
    """Return the conditional value at risk of the row that parts (k, m) miss most: below zero, the share is reached."""
    worst = np.sort(-parts.min(axis=1))[::-1]
    tail = max(1.0, (1.0 - share) * len(worst))
    whole = int(tail)
    rest = tail - whole
    total = worst[:whole].sum() + (rest * worst[whole] if rest and whole < len(worst) else 0.0)
    return float(total / tail)


def best_move(
    parts: FloatArray,  # (k, m): rows of each part
    slopes: NDArray[np.float64],  # (k, m, n): their derivatives by the values
    share: float,  # of parts that are to be good
    # bounds, x: (n, 2) and (n,): bounds of the values, and where these are
    bounds: FloatArray,
    x: FloatArray,
    trust: float,  # largest move, as a share of the ranges
) -> FloatArray | None:
    """Return the move of the values (n,) that lowers the risk most within the trust; None if there is none."""
    kept = min(FIRST_ROWS, parts.shape[1])
    # a program with every row of every part is large, and nearly all of its rows are idle: those that its answer would
    # break come in, until it breaks none
    chosen = np.zeros(parts.shape, dtype=bool)
    np.put_along_axis(chosen, np.argpartition(parts, kept - 1, axis=1)[:, :kept], True, axis=1)
    for _ in range(MOST_PROGRAMS):
        solution = _solve_linear_program(parts, slopes, chosen, share, bounds, x, trust)
        if solution is None:
            return None
        move, level, slack = solution
        left = parts + slopes @ move + level + slack[:, None]
        worst = np.argsort(left, axis=1)[:, :MORE_ROWS]
        present = np.take_along_axis(chosen, worst, axis=1)
        broken = (np.take_along_axis(left, worst, axis=1) < -ROW_SELECTION_LIMITS) & ~present
        if not broken.any():
            return move
        np.put_along_axis(chosen, worst, present | broken, axis=1)
    return move


def _solve_linear_program(
    parts: FloatArray,
    slopes: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    share: float,
    bounds: FloatArray,
    x: FloatArray,
    trust: float,
) -> tuple[FloatArray, float, FloatArray] | None:
    """Return the move (n,), the risk level and the slack of each part (k,) that are best for chosen rows (k, m)."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_matrix, hstack

    count, size = len(parts), len(x)
    reach = bounds[:, 1] - bounds[:, 0]
    part, row = np.nonzero(chosen)
    # slack of the part + level + row + slope move >= 0
    moves = csr_matrix(-slopes[part, row] * reach)
    level = csr_matrix(-np.ones((len(part), 1)))
    slack = csr_matrix((-np.ones(len(part)), (np.arange(len(part)), part)), shape=(len(part), count))
    tail = max(1.0, (1.0 - share) * count)
    cost = np.concatenate([np.zeros(size), [1.0], np.full(count, 1.0 / tail)])
    low = np.maximum(-trust, (bounds[:, 0] - x) / reach)
    high = np.minimum(trust, (bounds[:, 1] - x) / reach)
    limits = [*zip(low.tolist(), high.tolist(), strict=True), (None, None), *([(0.0, None)] * count)]
    solve: Any = linprog  # its stubs know no sparse matrices
    solution = solve(cost, hstack([moves, level, slack]).tocsr(), parts[part, row], bounds=limits, method="highs-ds")
    if solution.x is None:
        return None
    return np.asarray(solution.x[:size] * reach), float(solution.x[size]), np.asarray(solution.x[size + 1 :])


DIFFERENCE_STEP = 2e-4  # step of a difference by a value of the design, as a share of its range
ONE_SIDED_MEAN = 0.25
"""An error whose mean exceeds so many standard deviations is one-sided, like a waviness, which is never below zero."""
LINEAR_PARTS = 192  # parts of a linear program
YIELD_MARGIN = 0.01  # the estimated share is to be so much above what was requested: the estimate is of first order
FIRST_TRUST, LEAST_TRUST, MOST_TRUST = 0.1, 1e-4, 0.5  # how far a step may go, as a share of the ranges
SMALL_GAIN = 0.02
"""A step of drawn parts that lowers the risk by less is the last [standard deviations of the limit].

With other 48 parts the risk of one normal limit at 90 % scatters by 0.27: less is not worth solving parts for.
"""
MAX_STEPS_ON_SAMPLES = 25
MIN_RELATIVE_DEVIATION = 1e-2
"""Least standard deviation of a row, as a share of the largest of its limit: what no error moves is kept strictly."""


class SeenPart(Protocol):
    """Numbers of a part by its family."""

    def __call__(self, x: FloatArray, errors: FloatArray, /) -> FloatArray | None:
        """Return the numbers of a part (q,) whose design has the values x (n,) and whose errors are (d,); or None."""


@dataclass(frozen=True)
class PartSlopes:
    """Exact derivatives of the numbers of a part; NaN where one is not known."""

    by_x: FloatArray  # (q, n) by the values of its design
    by_error: FloatArray  # (q, d) by its errors


class SlopedPart(Protocol):
    """Derivatives of a part's numbers by its family."""

    def __call__(self, x: FloatArray, errors: FloatArray, /) -> PartSlopes | None:
        """Return the derivatives at the values x (n,) and errors (d,); None if none is known."""


@dataclass(frozen=True)
class RobustProblem:
    """Variables, errors of manufacture, and constraints."""

    # numbers of a part: its design's values (n,) and its errors (d,) in, (q,) out; None if it has none
    seen: SeenPart
    bounds: FloatArray  # (n, 2) of the values
    errors: FloatArray  # (k, d) errors of drawn parts
    deviations: FloatArray  # (d,) standard deviations of the errors
    # matrix, constant, (m, q), (m,): rows of the numbers, which must be at least zero: ``matrix @ numbers + constant``
    matrix: FloatArray
    constant: FloatArray
    about: NDArray[np.int64]  # (m,) which limit each row belongs to
    share: float  # of parts that are to be good
    late: Callable[[], bool]  # tells whether the time is up
    report: Callable[[float, int], None]  # takes the share estimated and the number of steps so far
    slopes: SlopedPart  # exact derivatives of a part's numbers, where there are any

    @property
    def reach(self) -> FloatArray:
        """Widths of the ranges, (n,)."""
        return np.asarray(self.bounds[:, 1] - self.bounds[:, 0])

    @property
    def middle(self) -> FloatArray:
        """Errors about which differences are taken, (d,): none, or of a range to one side of the design its middle."""
        mean = self.errors.mean(axis=0)
        return np.asarray(np.where(np.abs(mean) > ONE_SIDED_MEAN * self.deviations, mean, 0.0))

    @property
    def perfect(self) -> FloatArray:
        """The errors of a perfect part."""
        return np.zeros(len(self.deviations))


@dataclass(frozen=True)
class Linear(NearParts):
    """Limits of a design and of parts near it, by linear estimate: the numbers are what the limits leave."""

    x: FloatArray  # (n,) values of the design
    by_x: FloatArray  # (m, n) derivatives of the limits by the values


@dataclass(frozen=True)
class RobustResult:
    """End of the steps."""

    x: FloatArray  # (n,) values of the design
    share: float  # of good parts, by linear estimate, even where drawn parts were solved themselves
    began: float  # the same where the steps began
    # steps, seen: steps that gained something, and parts that were solved
    steps: int
    seen: int
    linear: Linear  # the design by linear estimate
    reached: bool  # whether the share is what was requested


class NoPart(Exception):
    """The design that the search begins with has no numbers: there is nothing to improve."""


@dataclass
class _Counted:
    """A problem whose parts are counted."""

    problem: RobustProblem
    count: int = 0

    def __call__(self, x: FloatArray, errors: FloatArray) -> FloatArray | None:
        self.count += 1
        part = self.problem.seen(x, errors)
        return part if part is not None and np.isfinite(part).all() else None

    def rows(self, numbers: FloatArray) -> FloatArray:
        return np.asarray(self.problem.matrix @ numbers + self.problem.constant)


def linear(problem: RobustProblem, x: FloatArray, seen: SeenPart) -> Linear | None:
    """Return a design by linear estimate; None if it, or a neighbour that a difference needs, has no numbers."""
    middle = seen(x, problem.perfect)
    if middle is None:
        return None
    slopes = problem.slopes(x, problem.perfect)
    by_x = _differentiate_by_values(problem, x, problem.perfect, seen, slopes)
    by_error = _differentiate_by_errors(problem, x, seen, slopes)
    if by_x is None or by_error is None:
        return None
    matrix = problem.matrix
    return Linear(matrix @ middle + problem.constant, matrix @ by_error, x, matrix @ by_x)


def _differentiate_by_values(
    problem: RobustProblem, x: FloatArray, errors: FloatArray, seen: SeenPart, slopes: PartSlopes | None
) -> FloatArray | None:
    """Return the derivatives of the numbers of a part by the values of its design, (q, n)."""
    if not len(x):  # nothing may move
        return np.zeros((problem.matrix.shape[1], 0))
    step = DIFFERENCE_STEP * problem.reach
    ends = np.column_stack([np.maximum(problem.bounds[:, 0], x - step), np.minimum(problem.bounds[:, 1], x + step)])

    def numbers(k: int, value: float) -> FloatArray | None:
        moved = x.copy()
        moved[k] = value
        return seen(moved, errors)

    return differentiate(numbers, ends, None if slopes is None else slopes.by_x)


def _differentiate_by_errors(
    problem: RobustProblem, x: FloatArray, seen: SeenPart, slopes: PartSlopes | None
) -> FloatArray | None:
    """Return the derivatives of the numbers by the errors, (q, d); exact ones hold for errors about zero only."""
    step, about = SIGMA_STEP * problem.deviations, problem.middle

    def numbers(k: int, error: float) -> FloatArray | None:
        return seen(x, np.where(np.arange(len(about)) == k, error, 0.0))

    exact = None if slopes is None else np.where(about == 0.0, slopes.by_error, np.nan)
    return differentiate(numbers, np.column_stack([about - step, about + step]), exact)


def with_margins(
    problem: RobustProblem,  # what may vary and what must hold
    x: FloatArray,  # (n,): where to begin
    most: int = 40,  # steps
) -> RobustResult:
    """Return values for which the yield, by linear estimate, is what was requested, or largest.

    Raises NoPart if the first design has no numbers.
    """
    seen = _Counted(problem)
    now = linear(problem, np.clip(x, *problem.bounds.T), seen)
    if now is None:
        raise NoPart
    scale = _scale(now, problem)
    few = problem.errors[:LINEAR_PARTS]
    began = share = now.share(problem.errors)
    best = now
    best_share, risk, trust, steps = share, tail_risk(now.numbers(few) / scale, problem.share), FIRST_TRUST, 0
    for _ in range(most):
        if not len(x) or best_share >= min(problem.share + YIELD_MARGIN, 1.0) or trust < LEAST_TRUST or problem.late():
            break
        parts = now.numbers(few) / scale
        slopes = np.broadcast_to(now.by_x / scale[:, None], (len(few), *now.by_x.shape))
        move = best_move(parts, slopes, problem.share, problem.bounds, now.x, trust)
        if move is None:
            break
        moved = np.clip(now.x + move, *problem.bounds.T)
        # one part tells most of what the way bends: errors and slopes are looked at where that is good only
        if not _risk_at(now, moved, few, scale, problem, seen) < risk:
            trust *= 0.5
            continue
        next_ = linear(problem, moved, seen)
        new_risk = np.inf if next_ is None else tail_risk(next_.numbers(few) / scale, problem.share)
        if next_ is None or not new_risk < risk - 1e-6 * (1.0 + abs(risk)):
            trust *= 0.5
            continue
        now, risk, steps = next_, new_risk, steps + 1
        trust = min(MOST_TRUST, 1.6 * trust)
        share = now.share(problem.errors)
        if share >= best_share:
            best, best_share = now, share
        problem.report(share, steps)
    return RobustResult(best.x, best_share, began, steps, seen.count, best, best_share >= problem.share)


def _risk_at(
    now: Linear, moved: FloatArray, few: FloatArray, scale: FloatArray, problem: RobustProblem, seen: _Counted
) -> float:
    """Return the risk of other values, errors moving the rows as they do now."""
    numbers = seen(moved, problem.perfect)
    if numbers is None:
        return np.inf
    return tail_risk(replace(now, middle=seen.rows(numbers)).numbers(few) / scale, problem.share)


def _scale(now: Linear, problem: RobustProblem) -> FloatArray:
    """Return the divisor of each row: its standard deviation over the drawn parts; None if it cannot be known."""
    moved = (problem.errors @ now.by_error.T).std(axis=0)
    out: FloatArray = np.empty(len(moved))
    for number in np.unique(problem.about):
        mine = problem.about == number
        # limits that no error moves at all have their own size for a scale
        largest = float(moved[mine].max()) or float(np.abs(problem.constant[mine]).max()) or 1.0
        out[mine] = np.maximum(moved[mine], MIN_RELATIVE_DEVIATION * largest)
    return out


@dataclass
class _Parts:
    """Drawn parts that are solved themselves."""

    problem: RobustProblem
    errors: FloatArray
    seen: _Counted

    def rows(self, x: FloatArray) -> FloatArray | None:
        """Return the rows of all parts, (k, m); None if a part has no numbers."""
        parts = [self.seen(x, error) for error in self.errors]
        return None if any(part is None for part in parts) else np.array([self.seen.rows(part) for part in parts])  # type: ignore[arg-type]

    def differentiate_rows(self, x: FloatArray) -> FloatArray | None:
        """Return the derivatives of the rows of all parts by the values of the design, (k, m, n)."""
        out = []
        for error in self.errors:
            slopes = _differentiate_by_values(self.problem, x, error, self.seen, self.problem.slopes(x, error))
            if slopes is None:
                return None
            out.append(self.problem.matrix @ slopes)
        return np.array(out)


def optimise_on_samples(
    problem: RobustProblem,  # what may vary and what must hold
    result: RobustResult,  # where to begin
    count: int,  # parts that are drawn
    worst: bool = False,  # whether the worst of them counts, and not the mean of the worst share
) -> RobustResult:
    """Return values for which drawn parts, each solved itself, are good: from a design that first order led to."""
    asked = replace(problem, share=1.0) if worst else problem
    seen = _Counted(problem)
    parts = _Parts(problem, problem.errors[-count:], seen)
    scale = _scale(result.linear, problem)
    x, rows = result.x, parts.rows(result.x)
    if rows is None:
        return result
    risk, trust, steps = tail_risk(rows / scale, asked.share), 0.25 * FIRST_TRUST, 0
    slopes = None
    for _ in range(MAX_STEPS_ON_SAMPLES):
        if trust < LEAST_TRUST or problem.late():
            break
        slopes = parts.differentiate_rows(x) if slopes is None else slopes
        if slopes is None:
            break
        move = best_move(rows / scale, slopes / scale[:, None], asked.share, problem.bounds, x, trust)
        if move is None:
            break
        moved = np.clip(x + move, *problem.bounds.T)
        new = parts.rows(moved)
        new_risk = np.inf if new is None else tail_risk(new / scale, asked.share)
        if new is None or not new_risk < risk - 1e-6 * (1.0 + abs(risk)):
            trust *= 0.35
            continue
        small = risk - new_risk < SMALL_GAIN
        x, rows, risk, slopes, steps = moved, new, new_risk, None, steps + 1
        trust = min(MOST_TRUST, 1.6 * trust)
        problem.report(float((rows >= 0).all(axis=1).mean()), steps)
        if small:
            break
    now = linear(problem, x, seen)
    if now is None:
        return result
    share = now.share(problem.errors)
    return RobustResult(
        x, share, result.began, result.steps + steps, result.seen + seen.count, now, share >= problem.share
    )


def costliest(result: RobustResult, problem: RobustProblem, groups: list[tuple[int, ...]]) -> int:
    """Return the number of the group of errors without which most more parts would be good, by linear estimate.

    Where no group alone makes a difference to that, the one without which parts miss their limits by least.
    """
    spread = result.linear.spread(problem.errors.std(axis=0))
    spread = np.where(spread > 0.0, spread, np.inf)  # what no error moves is missed alike whatever is held still
    gained = []
    for members in groups:
        still = problem.errors.copy()
        still[:, members] = 0.0
        missed = np.maximum(-result.linear.numbers(still) / spread, 0.0).max(axis=1)
        gained.append((result.linear.share(still), -float(missed.mean())))
    return max(range(len(groups)), key=gained.__getitem__)

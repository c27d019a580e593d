"""Rates of springs, none negative, that make a sum of unit curves follow a goal: the problem is linear in them.

Smallest largest deviation is a linear programme (solved by HiGHS), smallest root mean square is a
least-squares problem with bounds. Which other rates are as good is one more linear programme a spring.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class RateGoal:
    """Sum that the springs are to have, in units of the target."""

    matrix: FloatArray  # (n, m) what a rate of 1 gives at each of n places, over the target
    wanted: FloatArray  # (n,) 1 for a constant; something sloping for a stiffness
    upper: FloatArray  # (m,) largest rates, perhaps infinite; zero for a spring that may not be used
    held: tuple[FloatArray, float] | None = None  # a row and what it must give exactly
    lower: FloatArray | None = None  # (m,) smallest rates; None: zero
    least: tuple[FloatArray, float] | None = None  # a row and what it must give at least

    @property
    def bounds(self) -> list[tuple[float, float | None]]:
        """Smallest and largest rate of each spring; None for no limit."""
        low = np.zeros(len(self.upper)) if self.lower is None else self.lower
        return [(float(a), None if np.isinf(b) else float(b)) for a, b in zip(low, self.upper, strict=True)]

    def residual(self, rates: FloatArray) -> FloatArray:
        """Return the deviations from the goal, as fractions of the target."""
        residual: FloatArray = self.matrix @ rates - self.wanted
        return residual

    def deviation(self, rates: FloatArray) -> float:
        """Return the largest deviation."""
        return float(np.abs(self.residual(rates)).max())

    def rms(self, rates: FloatArray) -> float:
        """Return the root mean square of the deviations."""
        return float(np.sqrt(np.mean(self.residual(rates) ** 2)))

    def scales(self) -> FloatArray:
        """Return what makes the columns equally large; 1 for one that is zero."""
        size = np.abs(self.matrix).max(axis=0)
        scales: FloatArray = np.where(size > 0.0, size, 1.0)
        return scales

    def select_rows(self, rows: Sequence[int] | FloatArray) -> RateGoal:
        """Return the goal at some of the places."""
        index = np.asarray(rows)
        return replace(self, matrix=self.matrix[index], wanted=self.wanted[index])


MIN_RESOLVED_DEVIATION = 1e-5
"""Below this deviation a second programme, in units of it, refines the rates: the first meets its rows to 1e-7 only."""
MAX_PROGRAMME_PLACES, N_FIRST_PLACES = 128, 25
"""So many places the linear programme takes at once; of more it starts with few, and adds those where it fails."""


def minimax(goal: RateGoal) -> FloatArray | None:
    """Return the rates with the smallest largest deviation; None if `held` or `least` cannot be met.

    Solved on a few places, to which the worst of the others are added until none is worse.
    """
    count = len(goal.wanted)
    rows = np.unique(
        np.linspace(0, count - 1, count if count <= MAX_PROGRAMME_PLACES else N_FIRST_PLACES).round().astype(int)
    )
    while True:
        fit = _minimax(goal.select_rows(rows))
        if fit is None:
            return None
        rates, deviation = fit
        residual = np.abs(goal.residual(rates))
        worse = _peaks(residual, deviation * (1 + 1e-9) + 1e-15)
        more = np.union1d(rows, worse)
        if len(more) == len(rows):
            return rates
        rows = more


def can_keep(goal: RateGoal, worst: float) -> bool:
    """Return whether some rates leave no deviation above `worst`.

    Least squares decide most cases, at a fraction of the cost: what their rates deviate at most is enough, and their
    residual bounds from below what any rates do. The linear programme decides the rest.
    """
    if goal.held is None and goal.least is None:
        fitted = least_squares(goal)
        if fitted is not None and goal.deviation(fitted) <= worst:
            return True
        if fitted is not None and _least_possible(goal, fitted) > worst:
            return False
    rates = minimax(goal)
    return rates is not None and goal.deviation(rates) <= worst


MAX_RATE_RATIO = 100.0
"""How much larger than those of least squares, and than 1, the scaled rates of the smallest largest deviation may be
for the bound to hold; they are of the same size."""


def _least_possible(goal: RateGoal, rates: FloatArray) -> float:
    """Return a bound below the largest deviation of any rates, from the residual r of least squares.

    With weights r / sum|r| no mean of deviations is above the largest one; for other rates the mean falls by the
    gradient of the squares over their difference, which is zero but for rounding and where the fit ended early.
    """
    scales, residual = goal.scales(), -goal.residual(rates)
    weight = float(np.abs(residual).sum())
    if weight == 0.0:
        return 0.0
    gradient, scaled = (goal.matrix / scales).T @ residual, rates * scales
    low = np.zeros(len(rates)) if goal.lower is None else goal.lower * scales
    high = np.minimum(goal.upper * scales, MAX_RATE_RATIO * (1.0 + scaled.sum()))
    gained = np.maximum(gradient * (high - scaled), gradient * (low - scaled)).sum()
    return float((residual @ residual - gained) / weight)


def _peaks(residual: FloatArray, level: float) -> Any:
    """Return where deviations above a level are largest among their neighbours."""
    padded = np.concatenate([[-1.0], residual, [-1.0]])
    top = (padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]) & (residual > level)
    return np.flatnonzero(top)


def _minimax(goal: RateGoal) -> tuple[FloatArray, float] | None:
    """Return the rates with the smallest largest deviation, and this; solved twice where it is tiny."""
    smallest = _smallest_deviation(goal)
    if smallest is None:
        return None
    rates, unit = smallest[0], goal.deviation(smallest[0])
    if not 0.0 < unit < MIN_RESOLVED_DEVIATION:
        return smallest
    more = _smallest_deviation(_enlarge_goal(goal, rates, unit))
    if more is not None:
        rates = rates + more[0] * unit
    return rates, goal.deviation(rates)


def _smallest_deviation(goal: RateGoal) -> tuple[FloatArray, float] | None:
    cost = np.zeros(goal.matrix.shape[1] + 1)
    cost[-1] = 1.0
    scales = goal.scales()
    solved = _solve_programme(goal, cost, None, scales)
    return None if solved is None else (solved[:-1] / scales, float(solved[-1]))


def _enlarge_goal(goal: RateGoal, rates: FloatArray, unit: float) -> RateGoal:
    """Return the goal for what is to be added to rates, in units of their deviation."""
    held, least = (
        None if row is None else (row[0], (row[1] - float(row[0] @ rates)) / unit) for row in (goal.held, goal.least)
    )
    low = 0.0 if goal.lower is None else goal.lower
    return RateGoal(
        goal.matrix,
        -goal.residual(rates) / unit,
        (goal.upper - rates) / unit,
        held=held,
        lower=(low - rates) / unit,
        least=least,
    )


def _solve_programme(
    goal: RateGoal,  # m springs
    cost: FloatArray,  # (m + 1 + k,): of scaled rates, of the deviation, and of k unknowns more, none negative
    worst: float | None,  # largest deviation allowed
    scales: FloatArray,  # (m,): of the rates
    more: Sequence[FloatArray] = (),  # (m + 1 + k,) each: rows whose products with the unknowns must not be positive
) -> FloatArray | None:
    """Return scaled rates, then the deviation and what is more, that minimise a cost; None if there are none."""
    from scipy.optimize import linprog

    count, matrix = len(goal.upper), goal.matrix / scales
    ones, rest = np.ones((len(goal.wanted), 1)), np.zeros((len(goal.wanted), len(cost) - count - 1))
    rows = np.vstack([np.hstack([matrix, -ones, rest]), np.hstack([-matrix, -ones, rest]), *more])
    limits = np.concatenate([goal.wanted, -goal.wanted, np.zeros(len(more))])
    bounds = [
        (low * scale, None if top is None else top * scale)
        for (low, top), scale in zip(goal.bounds, scales, strict=True)
    ]
    bounds += [(0.0, worst), *[(0.0, None)] * rest.shape[1]]
    others = np.zeros(len(cost) - count)
    equal: dict[str, Any] = {}
    if goal.held is not None:
        row, held = _normalise_row(goal.held[0] / scales, goal.held[1])
        equal = {"A_eq": np.append(row, others)[None], "b_eq": [held]}
    if goal.least is not None:
        row, least = _normalise_row(goal.least[0] / scales, goal.least[1])
        rows = np.vstack([rows, np.append(-row, others)])
        limits = np.append(limits, -least)
    solved = linprog(cost, A_ub=rows, b_ub=limits, bounds=bounds, method="highs", **equal)
    lowest = np.array([low for low, _ in bounds])
    return None if solved.status != 0 or solved.x is None else np.maximum(solved.x, lowest)


def _normalise_row(row: FloatArray, value: float) -> tuple[FloatArray, float]:
    """Return a row (m,) and its value with the largest entry of the row 1: a programme meets rows to 1e-7."""
    size = float(np.abs(row).max()) or 1.0
    return row / size, value / size


def least_squares(goal: RateGoal) -> FloatArray | None:
    """Return the rates with the smallest root mean square of the deviations; None if `held` cannot be met."""
    from scipy.optimize import lsq_linear, nnls

    if goal.held is not None:
        return _held_least_squares(goal)
    if goal.lower is not None and goal.lower.any():
        above = replace(
            goal, wanted=goal.wanted - goal.matrix @ goal.lower, upper=goal.upper - goal.lower, held=None, lower=None
        )
        more = least_squares(above)
        return None if more is None else more + goal.lower
    scales, is_used = goal.scales(), goal.upper > 0.0
    matrix, scaled = goal.matrix / scales, np.zeros(len(goal.upper))
    if np.isinf(goal.upper[is_used]).all():
        scaled[is_used], _ = nnls(matrix[:, is_used], goal.wanted)
    else:
        solved = lsq_linear(
            matrix[:, is_used], goal.wanted, (0.0, (goal.upper * scales)[is_used]), method="bvls", tol=1e-14
        )
        scaled[is_used] = solved.x
    rates: FloatArray = scaled / scales
    return rates


def _held_least_squares(goal: RateGoal) -> FloatArray | None:
    """Return the least squares among all ways to leave a rate free, at zero or at its largest: few springs."""
    assert goal.held is not None
    scales = goal.scales()
    row, wanted = goal.held[0] / scales, goal.held[1]
    top = goal.upper * scales
    best: tuple[float, FloatArray] | None = None
    for ends in product(*[(np.nan, 0.0, end) if 0.0 < end < np.inf else (0.0, np.nan)[: 1 + (end > 0)] for end in top]):
        scaled = _free_least_squares(goal.matrix / scales, goal.wanted, (row, wanted), np.array(ends))
        if scaled is None or (scaled < 0.0).any() or (scaled > top).any():
            continue
        rates = scaled / scales
        if best is None or goal.rms(rates) < best[0]:
            best = goal.rms(rates), rates
    return None if best is None else best[1]


def _free_least_squares(
    matrix: FloatArray, wanted: FloatArray, held: tuple[FloatArray, float], ends: FloatArray
) -> FloatArray | None:
    """Return the unknowns, a row held and those not NaN in `ends` as they are there; None if that is impossible."""
    free, solved = np.isnan(ends), np.nan_to_num(ends)
    row, left = held[0][free], held[1] - held[0] @ solved
    size = float(row @ row)
    if size == 0.0:
        return solved if abs(left) <= 1e-12 * float(np.abs(held[0]).max()) and not free.any() else None
    base = row * (left / size)
    along = np.linalg.svd(row[None])[2][1:].T  # the directions that leave the row as it is
    gap = wanted - matrix @ solved - matrix[:, free] @ base
    solved[free] = base + along @ np.linalg.lstsq(matrix[:, free] @ along, gap, rcond=None)[0]
    return solved


def ranges(goal: RateGoal, worst: float) -> FloatArray:
    """Return the smallest and the largest rate of each spring, (m, 2), with no deviation above `worst`."""
    count, scales = len(goal.upper), goal.scales()
    ends = np.full((count, 2), np.nan)
    for k, cost in enumerate(np.eye(count + 1)[:count]):
        for end, sign in enumerate((1.0, -1.0)):
            solved = _solve_programme(goal, sign * cost, worst, scales)
            if solved is not None:
                ends[k, end] = solved[k] / scales[k]
    return ends


def choose_preferred(
    goal: RateGoal,  # m springs, the last of them the slider's if there are four
    worst: float,  # largest deviation allowed
    # smallest sum of the springs' largest efforts; or the smallest difference of the largest and the smallest torsion
    # rate of those that may be used
    rule: str,
) -> FloatArray | None:
    """Return one of the rates with no deviation above `worst`: the softest, or the most even ones."""
    count, scales = len(goal.upper), goal.scales()
    if rule == "soft-springs":
        solved = _solve_programme(goal, np.append(np.ones(count), 0.0), worst, scales)
        return None if solved is None else solved[:-1] / scales
    # one more unknown above all torsion rates that may be used, and one below
    usable = [k for k in range(min(3, count)) if goal.upper[k] > 0.0]
    scales = np.full(count, scales[usable].max() if usable else 1.0)
    unit = np.eye(count + 3)
    more = [row for k in usable for row in (unit[k] - unit[count + 1], unit[count + 2] - unit[k])]
    solved = _solve_programme(goal, unit[count + 1] - unit[count + 2], worst, scales, more)
    return None if solved is None else solved[:count] / scales

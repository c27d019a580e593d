"""The conditional value at risk of parts: the mean of what the worst share of them miss, and the move that lowers it.

To first order in the values of a design it is least where a linear program is [RU].

Reference
---------
[RU] R. T. Rockafellar, S. Uryasev, J. Risk 2 (2000) 21, eq. 9 and 17.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

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
        found = _program(parts, slopes, chosen, share, bounds, x, trust)
        if found is None:
            return None
        move, level, slack = found
        left = parts + slopes @ move + level + slack[:, None]
        worst = np.argsort(left, axis=1)[:, :MORE_ROWS]
        present = np.take_along_axis(chosen, worst, axis=1)
        broken = (np.take_along_axis(left, worst, axis=1) < -ROW_SELECTION_LIMITS) & ~present
        if not broken.any():
            return move
        np.put_along_axis(chosen, worst, present | broken, axis=1)
    return move


def _program(
    parts: FloatArray,
    slopes: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    share: float,
    bounds: FloatArray,
    x: FloatArray,
    trust: float,
) -> tuple[FloatArray, float, FloatArray] | None:
    """Return the move (n,), the level and the slack of each part (k,) that are best for chosen rows (k, m)."""
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
    found = solve(cost, hstack([moves, level, slack]).tocsr(), parts[part, row], bounds=limits, method="highs-ds")
    if found.x is None:
        return None
    return np.asarray(found.x[:size] * reach), float(found.x[size]), np.asarray(found.x[size + 1 :])

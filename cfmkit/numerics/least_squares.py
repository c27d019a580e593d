"""Nonlinear least squares with uncertainty, correlation, parameters that cannot be determined, and lack of fit.

Parameters are scaled by their sizes. Columns of the scaled Jacobian that vanish belong to parameters without effect;
directions with a vanishing singular value to parameters that cannot be told apart. Residuals of a smooth misfit are not
independent: the covariance is inflated by their correlation time, as if there were fewer of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.numerics.robust_statistics import robust_scale

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray


Loss = Literal["linear", "soft_l1", "huber", "cauchy"]
LOSS_NAMES: tuple[Loss, ...] = ("linear", "soft_l1", "huber", "cauchy")
DIFFERENCE_STEP = 1e-5  # of finite differences, in sizes of the parameter
NO_EFFECT = 1e-9
"""A parameter has no effect if changing it by its size changes no value by more than this part of the data."""
SINGULAR_RTOL = 1e-5  # unit columns of the Jacobian are dependent where a singular value is below this


class NotFinite(ValueError):
    """The residuals are not finite where the fit starts."""


@dataclass(frozen=True)
class LeastSquares:
    """A problem: what to make small, from where, within which bounds."""

    residuals: Callable[[FloatArray], FloatArray]  # ``residuals(values) -> (n,) array``; NaN where there is none
    # start, low, high, (p,): starting values and bounds
    start: FloatArray
    low: FloatArray
    high: FloatArray
    size: FloatArray  # (p,) typical size of each parameter, positive
    level: float  # typical size of the data, in the unit of the residuals
    # how many residuals count as one because they have unequal weights: the mean square of the weights over the square
    # of their mean (L. Kish, Survey Sampling, Wiley 1965, sec. 8.2)
    design_effect: float = 1.0
    tolerance: float = 1e-12  # relative change of values and of the sum of squares at which the search ends

    def jacobian(self, values: FloatArray) -> FloatArray:
        """Return the derivatives of the residuals by the parameters in their sizes, by central differences.

        At a bound, or where the residuals beyond are not finite, the difference is one-sided.
        """
        start = self.residuals(values)
        return np.column_stack([self._jacobian_column(values, start, k) for k in range(len(values))])

    def _jacobian_column(self, values: FloatArray, start: FloatArray, k: int) -> FloatArray:
        ends = []
        for sign in (1.0, -1.0):
            moved = np.array(values)
            moved[k] = np.clip(values[k] + sign * DIFFERENCE_STEP * self.size[k], self.low[k], self.high[k])
            shifted = self.residuals(moved) if moved[k] != values[k] else start
            good = bool(np.isfinite(shifted).all())
            ends.append((moved[k], shifted) if good else (values[k], start))
        (above, upper), (below, lower) = ends
        if above == below:
            return np.zeros_like(start)
        return np.asarray((upper - lower) * (self.size[k] / (above - below)))


@dataclass(frozen=True)
class FittedValues:
    """The outcome of a fit."""

    values: FloatArray  # (p,) best values
    covariance: FloatArray  # (p, p) of the values, inflated by `inflation`
    residuals: FloatArray  # (n,) at the best values
    noise: float  # standard deviation of the residuals, by their median absolute deviation under a robust loss
    # correlation time of the residuals in samples, times the effect of their weights: so many count as one
    inflation: float
    at_bound: Any  # (p,) which values lie on a bound
    freedom: float  # degrees of freedom left
    converged: bool  # whether the solver says so

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of each value."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> FloatArray:
        """Correlation matrix of the values; 0 where one of them does not vary."""
        spread = self.deviations
        product = np.outer(spread, spread)
        return np.divide(self.covariance, product, out=np.zeros_like(product), where=product > 0)

    def half_widths(self) -> FloatArray:
        """Return half the width of each value's 95 % confidence interval, by Student's t."""
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, 0.975)) * self.deviations


def unidentifiable(problem: LeastSquares, values: FloatArray) -> tuple[tuple[int, ...], ...]:
    """Return groups of parameters that the data do not determine at some values.

    A group of one has no effect; in a group of several each can make up for the others.

    Raises NotFinite if the residuals are not finite there.
    """
    if not np.isfinite(problem.residuals(values)).all():
        raise NotFinite
    return dependent_columns(problem.jacobian(values), problem.level) if len(values) else ()


def dependent_columns(
    jacobian: FloatArray,  # (n, p): scaled
    level: float,  # what its entries are compared with
) -> tuple[tuple[int, ...], ...]:
    """Return groups of columns that vanish (alone) or are linearly dependent (together)."""
    largest = np.abs(jacobian).max(axis=0)
    groups: list[tuple[int, ...]] = [(int(k),) for k in np.flatnonzero(largest <= NO_EFFECT * level)]
    alive = np.flatnonzero(largest > NO_EFFECT * level)
    if len(alive) > 1:
        unit = jacobian[:, alive] / np.linalg.norm(jacobian[:, alive], axis=0)
        _, singular, right = np.linalg.svd(unit, full_matrices=False)
        for direction in right[singular < SINGULAR_RTOL]:
            groups.append(tuple(int(alive[k]) for k in np.flatnonzero(np.abs(direction) > 0.05)))
    return tuple(dict.fromkeys(groups))


def solve(
    problem: LeastSquares,  # whose Jacobian is not singular: ask `unidentifiable` first
    # how large residuals count. A robust loss starts from the linear fit and takes twice the robust standard deviation
    # of its residuals as the size beyond which they count less
    loss: Loss = "soft_l1",
) -> FittedValues:
    """Return the best values, by a trust-region method within the bounds.

    Raises NotFinite if the residuals are not finite at the start.
    """
    if not np.isfinite(problem.residuals(problem.start)).all():
        raise NotFinite
    best = _minimise(problem, problem.start, "linear", 1.0)
    noise = 1.4826 * float(np.median(np.abs(best.fun)))
    if loss != "linear" and noise > 1e-12 * problem.level:
        best = _minimise(problem, best.x * problem.size, loss, 2.0 * noise)
    return _fitted_values(problem, best, loss)


def evaluate_start(problem: LeastSquares) -> FittedValues:
    """Return the residuals of a problem without parameters, as the outcome of a fit."""
    empty = np.zeros(0)
    residuals = problem.residuals(empty)
    rms, inflation = float(np.sqrt(np.mean(residuals**2))), correlation_time(residuals) * problem.design_effect
    freedom = max(len(residuals) / inflation, 1.0)
    return FittedValues(empty, np.zeros((0, 0)), residuals, rms, inflation, np.zeros(0, dtype=bool), freedom, True)


def _minimise(problem: LeastSquares, start: FloatArray, loss: Loss, scale: float) -> Any:
    from scipy.optimize import least_squares

    size = problem.size
    inside = np.clip(start, problem.low, problem.high)

    solve_scaled: Any = least_squares  # its stubs take no lambdas
    return solve_scaled(
        lambda z: problem.residuals(z * size),
        inside / size,
        lambda z: problem.jacobian(z * size),
        bounds=(problem.low / size, problem.high / size),
        loss=loss,
        f_scale=scale,
        xtol=problem.tolerance,
        ftol=problem.tolerance,
        gtol=0.01 * problem.tolerance,
        max_nfev=200,
    )


def _fitted_values(problem: LeastSquares, best: Any, loss: Loss) -> FittedValues:
    at_bound = best.active_mask != 0
    # the solver stays inside by a hair
    values = np.where(at_bound, np.where(best.active_mask < 0, problem.low, problem.high), best.x * problem.size)
    residuals = problem.residuals(values)
    count, free = len(residuals), len(residuals) - len(values)
    rms = float(np.sqrt((residuals**2).sum() / max(free, 1)))
    noise = rms if loss == "linear" else 1.4826 * float(np.median(np.abs(residuals))) or rms
    inflation = correlation_time(residuals) * problem.design_effect
    # With a robust loss the solver's Jacobian is weighted, so that its square is the curvature of the loss.
    _, singular, right = np.linalg.svd(best.jac, full_matrices=False)
    inverse = (right.T / np.maximum(singular, 1e-14 * singular[0]) ** 2) @ right
    covariance = noise**2 * inflation * inverse * np.outer(problem.size, problem.size)
    freedom = max(count / inflation - len(values), 1.0)
    return FittedValues(values, covariance, residuals, noise, inflation, at_bound, freedom, bool(best.success))


@dataclass(frozen=True)
class LackOfFit:
    """Whether residuals swing along the data by more than their noise explains."""

    swing: float  # root mean square of what is systematic in them
    noise: float  # standard deviation of what is not
    chance: float  # probability that noise alone makes means of neighbours as large


MAX_BLOCKS = 24  # means of so many stretches of each branch are compared with the noise inside them, at most
_SAMPLES_A_BLOCK = 8


def lack_of_fit(
    branches: Sequence[FloatArray],  # sequence of (n,): residuals of each branch in the order of its places
    fitted: int,  # number of fitted values
) -> LackOfFit:
    """Return the F test of means of neighbouring residuals against the scatter inside each group of neighbours.

    Neighbours count as pure error, as repeated points do in the classical test; where they are alike
    over less than a stretch, as under vibration, so many of them count as one. Residuals beyond five
    robust standard deviations count as that much.

    References
    ----------
    N. R. Draper, H. Smith, Applied Regression Analysis, 3rd ed., Wiley 1998, sec. 2.1: lack of fit and pure error.
    """
    from scipy.special import fdtrc

    far = 5.0 * robust_scale(np.concatenate(list(branches)))
    blocks = []
    for residuals in branches:
        count = min(MAX_BLOCKS, len(residuals) // _SAMPLES_A_BLOCK)
        if count >= 2:
            blocks += np.array_split(np.clip(residuals, -far, far) if far else residuals, count)
    free = len(blocks) - fitted
    if free < 2:
        return LackOfFit(0.0, 0.0, 1.0)
    means = np.array([block.mean() for block in blocks])
    inside = np.concatenate([block - block.mean() for block in blocks])
    alike = correlation_time(inside)
    left = max(len(inside) / alike - len(blocks), 1.0)
    noise = float(np.sqrt((inside**2).sum() / max(len(inside) - len(blocks), 1)))
    sizes = np.array([len(block) for block in blocks])
    by_chance = alike * noise**2
    between = float((sizes * means**2).sum())
    swing = max((between - free * by_chance) / sizes.sum(), 0.0) ** 0.5
    chance = float(fdtrc(free, left, between / free / by_chance)) if by_chance else float(swing == 0)
    return LackOfFit(swing, noise, chance)


def correlation_time(residuals: FloatArray) -> float:
    """Return how many successive residuals count as one: 1 + 2 sum of their correlations, at least 1."""
    count = len(residuals)
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    if power == 0 or count < 16:
        return 1.0
    spectrum = np.fft.rfft(centred, 2 * count)
    correlations = np.fft.irfft(np.abs(spectrum) ** 2)[: count // 4] / power
    end = int(np.argmax(correlations < 2.0 / np.sqrt(count))) or len(correlations)
    return float(np.clip(1.0 + 2.0 * correlations[1:end].sum(), 1.0, count / 10))

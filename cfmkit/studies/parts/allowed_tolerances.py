"""The inverse of a tolerance study: which tolerance on each parameter keeps the requested yield.

Requirements become rows of force and stress at a few poses (`requirement_rows`). How they move with each error alone is
solved at some of its sizes and linear between; errors of several parameters add. A derivative would not do: tolerances
may become twenty times as wide as stated. With that the yield of any set of tolerances is estimated without one more
solution. Three answers follow:

- alone: how wide one tolerance may be while all others stay as they are stated;
- together: all of them by one factor;
- allocated: by cost. With c / tolerance for the cost of each, the cheapest set whose spread of the critical limits is
  the same has tolerances in proportion to (c / s^2)^(1/3), s being what a parameter adds to that spread (Lagrange's
  multiplier of sum c/t under sum (t s)^2).

The allocated set is then drawn and analysed part by part: the yield that is reported is that of those parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.run_control import Run
from cfmkit.studies.parts.requirement_rows import numbers_of, numbers_of_parts, requirement_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.results import Result
    from cfmkit.studies.parts.parts import Parts

ERRORS_TRIED = np.array([-2.5, -1.7, -0.85, 0.85, 1.7, 2.5])
"""Errors at which limits are solved, in standard deviations; 1.7 is just within the ends of a range."""
MAX_SOLUTIONS, SAME_FACTOR, LEAST_FACTOR, N_ROUGH = 4, 1.3, 1e-6, 500
"""How often limits are solved, what is taken for the same tolerance, the least part of a stated one, and the parts that
decide where to solve again."""
MAX_TOLERANCE_FACTOR = 20.0
"""A tolerance is not made wider than so many times what is stated: first order does not reach farther."""
N_BISECTIONS = 26  # bisections: to a millionth of what is stated
MIN_TOLERANCE_RATIO = 1e-3
"""Of the widest tolerance the narrowest of an allocation has at least so much: no cost is beyond all others."""


@dataclass(frozen=True)
class LimitsAlong:
    """Changes of limits with the error of one parameter."""

    offsets: FloatArray  # (p,) errors at which that is known, increasing, 0 among them
    changes: FloatArray  # (p, m) of the limits there

    def __call__(self, errors: FloatArray) -> FloatArray:
        """Return the changes of the limits for errors (k,), linear between the offsets and beyond, (k, m)."""
        at = np.clip(np.searchsorted(self.offsets, errors) - 1, 0, len(self.offsets) - 2)
        share = ((errors - self.offsets[at]) / np.diff(self.offsets)[at])[:, None]
        return np.asarray((1.0 - share) * self.changes[at] + share * self.changes[at + 1])

    def merge(self, earlier: LimitsAlong | None) -> LimitsAlong:
        """Return the same with what is known at other errors, too."""
        if earlier is None:
            return self
        offsets, at = np.unique(np.concatenate([self.offsets, earlier.offsets]), return_index=True)
        return LimitsAlong(offsets, np.concatenate([self.changes, earlier.changes])[at])


def limits_along_errors(
    parts: Parts, nominal: Result, factors: FloatArray
) -> tuple[FloatArray, tuple[LimitsAlong, ...]]:
    """Return the limits of a perfect part (m,), and how they move with the error of each parameter.

    `factors`, (d,): on the stated tolerances: limits are solved as far as such tolerances go.

    Raises SolutionError if the perfect part, or one near it, cannot be followed at a few poses.
    """
    run, spec = Run(), parts.spec
    rows = requirement_rows(nominal, spec, run)
    middle = None if rows is None else numbers_of(spec, rows, run)
    if rows is None or middle is None:
        raise SolutionError("the specification cannot be followed at a few poses: no tolerance can be stated")
    limits = []
    for parameter, factor in zip(parts.parameters, factors.tolist(), strict=True):
        tight = parameter.spread.tighten(factor)
        offsets = factor * ERRORS_TRIED * parameter.spread.standard_deviation
        values = parameter.spread.nominal + offsets
        tried = (offsets != 0.0) & (tight.low <= values) & (values <= tight.high)
        part_numbers = numbers_of_parts(spec, {parameter.path: values[tried]}, rows, run)
        numbers_by_offset = dict(zip(offsets[tried].tolist(), part_numbers, strict=True))
        moved = {
            offset: numbers - middle for offset, numbers in sorted(numbers_by_offset.items()) if numbers is not None
        }
        if not moved:
            raise SolutionError(
                f"parts with an error of {parameter.path} cannot be followed: state a smaller tolerance for it"
            )
        offsets, at = np.array(list(moved)), int(np.searchsorted(list(moved), 0.0))
        changes = np.array(list(moved.values())) @ rows.matrix.T
        limits.append(LimitsAlong(np.insert(offsets, at, 0.0), np.insert(changes, at, 0.0, axis=0)))
    return rows.limits(middle), tuple(limits)


@dataclass(frozen=True)
class ToleranceFactors:
    """Factors on the stated tolerances; NaN where even none of that error leaves the yield too low."""

    # alone, together, allocated, (d,): for each parameter
    alone: FloatArray
    together: FloatArray
    allocated: FloatArray
    share: float  # yield as stated, as estimated
    perfect: float  # yield without errors, 0 or 1


def factors_that_keep(
    rows: FloatArray,
    along: tuple[LimitsAlong, ...],
    errors: FloatArray,
    costs: FloatArray,
    wanted: float,
) -> ToleranceFactors:
    """Return the factors on tolerances that keep a wanted yield.

    `rows`, (m,): limits of a perfect part, at least zero where they hold; `along`, of d errors: how they move with
    each; `errors`, (k, d): of parts as the tolerances are stated; `costs`, (d,): of each tolerance, over its width.
    """
    stated = [limit(error) for limit, error in zip(along, errors.T, strict=True)]
    all_moved: FloatArray = np.sum(stated, axis=0)
    ones = np.ones(errors.shape[1])

    def good(moved: FloatArray) -> float:
        return float((rows + moved >= 0).all(axis=1).mean())

    def share(factors: FloatArray) -> float:
        return good(
            np.sum([limit(f * error) for limit, f, error in zip(along, factors, errors.T, strict=True)], axis=0)
        )

    def share_alone(k: int) -> Callable[[float], float]:
        others = all_moved - stated[k]
        return lambda f: good(others + along[k](f * errors[:, k]))

    alone = np.array([_largest(share_alone(k), wanted) for k in range(len(ones))])
    shape = _proportion(rows, np.array([moved.std(axis=0) for moved in stated]).T, costs)
    together = _largest(lambda f: share(f * ones), wanted)
    allocated = _largest(lambda f: share(np.minimum(f * shape, MAX_TOLERANCE_FACTOR)), wanted)
    return ToleranceFactors(
        alone,
        together * ones,
        np.minimum(allocated * shape, MAX_TOLERANCE_FACTOR),
        good(all_moved),
        good(0.0 * all_moved),
    )


def allowed_tolerances(
    parts: Parts, nominal: Result, errors: FloatArray, costs: FloatArray, wanted: float
) -> ToleranceFactors:
    """Return the factors on the tolerances; limits are solved again where these now end, and all solutions count."""
    factors = np.ones(len(parts.parameters))
    earlier_limits: tuple[LimitsAlong | None, ...] = (None,) * len(factors)
    for _ in range(MAX_SOLUTIONS):
        rows, seen = limits_along_errors(parts, nominal, factors)
        earlier_limits = along = tuple(limit.merge(before) for limit, before in zip(seen, earlier_limits, strict=True))
        answer = factors_that_keep(rows, along, errors[:N_ROUGH], costs, wanted)
        ends = np.where(np.isfinite(answer.allocated), answer.allocated, factors)
        ends = np.clip(ends, LEAST_FACTOR, 1.0 if answer.perfect < wanted else MAX_TOLERANCE_FACTOR)
        if (np.abs(np.log(ends / factors)) < np.log(SAME_FACTOR)).all():
            break
        factors = ends
    return factors_that_keep(rows, along, errors, costs, wanted)


def _largest(share: Callable[[float], float], wanted: float) -> float:
    """Return the largest factor with which a yield is kept; NaN where none does."""
    if share(0.0) < wanted:
        return float("nan")
    low, high = 0.0, MAX_TOLERANCE_FACTOR
    if share(high) >= wanted:
        return high
    for _ in range(N_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if share(middle) >= wanted else (low, middle)
    return low


def _proportion(rows: FloatArray, moved: FloatArray, costs: FloatArray) -> FloatArray:
    """Return in which proportion tolerances of least cost stand, their mean 1; moved (m, d): what each adds."""
    spread = np.sqrt((moved**2).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        closeness = np.where(spread > 0, np.exp(-0.5 * np.clip(rows / spread, 0.0, 30.0) ** 2), 0.0)
    # what a limit loses counts as often as it is missed
    weights = closeness / closeness.sum() if closeness.sum() > 0 else np.full(len(rows), 1.0 / len(rows))
    scaled = np.where(spread[:, None] > 0, (moved / np.maximum(spread, 1e-300)[:, None]) ** 2, 0.0)
    adds = np.maximum(weights @ scaled, 1e-9)
    ratios: FloatArray = (costs / costs.max() / adds) ** (1.0 / 3.0)
    ratios = np.maximum(ratios, MIN_TOLERANCE_RATIO * ratios.max())
    return np.asarray(ratios / ratios.mean())

"""Sets of springs, one of those on offer per joint, with the smallest largest deviation: every set is accounted for.

Sets are enumerated joint by joint. What cannot be part of a set as good as the best so far is left out: linear
programmes bound the rate of each joint, whatever the others are. Of the last two joints all pairs are looked at, since
with one of them the rates of the other are an interval in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.fit_rates import minimax, ranges

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.fit_rates import RateGoal

PLACES = 41
"""Places of the window that bounds are taken from; sets themselves are judged at all places."""

SLACK = 1e-9
"""Bounds are wider by this share: rounding must not leave a set out."""


def best_sets(goal: RateGoal, offered: Sequence[FloatArray], count: int = 1) -> list[tuple[float, FloatArray]]:
    """Return the sets with the smallest largest deviation, the best first.

    Parameters
    ----------
    goal : RateGoal
        Over m joints.
    offered : sequence of m arrays
        Rates that each joint may have, increasing; zero among them where it may have no spring.
    count : int
        How many sets.

    Returns
    -------
    list of (float, (m,) array)
        The deviation and the rates; empty if no set keeps what the goal requires beside the deviation.
    """
    if any(not len(one) for one in offered):
        return []
    few = goal.at(np.unique(np.linspace(0, len(goal.wanted) - 1, PLACES).round().astype(int)))
    # limits of single rates are those of what is offered
    search = _Sets(goal, replace(few, upper=np.full(len(offered), np.inf), lower=None), count)
    search.begin(offered)
    search.look([np.asarray(one) for one in offered])
    return sorted(search.found, key=lambda one: one[0])


@dataclass
class _Sets:
    """The best sets so far."""

    goal: RateGoal
    few: RateGoal
    count: int
    found: list[tuple[float, FloatArray]] = field(default_factory=list)

    @property
    def bound(self) -> float:
        """Return the deviation that a set must not exceed to be among the best."""
        return self.found[-1][0] if len(self.found) == self.count else np.inf

    def take(self, sets: FloatArray) -> None:
        """Take those of some sets (k, m) that are among the best."""
        if self.goal.least is not None:
            row, least = self.goal.least
            sets = sets[sets @ row >= least - SLACK * abs(least)]
        if not len(sets):
            return
        off = np.abs(sets @ self.goal.matrix.T - self.goal.wanted).max(axis=1)
        for k in np.argsort(off, kind="stable")[: self.count].tolist():
            known = any(np.array_equal(sets[k], one) for _, one in self.found)
            if off[k] <= self.bound and not known:
                self.found = sorted([*self.found, (float(off[k]), sets[k])], key=lambda one: one[0])[: self.count]

    def begin(self, offered: Sequence[FloatArray]) -> None:
        """Take the sets next to the best rates that could be had if every rate could: they bound all others."""
        rates = minimax(self.few)
        if rates is not None:
            near = [
                one[max(0, int(np.searchsorted(one, rate)) - 1) :][:2] for one, rate in zip(offered, rates, strict=True)
            ]
            self.take(np.array(list(product(*near))))

    def look(self, offered: list[FloatArray]) -> None:
        """Look at all sets of what is offered that may be among the best."""
        open_ = [k for k, one in enumerate(offered) if len(one) > 1]
        if len(open_) <= 2:
            self._look_at_pairs(offered, open_)
            return
        offered = self._within_bounds(offered)
        if any(not len(one) for one in offered):
            return
        joint = min((k for k in open_ if len(offered[k]) > 1), key=lambda k: len(offered[k]), default=open_[0])
        one = offered[joint]
        # the middle first: the sooner a good set is found, the more is left out
        for rate in one[np.argsort(np.abs(one - 0.5 * (one[0] + one[-1])), kind="stable")]:
            self.look([np.array([rate]) if k == joint else other for k, other in enumerate(offered)])

    def _within_bounds(self, offered: list[FloatArray]) -> list[FloatArray]:
        """Return what is left of each joint's rates if no place may be off by more than the bound."""
        if not np.isfinite(self.bound):
            return offered
        ends = np.array([[one[0], one[-1]] for one in offered])
        worst = self.bound * (1 + SLACK) + 1e-12
        found = ranges(replace(self.few, lower=ends[:, 0], upper=ends[:, 1]), worst)
        if np.isnan(found).any():
            return [one[:0] for one in offered]
        reach = 1e-6 * np.abs(found).max(axis=1, keepdims=True) * np.array([-1.0, 1.0])
        return [one[(one >= low) & (one <= high)] for one, (low, high) in zip(offered, found + reach, strict=True)]

    def _look_at_pairs(self, offered: list[FloatArray], open_: list[int]) -> None:
        """Look at all sets in which at most two joints have more than one rate."""
        first, second = (open_ + [k for k in range(len(offered)) if k not in open_])[:2]
        fixed = np.array([one[0] for one in offered])
        fixed[[first, second]] = 0.0
        own, other = offered[first], offered[second]
        base = self.few.matrix @ fixed - self.few.wanted + np.outer(own, self.few.matrix[:, first])
        column = self.few.matrix[:, second]
        for k in np.argsort(np.abs(base).min(axis=1), kind="stable").tolist():
            low, high = _interval(base[k], column, self.bound * (1 + SLACK) + 1e-12)
            mates = other[(other >= low) & (other <= high)]
            if len(mates):
                sets = np.tile(fixed, (len(mates), 1))
                sets[:, first], sets[:, second] = own[k], mates
                self.take(sets)


def _interval(base: FloatArray, column: FloatArray, worst: float) -> tuple[float, float]:
    """Return between which rates no place is off by more than `worst`: |base + rate column| <= worst."""
    moved = column != 0.0
    if not np.isfinite(worst):
        return -np.inf, np.inf
    if (np.abs(base[~moved]) > worst).any():
        return np.inf, -np.inf
    ends = np.sort(np.array([-worst - base[moved], worst - base[moved]]) / column[moved], axis=0)
    low, high = (float(ends[0].max()), float(ends[1].min())) if moved.any() else (-np.inf, np.inf)
    reach = 1e-9 * max(abs(low), abs(high)) if np.isfinite([low, high]).all() else 0.0
    return low - reach, high + reach

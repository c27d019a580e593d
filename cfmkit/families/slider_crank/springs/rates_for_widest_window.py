"""The widest window in which springs can keep an effort within a tolerance.

All beginnings are searched: a part of a window never deviates more than the window. So if a window that begins in
[a, b] is to be wider than w, springs must keep the tolerance from b to a + w: one linear programme says whether they
do. Where they do, the interval is halved, and windows from its middle are tried.

A window grows locally: for a width the place with the smallest largest deviation, the width by steps in the law
deviation ~ width^3 inside a shrinking bracket. It begins at what was found, else beside the stretched position, or
where that has none, at the flattest place of the motion.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import can_keep, minimax
from cfmkit.families.slider_crank.springs.rate_fit_task import N_WINDOW_PLACES

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.rate_fit_task import SpringTask


N_SEARCH_PLACES = 48  # places of a window during the search; the result is judged on `N_WINDOW_PLACES`
WIDTH_OVER_LEAD = 0.533  # width of the best window over the lead of the unloaded position, for 0.5 % and small angles
MAX_STEPS = 24
"""Twenty halvings leave 1e-6 of a width, which ends the search; with steps by the law, the tests need ten."""
MIN_TOLERANCE_SHARE = 1.0 - 1e-4
"""A deviation between this share of the tolerance and all of it ends the search: the width is then right to 3e-5."""
MIN_WIDTH_GAIN, MIN_WIDTH_SHARE = 1e-3, 5e-4
"""A window wider by less than the first share is not looked for; nor one below the second share of the motion."""
N_START_INTERVALS, MAX_PROGRAMMES = 32, 4000
"""Intervals of beginnings that the search of the whole motion starts with, and its largest number of programmes."""
NEIGHBOUR_WIDTH_SHARE = 0.08  # once a window is found, the next one is looked for so near, as a share of its width
POOR_WIDTH_SHARE, N_ELSEWHERE_PLACES = 0.5, 25
"""A window narrower than this share of what was expected is also looked for elsewhere, at so many places."""
TOLERANCE_SHARE = 1.0 - 2e-5  # between the places on which it is judged, a deviation can be larger by this


@dataclass(frozen=True)
class FittedWindow:
    """A window, its springs and how far they are off."""

    # low, high: ends [rad or m]
    low: float
    high: float
    rates: FloatArray  # (4,) of the springs of one leg
    deviation: float  # largest one, as a fraction of the target

    @property
    def width(self) -> float:
        """High less low."""
        return self.high - self.low


def widest(task: SpringTask, tolerance: float) -> FittedWindow | None:
    """Return a wide window with no deviation above a tolerance, by the local search; None if that finds none."""
    first, last = task.searched
    if not last > first:
        return None
    tolerance *= TOLERANCE_SHARE
    width, middle = _first_guess(task, tolerance)
    width = min(width, last - first)
    best = _grow_window(task, tolerance, width, middle, 0.6)
    if best is not None and best.width >= POOR_WIDTH_SHARE * width:
        return best
    elsewhere = _flattest(task, width)
    grown = None if elsewhere is None else _grow_window(task, tolerance, width, elsewhere, NEIGHBOUR_WIDTH_SHARE)
    return max((item for item in (best, grown) if item is not None), key=lambda item: item.width, default=None)


def widest_of_all(task: SpringTask, tolerance: float) -> tuple[FittedWindow | None, bool]:
    """Return the widest window of the motion, and whether all that are wider by `MIN_WIDTH_GAIN` are ruled out."""
    first, last = task.searched
    if not last > first:
        return None, True
    search = _Everywhere(task, tolerance * TOLERANCE_SHARE)
    ends = search.run()
    if ends is None:
        return widest(task, tolerance), search.finished
    low, high = ends
    return _grow_window(
        task, tolerance * TOLERANCE_SHARE, high - low, 0.5 * (low + high), NEIGHBOUR_WIDTH_SHARE
    ), search.finished


class _Everywhere:
    """The search of all beginnings of a window for the widest one."""

    def __init__(self, task: SpringTask, tolerance: float) -> None:
        self.task, self.tolerance = task, tolerance
        self.first, self.last = task.searched
        self.width = MIN_WIDTH_SHARE * (self.last - self.first)
        self.left, self.finished = MAX_PROGRAMMES, True

    def run(self) -> tuple[float, float] | None:
        """Return the widest window, judged on `N_SEARCH_PLACES`; None if there is none above `MIN_WIDTH_SHARE`."""
        best: tuple[float, float] | None = None
        ends = np.linspace(self.first, self.last, N_START_INTERVALS + 1).tolist()
        queue = deque(itertools.pairwise(ends))
        while queue:
            low, high = queue.popleft()
            wanted = self.width * (1.0 + MIN_WIDTH_GAIN)
            if low + wanted > self.last or not self._may_begin(low, min(high, self.last - wanted), wanted):
                continue
            if self.left <= 0:
                self.finished = False
                break
            middle = 0.5 * (low + high)
            if middle + wanted <= self.last and self._keeps(middle, middle + wanted):
                best = middle, self._find_end(middle, middle + wanted)
                self.width = best[1] - best[0]
            if high - low > 0.5 * self.width * (MIN_WIDTH_GAIN if best else 1.0):
                queue += [(low, middle), (middle, high)]
        return best

    def _may_begin(self, low: float, high: float, width: float) -> bool:
        """Return whether a window of a width may begin in an interval: its part common to all of them must keep."""
        return low + width <= high or self._keeps(high, low + width)

    def _keeps(self, low: float, high: float) -> bool:
        """Return whether springs keep the tolerance over a window."""
        self.left -= 1
        goal = self.task.goal((low, high), N_SEARCH_PLACES)
        return goal is not None and can_keep(goal, self.tolerance)

    def _find_end(self, low: float, high: float) -> float:
        """Return where the widest window from its beginning ends: double, then halve."""
        step, bad = high - low, math.inf
        while high < self.last and bad - high > 0.25 * MIN_WIDTH_GAIN * (high - low):
            trial = min(high + step, self.last) if math.isinf(bad) else 0.5 * (high + bad)
            if self._keeps(low, trial):
                high, step = trial, 2.0 * step
            else:
                bad = trial
        return high


def _flattest(task: SpringTask, width: float) -> float | None:
    """Return the middle of the window of a width with the smallest deviation, of some all over the motion."""
    first, last = task.searched
    places = (first + (last - width - first) * k / (N_ELSEWHERE_PLACES - 1) for k in range(N_ELSEWHERE_PLACES))
    windows = [
        item for item in (_solve_window(task, low, low + width, N_SEARCH_PLACES) for low in places) if item is not None
    ]
    best = min(windows, key=lambda item: item.deviation, default=None)
    return None if best is None else 0.5 * (best.low + best.high)


def _grow_window(task: SpringTask, tolerance: float, width: float, middle: float, look: float) -> FittedWindow | None:
    """Return the widest window found from a width and a middle on, looking aside by a share of the width."""
    first, last = task.searched
    best: FittedWindow | None = None
    low, high = 0.0, last - first
    for _ in range(MAX_STEPS):
        width = min(width, last - first)
        window = _best_place(task, width, middle, look)
        if window is not None:
            middle, look = 0.5 * (window.low + window.high), NEIGHBOUR_WIDTH_SHARE
        if window is not None and window.deviation <= tolerance:
            best, low = window, max(low, width)
            if window.deviation >= tolerance * MIN_TOLERANCE_SHARE or width >= last - first:
                break
            if width > 0.9 * high and window.deviation < 0.5 * tolerance:
                high = last - first  # the window has moved on from where that width had failed
        else:
            high = min(high, width)
        if high - low <= 1e-6 * high:
            break
        width = _next_width(window, tolerance, (low, high), width)
    return best


def _first_guess(task: SpringTask, tolerance: float) -> tuple[float, float]:
    """Return width and middle from the law for small angles, or a tenth of the motion next to its start."""
    first, last = task.searched
    assembly = task.assembly
    lead = assembly.stretched_motion - assembly.start
    if assembly.drive == "torque" and abs(lead) > 1e-6:
        return WIDTH_OVER_LEAD * abs(lead) * (tolerance / 0.005) ** (1 / 3), assembly.stretched_motion
    return 0.1 * (last - first), first + 0.1 * (last - first)


def _next_width(window: FittedWindow | None, tolerance: float, bracket: tuple[float, float], width: float) -> float:
    low, high = bracket
    if window is None or window.deviation <= 0.0:
        return 0.5 * (low + high)
    wanted = tolerance * (0.5 + 0.5 * MIN_TOLERANCE_SHARE)
    step = width * min(max((wanted / window.deviation) ** (1 / 3), 0.5), 2.0)
    return step if low < step < high else 0.5 * (low + high)


def _best_place(task: SpringTask, width: float, middle: float, look: float) -> FittedWindow | None:
    """Return the window of a width with the smallest largest deviation near a place, by shares of the width."""
    from scipy.optimize import minimize_scalar

    first, last = task.searched
    room = last - width
    if room <= first:
        return evaluate_window(task, first, last)

    def deviation(low: float) -> float:
        window = _solve_window(task, low, low + width, N_SEARCH_PLACES)
        return window.deviation if window else 1e300

    start = min(max(middle - 0.5 * width, first), room)
    bracket = max(first, start - look * width), min(room, start + look * width)
    minimum = minimize_scalar(
        deviation, bounds=bracket, method="bounded", options={"xatol": 1e-4 * width, "maxiter": 25}
    )
    ends = [end for end in (first, room) if end in bracket]
    low = min([float(minimum.x), *ends], key=deviation) if ends else float(minimum.x)
    if look < 0.5 and min(abs(low - bracket[0]), abs(low - bracket[1])) < 1e-3 * width and low not in ends:
        return _best_place(task, width, low + 0.5 * width, 0.6)
    return evaluate_window(task, low, low + width)


def evaluate_window(task: SpringTask, low: float, high: float) -> FittedWindow | None:
    """Return the best springs for a window, judged on many places; None if there are none."""
    return _solve_window(task, low, high, N_WINDOW_PLACES)


def _solve_window(task: SpringTask, low: float, high: float, count: int) -> FittedWindow | None:
    goal = task.goal((low, high), count)
    rates = None if goal is None else minimax(goal)
    if goal is None or rates is None or not math.isfinite(goal.deviation(rates)):
        return None
    return FittedWindow(low, high, rates, goal.deviation(rates))

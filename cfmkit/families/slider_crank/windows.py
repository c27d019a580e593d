"""The widest window in which springs can keep an effort within a tolerance.

For a width, the place of the window with the smallest largest deviation is searched; the width is then found by
steps in the law deviation ~ width^3 inside a shrinking bracket. A local search from the
neighbourhood of the stretched position, or, where that has none, from the flattest place of
the motion: wider windows may exist elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.families.slider_crank.rates import minimax
from cfmkit.families.slider_crank.targets import DENSE

if TYPE_CHECKING:
    from cfmkit.curves import FloatArray
    from cfmkit.families.slider_crank.targets import Task

COARSE = 48
"""Places of a window during the search; the result is judged on `DENSE` ones."""

LAW = 0.533
"""Width of the best window over the lead of the unloaded position, for 0.5 % and small angles."""

STEPS = 24

CLOSE = 1.0 - 1e-4
"""A deviation between this share of the tolerance and all of it ends the search: the width is then right to 3e-5."""

NARROW = 0.08
"""Once a window is found, the next one is looked for so near, as a share of its width."""

POOR, PLACES = 0.5, 25
"""A window narrower than this share of what was expected is also looked for elsewhere, at so many places."""

KEPT = 1.0 - 2e-5
"""Between the places on which it is judged, a deviation can be larger by this."""


@dataclass(frozen=True)
class Window:
    """A window, its springs and how far they are off.

    Attributes
    ----------
    low, high : float
        Ends [rad or m].
    rates : (4,) array
        Of the springs of one leg.
    deviation : float
        Largest one, as a fraction of the target.
    """

    low: float
    high: float
    rates: FloatArray
    deviation: float

    @property
    def width(self) -> float:
        """High less low."""
        return self.high - self.low


def widest(task: Task, tolerance: float) -> Window | None:
    """Return the widest window found with no deviation above a tolerance; None if there is none."""
    first, last = task.allowed
    if not last > first:
        return None
    tolerance *= KEPT
    width, middle = _first_guess(task, tolerance)
    width = min(width, last - first)
    best = _grown(task, tolerance, width, middle, 0.6)
    if best is not None and best.width >= POOR * width:
        return best
    elsewhere = _flattest(task, width)
    found = None if elsewhere is None else _grown(task, tolerance, width, elsewhere, NARROW)
    return max((item for item in (best, found) if item is not None), key=lambda item: item.width, default=None)


def _flattest(task: Task, width: float) -> float | None:
    """Return the middle of the window of a width with the smallest deviation, of some all over the motion."""
    first, last = task.allowed
    places = (first + (last - width - first) * k / (PLACES - 1) for k in range(PLACES))
    found = [item for item in (_solved(task, low, low + width, COARSE) for low in places) if item is not None]
    best = min(found, key=lambda item: item.deviation, default=None)
    return None if best is None else 0.5 * (best.low + best.high)


def _grown(task: Task, tolerance: float, width: float, middle: float, look: float) -> Window | None:
    """Return the widest window found from a width and a middle on, looking aside by a share of the width."""
    first, last = task.allowed
    best: Window | None = None
    low, high = 0.0, last - first
    for _ in range(STEPS):
        width = min(width, last - first)
        found = _best_place(task, width, middle, look)
        if found is not None:
            middle, look = 0.5 * (found.low + found.high), NARROW
        if found is not None and found.deviation <= tolerance:
            best, low = found, max(low, width)
            if found.deviation >= tolerance * CLOSE or width >= last - first:
                break
            if width > 0.9 * high and found.deviation < 0.5 * tolerance:
                high = last - first  # the window has moved on from where that width had failed
        else:
            high = min(high, width)
        if high - low <= 1e-6 * high:
            break
        width = _next_width(found, tolerance, (low, high), width)
    return best


def _first_guess(task: Task, tolerance: float) -> tuple[float, float]:
    """Return width and middle from the law for small angles, or a tenth of the motion next to its start."""
    first, last = task.allowed
    assembly = task.assembly
    lead = assembly.stretched - assembly.start
    if assembly.drive == "torque" and abs(lead) > 1e-6:
        return LAW * abs(lead) * (tolerance / 0.005) ** (1 / 3), assembly.stretched
    return 0.1 * (last - first), first + 0.1 * (last - first)


def _next_width(found: Window | None, tolerance: float, bracket: tuple[float, float], width: float) -> float:
    low, high = bracket
    if found is None or found.deviation <= 0.0:
        return 0.5 * (low + high)
    wanted = tolerance * (0.5 + 0.5 * CLOSE)
    step = width * min(max((wanted / found.deviation) ** (1 / 3), 0.5), 2.0)
    return step if low < step < high else 0.5 * (low + high)


def _best_place(task: Task, width: float, middle: float, look: float) -> Window | None:
    """Return the window of a width with the smallest largest deviation near a place, by shares of the width."""
    from scipy.optimize import minimize_scalar

    first, last = task.allowed
    room = last - width
    if room <= first:
        return judged(task, first, last)

    def deviation(low: float) -> float:
        found = _solved(task, low, low + width, COARSE)
        return found.deviation if found else 1e300

    start = min(max(middle - 0.5 * width, first), room)
    bracket = max(first, start - look * width), min(room, start + look * width)
    found = minimize_scalar(deviation, bounds=bracket, method="bounded", options={"xatol": 1e-4 * width, "maxiter": 25})
    ends = [end for end in (first, room) if end in bracket]
    low = min([float(found.x), *ends], key=deviation) if ends else float(found.x)
    if look < 0.5 and min(abs(low - bracket[0]), abs(low - bracket[1])) < 1e-3 * width and low not in ends:
        return _best_place(task, width, low + 0.5 * width, 0.6)
    return judged(task, low, low + width)


def judged(task: Task, low: float, high: float) -> Window | None:
    """Return the best springs for a window, judged on many places; None where there are none."""
    return _solved(task, low, high, DENSE)


def _solved(task: Task, low: float, high: float, count: int) -> Window | None:
    goal = task.goal((low, high), count)
    rates = None if goal is None else minimax(goal)
    if goal is None or rates is None or not math.isfinite(goal.deviation(rates)):
        return None
    return Window(low, high, rates, goal.deviation(rates))

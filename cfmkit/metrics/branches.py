"""Branches of a curve, their part inside a window, and mean, extremes and broken limits where the motion turns back.

A window keeps the samples inside it and adds interpolated end points where its ends lie strictly between two samples.
It never reaches beyond the data. A branch that folds back in displacement enters and leaves a window several times:
then every contiguous run inside is kept, in path order. A path that leaves over one end comes back over the same end,
so nothing is bridged between two runs.

Of a branch whose motion turns back, known at every place of its way, mean, extremes and the places where it breaks a
limit follow: between two neighbouring places of `WindingPath.ways` neither motion nor effort turns, so that each is
passed once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import polynomial

from cfmkit.arrays import distinct
from cfmkit.numerics.roots import last_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve, Kind
    from cfmkit.results import WindingPath

    Interval = tuple[float, float]


WINDOW_RTOL = 1e-9
"""How far a sample may miss an end of the window and still count as on it, as a fraction of the window."""
BAND_RTOL = 1e-12  # a force on the edge of a band is inside it, whatever the last bits of the division say


class Undefined(Exception):
    """A metric has no value on this curve; `reason` says why. Caught where metrics are evaluated."""

    def __init__(self, reason: str) -> None:
        """Keep the reason, which follows "undefined: " in a sentence."""
        self.reason = reason
        super().__init__(reason)


@dataclass(frozen=True)
class Window:
    """A closed interval of displacement [m] or angle [rad].

    Raises
    ------
    ValueError
        If it has no width.
    """

    lo: float
    hi: float

    def __post_init__(self) -> None:
        if not self.lo < self.hi:
            raise ValueError(f"a window must be increasing, got {self.lo!r} to {self.hi!r}")


@dataclass(frozen=True, eq=False)
class BranchTrace:
    """One branch of a curve, or the part of it inside a window, in path order."""

    name: str  # the branch
    # motion, effort, (n,): displacement and force [m, N], or angle and torque [rad, N m]
    motion: FloatArray
    effort: FloatArray
    read_stress: Callable[[], FloatArray] | None = None  # the curve's column ``max_stress``, (n,) [Pa], if it has one

    @cached_property
    def stress(self) -> FloatArray | None:
        """Largest stress at each point (n,) [Pa], computed when it is read; None if the curve has none."""
        return None if self.read_stress is None else self.read_stress()

    @cached_property
    def way(self) -> int:
        """1 if the motion never decreases along the path, -1 if it never increases, 0 if it turns back."""
        steps = self.motion[1:] - self.motion[:-1]
        if not len(steps) or steps.min() >= 0:
            return 1
        return -1 if steps.max() <= 0 else 0

    @cached_property
    def extent(self) -> tuple[float, float]:
        """Smallest and largest motion."""
        if self.way:
            first, last = float(self.motion[0]), float(self.motion[-1])
            return (first, last) if self.way > 0 else (last, first)
        return float(self.motion.min()), float(self.motion.max())


def traces(curve: Curve) -> tuple[BranchTrace, ...]:
    """Return the branches of a curve in the order in which they first occur."""
    if not len(curve):
        return ()
    starts = np.flatnonzero(curve.branch[1:] != curve.branch[:-1]) + 1
    names = [str(curve.branch[0]), *curve.branch[starts].tolist()]
    if len(set(names)) == len(names):
        ends = [0, *starts.tolist(), len(curve)]
        return tuple(_trace(curve, name, slice(a, b)) for name, a, b in zip(names, ends[:-1], ends[1:], strict=True))
    return tuple(_trace(curve, name, np.flatnonzero(curve.branch == name)) for name in dict.fromkeys(names))


def _trace(curve: Curve, name: str, where: slice | NDArray[np.intp]) -> BranchTrace:
    read = (lambda: curve.extra["max_stress"].values[where]) if "max_stress" in curve.extra else None
    return BranchTrace(name, curve.motion[where], curve.effort[where], read)


def span_text(lo: float, hi: float, kind: Kind) -> str:
    """Return an interval of the motion as text in border units, rounded to six digits: ``2 ... 240 mm``."""
    from cfmkit.specs.units import border_unit, to_border

    dimension = "length" if kind == "force" else "angle"
    return f"{float(to_border(lo, dimension)):.6g} ... {float(to_border(hi, dimension)):.6g} {border_unit(dimension)}"


def covers(extent: tuple[float, float], window: Window) -> bool:
    """Return whether data from `extent[0]` to `extent[1]` reach both ends of the window."""
    slack = WINDOW_RTOL * (window.hi - window.lo)
    return extent[0] <= window.lo + slack and extent[1] >= window.hi - slack


def find_between_ends(places: FloatArray, low: float, high: float) -> NDArray[np.bool_]:
    """Return which places lie between the ends of a window and are none of these, but for rounding."""
    slack = WINDOW_RTOL * (high - low)
    return (places > low + slack) & (places < high - slack)


def restrict(motion: FloatArray, values: FloatArray, window: Window) -> tuple[FloatArray, FloatArray]:
    """Return places and values of a branch inside a window, in the order of its path, with interpolated ends.

    One that turns back may have several runs there. The caller checks `covers`.
    """
    slack = WINDOW_RTOL * (window.hi - window.lo)
    inside = (motion >= window.lo - slack) & (motion <= window.hi + slack)
    if inside.all():
        return motion, values
    before, shares, levels = _crossings(motion, window, slack)
    ends, kept = values[before] + shares * (values[before + 1] - values[before]), np.insert(inside, before + 1, True)
    return np.insert(motion, before + 1, levels)[kept], np.insert(values, before + 1, ends)[kept]


def _crossings(motion: FloatArray, window: Window, slack: float) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Return where ends of the window are crossed between samples: the one before, the share of the step, the end."""
    pieces = []
    for level in (window.lo, window.hi):
        offset = motion - level
        side = (offset > slack).view(np.int8) - (offset < -slack).view(np.int8)
        before = np.flatnonzero(side[1:] * side[:-1] < 0)
        shares = -offset[before] / (motion[before + 1] - motion[before])
        pieces.append((before, shares, np.full(len(before), level)))
    before, shares, levels = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    order = np.argsort(before + shares)
    return before[order], shares[order], levels[order]


_LOBATTO_NODE = 1.0 / np.sqrt(5.0)
_LOBATTO_NODES = np.array([-1.0, -_LOBATTO_NODE, _LOBATTO_NODE, 1.0])
_LOBATTO_WEIGHTS = np.array([1.0, 5.0, 5.0, 1.0]) / 6.0
"""Lobatto's rule on each step of the way: its ends are known already."""
_SLOPE_COEFFICIENTS = polynomial.polyder(np.linalg.inv(np.vander(_LOBATTO_NODES, increasing=True)), axis=0)
_NODE_DERIVATIVES = np.vander(_LOBATTO_NODES, 3, increasing=True) @ _SLOPE_COEFFICIENTS
"""Derivatives at the nodes of the cubic through values there, (node, value)."""


def reach(path: WindingPath) -> Interval:
    """Return the smallest and the largest motion."""
    motion = path.states(path.ways)[0]
    return float(motion.min()), float(motion.max())


def places_inside(path: WindingPath, low: float, high: float) -> FloatArray:
    """Return the places `ways` of a path with those where its motion enters and leaves a window, increasing."""
    ways = path.ways
    motion, ways_of_pieces = path.states(ways)[0], [ways]
    for level in (low, high):
        at = np.flatnonzero((motion[1:] - level) * (motion[:-1] - level) < 0)
        sense = np.sign(motion[at + 1] - motion[at])[:, None]

        def measure_excess(
            places: FloatArray, ends: NDArray[np.intp], sense: FloatArray = sense, level: float = level
        ) -> FloatArray:
            return np.asarray(sense[ends] * (path.states(places)[0] - level) / (high - low))

        ways_of_pieces.append(last_places(measure_excess, ways[at][:, None], ways[at + 1][:, None]).ravel())
    return distinct(np.concatenate(ways_of_pieces))


def mean(path: WindingPath, low: float, high: float) -> float:
    """Return the mean effort over the way in a window, each bit of motion counted in whichever direction it goes."""
    ways = places_inside(path, low, high)
    middle, half = 0.5 * (ways[1:] + ways[:-1]), 0.5 * (ways[1:] - ways[:-1])
    motion, effort = path.states(middle[:, None] + half[:, None] * _LOBATTO_NODES)
    centre = 0.5 * (motion[:, 0] + motion[:, -1])
    within = (centre > low) & (centre < high)
    moved = np.abs(motion @ _NODE_DERIVATIVES.T)[within] * _LOBATTO_WEIGHTS
    return float((effort[within] * moved).sum() / moved.sum())


def extremes(path: WindingPath, low: float, high: float) -> tuple[float, float]:
    """Return the largest and the smallest effort in a window."""
    return _largest_and_smallest(path, low, high, path.states(places_inside(path, low, high))[1])


def stress_extremes(path: WindingPath, low: float, high: float) -> tuple[float, float]:
    """Return the largest and the smallest stress in a window [Pa]."""
    return _largest_and_smallest(path, low, high, path.stress(places_inside(path, low, high)))


def _largest_and_smallest(path: WindingPath, low: float, high: float, values: FloatArray) -> tuple[float, float]:
    motion = path.states(places_inside(path, low, high))[0]
    slack = 1e-9 * float(np.ptp(motion))
    kept = values[(motion >= low - slack) & (motion <= high + slack)]
    return float(kept.max()), float(kept.min())


def list_broken_intervals(path: WindingPath, height: Callable[[FloatArray], FloatArray]) -> list[Interval]:
    """Return the intervals of the motion over which a height, of places of the way, is positive or no number."""
    ways = path.ways
    bad = ~(height(ways) <= 0)
    if not bad.any():
        return []
    edges = np.flatnonzero(bad[1:] != bad[:-1])
    good, spoilt = edges + bad[edges], edges + ~bad[edges]
    ends = last_places(lambda at, _ends: height(at), ways[good][:, None], ways[spoilt][:, None]).ravel()
    motion, of_ends = path.states(ways)[0], path.states(ends)[0]
    numbers = np.arange(len(edges))
    branches = []
    for number, run in enumerate(np.split(np.arange(len(ways)), edges + 1)):
        if bad[run[0]]:
            around = [of_ends[k] for k in (number - 1, number) if k in numbers]
            motions = [*motion[run].tolist(), *around]
            branches.append((float(min(motions)), float(max(motions))))
    return branches

"""Metrics that are lengths of travel, for many curves at once, row by row; one curve is one row (`ranges`).

Each row is one branch, whose motion increases. Places between two samples are found by linear interpolation. A sample
without equilibrium (no effort) is outside every band, and so is the way from there to the next sample. Where the model
is known at every place places are solved for, whatever the samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.branches import BAND_RTOL
from cfmkit.numerics.roots import last_places

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

    Exact = Callable[[FloatArray, NDArray[np.intp]], FloatArray]
    Pair = tuple[FloatArray, FloatArray]


UNIFORM_POINTS = 100  # points at which `rms_to_target` is taken, the start excluded: Q of [Bilancia 2019, eq. 8].


@dataclass(frozen=True, eq=False)
class ManyBranches:
    """One branch of many curves."""

    # motion, effort, (d, n): increasing along each row [m or rad], and what is known there [N or N m]
    motion: FloatArray
    effort: FloatArray
    # low, high, (d,): ends of the window, or of the travel where there is no window
    low: FloatArray
    high: FloatArray
    # ``exact(places, rows)``, the effort at any places of some rows, (r, m) -> (r, m): then places are solved for, not
    # interpolated
    exact: Exact | None = None
    excess: Exact | None = None  # by what share the stress there exceeds what is allowed, likewise
    pose: FloatArray | None = None  # (d,) where bands are taken; default: the middle of the window
    # (d,) numerical error of the effort [N or N m]: an effort that is not above it is none to compare with
    error: FloatArray | float = 0.0
    traced: bool = False  # whether every place takes an equilibrium

    @property
    def reference(self) -> FloatArray:
        """Places at which bands are taken, (d,)."""
        return (self.low + self.high) / 2 if self.pose is None else self.pose

    @cached_property
    def solved(self) -> tuple[FloatArray, FloatArray]:
        """Places at which 95 % is first reached, (d,), and widths of `BAND_RANGES`, (d, 3), of known branches."""
        return _solve_ends(self)

    @cached_property
    def rise(self) -> FloatArray:
        """The first of these alone: of a beam every place takes an equilibrium, and bands need six times as many."""
        return self.solved[0] if "solved" in self.__dict__ else _solve_ends(self, with_bands=False)[0]

    @cached_property
    def bands(self) -> FloatArray:
        """The second; with the first in the same calls unless that is known."""
        return _solve_ends(self, with_rise=False)[1] if "rise" in self.__dict__ else self.solved[1]

    def interpolate(self, places: FloatArray) -> FloatArray:
        """Return the effort at places of each row, (d, m), by linear interpolation."""
        if self.exact is not None:
            return self.exact(places, np.arange(len(places)))
        last = self.motion.shape[1] - 1
        rows = np.arange(len(self.motion))[:, None]
        left = np.stack([row.searchsorted(at, "right") for row, at in zip(self.motion, places, strict=True)]) - 1
        left = np.minimum(np.maximum(left, 0), last - 1)
        start, stop = self.motion[rows, left], self.motion[rows, left + 1]
        first, second = self.effort[rows, left], self.effort[rows, left + 1]
        inside = (second - first) / (stop - start) * (places - start) + first
        inside = np.where(places == start, first, inside)  # though there is no effort at the next sample
        beyond = np.where(places >= self.motion[:, -1:], self.effort[:, -1:], inside)
        found: FloatArray = np.where(places <= self.motion[:, :1], self.effort[:, :1], beyond)
        return found


def rms_to_target(many: ManyBranches, target: FloatArray) -> FloatArray:
    """Return the root mean square of F - target at `uniform_places` of each row, (d,); `target` is (d,)."""
    offset = many.interpolate(uniform_places(many)) - target[:, None]
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / UNIFORM_POINTS))


def uniform_places(many: ManyBranches) -> FloatArray:
    """Return places uniform in the motion, the start of the window left out, (d, `UNIFORM_POINTS`)."""
    low, high = many.low[:, None], many.high[:, None]
    return np.asarray(low + (high - low) * np.arange(1, UNIFORM_POINTS + 1) / UNIFORM_POINTS)


def range_95(many: ManyBranches) -> FloatArray:
    """Return d - c of each row, (d,), with F(c) = 0.95 F(d); call it with numpy's warnings off, as all of these."""
    return many.high - _first_95(many)


def range_95_fraction(many: ManyBranches) -> FloatArray:
    """Return (d - c)/d of each row, (d,)."""
    return np.where(many.high > 0, (many.high - _first_95(many)) / many.high, np.nan)


def _first_95(many: ManyBranches) -> FloatArray:
    if many.exact is not None:
        # of many closed forms a call costs more than its places; of one, or where equilibria are traced, places cost
        return many.rise if many.traced or len(many.motion) == 1 else many.solved[0]
    nominal, first, step, (earlier, later) = _rise(many)
    crossed = _crossing(step, (earlier - 0.95 * nominal, later - 0.95 * nominal))
    return np.where(np.abs(nominal) <= many.error, np.nan, np.where(first == 0, many.motion[:, 0], crossed))


def _rise(many: ManyBranches) -> tuple[FloatArray, NDArray[np.intp], Pair, Pair]:
    """Return efforts at the ends of windows, the first samples with 95 % of it, and those steps: places, efforts."""
    motion, effort, rows = many.motion, many.effort, np.arange(len(many.motion))
    nominal = many.interpolate(many.high[:, None])[:, 0]
    before = (motion < many.high[:, None]).sum(axis=1)
    reached = (effort / nominal[:, None] >= 0.95 - BAND_RTOL) & (np.arange(motion.shape[1]) < before[:, None])
    first = np.where(reached.any(axis=1), reached.argmax(axis=1), before)
    sample, earlier = np.minimum(first, motion.shape[1] - 1), np.maximum(first - 1, 0)
    place = np.where(first < before, motion[rows, sample], many.high)
    level = np.where(first < before, effort[rows, sample], nominal)
    return nominal, first, (motion[rows, earlier], place), (effort[rows, earlier], level)


def _crossing(motion: tuple[FloatArray, FloatArray], height: tuple[FloatArray, FloatArray]) -> FloatArray:
    step = height[1] - height[0]
    return np.where(np.abs(step) > 0, motion[0] - height[0] * (motion[1] - motion[0]) / step, motion[1])


def band_range(many: ManyBranches, tolerance: float) -> FloatArray:
    """Return the width within a tolerance about the reference pose of each row, (d,); one of `BAND_RANGES`."""
    if many.exact is not None:
        return many.bands[:, list(BAND_RANGES.values()).index(tolerance)]
    motion, place = many.motion, many.reference
    here = many.interpolate(place[:, None])[:, 0]
    offset = many.effort / here[:, None] - 1
    outside = ~(np.abs(offset) <= tolerance * (1 + BAND_RTOL))
    index = (motion < place[:, None]).sum(axis=1)
    samples = np.arange(motion.shape[1])
    left, right = outside & (samples < index[:, None]), outside & (samples >= index[:, None])
    low = _edge(many, offset, (motion.shape[1] - 1 - left[:, ::-1].argmax(axis=1), 1), (index, place), tolerance)
    high = _edge(many, offset, (right.argmax(axis=1), -1), (index, place), tolerance)
    low = np.where(left.any(axis=1), low, motion[:, 0])
    high = np.where(right.any(axis=1), high, motion[:, -1])
    return np.where(np.abs(here) <= many.error, np.nan, high - low)


def _edge(
    many: ManyBranches,
    offset: FloatArray,
    bad: tuple[NDArray[np.intp], int],
    pose: tuple[NDArray[np.intp], FloatArray],
    tolerance: float,
) -> FloatArray:
    """Return where the offset leaves the band between the sample `bad` and its neighbour inside."""
    rows, (worst, inward), (index, place) = np.arange(len(offset)), bad, pose
    inner = np.minimum(np.maximum(worst + inward, 0), offset.shape[1] - 1)
    # The reference pose, with no offset, stands between the samples index - 1 and index.
    beside = worst == (index - 1 if inward > 0 else index)
    good, height = (
        np.where(beside, place, many.motion[rows, inner]),
        np.where(beside, 0.0, offset[rows, inner]),
    )
    level = np.where(offset[rows, worst] > 0, tolerance, -tolerance)
    return _crossing((many.motion[rows, worst], good), (offset[rows, worst] - level, height - level))


def _solve_ends(many: ManyBranches, with_rise: bool = True, with_bands: bool = True) -> tuple[FloatArray, FloatArray]:
    """Return where each branch first reaches 95 %, (d,), and the widths of its bands, (d, 3), solved by the model.

    All ends are looked for together: calls of the model are what takes the time. NaN without the rise, or the bands.
    """
    nominal, first, (start, stop), _ = _rise(many)
    start, some = np.where(first == 0, many.motion[:, 0], start), np.isfinite(nominal) & (np.abs(nominal) > many.error)
    stop = np.where(some & (first > 0), stop, start)
    start, stop = (start, stop) if with_rise else (start, start)
    here, inside, outside, ends = _bands(many)
    outside = outside if with_bands else inside
    widths, effort = np.repeat(list(BAND_RANGES.values()), 2) * (1 + BAND_RTOL), many.exact
    if effort is None:
        raise ValueError("the branches are not known at every place")

    def excess(at: FloatArray, ends: NDArray[np.intp]) -> FloatArray:
        rows, which = np.divmod(ends, 1 + len(widths))
        found, of_band = effort(at, rows), which > 0
        risen = found / nominal[rows, None] - (0.95 - BAND_RTOL)
        away = np.abs(found / here[rows] - 1) - widths[which - 1][:, None]
        # Where there is no effort, 95 % are not reached, and it is outside every band.
        return np.where(of_band[:, None], away, np.where(np.isnan(risen), -np.inf, risen))

    places = last_places(excess, np.column_stack([start, inside]), np.column_stack([stop, outside]))
    found = np.where(np.isnan(ends), places[:, 1:], ends)
    nothing = np.abs(here[:, 0]) <= many.error
    bands = np.where(nothing[:, None], np.nan, found[:, 1::2] - found[:, ::2])
    return np.where(some & with_rise, places[:, 0], np.nan), bands if with_bands else np.full_like(bands, np.nan)


def _bands(many: ManyBranches) -> tuple[FloatArray, ...]:
    """Return efforts at the poses, (d, 1), and of both ends of `BAND_RANGES` places inside, outside, and known ends."""
    motion, place = many.motion, many.reference
    here = many.interpolate(place[:, None])
    offset, last = np.abs(many.effort / here - 1), motion.shape[1] - 1
    index, samples = (motion < place[:, None]).sum(axis=1)[:, None], np.arange(motion.shape[1])
    inside, outside, ends = [], [], []
    for tolerance in BAND_RANGES.values():
        bad = ~(offset <= tolerance * (1 + BAND_RTOL))
        for there, inward in ((bad & (samples < index), 1), (bad & (samples >= index), -1)):
            worst = last - there[:, ::-1].argmax(axis=1) if inward > 0 else there.argmax(axis=1)
            worst = worst[:, None]
            inner = np.take_along_axis(motion, np.clip(worst + inward, 0, last), axis=1)
            # The reference pose, with no offset, stands between the samples index - 1 and index.
            good = np.where(worst == (index - 1 if inward > 0 else index), place[:, None], inner)
            some = there.any(axis=1, keepdims=True)
            ends.append(np.where(some, np.nan, motion[:, :1] if inward > 0 else motion[:, -1:]))
            inside.append(good)
            outside.append(np.where(some, np.take_along_axis(motion, worst, axis=1), good))
    return here, np.hstack(inside), np.hstack(outside), np.hstack(ends)


def usable_interval(
    branches: Sequence[ManyBranches],  # of one motion
    target: FloatArray,  # (d,): what the efforts are compared with, not zero
    band: FloatArray | float,  # (d,) or float: half width of the band, as a fraction
    # valid, until: (d,): where the mechanism starts to work as intended, and where it ceases to, by default nowhere
    valid: FloatArray,
    until: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return start and end of the largest usable interval of each row, (d,) each; NaN where there is none."""
    motion = branches[0].motion
    last = motion[:, -1]
    if until is None:
        until = np.full(len(motion), np.inf)
    else:  # the last place itself, but for rounding, is no limit
        until = np.where(until < last - 1e-9 * (last - motion[:, 0]), until, np.inf)
    width = np.broadcast_to(band * (1 + BAND_RTOL), len(motion))
    if all(branch.exact is not None for branch in branches):
        return _solved_interval(branches, target, width, (valid, until))
    # What is usable of each step between two samples, and whether a new interval begins there.
    steps = _Steps(motion[:, :-1].copy(), motion[:, 1:].copy(), np.zeros(motion[:, 1:].shape, dtype=bool))
    steps.begins[:, 0] = True
    for branch in branches:
        ratio = branch.effort / target[:, None] - 1
        for height in (ratio - width[:, None], -width[:, None] - ratio):
            _narrow(motion, height, steps)
    since = np.maximum.accumulate(np.where(steps.begins, np.arange(steps.begins.shape[1]), 0), axis=1)
    start = np.maximum(np.take_along_axis(steps.low, since, axis=1), valid[:, None])
    stop = np.minimum(steps.high, until[:, None])
    length, rows = stop - start, np.arange(len(motion))
    best = (length >= length.max(axis=1, keepdims=True) * (1 - 1e-9)).argmax(axis=1)
    some = length[rows, best] > 0
    return np.where(some, start[rows, best], np.nan), np.where(some, stop[rows, best], np.nan)


def _solved_interval(
    branches: Sequence[ManyBranches], target: FloatArray, width: FloatArray, valid: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return `usable_interval` of branches that are known at every place: its ends are solved for."""
    motion, every = branches[0].motion, np.arange(len(branches[0].motion))
    rows, count = every, motion.shape[1]
    reach = motion[:, -1] - motion[:, 0]

    def excess(at: FloatArray, rows: NDArray[np.intp], known: bool = False) -> FloatArray:
        """Return by what share that exceeds its limit which does so most; NaN where one is not a number."""
        start, stop = (one[rows, None] for one in valid)
        worst = np.maximum(start - at, at - stop) / reach[rows, None]
        for branch in branches:
            if branch.exact is not None:
                effort = branch.effort if known else branch.exact(at, rows)
                worst = np.maximum(worst, np.abs(effort / target[rows, None] - 1) - width[rows, None])
            if branch.excess is not None:
                worst = np.maximum(worst, branch.excess(at, rows))
        return worst

    good = excess(motion, every, known=True) <= 0
    begins, ends = good.copy(), good.copy()
    begins[:, 1:] &= ~good[:, :-1]
    ends[:, :-1] &= ~good[:, 1:]
    since = np.maximum.accumulate(np.where(begins, np.arange(count), 0), axis=1)
    # Between two places outside and inside the last bit of length is unknown: runs that are equally long but
    # for that are told apart by their first place, as where places are interpolated.
    length = np.where(ends, motion - np.take_along_axis(motion, since, axis=1), -1.0)
    last = (length >= length.max(axis=1, keepdims=True) * (1 - 1e-9)).argmax(axis=1)
    first = since[rows, last]
    before, after = np.maximum(first - 1, 0), np.minimum(last + 1, count - 1)
    inside, outside = (np.stack([motion[rows, k] for k in pair], axis=1) for pair in ((first, last), (before, after)))
    start, end = last_places(lambda at, ends: excess(at, ends // 2), inside, outside).T
    lost = np.flatnonzero(~good.any(axis=1))  # the whole interval may lie between two samples
    if lost.size:
        start[lost], end[lost] = _intervals_between_samples(branches[0], target, excess, lost)
    some = end > start
    return np.where(some, start, np.nan), np.where(some, end, np.nan)


def _intervals_between_samples(
    branch: ManyBranches, target: FloatArray, excess: Callable[..., FloatArray], rows: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Return the interval around the first place where the effort passes the target between two samples; NaN without.

    ``excess(at, rows)`` is by what share the most exceeded limit is exceeded at places (r, n).
    """
    start, end = np.full((2, len(rows)), np.nan)
    above = branch.effort[rows] > target[rows, None]
    passes = (above[:, 1:] != above[:, :-1]) & np.isfinite(branch.effort[rows][:, 1:] + branch.effort[rows][:, :-1])
    some = np.flatnonzero(passes.any(axis=1))
    exact = branch.exact
    if exact is None or not some.size:
        return start, end
    own, step = rows[some], passes[some].argmax(axis=1)
    left, right = branch.motion[own, step][:, None], branch.motion[own, step + 1][:, None]
    sign = np.where(above[some, step], -1.0, 1.0)[:, None]

    def short(at: FloatArray, few: NDArray[np.intp]) -> FloatArray:
        goal = target[own[few], None]
        return np.asarray(sign[few] * (exact(at, own[few]) - goal) / np.abs(goal))

    middle = last_places(short, left, right)
    kept = np.flatnonzero(excess(middle, own)[:, 0] <= 0)
    if kept.size:
        inside, outside = np.hstack([middle, middle])[kept], np.hstack([left, right])[kept]
        found = last_places(lambda at, ends: excess(at, own[kept][ends // 2]), inside, outside)
        start[some[kept]], end[some[kept]] = found.T
    return start, end


@dataclass(frozen=True, eq=False)
class _Steps:
    low: FloatArray
    high: FloatArray
    begins: NDArray[np.bool_]


def _narrow(motion: FloatArray, height: FloatArray, steps: _Steps) -> None:
    """Take from each step between two samples the part over which a piecewise linear height is positive."""
    bad = ~(height <= 0)
    if not bad.any():
        return
    left, right = bad[:, :-1], bad[:, 1:]
    rise = height[:, 1:] - height[:, :-1]
    mixed = left != right
    place = motion[:, :-1] - height[:, :-1] * (motion[:, 1:] - motion[:, :-1]) / np.where(mixed, rise, 1.0)
    np.copyto(steps.low, np.maximum(steps.low, place), where=left & ~right)
    np.copyto(steps.high, np.minimum(steps.high, place), where=right & ~left)
    np.copyto(steps.low, motion[:, 1:], where=left & right)
    np.copyto(steps.high, motion[:, :-1], where=left & right)
    np.logical_or(steps.begins, left, out=steps.begins)


BAND_RANGES = {"band_range_05pct": 0.005, "band_range_1pct": 0.01, "band_range_5pct": 0.05}

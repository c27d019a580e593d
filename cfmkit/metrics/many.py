"""Metrics that are lengths of travel, for many curves at once: those of `ranges`, row by row.

Each row is one branch: its motion increases, and its effort is known at every sample.
The formulas are those for one curve, in the same order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.flatness import UNIFORM_POINTS
from cfmkit.metrics.traces import ROUNDING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.curves import FloatArray


_PARTS = 48


def boundary(
    holds: Callable[[FloatArray], NDArray[np.bool_]], inside: FloatArray, outside: FloatArray, rounds: int = 7
) -> FloatArray:
    """Return how far a condition holds from places inside towards places outside, one by one.

    Each round cuts the way into parts and keeps the first in which the condition is lost, so
    that it ends at the loss nearest to `inside`, and where the condition is not a number as well.

    Parameters
    ----------
    holds : callable
        ``holds(places)``, (d, k m) -> (d, k m) of bool: m places for each of the k, one after the other.
    inside, outside : (d, k) array
        Where it holds, and where it does not; equal where there is nothing to look for. What is looked for
        together costs hardly more than the first of it: calls of the model are what takes the time.
    rounds : int
        Each makes the way 48 times as short: seven make a millimetre as short as rounding.

    Returns
    -------
    (d, k) array
        The last places at which it still holds.

    Examples
    --------
    >>> boundary(lambda x: x * x <= 2.0, np.array([[0.0]]), np.array([[2.0]])).round(12)
    array([[1.41421356]])
    """
    share = np.arange(1, _PARTS) / _PARTS
    near, far = np.array(inside), np.array(outside)
    for _ in range(rounds):
        if (near == far).all():
            break
        places = near[..., None] + (far - near)[..., None] * share
        lost = ~holds(places.reshape(len(places), -1)).reshape(places.shape)
        first = np.where(lost.any(axis=-1), lost.argmax(axis=-1), _PARTS - 1)
        last, next_ = np.maximum(first - 1, 0), np.minimum(first, _PARTS - 2)
        near, far = (
            np.where(first > 0, np.take_along_axis(places, last[..., None], axis=-1)[..., 0], near),
            np.where(first < _PARTS - 1, np.take_along_axis(places, next_[..., None], axis=-1)[..., 0], far),
        )
    return near


@dataclass(frozen=True, eq=False)
class ManyBranches:
    """One branch of many curves.

    Attributes
    ----------
    motion, effort : (d, n) array
        Increasing along each row [m or rad], and finite [N or N m].
    low, high : (d,) array
        Ends of the window, or of the travel where there is no window.
    exact : callable, optional
        The effort at any places of each row, (d, m) -> (d, m): then places are solved for, not interpolated.
    excess : callable, optional
        By how much the stress exceeds what is allowed, at any places of each row [Pa].
    """

    motion: FloatArray
    effort: FloatArray
    low: FloatArray
    high: FloatArray
    exact: Callable[[FloatArray], FloatArray] | None = None
    excess: Callable[[FloatArray], FloatArray] | None = None

    def at(self, places: FloatArray) -> FloatArray:
        """Return the effort at places of each row, (d, m), by linear interpolation."""
        if self.exact is not None:
            return self.exact(places)
        last = self.motion.shape[1] - 1
        rows = np.arange(len(self.motion))[:, None]
        left = np.stack([row.searchsorted(at, "right") for row, at in zip(self.motion, places, strict=True)]) - 1
        left = np.minimum(np.maximum(left, 0), last - 1)
        start, stop = self.motion[rows, left], self.motion[rows, left + 1]
        first, second = self.effort[rows, left], self.effort[rows, left + 1]
        inside = (second - first) / (stop - start) * (places - start) + first
        beyond = np.where(places >= self.motion[:, -1:], self.effort[:, -1:], inside)
        found: FloatArray = np.where(places <= self.motion[:, :1], self.effort[:, :1], beyond)
        return found


def rms_to_target(many: ManyBranches, target: FloatArray) -> FloatArray:
    """Return `flatness.rms_to_target` of each row, (d,); `target` is (d,)."""
    low, high = many.low[:, None], many.high[:, None]
    places = low + (high - low) * np.arange(1, UNIFORM_POINTS + 1) / UNIFORM_POINTS
    offset = many.at(places) - target[:, None]
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / UNIFORM_POINTS))


def range_95(many: ManyBranches) -> FloatArray:
    """Return `ranges.range_95` of each row, (d,); call it with numpy's warnings off, as all of these."""
    return many.high - _first_95(many)


def range_95_fraction(many: ManyBranches) -> FloatArray:
    """Return `ranges.range_95_fraction` of each row, (d,)."""
    return np.where(many.high > 0, (many.high - _first_95(many)) / many.high, np.nan)


def _first_95(many: ManyBranches) -> FloatArray:
    motion, effort, rows = many.motion, many.effort, np.arange(len(many.motion))
    nominal = many.at(many.high[:, None])[:, 0]
    before = (motion < many.high[:, None]).sum(axis=1)
    reached = (effort / nominal[:, None] >= 0.95 - ROUNDING) & (np.arange(motion.shape[1]) < before[:, None])
    first = np.where(reached.any(axis=1), reached.argmax(axis=1), before)
    sample, earlier = np.minimum(first, motion.shape[1] - 1), np.maximum(first - 1, 0)
    place = np.where(first < before, motion[rows, sample], many.high)
    level = np.where(first < before, effort[rows, sample], nominal)
    if many.exact is not None:
        solve, wanted = many.exact, nominal[:, None]
        ends = motion[rows, earlier][:, None], place[:, None]
        crossed = boundary(lambda at: ~(solve(at) / wanted >= 0.95 - ROUNDING), *ends)[:, 0]
    else:
        heights = effort[rows, earlier] - 0.95 * nominal, level - 0.95 * nominal
        crossed = _crossing((motion[rows, earlier], place), heights)
    return np.where(nominal == 0, np.nan, np.where(first == 0, motion[:, 0], crossed))


def _crossing(motion: tuple[FloatArray, FloatArray], height: tuple[FloatArray, FloatArray]) -> FloatArray:
    step = height[1] - height[0]
    return np.where(np.abs(step) > 0, motion[0] - height[0] * (motion[1] - motion[0]) / step, motion[1])


def band_range(many: ManyBranches, tolerance: float) -> FloatArray:
    """Return `ranges.band_range` of each row about the middle of its window, (d,)."""
    if many.exact is not None:
        return band_ranges(many, (tolerance,))[:, 0]
    motion, place = many.motion, (many.low + many.high) / 2
    here = many.at(place[:, None])[:, 0]
    offset = many.effort / here[:, None] - 1
    outside = ~(np.abs(offset) <= tolerance * (1 + ROUNDING))
    index = (motion < place[:, None]).sum(axis=1)
    samples = np.arange(motion.shape[1])
    left, right = outside & (samples < index[:, None]), outside & (samples >= index[:, None])
    low = _edge(many, offset, (motion.shape[1] - 1 - left[:, ::-1].argmax(axis=1), 1), (index, place), tolerance)
    high = _edge(many, offset, (right.argmax(axis=1), -1), (index, place), tolerance)
    low = np.where(left.any(axis=1), low, motion[:, 0])
    high = np.where(right.any(axis=1), high, motion[:, -1])
    return np.where(here == 0, np.nan, high - low)


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


def band_ranges(many: ManyBranches, tolerances: Sequence[float]) -> FloatArray:
    """Return `band_range` of each row for each tolerance, (d, k), of branches that are known at every place."""
    motion, place = many.motion, (many.low + many.high) / 2
    here = many.at(place[:, None])
    offset, last = np.abs(many.effort / here - 1), motion.shape[1] - 1
    index, samples = (motion < place[:, None]).sum(axis=1)[:, None], np.arange(motion.shape[1])
    inside, outside, ends = [], [], []
    for tolerance in tolerances:
        bad = ~(offset <= tolerance * (1 + ROUNDING))
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
    widths = np.repeat(np.asarray(tolerances) * (1 + ROUNDING), 2)

    def holds(at: FloatArray) -> NDArray[np.bool_]:
        return np.asarray(np.abs(many.at(at) / here - 1) <= np.repeat(widths, at.shape[1] // len(widths)))

    solved = boundary(holds, np.hstack(inside), np.hstack(outside))
    found = np.where(np.isnan(np.hstack(ends)), solved, np.hstack(ends))
    return np.where(here == 0, np.nan, found[:, 1::2] - found[:, ::2])


def usable_interval(
    branches: Sequence[ManyBranches], target: FloatArray, band: float, valid: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return start and end of `ranges.usable_interval` of each row, (d,) each; NaN where there is none.

    Parameters
    ----------
    branches : sequence of ManyBranches
        Of one motion.
    target : (d,) array
        What the efforts are compared with, not zero.
    band : float
        Half width of the band, as a fraction.
    valid : (d,) array
        Where the mechanism starts to work as intended.
    """
    motion = branches[0].motion
    if all(branch.exact is not None for branch in branches):
        return _solved_interval(branches, target, band * (1 + ROUNDING), valid)
    # What is usable of each step between two samples, and whether a new interval begins there.
    steps = _Steps(motion[:, :-1].copy(), motion[:, 1:].copy(), np.zeros(motion[:, 1:].shape, dtype=bool))
    steps.begins[:, 0] = True
    width = band * (1 + ROUNDING)
    for branch in branches:
        ratio = branch.effort / target[:, None] - 1
        for height in (ratio - width, -width - ratio):
            _narrow(motion, height, steps)
    since = np.maximum.accumulate(np.where(steps.begins, np.arange(steps.begins.shape[1]), 0), axis=1)
    start = np.maximum(np.take_along_axis(steps.low, since, axis=1), valid[:, None])
    length, rows = steps.high - start, np.arange(len(motion))
    best = (length >= length.max(axis=1, keepdims=True) * (1 - 1e-9)).argmax(axis=1)
    some = length[rows, best] > 0
    return np.where(some, start[rows, best], np.nan), np.where(some, steps.high[rows, best], np.nan)


def _solved_interval(
    branches: Sequence[ManyBranches], target: FloatArray, width: float, valid: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return `usable_interval` of branches that are known at every place: its ends are solved for."""
    motion, wanted = branches[0].motion, target[:, None]
    rows, count = np.arange(len(motion)), motion.shape[1]

    def holds(at: FloatArray) -> NDArray[np.bool_]:
        kept = at >= valid[:, None]
        for branch in branches:
            if branch.exact is not None:
                kept &= np.abs(branch.exact(at) / wanted - 1) <= width
            if branch.excess is not None:
                kept &= branch.excess(at) <= 0
        return kept

    good = holds(motion)
    begins, ends = good.copy(), good.copy()
    begins[:, 1:] &= ~good[:, :-1]
    ends[:, :-1] &= ~good[:, 1:]
    since = np.maximum.accumulate(np.where(begins, np.arange(count), 0), axis=1)
    # Between two places outside and inside the last bit of length is unknown: runs that are equally long but
    # for that are told apart by their first place, as where places are interpolated.
    length = np.where(ends, motion - np.take_along_axis(motion, since, axis=1), -1.0)
    last = (length >= length.max(axis=1, keepdims=True) * (1 - 1e-9)).argmax(axis=1)
    first, some = since[rows, last], good.any(axis=1)
    before, after = np.maximum(first - 1, 0), np.minimum(last + 1, count - 1)
    inside, outside = (np.stack([motion[rows, k] for k in pair], axis=1) for pair in ((first, last), (before, after)))
    start, end = boundary(holds, inside, outside).T
    some &= end > start
    return np.where(some, start, np.nan), np.where(some, end, np.nan)


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
RANGES: dict[str, Callable[[ManyBranches], FloatArray]] = {
    "range_95": range_95,
    "range_95_fraction": range_95_fraction,
    "band_range_05pct": lambda many: band_range(many, BAND_RANGES["band_range_05pct"]),
    "band_range_1pct": lambda many: band_range(many, BAND_RANGES["band_range_1pct"]),
    "band_range_5pct": lambda many: band_range(many, BAND_RANGES["band_range_5pct"]),
}
"""What needs nothing but the branch."""

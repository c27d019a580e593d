"""Metrics that are lengths of travel: how far the force stays constant.

Here the window only says what to compare with (its end, its centre, its mean); the travel that is looked at is the
whole branch, whose motion increases. Where the model is known at every place, places are solved for, whatever the
samples. Of a curve that is known at its points, places between two are found by linear interpolation; a sample without
equilibrium (no effort) is outside every band, and so is the way from there to the next sample.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.branches import BAND_RTOL
from cfmkit.metrics.definition import Definition
from cfmkit.metrics.rows_in_window import ZERO_EFFORT_SHARE
from cfmkit.numerics.roots import last_places

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.rows_in_window import RowsInWindow
    from cfmkit.metrics.usable_interval_of_all_branches import CycleRows

    Pair = tuple[FloatArray, FloatArray] | FloatArray


UNIFORM_POINTS = 100  # points at which `rms_to_target` is taken, the start excluded: Q of [Bilancia 2019, eq. 8].
BAND_RANGES = {"band_range_05pct": 0.005, "band_range_1pct": 0.01, "band_range_5pct": 0.05}
NO_EQUILIBRIUM_REASON = "there is no equilibrium at the place that it is compared with"


def uniform_places(rows: RowsInWindow) -> FloatArray:
    """Return places uniform in the motion, the start of the window left out, (d, `UNIFORM_POINTS`)."""
    low, high = (end[:, None] for end in rows.ends)
    return np.asarray(low + (high - low) * np.arange(1, UNIFORM_POINTS + 1) / UNIFORM_POINTS)


def rms_about(rows: RowsInWindow, level: FloatArray) -> FloatArray:
    """Return the root mean square of the effort less a level at `uniform_places`, (d,)."""
    rows.require_straight()
    offset = rows.curves.all_at(uniform_places(rows)) - level
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / UNIFORM_POINTS))


def range_95(rows: RowsInWindow) -> FloatArray:
    """Return d - c, with d the end of the window and c where F first reaches 0.95 F(d)."""
    return rows.ends[1] - _first_95(rows)


def range_95_fraction(rows: RowsInWindow) -> FloatArray:
    """Return (d - c) / d."""
    end = rows.ends[1]
    is_positive = rows.require(end > 0, "the displacement at the end is not positive")
    return np.where(is_positive, (end - _first_95(rows)) / end, np.nan)


def _first_95(rows: RowsInWindow) -> FloatArray:
    """Return the place where 95 % of the effort at the end of the window are first reached, (d,)."""
    curves, (_, end) = rows.curves, rows.ends
    is_reached = rows.reach(end)
    rows.require_straight()
    if len(rows) == 1:
        at_end = np.interp(end, curves.samples.motion[0], curves.samples.values[0])
        said = "at the end is zero within its numerical error"
        rows.require(~(np.abs(at_end) <= curves.error), lambda: f"the {curves.kind} {said}, {rows.error_text}")
    if curves.effort is None:
        nominal, first, step, (earlier, later) = _find_rise(rows)
        crossed = _crossing(step, (earlier - 0.95 * nominal, later - 0.95 * nominal))
        crossed = np.where(first == 0, curves.dense[:, 0], crossed)
        place = np.where(np.abs(nominal) <= curves.error, np.nan, crossed)
    elif _are_solved_apart(rows):
        place = rows.remember(partial(_solve_ends, with_bands=False), "rise")[0]
    else:
        place = rows.remember(_solve_ends, "ends")[0]
    place = np.where(is_reached, place, np.nan)
    rows.require(~np.isnan(place), NO_EQUILIBRIUM_REASON)
    return place


def _are_solved_apart(rows: RowsInWindow) -> bool:
    """Return whether one end at a time is looked for.

    Of many closed forms a call costs more than its places; of one, or where equilibria are traced, places cost, and
    bands need six times as many.
    """
    return rows.curves.traced or len(rows) == 1


def _find_rise(rows: RowsInWindow) -> tuple[FloatArray, NDArray[np.intp], Pair, Pair]:
    """Return efforts at the ends of windows, the first samples with 95 % of it, and those steps: places, efforts."""
    motion, effort, end = rows.curves.dense, rows.curves.dense_effort, rows.ends[1]
    every = np.arange(len(motion))
    nominal = rows.curves.all_at(end[:, None])[:, 0]
    before = (motion < end[:, None]).sum(axis=1)
    reached = (effort / nominal[:, None] >= 0.95 - BAND_RTOL) & (np.arange(motion.shape[1]) < before[:, None])
    first = np.where(reached.any(axis=1), reached.argmax(axis=1), before)
    sample, earlier = np.minimum(first, motion.shape[1] - 1), np.maximum(first - 1, 0)
    place = np.where(first < before, motion[every, sample], end)
    level = np.where(first < before, effort[every, sample], nominal)
    return nominal, first, (motion[every, earlier], place), (effort[every, earlier], level)


def _crossing(motion: Pair, height: Pair) -> FloatArray:
    step = height[1] - height[0]
    return np.where(np.abs(step) > 0, motion[0] - height[0] * (motion[1] - motion[0]) / step, motion[1])


def band_range(rows: RowsInWindow, tolerance: float) -> FloatArray:
    """Return the widest interval around the reference pose in which ``|F / F_ref - 1|`` is within the tolerance."""
    curves, pose = rows.curves, rows.pose
    is_reached = rows.reach(pose)
    rows.require_straight()
    size_at_pose = np.abs(rows.remember(_effort_at_pose, "pose")[:, 0])
    largest = np.nanmax(np.abs(curves.samples.values), axis=1, initial=0.0)
    zero = size_at_pose <= np.maximum(curves.error, ZERO_EFFORT_SHARE * largest)
    rows.require(~zero, f"the {curves.kind} at the reference pose is zero within its numerical error")
    if curves.effort is None:
        width = _width_between_points(rows, tolerance)
    else:
        apart = _are_solved_apart(rows)
        solve = partial(_solve_ends, with_rise=False) if apart else _solve_ends
        width = rows.remember(solve, "bands" if apart else "ends")[1][:, list(BAND_RANGES.values()).index(tolerance)]
    width = np.where(is_reached & ~zero, width, np.nan)
    rows.require(~np.isnan(width), NO_EQUILIBRIUM_REASON)
    return width


def _effort_at_pose(rows: RowsInWindow) -> FloatArray:
    return rows.curves.all_at(rows.pose[:, None])


def _width_between_points(rows: RowsInWindow, tolerance: float) -> FloatArray:
    """Return the width of the band of one curve that is known at its points, (1,)."""
    motion, effort, place = rows.curves.samples.motion[0], rows.curves.samples.values[0], rows.pose[0]
    index = int((motion < place).sum())
    offset = np.insert(effort / np.interp(place, motion, effort) - 1, index, 0.0)  # the reference pose has none
    motion = np.insert(motion, index, place)
    outside = ~(np.abs(offset) <= tolerance * (1 + BAND_RTOL))

    def find_edge(bad: NDArray[np.intp], inward: int, end: float) -> float:
        if not bad.size:
            return end
        worst = bad[-1] if inward > 0 else bad[0]
        level = tolerance if offset[worst] > 0 else -tolerance
        pair, height = [worst, worst + inward], offset - level
        return float(_crossing(motion[pair], height[pair]))

    low = find_edge(np.flatnonzero(outside[:index]), 1, motion[0])
    return np.array([find_edge(index + np.flatnonzero(outside[index:]), -1, motion[-1]) - low])


def _solve_ends(rows: RowsInWindow, with_rise: bool = True, with_bands: bool = True) -> tuple[FloatArray, FloatArray]:
    """Return where each branch first reaches 95 %, (d,), and the widths of its bands, (d, 3), solved by the model.

    All ends are looked for together: calls of the model are what takes the time. NaN without the rise, or the bands.
    """
    curves = rows.curves
    nominal, first, (start, stop), _ = _find_rise(rows)
    some = np.isfinite(nominal) & (np.abs(nominal) > curves.error)
    start = np.where(first == 0, curves.dense[:, 0], start)
    stop = np.where(some & (first > 0) & with_rise, stop, start)
    effort_at_pose, inside, outside, ends = _find_bands(rows)
    outside = outside if with_bands else inside
    widths, effort = np.repeat(list(BAND_RANGES.values()), 2) * (1 + BAND_RTOL), curves.effort
    assert effort is not None

    def excess(at: FloatArray, ends: NDArray[np.intp]) -> FloatArray:
        rows, which = np.divmod(ends, 1 + len(widths))
        efforts, of_band = effort(at, rows), which > 0
        risen = efforts / nominal[rows, None] - (0.95 - BAND_RTOL)
        away = np.abs(efforts / effort_at_pose[rows] - 1) - widths[which - 1][:, None]
        # Where there is no effort, 95 % are not reached, and it is outside every band.
        return np.where(of_band[:, None], away, np.where(np.isnan(risen), -np.inf, risen))

    places = last_places(excess, np.column_stack([start, inside]), np.column_stack([stop, outside]))
    band_ends = np.where(np.isnan(ends), places[:, 1:], ends)
    bands = band_ends[:, 1::2] - band_ends[:, ::2]
    return np.where(some & with_rise, places[:, 0], np.nan), bands if with_bands else np.full_like(bands, np.nan)


def _find_bands(rows: RowsInWindow) -> tuple[FloatArray, ...]:
    """Return efforts at the poses, (d, 1), and of both ends of `BAND_RANGES` places inside, outside, and known ends."""
    motion, place = rows.curves.dense, rows.pose
    effort_at_pose = rows.remember(_effort_at_pose, "pose")
    offset, last = np.abs(rows.curves.dense_effort / effort_at_pose - 1), motion.shape[1] - 1
    index, samples = (motion < place[:, None]).sum(axis=1)[:, None], np.arange(motion.shape[1])
    inside, outside, ends = [], [], []
    for tolerance in BAND_RANGES.values():
        bad = ~(offset <= tolerance * (1 + BAND_RTOL))
        for bad_on_side, inward in ((bad & (samples < index), 1), (bad & (samples >= index), -1)):
            worst = last - bad_on_side[:, ::-1].argmax(axis=1) if inward > 0 else bad_on_side.argmax(axis=1)
            worst = worst[:, None]
            inner = np.take_along_axis(motion, np.clip(worst + inward, 0, last), axis=1)
            # The reference pose, with no offset, stands between the samples index - 1 and index.
            good = np.where(worst == (index - 1 if inward > 0 else index), place[:, None], inner)
            some = bad_on_side.any(axis=1, keepdims=True)
            ends.append(np.where(some, np.nan, motion[:, :1] if inward > 0 else motion[:, -1:]))
            inside.append(good)
            outside.append(np.where(some, np.take_along_axis(motion, worst, axis=1), good))
    return effort_at_pose, np.hstack(inside), np.hstack(outside), np.hstack(ends)


def find_usable(cycle: CycleRows, which: int) -> FloatArray:
    """Return length, start or end of the largest usable interval of each row, (d,); no length where there is none."""
    values = cycle.usable[which]
    cycle.first.require(~np.isnan(values), "no part of the travel is usable")
    return values


_RANGE_MEANING = "d is the end of the window, c where the {effort} first reaches 0.95 of that at d [Lan 2010, sec. 2]"
TRAVEL_METRICS = (
    *(
        Definition(name, dimension, f"{formula}: {_RANGE_MEANING}", function, worst="smallest", windowed=False)
        for name, dimension, formula, function in (
            ("range_95", "motion", "d - c", range_95),
            ("range_95_fraction", "ratio", "(d - c)/d", range_95_fraction),
        )
    ),
    *(
        Definition(
            name,
            "motion",
            f"widest interval around the reference pose (default: the centre of the window; for the springs of a "
            f"slider-crank the stretched position, or half the travel of a force) in which the {{effort}} "
            f"is within {100 * tolerance:g} % of that at the pose [Li, Hao 2019, eq. 32]",
            partial(band_range, tolerance=tolerance),
            worst="smallest",
            windowed=False,
        )
        for name, tolerance in BAND_RANGES.items()
    ),
    *(
        Definition(
            f"usable_{end}",
            "motion",
            f"{what} of the longest part of the travel on which every branch stays within the {{effort}} band (around "
            "the target, else around the mean in the window), the allowable stress and its valid range",
            partial(find_usable, which=which),
            worst="smallest",
            scope="cycle",
            windowed=False,
        )
        for which, (end, what) in enumerate((("stroke", "length"), ("start", "start"), ("end", "end")))
    ),
)
"""Metrics that are lengths of travel, in the order in which they are shown."""

"""What must hold for the metrics of every curve: scaling, sampling, reversal, order of branches."""

import itertools

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from cfmkit.curves import Column, Curve
from cfmkit.metrics import MeasuringFrame, Window, measure, restrict

PROPERTY = settings(deadline=None, max_examples=60)

FORCE = st.integers(200, 900).map(lambda n: n / 8)  # eighths: sums and differences are exact
STEP = st.integers(1, 40).map(lambda n: n / 16)
FACTOR = st.sampled_from([0.25, 0.5, 2.0, 8.0])  # powers of two: scaling is exact
LOOP_METRICS = ("hysteresis_area",)
MAXIMA = (
    "force_max",
    "force_min",
    "force_ripple",
    "half_band",
    "deviation_from_target",
    "stress_max",
    "hysteresis_area",
)
LENGTHS = ("range_95", "band_range_05pct", "band_range_1pct", "band_range_5pct", "usable_stroke", "usable_end")


@st.composite
def loops(draw):
    """A loop whose branches have different samples over one travel that starts at zero."""
    sides = []
    for _ in range(2):
        steps = draw(st.lists(STEP, min_size=2, max_size=9))
        motion = np.concatenate([[0.0], np.cumsum(steps)])
        effort = np.array(draw(st.lists(FORCE, min_size=len(motion), max_size=len(motion))))
        sides.append([motion, effort])
    end = max(side[0][-1] for side in sides)
    for side in sides:
        if side[0][-1] < end:
            side[0], side[1] = np.append(side[0], end), np.append(side[1], side[1][-1])
    return sides


def build(sides, flip=(False, True), order=(0, 1), extra=True):
    names = ("load", "unload")
    pieces = [(names[i], *(array[::-1] if flip[i] else array for array in sides[i])) for i in order]
    motion = np.concatenate([piece[1] for piece in pieces])
    effort = np.concatenate([piece[2] for piece in pieces])
    branch = np.concatenate([[piece[0]] * len(piece[1]) for piece in pieces])
    columns = {"max_stress": Column(np.sqrt(motion + 1), "stress")} if extra else {}
    return Curve(motion, effort, branch, np.ones(len(motion), bool), columns)


def numbers(curve, frame, window=None):
    return {name: item.value for name, item in measure(curve, frame, window).items()}


def same(found, expected, factor=1.0):
    if expected is None:
        return found is None
    return found == pytest.approx(expected * factor, rel=1e-9, abs=1e-9)


FRAME = MeasuringFrame(target=64.0, allowable_stress=3.0)
WINDOWS = st.tuples(st.floats(0, 0.45), st.floats(0.55, 1))


@PROPERTY
@given(loops(), FACTOR, WINDOWS)
def test_a_force_twice_as_large_doubles_forces_and_areas_and_leaves_ratios_and_ranges(sides, factor, part):
    end = sides[0][0][-1]
    window = Window(part[0] * end, part[1] * end)
    plain = numbers(build(sides), FRAME, window)
    scaled = [(motion, effort * factor) for motion, effort in sides]
    more = numbers(build(scaled), MeasuringFrame(target=64.0 * factor, allowable_stress=3.0), window)
    for name, item in measure(build(sides), FRAME, window).items():
        power = factor if item.dimension in ("force", "energy") else 1.0
        assert same(more[name], plain[name], power), name


@PROPERTY
@given(loops(), FACTOR, WINDOWS)
def test_a_travel_twice_as_long_doubles_lengths_and_areas_and_leaves_forces_and_ratios(sides, factor, part):
    end = sides[0][0][-1]
    frame = MeasuringFrame(target=64.0)
    plain = measure(build(sides, extra=False), frame, Window(part[0] * end, part[1] * end))
    longer = [(motion * factor, effort) for motion, effort in sides]
    window = Window(part[0] * end * factor, part[1] * end * factor)
    more = numbers(build(longer, extra=False), frame, window)
    for name, item in plain.items():
        power = factor if item.dimension in ("length", "energy") else 1.0
        assert same(more[name], item.value, power), name


TWO_EQUAL_STRETCHES = [
    [np.array([0.0, 1.125, 1.1875, 1.25, 1.4375]), np.array([62.5, 41.0, 25.0, 25.0, 25.0])],
    [np.array([0.0, 0.0625, 0.125, 1.4375]), np.array([25.0, 86.625, 25.0, 25.0])],
]


@PROPERTY
@example(TWO_EQUAL_STRETCHES, (0.0, 1.0))
@given(loops(), WINDOWS)
def test_the_direction_in_which_a_branch_is_stored_changes_nothing(sides, part):
    window = Window(part[0] * sides[0][0][-1], part[1] * sides[0][0][-1])
    expected = numbers(build(sides), FRAME, window)
    for flip in ((True, True), (False, False), (True, False)):
        found = numbers(build(sides, flip), FRAME, window)
        assert all(same(found[name], expected[name]) for name in expected)


@PROPERTY
@given(loops(), WINDOWS)
def test_the_order_of_the_branches_changes_nothing(sides, part):
    window = Window(part[0] * sides[0][0][-1], part[1] * sides[0][0][-1])
    found, expected = (numbers(build(sides, order=order), FRAME, window) for order in ((1, 0), (0, 1)))
    assert all(same(found[name], expected[name]) for name in expected)


@PROPERTY
@given(loops(), WINDOWS, st.lists(st.floats(0.01, 0.99), min_size=1, max_size=6))
def test_points_added_on_a_piecewise_linear_curve_change_neither_extremes_nor_areas_nor_lengths(sides, part, places):
    window = Window(part[0] * sides[0][0][-1], part[1] * sides[0][0][-1])
    frame = MeasuringFrame(target=64.0)
    finer = []
    for motion, effort in sides:
        more = np.union1d(motion, np.array(places) * motion[-1])
        finer.append((more, np.interp(more, motion, effort)))
    found = numbers(build(finer, extra=False), frame, window)
    expected = numbers(build(sides, extra=False), frame, window)
    for name in (*MAXIMA, *LENGTHS):
        assert same(found[name], expected[name]), name


@PROPERTY
@given(loops())
def test_the_opposite_sign_convention_gives_the_same_ripple_ranges_and_deviations(sides):
    frame, mirror = MeasuringFrame(target=64.0), MeasuringFrame(target=-64.0)
    plain = numbers(build(sides, extra=False), frame)
    other = numbers(build([(motion, -effort) for motion, effort in sides], extra=False), mirror)
    for name in ("force_ripple", "half_band", "deviation_from_mean", "deviation_from_target", "force_sd", *LENGTHS):
        assert same(other[name], plain[name]), name
    assert same(other["force_max[load]"], plain["force_min[load]"], -1)
    assert same(other["hysteresis_area"], plain["hysteresis_area"], -1)


@PROPERTY
@given(loops(), WINDOWS)
def test_the_area_is_the_work_put_in_less_the_work_given_back(sides, part):
    lo, hi = part[0] * sides[0][0][-1], part[1] * sides[0][0][-1]

    def work(motion, effort):
        grid = np.unique(np.concatenate([[lo, hi], motion[(motion > lo) & (motion < hi)]]))
        force = np.interp(grid, motion, effort)
        return float(np.sum(np.diff(grid) * (force[1:] + force[:-1])) / 2)

    area = numbers(build(sides), FRAME, Window(lo, hi))["hysteresis_area"]
    assert same(area, work(*sides[0]) - work(*sides[1]))


@PROPERTY
@given(loops(), st.floats(0.1, 0.9))
def test_areas_of_neighbouring_windows_add_up(sides, cut):
    end = sides[0][0][-1]
    loop = build(sides)
    whole = numbers(loop, FRAME, Window(0, end))["hysteresis_area"]
    parts = [numbers(loop, FRAME, Window(*w))["hysteresis_area"] for w in ((0, cut * end), (cut * end, end))]
    assert same(sum(parts), whole)


@PROPERTY
@given(loops(), WINDOWS)
def test_a_narrower_window_never_shows_more_ripple(sides, part):
    end = sides[0][0][-1]
    narrow, wide = (numbers(build(sides), FRAME, w) for w in (Window(part[0] * end, part[1] * end), Window(0, end)))
    for name in ("force_ripple", "half_band", "deviation_from_target", "force_max", "stress_max"):
        assert narrow[name] <= wide[name] * (1 + 1e-12)


@PROPERTY
@given(loops())
def test_wider_bands_contain_narrower_ones_and_nothing_is_longer_than_the_travel(sides):
    found = numbers(build(sides), FRAME)
    assert 0 <= found["band_range_05pct"] <= found["band_range_1pct"] <= found["band_range_5pct"] <= sides[0][0][-1]
    assert 0 <= found["usable_stroke"] <= sides[0][0][-1]


@PROPERTY
@given(loops(), st.floats(0.01, 0.5))
def test_the_force_inside_the_usable_stroke_keeps_the_band_and_just_outside_it_does_not(sides, band):
    found = numbers(build(sides, extra=False), MeasuringFrame(target=64.0, band=band))
    assume(found["usable_stroke"] > 1e-6)
    start, end, travel = found["usable_start"], found["usable_end"], sides[0][0][-1]
    for motion, effort in sides:
        grid = np.union1d(np.linspace(start, end, 50), motion[(motion >= start) & (motion <= end)])
        assert np.abs(np.interp(grid, motion, effort) / 64 - 1).max() <= band + 1e-9
    for edge, beyond in ((start, start - 1e-7), (end, end + 1e-7)):
        if 1e-6 < edge < travel - 1e-6:
            assert max(abs(np.interp(beyond, *side) / 64 - 1) for side in sides) > band


@PROPERTY
@given(st.lists(st.tuples(st.integers(-20, 20), FORCE), min_size=3, max_size=30))
def test_the_runs_of_a_fold_are_its_path_clipped_to_the_window(points):
    motion = np.array([float(place) for place, _ in points])
    effort = np.array([force for _, force in points])
    lo, hi = motion.min(), motion.max()
    assume(hi > lo)
    window = Window(lo + (hi - lo) / 3, hi - (hi - lo) / 3.5)
    places, forces = restrict(motion, effort, window)
    slack = 1e-8 * (hi - lo)
    assert (places >= window.lo - slack).all()
    assert (places <= window.hi + slack).all()
    # every sample strictly inside is there, once each and in order
    kept = motion[(motion > window.lo + slack) & (motion < window.hi - slack)]
    assert places[(places > window.lo + slack) & (places < window.hi - slack)].tolist() == kept.tolist()
    # length and work of the path inside are those of its segments, clipped one by one
    length = work = 0.0
    for (x0, f0), (x1, f1) in itertools.pairwise(points):
        ends = np.clip([x0, x1], window.lo, window.hi)
        force = np.interp(ends, *zip(*sorted([(x0, f0), (x1, f1)]), strict=True))
        length += abs(ends[1] - ends[0])
        work += (ends[1] - ends[0]) * force.sum() / 2
    assert np.abs(np.diff(places)).sum() == pytest.approx(length, abs=1e-6)
    assert np.trapezoid(forces, places) == pytest.approx(work, abs=1e-4)

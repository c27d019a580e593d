"""Strokes: reversals, cycles, jitter, pauses; and what several cycles say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from experiment_support import triangle
from hypothesis import given
from hypothesis import strategies as st

from cfmkit.errors import DataError, UsageError
from cfmkit.experiment.branches import split, turning_points
from cfmkit.experiment.corrections_and_low_pass import LowPass, low_passed, read_filter
from cfmkit.experiment.curves_and_metrics_of_recording import measure_recording, numbers_of, require_loop
from cfmkit.experiment.reading import Recording
from cfmkit.experiment.recorded_values import loop_area
from cfmkit.metrics import Window


def recording(motion, force=None, time=None):
    motion = np.asarray(motion, dtype=float)
    force = 51.0 - np.arange(len(motion)) / len(motion) if force is None else force
    return Recording("made.csv", motion * 1e-3, force, time)


def strokes(motion):
    return [(part.branch, part.cycle, len(part.points)) for part in split(recording(motion)).strokes]


@pytest.mark.parametrize("cycles", [1, 2, 5])
def test_every_way_up_and_down_is_a_stroke_and_two_make_a_cycle(cycles):
    found = strokes(triangle(cycles))
    assert [item[:2] for item in found] == [(b, k + 1) for k in range(cycles) for b in ("load", "unload")]
    assert len(split(recording(triangle(cycles))).cycles) == cycles


def test_a_recording_that_starts_with_the_way_down_has_the_same_branches():
    assert [item[:2] for item in strokes(100.0 - triangle(1))] == [("unload", 1), ("load", 1)]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [0.1, 0.5])
def test_jitter_of_the_encoder_makes_no_strokes(seed, size):
    motion = triangle(2) + np.random.default_rng(seed).normal(0.0, size, 801)
    found = strokes(motion)
    assert [item[:2] for item in found] == [("load", 1), ("unload", 1), ("load", 2), ("unload", 2)]
    assert all(abs(item[2] - 200) <= 12 for item in found)


@given(st.lists(st.floats(-1, 1), min_size=2, max_size=60), st.floats(0.01, 1.5))
def test_successive_reversals_are_farther_apart_than_the_threshold(values, threshold):
    motion = np.array(values)
    found = turning_points(motion, threshold)
    assert found[0] == 0
    assert found == sorted(set(found))
    inner = np.abs(np.diff(motion[found]))[1:-1]
    assert (inner > threshold).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none",), "'none' is no filter; give 'default', None for no filter, or a LowPass"),
        (("2 Hz",), r"read_filter\('2 Hz'\)"),
        ((None, ("reversal",)), "a collection of 'reversals' and 'spikes' is needed, not"),
        ((None, "spikes"), "a collection of 'reversals' and 'spikes' is needed, not 'spikes'"),
    ],
)
def test_an_unknown_word_is_not_taken_for_the_default(arguments, words):
    with pytest.raises(UsageError, match=words):
        measure_recording(recording(triangle(1)), *arguments)


def test_points_at_which_the_machine_stood_are_left_out_and_counted():
    up = np.linspace(0, 100, 401)
    motion = np.concatenate([np.zeros(100), up, np.full(150, 100.0), up[::-1], np.zeros(80)])
    source = measure_recording(recording(motion), None)
    assert [item.name for item in source.warnings] == ["pauses"]
    assert 300 <= source.strokes.pauses <= 330
    assert all(399 <= len(part.points) <= 406 for part in source.strokes.strokes)


def test_a_pause_does_not_shift_the_mean():
    up = np.linspace(0, 100, 401)
    moving = np.concatenate([up, up[::-1]])
    standing = np.concatenate([np.zeros(500), moving])
    means = [
        numbers_of(measure_recording(recording(motion, 50 + motion / 10), None), window=Window(0.0, 0.1)).raw[
            "force_mean[load]"
        ]
        for motion in (moving, standing)
    ]
    assert means[1].value == pytest.approx(means[0].value, abs=0.03)


def test_one_way_only_is_measured_with_a_warning_and_without_hysteresis():
    source = measure_recording(recording(np.linspace(0, 100, 200)), None)
    assert [item.name for item in source.warnings] == ["one_branch"]
    numbers = numbers_of(source)
    assert numbers.raw["force_mean"].value is not None
    assert numbers.raw["hysteresis_area"].value is None


def test_what_completes_no_cycle_is_left_out_with_a_warning():
    motion = np.concatenate([triangle(2), np.linspace(0, 100, 201)[1:]])
    source = measure_recording(recording(motion), None)
    assert len(source.raw) == 2
    assert "unfinished_cycle" in [item.name for item in source.warnings]


def test_the_value_of_a_metric_is_its_mean_over_the_cycles_and_repeatability_is_their_spread():
    motion = triangle(3, 200)
    level = np.repeat([50.0, 51.0, 52.0], [401, 400, 400])
    numbers = numbers_of(measure_recording(recording(motion, level + motion / 1e3), None), window=Window(0.01, 0.09))
    assert numbers.raw["force_mean[load]"].value == pytest.approx(51.05, abs=1e-6)
    assert numbers.raw["force_repeatability[load]"].value == pytest.approx(1.0, abs=1e-9)
    assert len(numbers.cycle_metrics) == 3


def test_jitter_leaves_every_metric_defined():
    """Within a branch samples stand in the order of the motion: a flickering encoder makes no folds."""
    motion = triangle(1, 2000) + np.random.default_rng(0).normal(0, 0.2, 4001)
    numbers = numbers_of(measure_recording(recording(motion, 50 + 0.01 * motion), None), window=Window(0.01, 0.09))
    assert numbers.raw["band_range_1pct[load]"].value is not None


def test_a_window_that_was_not_measured_is_refused_with_what_was():
    source = measure_recording(recording(triangle(1)), None)
    with pytest.raises(DataError, match=r"the window 10 ... 300 mm is not measured on every branch: 0 ... 99.5 mm is"):
        numbers_of(source, window=Window(0.01, 0.3))


def test_the_loop_area_of_a_rectangle_is_its_sides_product():
    s = np.linspace(0, 0.1, 7)
    assert loop_area(s, np.full(7, 51.0), np.full(7, 49.0)) == pytest.approx(0.2)


@pytest.mark.parametrize("order", range(1, 9))
@pytest.mark.parametrize("share", [0.003, 0.05, 0.4])
def test_the_filter_is_that_of_scipy(order, share):
    from scipy.signal import butter, sosfiltfilt

    values = 50 + np.cumsum(np.random.default_rng(order).normal(size=700))
    sections = butter(order, 2 * share, output="sos")
    expected = sosfiltfilt(sections, values, padtype="odd", padlen=3 * (2 * len(sections) + 1))
    assert low_passed(values, np.arange(700.0), LowPass(share, "time", order)) == pytest.approx(expected, rel=1e-8)


def test_uneven_samples_are_filtered_as_even_ones():
    time = 0.0133 * (np.arange(1500) + np.random.default_rng(0).uniform(-0.2, 0.2, 1500))
    values = 50 + np.sin(time) + 0.2 * np.sin(60 * time)
    smooth = low_passed(values, time, LowPass(1.0, "time", 4))
    inside = (time > 2) & (time < 18)
    assert np.abs(smooth - 50 - np.sin(time))[inside].max() < 0.02


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2 Hz", LowPass(2.0, "time", 6)), ("0.24 1/mm, order 3", LowPass(240.0, "length", 3)),
        ("2 Hz, order 4, corrected", LowPass(2.0, "time", 4, True)), ("2 Hz corrected", LowPass(2.0, "time", 6, True)),
        ("none", None),
    ],
)  # fmt: skip
def test_filters_are_read(text, expected):
    assert read_filter(text) == expected


@pytest.mark.parametrize("text", ["", "2", "2 mm", "-1 Hz", "0 Hz", "2 Hz order x", "2 Hz, order 99"])
def test_malformed_filters_are_usage_errors(text):
    with pytest.raises(UsageError):
        read_filter(text)


def test_a_named_filter_that_cannot_be_used_is_refused_and_the_default_one_left_out():
    few = recording(triangle(1, 12))
    with pytest.raises(DataError, match="needs more than"):
        measure_recording(few, LowPass(20.0, "length", 6))
    with pytest.raises(DataError, match="not below half the sampling rate"):
        measure_recording(few, LowPass(1e5, "length", 1))
    with pytest.raises(DataError, match="needs a column with the time"):
        measure_recording(few, LowPass(1.0, "time", 1))
    assert [item.name for item in measure_recording(few).warnings] == ["not_filtered"]


def looped(motion, gap=1.0):
    motion = np.asarray(motion, dtype=float)
    way = np.sign(np.diff(motion, append=motion[-2]))
    return recording(motion, 50.0 + 0.5 * gap * way)


def test_a_last_cycle_that_was_broken_off_is_left_out_and_does_not_narrow_the_window():
    motion = triangle(3)
    source = measure_recording(looped(motion[: len(motion) - 100]), None)
    assert len(source.raw) == 2
    assert [(item.name, item.message) for item in source.warnings] == [
        ("unfinished_cycle", "2 of 6 strokes complete no cycle: left out")
    ]
    assert numbers_of(source).window.lo < 1e-3


def test_a_single_cycle_that_was_broken_off_is_measured_with_a_warning():
    motion = triangle(1)
    source = measure_recording(looped(motion[:300]), None)
    assert len(source.raw) == 1
    assert source.warnings[0].name == "unfinished_cycle"
    assert "covers only 49 % of the longer one" in source.warnings[0].message


def to_and_fro(*ends, step=0.5):
    """A displacement that passes some places in turn [mm]."""
    parts = [np.linspace(a, b, round(abs(b - a) / step) + 1)[1:] for a, b in pairwise(ends)]
    return np.concatenate([[ends[0]], *parts])


@pytest.mark.parametrize(
    ("ends", "cycles", "left"),
    [
        ((0, -3, 100, 0), [("load", 1)], "1 of 3"),
        ((0, -3, 100, 0, 100, 0), [("load", 1), ("load", 2)], "1 of 5"),
        ((50, 100, 0, 100), [("unload", 1)], "1 of 3"),
        ((100, 103, 0, 100), [("unload", 1)], "1 of 3"),
        ((0, -3, 100, 0, 100), [("unload", 2)], "2 of 4"),
        ((0, 100, 0, 100), [("load", 1)], "1 of 3"),
    ],
)
def test_a_short_first_stroke_is_no_part_of_a_cycle(ends, cycles, left):
    """A machine that retracts 3 mm first had been measured over these 3 mm alone."""
    source = measure_recording(looped(to_and_fro(*ends)), None)
    assert [(first.branch, first.cycle) for first, _ in source.strokes.cycles] == cycles
    assert f"{left} strokes complete no cycle: left out" in [item.message for item in source.warnings]
    numbers = numbers_of(source)
    assert (numbers.window.lo, numbers.window.hi) == pytest.approx((0.0, 0.1), abs=1.1e-3)
    assert numbers.raw["hysteresis_area"].value == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("ends", [(0, -3, 100), (0, 100, 95), (100, 103, 0)])
def test_one_stroke_and_a_few_millimetres_are_no_loop(ends):
    """The area over 3 mm had been given as the hysteresis of a recording without a way back."""
    source = measure_recording(looped(to_and_fro(*ends)), None)
    branch = "load" if ends[0] == 0 else "unload"
    assert source.raw[0].branches == (branch,)
    assert [item.name for item in source.warnings] == ["one_branch", "unfinished_cycle"]
    with pytest.raises(DataError, match=f"holds only the branch '{branch}'"):
        require_loop(source)
    numbers = numbers_of(source)
    assert numbers.window.hi - numbers.window.lo > 0.099
    assert numbers.raw["hysteresis_area"].value is None


@pytest.mark.parametrize(("gap", "found"), [(1.0, []), (-1.0, ["negative_loop"]), (0.01, []), (-0.01, [])])
def test_a_loop_that_runs_the_wrong_way_round_is_reported_where_noise_cannot_explain_it(gap, found):
    assert [item.name for item in measure_recording(looped(triangle(2), gap), None).warnings] == found

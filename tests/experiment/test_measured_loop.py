"""The synthetic loop of the reference note (section 4), raw and filtered, to its printed digits."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_support import reference_case
from scipy.signal import sosfreqz

from cfmkit.experiment.branches import split
from cfmkit.experiment.corrections_and_low_pass import LowPass, low_passed
from cfmkit.experiment.curves_and_metrics_of_recording import Measurement, measure_recording, numbers_of
from cfmkit.metrics import Window

WINDOW = Window(0.040, 0.210)
TWO_HERTZ = LowPass(2.0, "time", 6)


def two_pass_gain(filtered_by: LowPass, frequency: float, step: float) -> float:
    """Return the gain of both passes at a frequency, for samples `step` apart."""
    _, gain = sosfreqz(filtered_by.sections(step), [frequency], fs=1 / step)
    return float(abs(gain[0]) ** 2)


@pytest.fixture(scope="module")
def source():
    return measure_recording(reference_case(), TWO_HERTZ)


@pytest.fixture(scope="module")
def numbers(source) -> Measurement:
    return numbers_of(source, window=WINDOW)


@pytest.mark.parametrize(
    ("order", "frequency", "gain"), [(6, 1.8, 0.784004), (6, 2.5, 0.059993), (3, 1.8, 0.655788), (3, 2.5, 0.201680)]
)
def test_the_gain_of_both_passes_is_the_printed_one(order, frequency, gain):
    assert two_pass_gain(LowPass(2.0, "time", order), frequency, 1 / 35) == pytest.approx(gain, abs=5e-7)


@pytest.mark.parametrize("order", [1, 2, 3, 6])
def test_the_corrected_filter_has_minus_three_decibels_at_its_cutoff_and_the_plain_one_minus_six(order):
    assert two_pass_gain(LowPass(2.0, "time", order, corrected=True), 2.0, 1 / 35) == pytest.approx(0.5**0.5)
    assert two_pass_gain(LowPass(2.0, "time", order), 2.0, 1 / 35) == pytest.approx(0.5)


def test_the_recording_is_split_into_two_branches_at_the_largest_displacement(source):
    assert [(part.branch, len(part.points)) for part in source.strokes.strokes] == [("load", 1008), ("unload", 1008)]
    assert source.warnings == ()


def test_the_raw_loop_area_is_the_printed_one(numbers):
    assert numbers.raw["hysteresis_area"].value == pytest.approx(0.22953181, abs=5e-9)


def test_the_filtered_loop_area_is_the_printed_and_the_exact_one(numbers):
    assert numbers.filtered["hysteresis_area"].value == pytest.approx(0.22950000, abs=5e-9)


@pytest.mark.parametrize(("branch", "printed", "way"), [("load", 50.658418, 1.0), ("unload", 49.308418, -1.0)])
def test_filtered_means_over_the_715_points_of_the_closed_window_are_the_printed_ones(
    source, numbers, branch, printed, way
):
    """The note averages the points, ends included; the metric is over the displacement: the ends count half."""
    part = source.curve.select_branch(branch)
    inside = (part.motion > 0.040 - 1e-9) & (part.motion < 0.210 + 1e-9)
    assert inside.sum() == 715
    assert part.effort[inside].mean() == pytest.approx(printed, abs=5e-7)
    waves = 0.4 * 30 / (2 * np.pi * 170) * (np.cos(2 * np.pi * 40 / 30) - np.cos(2 * np.pi * 210 / 30))
    assert numbers.filtered[f"force_mean[{branch}]"].value == pytest.approx(50 + waves + way * 0.675, abs=1e-5)


@pytest.mark.parametrize(
    ("branch", "last", "printed"),
    [
        ("load", 209.9, (50.658037, 0.312040, 51.262733, 50.057267)),
        ("unload", 210.1, (49.307552, 0.321681, 49.915296, 48.692267)),
    ],
)
def test_filtered_statistics_over_714_points_are_the_printed_ones(source, branch, last, printed):
    """Rounding drops one of the two exact samples 40 and 210 mm in the note: 210 on the way up, 40 on the way down."""
    part = source.curve.select_branch(branch)
    s = part.motion * 1e3
    inside = (s > 39.9) & (s < last) if branch == "load" else (s > 40.1) & (s < last)
    force = part.effort[inside]
    assert len(force) == 714
    assert (force.mean(), force.std(ddof=1), force.max(), force.min()) == pytest.approx(printed, abs=5e-7)


def test_filtering_across_the_reversal_smears_the_jump_and_filtering_each_branch_does_not(source):
    case = reference_case()
    assert case.time is not None
    smeared = low_passed(case.effort, case.time, TWO_HERTZ)[1007]
    kept = source.curve.select_branch("load").effort[-1]
    assert (smeared, kept, case.effort[1007]) == pytest.approx((50.0821, 51.2547, 51.2578), abs=5e-5)


def test_metrics_of_the_contract_are_there_raw_and_filtered_per_branch(numbers):
    for name in ("force_mean", "force_sd", "force_ripple", "band_range_1pct", "range_95"):
        for branch in ("load", "unload"):
            for metrics in (numbers.raw, numbers.filtered):
                assert metrics[f"{name}[{branch}]"].value is not None, name


def test_a_filter_over_the_displacement_gives_the_same_loop_as_one_over_time(numbers):
    """500 mm/min: 2 Hz are 0.24 cycles per mm."""
    other = numbers_of(measure_recording(reference_case(), LowPass(240.0, "length", 6)), window=WINDOW)
    for name in ("force_mean[load]", "force_sd[unload]", "hysteresis_area"):
        assert other.filtered[name].value == pytest.approx(numbers.filtered[name].value, rel=1e-9)


def test_splitting_again_the_points_that_it_gave_changes_nothing():
    case = reference_case()
    points = np.concatenate([part.points for part in split(case).strokes])
    assert np.array_equal(points, np.arange(2016))

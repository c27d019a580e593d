"""Each metric against numbers worked out by hand on small curves."""

import math

import numpy as np
import pytest
from metrics_support import BARE, LOOP, SAW, curve, reason, value

from cfmkit.metrics import MeasuringFrame, definitions, measure

BY_HAND = {
    "force_mean": 10.0,
    "force_sd": math.sqrt(10 / 4),
    "force_max": 12.0,
    "force_min": 8.0,
    "force_ripple": 4 / 12,
    "half_band": 4 / 20,
    "deviation_from_mean": 2 / 10,
    "deviation_from_target": 4 / 12,
    "range_95": 4 - (3 + 0.4),
    "range_95_fraction": 0.6 / 4,
    "stress_max": 50.0,
    "safety_factor": 2.0,
}


@pytest.mark.parametrize("metric", BY_HAND)
def test_metrics_of_five_points_by_hand(metric):
    saw = curve(([0, 1, 2, 3, 4], [8, 10, 9, 11, 12]), stress=[0, 10, 20, 50, 40])
    assert value(metric, saw, MeasuringFrame(target=12.0, allowable_stress=100.0)) == pytest.approx(
        BY_HAND[metric], rel=1e-14
    )


@pytest.mark.parametrize("stress", [[0, 80, np.nan, 80, 0], [np.nan, 80, 80, 80, 0]])
def test_the_largest_stress_is_not_known_where_that_of_a_load_case_is_not(stress):
    """It was that of the other load cases, without the 80 Pa that are known of this one."""
    saw, other = (curve(([0, 1, 2, 3, 4], [8, 10, 9, 11, 12]), stress=one) for one in ([0, 10, 20, 50, 40], stress))
    frame = MeasuringFrame(allowable_stress=100.0, load_cases=(other,))
    for name in ("stress_max", "safety_factor"):
        assert reason(name, saw, frame) == "the stress of another load case is not known everywhere in the window"
    assert value("stress_max", saw, frame, (3, 4)) == 80.0


def test_every_metric_of_the_table_has_a_value_on_a_complete_loop():
    loop = curve(([0, 1, 2], [10, 12, 14]), ([2, 1, 0], [13, 11, 9]), stress=[0, 1, 2, 2, 1, 0])
    found = measure(loop, MeasuringFrame(target=12.0, allowable_stress=9.0))
    assert [name for name, item in found.items() if item.value is None] == []
    # what needs data of the material, a time, a curve or efforts of parts is measured where these are given
    # (test_metrics_longterm, test_target_curve, test_metrics_of_nothing)
    given = {"fatigue_life", "force_after", "deviation_from_curve", "rms_to_curve", "static_balance"}
    assert {item.name for item in definitions("force")} - given <= set(found)


def test_rms_to_target_is_taken_at_places_uniform_in_displacement_without_the_start():
    ramp = curve(([0, 0.001, 1], [-1e6, 0.001, 1]))  # F = u beyond a run-in that is over before the first place
    places = np.arange(1, 101) / 100
    assert value("rms_to_target", ramp, MeasuringFrame(target=0.25)) == pytest.approx(
        math.sqrt(np.mean((places - 0.25) ** 2))
    )


def test_sampling_does_not_weigh_in_rms_to_target():
    dense = np.concatenate([np.linspace(0, 0.1, 1000), np.linspace(0.11, 1, 7)])
    target = MeasuringFrame(target=3.0)
    assert value("rms_to_target", curve((dense, 2 + dense)), target) == pytest.approx(
        value("rms_to_target", curve(([0, 1], [2, 3])), target), rel=1e-12
    )


@pytest.mark.parametrize(("metric", "width"), [("05pct", 0.0025), ("1pct", 0.005), ("5pct", 0.025)])
def test_a_linear_force_leaves_the_band_where_its_slope_says(metric, width):
    # F = 10 (1 + 4 (u - 0.5)) about u = 0.5: |4 (u - 0.5)| <= p
    line = curve(([0, 0.3, 1], [-10, 2, 30]))
    assert value(f"band_range_{metric}", line) == pytest.approx(width, rel=1e-12)


def test_a_band_ends_at_the_first_exit_although_the_force_comes_back():
    bump = curve(([0, 1, 2, 3, 4], [10, 10, 10, 12, 10]))
    assert value("band_range_5pct", bump, MeasuringFrame(reference=1.0)) == pytest.approx(2.25)  # 10.5 at u = 2.25


def test_a_reference_pose_on_the_last_sample_is_allowed():
    assert value("band_range_5pct", SAW, MeasuringFrame(reference=4.0)) == pytest.approx(0.6)  # 11.4 at u = 3.4


def test_range_95_takes_the_first_place_that_reaches_the_force_at_the_end_of_the_window():
    peak = curve(([0, 1, 2, 3, 4], [0, 20, 5, 20, 20]))
    assert value("range_95", peak) == pytest.approx(4 - 0.95)
    assert value("range_95", peak, window=(0.5, 3)) == pytest.approx(3 - 0.95)  # c is sought before the window too


def test_range_95_is_the_whole_travel_where_the_force_is_there_from_the_start():
    assert value("range_95", curve(([1, 2, 3], [5, 5, 5]))) == 2


def test_hysteresis_is_the_area_between_the_branches_positive_where_load_lies_above():
    assert value("hysteresis_area", LOOP) == pytest.approx(2.0)
    swapped = curve(([0, 1, 2], [9, 11, 13]), ([2, 1, 0], [14, 12, 10]))
    assert value("hysteresis_area", swapped) == pytest.approx(-2.0)


def test_hysteresis_in_a_window_between_samples_uses_interpolated_ends():
    wedge = curve(([0, 2], [10, 14]), ([2, 0], [14, 8]))  # the gap falls linearly from 2 to 0
    assert value("hysteresis_area", wedge, window=(0.5, 1.5)) == pytest.approx((1.5 + 0.5) / 2)


def test_hysteresis_equals_the_trapezoids_on_the_union_of_both_grids():
    up, down = np.array([0, 0.3, 1.1, 2.0]), np.array([0, 0.7, 1.6, 2.0])
    load, unload = np.array([3, 5, 4, 6.0]), np.array([2, 1, 3, 5.5])
    grid = np.union1d(up, down)
    gap = np.interp(grid, up, load) - np.interp(grid, down, unload)
    area = np.sum(np.diff(grid) * (gap[1:] + gap[:-1]) / 2)
    assert value("hysteresis_area", curve((up, load), (down[::-1], unload[::-1]))) == pytest.approx(area)


def test_hysteresis_without_a_window_is_taken_where_both_branches_are():
    partial = curve(([0, 1, 2], [10, 12, 14]), ([2, 1.5], [13, 12]))
    assert value("hysteresis_area", partial) == pytest.approx(0.5)


def test_noise_of_a_known_loop_as_in_the_physics_note_of_the_cam():
    # exact area 0.2295 N m; with the sampled noise 0.22953181, both directions running in time
    s = 500 / 60 * np.arange(1008) / 35
    wave = 50 + 0.4 * np.sin(2 * np.pi * s / 30) + 0.25 * np.sin(2 * np.pi * 9 * np.arange(1008) / 35)
    gap = 0.3 + 0.003 * s
    loop = curve((s / 1000, wave + gap), (s[::-1] / 1000, (wave - gap)[::-1]))
    assert value("hysteresis_area", loop, window=(0.040, 0.210)) == pytest.approx(0.2295, abs=1e-6)


# -- usable stroke -----------------------------------------------------------------------------------------------


HUMP = curve(([0, 1, 2, 3, 4], [0, 100, 104, 100, 120]))


def usable(of, frame=BARE, window=None):
    return tuple(value(f"usable_{end}", of, frame, window) for end in ("start", "end", "stroke"))


FLAT = curve(([0, 1, 2, 3, 4], [100] * 5))
USABLE = {
    "from band to band": (HUMP, {}, (0.95, 3.25, 2.30)),  # enters 95 at 0.95; leaves 105 at 3.25
    "up to the allowable stress": (
        curve(([0, 1, 2, 3, 4], [100] * 5), stress=[0, 10, 20, 30, 40]), {"allowable_stress": 25.0}, (0, 2.5, 2.5),
    ),
    "in the longest valid interval": (FLAT, {"valid": ((0.0, 1.0), (1.5, 3.75))}, (1.5, 3.75, 2.25)),
    "in a valid interval beyond the travel": (FLAT, {"valid": ((-5.0, 9.0),)}, (0, 4, 4)),
    "where all branches keep the band": (curve(([0, 4], [100, 100]), ([4, 3, 0], [80, 100, 100])), {}, (0, 3.25, 3.25)),
    "where a step goes through the band between samples": (curve(([0, 1], [0, 200])), {}, (0.475, 0.525, 0.05)),
    # forward to 3 at 100 N, back to 1 at 50 N, forward again at 100 N: nothing between 1 and 3 can be relied on
    "where all states of a fold are": (curve(([0, 3, 3, 1, 1, 6], [100, 100, 50, 50, 100, 100])), {}, (3, 6, 3)),
    # leaves the band at 3, wanders back to 0.5 and returns into it at 2: all of 0.5 to 3 is lost
    "beyond the bad states of a fold": (
        curve(([0, 3, 3, 0.5, 2, 2, 4], [100, 100, 50, 50, 50, 100, 100])), {}, (3, 4, 1),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("of", "frame", "ends"), USABLE.values(), ids=USABLE)
def test_a_curve_is_usable(of, frame, ends):
    assert usable(of, MeasuringFrame(target=100.0, **frame)) == pytest.approx(ends)


def test_usable_stroke_without_a_target_is_around_the_mean_in_the_window():
    mean = (100 + 104 + 100) / 3
    assert value("usable_end", HUMP, window=(1, 3)) == pytest.approx(3 + (1.05 * mean - 100) / 20)


def test_a_mechanism_that_is_usable_nowhere_has_stroke_zero_and_no_ends():
    far = curve(([0, 1], [1, 2]))
    assert value("usable_stroke", far, MeasuringFrame(target=100.0)) == 0
    assert "no part of the travel" in reason("usable_start", far, MeasuringFrame(target=100.0))

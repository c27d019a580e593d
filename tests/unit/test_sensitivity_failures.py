"""A failed sample never passes as "no influence"."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from cfmkit.studies.parts.share import Share
from cfmkit.studies.sensitivity import failed_sample_policy as failures
from cfmkit.studies.sensitivity import local, monte_carlo_yield, morris, oat, sobol
from cfmkit.studies.sensitivity.failed_sample_policy import evaluated, nothing, stated

SLOPES = np.array([5.0, 1.0])


def linear(points):
    return points @ SLOPES


def sobol_setup():
    points = sobol.sample(0, 256, 2, 0)
    return linear(points), lambda outputs: sobol.analyze(outputs, 0), nothing(sobol.NAMES, 2)


def morris_setup():
    points = morris.sample(0, 20, 2, 0)
    return linear(points), lambda outputs: morris.analyze(points, outputs, 0), nothing(morris.NAMES, 2)


def tolerance_setup():
    unit = np.random.default_rng(0).standard_normal((500, 2))
    outputs = np.stack([linear(unit), linear(unit * [0.5, 1]), linear(unit * [1, 0.5])], axis=1)
    return (
        outputs,
        lambda found: monte_carlo_yield.variance_drops(found, 0),
        nothing((monte_carlo_yield.VARIANCE_DROP,), 2),
    )


every_method = pytest.mark.parametrize("setup", [sobol_setup, morris_setup, tolerance_setup])


def spoilt(outputs, count=1):
    damaged = outputs.copy()
    damaged.reshape(-1)[np.linspace(3, damaged.size - 4, count).astype(int)] = np.nan
    return damaged


@every_method
@pytest.mark.parametrize("policy", ["fail", "resample"])
def test_with_one_value_missing_no_index_is_stated(setup, policy):
    outputs, analyze, empty = setup()
    assert all(np.isfinite(found.value).all() for found in stated(analyze, outputs, policy, empty))
    for found in stated(analyze, spoilt(outputs), policy, empty):
        assert np.isnan(found.value).all()
        assert np.isnan(found.low).all()


@every_method
def test_bounds_hold_the_index_that_would_have_come_out(setup):
    outputs, analyze, empty = setup()
    complete = analyze(outputs)
    for found, known in zip(stated(analyze, spoilt(outputs, 5), "bound", empty), complete, strict=True):
        inside = (found.low <= known.value) & (known.value <= found.high)
        assert inside[~np.isnan(found.low)].all()
        assert np.isfinite(found.value).all()
        assert (found.value != 0).all()


def test_bounds_are_wider_the_more_samples_failed():
    outputs, analyze, empty = sobol_setup()
    widths = []
    for count in (1, 10, 60):
        first, _ = stated(analyze, spoilt(outputs, count), "bound", empty)
        widths.append(float((first.high - first.low).max()))
    assert widths == sorted(widths)
    # The sampling interval, the same in all three, is a large part of them.
    assert widths[-1] > 1.2 * widths[0]


@every_method
def test_with_all_values_missing_nothing_is_stated_under_any_policy(setup):
    outputs, analyze, empty = setup()
    for policy in get_args(failures.Policy):
        assert all(np.isnan(one.value).all() for one in stated(analyze, np.full_like(outputs, np.nan), policy, empty))


def test_the_library_alone_would_have_said_something_else():
    # Why the guard stands in front of the library: one NaN among 1024 values and this is what it says.
    outputs, analyze, _ = sobol_setup()
    with np.errstate(all="ignore"):
        first, _ = analyze(spoilt(outputs))
    assert not np.allclose(first.value, analyze(outputs)[0].value, equal_nan=False)


def fails_in_a_corner(points):
    outputs = linear(points)[..., None]
    return np.where((points[..., 0] > 0.9)[..., None], np.nan, outputs)


@pytest.mark.parametrize("name", ["sobol", "morris"])
def test_resampling_replaces_whole_blocks_and_says_how_many(name):
    module = {"sobol": sobol, "morris": morris}[name]
    model = fails_in_a_corner if name == "sobol" else fails_often
    found = evaluated(lambda start, count: module.sample(start, count, 2, 0), model, 40, "resample")
    assert found.points.shape[0] == 40
    assert not np.isnan(found.outputs).any()
    assert found.replaced >= 1
    assert found.failed >= found.replaced
    np.testing.assert_allclose(found.outputs[..., 0], linear(found.points))


def fails_often(points):
    return np.where((points.sum(axis=-1) == 0)[..., None], np.nan, linear(points)[..., None])


def test_resampled_trajectories_are_still_trajectories():
    found = evaluated(lambda start, count: morris.sample(start, count, 2, 0), fails_often, 30, "resample")
    size, _, _ = morris.analyze(found.points, found.outputs[..., 0], 0)
    np.testing.assert_allclose(size.value, SLOPES, atol=1e-12)


def test_resampling_gives_up_where_nothing_works():
    calls = []

    def never(points):
        calls.append(len(points))
        return np.full((*points.shape[:2], 1), np.nan)

    found = evaluated(lambda start, count: sobol.sample(start, count, 2, 0), never, 8, "resample")
    assert np.isnan(found.outputs).all()
    assert sum(calls) <= (failures.MOST_DRAWN + 1) * 8


def test_without_resampling_the_failures_are_counted_and_left_where_they_are():
    found = evaluated(lambda start, count: sobol.sample(start, count, 2, 0), fails_in_a_corner, 64, "fail")
    assert found.failed == int((found.points[..., 0] > 0.9).sum()) > 0
    assert found.replaced == 0


def test_a_failed_point_leaves_the_swing_of_its_own_parameter_open():
    nominal, ends = np.array([0.5, 0.5]), np.array([[0.0, 1.0], [0.0, 1.0]])
    outputs = linear(oat.sample(nominal, ends, 5))
    outputs[0, 0] = np.nan
    low, _, swing, slope = oat.analyze(nominal, ends, outputs, 3.0)
    assert np.isnan([low.value[0], swing.value[0], slope.value[0]]).all()
    assert swing.value[1] == pytest.approx(1.0)
    _, _, at_least, _ = oat.analyze(nominal, ends, outputs, 3.0, "bound")
    assert at_least.value[0] == pytest.approx(3.75)
    assert at_least.high[0] == np.inf


def test_a_gradient_without_points_is_not_zero():
    missing = np.full(local.LEVELS, np.nan)
    assert np.isnan(local.slope(missing, missing, 1.0, 0.1).value)
    one = missing.copy()
    one[3] = 1.0
    assert np.isnan(local.slope(one, one, 1.0, 0.1).value)


def test_steps_that_fail_far_out_leave_the_gradient_to_the_small_ones():
    points = local.sample(np.array([1.0]), np.array([0.4]))[0, ..., 0]
    outputs = np.where(np.abs(points - 1.0) > 0.06, np.nan, np.exp(points))
    found = local.slope(outputs[0], outputs[1], np.exp(1.0), 0.4)
    assert found.value == pytest.approx(np.exp(1.0), abs=1e-7)


def test_failed_samples_leave_the_yield_open_or_bounded():
    met = np.array([True] * 80 + [False] * 10 + [False] * 10)
    failed = np.array([False] * 90 + [True] * 10)
    found = Share.of(met, failed, "unknown")
    assert np.isnan([found.value, *found.wilson, *found.clopper_pearson]).all()
    assert found.failed == 10
    assert found.as_json()["value"] is None
    bounded = Share.of(met, failed, "either")
    assert bounded.value == pytest.approx(0.85)
    assert bounded.wilson[0] < 0.8
    assert bounded.wilson[1] > 0.9


def test_a_failed_sample_leaves_the_yield_gain_of_its_tolerance_open():
    met = np.array([[True, True, True]] * 50 + [[False, True, False]] * 50)
    failed = np.zeros(met.shape, bool)
    failed[3, 2] = True
    gain = monte_carlo_yield.yield_gains(met, failed, "fail")
    assert gain.value[0] == pytest.approx(0.5)
    assert np.isnan(gain.value[1])

"""A failed sample never passes as "no influence"."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.studies.parts.share import Share
from cfmkit.studies.sensitivity import local, morris, oat, sobol, tolerance
from cfmkit.studies.sensitivity.result_types import analyze_complete

SLOPES = np.array([5.0, 1.0])


def linear(points):
    return points @ SLOPES


def sobol_setup():
    points = sobol.sample(0, 256, 2, 0)
    return linear(points), lambda outputs: sobol.analyze(outputs, 0), sobol.INDEX_NAMES


def morris_setup():
    points = morris.sample(0, 20, 2, 0)
    return linear(points), lambda outputs: morris.analyze(points, outputs, 0), morris.INDEX_NAMES


def tolerance_setup():
    unit = np.random.default_rng(0).standard_normal((500, 2))
    outputs = np.stack([linear(unit), linear(unit * [0.5, 1]), linear(unit * [1, 0.5])], axis=1)
    return (
        outputs,
        lambda found: tolerance.variance_drops(found, 0),
        (tolerance.VARIANCE_DROP,),
    )


every_method = pytest.mark.parametrize("setup", [sobol_setup, morris_setup, tolerance_setup])


def spoilt(outputs, count=1):
    damaged = outputs.copy()
    damaged.reshape(-1)[np.linspace(3, damaged.size - 4, count).astype(int)] = np.nan
    return damaged


@every_method
@pytest.mark.parametrize("count", [1, 100])
def test_with_values_missing_no_index_is_stated(setup, count):
    outputs, analyze, names = setup()
    assert all(np.isfinite(found.value).all() for found in analyze_complete(outputs, analyze, names, 2))
    for found in analyze_complete(spoilt(outputs, min(count, outputs.size)), analyze, names, 2):
        assert np.isnan(found.value).all()
        assert np.isnan(found.low).all()


def test_the_library_alone_would_have_said_something_else():
    # Why the guard stands in front of the library: one NaN among 1024 values and this is what it says.
    outputs, analyze, _ = sobol_setup()
    with np.errstate(all="ignore"):
        first, _ = analyze(spoilt(outputs))
    assert not np.allclose(first.value, analyze(outputs)[0].value, equal_nan=False)


def test_a_failed_point_leaves_the_swing_of_its_own_parameter_open():
    nominal, ends = np.array([0.5, 0.5]), np.array([[0.0, 1.0], [0.0, 1.0]])
    outputs = linear(oat.sample(nominal, ends, 5))
    outputs[0, 0] = np.nan
    low, _, swing, slope = oat.analyze(nominal, ends, outputs, 3.0)
    assert np.isnan([low.value[0], swing.value[0], slope.value[0]]).all()
    assert swing.value[1] == pytest.approx(1.0)


def test_a_gradient_without_points_is_not_zero():
    missing = np.full(local.N_STEP_LEVELS, np.nan)
    assert np.isnan(local.slope(missing, missing, 1.0, 0.1).value)
    one = missing.copy()
    one[3] = 1.0
    assert np.isnan(local.slope(one, one, 1.0, 0.1).value)


def test_steps_that_fail_far_out_leave_the_gradient_to_the_small_ones():
    points = local.sample(np.array([1.0]), np.array([0.4]))[0, ..., 0]
    outputs = np.where(np.abs(points - 1.0) > 0.06, np.nan, np.exp(points))
    found = local.slope(outputs[0], outputs[1], np.exp(1.0), 0.4)
    assert found.value == pytest.approx(np.exp(1.0), abs=1e-7)


def test_failed_samples_are_bad_parts():
    met = np.array([True] * 80 + [False] * 10 + [True] * 10)
    failed = np.array([False] * 90 + [True] * 10)
    found = Share.from_outcomes(met, failed)
    assert (found.value, found.failed) == (0.8, 10)
    assert found.wilson[0] < 0.8 < found.wilson[1]
    both = np.array([[True, True, True]] * 50 + [[False, True, False]] * 50)
    lost = np.zeros(both.shape, bool)
    lost[3, 2] = True
    gain = tolerance.yield_gains(both, lost)
    assert gain.value.tolist() == [pytest.approx(0.5), pytest.approx(-0.01)]

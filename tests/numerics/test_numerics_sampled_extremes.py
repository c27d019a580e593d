"""Extremes of sampled functions: exact on parabolas, third order on smooth functions, with their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cfmkit.numerics.sampled_extremes import largest, soft_least

PLACES = np.array([0.0, 0.2, 0.5, 0.6, 1.0, 1.3])


@given(st.floats(0.21, 0.99), st.floats(0.1, 10), st.floats(-5, 5))
def test_the_top_of_a_parabola_is_met_exactly(top, bend, height):
    value, place, weights = largest(PLACES, height - bend * (PLACES - top) ** 2)
    assert value == pytest.approx(height, abs=1e-12 * (bend + abs(height)))
    assert place == pytest.approx(top, abs=1e-10)
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("values", [PLACES, -PLACES, PLACES**2, np.zeros(6), (PLACES - 0.55) ** 2])
def test_without_a_top_the_largest_sample_is_returned(values):
    value, place, weights = largest(PLACES, values)
    best = int(values.argmax())
    assert (value, place) == (values[best], PLACES[best])
    np.testing.assert_array_equal(weights, np.eye(6)[best])


def test_the_error_of_a_top_falls_with_the_third_power_of_the_spacing_at_least():
    errors = []
    for count in (11, 21, 41, 81):
        x = np.linspace(0.0, 2.0, count)
        tops = np.linspace(0.6, 1.4, 101)[:, None]
        values = np.exp(-(x - tops)) * np.sin(np.pi / 4 + x - tops)
        errors.append(np.abs(largest(x, values)[0] - np.sqrt(0.5)).max())
    assert (np.log2(np.array(errors[:-1]) / errors[1:]) > 2.7).all()


def test_many_functions_at_once_are_those_one_by_one():
    rng = np.random.default_rng(5)
    places = np.sort(rng.random((3, 1, 7)), axis=-1)
    values = rng.normal(size=(3, 2, 7))
    together = largest(places, values)
    assert [part.shape for part in together] == [(3, 2), (3, 2), (3, 2, 7)]
    for row in np.ndindex(3, 2):
        alone = largest(places[row[0], 0], values[row])
        for one, all_of_them in zip(alone, together, strict=True):
            np.testing.assert_array_equal(one, all_of_them[row])


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6), st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_the_weights_give_the_derivative_of_a_top(values, slopes):
    """By central differences, where the step changes neither the best sample nor whether there is a top."""
    f, by = np.array(values), np.array(slopes)
    step = 1e-6
    low, high = (largest(PLACES, f + side * step * by) for side in (-1, 1))
    _, place, weights = largest(PLACES, f)
    gaps = np.sort(f)[-1] - np.sort(f)[-2]
    bends = np.abs(np.diff(np.diff(f) / np.diff(PLACES)))
    assume(gaps > 1e-2)
    assume(bends.min() > 1e-2)
    assume(abs(low[1] - high[1]) < 1e-3)
    assert PLACES[0] <= place <= PLACES[-1]
    assert (high[0] - low[0]) / (2 * step) == pytest.approx(weights @ by, abs=1e-4)


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=8), st.floats(1, 200))
def test_the_soft_least_is_below_the_least_by_no_more_than_it_says(values, sharpness):
    values = np.array(values)
    least, weights = soft_least(values, sharpness)
    assert values.min() - np.log(len(values)) / sharpness - 1e-12 <= least <= values.min() + 1e-12
    assert weights.sum() == pytest.approx(1.0)
    assert (weights >= 0).all()


def test_the_soft_least_has_the_derivatives_that_it_says():
    values, sharpness, step = np.array([1.0, 1.02, 1.5]), 30.0, 1e-6
    _, weights = soft_least(values, sharpness)
    for k, weight in enumerate(weights):
        low, high = (soft_least(values + side * step * np.eye(3)[k], sharpness)[0] for side in (-1, 1))
        assert (high - low) / (2 * step) == pytest.approx(weight, abs=1e-8)

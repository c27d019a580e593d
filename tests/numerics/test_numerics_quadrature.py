"""Running integrals by panels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfmkit.numerics.quadrature import RunningIntegral, clenshaw_curtis

FAST = settings(deadline=None, max_examples=100)


@FAST
@given(st.lists(st.floats(-3, 3), min_size=1, max_size=8), st.floats(0.1, 5), st.floats(0, 1))
def test_polynomials_up_to_degree_7_are_integrated_exactly(coefficients, length, share):
    polynomial = np.polynomial.Polynomial(coefficients)
    integral = RunningIntegral(polynomial, -1.0, -1.0 + length)
    t = np.array([-1.0, -1.0 + share * length, -1.0 + length])
    exact = polynomial.integ()
    scale = sum(abs(c) * max(1, length) ** (k + 1) for k, c in enumerate(coefficients))
    np.testing.assert_allclose(integral(t), exact(t) - exact(-1.0), rtol=1e-13, atol=1e-14 * scale + 1e-300)


@pytest.mark.parametrize(
    ("function", "antiderivative", "stop"),
    [
        (np.cos, np.sin, 20.0),
        (np.exp, np.exp, 5.0),
        (lambda t: 1 / (1 + 25 * (t - 1) ** 2), lambda t: np.arctan(5 * (t - 1)) / 5, 3.0),
        (lambda t: 1 / (1.001 - t), lambda t: -np.log(1.001 - t), 1.0),
    ],
    ids=["oscillating", "growing", "peaked", "nearly singular at its end"],
)
def test_the_integral_is_accurate_everywhere_between(function, antiderivative, stop):
    integral = RunningIntegral(function, 0.0, stop)
    t = stop * (1 - np.linspace(0, 1, 501) ** 3)
    exact = antiderivative(t) - antiderivative(0.0)
    np.testing.assert_allclose(integral(t), exact, rtol=1e-12, atol=1e-13 * np.abs(exact).max())


def test_panels_gather_where_the_function_is_difficult():
    integral = RunningIntegral(lambda t: 1 / (1 + 1e-6 - t), 0.0, 1.0)
    edges = integral._inner
    assert (edges > 0.9).sum() > 3 * (edges < 0.5).sum()


def test_a_smooth_function_is_evaluated_once():
    calls = []

    def counted(t):
        calls.append(t.size)
        return np.cos(t)

    integral = RunningIntegral(counted, 0.0, 1.0)
    integral(np.linspace(0, 1, 1000))
    assert len(calls) == 1


def test_a_number_and_an_array_give_the_same_integral():
    integral = RunningIntegral(np.exp, 0.0, 2.0)
    t = np.linspace(0, 2, 37)
    np.testing.assert_allclose([integral(float(at)) for at in t], integral(t), rtol=1e-15, atol=1e-17)


def test_an_interval_without_length_has_no_integral():
    integral = RunningIntegral(np.exp, 1.0, 1.0)
    assert integral(1.0) == 0
    np.testing.assert_array_equal(integral(np.ones(3)), np.zeros(3))


def test_a_function_singular_inside_ends_refinement_at_the_limit():
    integral = RunningIntegral(lambda t: 1 / np.abs(t - 1 / math.pi), 0.0, 1.0, max_panels=64)
    assert len(integral._middle) <= 128
    assert np.isfinite(integral(1.0))


@pytest.mark.parametrize("count", [2, 3, 4, 9, 16, 17])
def test_the_mean_from_chebyshev_points_is_exact_for_polynomials_of_a_degree_below_their_number(count):
    nodes, weights = np.polynomial.chebyshev.chebpts2(count), clenshaw_curtis(count)
    assert (weights > 0).all()
    np.testing.assert_allclose(weights, weights[::-1], rtol=1e-13)
    for degree in range(count):
        mean = 0.0 if degree % 2 else 1.0 / (degree + 1)
        assert weights @ nodes**degree == pytest.approx(mean, abs=1e-14)


def test_the_mean_of_a_smooth_function_converges_faster_than_any_power():
    def error(count):
        return abs(clenshaw_curtis(count) @ np.exp(np.polynomial.chebyshev.chebpts2(count)) - math.sinh(1.0))

    assert error(5) < 1e-3
    assert error(9) < 1e-8
    assert error(13) < 1e-14

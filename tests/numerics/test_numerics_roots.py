"""Root finding for one and for many targets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from cfmkit.numerics.roots import bracketed_root, invert_increasing

FAST = settings(deadline=None, max_examples=200)


def cubic(x):
    return x**3 + x, 3 * x**2 + 1


@FAST
@given(st.lists(st.floats(-30, 30), min_size=1, max_size=20), st.floats(-3, 3))
def test_every_target_is_met(targets, guess):
    targets = np.array(targets)
    x = invert_increasing(cubic, targets, (-4.0, 4.0), np.full(targets.shape, guess))
    np.testing.assert_allclose(cubic(x)[0], targets, rtol=1e-13, atol=1e-13)


@FAST
@given(st.floats(0, 1))
def test_a_vanishing_derivative_at_an_end_does_no_harm(share):
    target = np.array([share**2])
    x = invert_increasing(lambda x: (x * x, 2 * x), target, (0.0, 1.0), np.array([0.9]))
    assert x[0] ** 2 == pytest.approx(share**2, abs=1e-15)


def test_a_steep_and_flat_function_needs_bisection_and_gets_it():
    def step(x):
        return np.tanh(1e4 * (x - 0.123)), 1e4 / np.cosh(np.minimum(1e4 * np.abs(x - 0.123), 300)) ** 2

    targets = np.array([-0.5, 0.0, 0.5])
    x = invert_increasing(step, targets, (-1.0, 1.0), np.array([-0.9, 0.9, 0.0]))
    np.testing.assert_allclose(x, 0.123 + np.arctanh(targets) / 1e4, rtol=1e-12)


def test_targets_outside_the_range_end_at_the_nearer_end():
    x = invert_increasing(cubic, np.array([-1e3, 1e3]), (-2.0, 2.0), np.zeros(2))
    np.testing.assert_allclose(x, [-2, 2], atol=1e-12)


def test_a_target_that_is_not_a_number_has_no_root_and_does_not_disturb_the_others():
    x = invert_increasing(cubic, np.array([np.nan, 2.0]), (-2.0, 2.0), np.zeros(2))
    assert np.isnan(x[0])
    assert x[1] == pytest.approx(1)


def test_no_targets_give_no_roots():
    assert invert_increasing(cubic, np.array([]), (0.0, 1.0), np.array([])).shape == (0,)


def test_newton_from_a_good_guess_evaluates_twice():
    calls = []

    def counted(x):
        calls.append(x)
        return np.exp(x), np.exp(x)

    targets = np.linspace(1, 7, 50)
    x = invert_increasing(counted, targets, (0.0, 2.0), np.log(targets) + 1e-6)
    np.testing.assert_allclose(x, np.log(targets), atol=1e-14)
    assert len(calls) == 2


@FAST
@given(st.floats(-0.99, 0.99), st.integers(1, 9))
def test_the_bracketed_root_is_brents(root, power):
    def function(x):
        return (x - root) * (1 + (x - root) ** 2) ** power

    assert bracketed_root(function, -1.0, 1.5) == pytest.approx(brentq(function, -1.0, 1.5, xtol=1e-15), abs=2e-15)


@pytest.mark.parametrize("function", [lambda x: math.copysign(1.0, x - 0.3), lambda x: x**3 - 2 * x - 5])
def test_functions_with_a_jump_or_a_bend_are_bracketed_down_to_rounding(function):
    root = bracketed_root(function, -1.0, 4.0)
    step = 4 * np.finfo(float).eps * abs(root)
    assert function(root - step) < 0 < function(root + step)


def test_a_flat_root_is_found_where_the_function_vanishes():
    assert bracketed_root(lambda x: (x - 1) ** 9, -1.0, 4.0) == pytest.approx(1, abs=1e-12)


def test_it_converges_faster_than_bisection():
    calls = []

    def counted(x):
        calls.append(x)
        return math.cos(x) - x

    assert math.cos(root := bracketed_root(counted, 0.0, 1.0)) == pytest.approx(root, abs=1e-15)
    assert len(calls) < 15


def test_a_root_at_an_end_is_that_end():
    assert bracketed_root(lambda x: x - 1.0, 1.0, 2.0) == 1.0
    assert bracketed_root(lambda x: x - 2.0, 1.0, 2.0) == 2.0


@pytest.mark.parametrize(
    "function",
    [lambda x: 1.0 + x * x, lambda x: math.nan, lambda x: math.nan if 0.2 < x < 0.8 else x - 0.5],
    ids=["no change of sign", "not a number at the ends", "not a number on the way"],
)
def test_what_has_no_bracketed_root_is_refused(function):
    with pytest.raises(ValueError, match=r"sign|not a number"):
        bracketed_root(function, 0.0, 1.0)

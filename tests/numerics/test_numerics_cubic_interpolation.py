"""Local cubics: exact on cubics, fourth order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfmkit.numerics.interpolation import bisect, crossing, first_extreme, value_at, values_at

X = np.array([0.0, 0.3, 1.0, 1.4, 2.0, 3.1])


@given(st.lists(st.floats(-2, 2), min_size=4, max_size=4), st.floats(0, 3.1))
def test_a_cubic_is_met_exactly(coefficients, place):
    assert value_at(X, np.polyval(coefficients, X), place) == pytest.approx(np.polyval(coefficients, place), abs=1e-10)


@given(st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6), st.floats(0, 3.1))
def test_one_place_gives_what_many_give(values, place):
    assert value_at(X, np.array(values), place) == values_at(X, np.array(values), np.array([place]))[0]


def test_the_error_falls_with_the_fourth_power_of_the_spacing():
    errors = []
    for count in (11, 21, 41):
        x, places = np.linspace(0, 3, count), np.linspace(0, 3, 997)
        errors.append(np.abs(values_at(x, np.sin(x), places) - np.sin(places)).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([4, 4], abs=0.5)


def test_crossings_and_extremes_of_a_sine():
    x = np.linspace(0, 6, 241)
    assert crossing(x, np.sin(x), 0.5) == pytest.approx(np.pi / 6, abs=1e-7)
    assert crossing(x, np.sin(x), 1.5) is None
    assert crossing(x, np.cos(x), 0.5) == 0
    assert first_extreme(x, np.sin(x)) == pytest.approx((np.pi / 2, 1), abs=1e-6)
    assert first_extreme(x, np.sin(x), -1, after=2.0) == pytest.approx((1.5 * np.pi, -1), abs=1e-6)
    assert first_extreme(x, x) is None


def test_bisection_finds_where_a_condition_begins_to_hold():
    assert bisect(lambda place: place > 0.25, 0.0, 1.0) == pytest.approx(0.25, abs=1e-15)

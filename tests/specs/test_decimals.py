"""The decimal point moves as on paper, for every magnitude, and back again."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfmkit.specs.units.decimal_scaling_and_grids import even_grid, shift_decimal

POWERS = (-15, -6, -3, -1, 1, 3, 6, 15)
finite = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e250, max_value=1e250)


def test_the_plain_product_is_not_good_enough_and_the_shift_is():
    thousandths = np.arange(1, 2000) / 10_000
    assert any(len(repr(float(value * 1000))) > 6 for value in thousandths)
    assert [repr(value) for value in shift_decimal(thousandths, 3).tolist()] == [repr(k / 10) for k in range(1, 2000)]


@given(
    st.integers(-(10**15) + 1, 10**15 - 1),
    st.integers(-200, 200),
    st.sampled_from(POWERS),
)
def test_decimals_of_15_digits_shift_as_on_paper_and_back(digits, exponent, power):
    value = float(f"{digits}e{exponent}")
    shifted = float(shift_decimal(value, power))
    assert shifted == float(f"{digits}e{exponent + power}")
    assert float(shift_decimal(shifted, -power)) == value


@given(finite, st.sampled_from(POWERS))
def test_longer_floats_become_the_float_nearest_to_the_exact_product(value, power):
    shifted = float(shift_decimal(value, power))
    if len(Decimal(repr(value)).normalize().as_tuple().digits) > 15:
        assert shifted == float(Fraction(value) * Fraction(10) ** power)
    assert abs(Fraction(shifted) - Fraction(value) * Fraction(10) ** power) <= 2 * Fraction(math.ulp(shifted))


@pytest.mark.parametrize("edge", [10.0**k for k in range(-12, 24)])
def test_neighbours_of_powers_of_ten_are_not_off_by_a_digit(edge):
    for value in (np.nextafter(edge, 0), edge, np.nextafter(edge, np.inf), edge * (1 - 1e-15), edge * (1 + 1e-14)):
        digits = Decimal(repr(float(value))).normalize()
        exact = Fraction(digits) if len(digits.as_tuple().digits) <= 15 else Fraction(float(value))
        assert float(shift_decimal(value, 3)) == float(exact * 1000)


def test_nan_infinity_and_zero_stay_and_the_shape_too():
    values = np.array([[np.nan, np.inf, -np.inf], [0.0, -0.0, 1.0]])
    np.testing.assert_array_equal(shift_decimal(values, 3), [[np.nan, np.inf, -np.inf], [0.0, 0.0, 1000.0]])
    assert shift_decimal([], 3).shape == (0,)
    assert shift_decimal(1.5, 0) == 1.5


def test_a_shift_beyond_the_exact_powers_is_refused():
    with pytest.raises(ValueError, match="-15 to 15 places, not 16"):
        shift_decimal(1.0, 16)


@pytest.mark.parametrize(
    ("start", "stop", "count"),
    [(0, 240, 481), (0, 30, 101), (0.1, 0.7, 7), (-12.5, 3, 156), (240, 0, 481), (2, 2.03, 4)],
)
def test_an_even_grid_has_the_float_nearest_to_each_decimal(start, stop, count):
    ends = Fraction(str(start)), Fraction(str(stop))
    exact = [ends[0] + (ends[1] - ends[0]) * k / (count - 1) for k in range(count)]
    grid = even_grid(float(ends[0] / 1000), float(ends[1] / 1000), count)
    assert shift_decimal(grid, 3).tolist() == [float(place) for place in exact]
    assert grid.tolist() == [float(place / 1000) for place in exact]


@given(st.floats(-10, 10), st.floats(-10, 10), st.integers(2, 50))
def test_an_even_grid_keeps_its_ends_and_never_strays_from_the_line(start, stop, count):
    grid = even_grid(start, stop, count)
    assert (grid[0], grid[-1]) == (start, stop)
    np.testing.assert_allclose(grid, np.linspace(start, stop, count), rtol=0, atol=1e-14)


def test_a_grid_of_one_place_is_refused():
    with pytest.raises(ValueError, match="at least 2 places"):
        even_grid(0.0, 1.0, 1)

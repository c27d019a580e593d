"""Cubics through values and slopes: against scipy's."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from cfmkit.numerics.hermite_cubics import HermiteCubics, monotone_cubics


def knots(count):
    return np.cumsum(np.random.default_rng(count).uniform(0.2, 2.0, count))


@pytest.mark.parametrize("columns", [(), (3,)])
def test_values_and_slopes_are_those_of_scipys_spline(columns):
    random = np.random.default_rng(1)
    x, y, slope = knots(7), random.normal(size=(7, *columns)), random.normal(size=(7, *columns))
    places = np.linspace(x[0] - 0.5, x[-1] + 0.5, 101)
    own, other = HermiteCubics(x, y, slope), CubicHermiteSpline(x, y, slope)
    assert own(places) == pytest.approx(other(places), rel=1e-10, abs=1e-12)
    assert own.derivative(places) == pytest.approx(other.derivative()(places), rel=1e-10, abs=1e-12)


def test_turning_points_and_places_of_a_level_are_those_of_scipys_spline():
    random = np.random.default_rng(2)
    x, y, slope = knots(9), random.normal(size=9), random.normal(size=9)
    own, other = HermiteCubics(x, y, slope), CubicHermiteSpline(x, y, slope)
    assert own.turning_points() == pytest.approx(np.sort(other.derivative().roots(extrapolate=False)), rel=1e-9)
    for level in (-0.4, 0.1, float(y[3])):
        assert own.where(level) == pytest.approx(np.unique(other.solve(level, extrapolate=False)), rel=1e-9)
    assert len(own.where(99.0)) == 0


@pytest.mark.parametrize("count", [2, 3, 12])
def test_monotone_cubics_are_scipys(count):
    x = knots(count)
    y = np.round(np.random.default_rng(count).normal(size=count), 1)  # some equal neighbours
    places = np.linspace(x[0], x[-1], 77)
    assert monotone_cubics(x, y)(places) == pytest.approx(PchipInterpolator(x, y)(places), rel=1e-10, abs=1e-12)

"""Curves through points that do not overshoot."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.numerics.interpolation import ThroughPoints


@pytest.mark.parametrize("smooth", [True, False])
def test_integral_and_slope_are_those_of_the_function(smooth):
    curve = ThroughPoints((0.0, 1.0, 2.5, 3.0, 4.0), (1.0, 1.0, 2.0, 0.5, 0.7), smooth)
    x = np.linspace(-0.5, 4.5, 301)
    x = x[np.abs(x[:, None] - np.array(curve.places)).min(axis=1) > 2e-5]
    h = 1e-5
    assert np.allclose((curve.integral(x + h) - curve.integral(x - h)) / (2 * h), curve.evaluate(x), atol=1e-9)
    inside = x[(x > 0) & (x < 4)]
    assert np.allclose(
        (curve.evaluate(inside + h) - curve.evaluate(inside - h)) / (2 * h), curve.slope(inside), atol=1e-6
    )
    assert curve.evaluate(np.array(curve.places)) == pytest.approx(curve.values)


def test_a_smooth_curve_rounds_steps_and_does_not_overshoot():
    curve = ThroughPoints((0.0, 1.0, 1.2, 3.0), (1.0, 1.0, 2.0, 2.0))
    values = curve.evaluate(np.linspace(0.0, 3.0, 1001))
    assert values.min() == 1.0
    assert values.max() == 2.0
    assert (np.diff(values) >= 0).all()
    assert curve.slope(1.0) == 0.0
    assert curve.extremes(0.0, 3.0) == (1.0, 2.0)

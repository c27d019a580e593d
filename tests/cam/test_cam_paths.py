"""Roller paths: closed form, quadrature and ODE against each other and against scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from cfmkit.families.cam.geometry.path import RollerPath, reach
from cfmkit.families.cam.geometry.slope_law import SlopeLaw, brace_tangent, drop

SLOW = settings(deadline=None, max_examples=30)
FAST = settings(deadline=None, max_examples=150)


@st.composite
def laws(draw, frictions=(0.0, 0.002, 0.05, 0.3, -0.002, -0.05), factors=(1.0, 1.4)):
    brace = draw(st.floats(0.05, 0.5))
    law = SlopeLaw(
        brace * draw(st.floats(0.01, 1.0)),
        brace * draw(st.floats(0.1, 0.7)),
        brace,
        draw(st.sampled_from(frictions)),
        draw(st.sampled_from(factors)),
    )
    assume(law.slope(law.rest_half_width) > 0.02)
    return law


def places(law, count=9, most=0.95):
    """Return path coordinates from x0 to a part of the way to where the path must end."""
    span = min(law.vertical_at, 0.98 * law.brace_length) - law.rest_half_width
    return law.rest_half_width + span * np.linspace(0, most, count)


@SLOW
@given(laws())
def test_quadrature_and_ode_agree_to_1e_9(law):
    x = places(law)
    by_quadrature, by_ode = RollerPath(law, x[-1]).height(x), RollerPath(law, x[-1], "ode").height(x)
    np.testing.assert_allclose(by_ode, by_quadrature, rtol=1e-9, atol=1e-12 * law.brace_length)


@settings(deadline=None, max_examples=10)
@given(laws())
def test_the_path_is_what_radau_makes_of_the_papers_equation(law):
    """dx/dy = (1 - mu f)/(mu + f) over y, [SS, eq. 2], by an implicit integrator with tight tolerances."""
    x = places(law, most=0.8)
    heights = np.maximum(RollerPath(law, x[-1]).height(x), 0)  # the first one may be -1e-19

    def rate(_y, at):
        p = law.slope_factor * (
            (at - law.rest_half_width) / law.force_constant + at / np.sqrt(law.brace_length**2 - at**2)
        )
        return (1 - law.friction * p) / (law.friction + p)

    found = solve_ivp(rate, (0, heights[-1]), [x[0]], "Radau", t_eval=heights, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(found.y[0], x, rtol=1e-8)


@FAST
@given(laws())
def test_the_height_is_the_integral_of_the_slope(law):
    x = places(law, 3)
    expected = [quad(law.slope, x[0], at, epsabs=0, epsrel=1e-12, limit=200)[0] for at in x[1:]]
    np.testing.assert_allclose(RollerPath(law, x[-1]).height(x[1:]), expected, rtol=1e-10)


@FAST
@given(laws(frictions=(0.0,)))
def test_without_friction_the_quadrature_gives_the_closed_form(law):
    x = places(law)
    barely = SlopeLaw(law.force_constant, law.rest_half_width, law.brace_length, 1e-300, law.slope_factor)
    closed, quadrature = RollerPath(law, x[-1]), RollerPath(barely, x[-1])
    np.testing.assert_allclose(quadrature.height(x), closed.height(x), rtol=1e-11, atol=1e-16)


@FAST
@given(laws(frictions=(0.0,), factors=(1.0,)), st.floats(0, 1))
def test_without_friction_force_times_travel_is_the_energy_of_the_springs(law, share):
    x = law.rest_half_width + share * 0.95 * (law.brace_length - law.rest_half_width)
    # F s = K (2D)^2 / 2 with F = 4 K A.
    travel = (x - law.rest_half_width) ** 2 / (2 * law.force_constant)
    assert RollerPath(law, x).travel(x) == pytest.approx(travel, rel=1e-9, abs=1e-16)
    assert law.position(travel) == pytest.approx(x, rel=1e-12)


@FAST
@given(laws(), st.floats(0.01, 2))
def test_reach_ends_at_the_travel_asked_for_or_says_how_far_it_comes(law, travel):
    travel *= law.brace_length
    path, end = reach(law, travel)
    assert law.rest_half_width <= end <= law.vertical_at
    reached = path.travel(end)
    rounding = 1e-12 * travel + 4e-16 * end * law.slope(end)  # of x, on a steep path
    assert reached <= travel + rounding
    if reached < travel - rounding:
        beyond = np.linspace(end, law.vertical_at - 1e-12 * law.brace_length, 5)[1:-1]
        rising = law.slope(beyond) > brace_tangent(beyond, law.brace_length)
        near_limit = law.vertical_at - end < 1e-8 * law.brace_length
        assert near_limit or not rising[0]


@FAST
@given(laws(), st.floats(0.5, 4))
def test_longer_parts_make_a_longer_path_of_the_same_shape(law, scale):
    x = places(law)
    larger = SlopeLaw(
        law.force_constant * scale,
        law.rest_half_width * scale,
        law.brace_length * scale,
        law.friction,
        law.slope_factor,
    )
    heights = RollerPath(larger, x[-1] * scale).height(x * scale)
    np.testing.assert_allclose(heights, scale * RollerPath(law, x[-1]).height(x), rtol=1e-10, atol=1e-15)


def test_a_number_and_an_array_give_the_same_height():
    for friction in (0.0, 0.002):
        path = RollerPath(SlopeLaw(0.009, 0.068, 0.2, friction), 0.14)
        x = np.linspace(0.068, 0.14, 23)
        np.testing.assert_allclose([path.height(float(at)) for at in x], path.height(x), rtol=1e-14, atol=1e-18)


def test_the_height_of_a_path_that_turns_vertical_is_accurate_up_to_the_end():
    """There the slope grows like 1/(x_v - x): the height by the substitution u = ln(x_v - x)."""
    law = SlopeLaw(0.009, 0.068, 0.2, 0.2)
    end = law.vertical_at - 1e-7 * (law.vertical_at - law.rest_half_width)
    low, high = math.log(law.vertical_at - end), math.log(law.vertical_at - law.rest_half_width)

    def by_log(u):
        return law.slope(law.vertical_at - math.exp(u)) * math.exp(u)

    expected = quad(by_log, low, high, epsabs=0, epsrel=1e-11, limit=400)[0]
    assert RollerPath(law, end).height(end) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("friction", [1e-300, 1e-20, 1e-12, 1e-6])
def test_a_trace_of_friction_is_no_trouble(friction):
    law = SlopeLaw(0.009058, 0.068, 0.2, friction)
    assert law.vertical_at == pytest.approx(0.2, rel=1e-9)
    path, end = reach(law, 0.24)
    assert path.travel(end) == pytest.approx(0.24, rel=1e-12)
    assert end == pytest.approx(0.13393815284, rel=1e-4)


def test_a_path_cut_for_much_friction_on_the_way_down_ends_where_the_slider_would_fall():
    law = SlopeLaw(0.02, 0.06, 0.2, -0.2)
    path, end = reach(law, 10.0)
    x = np.linspace(0.06, 0.2 * (1 - 1e-9), 100_001)
    assert path.travel(end) == pytest.approx(RollerPath(law, x[-1]).travel(x).max(), rel=1e-8)


@pytest.mark.parametrize("stroke", [1.1321e-3, 2e-3])
def test_a_path_that_weights_help_ends_at_the_stroke_or_where_the_slider_would_fall(stroke):
    law = SlopeLaw(0.03435, 0.05973, 0.1, slope_factor=0.7526)
    path, end = reach(law, stroke)
    x = np.linspace(0.05973, 0.1 * (1 - 1e-9), 100_001)
    highest = path.travel(x).max()
    assert highest == pytest.approx(1.514e-3, rel=1e-3)
    assert path.travel(end) == pytest.approx(min(stroke, highest), rel=1e-8)
    assert end <= x[np.argmax(path.travel(x))] * (1 + 1e-5)


def test_a_path_on_which_the_slider_never_rises_has_no_length():
    law = SlopeLaw(2.0, 0.1, 0.2, -0.4)
    assert law.slope(0.1) > 0
    assert reach(law, 0.1)[1] == 0.1


@FAST
@given(st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_the_drop_of_the_brace_is_the_difference_of_its_heights(first, second):
    expected = math.sqrt(1 - second**2) - math.sqrt(1 - first**2)
    assert drop(second, first, 1.0) == pytest.approx(expected, abs=1e-14)


def test_the_drop_of_the_brace_does_not_cancel():
    # d/dx sqrt(1 - x^2) = -x / sqrt(1 - x^2) = -0.75 at 0.6
    assert drop(0.6 + 1e-12, 0.6, 1.0) == pytest.approx(-0.75e-12, rel=1e-3)

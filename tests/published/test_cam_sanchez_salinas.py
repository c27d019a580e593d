"""What Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819 print about their cam mechanism.

Tolerances are half a unit of the last printed digit unless a test says why not.
"""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import MM, analyze, at, cam, design, fixed
from hypothesis import given, settings
from hypothesis import strategies as st

from cfmkit.families.cam.geometry import SlopeLaw

TABLE_2 = (0.683, 0.682, 0.681, 0.686, 0.686, 0.679)
"""Measured stiffness of springs 1 to 6 [N/mm]."""


def springs(count):
    return tuple(value * 1e3 for value in TABLE_2[:count])


def loop_area(spec):
    """Return the area of the loop between 40 and 210 mm [N m], as in the text of sec. 3."""
    curve = analyze(spec.replace({"analysis.travel": 240 * MM, "analysis.points": 2401})).curve
    half = len(curve) // 2
    inside = slice(400, 2101)
    up, down = curve.force[:half][inside], curve.force[half:][::-1][inside]
    return np.trapezoid(up - down, curve.motion[:half][inside])


# --- sec. 2.1: equations ----------------------------------------------------------------------------------

frictions = st.floats(-0.05, 0.2)


@settings(deadline=None)
@given(share=st.floats(0, 1), friction=frictions)
def test_the_path_satisfies_equations_2_and_3(share, friction):
    constant, x0, brace = 9.058, 68.0, 200.0
    x = x0 + share * 70
    f = (x - x0) / constant + x / brace * (1 - (x / brace) ** 2) ** -0.5
    law = SlopeLaw(constant, x0, brace, friction)
    assert 1 / law.slope(x) == pytest.approx((1 - friction * f) / (friction + f), rel=1e-12, abs=1e-13)


@settings(deadline=None, max_examples=40)
@given(travel=st.floats(0.0012, 0.24), friction=st.floats(0, 0.01), cut_for=st.floats(1e-9, 0.01))
def test_the_force_on_the_way_up_is_that_of_equation_1(travel, friction, cut_for):
    found = at(cam(profile__friction=cut_for), travel + 0.001, friction)
    x, tan_beta = found.x[0], 1 / found.slope[0]
    tan_alpha = x / np.sqrt(0.2**2 - x**2)
    # Delta x is half the elongation: only so does F = 4KA hold with the A of Table 1.
    force = 4 * 1365 * (x - 0.068) / ((1 - friction * tan_beta) / (tan_beta + friction) - tan_alpha)
    assert found.force[0] == pytest.approx(force, rel=1e-9)


# --- Tables 1 and 3, forces ----------------------------------------------------------------------------------


def test_the_design_targets_give_the_force_constant_of_table_1():
    targets = {"force": 50.0, "stroke": 0.24}
    spec = cam(springs={"stiffness": 690.0, "count": 2}).replace({"design": targets})
    found = design(spec).spec
    assert found is not None
    assert found.get_value("mechanism.profile.force_constant") / MM == pytest.approx(9.058, abs=0.0005)


@pytest.mark.parametrize(("count", "force"), [(2, 50), (4, 100), (6, 150)])
def test_two_four_and_six_springs_give_the_forces_of_table_1(count, force):
    spec = cam(springs={"stiffness": 690.0, "count": count})
    assert at(spec, 0.12).force[0] == pytest.approx(force, abs=0.5)


@pytest.mark.parametrize(("count", "stiffness", "digits"), [(2, 1.365, 3), (4, 2.732, 3), (6, 4.097, 3)])
def test_the_measured_springs_of_table_2_add_up_to_the_stiffness_of_table_3(count, stiffness, digits):
    spec = cam(springs=springs(count))
    assert spec.mechanism.springs.total / 1e3 == pytest.approx(stiffness, abs=0.5 * 10**-digits)


@pytest.mark.parametrize(("count", "force", "digits"), [(2, 49.46, 2), (4, 98.99, 2), (6, 148.4, 1)])
def test_the_theoretical_forces_are_those_of_table_3(count, force, digits):
    result = analyze(cam(springs=springs(count)))
    theory = result.values["theoretical_force"].value
    assert theory == pytest.approx(force, abs=0.5 * 10**-digits)
    on_flank = result.curve.extra["contact"].values == "flank"
    np.testing.assert_allclose(result.curve.force[on_flank], theory, rtol=1e-9)


@pytest.mark.parametrize(("count", "up", "down"), [(2, 49.67, 48.27), (4, 98.94, 96.62), (6, 148.27, 144.17)])
def test_the_measured_mean_forces_of_table_3_are_within_2_percent(count, up, down):
    """2 %: the measured means lie 1 to 1.5 % below theory on both ways, which the paper does not explain."""
    spec = cam(springs=springs(count), rolling_friction=0.002)
    travel = np.linspace(2, 240, 2381) * MM
    means = [at(spec, travel, mu).force.mean() for mu in (0.002, -0.002)]
    np.testing.assert_allclose(means, (up, down), rtol=0.02)


# --- sec. 3: the loop --------------------------------------------------------------------------------------------


def test_the_loop_area_for_a_friction_of_0_002_is_that_of_fig_9():
    assert loop_area(cam(rolling_friction=0.002, springs={"stiffness": 1380.0})) == pytest.approx(0.233, abs=0.0005)


def test_the_loop_area_with_springs_of_136_5_mm_is_that_of_fig_10():
    spec = fixed(cam(rolling_friction=0.002, springs={"stiffness": 1380.0}), rest_half_width=68.25 * MM)
    assert loop_area(spec) == pytest.approx(0.232, abs=0.0005)


def test_the_loop_area_for_a_friction_of_0_004_contradicts_the_one_for_0_002():
    """The text prints 0.410 N m for mu = 0.004: 12 % below the model, whatever the stiffness.

    The area is proportional to mu. With the printed 0.233 for 0.002 it must be 0.466; the
    printed ratio of 1.76 fits no stiffness and no definition of mu.
    """
    ratio = [
        loop_area(cam(rolling_friction=0.004, springs={"stiffness": k}))
        / loop_area(cam(rolling_friction=0.002, springs={"stiffness": k}))
        for k in (1365.0, 1380.0, 4097.0)
    ]
    np.testing.assert_allclose(ratio, 2, rtol=1e-4)
    printed = 0.410 / 0.233
    assert printed == pytest.approx(1.76, abs=0.005)


def test_longer_springs_lower_the_force_most_at_the_start_as_in_fig_10():
    spec = cam(rolling_friction=0.002)
    travel = np.array([5, 10, 40, 210]) * MM
    ratio = at(fixed(spec, rest_half_width=68.25 * MM), travel).force / at(spec, travel).force
    assert (np.diff(ratio) > 0).all()
    assert ratio[0] < 0.98
    assert ratio[-1] > 0.995


@pytest.mark.parametrize("stroke", [240, 250])
def test_the_strokes_of_table_1_and_of_the_text_are_both_within_reach(stroke):
    result = analyze(cam(profile__stroke=stroke * MM, springs={"stiffness": 690.0, "count": 2}))
    assert result.status.key == "complete"
    assert result.curve.motion.max() == pytest.approx(stroke * MM)
    assert result.curve.force[len(result.curve) // 2] == pytest.approx(50, abs=0.5)

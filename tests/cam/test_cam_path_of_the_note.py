"""Roller paths and cams of the published design to the digits of the reference note (lengths in mm)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cam_support import MM, at, cam

from cfmkit.families.cam.geometry.flank_from_roller_path import cut_cam
from cfmkit.families.cam.geometry.path import RollerPath, reach
from cfmkit.families.cam.geometry.slope_law import SlopeLaw

X0, BRACE, A, ROLLER = 68 * MM, 200 * MM, 9.058 * MM, 16 * MM
DIGITS = 0.51e-8 * MM
"""Half a unit of the eighth decimal of a millimetre."""

METHODS = pytest.mark.parametrize("method", ["quadrature", "ode"])

# friction the profile is cut for: rows of x, y, s [mm]
TABLE = {
    0.0: (
        (68, 0, 0),
        (70, 0.95594647, 0.22079929),
        (80, 12.73083389, 7.94877456),
        (90, 36.19609064, 26.71671451),
        (100, 71.40462549, 56.52461912),
        (120, 177.34540950, 149.26032237),
        (140, 331.41240286, 286.15588430),
    ),
    0.002: (
        (68, 0, 0),
        (70, 0.96088314, 0.22573596),
        (80, 12.78589791, 8.00383858),
        (90, 36.38421152, 26.90483539),
        (100, 71.86493464, 56.98492827),
        (120, 179.00000826, 150.91492114),
        (140, 335.53917953, 290.28266097),
    ),
    0.004: (
        (68, 0, 0),
        (70, 0.96582933, 0.23068215),
        (80, 12.84123045, 8.05917112),
        (90, 36.57390598, 27.09452985),
        (100, 72.33077368, 57.45076731),
        (120, 180.68684868, 152.60176155),
        (140, 339.77814842, 294.52162986),
    ),
}
X_AT_HEIGHT = {
    50: {0.0: 94.33109280, 0.002: 94.24862022, 0.004: 94.16633628},
    150: {0.0: 115.60883889, 0.002: 115.39297530, 0.004: 115.17770040},
    250: {0.0: 130.22215610, 0.002: 129.87397966, 0.004: 129.52690191},
}


def law(friction: float = 0.0, force_constant: float = A) -> SlopeLaw:
    return SlopeLaw(force_constant, X0, BRACE, friction)


@METHODS
@pytest.mark.parametrize("friction", TABLE)
def test_the_path_has_the_heights_and_travels_of_the_table(method, friction):
    x, y, s = MM * np.array(TABLE[friction]).T
    path = RollerPath(law(friction), 140 * MM, method)
    np.testing.assert_allclose(path.height(x), y, rtol=0, atol=DIGITS)
    np.testing.assert_allclose(path.travel(x), s, rtol=0, atol=DIGITS)


def test_the_slope_from_the_vertical_is_that_of_the_table():
    x = MM * np.array([68, 70, 80, 90, 100, 120, 140])
    printed = [2.76595716, 1.68227919, 0.56778452, 0.34098324, 0.24330078, 0.15406465, 0.11199499]
    np.testing.assert_allclose(1 / law().slope(x), printed, rtol=0, atol=0.51e-8)


@pytest.mark.parametrize("height", X_AT_HEIGHT)
@pytest.mark.parametrize("friction", TABLE)
def test_the_path_passes_the_tabulated_points_by_height(height, friction):
    x = X_AT_HEIGHT[height][friction] * MM
    path = RollerPath(law(friction), 140 * MM)
    # The tabulated x is rounded: the height may be off by that rounding times the slope.
    assert path.height(x) == pytest.approx(height * MM, abs=DIGITS * law(friction).slope(x))


@pytest.mark.parametrize(
    ("x", "point", "radius", "digits"),
    [
        (80, (66.08632136, 20.63080520), 55.070659, 6),
        (100, (84.45352378, 75.18709522), 624.903, 3),
        (120, (104.18657247, 179.78169967), 2341.186, 3),
        (133.93815284, (118.05635081, 281.49829977), 4550.821, 3),
    ],
)
def test_the_cam_has_the_tabulated_points_and_radii_of_curvature(x, point, radius, digits):
    profile = cut_cam(RollerPath(law(), 140 * MM), ROLLER, 140 * MM)
    # The last x is rounded to 1e-8 mm, which the slope of 8 turns into 4e-8 mm of height.
    np.testing.assert_allclose(profile.flank(x * MM), MM * np.array(point), rtol=0, atol=8 * DIGITS)
    assert (law().curvature_radius(x * MM) - ROLLER) / MM == pytest.approx(radius, abs=0.51 * 10**-digits)


def test_the_published_roller_is_larger_than_the_radius_of_curvature_at_the_start():
    radius = law().curvature_radius(X0)
    cos3 = (1 - (X0 / BRACE) ** 2) ** 1.5
    assert radius / MM == pytest.approx(10.32836569, abs=0.51e-8)
    assert radius == pytest.approx(1 / (cos3 / A + 1 / BRACE), rel=1e-14)


def test_the_undercut_cam_begins_at_the_tabulated_corner():
    path, end = reach(law(), 240 * MM)
    profile = cut_cam(path, ROLLER, end)
    assert profile.corner is not None
    np.testing.assert_allclose(profile.corner.point, MM * np.array([61.90084727, 14.79190103]), rtol=0, atol=DIGITS)
    assert profile.corner.cusp / MM == pytest.approx(71.05622211, abs=0.51e-8)
    assert path.travel(profile.corner.cusp) / MM == pytest.approx(0.51559360, abs=0.51e-8)
    assert profile.corner.first_contact / MM == pytest.approx(72.54386863, abs=0.51e-8)
    assert path.travel(profile.corner.first_contact) / MM == pytest.approx(1.13969652, abs=0.51e-8)


def test_on_the_corner_the_force_overshoots_to_the_tabulated_peak():
    travel = MM * np.array([0, 0.47770, 1.13969652, 1.2])
    force = at(cam(), travel).force / (4 * 1365 * A)
    assert force[0] == 0
    assert force[1] == pytest.approx(1.063265, abs=0.51e-6)
    np.testing.assert_allclose(force[2:], 1, rtol=0, atol=1e-8)
    dense = at(cam(), np.linspace(0.3, 0.7, 4001) * MM).force
    assert np.argmax(dense) * 1e-4 + 0.3 == pytest.approx(0.47770, abs=1e-4)


def test_the_smallest_force_constant_without_undercut_has_its_closed_form():
    smallest = law().smallest_force_constant(ROLLER)
    assert smallest is not None
    cos3 = (1 - (X0 / BRACE) ** 2) ** 1.5
    assert smallest / MM == pytest.approx(14.46456, abs=0.51e-5)
    assert smallest == pytest.approx(cos3 / (1 / ROLLER - 1 / BRACE), rel=1e-13)
    assert law(0.0, smallest).curvature_radius(X0) == pytest.approx(ROLLER, rel=1e-13)


@METHODS
@pytest.mark.parametrize(
    ("stroke", "x", "y", "elongation", "angle"),
    [
        (240, 133.93815284, 279.55707222, 131.876, 42.043),
        (250, 135.29784543, 290.79458159, 134.596, 42.570),
    ],
)
def test_a_stroke_ends_at_the_tabulated_place(method, stroke, x, y, elongation, angle):
    path, end = reach(law(), stroke * MM, method)
    assert end / MM == pytest.approx(x, abs=0.51e-8)
    assert path.height(end) / MM == pytest.approx(y, abs=0.51e-8)
    assert 2 * (end - X0) / MM == pytest.approx(elongation, abs=0.51e-3)
    assert math.degrees(math.asin(end / BRACE)) == pytest.approx(angle, abs=0.51e-3)


@pytest.mark.parametrize(("stroke", "height"), [(240, 266.7), (250, 277.9)])
def test_the_cam_has_the_tabulated_height(stroke, height):
    path, end = reach(law(), stroke * MM)
    profile = cut_cam(path, ROLLER, end)
    bottom, top = (profile.flank(x)[1] for x in (profile.start, end))
    assert (top - bottom) / MM == pytest.approx(height, abs=0.051)


def test_the_brace_turns_horizontal_after_the_tabulated_travel():
    path, end = reach(law(), 1.0)
    assert path.travel(BRACE) / MM == pytest.approx(961.80172, abs=0.51e-5)
    # The path stops just short of the singular point.
    assert end / MM == pytest.approx(200, abs=1e-6)


@pytest.mark.parametrize(("friction", "x"), [(0.002, 199.99957562), (0.004, 199.99819582)])
def test_a_profile_cut_for_friction_turns_vertical_at_the_tabulated_place(friction, x):
    assert law(friction).vertical_at / MM == pytest.approx(x, abs=0.51e-8)
    assert friction * law(friction).frictionless(law(friction).vertical_at) == pytest.approx(1, abs=1e-9)

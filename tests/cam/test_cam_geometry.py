"""Roller paths against integrals of scipy; cam and roller track against a cam of points and contact found by search."""

from __future__ import annotations

import math
from dataclasses import replace

import cam_oracles
import numpy as np
import pytest
from cam_support import MM, cam, fixed
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from cfmkit.families import CannotBuild
from cfmkit.families.cam.geometry.flank_from_roller_path import WholeCamUndercut, cut_cam
from cfmkit.families.cam.geometry.path import RollerPath, reach
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import NoTrack, Track, track_of
from cfmkit.families.cam.geometry.slope_law import SlopeLaw, brace_tangent, drop
from cfmkit.families.cam.mechanism_from_spec import assemble

SLOW = settings(deadline=None, max_examples=25)
FAST = settings(deadline=None, max_examples=200)


@st.composite
def laws(draw, frictions=(0.0, 0.002, 0.05, 0.3), factors=(1.0, 1.4), least_slope=-np.inf):
    """Draw slope laws of all proportions, with a length of the size of the brace."""
    brace = draw(st.floats(0.05, 0.5))
    sizes = brace * draw(st.floats(0.01, 1.0)), brace * draw(st.floats(0.1, 0.7)), brace
    law = SlopeLaw(*sizes, draw(st.sampled_from(frictions)), draw(st.sampled_from(factors)))
    assume(law.slope(law.rest_half_width) > least_slope)
    return law


RISING = laws((0.0, 0.002, 0.05, 0.3, -0.002, -0.05), least_slope=0.02)


def point_cam(law, end, radius):
    x, y = cam_oracles.path_points(
        law.force_constant, law.rest_half_width, law.brace_length, end, friction=law.friction, factor=law.slope_factor
    )
    slopes = cam_oracles.slope(
        x, law.force_constant, law.rest_half_width, law.brace_length, law.friction, law.slope_factor
    )
    return cam_oracles.cut(x, y, slopes, radius)


@SLOW
@given(laws(), st.floats(0.3, 1.2), st.floats(0.01, 0.3))
def test_the_corner_is_where_the_cam_of_points_begins(law, stroke, radius):
    path, end = reach(law, stroke * law.brace_length)
    radius *= law.brace_length
    try:
        profile = cut_cam(path, radius, end)
    except WholeCamUndercut:
        assume(False)
    assume(end - profile.start > 0.2 * (end - law.rest_half_width) and law.slope(end) < 50)
    points, corner = point_cam(law, end, radius)
    assert (corner is None) == (profile.corner is None)
    if profile.corner:
        np.testing.assert_allclose(profile.corner.point, corner, rtol=0, atol=2e-7 * law.brace_length)
    on_flank = np.array(profile.flank(np.linspace(profile.start, end, 7))).T
    assert max(points.reach(place) for place in on_flank) < 1e-7 * law.brace_length


@st.composite
def variants(draw):
    """Draw the published cam, or one without undercut, with other parts around it."""
    spec = cam(profile__force_constant=draw(st.sampled_from([9.058 * MM, 15 * MM])))
    return fixed(
        spec,
        brace_length=draw(st.floats(190, 230)) * MM,
        roller_radius=draw(st.floats(10, 24)) * MM,
        rest_half_width=draw(st.floats(66, 70)) * MM,
        profile__offset=draw(st.sampled_from([0.0, 0.3, -0.3])) * MM,
    )


_CAMS = {}


def published_points(constant, radius):
    """Return the cam of points of the published path, cut for a roller."""
    if (constant, radius) not in _CAMS:
        law = SlopeLaw(constant, 68 * MM, 200 * MM)
        _CAMS[constant, radius], _ = point_cam(law, reach(law, 240 * MM)[1], radius)
    return _CAMS[constant, radius]


@SLOW
@given(variants(), st.floats(0, 1), st.booleans())
def test_the_roller_is_where_the_search_finds_its_first_touch(spec, share, near_start):
    try:
        assembly = assemble(spec)
    except CannotBuild:
        assume(False)
    track, offset = assembly.track, spec.mechanism.profile.offset
    travel = share * (3 * MM if near_start else track.end - track.start)
    states = track.states(np.array([track.start + travel]))
    # Where the slider has next to no lever (a dead point) the touch is a tangency that no search resolves.
    lever = states.slope[0] - brace_tangent(states.x[0], spec.mechanism.brace_length)
    assume(lever > 0.02)
    # Missing material is a cam cut with a larger tool; material left on keeps the roller at a distance.
    points = published_points(spec.mechanism.profile.force_constant, 16 * MM - min(offset, 0))
    x, y = points.roller(
        track.start + travel, spec.mechanism.brace_length, spec.mechanism.roller_radius + max(offset, 0)
    )
    tolerance = 3e-9 * max(1.0, 0.1 / lever)
    assert states.x[0] == pytest.approx(x, abs=tolerance)
    assert states.y[0] == pytest.approx(y, abs=10 * tolerance)


@SLOW
@given(variants(), st.floats(0.01, 0.99))
def test_slope_and_bend_of_the_track_are_its_derivatives(spec, share):
    try:
        track = assemble(spec).track
    except CannotBuild:
        assume(False)
    for low, high in ((track.start, track.corner_end), (track.corner_end, track.end)):
        if high - low < 0.1 * MM:
            continue
        middle = low + share * (high - low)
        step = 1e-3 * min(middle - low, high - middle)
        states = track.states(middle + step * np.array([-1.0, 0.0, 1.0]))
        slope = np.diff(states.y[::2])[0] / np.diff(states.x[::2])[0]
        bend = np.diff(states.slope[::2])[0] / np.diff(states.x[::2])[0]
        assert states.slope[1] == pytest.approx(slope, rel=1e-4)
        assert states.bend[1] == pytest.approx(bend, rel=1e-3)


def test_the_roller_passes_from_corner_to_flank_without_a_jump():
    track = assemble(cam()).track
    states = track.states(track.corner_end * np.array([1 - 1e-12, 1]))
    assert states.on_corner.tolist() == [True, False]
    for values, tolerance in ((states.x, 1e-9), (states.y, 1e-9), (states.slope, 1e-8)):
        assert values[0] == pytest.approx(values[1], rel=tolerance)


@FAST
@given(laws(), st.floats(0, 1))
def test_a_path_cut_for_no_friction_or_for_the_way_up_is_curved_most_at_its_start(law, share):
    x = law.rest_half_width + share * (law.vertical_at * (1 - 1e-9) - law.rest_half_width)
    assert law.curvature_radius(x) >= law.curvature_radius(law.rest_half_width) * (1 - 1e-9)


def test_a_path_cut_for_the_way_down_may_be_curved_most_at_its_end():
    law = SlopeLaw(0.2, 0.06, 0.2, friction=-0.3)
    assert law.curvature_radius(0.1999) < 0.3 * law.curvature_radius(0.06)


@FAST
@given(laws((-0.002, -0.05, -0.3, -0.1)))
def test_where_the_slider_rises_no_path_is_curved_more_tightly_than_at_its_start(law):
    """Up to 1e-3, for a path cut for the way down; rollers are smaller than the brace."""
    assume(law.slope(law.rest_half_width) > 0)
    _, end = reach(law, 100 * law.brace_length)
    radius = law.curvature_radius(np.linspace(law.rest_half_width, end, 501))
    tightest = min(law.curvature_radius(law.rest_half_width), law.brace_length)
    assert radius.min() >= tightest * (1 - 1e-3)


@SLOW
@given(laws((0.0, 0.002, 0.05, -0.002)), st.floats(0.05, 1.4), st.floats(0.0, 0.9), st.floats(0.1, 0.99))
def test_the_tightest_place_of_any_path_is_found(law, factor, stretched, share):
    law = replace(law, slope_factor=factor, preload=stretched * law.rest_half_width)
    start = law.rest_half_width
    assume(law.frictionless(start) + law.friction > 0 and law.vertical_at > start * (1 + 1e-9))
    end = start + share * (law.vertical_at - start)
    place, radius = law.tightest(end)
    assert radius == pytest.approx(law.curvature_radius(np.linspace(start, end, 4001)).min(), rel=1e-5)
    assert radius == law.curvature_radius(place)
    assert start <= place <= end


def test_a_path_that_weights_help_is_curved_most_behind_its_start():
    law = SlopeLaw(200 * MM, 20 * MM, 100 * MM, slope_factor=0.3)
    assert law.curvature_radius(20 * MM) == pytest.approx(214.4457 * MM, rel=1e-6)
    assert law.tightest(60 * MM) == (60 * MM, pytest.approx(152.7683 * MM, rel=1e-6))
    assert law.tightest(80 * MM) == (80 * MM, pytest.approx(89.7383 * MM, rel=1e-6))


@FAST
@given(laws(), st.floats(0.01, 0.5))
def test_the_smallest_force_constant_is_just_large_enough(law, radius):
    radius *= law.brace_length
    smallest = law.smallest_force_constant(radius)
    if smallest is None:
        flat = SlopeLaw(1e9, law.rest_half_width, law.brace_length, law.friction, law.slope_factor)
        assert flat.curvature_radius(flat.rest_half_width) <= radius * (1 + 1e-6)
        return
    for factor, fits in ((1 - 1e-9, False), (1 + 1e-9, True)):
        trial = SlopeLaw(factor * smallest, law.rest_half_width, law.brace_length, law.friction, law.slope_factor)
        assert (trial.curvature_radius(law.rest_half_width) > radius) == fits


@FAST
@given(laws((0.0, 0.002, 0.05, -0.002)), st.floats(0.1, 0.9))
def test_slope_derivative_and_curvature_are_derivatives_of_the_slope(law, share):
    assume(law.slope(law.rest_half_width) > 0)
    limit = min(law.vertical_at, 0.98 * law.brace_length)
    x = law.rest_half_width + share * 0.9 * (limit - law.rest_half_width)
    rate = law.slope(x + 1e-30j).imag / 1e-30
    assert law.slopes(x) == (pytest.approx(law.slope(x), rel=4e-16), pytest.approx(rate, rel=1e-9))
    assert law.curvature_radius(x) == pytest.approx((1 + law.slope(x) ** 2) ** 1.5 / rate, rel=1e-9)


def test_a_roller_larger_than_every_radius_of_the_path_leaves_no_cam():
    path, end = reach(SlopeLaw(9.058 * MM, 68 * MM, 200 * MM), 1.0 * MM)
    with pytest.raises(WholeCamUndercut):
        cut_cam(path, 16 * MM, end)


def test_a_track_that_starts_beyond_the_brace_does_not_exist():
    path, end = reach(SlopeLaw(15 * MM, 68 * MM, 200 * MM), 0.2)
    with pytest.raises(NoTrack, match="brace"):
        Track(cut_cam(path, 10 * MM, end), 60 * MM, 70 * MM)


def test_a_track_on_which_the_slider_never_rises_does_not_exist():
    path, end = reach(SlopeLaw(9.058 * MM, 68 * MM, 200 * MM), 0.1 * MM)
    with pytest.raises(NoTrack, match="dead"):
        Track(cut_cam(path, 5 * MM, end), 5 * MM, 100 * MM)


def test_the_track_ends_where_the_slider_would_turn_back():
    path, end = reach(SlopeLaw(9.058 * MM, 68 * MM, 200 * MM), 0.7)
    track = Track(cut_cam(path, 10 * MM, end), 10 * MM, 170 * MM)
    assert track.turns_back
    last = track.states(np.array([track.end])).x[0]
    assert last < end - 1 * MM
    x = np.linspace(68 * MM, min(end, 170 * MM * (1 - 1e-9)), 200001)
    slider = path.height(x) + np.sqrt(0.17**2 - x**2)
    assert track.end == pytest.approx(slider.max(), abs=1e-9)
    assert track.dead_point == pytest.approx(slider[: len(x) // 2].min(), abs=1e-9)
    assert math.isclose(x[np.argmax(slider)], last, abs_tol=1e-5)


def test_a_dead_point_on_the_corner_is_where_brace_and_roller_are_in_line():
    track = assemble(fixed(cam(), brace_length="165 mm")).track
    (xc, yc), turn = track.profile.corner.point, np.linspace(0.2, 0.8, 200_001)
    x, y = xc + 16 * MM * np.sin(turn), yc - 16 * MM * np.cos(turn)
    slider = y + np.sqrt(0.165**2 - x**2)
    assert track.dead_point == pytest.approx(slider.min(), abs=1e-12)
    assert track.dead_point < track.start - 1e-6
    first, last = (part for part in track.stretches())
    assert first.on_corner
    assert not last.on_corner
    # The stretch begins at the slider's start position, on the far side of the dead point.
    assert first.at(first.low)[0] == pytest.approx(track.start, abs=1e-12)
    assert first.low > turn[np.argmin(slider)]


def test_tracks_side_by_side_have_the_states_of_each():
    profile = assemble(cam()).track.profile
    radius, brace = profile.roller_radius + np.linspace(-5e-5, 5e-5, 8), np.linspace(0.1998, 0.2002, 8)
    tracks = [Track(profile, *numbers) for numbers in zip(radius.tolist(), brace.tolist(), strict=True)]
    together = track_of(profile, radius[:, None], brace[:, None])
    slider = together.start + np.linspace(0.0, 0.23, 60)
    for some in (np.arange(8), np.array([5, 2])):
        found = together.select_rows(some).states(slider[some])
        for row, track in enumerate(some):
            alone = tracks[track].states(slider[track])
            for one, own in zip((*found.fields(), found.bend), (*alone.fields(), alone.bend), strict=True):
                np.testing.assert_allclose(one[row], own, rtol=1e-14)


# --- the roller path --------------------------------------------------------------------------------------


def places(law, count=9, most=0.95):
    """Return path coordinates from x0 to a part of the way to where the path must end."""
    span = min(law.vertical_at, 0.98 * law.brace_length) - law.rest_half_width
    return law.rest_half_width + span * np.linspace(0, most, count)


@SLOW
@given(RISING)
def test_quadrature_and_ode_agree_to_1e_9(law):
    x = places(law)
    by_quadrature, by_ode = RollerPath(law, x[-1]).height(x), RollerPath(law, x[-1], "ode").height(x)
    np.testing.assert_allclose(by_ode, by_quadrature, rtol=1e-9, atol=1e-12 * law.brace_length)


@FAST
@given(RISING)
def test_the_height_is_the_integral_of_the_slope(law):
    x = places(law, 3)
    expected = [quad(law.slope, x[0], at, epsabs=0, epsrel=1e-12, limit=200)[0] for at in x[1:]]
    np.testing.assert_allclose(RollerPath(law, x[-1]).height(x[1:]), expected, rtol=1e-10)


@FAST
@given(laws((0.0,), (1.0,), 0.02), st.floats(0, 1))
def test_without_friction_force_times_travel_is_the_energy_of_the_springs(law, share):
    x = law.rest_half_width + share * 0.95 * (law.brace_length - law.rest_half_width)
    # F s = K (2D)^2 / 2 with F = 4 K A.
    travel = (x - law.rest_half_width) ** 2 / (2 * law.force_constant)
    assert RollerPath(law, x).travel(x) == pytest.approx(travel, rel=1e-9, abs=1e-16)
    assert law.position(travel) == pytest.approx(x, rel=1e-12)


@FAST
@given(RISING, st.floats(0.01, 2))
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

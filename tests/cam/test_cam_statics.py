"""Forces of the cam mechanism against free bodies and energy."""

from __future__ import annotations

import cam_oracles
import numpy as np
import pytest
from cam_support import MM, analyze, at, cam, fixed
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cfmkit.families import CannotBuild
from cfmkit.families.cam.mechanism_from_spec import assemble, weights_of
from cfmkit.families.cam.statics import STANDARD_GRAVITY

SLOW = settings(deadline=None, max_examples=60)


@st.composite
def mechanisms(draw, frictions=(0.0, 0.002, 0.02, 0.2)):
    """Draw a cam mechanism that can be built; half of them run on a cam cut for other parts."""
    brace = draw(st.floats(0.05, 0.5))
    x0 = brace * draw(st.floats(0.1, 0.7))
    gravity = draw(st.booleans())
    spec = cam(
        brace_length=brace,
        rest_half_width=x0,
        roller_radius=brace * draw(st.floats(0.01, 0.12)),
        springs={"stiffness": draw(st.floats(100, 5000)), "count": draw(st.integers(1, 6))},
        rolling_friction=draw(st.sampled_from(frictions)),
        profile__force_constant=brace * draw(st.floats(0.02, 0.3)),
        profile__friction=draw(st.sampled_from([0.0, 0.002, 0.05, -0.002, -0.05])),
        profile__slope_factor=draw(st.sampled_from([1.0, 1.3])),
        profile__stroke=brace * draw(st.floats(0.3, 1.5)),
        analysis__gravity=gravity,
        analysis__points=41,
    )
    if draw(st.booleans()):
        spec = fixed(
            spec,
            brace_length=brace * draw(st.floats(0.97, 1.1)),
            rest_half_width=x0 * draw(st.floats(0.95, 1.05)),
            roller_radius=spec.mechanism.roller_radius * draw(st.floats(0.5, 1.5)),
            profile__offset=brace * draw(st.sampled_from([-0.002, -0.0003, 0.0, 0.0005, 0.002])),
        )
    try:
        assembly = assemble(spec)
    except CannotBuild:
        assume(False)
    return spec, assembly


def travels(assembly, shares):
    return np.asarray(shares) * (assembly.track.end - assembly.track.start)


@SLOW
@given(mechanisms(), st.lists(st.floats(0.001, 0.999), min_size=4, max_size=4), st.booleans())
def test_forces_are_those_of_the_free_bodies(mechanism, shares, up):
    spec, assembly = mechanism
    mu = spec.mechanism.rolling_friction
    found = at(spec, travels(assembly, shares), mu if up else -mu)
    weights = weights_of(spec.mechanism).along if spec.gravity else (0.0, 0.0)
    for i, x in enumerate(found.x):
        spring = 2 * spec.mechanism.springs.total * max(x - spec.mechanism.rest_half_width, 0)
        expected = cam_oracles.free_bodies(
            x,
            found.slope[i],
            spec.mechanism.brace_length,
            spring=spring,
            radius=spec.mechanism.roller_radius,
            friction=mu,
            up=up,
            weights=weights,
        )
        got = found.force[i], found.contact[i], found.brace[i]
        if np.isnan(got[0]):  # a jam: the same equations ask for a contact that pulls
            assert expected[1] <= 0
        else:
            np.testing.assert_allclose(got, expected, rtol=1e-7, atol=1e-9 * abs(expected[1]))


@SLOW
@given(mechanisms(frictions=(0.0,)), st.floats(0.05, 0.9))
def test_without_friction_the_force_is_the_change_of_energy(mechanism, share):
    spec, assembly = mechanism
    low, high = travels(assembly, (share, share + 0.01))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    inside = at(spec, 0.5 * (low + high) + 0.5 * (high - low) * nodes)
    ends = at(spec, [low, high])
    corner = ends.on_corner[0] != ends.on_corner[1]
    assume(not corner and np.isfinite(inside.force).all())
    assume((inside.x > spec.mechanism.rest_half_width).all() or (inside.x < spec.mechanism.rest_half_width).all())
    work = 0.5 * (high - low) * weights @ inside.force
    stretch = np.maximum(2 * (ends.x - spec.mechanism.rest_half_width), 0)
    energy = 0.5 * spec.mechanism.springs.total * stretch**2
    if spec.gravity:
        masses = spec.mechanism.masses
        slider = ends.y + np.sqrt(spec.mechanism.brace_length**2 - ends.x**2)
        middle = 0.5 * (ends.y + slider)
        energy += STANDARD_GRAVITY * (2 * masses.roller * ends.y + 2 * masses.brace * middle + masses.slider * slider)
    assert work == pytest.approx(energy[1] - energy[0], rel=1e-6, abs=1e-9 * np.abs(energy).max())


@SLOW
@given(mechanisms(frictions=(0.002, 0.02)))
def test_the_area_of_the_loop_is_the_energy_that_rolling_loses(mechanism):
    """Lost: mu N along the path of both rollers, up and down."""
    spec, assembly = mechanism
    mu = spec.mechanism.rolling_friction
    low, high = travels(assembly, (0.4, 0.6))
    nodes, weights = np.polynomial.legendre.leggauss(64)
    travel, step = 0.5 * (low + high) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * weights
    up, down = at(spec, travel, mu), at(spec, travel, -mu)
    assume(np.isfinite(up.force).all() and not up.on_corner.any())
    area = step @ (up.force - down.force)
    # The path runs sqrt(1 + f^2) dx while the slider rises (f - tan a) dx.
    tangent = up.x / np.sqrt(spec.mechanism.brace_length**2 - up.x**2)
    along = np.hypot(1, up.slope) / (up.slope - tangent)
    lost = 2 * mu * step @ (along * (up.contact + down.contact))
    assert area == pytest.approx(lost, rel=1e-6, abs=1e-12)


def curve_of(spec):
    """Return the curve of a mechanism that can exist; what cannot has none, as other tests say."""
    result = analyze(spec)
    assume(result.status.usable)
    return result.curve


@SLOW
@given(mechanisms(frictions=(0.0,)))
def test_without_friction_both_ways_are_the_same(mechanism):
    curve = curve_of(mechanism[0])
    half = len(curve) // 2
    np.testing.assert_array_equal(curve.force[:half], curve.force[half:][::-1])


@SLOW
@given(mechanisms(), st.integers(2, 5))
def test_the_curve_does_not_depend_on_the_number_of_points(mechanism, factor):
    spec, _ = mechanism
    coarse = curve_of(spec)
    fine = curve_of(spec.replace({"analysis.points": 40 * factor + 1}))
    half, other = len(coarse) // 2, len(fine) // 2
    np.testing.assert_allclose(coarse.motion[:half], fine.motion[:other:factor], rtol=1e-12)
    steady = np.abs(coarse.force[:half]) < 1e3 * np.nanmedian(np.abs(coarse.force)) + 1e-9
    for a, b in ((coarse.force[:half], fine.force[:other]), (coarse.force[::-1][:half], fine.force[::-1][:other])):
        np.testing.assert_allclose(a[steady], b[::factor][steady], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("cut_for", [0.0, 0.002, -0.002])
@pytest.mark.parametrize("roller", ["16 mm", "10 mm"])
def test_the_papers_ode_and_the_quadrature_give_the_same_loop(cut_for, roller):
    spec = cam(profile__friction=cut_for, rolling_friction=0.002, roller_radius=roller)
    ours, papers = (analyze(spec.replace({"analysis.path_method": way})).curve for way in ("quadrature", "ode"))
    np.testing.assert_allclose(papers.motion, ours.motion, rtol=1e-12)
    np.testing.assert_allclose(papers.force[2:-2], ours.force[2:-2], rtol=1e-9)


def test_an_ideal_cam_starts_with_the_constant_force_although_its_springs_carry_nothing_there():
    spec = cam(roller_radius="10 mm")
    found = at(spec, [0.0, 1e-9, 1e-6])
    np.testing.assert_allclose(found.force, 4 * 1365 * 9.058 * MM, rtol=1e-6)
    assert found.x[0] == 68 * MM
    # The contact force too has its limit: the roller is held by the brace alone.
    assert found.contact[0] == pytest.approx(found.contact[1], rel=1e-3)


def test_a_cam_cut_for_the_friction_it_has_starts_with_the_constant_force_on_the_way_up():
    spec = cam(roller_radius="10 mm", profile__friction=0.01, rolling_friction=0.01)
    assert at(spec, 0.0).force[0] == pytest.approx(4 * 1365 * 9.058 * MM, rel=1e-12)


def test_with_much_friction_the_way_down_has_to_be_pushed():
    """Where 1 - mu f < 0 the contact normal is turned past horizontal: the springs no longer bring the rollers back."""
    spec = cam(rolling_friction=0.2)
    found = at(spec, np.array([50, 230]) * MM, -0.2)
    assert 0.2 * found.slope[0] < 1 < 0.2 * found.slope[1]
    assert found.force[0] > 0 > found.force[1]
    assert (found.contact > 0).all()


def test_the_force_down_is_continuous_where_the_contact_normal_is_horizontal():
    spec = cam(rolling_friction=0.2)
    travel = np.linspace(50, 230, 2001) * MM
    found = at(spec, travel, -0.2)
    crossing = np.flatnonzero(np.diff(np.sign(1 - 0.2 * found.slope)))
    assert crossing.size == 1
    assert np.abs(found.force[crossing[0] : crossing[0] + 2]).max() < 0.1
    assert np.abs(np.diff(found.force)).max() < 0.2

"""Arcs fitted to a smooth curve stay within the tolerance, touch, and depend on nothing but the curve."""

import pickle

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from cfmkit.errors import InputError
from cfmkit.numerics.arc_chains import ArcChain, CoarseDataError, biarc, fit_arcs

# Exact curves: a fraction in [0, 1] -> points and (not yet unit) tangents as x + iy.


def parabola(u):
    x = 0.2 * u - 0.1
    return x + 5j * x**2, 1 + 10j * x


def ellipse(u):
    a = 2 * np.pi * u
    return 0.1 * np.cos(a) + 0.02j * np.sin(a), -0.1 * np.sin(a) + 0.02j * np.cos(a)


def involute(u):
    a = 0.05 + 8 * u
    return 0.01 * (1 - 1j * a) * np.exp(1j * a), np.exp(1j * a)


def sine(u):
    x = 0.2 * u
    return x + 0.01j * np.sin(100 * x), 1 + 1j * np.cos(100 * x)


def straight(u):
    return 0.3 * u * (3 + 4j) / 5, np.full(len(u), (3 + 4j) / 5)


def logarithmic_spiral(u):
    """Curvature radius from 0.3 mm to 5 m."""
    b = 0.5
    a = np.log(5 / 0.0003) / b * u
    return 0.0003 / np.hypot(1, b) * np.exp((b + 1j) * a), (b + 1j) * np.exp(1j * a)


def flank(u, force_constant=0.00906, brace=0.2, rest=0.068, roller=0.010):
    """The parallel, at a roller's radius, of y = D^2 / 2A - sqrt(L^2 - x^2)."""
    x = rest + 0.066 * u**2
    slope = (x - rest) / force_constant + x / np.sqrt(brace**2 - x**2)
    y = (x - rest) ** 2 / (2 * force_constant) - np.sqrt(brace**2 - x**2)
    return x + 1j * y + 1j * roller * (1 + 1j * slope) / np.abs(1 + 1j * slope), 1 + 1j * slope


def rounded_corner(u):
    """Straight, a quarter circle of 20 mm radius, straight."""
    arc, s = 0.02 * np.pi / 2, u * (0.1 + 0.02 * np.pi / 2)
    turn = np.clip((s - 0.05) / 0.02, 0, np.pi / 2)
    z = np.minimum(s, 0.05) + 0.02j * (1 - np.exp(1j * turn)) + 1j * np.maximum(s - 0.05 - arc, 0)
    return z, np.exp(1j * turn)


CURVES = [parabola, ellipse, involute, sine, straight, logarithmic_spiral, flank, rounded_corner]


def sampled(curve, n):
    z, t = curve(np.linspace(0, 1, n))
    t = t / np.abs(t)
    return np.column_stack([z.real, z.imag]), np.column_stack([t.real, t.imag])


def on_chain(chain, per_arc=60):
    """Points on each arc and unit tangents there, from centre and radius."""
    points, tangents = [], []
    for a, b, bulge in zip(chain.nodes[:-1], chain.nodes[1:], chain.bulges, strict=True):
        turn = 4 * np.arctan(bulge) * np.linspace(0, 1, per_arc)
        if abs(bulge) < 1e-9:
            points.append(a + (b - a) * np.linspace(0, 1, per_arc))
            tangents.append(np.full(per_arc, (b - a) / abs(b - a)))
        else:
            center = (a + b) / 2 + 1j * (b - a) * (1 - bulge**2) / (4 * bulge)
            points.append(center + (a - center) * np.exp(1j * turn))
            tangents.append(1j * np.sign(bulge) * (points[-1] - center) / np.abs(points[-1] - center))
    return np.concatenate(points), np.concatenate(tangents)


def offset_from(curve, chain, fine=100_001):
    """Largest distance between the curve and the chain, both ways, and the largest angle between them."""
    exact, slope = curve(np.linspace(0, 1, fine))
    slope = slope / np.abs(slope)
    points, tangents = on_chain(chain)
    _, near = cKDTree(np.column_stack([exact.real, exact.imag])).query(np.column_stack([points.real, points.imag]))
    across = np.abs(((points - exact[near]) * slope[near].conj()).imag)
    line = shapely.LineString(np.column_stack([points.real, points.imag]))
    some = exact[:: fine // 400]
    back = shapely.distance(shapely.points(some.real, some.imag), line)
    return max(across.max(), back.max()), np.abs(np.angle(tangents / slope[near])).max()


@pytest.mark.parametrize("curve", CURVES)
def test_the_arcs_stay_within_the_tolerance_of_the_exact_curve(curve):
    chain = fit_arcs(*sampled(curve, 2001), 5e-6)
    # The polygon with which distances are measured adds up to 0.3 um of its own.
    assert offset_from(curve, chain)[0] <= 5e-6 + 3e-7


@pytest.mark.parametrize("curve", CURVES)
def test_neighbouring_arcs_have_a_common_tangent(curve):
    chain = fit_arcs(*sampled(curve, 2001), 5e-6)
    _, tangents = on_chain(chain)
    ends, starts = tangents[59::60][:-1], tangents[60::60]
    assert np.abs(ends - starts).max(initial=0.0) < 1e-6


@pytest.mark.parametrize("curve", CURVES)
def test_the_chain_begins_and_ends_as_the_curve_does(curve):
    points, tangents = sampled(curve, 2001)
    chain = fit_arcs(points, tangents, 5e-6)
    into, out = chain.tangents
    assert chain.nodes[0] == complex(*points[0])
    assert chain.nodes[-1] == complex(*points[-1])
    assert abs(into[0] - complex(*tangents[0])) < 1e-7
    assert abs(out[-1] - complex(*tangents[-1])) < 1e-7


def test_a_straight_curve_is_one_straight_piece():
    chain = fit_arcs(*sampled(straight, 500), 5e-6)
    assert len(chain.bulges) == 1
    assert abs(chain.bulges[0]) < 1e-15


def test_a_straight_stretch_takes_no_more_than_its_share_of_pieces():
    corner = fit_arcs(*sampled(rounded_corner, 2001), 5e-6)
    assert len(corner.bulges) <= 10


def test_a_circle_is_arcs_of_its_own_radius():
    def circle(u):
        return 0.05 * np.exp(2j * np.pi * u), 1j * np.exp(2j * np.pi * u)

    chain = fit_arcs(*sampled(circle, 400), 5e-6)
    assert len(chain.bulges) <= 4
    np.testing.assert_allclose(1 / chain.curvatures, 0.05, rtol=1e-9)


def test_eight_times_the_tolerance_takes_half_the_pieces():
    counts = [len(fit_arcs(*sampled(involute, 8001), tolerance).bulges) for tolerance in (8e-7, 1e-7)]
    assert counts[1] / counts[0] == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("curve", [flank, sine, logarithmic_spiral])
def test_a_bound_on_the_angle_is_kept(curve):
    loose, tight = (fit_arcs(*sampled(curve, 4001), 5e-6, lean) for lean in (np.inf, 1e-3))
    assert offset_from(curve, loose)[1] > 3e-3
    # The nearest of the exact points, at which angles are compared, is up to 1 um away on a radius of 10 mm.
    assert offset_from(curve, tight)[1] <= 1e-3 + 1e-4


# ---- invariance


heights = st.lists(st.floats(-1, 1), min_size=5, max_size=5)


def wavy(amplitudes):
    """A graph with up to five harmonics; its direction changes by less than half a turn."""

    def curve(u):
        harmonics = np.arange(1, 6)
        phase = np.outer(3 * u, harmonics) + np.arange(5)
        return 3 * u + 0.3j * np.sin(phase) @ amplitudes, 3 + 0.9j * (np.cos(phase) * harmonics) @ amplitudes

    return curve


def nodes_of(points, tangents, tolerance):
    return fit_arcs(points, tangents, tolerance).nodes


@settings(deadline=None, max_examples=60)
@given(heights, st.floats(0, 6.3), st.floats(1e-3, 1e3), st.floats(-3, 3), st.floats(-3, 3))
def test_turned_moved_and_scaled_curves_get_turned_moved_and_scaled_arcs(amplitudes, angle, scale, x, y):
    points, tangents = sampled(wavy(amplitudes), 801)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    moved = nodes_of(scale * (points @ turn + [x, y]), tangents @ turn, scale * 1e-4)
    expected = scale * (nodes_of(points, tangents, 1e-4) * np.exp(1j * angle) + x + 1j * y)
    assert len(moved) == len(expected)
    assert np.abs(moved - expected).max() < 1e-8 * scale


@settings(deadline=None, max_examples=60)
@given(heights)
def test_a_curve_run_backwards_gets_the_same_arcs(amplitudes):
    points, tangents = sampled(wavy(amplitudes), 801)
    there, back = fit_arcs(points, tangents, 1e-4), fit_arcs(points[::-1], -tangents[::-1], 1e-4)
    assert len(there.nodes) == len(back.nodes)
    assert np.abs(there.nodes - back.nodes[::-1]).max() < 1e-9
    assert np.abs(there.bulges + back.bulges[::-1]).max() < 1e-9


@settings(deadline=None, max_examples=60)
@given(heights)
def test_the_mirror_image_of_a_curve_gets_the_mirror_image_of_its_arcs(amplitudes):
    points, tangents = sampled(wavy(amplitudes), 801)
    chain, mirrored = fit_arcs(points, tangents, 1e-4), fit_arcs(points * [-1, 1], tangents * [-1, 1], 1e-4)
    assert np.array_equal(mirrored.nodes, -chain.nodes.conj())
    assert np.array_equal(mirrored.bulges, -chain.bulges)


# ---- data that do not say enough


@settings(deadline=None, max_examples=80)
@given(heights, st.integers(2, 120), st.floats(-6, -3))
def test_few_points_are_refused_or_fitted_within_the_tolerance(amplitudes, n, exponent):
    curve, tolerance = wavy(amplitudes), 10**exponent
    assume(np.abs(np.diff(np.angle(curve(np.linspace(0, 1, n))[1]))).max() < 1)
    try:
        chain = fit_arcs(*sampled(curve, n), tolerance)
    except CoarseDataError:
        return
    measured = offset_from(curve, chain, fine=20_001)[0]
    assert measured <= tolerance + 2e-5 * np.ptp(chain.nodes.real) / len(chain.bulges)


@pytest.mark.parametrize("n", [8, 20, 40])
def test_points_too_far_apart_are_refused_with_the_place(n):
    with pytest.raises(CoarseDataError, match=r"points \d+ and \d+ of \d+ are too far apart for the tolerance"):
        fit_arcs(*sampled(sine, n), 5e-6)


def test_a_corner_is_refused_with_its_place():
    x = np.linspace(-1, 1, 400)
    points = np.column_stack([x, 0.2 * np.abs(x)])
    tangents = np.column_stack([np.ones(400), 0.2 * np.sign(x)]) / np.hypot(1, 0.2)
    with pytest.raises(CoarseDataError, match="corner") as caught:
        fit_arcs(points, tangents, 5e-6)
    assert abs(caught.value.index - 199.5) <= 2


def test_tangents_against_the_order_of_the_points_are_refused():
    points, tangents = sampled(parabola, 100)
    with pytest.raises(CoarseDataError, match="180 deg off their chord"):
        fit_arcs(points, -tangents, 5e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p, t: (np.insert(p, 7, p[7], axis=0), np.insert(t, 7, t[7], axis=0)), "coincide"),
        (lambda p, t: (p, 1.01 * t), "length one"),
        (lambda p, t: (np.where(np.arange(100)[:, None] == 7, np.nan, p), t), "not finite"),
    ],
)
def test_data_that_are_no_curve_are_refused(change, message):
    with pytest.raises(CoarseDataError, match=message):
        fit_arcs(*change(*sampled(parabola, 100)), 5e-6)


def test_the_refusal_is_an_input_error_and_survives_pickling():
    error = pickle.loads(pickle.dumps(CoarseDataError("too few", 3)))
    assert isinstance(error, InputError)
    assert (str(error), error.index) == ("too few", 3)


# ---- one biarc, one chain


def test_a_biarc_between_tangents_of_one_circle_is_that_circle():
    found = biarc(1 + 0j, 1j, 1j, -1 + 0j)
    assert found is not None
    assert found.curvatures == pytest.approx((1, 1))
    assert found.joint == pytest.approx(np.exp(0.25j * np.pi))
    assert found.turn == pytest.approx(np.pi / 2)


def test_there_is_no_biarc_when_both_ends_face_away():
    assert biarc(0j, -1 + 0j, 1 + 0j, -1 + 0j) is None


def test_the_area_of_a_chain_counts_its_arcs():
    stadium = ArcChain(np.array([0, 2, 2 + 2j, 2j, 0]), np.array([0.0, 1.0, 0.0, 1.0]))
    assert stadium.area == pytest.approx(4 + np.pi)
    assert ArcChain(stadium.nodes[::-1], -stadium.bulges[::-1]).area == pytest.approx(-4 - np.pi)


@given(st.floats(-0.99, 0.99), st.floats(1e-6, 1e-2))
def test_a_flattened_arc_keeps_its_sagitta(bulge, sagitta):
    points = ArcChain(np.array([0, 1 + 1j]), np.array([bulge])).flatten(sagitta)
    middle = (points[1:] + points[:-1]) / 2
    if abs(bulge) > 1e-9:
        center = (1 + 1j) / 2 + 1j * (1 + 1j) * (1 - bulge**2) / (4 * bulge)
        assert np.allclose(np.abs(points - center), abs(center), rtol=1e-9)
        assert (abs(center) - np.abs(middle - center)).max() <= sagitta * (1 + 1e-6) + 1e-12 * abs(center)

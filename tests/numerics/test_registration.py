"""Registration of measured flanks: the reference note's case (section 4), robustness, uncertainty."""

from __future__ import annotations

import numpy as np
import pytest
from flanks import Errors, flanks, measured, parameters, profile

from cfmkit.numerics.rigid_point_registration import feet, gaps_across, register, registered_where_it_is, turn_points
from cfmkit.numerics.robust_statistics import neighbour_noise
from cfmkit.numerics.smoothing_spline import fit_smoothing_spline

ANGLE, SHIFT = -0.3, (-1.49579067, 0.80784298)
"""Printed in the note: deg and mm."""


def spoilt(points, count=3):
    """Points of which some are moved by some tenths of a millimetre."""
    rng = np.random.default_rng(0)
    found = [np.array(item) for item in points]
    for item in found:
        item[rng.choice(len(item), count, replace=False)] += rng.normal(0, 0.3e-3, (count, 2))
    return found


def test_an_exact_profile_that_was_moved_is_moved_back_to_the_printed_digits():
    found = register(measured(), flanks())
    assert np.degrees(found.angle) == pytest.approx(ANGLE, abs=2e-14)
    assert found.shift * 1e3 == pytest.approx(SHIFT, abs=5e-9)
    assert np.abs(np.concatenate(found.errors)).max() < 1e-15


def test_six_outliers_do_not_move_the_robust_registration_and_move_the_plain_one():
    robust, plain = (register(spoilt(measured()), flanks(), robust=way) for way in (True, False))
    assert robust.shift * 1e3 == pytest.approx(SHIFT, abs=5e-9)
    assert np.degrees(robust.angle) == pytest.approx(ANGLE, abs=1e-13)
    assert np.abs(plain.shift * 1e3 - SHIFT).max() > 1e-3
    assert sum(int((weight == 0).sum()) for weight in robust.weights) == 6


def rms(values):
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


def test_a_width_error_stays_in_the_residuals_of_the_joint_registration_and_vanishes_in_one_of_each_flank():
    points = measured(Errors(offset=-0.01e-3))
    joint = register(points, flanks())
    alone = [register([item], [flank]) for item, flank in zip(points, flanks(), strict=True)]
    assert rms(joint.errors) > 20 * max(rms(item.errors) for item in alone)


def test_most_of_a_width_error_is_taken_for_a_shift_along_the_steep_flanks():
    """A cam 0.01 mm too narrow on each side looks like one that sits 0.035 mm lower: the note's 0.024 to 0.036."""
    found = register(measured(Errors(offset=-0.01e-3)), flanks(), robust=False)
    assert found.shift[1] * 1e3 == pytest.approx(SHIFT[1] - 0.035, abs=0.001)
    assert found.shift[0] * 1e3 == pytest.approx(SHIFT[0], abs=1e-8)


def test_the_shift_that_a_width_error_is_taken_for_is_told_beforehand():
    """0.01 mm of width, plain least squares: the registration moves as `growth` of the exact profile says."""
    reported = register(measured(), flanks(), robust=False).growth
    exact, wide = (register(measured(Errors(offset=size)), flanks(), robust=False) for size in (0.0, 0.01e-3))
    centre = np.concatenate(exact.points).mean(axis=0)
    turn = np.array([-centre[1], centre[0]]) * (wide.angle - exact.angle)
    moved = turn_points(np.zeros((1, 2)), wide.angle - exact.angle, np.zeros(2))[0]
    assert wide.shift - exact.shift + turn - moved == pytest.approx(0.01e-3 * reported, rel=1e-3, abs=1e-9)
    assert reported[1] > 3


@pytest.mark.parametrize("offset", [-0.2e-3, -0.05e-3, 0.05e-3, 0.3e-3])
def test_a_cam_that_is_simply_wider_keeps_all_its_points_and_its_place_with_a_width(offset):
    """Taken for a motion, +0.05 mm on both flanks lose the first 12 mm as outliers and move the cam by 0.2 mm."""
    points = measured(Errors(offset=offset))
    found, moved = register(points, flanks(), width=True), register(points, flanks())
    assert found.width == pytest.approx(offset, rel=1e-9)
    assert found.shift * 1e3 == pytest.approx(SHIFT, abs=5e-9)
    assert all((weight > 0).all() for weight in found.weights)
    assert np.concatenate(found.errors) == pytest.approx(np.full(600, offset), rel=1e-9)
    assert abs(moved.shift[1] * 1e3 - SHIFT[1]) > 2 * abs(offset) * 1e3


def test_the_stated_deviation_of_the_width_is_that_of_repeated_measurements():
    found = [register(measured(Errors(0.0, offset=0.05e-3, noise=0.02e-3, seed=seed)), flanks(), False, width=True)
             for seed in range(30)]  # fmt: skip
    widths = np.array([item.width for item in found])
    assert found[0].width_deviation == pytest.approx(widths.std(ddof=1), rel=0.4)
    assert abs(widths.mean() - 0.05e-3) < 3 * widths.std(ddof=1) / 30**0.5


def test_points_in_the_parts_datum_are_not_moved():
    points = measured(Errors(offset=0.05e-3), move=(0.0, np.zeros(2)))
    found = registered_where_it_is(points, flanks(), register(points, flanks(), width=True))
    assert (found.angle, *found.shift) == (0.0, 0.0, 0.0)
    assert np.concatenate(found.errors) == pytest.approx(np.full(600, 0.05e-3), rel=1e-9)


@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_the_noise_of_points_is_seen_through_their_waves_and_past_outliers(spacing):
    rng = np.random.default_rng(1)
    places = np.linspace(0, 0.15, 400) if spacing == "even" else np.sort(rng.uniform(0, 0.15, 400))
    values = 0.02e-3 * np.sin(2 * np.pi * places / 0.03) + rng.normal(0, 0.002e-3, 400)
    values[::40] += 1e-3
    order = rng.permutation(400)
    assert neighbour_noise(places[order], values[order]) == pytest.approx(0.002e-3, rel=0.25)


def test_the_height_is_the_weakly_observed_shift_on_steep_flanks():
    found = register(measured(Errors(noise=0.02e-3)), flanks())
    assert found.deviations[2] > found.deviations[1]
    direction, deviation = found.weakest(0.1)
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert deviation >= found.deviations[2]


def test_the_stated_deviations_are_those_of_repeated_measurements():
    states = []
    for seed in range(40):
        found = register(measured(Errors(noise=0.02e-3, seed=seed)), flanks(), robust=False)
        states.append([found.angle, *found.shift])
    spread = np.std(states, axis=0, ddof=1)
    assert found.deviations == pytest.approx(spread, rel=0.4)


def test_rmse_and_deviation_of_the_errors_are_those_that_were_put_in():
    found = register(measured(Errors(noise=0.02e-3)), flanks())
    assert np.concatenate(found.errors).std(ddof=1) == pytest.approx(0.02e-3, rel=0.08)


def test_errors_across_are_errors_along_the_normal_over_its_slope():
    flank = flanks()[0]
    u = parameters()
    at = flank.frame(u)
    points = at.points + 1e-6 * at.normals
    assert gaps_across(flank, points, u) == pytest.approx(1e-6 / at.normals[:, 0], rel=1e-3)


def test_points_beyond_the_ends_of_the_curve_do_not_count():
    points = measured()
    far = [np.concatenate([item, item[-1:] + np.array([0.0, 0.3])]) for item in points]
    found = register(far, flanks())
    assert found.shift * 1e3 == pytest.approx(SHIFT, abs=1e-6)
    assert [weight[-1] for weight in found.weights] == [0.0, 0.0]


def test_feet_of_points_off_the_curve_are_the_parameters_they_came_from():
    for flank in flanks():
        u = parameters()
        at = flank.frame(u)
        for offset in (-2e-3, 5e-3):
            assert feet(flank, at.points + offset * at.normals) == pytest.approx(u, abs=1e-13)


def test_tangent_speed_and_curvature_of_a_flank_are_its_derivatives():
    cut, step = profile(), 1e-6
    u = np.linspace(cut.start + 0.005, cut.end - 0.005, 50)
    for flank in flanks():
        before, here, after = (flank.frame(u + way * step) for way in (-1, 0, 1))
        rate = (after.points - before.points) / (2 * step)
        assert here.speed[:, None] * here.tangents == pytest.approx(rate, rel=1e-6)
        turn = (after.normals - before.normals) / (2 * step) / here.speed[:, None]
        assert (turn * here.tangents).sum(axis=1) == pytest.approx(here.curvature, rel=1e-5)


def test_turning_keeps_distances():
    points = np.random.default_rng(0).normal(size=(5, 2))
    moved = turn_points(points, 0.7, np.array([1.0, 2.0]))
    assert np.linalg.norm(moved[1:] - moved[0], axis=1) == pytest.approx(np.linalg.norm(points[1:] - points[0], axis=1))


X = np.linspace(0.0, 0.15, 300)


@pytest.mark.parametrize("noise", [0.5e-6, 2e-6, 10e-6])
def test_the_residuals_of_the_smoothing_spline_are_as_large_as_the_stated_noise(noise):
    values = 20e-6 * np.sin(2 * np.pi * X / 0.02) + np.random.default_rng(0).normal(0, noise, 300)
    found = fit_smoothing_spline(X, values, noise)
    assert found.residual == pytest.approx(noise, rel=1e-3)


def test_its_derivative_is_nearer_to_the_truth_than_that_of_interpolation():
    values = 20e-6 * np.sin(2 * np.pi * X / 0.02) + np.random.default_rng(0).normal(0, 2e-6, 300)
    truth = 20e-6 * 2 * np.pi / 0.02 * np.cos(2 * np.pi * X / 0.02)
    errors = [
        np.sqrt(np.mean((fit_smoothing_spline(X, values, noise).evaluate(X, 1) - truth) ** 2)) for noise in (0.0, 2e-6)
    ]
    assert errors[1] < 0.15 * errors[0]


def test_noise_larger_than_the_signal_leaves_a_straight_line():
    found = fit_smoothing_spline(X, 3 * X + 1e-9 * np.sin(40 * X), 1e-3)
    assert np.abs(found.evaluate(X, 2)).max() < 1e-3
    assert found.evaluate(X, 1) == pytest.approx(np.full(300, 3.0), abs=1e-3)


def test_without_noise_the_points_are_met():
    values = np.sin(40 * X)
    assert fit_smoothing_spline(X, values, 0.0).evaluate(X) == pytest.approx(values, abs=1e-12)


@pytest.mark.parametrize("places", [[0, 1, 2], [0, 1, 1, 2, 3, 4], [3, 2, 1, 0, -1]])
def test_too_few_or_unordered_points_are_refused(places):
    with pytest.raises(ValueError, match="increasing order"):
        fit_smoothing_spline(np.array(places, dtype=float), np.zeros(len(places)), 1.0)

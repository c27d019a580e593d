"""Least squares: values, intervals that hold what they promise, correlation, and what cannot be determined."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.numerics.least_squares import (
    LeastSquares,
    NotFinite,
    correlation_time,
    dependent_columns,
    solve,
    unidentifiable,
)

X = np.linspace(0, 1, 200)


def problem(model, data, start, low=None, high=None):
    count = len(start)
    return LeastSquares(
        lambda p: model(p) - data,
        np.array(start, dtype=float),
        np.full(count, -np.inf) if low is None else np.array(low, dtype=float),
        np.full(count, np.inf) if high is None else np.array(high, dtype=float),
        np.ones(count),
        float(np.abs(data).max()),
    )


def line(p):
    return p[0] + p[1] * X


def decay(p):
    return p[0] * np.exp(-p[1] * X)


@pytest.mark.parametrize("loss", ["linear", "soft_l1", "huber", "cauchy"])
def test_without_noise_the_truth_is_found(loss):
    assert solve(problem(decay, decay([2.0, 3.0]), [1.0, 1.0]), loss).values == pytest.approx([2.0, 3.0], rel=1e-8)


def test_a_linear_fit_has_the_textbook_covariance():
    data = line([1.0, 2.0]) + np.random.default_rng(0).normal(0, 0.1, 200)
    fit = solve(problem(line, data, [0.0, 0.0]), "linear")
    design = np.column_stack([np.ones(200), X])
    expected = np.linalg.inv(design.T @ design) * fit.noise**2 * fit.inflation
    assert fit.covariance == pytest.approx(expected, rel=1e-6)
    assert fit.correlation[0, 1] == pytest.approx(expected[0, 1] / np.sqrt(expected[0, 0] * expected[1, 1]))


@pytest.mark.parametrize("loss", ["linear", "soft_l1"])
def test_nineteen_of_twenty_intervals_hold_the_truth(loss):
    inside = []
    for seed in range(120):
        data = decay([2.0, 3.0]) + np.random.default_rng(seed).normal(0, 0.05, 200)
        fit = solve(problem(decay, data, [1.0, 1.0]), loss)
        inside += (np.abs(fit.values - [2.0, 3.0]) <= fit.half_widths()).tolist()
    assert 0.90 <= np.mean(inside) <= 0.99


def test_intervals_grow_where_the_residuals_are_not_independent():
    inside = []
    for seed in range(60):
        steps = np.random.default_rng(seed).normal(0, 0.05, 220)
        smooth = np.convolve(steps, np.ones(21) / 21**0.5, mode="valid")
        fit = solve(problem(line, line([1.0, 2.0]) + smooth, [0.0, 0.0]), "linear")
        inside += (np.abs(fit.values - [1.0, 2.0]) <= fit.half_widths()).tolist()
    assert np.mean(inside) > 0.75


def test_the_correlation_time_of_noise_is_one_and_of_a_moving_average_its_length():
    noise = np.random.default_rng(1).normal(size=20_000)
    assert correlation_time(noise) == pytest.approx(1.0, abs=0.1)
    averaged = np.convolve(noise, np.ones(9), mode="valid")
    assert correlation_time(averaged) == pytest.approx(9.0, rel=0.2)


def test_a_robust_loss_is_hardly_moved_by_outliers_that_move_the_linear_fit():
    data = line([1.0, 2.0]) + np.random.default_rng(0).normal(0, 0.01, 200)
    data[::20] += 1.0
    errors = {loss: abs(solve(problem(line, data, [0.0, 0.0]), loss).values[0] - 1.0) for loss in ("linear", "cauchy")}
    assert errors["cauchy"] < 0.01 < errors["linear"]


def test_a_value_that_the_data_push_over_its_bound_stays_on_it_and_is_marked():
    fit = solve(problem(line, line([-0.5, 2.0]), [0.5, 1.0], low=[0.0, -9.0], high=[9.0, 9.0]))
    assert fit.values[0] == 0.0  # it was 1e-23
    assert fit.at_bound.tolist() == [True, False]


def test_parameters_without_effect_and_parameters_that_replace_each_other_are_named():
    data = line([1.0, 2.0])
    assert unidentifiable(problem(lambda p: line(p[:2]), data, [1, 2, 3]), np.array([1.0, 2.0, 3.0])) == ((2,),)
    product = problem(lambda p: p[0] * p[1] * (1 + X) + p[2] * X**2, data, [1, 1, 1])
    assert unidentifiable(product, np.array([1.0, 2.0, 1.0])) == ((0, 1),)
    assert unidentifiable(problem(line, data, [1, 2]), np.array([1.0, 2.0])) == ()


def test_three_columns_in_one_plane_are_one_group():
    jacobian = np.column_stack([X, X**2, X + 2 * X**2, X**3])
    assert dependent_columns(jacobian, 1.0) == ((0, 1, 2),)


def test_a_start_without_residuals_is_refused():
    bad = problem(lambda p: np.full(200, np.nan), line([1.0, 1.0]), [1, 1])
    with pytest.raises(NotFinite):
        solve(bad)
    with pytest.raises(NotFinite):
        unidentifiable(bad, bad.start)


def test_a_region_without_residuals_is_walked_around():
    def model(p):
        return np.log(p[0]) + p[1] * X if p[0] > 0 else np.full(200, np.nan)

    assert solve(problem(model, model([0.05, 1.0]), [3.0, 0.0])).values == pytest.approx([0.05, 1.0], rel=1e-6)

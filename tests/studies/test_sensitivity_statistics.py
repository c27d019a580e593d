"""Sensitivity methods on functions whose answers are known in closed form."""

from __future__ import annotations

from math import pi, sqrt
from statistics import NormalDist

import numpy as np
import pytest
from scipy.stats import binom

from cfmkit.studies.parts import share, uncertain_values
from cfmkit.studies.parts.share import Share
from cfmkit.studies.parts.uncertain_values import ParameterSpread
from cfmkit.studies.sensitivity import local, morris, oat, sobol, tolerance

RANGE = {"kind": "uniform", "nominal": 0.0}


def ishigami(points, a=7.0, b=0.1):
    x, y, z = (points[..., k] for k in range(3))
    return np.sin(x) + a * np.sin(y) ** 2 + b * z**4 * np.sin(x)


def ishigami_indices(a=7.0, b=0.1):
    first = 0.5 * (1 + b * pi**4 / 5) ** 2
    second, mixed = a**2 / 8, b**2 * pi**8 * (1 / 18 - 1 / 50)
    total = first + second + mixed
    return np.array([first, second, 0]) / total, np.array([first + mixed, second, mixed]) / total


G = np.array([0.0, 1.0, 4.5, 9.0, 99.0])


def g_function(points):
    return np.prod((np.abs(4 * points - 2) + G) / (1 + G), axis=-1)


def g_indices():
    part = 1 / (3 * (1 + G) ** 2)
    variance = np.prod(1 + part) - 1
    rest = np.array([np.prod(np.delete(1 + part, k)) for k in range(len(G))])
    return part / variance, part * rest / variance


def indices(function, parameters, count=2048, seed=0, stretch=lambda u: u):
    points = sobol.sample(0, count, parameters, seed)
    return sobol.analyze(function(stretch(points)), seed)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_sobol_indices_of_the_ishigami_function_are_those_of_the_closed_form(seed):
    first, total = indices(ishigami, 3, seed=seed, stretch=lambda unit: pi * (2 * unit - 1))
    for found, known in zip((first, total), ishigami_indices(), strict=True):
        np.testing.assert_allclose(found.value, known, atol=0.02)
        assert ((found.low - 0.005 < known) & (known < found.high + 0.005)).all()


@pytest.mark.parametrize("seed", [0, 3])
def test_sobol_indices_of_the_g_function_are_those_of_the_closed_form(seed):
    first, total = indices(g_function, len(G), seed=seed)
    known_first, known_total = g_indices()
    np.testing.assert_allclose(first.value, known_first, atol=0.015)
    np.testing.assert_allclose(total.value, known_total, atol=0.015)


def test_sobol_intervals_shrink_with_the_square_root_of_the_number_of_blocks():
    points = sobol.sample(0, 4096, 3, 0)
    stages = sobol.convergence(ishigami(pi * (2 * points - 1)), 0)
    assert [size for size, _ in stages] == [16, 32, 64, 128, 256, 512, 1024, 2048, 4096]
    widths = [float((total.high - total.low).max()) for size, (_, total) in stages if size in (64, 1024)]
    assert widths[0] / widths[1] == pytest.approx(4.0, rel=0.5)


def test_more_sobol_blocks_leave_the_first_ones_as_they_are():
    np.testing.assert_array_equal(sobol.sample(0, 64, 3, 5)[:16], sobol.sample(0, 16, 3, 5))
    np.testing.assert_array_equal(sobol.sample(0, 64, 3, 5)[16:24], sobol.sample(16, 8, 3, 5))


@pytest.mark.parametrize("seed", [0, 1])
def test_the_same_seed_gives_the_same_intervals_even_if_it_is_zero(seed):
    one, other = (indices(g_function, len(G), 64, seed) for _ in range(2))
    for found, again in zip(one, other, strict=True):
        np.testing.assert_array_equal(found.high, again.high)


def test_an_output_that_does_not_vary_has_no_sobol_indices():
    points = sobol.sample(0, 32, 2, 0)
    for found in sobol.analyze(np.full(points.shape[:2], 50.0), 0):
        assert np.isnan(found.value).all()


def test_morris_finds_the_coefficients_of_a_linear_function_without_scatter():
    slopes = np.array([3.0, -2.0, 0.0])
    points = morris.sample(0, 12, 3, 0)
    size, mean, scatter = morris.analyze(points, points @ slopes + 7.0, 0)
    np.testing.assert_allclose(size.value, np.abs(slopes), atol=1e-12)
    np.testing.assert_allclose(mean.value, slopes, atol=1e-12)
    np.testing.assert_allclose(scatter.value, 0, atol=1e-12)
    np.testing.assert_allclose(size.high, np.abs(slopes), atol=1e-12)


def test_morris_sees_an_interaction_as_scatter():
    # f = x y: the effect of x is y, which is 0, 1/3, 2/3 or 1 with equal probability.
    points = morris.sample(0, 2000, 2, 0)
    size, _, scatter = morris.analyze(points, points[..., 0] * points[..., 1], 0)
    np.testing.assert_allclose(size.value, 0.5, atol=0.03)
    np.testing.assert_allclose(scatter.value, sqrt(5 / 36), atol=0.02)


def test_morris_cancels_in_the_mean_what_it_counts_in_its_size():
    # A parabola about the middle: steps of two thirds up and down by turns.
    points = morris.sample(0, 500, 1, 0)
    size, mean, _ = morris.analyze(points, (points[..., 0] - 0.5) ** 2, 0)
    assert abs(mean.value[0]) < 0.05 < 0.2 < size.value[0]


def test_one_at_a_time_gives_the_exponents_of_a_power_law():
    nominal, ends = np.array([2.0, 3.0]), np.array([[1.998, 2.002], [2.997, 3.003]])
    points = oat.sample(nominal, ends, 5)
    assert (points[0, :, 1] == 3.0).all()
    outputs = points[..., 0] ** 2 / points[..., 1]
    low, high, swing, slope = oat.analyze(nominal, ends, outputs, 4 / 3)
    np.testing.assert_allclose(slope.value, [2.0, -1.0], rtol=1e-5)
    np.testing.assert_allclose(swing.value, np.abs(high.value - low.value))


def test_a_swing_counts_what_lies_between_the_ends():
    points = oat.sample(np.array([0.0]), np.array([[-1.0, 1.0]]), 11)
    _, _, swing, slope = oat.analyze(np.array([0.0]), np.array([[-1.0, 1.0]]), points[..., 0] ** 2, 0.0)
    assert swing.value[0] == pytest.approx(1.0)
    assert np.isnan(slope.value[0])


@pytest.mark.parametrize("function", [np.exp, np.sin, lambda x: x**3 - x, lambda x: 1 / (2 + x)])
def test_a_gradient_is_exact_to_within_its_error_estimate(function):
    at, half = 0.3, 0.2
    points = local.sample(np.array([at]), np.array([half]))[0, ..., 0]
    found = local.slope(function(points[0]), function(points[1]), function(at), half)
    step = 1e-30
    exact = function(at + 1j * step).imag / step
    assert abs(found.value - exact) <= 10 * found.error + 1e-14
    assert found.error < 1e-7


def test_a_gradient_at_a_bound_is_taken_from_the_side_that_works():
    points = local.sample(np.array([0.0]), np.array([0.4]))[0, ..., 0]
    outputs = np.where(points < 0, np.nan, np.exp(3 * points))
    for up, down, sign in ((outputs[0], outputs[1], 1), (outputs[1], outputs[0], -1)):
        found = local.slope(up, down, 1.0, 0.4)
        assert found.value == pytest.approx(sign * 3.0, abs=1e-4)
        assert abs(found.value - sign * 3.0) <= found.error


def test_a_gradient_that_does_not_exist_has_a_large_error_estimate():
    points = local.sample(np.array([0.0]), np.array([1.0]))[0, ..., 0]
    kinked = np.sqrt(np.abs(points)) * np.sign(points)
    found = local.slope(kinked[0], kinked[1], 0.0, 1.0)
    assert found.error > 0.1


def normal(deviation, nominal=0.0, low=-np.inf, high=np.inf):
    return ParameterSpread("normal", nominal, low, high, deviation)


def made(tolerances, matrix, count=40_000, seed=0, groups=()):
    unit = uncertain_values.draw(matrix, count, np.random.default_rng(seed))
    return tolerance.sample(unit, tolerances, groups)


def test_the_yield_of_a_normal_tolerance_is_that_of_the_normal_distribution():
    points = made([normal(0.1, 5.0)], np.eye(1))[:, 0, 0]
    met = np.abs(points - 5.0) <= 0.15
    found = Share.from_outcomes(met, np.zeros(len(met), bool))
    exact = 2 * NormalDist().cdf(1.5) - 1
    assert found.wilson[0] < exact < found.wilson[1]
    assert found.value == pytest.approx(exact, abs=0.005)
    assert found.clopper_pearson[0] <= found.wilson[0] + 1e-4


@pytest.mark.parametrize("correlation", [-0.6, 0.0, 0.5, 1.0])
def test_the_sum_of_correlated_springs_scatters_as_theory_says(correlation):
    matrix = uncertain_values.correlation_matrix(2, [((0, 1), correlation)])
    total = made([normal(1.0), normal(1.0)], matrix)[:, 0].sum(axis=1)
    assert total.std() == pytest.approx(sqrt(2 + 2 * correlation), rel=0.02)


def test_correlation_leaves_each_distribution_as_it_is():
    spread = ParameterSpread("uniform", 0.0, -1.0, 1.0)
    points = made([spread, spread], uncertain_values.correlation_matrix(2, [((0, 1), 0.9)]))[:, 0]
    # The rank correlation of a Gaussian copula is 6/pi asin(r/2); for uniform parameters it is their own.
    assert np.corrcoef(points.T)[0, 1] == pytest.approx(6 / pi * np.arcsin(0.45), abs=0.01)
    assert points.std(axis=0) == pytest.approx([1 / sqrt(3)] * 2, rel=0.02)


def test_correlations_that_cannot_be_are_refused():
    with pytest.raises(uncertain_values.Incompatible, match="oppose"):
        uncertain_values.correlation_matrix(3, [((0, 1, 2), -0.9)])


def test_a_truncated_normal_distribution_keeps_its_ends_and_its_shape():
    spread = normal(1.0, 0.0, -1.0, 1.0)
    points = spread.evaluate_quantiles(np.linspace(1e-9, 1 - 1e-9, 200_001))
    assert points.min() >= -1
    assert points.max() <= 1
    phi, density = NormalDist().cdf(1) - NormalDist().cdf(-1), NormalDist().pdf(1)
    assert points.var() == pytest.approx(1 - 2 * density / phi, rel=1e-4)


@pytest.mark.parametrize(
    "spread", [normal(0.1, 2.0), ParameterSpread("uniform", 2.0, 1.9, 2.3), normal(1.0, 2.0, 1.0, 3.0)]
)
def test_a_tightened_tolerance_is_the_same_about_the_nominal_value(spread):
    unit = np.linspace(0.01, 0.99, 99)
    np.testing.assert_allclose(
        spread.tighten(0.5).evaluate_quantiles(unit) - 2.0, 0.5 * (spread.evaluate_quantiles(unit) - 2.0), atol=1e-12
    )


def test_the_tolerance_that_matters_is_the_one_to_tighten():
    points = made([normal(3.0), normal(1.0), normal(1.0)], np.eye(3), groups=((0,), (1, 2)))
    outputs = points.sum(axis=2)
    (drop,) = tolerance.variance_drops(outputs, 0)
    # Halving a tolerance takes three quarters of its share of the variance away.
    np.testing.assert_allclose(drop.value, [0.75 * 9 / 11, 0.75 * 2 / 11], atol=0.01)
    assert (drop.low < drop.value).all()
    gain = tolerance.yield_gains(np.abs(outputs) < 4, np.zeros(outputs.shape, bool))
    exact = [
        (2 * NormalDist(0, sqrt(after)).cdf(4) - 1) - (2 * NormalDist(0, sqrt(11)).cdf(4) - 1)
        for after in (9 / 4 + 2, 9 + 2 / 4)
    ]
    assert ((gain.low < exact) & (exact < gain.high)).all()
    assert gain.value[0] > gain.high[1]


def test_common_random_numbers_make_a_gain_sharper_than_two_separate_yields():
    points = made([normal(1.0), normal(0.1)], np.eye(2), 1000, groups=((1,),))
    met = np.abs(points.sum(axis=2)) < 1
    gain = tolerance.yield_gains(met, np.zeros(met.shape, bool))
    alone = Share.from_outcomes(met[:, 0], np.zeros(len(met), bool)).wilson
    assert gain.high[0] - gain.low[0] < 0.5 * (alone[1] - alone[0])


@pytest.mark.parametrize("count", [10, 40, 300])
def test_the_exact_interval_covers_the_truth_as_often_as_it_says_and_wilson_on_average(count):
    outcomes = np.arange(count + 1)
    for name, interval in (
        ("exact", share.clopper_pearson),
        ("score", share.wilson),
    ):
        ends = np.array([interval(int(k), count) for k in outcomes])
        covered = []
        for truth in np.linspace(0.02, 0.98, 49):
            inside = (ends[:, 0] <= truth) & (truth <= ends[:, 1])
            covered.append(binom.pmf(outcomes, count, truth)[inside].sum())
        assert np.mean(covered) == pytest.approx(0.955 if name == "score" else 0.97, abs=0.02)
        if name == "exact":
            assert min(covered) >= 0.95


def test_the_interval_of_a_paired_difference_covers_the_truth():
    generator, truth, hits = np.random.default_rng(0), 0.1, 0
    for _ in range(400):
        kinds = generator.choice(3, size=120, p=[0.15, 0.05, 0.8])
        low, high = share.paired_difference(int((kinds == 0).sum()), int((kinds == 1).sum()), 120)
        hits += low <= truth <= high
    assert hits / 400 == pytest.approx(0.95, abs=0.025)


def test_an_interval_without_samples_says_nothing():
    assert share.wilson(0, 0) == (0.0, 1.0)
    assert share.clopper_pearson(0, 0) == (0.0, 1.0)
    assert share.paired_difference(0, 0, 0) == (-1.0, 1.0)

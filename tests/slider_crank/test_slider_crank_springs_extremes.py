"""Extremes of a linkage's effort, their derivatives and its mean are those of the closed form, however few points."""

from pathlib import Path

import numpy as np
import pytest

import cfmkit
import cfmkit.api

CONFIGS = Path(__file__).parents[2] / "configs"
RATES = [f"mechanism.springs.{joint}" for joint in ("pivot", "crank_pin", "slider_pin")]


def config(name, *settings):
    return cfmkit.load(CONFIGS / f"slider_crank_{name}.yaml", list(settings))


@pytest.mark.parametrize("name", ["bought", "bilancia2019_optimum"])
def test_derivatives_of_extremes_are_those_at_their_places(name):
    gradient = cfmkit.api.family("slider-crank").gradient
    few, many = (gradient(config(name, f"analysis.points={count}"), RATES) for count in (11, 301))
    for metric in ("force_max", "force_min", "force_ripple", "half_band", "energy_max"):
        for path in RATES:
            assert few[metric][path] == pytest.approx(many[metric][path], rel=1e-9), (metric, path)
    spec = config(name, "analysis.points=11")
    for path in RATES:
        rate = spec.get_value(path)
        ends = [cfmkit.analyze(spec.replace({path: rate * (1 + step)})).metrics for step in (-1e-4, 1e-4)]
        for metric in ("force_max", "force_ripple"):
            difference = (ends[1][metric].value - ends[0][metric].value) / (2e-4 * rate)
            assert few[metric][path] == pytest.approx(difference, rel=1e-4), (metric, path)


def test_a_point_that_is_the_end_of_a_window_but_for_rounding_counts_once_in_sweeps_too():
    spec = config("bilancia2019_optimum", "analysis.points=301")
    single = cfmkit.analyze(spec)
    assert np.abs(single.curve.motion - 0.35e-3).min() < 1e-18  # it is there, and not equal
    swept = cfmkit.sweep(spec, vary={RATES[0]: spec.get_value(RATES[0]) * np.array([1.0, 1.1])})
    for metric in ("force_mean", "force_max", "force_min"):
        assert swept.table[metric][0] == pytest.approx(single.metrics[metric].value, rel=1e-13), metric
    slopes = cfmkit.api.family("slider-crank").gradient(spec, RATES)["force_mean"]
    assert sum(slopes[path] * spec.get_value(path) for path in RATES) == pytest.approx(
        single.metrics["force_mean"].value, rel=1e-12
    )

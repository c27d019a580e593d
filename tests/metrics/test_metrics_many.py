"""Range metrics of many curves at once are those of each curve."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from cfmkit.curves import Curve
from cfmkit.metrics import MeasuringFrame, Window
from cfmkit.metrics.metric_definitions import METRIC_TABLE
from cfmkit.metrics.metric_values import survey
from cfmkit.metrics.ranges_many import (
    BAND_RANGES,
    ManyBranches,
    band_range,
    range_95,
    range_95_fraction,
    rms_to_target,
    usable_interval,
)
from cfmkit.metrics.spread import ManyWindows, Spread

DEFINED = {item.name: item for item in METRIC_TABLE}
COUNT, POINTS = 300, 41
FUNCTIONS = {
    "range_95": range_95,
    "range_95_fraction": range_95_fraction,
    "rms_to_target": partial(rms_to_target, target=np.full(COUNT, 10.0)),
    **{name: partial(band_range, tolerance=tolerance) for name, tolerance in BAND_RANGES.items()},
}


def curves(seed):
    """Return motions and efforts that rise, wave, cross their bands, and touch them exactly."""
    rng = np.random.default_rng(seed)
    motion = np.sort(rng.uniform(0.0, 1.0, (COUNT, POINTS)), axis=1)
    motion[:, 0] = 0.0
    waves = rng.uniform(0.0, 0.12, (COUNT, 1)) * np.sin(rng.uniform(1, 40, (COUNT, 1)) * motion)
    effort = 10.0 * (1.0 + waves + rng.uniform(-0.1, 0.1, (COUNT, 1)) * motion)
    effort[::3, 0] = 0.0
    effort[::5] = np.round(effort[::5] * 2.0) / 2.0
    effort[1::7] = 10.0
    return motion, effort


def alone(motion, efforts, window, name, until=np.inf):
    """Return a metric of one curve whose branches have one motion, unloading stored backwards."""
    path = np.concatenate([motion, *(motion[::-1] for _ in efforts[1:])])
    effort = np.concatenate([efforts[0], *(one[::-1] for one in efforts[1:])])
    branch = np.repeat(["load", "unload"][: len(efforts)], len(motion))
    frame = MeasuringFrame(target=10.0, valid=((0.05, min(float(motion[-1]), until)),))
    view = survey(Curve(path, effort, branch, np.ones(len(path), bool)), frame, window)
    definition = DEFINED[name]
    value = view.worst(definition, view.evaluate_each(definition)).value
    return np.nan if value is None else value


@pytest.mark.parametrize("window", [None, (0.2, 0.8)])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_range_of_many_curves_is_that_of_each(name, window):
    motion, effort = curves(1)
    motion[:, -1] = 1.0
    low, high = (np.full(COUNT, end) for end in window) if window else (motion[:, 0], motion[:, -1])
    many = ManyBranches(motion, effort, low, high)
    with np.errstate(all="ignore"):
        found = FUNCTIONS[name](many)
    wanted = [alone(motion[k], [effort[k]], Window(*window) if window else None, name) for k in range(COUNT)]
    assert np.allclose(found, wanted, rtol=1e-12, atol=1e-13, equal_nan=True)
    assert np.ptp(found[np.isfinite(found)]) > 0.01


@pytest.mark.parametrize(("seed", "until"), [(2, None), (3, None), (3, 0.7)])
def test_the_usable_interval_of_many_loops_is_that_of_each(seed, until):
    motion, load = curves(seed)
    _, unload = curves(seed + 10)
    unload[::40] = 20.0
    branches = [ManyBranches(motion, one, motion[:, 0], motion[:, -1]) for one in (load, unload)]
    limit = None if until is None else np.full(COUNT, until)
    start, end = usable_interval(branches, np.full(COUNT, 10.0), 0.05, np.full(COUNT, 0.05), limit)
    found = {"usable_start": start, "usable_end": end, "usable_stroke": np.nan_to_num(end - start)}
    for name, values in found.items():
        wanted = [alone(motion[k], [load[k], unload[k]], None, name, until or np.inf) for k in range(COUNT)]
        assert np.allclose(values, wanted, rtol=1e-12, atol=1e-13, equal_nan=True)
    assert 20 < np.isfinite(start).sum() < COUNT


OF_EFFORTS = ("force_mean", "force_sd", "force_max", "force_min", "force_ripple", "half_band", "deviation_from_mean")


def metric_of(name, many, target):
    """Return a metric of many curves by its definition."""
    (function,) = (one.of_rows for one in METRIC_TABLE if one.name == name)
    return function(SimpleNamespace(many=many, curves=SimpleNamespace(target=np.full(len(many.effort), target))))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", [*OF_EFFORTS, "deviation_from_target"])
def test_a_metric_of_many_windows_is_that_of_each_whichever_way_the_force_acts(name, sign):
    motion, effort = curves(4)
    effort = sign * effort
    rows = ManyWindows(motion, effort, lambda _, rows: (rows.max(axis=1), rows.min(axis=1)))
    found = metric_of(name, rows, 10.0)
    wanted = [alone(motion[k], [effort[k]], None, name) for k in range(COUNT)]
    assert np.allclose(found, wanted, rtol=1e-12, atol=0.0)
    assert np.ptp(found) > 1e-3


def test_a_spread_is_judged_in_the_direction_of_its_mean_and_without_a_target_nothing_deviates_from_it():
    assert Spread.from_extremes(-0.5, 2.0, -3.0)[:4] == (0.5, 3.0, -2.0, -1.0)
    rows = ManyWindows(np.arange(2.0), np.array([[-1.0, -3.0], [1.0, -3.0]]), lambda _, e: (e.max(1), e.min(1)))
    assert metric_of("force_ripple", rows, np.nan) == pytest.approx([2 / 3, 4 / 3])
    assert metric_of("force_max", rows, np.nan).tolist() == [-1.0, 1.0]
    assert np.isnan(metric_of("deviation_from_target", rows, np.nan)).all()


def test_the_first_95_percent_alone_are_those_that_are_solved_for_beside_the_bands():
    def effort(places, _rows):
        return np.tanh(places) * (1.0 - 0.02 * places)

    motion = np.linspace(0.0, 4.0, 41)[None]
    many = ManyBranches(motion, effort(motion, None), np.array([0.0]), np.array([4.0]), exact=effort)
    with np.errstate(all="ignore"):
        both = many.solved
        alone = ManyBranches(motion, many.effort, many.low, many.high, exact=effort)
        np.testing.assert_allclose(alone.rise, both[0], rtol=1e-11)
        np.testing.assert_allclose(alone.bands, both[1], rtol=1e-11)


@pytest.mark.parametrize("mean", [-3e-16, 0.0, 3e-16])
def test_where_the_mean_is_zero_the_larger_extreme_says_the_direction(mean):
    """Over a full turn the rounding of the mean decided: a ripple of 197.5 or 202.6 % by the number of points."""
    alone = Spread.from_extremes(mean, 1.25, -1.5)
    many = Spread.from_extremes(np.array([mean, 0.5]), np.array([1.25, 2.0]), np.array([-1.5, -3.0]))
    assert alone == (0.0, 1.5, -1.25, -1.0, 0.0)
    assert tuple(float(item[0]) for item in many[:4]) == alone[:4]
    assert tuple(float(item[1]) for item in many[:4]) == (0.5, 2.0, -3.0, 1.0)

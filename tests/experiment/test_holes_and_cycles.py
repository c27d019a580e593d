"""Holes in a recording, cycles of unequal travel, and samples that are not uniform in the displacement."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_support import triangle

import cfmkit
from cfmkit.errors import DataError, UsageError
from cfmkit.experiment.reading import Recording
from cfmkit.metrics import Window

WINDOW = (0.004, 0.024)


def law(s):
    """A force with a hump at 13.5 mm [N], over the displacement [mm]."""
    return 11.0 + 3.5 * np.exp(-(((s - 13.5) / 2.5) ** 2))


def loop(cycles=1, stroke=28.0, points=112):
    motion = triangle(cycles, points, stroke)
    way = np.sign(np.diff(motion, append=motion[-2]))
    return motion, way, law(motion) + 0.25 * way


def recording(motion, force):
    return Recording("made.csv", np.asarray(motion) * 1e-3, np.asarray(force))


def report(motion, force, window=WINDOW, **options):
    return cfmkit.measure(recording(motion, force), window=window, filter="none", **options)


def with_hole(low, high, branch=0.0, cycle=None, cycles=1, keep=()):
    """A loop without what is between two places [mm], on both branches or on one, in all cycles or in one."""
    motion, way, force = loop(cycles)
    number = np.minimum(np.arange(len(motion)) // (2 * 112), cycles - 1)
    inside = (motion > low) & (motion < high) & ((way == branch) | (branch == 0))
    inside &= (number == cycle) if cycle is not None else True
    for place in keep:
        inside &= np.abs(motion - place) > 0.05
    return motion[~inside], force[~inside]


def test_without_a_hole_everything_is_known_and_covered():
    found = report(*loop()[::2])
    assert found.numbers.raw["force_ripple[load]"].value == pytest.approx(1 - 11.25 / 14.75, abs=2e-3)
    assert found.numbers.raw["coverage[load]"].value == 1.0
    assert (found.data["status"], found.numbers.holes) == ("complete", ())


@pytest.mark.parametrize(
    ("hole", "branches", "share"),
    [
        ({"low": 9, "high": 18}, ("load", "unload"), 0.45),
        ({"low": 9, "high": 18, "branch": 1.0}, ("load",), 0.45),
        ({"low": 9, "high": 18, "branch": -1.0}, ("unload",), 0.45),
        ({"low": 2, "high": 6}, ("load", "unload"), 0.10),
        ({"low": 22, "high": 26}, ("load", "unload"), 0.10),
        ({"low": 12, "high": 14}, ("load", "unload"), 0.10),
        ({"low": 9, "high": 18, "keep": (12.0, 15.0)}, ("load", "unload"), 0.45),
        ({"low": 9, "high": 18, "branch": 1.0, "cycle": 1, "cycles": 3}, ("load",), 0.45),
    ],
)
def test_what_holds_over_a_hole_has_no_value_and_the_hole_is_named(hole, branches, share):
    found = report(*with_hole(**hole))
    raw = found.numbers.raw
    for branch in ("load", "unload"):
        for metric in ("force_mean", "force_sd", "force_max", "force_ripple", "deviation_from_mean", "band_range_5pct"):
            assert (raw[f"{metric}[{branch}]"].value is None) == (branch in branches), (metric, branch)
    assert raw["force_mean"].value is raw["hysteresis_area"].value is None
    assert min(raw[f"coverage[{branch}]"].value for branch in branches) == pytest.approx(1 - share, abs=1e-9)
    (warning,) = [item for item in found.warnings if item.name == "holes"]
    low, high = max(hole["low"], 4), min(hole["high"], 24)
    assert all(f"{end}" in warning.message for end in (low, high) if "keep" not in hole)
    assert found.data["status"] == "partial"
    assert found.data["message"] == warning.message


def test_a_hole_in_one_cycle_of_several_is_avoided_by_choosing_others():
    motion, force = with_hole(9, 18, cycle=1, cycles=3)
    found = report(motion, force)
    assert "of cycle 2" in found.warnings[-1].message
    assert [item["force_mean[load]"].value is None for item in found.numbers.cycle_metrics] == [False, True, False]
    assert report(motion, force, cycles="3").numbers.raw["force_mean"].value is not None


def test_a_hole_outside_the_window_does_not_matter():
    found = report(*with_hole(9, 18), window=(0.019, 0.027))
    assert found.numbers.raw["force_mean"].value is not None
    assert found.numbers.raw["coverage"].value == 1.0


def test_how_large_a_hole_may_be_is_the_users_choice():
    motion, force = with_hole(12, 13)  # three samples, the way over which they lack is 1 mm
    assert report(motion, force).numbers.raw["force_mean"].value is None
    assert report(motion, force, max_hole="6 %").numbers.raw["force_mean"].value is not None
    assert report(motion, force, max_hole=0.06).numbers.raw["coverage"].value == pytest.approx(0.95)
    for wrong in ("6", "0 %", "120 %", "5 mm"):
        with pytest.raises(UsageError, match="--max-hole"):
            report(motion, force, max_hole=wrong)


@pytest.mark.parametrize("points", [10, 20, 40])
def test_a_coarse_recording_has_no_holes(points):
    motion, _, force = loop(points=points)
    assert report(motion, force).numbers.holes == ()


def test_dense_samples_at_random_places_leave_no_holes():
    for seed in range(20):
        up = np.sort(np.random.default_rng(seed).uniform(0, 28, 1200))
        motion = np.concatenate([up, up[::-1]])
        assert report(motion, law(motion)).numbers.holes == (), seed


def uneven(weights, seed=0):
    """Displacements up and down whose density changes along the way [mm]."""
    places = np.concatenate([np.arange(a, b, step) for a, b, step in weights] + [[weights[-1][1]]])
    return np.concatenate([places, places[-2::-1]])


@pytest.mark.parametrize(
    "steps",
    [
        [(0, 12, 0.02), (12, 26, 0.5)],
        [(0, 5, 0.5), (5, 9, 0.01), (9, 26, 0.25)],
        [(0, 26, 0.1)],
        [(0, 13, 0.3), (13, 26, 0.03)],
    ],
)
def test_means_deviations_and_loops_are_over_the_displacement_wherever_the_samples_are(steps):
    motion = uneven(steps)
    turn = len(motion) // 2
    force = 9.0 + np.clip((motion - 8.0) / 2.0, 0.0, 3.0) - 0.4 * (np.arange(len(motion)) > turn)
    raw = report(motion, force, window=(0.003, 0.023)).numbers.raw
    s = np.linspace(3, 23, 200_001)
    truth = 9.0 + np.clip((s - 8.0) / 2.0, 0.0, 3.0)
    assert raw["force_mean[load]"].value == pytest.approx(truth.mean(), abs=2e-3)
    assert raw["force_sd[load]"].value == pytest.approx(truth.std(), rel=2e-3)
    assert raw["deviation_from_mean[load]"].value == pytest.approx((truth.mean() - 9) / truth.mean(), abs=1e-3)
    assert raw["hysteresis_area"].value == pytest.approx(8e-3, rel=2e-3)
    for metric in ("force_mean[load]", "force_sd[unload]"):
        assert "over the displacement in the window, each sample weighted" in raw[metric].definition


def test_the_deviation_of_noise_is_that_of_the_noise():
    motion = triangle(1, 4000, 28.0)
    force = 50.0 + np.random.default_rng(0).normal(0, 0.1, len(motion))
    assert report(motion, force).numbers.raw["force_sd[load]"].value == pytest.approx(0.1, rel=0.03)


def cycles_of(*strokes, step=0.2):
    """One cycle up to each of some travels [mm], with a gap of half a newton."""
    parts = [np.concatenate([np.arange(0, stroke, step), np.arange(stroke, step / 2, -step)]) for stroke in strokes]
    motion = np.concatenate([*parts, [0.0]])
    way = np.sign(np.diff(motion, append=motion[-2]))
    return motion, law(motion) + 0.25 * way


@pytest.mark.parametrize(
    ("travels", "name", "left", "kept"),
    [
        ((4, 27, 27), "seating_cycles", "seating cycle 1 (0 ... 4 mm) is left out", 2),
        ((3, 5, 27, 27, 27), "seating_cycles", "seating cycles 1 (0 ... 3 mm), 2 (", 3),
        ((27, 27, 4), "short_cycles", "cycle 3 (", 2),
        ((27, 10, 27), "short_cycles", "cycle 2 (", 2),
        ((27, 26, 27), None, "", 3),
    ],
)
def test_cycles_that_cover_less_are_left_out_and_named(travels, name, left, kept):
    motion, force = cycles_of(*travels)
    found = report(motion, force, window=None)
    assert len(found.source.raw) == kept
    assert [item.name for item in found.warnings if "cycles" in item.name] == ([name] if name else [])
    assert left in " ".join(item.message for item in found.warnings)
    assert found.numbers.window.hi > 0.0255
    full = report(*cycles_of(27, 27), window=(0.005, 0.024)).numbers.raw
    mine = report(motion, force, window=(0.005, 0.024)).numbers.raw
    for metric in ("force_mean[load]", "force_ripple[unload]", "hysteresis_area"):
        assert mine[metric].value == pytest.approx(full[metric].value, rel=1e-3)


def test_the_user_chooses_cycles_by_their_numbers():
    motion, force = cycles_of(4, 27, 27, 27)
    assert [curve.label["cycle"][0] for curve in report(motion, force, cycles="2:3").source.raw] == [2, 3]
    assert len(report(motion, force, cycles="4").source.raw) == 1
    every = report(motion, force, window=None, cycles="1:4")
    assert every.numbers.window.hi < 0.0042
    (cut,) = [item for item in every.warnings if item.name == "window_cut"]
    assert "'unload' of cycle 1" in cut.message


@pytest.mark.parametrize(
    ("text", "error", "complaint"),
    [
        ("2-3", UsageError, "'2-3' is not 'first:last'"),
        ("3:2", UsageError, "'3:2' is not"),
        ("0:2", UsageError, "'0:2' is not"),
        ("2:9", DataError, "cycle 9 is not there; cycles 1 to 3 can be measured"),
    ],
)
def test_cycles_that_are_not_there_are_refused(text, error, complaint):
    with pytest.raises(error, match=complaint):
        report(*cycles_of(4, 27, 27), cycles=text)


def test_a_branch_that_begins_late_cuts_the_window_and_is_named():
    motion, way, force = loop(2)
    late = (np.arange(len(motion)) > 224) & (way > 0) & (motion < 2.5)
    found = report(motion[~late], force[~late], window=None)
    assert found.numbers.window.lo == pytest.approx(0.0025, abs=3e-4)
    assert "on 'load' of cycle 2" in next(item.message for item in found.warnings if item.name == "window_cut")
    assert isinstance(found.numbers.window, Window)

"""What happens next to reversals spoils no number: made loops whose ripple is known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from experiment_support import lossy_loop, reference_case, rows, triangle

import cfmkit
from cfmkit.errors import UsageError
from cfmkit.experiment.corrections_and_low_pass import correct_recording
from cfmkit.experiment.curves_and_metrics_of_recording import LEFT_OUT, measure_recording, numbers_of
from cfmkit.experiment.parameters_to_fit import parameters
from cfmkit.experiment.reading import Recording
from cfmkit.metrics import Window


def ripples(numbers, gap=1.0):
    """Raw and filtered ripple of each branch over the true one, 0.6 N over the largest force."""
    found = {}
    for branch, way in (("load", 1.0), ("unload", -1.0)):
        truth = 0.6 / (50.3 + 0.5 * gap * way)
        found[branch] = [part[f"force_ripple[{branch}]"].value / truth for part in (numbers.raw, numbers.filtered)]
    return np.concatenate(list(found.values()))


def names(*findings):
    return {item.name for item in findings}


@pytest.mark.parametrize("cycles", [1, 2, 5])
@pytest.mark.parametrize(("points", "stroke"), [(200, 100.0), (450, 60.0), (900, 240.0)])
def test_the_sample_at_a_reversal_spoils_no_filtered_number(cycles, points, stroke):
    source = measure_recording(lossy_loop(triangle(cycles, points, stroke)))
    assert ripples(numbers_of(source)) == pytest.approx(np.ones(4), abs=2e-3)
    assert source.warnings == ()


@pytest.mark.parametrize("decay", [False, True], ids=["spring and dry friction", "exponential"])
@pytest.mark.parametrize(("elastic", "gap"), [(0.3, 1.0), (1.0, 1.0), (1.0, 0.3), (3.0, 2.0)])
@pytest.mark.parametrize(("points", "stroke"), [(200, 100.0), (1000, 60.0)])
def test_an_elastic_reversal_spoils_neither_raw_nor_filtered_numbers(elastic, gap, decay, points, stroke):
    source = measure_recording(lossy_loop(triangle(2, points, stroke), gap, elastic, decay))
    numbers = numbers_of(source)
    assert ripples(numbers, gap) == pytest.approx(np.ones(4), abs=5e-3)
    # A passage shorter than a sample costs the sample at the reversal only, which is no news.
    assert names(*source.warnings) == ({"reversals"} if elastic > stroke / points else set())
    assert stroke * 1e-3 - numbers.window.hi < 2.2e-3 * elastic + 2e-3 * stroke / points


@pytest.mark.parametrize("seed", range(4))
def test_an_elastic_reversal_is_seen_through_noise(seed):
    """0.05 N of noise, 20 samples per mm: the filter leaves 3 mN of it, the passage would be 1 N."""
    source = measure_recording(lossy_loop(triangle(2, 2000), 1.0, 1.0, noise=0.05, seed=seed))
    assert ripples(numbers_of(source))[[1, 3]] == pytest.approx(np.ones(2), abs=0.15)
    as_recorded = measure_recording(lossy_loop(triangle(2, 2000), 1.0, 1.0, noise=0.05, seed=seed), leave_out=())
    assert ripples(numbers_of(as_recorded))[3] > 1.5


def test_play_at_a_reversal_is_left_out():
    """Over 0.8 mm of the way back the force waits, then it jumps."""
    case = lossy_loop(triangle(2, 400))
    motion = np.array(case.motion)
    effort, last = np.array(case.effort), 0
    for top in (400, 800, 1200):
        assert top > last
        effort[top : top + 4] = effort[top - 1]
        last = top
    source = measure_recording(replace(case, motion=motion, effort=effort))
    assert ripples(numbers_of(source)) == pytest.approx(np.ones(4), abs=3e-3)


@pytest.mark.parametrize("gap", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_where_the_force_jumps_at_the_reversal_noise_costs_few_points(gap, seed):
    """Both strokes on their own branch to the last sample: nothing is to be left out but by chance."""
    motion = triangle(2, 400)
    way = np.sign(np.diff(motion, prepend=-0.1))
    force = 50 + 0.5 * gap * way + np.random.default_rng(seed).normal(0, 0.1, len(motion))
    source = measure_recording(Recording("made.csv", motion * 1e-3, force))
    assert source.warnings == ()


def test_what_both_branches_have_in_common_is_no_passage():
    """The force rises from nothing over 3 mm, on both ways, and the gap narrows along the travel."""
    up = np.linspace(0.0, 100.0, 401)
    level = 50 * np.minimum(up / 3.0, 1.0)
    half = 0.5 - 0.003 * up
    force = np.concatenate([level + half, (level - half)[::-1]])
    source = measure_recording(Recording("made.csv", np.concatenate([up, up[::-1]]) * 1e-3, force))
    assert source.warnings == ()


def test_a_window_that_touches_a_reversal_is_shortened_and_the_user_is_told():
    source = measure_recording(lossy_loop(triangle(2), elastic=1.0))
    numbers = numbers_of(source, window=Window(0.0, 0.1))
    assert names(*numbers.warnings) == {"window_at_reversal"}
    assert numbers.warnings[0].message.startswith(
        "the window 0 ... 100 mm touches a reversal: the numbers hold over 1.5"
    )
    assert ripples(numbers) == pytest.approx(np.ones(4), abs=5e-3)
    assert numbers_of(source, window=Window(0.02, 0.08)).warnings == ()


def test_a_window_to_the_very_reversal_is_said_to_touch_it():
    numbers = numbers_of(measure_recording(lossy_loop(triangle(2))), window=Window(0.0, 0.1))
    assert (numbers.window.lo, numbers.window.hi) == pytest.approx((0.0005, 0.0995))
    assert names(*numbers.warnings) == {"window_at_reversal"}


def test_the_reference_case_loses_no_point():
    source = measure_recording(reference_case())
    assert sum(len(stroke.points) for stroke in source.strokes.strokes) == 2016


def test_as_recorded_keeps_every_point():
    source = measure_recording(lossy_loop(triangle(2), elastic=1.0), leave_out=())
    assert source.warnings == ()
    assert sum(len(stroke.points) for stroke in source.strokes.strokes) == 801


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("seed", range(3))
def test_spikes_are_left_out_and_counted(seed, noise):
    """15 spikes in 1804 samples made a ripple of 1.2 % one of 67 %."""
    case = lossy_loop(triangle(2, 450), noise=noise, seed=seed)
    rng = np.random.default_rng(seed)
    effort = np.array(case.effort)
    where = rng.choice(np.arange(5, len(effort) - 5, 7), 15, replace=False)
    effort[where] += rng.choice([-1, 1], 15) * rng.uniform(5.0, 40.0, 15)
    numbers = numbers_of(measure_recording(replace(case, effort=effort), leave_out=LEFT_OUT))
    clean = numbers_of(measure_recording(case))
    finding = measure_recording(replace(case, effort=effort), leave_out=LEFT_OUT).warnings[0]
    assert finding.name == "spikes"
    assert finding.message.startswith(f"15 of {len(effort)} points are far from their neighbours")
    assert ripples(numbers) == pytest.approx(ripples(clean), rel=0.02 if noise == 0 else 0.15)


def test_spikes_of_the_displacement_make_no_strokes():
    case = lossy_loop(triangle(1, 400))
    motion = np.array(case.motion)
    motion[[100, 350, 351, 600]] = [0.09, 0.0, 0.0, 0.2]
    source = measure_recording(replace(case, motion=motion), leave_out=LEFT_OUT)
    assert [stroke.branch for stroke in source.strokes.strokes] == ["load", "unload"]
    assert ripples(numbers_of(source)) == pytest.approx(np.ones(4), abs=3e-3)


def test_one_glitch_of_the_displacement_changes_neither_filter_nor_tare_nor_bounds():
    """One sample of 10 m in a travel of 100 mm had made everything that goes by the travel a hundred times too long."""
    case = lossy_loop(triangle(1, 400))
    motion = np.array(case.motion)
    motion[300] = 10.0
    glitch = replace(case, motion=motion)
    assert glitch.travel == case.travel == np.ptp(case.motion)
    assert measure_recording(glitch, leave_out=LEFT_OUT).low_pass == measure_recording(case).low_pass
    assert ripples(numbers_of(measure_recording(glitch, leave_out=LEFT_OUT))) == pytest.approx(np.ones(4), abs=3e-3)
    assert correct_recording(glitch, tare="start").zeros == correct_recording(case, tare="start").zeros
    spec = cfmkit.load("configs/cam.yaml")
    zeros = [parameters(spec, ["data.displacement_offset"], recording=one)[0] for one in (glitch, case)]
    assert zeros[0] == zeros[1]


def test_a_corner_that_every_stroke_shows_is_no_spike():
    """The published cam starts on a corner: 0, 53.7, 51.3, 50.3 N over the first 1.5 mm, and back."""
    case = lossy_loop(triangle(2, 400))
    extra = np.interp(1e3 * case.motion, [0.0, 0.25, 0.5, 0.75, 1.0, 1.5], [-50.0, 4.0, 2.0, 1.0, 0.0, 0.0])
    detent = 5.0 * (np.abs(1e3 * case.motion - 60.0) < 0.2)
    source = measure_recording(replace(case, effort=case.effort + extra + detent), leave_out=LEFT_OUT)
    assert source.warnings == ()


def test_python_measures_files_and_arrays_alike(tmp_path):
    case = lossy_loop(triangle(2), elastic=1.0)
    (tmp_path / "rig.csv").write_text(
        "t [s];s [mm];F [N]\n" + rows((case.time, 1e3 * case.motion, case.effort), digits=12)
    )
    window = {"window": "10 mm:90 mm", "filter": "2 Hz", "target": "50 N"}
    one, other = cfmkit.measure(tmp_path / "rig.csv", **window), cfmkit.measure(case, **window)
    si = cfmkit.measure(case, window=(0.01, 0.09), filter="2 Hz", target=50.0)
    for found in (other, si):
        for name, value in one.numbers.filtered.items():
            if value.value is None:
                assert found.numbers.filtered[name].value is None, name
                continue
            assert found.numbers.filtered[name].value == pytest.approx(value.value, rel=1e-9, abs=1e-12), name
    assert names(*one.warnings) == {"reversals"}
    assert one.data["metrics"]["force_mean"]["unit"] == "N"


@pytest.mark.parametrize("window", [(0.09, 0.01), "90 mm:10 mm"])
def test_a_window_that_does_not_increase_is_refused_as_text_and_as_numbers(window):
    with pytest.raises(UsageError, match=r"--window: .* must be increasing"):
        cfmkit.measure(lossy_loop(triangle(2), elastic=1.0), window=window)

"""What a measured loop says about friction and rest length: made by the model with known values, and found again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cam_support import analyze, cam

import cfmkit
from cfmkit.experiment.comparison import compare
from cfmkit.experiment.curves_and_metrics_of_recording import measure_recording
from cfmkit.experiment.reading import Recording, read_recording

CONFIGS = Path(__file__).parents[2] / "configs"
PART = {"profile__rest_half_width": 0.068}
WINDOW = {"analysis__window": [0.04, 0.21]}


def recorded(curve, noise=0.0, keep=slice(None)):
    """Return the curve of a model as a recording."""
    force = curve.force + np.random.default_rng(0).normal(0.0, noise, len(curve)) if noise else curve.force
    good = np.isfinite(force)
    return measure_recording(Recording("made.csv", curve.motion[good][keep], force[good][keep]), None)


def causes(source, **changes):
    result = analyze(cam(**WINDOW, **changes))
    return {name: item.value for name, item in compare(result, source).causes(result).items()}


@pytest.mark.parametrize("friction", [0.0005, 0.00225, 0.01])
@pytest.mark.parametrize("longer", [-0.4e-3, 0.0, 0.7e-3])
def test_friction_and_rest_length_of_a_made_loop_are_found_from_other_values(friction, longer):
    truth = analyze(cam(rolling_friction=friction, rest_half_width=0.068 + longer / 2, **PART)).curve
    found = causes(recorded(truth), rolling_friction=0.002, **PART)
    assert found["data_friction"] == pytest.approx(friction, rel=1e-3)
    assert found["data_rest_error"] == pytest.approx(longer, abs=3e-7)
    assert found["data_unexplained"] < 0.01
    assert found["data_by_profile"] == 0


def test_the_area_that_the_paper_measured_is_a_friction_of_0_00225():
    """0.259 N m from 40 to 210 mm [SS, table 3], with the measured 1.365 N/mm; area and friction are proportional."""
    truth = analyze(cam(rolling_friction=0.002, springs={"stiffness": 1365.0})).curve
    half = 0.5 * np.where(truth.branch == "load", 1, -1) * (0.259 - 0.23044378) / 0.170
    source = measure_recording(Recording("made.csv", truth.motion, np.nan_to_num(truth.force + half)), None)
    assert causes(source, springs={"stiffness": 1365.0})["data_friction"] == pytest.approx(0.00225, abs=5e-6)


def test_the_parts_are_those_of_the_closed_forms():
    """The rest length takes d/D of the force, D the way of the roller; friction adds eps on the way up."""
    truth = analyze(cam(rolling_friction=0.002, rest_half_width=0.06825, **PART)).curve
    found = causes(recorded(truth), rolling_friction=0.0, **PART)
    s = np.linspace(0.04, 0.21, 5001)
    way = np.sqrt(2 * 9.058e-3 * s)
    slope = way / 9.058e-3 + (0.068 + way) / np.sqrt(0.2**2 - (0.068 + way) ** 2)
    force = 4 * 1365 * 9.058e-3
    assert found["data_by_rest_length"] == pytest.approx(force * np.sqrt(np.mean((0.00025 / way) ** 2)), rel=2e-3)
    eps = 0.002 * (1 + slope**2) * 9.058e-3 / way
    assert found["data_by_friction"] == pytest.approx(force * np.sqrt(np.mean(eps**2)), rel=1e-2)


def test_on_the_shipped_built_cam_profile_friction_and_rest_length_are_told_apart():
    result = cfmkit.analyze(cfmkit.load(CONFIGS / "cam_as_built.yaml"))
    source = measure_recording(read_recording(CONFIGS / "synthetic/cam_loop.csv"), None)
    found = {name: item.value for name, item in compare(result, source).causes(result).items()}
    assert found["data_friction"] == pytest.approx(0.00225, abs=2e-5)
    assert found["data_rest_error"] == pytest.approx(0.3e-3, abs=1e-5)
    assert found["data_by_profile"] == pytest.approx(0.355, abs=0.01)
    assert found["data_unexplained"] < 0.05
    squares = sum(found[f"data_by_{name}"] ** 2 for name in ("profile", "friction", "rest_length"))
    assert found["data_off_design"] == pytest.approx(squares**0.5, rel=0.05)  # the parts are nearly orthogonal


def test_one_way_only_and_a_motion_say_nothing_about_causes():
    truth = analyze(cam())
    half = slice(0, len(truth.curve) // 2)
    assert compare(truth, recorded(truth.curve, keep=half)).causes(truth) == {}
    moving = cfmkit.analyze(cfmkit.load(CONFIGS / "cam_dynamics.yaml"))
    assert compare(moving, recorded(truth.curve)).causes(moving) == {}


def test_noise_averages_out():
    truth = analyze(cam(rolling_friction=0.003, rest_half_width=0.0682, **PART)).curve
    found = causes(recorded(truth, noise=0.2), **PART)
    assert found["data_friction"] == pytest.approx(0.003, rel=0.05)
    assert found["data_rest_error"] == pytest.approx(0.4e-3, abs=0.05e-3)

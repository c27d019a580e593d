"""The shipped synthetic data: made by the script that says so, and what is put in is found again."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

import cfmkit
from cfmkit import api
from cfmkit.experiment.calibration import calibrate
from cfmkit.experiment.curves_and_metrics_of_recording import measure_recording
from cfmkit.experiment.parameters_to_fit import parameters
from cfmkit.experiment.reading import read_recording

CONFIGS = Path(__file__).parents[2] / "configs"
DATA = CONFIGS / "synthetic"


@pytest.fixture(scope="module")
def script():
    described = importlib.util.spec_from_file_location("make_cam_data", DATA / "make_cam_data.py")
    module = importlib.util.module_from_spec(described)
    described.loader.exec_module(module)
    return module


def test_the_script_makes_the_shipped_files(script, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_cam_data.py", str(tmp_path)])
    script.main()
    for name in ("cam_flanks.csv", "cam_loop.csv"):
        assert (tmp_path / name).read_text() == (DATA / name).read_text(), name


@pytest.mark.parametrize("name", ["cam_flanks.csv", "cam_loop.csv"])
def test_every_file_says_in_its_first_line_that_it_is_synthetic(name):
    assert (DATA / name).read_text().startswith("synthetic: made by configs/synthetic/make_cam_data.py")


def test_friction_and_rest_length_that_were_put_in_are_calibrated_on_the_built_cam(script):
    spec = api.resolve(cfmkit.load(CONFIGS / "cam_as_built.yaml"))
    chosen = parameters(spec, ["mechanism.rolling_friction", "mechanism.rest_half_width"])
    found = calibrate(spec, measure_recording(read_recording(DATA / "cam_loop.csv"), None), chosen)
    truth = (script.FRICTION, 0.068 + script.LONGER)
    for value, width, expected in zip(found.fit.values, found.fit.half_widths(), truth, strict=True):
        assert abs(value - expected) < 1.5 * width < 0.02 * expected

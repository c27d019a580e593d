"""`cfmkit.sweep` and `cfmkit.sensitivity` say what the files of a study say."""

import json

import numpy as np
import pytest

import cfmkit
from cfmkit.tables import to_csv

CAM = cfmkit.load("configs/cam.yaml", ["analysis.points=121"])
RADIUS = "mechanism.roller_radius"
TOLERANCES = {RADIUS: {"uniform": "0.05 mm"}, "mechanism.springs.stiffness": {"normal": "1 %"}}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_sweep_gives_the_rows_of_results_csv(cli, tmp_path, jobs):
    found = cfmkit.sweep(CAM, jobs, vary={RADIUS: "8 mm:16 mm:5"}, metrics=("force_ripple", "force_mean"))
    (tmp_path / "cam.yaml").write_text(cfmkit.dumps(CAM))
    options = ["--vary", f"{RADIUS}=8 mm:16 mm:5", "--metrics", "force_ripple,force_mean", "--no-plots"]
    assert cli("sweep", str(tmp_path / "cam.yaml"), *options, "-o", str(tmp_path / "out")).code == 0
    assert to_csv(found.table) == (tmp_path / "out" / "results.csv").read_bytes()
    assert found.summary == json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert found.table["status"] == ("complete",) * 5
    assert (found.curves, found.indices) == (None, None)


@pytest.mark.parametrize(
    ("path", "values", "texts"),
    [
        (RADIUS, np.array([8e-3, 12e-3, 16e-3]), ["8 mm", "12 mm", "16 mm"]),
        (RADIUS, list(np.array([8e-3, 16e-3])), ["8 mm", "16 mm"]),
        ("mechanism.rolling_friction", np.array([0.001, 0.003]), [0.001, 0.003]),
        ("mechanism.springs.count", np.arange(1, 3), [1, 2]),
        ("mechanism.springs.count", range(2, 5), [2, 3, 4]),
        ("analysis.points", range(41, 20, -20), [41, 21]),
        ("mechanism.springs.stiffness", np.array(["0.5 N/mm", "1 N/mm"]), ["0.5 N/mm", "1 N/mm"]),
        ("analysis.gravity", np.array([True, False]), [True, False]),
    ],
)
def test_arrays_are_values_in_si_units(path, values, texts):
    one, other = (cfmkit.sweep(CAM, vary={path: each}, metrics=["force_mean"]) for each in (values, texts))
    assert to_csv(one.table) == to_csv(other.table)
    assert one.table["status"] == ("complete",) * len(texts)


def test_arrays_are_taken_by_a_sensitivity_study():
    stiffness = {"mechanism.springs.stiffness": {"uniform": np.float64(20.0)}}
    texts = {"mechanism.springs.stiffness": {"uniform": "0.02 N/mm"}}
    one, other = (
        cfmkit.sensitivity(CAM, method="tolerance", samples=4, parameters=item, metrics=["force_mean"])
        for item in (stiffness, texts)
    )
    assert to_csv(one.table) == to_csv(other.table)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.ones((2, 2)), "an array of 2 dimensions is not a list of values; flatten it"),
        (range(10**30), "mechanism.roller_radius: a range of more than 1000000 values; take fewer"),
        (np.array([0.01, np.nan]), "mechanism.roller_radius: nan cannot be written"),
    ],
)
def test_arrays_that_are_no_values_are_refused(values, words):
    with pytest.raises(cfmkit.UsageError, match=words):
        cfmkit.sweep(CAM, vary={RADIUS: values})


def test_without_arguments_the_block_of_the_specification_counts():
    spec = CAM.replace({"sweep": {"vary": {RADIUS: ("8 mm", "9 mm")}, "metrics": ("force_mean",), "curves": True}})
    found = cfmkit.sweep(spec)
    assert len(found.table) == 2
    assert len(found.curves) == 2 * 2 * 121
    assert len(cfmkit.sweep(spec, vary={RADIUS: "8 mm:10 mm:3"}).table) == 3


def test_a_failed_point_is_a_row_without_values():
    found = cfmkit.sweep(CAM, vary={RADIUS: ["8 mm", "-1 mm"]}, metrics=["force_mean"])
    assert found.table["status"] == ("complete", "invalid")
    assert found.summary["status"] == "partial"


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: cfmkit.sweep(CAM), cfmkit.UsageError, "nothing to vary"),
        (lambda: cfmkit.sweep(CAM, vary={RADIUS: [8.0]}), cfmkit.SpecError, "has no unit"),
        (lambda: cfmkit.sweep(CAM, vary={RADIUS: "8 mm:9 mm:3"}, points=3), TypeError, "points"),
        (lambda: cfmkit.sweep(CAM, seed=-1), cfmkit.UsageError, "seed"),
        (lambda: cfmkit.sweep(CAM, jobs=0, vary={RADIUS: "8 mm:9 mm:3"}), cfmkit.UsageError, "jobs"),
        (lambda: cfmkit.sensitivity(CAM), cfmkit.UsageError, "nothing to vary"),
        (lambda: cfmkit.sensitivity(CAM, parameters=TOLERANCES, method="guess"), cfmkit.SpecError, "guess"),
    ],
)
def test_what_makes_no_sense_is_refused_as_on_the_command_line(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_a_sensitivity_gives_samples_indices_and_summary():
    found = cfmkit.sensitivity(CAM, method="tolerance", samples=8, parameters=TOLERANCES, seed=3)
    again = cfmkit.sensitivity(CAM, 2, method="tolerance", samples=8, parameters=TOLERANCES, seed=3)
    other = cfmkit.sensitivity(CAM, method="tolerance", samples=8, parameters=TOLERANCES, seed=4)
    assert len(found.table) == 8 * 3
    assert set(found.indices["index"]) == {"yield_gain_when_halved", "variance_drop_when_halved"}
    assert found.summary["samples"]["seed"] == 3
    assert to_csv(found.table) == to_csv(again.table) != to_csv(other.table)
    assert to_csv(found.indices) == to_csv(again.indices)
    assert found.convergence is None

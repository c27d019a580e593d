"""`analyze --compare-fidelity` as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit import Run
from cfmkit.studies import choices_of, compare
from cfmkit.tables import read_csv

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def moving(tmp_path):
    """The published cam in motion, as ``moving.yaml`` in the folder of `cli`."""
    (tmp_path / "moving.yaml").write_bytes((CONFIGS / "cam_dynamics.yaml").read_bytes())
    return "moving.yaml"


def document(cli, folder="out"):
    return json.loads((cli.folder / folder / "metrics.json").read_text())


def test_all_models_stand_in_one_table_one_figure_and_in_numbers(cli, moving):
    done = cli("analyze", moving, "--compare-fidelity", "-o", "out")
    assert (done.code, done.err) == (0, "")
    assert "fidelity quasi-static - dynamic on load: rms " in " ".join(done.out.split())
    assert (cli.folder / "out/figures/fidelity.png").read_bytes().startswith(b"\x89PNG")
    table = read_csv((cli.folder / "out/curve.csv").read_bytes())
    assert table.headers[:4] == ("fidelity", "branch", "displacement [mm]", "force [N]")
    assert list(dict.fromkeys(table["fidelity"])) == ["dynamic", "quasi-static"]  # the nominal one first
    reported = document(cli)
    assert reported["fidelity"]["reference"] == "dynamic"
    assert [(item["fidelity"], item["status"]) for item in reported["fidelity"]["curves"]] == [
        ("dynamic", "complete"),
        ("quasi-static", "complete"),
    ]
    assert reported["metrics"]["fidelity_rms[quasi-static]"]["unit"] == "N"
    assert "(quasi-static - dynamic) force" in reported["metrics"]["fidelity_rms[quasi-static]"]["definition"]


def test_the_numbers_are_those_of_the_curves_in_the_table(cli, moving):
    cli("analyze", moving, "--compare-fidelity", "-o", "out", "--no-plots")
    table = read_csv((cli.folder / "out/curve.csv").read_bytes())
    fidelity, branch = np.array(table["fidelity"]), np.array(table["branch"])
    motion, force = np.array(table["displacement"]), np.array(table["force"])
    fine, coarse = fidelity == "dynamic", (fidelity == "quasi-static") & (branch == "load")
    places = np.linspace(motion[fine].min(), motion[fine].max(), 1001)
    gap = np.interp(places, motion[coarse], force[coarse]) - np.interp(places, motion[fine], force[fine])
    found = {name: item["value"] for name, item in document(cli)["metrics"].items() if name.startswith("fidelity")}
    assert found == {
        "fidelity_rms[quasi-static]": pytest.approx(np.sqrt(np.mean(gap**2)), rel=1e-9),
        "fidelity_max[quasi-static]": pytest.approx(gap[np.abs(gap).argmax()], rel=1e-9),
        "fidelity_mean[quasi-static]": pytest.approx(gap.mean(), abs=1e-9),
    }


def test_from_rest_to_rest_inertia_takes_no_work():
    """The mean times the stroke is the work of the difference: kinetic energy begins and ends at zero."""
    spec = cfmkit.load(CONFIGS / "cam_dynamics.yaml")
    spec = spec.replace({"analysis.dynamics.points": 20001, "analysis.points": 20001})
    found = compare(cfmkit.analyze(spec), choices_of(spec), Run()).metrics()
    assert found["fidelity_mean[quasi-static]"].value == pytest.approx(0.0, abs=1e-3)
    assert found["fidelity_rms[quasi-static]"].value == pytest.approx(38.29, abs=0.02)


def test_the_chosen_fidelity_is_the_nominal_one(cli, moving):
    cli("analyze", moving, "--compare-fidelity", "--fidelity", "quasi-static", "-o", "out", "--no-plots")
    table = read_csv((cli.folder / "out/curve.csv").read_bytes())
    assert list(dict.fromkeys(table["fidelity"])) == ["quasi-static", "dynamic"]
    assert document(cli)["fidelity"]["reference"] == "dynamic"


def test_a_spec_with_data_for_one_model_only_is_refused_in_one_line(cli, cam):
    done = cli("analyze", cam, "--compare-fidelity", "-o", "out")
    assert (done.code, done.out) == (3, "")
    assert done.err.splitlines() == [
        "--compare-fidelity: needs two models; 'dynamic' cannot run here: the dynamic model needs a motion: "
        "add 'analysis.dynamics'"
    ]
    assert not (cli.folder / "out/metrics.json").exists()


@pytest.mark.parametrize("start", ["400 mm", "700 mm"])
def test_a_second_curve_that_ends_early_or_fails_makes_the_run_partial(cli, moving, start):
    wanted = ("--compare-fidelity", "--fidelity", "quasi-static", "--set", f"analysis.dynamics.slider_position={start}")
    done = cli("analyze", moving, *wanted, "-o", "out", "-q")
    assert done.code == 6
    assert done.err.startswith("partial  fidelity dynamic: the requested motion of the slider is from ")
    reported = document(cli)
    assert (reported["status"], reported["message"].split(":")[0]) == ("partial", "fidelity dynamic")
    assert (reported["metrics"]["fidelity_rms[quasi-static]"]["value"] is None) == (start == "700 mm")
    assert (cli.folder / "out/figures/fidelity.png").exists()
    assert json.loads((cli.folder / "out/manifest.json").read_text())["exit_code"] == 6


def test_a_nominal_curve_that_fails_keeps_its_exit_code_and_the_others_are_written(cli, moving):
    wanted = ("--compare-fidelity", "--set", "analysis.dynamics.slider_position=700 mm", "--no-plots")
    done = cli("analyze", moving, *wanted, "-o", "out", "--json")
    assert (done.code, done.document["status"]) == (4, "no_equilibrium")
    assert set(read_csv((cli.folder / "out/curve.csv").read_bytes())["fidelity"]) == {"quasi-static"}


def test_models_and_a_measurement_can_be_laid_over_one_another(cli, moving):
    (cli.folder / "rig.csv").write_text("s [mm];F [N]\n" + "".join(f"{s};{60 + s / 1e3}\n" for s in range(40, 121, 2)))
    done = cli("analyze", moving, "--compare-fidelity", "--data", "rig.csv", "-o", "out", "--no-plots")
    assert done.code == 0
    assert {"data_rmse", "fidelity_rms[quasi-static]"} <= set(document(cli)["metrics"])
    assert {"data", "fidelity"} <= set(document(cli))


def test_without_the_option_nothing_is_said_about_other_models(cli, moving):
    cli("analyze", moving, "-o", "out", "--no-plots")
    assert "fidelity" not in document(cli)
    assert not read_csv((cli.folder / "out/curve.csv").read_bytes()).headers[0].startswith("fidelity")

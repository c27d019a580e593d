"""Slider-cranks as a user runs them: both drives, design, and the map of classes."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def specs(cli):
    for path in [*CONFIGS.glob("slider_crank_*2019*.yaml"), *CONFIGS.glob("studies/slider_crank_class_map.yaml")]:
        (cli.folder / path.name).write_bytes(path.read_bytes())


def table(cli, name):
    return list(csv.DictReader((cli.folder / name).read_text().splitlines()))


@pytest.mark.usefixtures("specs")
def test_torque_mode_writes_angles_torques_and_pictures(cli):
    done = cli("analyze", "slider_crank_li2019.yaml", "-o", "out")
    assert (done.code, done.err) == (0, "")
    rows = table(cli, "out/curve.csv")
    assert list(rows[0])[:4] == ["branch", "angle [deg]", "torque [N*mm]", "stable"]
    assert (float(rows[0]["angle [deg]"]), float(rows[-1]["angle [deg]"])) == (-5.0, 14.0)
    assert {path.stem for path in (cli.folder / "out/figures").iterdir()} == {
        "assembly", "curve", "energy", "springs", "joints", "linkage",
    }  # fmt: skip
    metrics = json.loads((cli.folder / "out/metrics.json").read_text())["metrics"]
    assert metrics["stiffness_class"]["value"] == "zero"
    assert metrics["constant_angle"]["value"] == pytest.approx(2.7088, abs=1e-4)
    assert re.search(r"stiffness class +zero", done.out)


@pytest.mark.usefixtures("specs")
def test_force_mode_starts_at_the_limit_of_the_stretched_position(cli):
    stretched = ("--set", "mechanism.unloaded_offset=0 rad", "--set", "analysis.side=before")
    text = (cli.folder / "slider_crank_bilancia2019.yaml").read_text().replace("  unloaded_angle: 0.542 rad\n", "")
    (cli.folder / "stretched.yaml").write_text(text)
    done = cli("analyze", "stretched.yaml", *stretched, "--set", "requirements=[]", "-o", "out", "--no-plots")
    assert done.code == 0, done.err
    first = table(cli, "out/curve.csv")[0]
    assert float(first["displacement [mm]"]) == 0.0
    assert float(first["force [N]"]) == pytest.approx(1.51193452, abs=5e-9)
    assert "stretched_start" in done.out


@pytest.mark.usefixtures("specs")
def test_the_map_of_classes_is_a_table_of_words_and_a_picture(cli):
    vary = (
        "--vary", "mechanism.springs.crank_pin=0 N*cm/deg:0.02 N*cm/deg:9",
        "--vary", "mechanism.springs.slider_pin=0 N*cm/deg:0.7 N*cm/deg:8",
    )  # fmt: skip
    done = cli("sweep", "slider_crank_class_map.yaml", *vary, "-o", "out", "-j", "1", "--json")
    assert done.code == 0, done.err
    rows = table(cli, "out/results.csv")
    assert len(rows) == 72
    assert {row["stiffness_class"] for row in rows} >= {"bistable", "local negative", "positive"}
    assert rows[0]["stiffness_class"] == "bistable"
    assert (cli.folder / "out/figures/stiffness_class.png").stat().st_size > 5000
    assert "stiffness_class" not in done.document["range"]


@pytest.mark.usefixtures("specs")
def test_a_design_says_which_value_of_an_option_it_replaces(cli):
    """A start that the user sets, and the design does not keep, had been dropped without a word."""
    springs = ("--set", "mechanism.springs={pivot: 20 N*mm/rad}")
    done = cli("design", "slider_crank_bilancia2019.yaml", *springs, "--no-plots", "-o", "out", "--json")
    assert done.code == 0, done.err
    (one,) = [item["message"] for item in done.document["warnings"] if item["name"] == "overwritten"]
    assert one.startswith("'mechanism.springs.pivot' (20 N*mm/rad), which --set states, is replaced by ")
    made = re.search(r"pivot: (\S+) N", (cli.folder / "out/design.yaml").read_text())
    assert f"{float(made[1]):.6g} N*mm/rad" in one
    kept = ("--set", "analysis.points=71", "--set", "mechanism.crank_length=54 mm")
    other = cli("design", "slider_crank_bilancia2019.yaml", *kept, "--no-plots", "-o", "other", "--json")
    assert "overwritten" not in {item["name"] for item in other.document["warnings"]}

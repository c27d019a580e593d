"""`correct` as a user runs it: page, files, JSON document and exit codes."""

from __future__ import annotations

import json

import numpy as np
import pytest

import cfmkit

MODULUS = "mechanism.material.youngs_modulus"


@pytest.fixture
def beams(cli):
    """A design of beams, and the recording of a part of a material with 88 % of its modulus."""
    return recorded(cli, 0.88)


def recorded(cli, factor):
    """Write a design of beams and the recording of a part of a material with so much of its modulus."""
    spec = cfmkit.load("configs/beam_rescaled.yaml")
    (cli.folder / "beams.yaml").write_text(cfmkit.dumps(spec))
    curve = cfmkit.analyze(spec.replace({MODULUS: factor * spec.get_value(MODULUS)})).curve
    force = np.concatenate([1.01 * curve.force, 0.99 * curve.force[::-1]]) + 0.1
    force += np.random.default_rng(3).normal(0.0, 0.02, len(force))
    motion = np.concatenate([curve.motion, curve.motion[::-1]])
    lines = [f"{1e3 * s:.4f},{f:.4f}" for s, f in zip(motion, force, strict=True)]
    (cli.folder / "rig.csv").write_text("displacement [mm],force [N]\n" + "\n".join(lines) + "\n")
    return "beams.yaml", "rig.csv"


def test_correct_writes_the_design_its_drawing_and_a_table_of_before_and_after(cli, beams):
    done = cli("correct", *beams, "-o", "out")
    assert (done.code, done.err) == (0, "")
    assert "before (95 %)" in done.out
    assert "predicted (95 %)" in done.out
    warned = json.loads((cli.folder / "out/metrics.json").read_text())["warnings"]
    assert any("cannot tell modulus from thickness" in warning["message"] for warning in warned)
    table = (cli.folder / "out/correction.csv").read_text().splitlines()
    assert table[0] == "value,unit,before,after,before_low_95,before_high_95,after_low_95,after_high_95"
    assert table[1].startswith("width,mm,10.0,11.3")
    for name in ("design.yaml", "calibrated.yaml", "predicted.yaml", "figures/drawing.png", "geometry/beams.dxf"):
        assert (cli.folder / "out" / name).exists(), name
    found = json.loads((cli.folder / "out/metrics.json").read_text())
    assert found["correction"]["within_scatter"] is False
    assert found["metrics"]["data_loss_factor"]["value"] == pytest.approx(0.02 / (2.0 * np.pi), rel=0.2)
    predicted = cfmkit.evaluate(str(cli.folder / "out/predicted.yaml"), ["force_mean"])["force_mean"].value
    assert predicted == pytest.approx(found["metrics"]["force_mean"]["value"], rel=1e-9)


def test_json_of_a_recording_of_another_part_ends_with_3_and_one_line(cli, beams):
    lines = (cli.folder / "rig.csv").read_text().splitlines()
    far = [f"{5.0 * float(s)},{f}" for s, f in (line.split(",") for line in lines[1:])]
    (cli.folder / "far.csv").write_text("\n".join([lines[0], *far]) + "\n")
    done = cli("correct", beams[0], "far.csv", "-o", "out", "--json")
    assert done.code == 3
    (error,) = json.loads(done.out)["errors"]
    assert "a recording of another part?" in error["message"]
    assert not (cli.folder / "out/design.yaml").exists()


def test_a_thickness_that_cannot_be_made_ends_with_4_and_the_nearest_force(cli):
    changes = ("mechanism.part.sheet=10 mm", "mechanism.part.process.least_feature=0.98 mm")
    options = [word for change in changes for word in ("--set", change)]
    done = cli("correct", *recorded(cli, 1.4), *options, "-o", "out", "--no-plots")
    assert done.code == 4
    assert "mechanism.thickness 0.98 mm (the least that laser makes)" in done.out
    assert "feasible" in done.out
    assert not (cli.folder / "out/design.yaml").exists()


def test_an_empty_fit_is_a_usage_error(cli, beams):
    assert cli("correct", *beams, "--fit", " ", "-o", "out").code == 2

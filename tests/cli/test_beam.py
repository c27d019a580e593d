"""Beam mechanisms as a user runs them: analyse, design, export, sweep, and what goes wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def lan(tmp_path):
    """The mechanism of Table 3 as ``lan.yaml`` in the folder of `cli`."""
    (tmp_path / "lan.yaml").write_bytes((CONFIGS / "beam_lan2010.yaml").read_bytes())
    return "lan.yaml"


def metrics(cli, folder="out"):
    return json.loads((cli.folder / folder / "metrics.json").read_text())["metrics"]


def test_analyze_writes_curve_metrics_and_figures_and_takes_its_own_resolved_spec(cli, lan):
    done = cli("analyze", lan, "-o", "out")
    assert done.code == 0
    assert "closure_adjusted: beams were turned and scaled" in " ".join(done.out.split())
    names = {path.name for path in (cli.folder / "out/figures").iterdir()}
    assert names == {"curve.png", "reactions.png", "shapes.png", "stress.png"}
    assert metrics(cli)["nominal_force"]["value"] == pytest.approx(9.739693, abs=1e-6)
    head = (cli.folder / "out/curve.csv").read_text().partition("\n")[0]
    assert head.startswith(
        "branch,displacement [mm],force [N],stable,max_stress [MPa],stress_beam,stress_place [1],path,b1"
    )
    again = cli("analyze", "out/resolved.yaml", "-o", "again", "--no-plots")
    assert again.code == 0
    assert (cli.folder / "out/curve.csv").read_bytes() == (cli.folder / "again/curve.csv").read_bytes()


def test_design_rescales_writes_the_part_and_its_spec_is_a_design_too(cli, lan):
    done = cli("design", lan, "--set", "design.rescale.force=15 N", "-o", "out", "--no-plots")
    assert done.code == 0
    assert "rescaled: width 10 mm -> 15.4 mm" in done.out
    assert {"beams.dxf", "beams.svg", "beam-b1.csv"} <= {path.name for path in (cli.folder / "out/geometry").iterdir()}
    assert metrics(cli)["nominal_force"]["value"] == pytest.approx(15, rel=1e-4)  # widths have digits
    assert cli("analyze", "out/design.yaml", "-o", "again", "--no-plots").code == 0
    assert metrics(cli, "again") == metrics(cli)


def test_node_places_are_swept_by_name(cli, lan):
    done = cli("sweep", lan, "--vary", "mechanism.nodes.n3.at.1=18.7mm:18.9mm:3", "-o", "out", "-j", "1", "--no-plots")
    assert done.code in (0, 5)
    rows = (cli.folder / "out/results.csv").read_text().splitlines()
    assert len(rows) == 4
    assert rows[0].startswith("mechanism.nodes.n3.at.1 [mm]")

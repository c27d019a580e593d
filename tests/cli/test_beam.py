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


def test_a_missed_name_is_one_line_with_file_line_and_column(cli, lan):
    text = (cli.folder / lan).read_text()
    (cli.folder / lan).write_text(text.replace("end: n4", "end: n44"))
    done = cli("analyze", lan, "--no-plots")
    assert done.code == 3
    line = next(number for number, row in enumerate(text.splitlines(), start=1) if "end: n4" in row)
    assert done.err.startswith(f"lan.yaml:{line}:")
    assert "mechanism.beams.b3.end: there is no node 'n44'; nodes are n1, n2, n3, n4, n5" in done.err


def test_a_path_that_ends_early_is_exit_code_6_with_what_was_solved(cli, lan):
    (cli.folder / "lee.yaml").write_bytes((CONFIGS / "beam_lee_frame.yaml").read_bytes())
    done = cli("analyze", "lee.yaml", "-o", "out", "--no-plots", "--set", "analysis.through_folds=false", "--json")
    assert done.code == 6
    assert "limit point" in done.document["message"]
    assert (cli.folder / "out/curve.csv").exists()


PULLED = """\
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 1 mm
  width: 10 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    tip: {at: [60 mm, 0 mm], support: guided, direction: 0 deg}
  beams:
    strip: {start: root, end: tip}
  drive: {kind: displacement, node: tip, direction: 0 deg}
analysis: {travel: 1 mm, fidelity: inextensible}
"""


def test_no_equilibrium_is_exit_code_4(cli):
    """A straight strip that does not stretch is pulled along itself."""
    (cli.folder / "strip.yaml").write_text(PULLED, encoding="utf-8")
    done = cli("analyze", "strip.yaml", "--no-plots", "--json", "-o", "out")
    assert done.code == 4
    assert done.document["message"]


def test_models_are_compared_with_numbers(cli, lan):
    """The part as a solid carries 3.6 % more than beams that do not stretch at 13.6 mm, and up to 5 % elsewhere."""
    coarse = ("--set", "analysis.solid.poses=7", "--set", "analysis.solid.error=0.1")
    done = cli("analyze", lan, "--compare-fidelity", "-o", "out", "--no-plots", *coarse)
    assert done.code == 0
    assert "fidelity inextensible - solid on load: rms " in " ".join(done.out.split())
    found = {name: metrics(cli)[f"fidelity_max[{name}]"]["value"] for name in ("inextensible", "reissner")}
    assert found["inextensible"] == pytest.approx(-0.36, abs=0.03)
    assert found["reissner"] - found["inextensible"] == pytest.approx(0, abs=0.09)


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


def test_export_writes_what_is_to_be_cut(cli, lan):
    done = cli("export", lan, "-o", "out", "--kerf", "0.1 mm")
    assert done.code == 0
    assert {"beams.dxf", "beams-kerf.dxf", "beams.svg"} <= {path.name for path in (cli.folder / "out").iterdir()}


def test_a_new_spec_runs_as_it_is(cli):
    assert cli("new", "beam", "-o", "beam.yaml").code == 0
    done = cli("analyze", "beam.yaml", "--no-plots", "-o", "out")
    assert done.code == 0
    assert cli("design", "beam.yaml", "--no-plots", "-o", "design").code == 0

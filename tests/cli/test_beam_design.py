"""Shape design as a user runs it: it goes on where it was, and says what blocks where there is no design."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def arch(tmp_path):
    """A small shape design as ``arch.yaml`` in the folder of `cli`."""
    (tmp_path / "arch.yaml").write_bytes((CONFIGS / "beam_design_arch.yaml").read_bytes())
    return "arch.yaml"


def test_a_design_is_repeated_from_the_journal_with_the_same_bytes(cli, arch):
    first = cli("design", arch, "-o", "out", "--no-plots")
    assert first.code == 0
    design = (cli.folder / "out/design.yaml").read_bytes()
    report = json.loads((cli.folder / "out/metrics.json").read_text())
    assert report["metrics"]["half_band"]["value"] < 0.01
    assert report["search"]["tolerance_half_band_p90"]["value"] > report["metrics"]["half_band"]["value"]
    again = cli("design", arch, "-o", "out", "--no-plots", "-j", "1", "-v")
    assert again.code == 0
    assert "2 from the journal" in " ".join(again.out.split())
    assert (cli.folder / "out/design.yaml").read_bytes() == design
    assert cli("analyze", "out/design.yaml", "-o", "judged", "--no-plots").code == 0


def test_what_only_the_search_knows_is_a_block_of_its_own_with_model_and_window(cli, arch):
    done = cli("design", arch, "-o", "out", "--no-plots", "--json")
    reported = json.loads((cli.folder / "out/metrics.json").read_text())
    assert json.loads(done.out)["search"] == reported["search"]
    assert not any(name.startswith(("audit", "tolerance", "starts")) for name in reported["metrics"])
    starts = reported["search"]["starts"]
    assert (starts["value"], starts["unit"], starts["model"]) == (2.0, "1", "reissner")
    assert (starts["window"], starts["window_unit"]) == ([6.0, 12.0], "mm")
    page = " ".join(cli("design", arch, "-o", "bends", "--no-plots", "--fidelity", "inextensible", "-v").out.split())
    assert "search inextensible, 6 to 12 mm: starts 2, " in page
    assert "search reissner, 6 to 12 mm: audit half band reissner " in page


def test_shapes_are_searched_with_stretch_and_shear_and_every_start_is_audited(cli, arch):
    done = cli("design", arch, "-o", "out", "--no-plots")
    assert done.code == 0
    assert "fidelity: reissner" in (cli.folder / "out/design.yaml").read_text()
    header, *rows = (cli.folder / "out/starts.csv").read_text().splitlines()
    assert "sound,crossings,gap [mm]" in header
    assert len(rows) == 2
    assert all(",true,0," in row for row in rows)
    report = json.loads((cli.folder / "out/metrics.json").read_text())
    assert report["search"]["starts_sound"]["value"] == 2
    assert "audit_half_band_reissner" not in report["search"]  # that is what the metrics are of


def test_without_a_shape_the_blocking_limit_and_the_nearest_value_are_named(cli, arch):
    done = cli("design", arch, "-o", "out", "--no-plots", "--set", "design.optimise.force.min=50 N")
    said = " ".join(done.out.split())
    assert done.code == 4
    assert "meets all limits; the best misses force (least mean: missed by" in said
    assert "feasible design.optimise.force.min: at most" in said
    assert re.search(r"missed by \d[\d.]* %", said)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("design.optimise.free={q: {x: [0 mm, 1 mm]}}", "there is no node 'q'; nodes are a, b"),
        ("design.optimise.window=[6 mm, 20 mm]", "analysis.travel ends before"),
        ("design.optimise.objective=paper", "needs 'compare'"),
        ("design.rescale={force: 2 N}", "either 'rescale' or 'optimise'"),
    ],
)
def test_a_task_that_makes_no_sense_is_refused_in_one_line(cli, arch, change, said):
    done = cli("design", arch, "-o", "out", "--no-plots", "--set", change)
    assert done.code == 3
    assert said in " ".join((done.out + done.err).split())


@pytest.mark.parametrize("budget", [("--set", "design.optimise.time_budget=0.001 s"), ("--time-budget", "0.001 s")])
def test_a_budget_of_no_time_is_told(cli, arch, budget):
    done = cli("design", arch, "-o", "out", "--no-plots", *budget)
    assert done.code == 4
    assert "the time budget ended before any start" in " ".join(done.out.split())

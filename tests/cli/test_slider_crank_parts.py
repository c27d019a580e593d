"""Printed slider-cranks as a user runs them: design to a drawing, three models side by side."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cfmkit.tables import read_csv

CONFIGS = Path(__file__).parents[2] / "configs"


def test_a_designed_strip_comes_with_its_drawing_and_its_limits(cli):
    (cli.folder / "taper.yaml").write_bytes((CONFIGS / "slider_crank_taper_design.yaml").read_bytes())
    done = cli("design", "taper.yaml", "-o", "out", "--no-plots", "-v")
    assert done.code == 0, done.err
    assert "converged to a local optimum" in " ".join(done.out.split())
    assert {path.name for path in (cli.folder / "out/geometry").iterdir()} >= {
        "slider-crank.dxf",
        "slider-crank.svg",
        "strip.csv",
    }
    again = cli("analyze", "out/design.yaml", "-o", "again", "--no-plots", "-q")
    assert again.code == 0


def test_springs_flexures_and_strip_stand_side_by_side_with_their_differences(cli):
    """The paper's overlay: springs and flexures agree within 0.5 %, the printed strip has 0.3 N more than both."""
    (cli.folder / "tapered.yaml").write_bytes((CONFIGS / "slider_crank_tapered.yaml").read_bytes())
    done = cli("analyze", "tapered.yaml", "--compare-fidelity", "-o", "out")
    assert done.code == 0, done.err
    assert (cli.folder / "out/figures/fidelity.png").read_bytes().startswith(b"\x89PNG")
    table = read_csv((cli.folder / "out/curve.csv").read_bytes())
    names = np.array(table["fidelity"])
    assert list(dict.fromkeys(names.tolist())) == ["beam", "prb", "lumped", "solid"]
    force = {name: np.array(table["force [N]"], dtype=float)[names == name][-1] for name in set(names.tolist())}
    assert abs(force["prb"] / force["lumped"] - 1) < 5e-3
    assert 0.27 < force["beam"] - force["lumped"] < 0.31
    assert abs(force["solid"] / force["beam"] - 1) < 0.02
    reported = json.loads((cli.folder / "out/metrics.json").read_text())["metrics"]
    assert reported["fidelity_mean[lumped]"]["value"] < -0.28


DESIGNS = "slider_crank_li2019_widest", "slider_crank_bilancia2019_optimum", "slider_crank_lumped"
LONG = "slider_crank_strip", "slider_crank_taper_design"


@pytest.mark.parametrize("name", [*DESIGNS, *(pytest.param(name, marks=pytest.mark.slow) for name in LONG)])
def test_a_design_has_the_metrics_of_its_analysis_and_what_only_the_search_knows_apart(cli, name):
    """To the last digit; the search's block shares no name with a metric, and says of which model and window it is."""
    designed = cli("design", str(CONFIGS / f"{name}.yaml"), "-o", "one", "--no-plots", "--json")
    analysed = cli("analyze", "one/design.yaml", "-o", "two", "--no-plots", "--json")
    assert designed.code == analysed.code == 0
    assert designed.document["metrics"] == analysed.document["metrics"]
    searched = designed.document.get("search", {})
    # springs: all that the search finds is a metric of its design; a strip's thickness and width are closed forms
    assert bool(searched) == (name in ("slider_crank_lumped", "slider_crank_taper_design"))
    assert "search" not in analysed.document
    for key, item in searched.items():
        assert key not in analysed.document["metrics"]
        assert item["model"] in ("prb", "lumped", "beam")
        assert len(item["window"]) == 2


@pytest.mark.slow
def test_what_a_strip_is_said_to_keep_is_what_its_analysis_says(cli):
    page = cli("design", str(CONFIGS / "slider_crank_taper_design.yaml"), "-o", "one", "--no-plots").out
    said = re.search(r"within ([0-9.]+) % from", " ".join(page.split()))
    found = cli("analyze", "one/design.yaml", "-o", "two", "--no-plots", "--json").document["metrics"]
    assert said is not None
    assert float(said.group(1)) == pytest.approx(
        100 * found["deviation_from_target"]["value"], abs=2e-3
    )  # with its digits
    assert found["stress_max"]["value"] <= 42.5

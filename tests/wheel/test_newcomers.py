"""Four newcomers with nothing but an installed wheel: a designer, a researcher, a CI engineer, a notebook user.

`CFMKIT_INSTALLED` names the folder that the wheel was installed to (`pip install --target`); `.ci/run` sets it. The
commands run in an empty folder that does not see the tree.
"""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

INSTALLED = os.environ.get("CFMKIT_INSTALLED")

pytestmark = pytest.mark.skipif(INSTALLED is None, reason="no installed wheel named in CFMKIT_INSTALLED")


@pytest.fixture
def run(tmp_path):
    """Return what runs Python in the empty folder with the wheel alone, and returns the finished process."""

    def python(*arguments, code=0):
        environment = {**os.environ, "PYTHONPATH": INSTALLED, "NO_COLOR": "1", "COLUMNS": "100"}
        done = subprocess.run(
            [sys.executable, *map(str, arguments)], cwd=tmp_path, env=environment, capture_output=True, text=True,
            timeout=600, check=False,
        )  # fmt: skip
        assert done.returncode == code, done.stdout + done.stderr
        return done

    where = python("-c", "import cfmkit; print(cfmkit.__file__)").stdout.strip()
    assert where.startswith(os.path.realpath(INSTALLED)), where
    return python


@pytest.fixture
def cfmkit(run):
    """Return what runs the command."""
    return lambda *arguments, code=0: run("-m", "cfmkit", *arguments, code=code)


def test_a_designer_with_a_laser_gets_parts_and_a_page_to_send(cfmkit, tmp_path):
    assert "cam" in cfmkit("examples").stdout
    cfmkit("examples", "cam")
    reported = cfmkit("design", "cam.yaml", "--set", "design.force=40 N", "--report", "--figures", "png,svg")
    assert "force" in reported.stdout
    out = tmp_path / "cfm-out" / "cam-design"
    assert {"cam.dxf", "cam.svg"} <= {path.name for path in (out / "geometry").iterdir()}
    assert (out / "design.yaml").is_file()
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert not re.search(r'(src|href)="https?:', page)
    cfmkit("export", "cfm-out/cam-design/design.yaml", "--kerf", "0.2 mm", "-o", "cut")
    assert any("kerf" in path.name for path in (tmp_path / "cut").iterdir())


def test_a_researcher_gets_a_figure_for_print_and_its_bibtex(cfmkit, tmp_path):
    cfmkit("examples", "studies/vcfm_fig9_t1")
    cfmkit("sweep", "vcfm_fig9_t1.yaml", "--figures", "pdf,svg", "--figure-width", "174 mm")
    drawn = tmp_path / "cfm-out" / "vcfm_fig9_t1-sweep" / "figures"
    assert b"/FontFile2" in (drawn / "curves.pdf").read_bytes()
    assert "force [N]" in (drawn / "curves.svg").read_text()
    with (tmp_path / "cfm-out" / "vcfm_fig9_t1-sweep" / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["complete"] * 4
    assert "@article{Ding2022" in cfmkit("show", "references").stdout


def test_a_ci_engineer_gets_verdicts_beside_the_lines_and_a_gate(cfmkit, tmp_path):
    (tmp_path / "specs").mkdir()
    cfmkit("new", "vcfm", "-o", "specs/a.yaml")
    cfmkit("check", "specs")
    common = ("batch", "specs/*.yaml", "--no-plots", "-o", "out", "--verb", "analyze")
    cfmkit(*common, "--junit", "junit.xml", "--summary", "summary.md")
    assert "| specs/a.yaml | analyze | ok |" in (tmp_path / "summary.md").read_text()
    again = json.loads(cfmkit(*common, "--json").stdout)
    assert again["reused"] == 1
    moved = cfmkit(*common, "--compare", "out", "--set", "mechanism.positive.width=10.5 mm", code=5)
    assert "force_mean" in moved.stdout
    text = (tmp_path / "specs" / "a.yaml").read_text()
    (tmp_path / "specs" / "a.yaml").write_text(text.replace("family: vcfm", "family: vcfm\nmechansim: 1"))
    wrong = cfmkit(*common, "--annotations", "github", code=3)
    assert re.search(r"^::error file=specs/a\.yaml,line=\d+,col=\d+::", wrong.stderr, re.MULTILINE)


NOTEBOOK = """
import cfmkit, numpy as np
(cam,) = [one for one in cfmkit.examples() if one.name == "cam"]
result = cfmkit.analyze(cam.path)
assert len(repr(result)) < 2000, len(repr(result))
html = result._repr_html_()
assert "<svg" in html and "force" in html
assert len(html) < 300_000, len(html)
study = cfmkit.sweep(cam.path, vary={"mechanism.roller_radius": np.array([0.008, 0.010])}, metrics=["force_mean"])
assert len(study.table["force_mean"]) == 2
assert len(repr(study)) < 2000
picture = cfmkit.figures(result)["loop"]()
print(result.status.key, round(result.metrics["theoretical_force"].value, 3), len(picture.axes))
"""


def test_a_notebook_user_sees_numbers_and_a_figure(run):
    assert run("-c", NOTEBOOK).stdout.split() == ["complete", "50.0", "2"]


def test_everybody_has_the_dimension_drawings(cfmkit, tmp_path):
    drawings = sorted(Path(INSTALLED, "cfmkit", "families").glob("*/dimensions.*"))
    assert [path.suffix for path in drawings] == [".pdf", ".png", ".svg"] * 4
    cfmkit("show", "vcfm", "--figure", "mine.pdf")
    assert (tmp_path / "mine.pdf").read_bytes() == drawings[-3].read_bytes()


def test_everybody_has_the_documentation_without_a_network(cfmkit):
    pages = {one["name"]: Path(one["path"]) for one in json.loads(cfmkit("docs", "--json").stdout)["pages"]}
    assert {"tutorial", "howto", "reference", "cam", "ci"} <= set(pages)
    for path in pages.values():
        text = path.read_text(encoding="utf-8")
        links = re.findall(r"\]\((?!https?:)([^)#\s]+)", text)
        assert [one for one in links if not (path.parent / one).is_file()] == [], path.name
    assert "ten minutes" in cfmkit("docs", "tutorial").stdout
    (described,) = Path(INSTALLED).glob("cfmkit-*.dist-info/METADATA")
    text = described.read_text(encoding="utf-8")
    assert re.findall(r"\]\((?!https?:)", text) == []
    assert "(`cfmkit docs cam`)" in text

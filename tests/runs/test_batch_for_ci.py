"""What a batch leaves for continuous integration: a summary, annotations, and a comparison with an earlier batch."""

import csv
import json
import re
from pathlib import Path

import pytest

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import ExitCode, UsageError

ROOT = Path(__file__).parents[2]
SPEC = (ROOT / "configs" / "vcfm_ding2022.yaml").read_text()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def batch(**more):
    return cfmkit.batch("a.yaml", "out", verb="analyze", plots=False, **more)


def test_a_batch_compared_with_itself_has_no_changes_and_one_that_changed_returns_5(folder):
    assert batch().exit_code is ExitCode.OK
    same = batch(compare="out")
    assert (same.exit_code, same.compared.changes) == (ExitCode.OK, ())
    assert (folder / "out" / "changes.csv").read_text().startswith("spec,metric,before,after")
    (folder / "a.yaml").write_text(SPEC + "\n")
    thicker = [f"mechanism.positive.width={width} mm" for width in (10.01, 10.02)]
    moved = batch(compare="out", changes=thicker[:1], summary="reports/summary.md")
    assert moved.exit_code is ExitCode.REQUIREMENT_MISSED
    rows = list(csv.DictReader((folder / "out" / "changes.csv").read_text().splitlines()))
    assert "force_mean" in {row["metric"] for row in rows}
    assert all(row["beyond_tolerance"] == "true" for row in rows if abs(float(row["relative_change"])) > 1e-6)
    reported = json.loads((folder / "out" / "metrics.json").read_text())
    assert reported["status"] == "requirement_missed"
    assert len(reported["compared"]["changes"]) == len(rows)
    assert "### Compared with out" in (folder / "reports" / "summary.md").read_text()
    wide = batch(compare="out", compare_tolerance=0.2, changes=thicker[1:])
    assert wide.exit_code is ExitCode.OK
    assert wide.compared.changes


def test_what_an_earlier_batch_finished_is_compared_too(folder):
    cfmkit.batch("a.yaml", "before", verb="analyze", plots=False)
    thicker = ["mechanism.positive.width=10.01 mm"]
    cfmkit.batch("a.yaml", "out", verb="analyze", plots=False, changes=thicker)
    again = batch(compare="before", changes=thicker)
    assert again.entries[0].reused
    assert again.exit_code is ExitCode.REQUIREMENT_MISSED
    assert "force_mean" in {change.name for change in again.compared.changes}


def test_the_page_of_a_second_run_still_leads_to_the_page_of_each(folder):
    for reused in (False, True):
        found = batch(page=True)
        assert found.entries[0].reused is reused
        assert '<a href="a/report.html">' in (folder / "out" / "report.html").read_text()


def test_a_folder_that_is_none_of_a_batch_is_refused(folder):
    with pytest.raises(UsageError, match="is not the folder of a batch"):
        batch(compare=".")
    with pytest.raises(UsageError, match="must be >= 0"):
        batch(compare=".", compare_tolerance=-1.0)


def test_a_missed_requirement_is_annotated_at_its_line(folder, capsys):
    strict = re.sub(r"metric: force_ripple, max: [^,}]+", "metric: force_ripple, max: 0.001 %", SPEC)
    line = next(number for number, row in enumerate(strict.splitlines(), 1) if "max: 0.001 %" in row)
    (folder / "a.yaml").write_text(strict)
    assert run_command(["batch", "a.yaml", "-o", "out", "--no-plots", "-j", "1", "-q", "--annotations", "github"]) == 5
    err = capsys.readouterr().err
    assert re.search(rf"^::error file=a\.yaml,line={line},col=\d+,title=requirement missed::", err, re.MULTILINE)


def test_the_tolerance_needs_a_comparison(folder, capsys):
    assert run_command(["batch", "a.yaml", "--compare-tolerance", "1 %"]) == 2
    assert run_command(["batch", "a.yaml", "--compare", "out", "--compare-tolerance", "1 mm"]) == 2
    assert "--compare-tolerance" in capsys.readouterr().err


def test_accepted_results_are_the_reference_that_the_next_batch_is_compared_with(folder):
    """The reference is made where there is none, and holds what a comparison reads, nothing else."""
    first = batch(compare="reference", accept=True)
    assert (first.exit_code, first.compared, first.accepted) == (ExitCode.OK, None, "reference")
    files = sorted(str(path.relative_to("reference")) for path in Path("reference").rglob("*") if path.is_file())
    specs = sorted(f"{one.folder}/metrics.json" for one in first.entries)
    assert files == sorted(["manifest.json", "metrics.json", *specs])
    thicker = ["mechanism.positive.width=10.01 mm"]
    assert batch(compare="reference", changes=thicker).exit_code is ExitCode.REQUIREMENT_MISSED
    accepted = batch(compare="reference", changes=thicker, accept=True)
    assert accepted.compared.changes_beyond_tolerance
    assert accepted.exit_code is ExitCode.OK
    again = batch(compare="reference", changes=thicker)
    assert again.compared.changes == ()


@pytest.mark.parametrize(("more", "reported"), [({}, "name its folder with --compare"), ({"compare": "out"}, "itself")])
def test_results_are_not_accepted_without_a_reference_of_their_own(folder, more, reported):
    with pytest.raises(UsageError, match=reported):
        batch(accept=True, **more)


def test_a_folder_that_is_none_of_a_batch_is_not_replaced(folder):
    Path("mine").mkdir()
    Path("mine/metrics.json").write_text("{}")
    with pytest.raises(UsageError, match="is not the folder of a batch"):
        batch(compare="mine", accept=True)
    assert Path("mine/metrics.json").read_text() == "{}"


def test_python_runs_a_batch_and_reuses_what_an_earlier_one_has_finished(tmp_path):

    configs = Path(__file__).parents[2] / "configs"
    (tmp_path / "good.yaml").write_text((configs / "cam.yaml").read_text())
    (tmp_path / "bad.yaml").write_text("cfmkit: 1\nfamily: cam\n")
    first = cfmkit.batch(tmp_path, tmp_path / "out", plots=False, changes=["analysis.points=61"])
    again = cfmkit.batch([tmp_path / "*.yaml"], tmp_path / "out", plots=False, changes=["analysis.points=61"])
    assert first.exit_code == cfmkit.ExitCode.INVALID
    assert [(one.name, one.status) for one in first.entries] == [("", "invalid"), ("sanchez-salinas-2022", "complete")]
    assert [one.reused for one in first.entries + again.entries] == [False, False, False, True]
    assert first.table["status"] == ("invalid", "complete")
    assert first.summary == json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert (tmp_path / "out" / "good" / "design.yaml").exists()
    with pytest.raises(cfmkit.UsageError, match="no such file"):
        cfmkit.batch(tmp_path / "none.yaml", tmp_path / "out")

"""What a batch leaves for continuous integration: a summary, annotations, and a comparison with an earlier batch."""

import csv
import json
import os
import re
import subprocess
from dataclasses import fields, replace
from pathlib import Path

import pytest
import yaml

import cfmkit
from cfmkit.cli import run_command
from cfmkit.cli.verbs.batch import BatchOptions
from cfmkit.documents import batch_document
from cfmkit.documents.annotations import workflow_commands
from cfmkit.documents.markdown import summary
from cfmkit.errors import ExitCode, UsageError
from cfmkit.metrics.compare import MetricChange
from cfmkit.studies.batch_sources_and_outcomes import Entry
from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison, Earlier, changes

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


def one(**more):
    return replace(Entry("a.yaml", "a", "analyze", "vcfm", "a", "complete", written=True), **more)


def compared(tmp_path, before, after, entry=None, **more):
    (tmp_path / "a").mkdir(exist_ok=True)
    (tmp_path / "a" / "metrics.json").write_text(json.dumps({"metrics": after}))
    known = {"a": Earlier("complete", 0, before)}
    return [(change.name, change.beyond) for change in changes(known, [entry or one()], str(tmp_path), **more)]


def value(number, unit="N"):
    return {"value": number, "unit": unit}


def test_only_what_differs_by_more_than_rounding_is_a_change(tmp_path):
    before = {"f": value(10.0), "zero": value(1e-14), "gone": value(1.0), "kind": value("stable"), "none": value(None)}
    after = {"f": value(10.0 * (1 + 1e-8)), "zero": value(-3e-13), "gone": value(None), "kind": value("bistable")}
    after |= {"none": value(None), "new": value(3.0)}
    found = compared(tmp_path, before, after)
    assert found == [("f", False), ("gone", True), ("kind", True), ("new", True)]
    assert compared(tmp_path, {"f": value(10.0)}, {"f": value(10.2)}, tolerance=0.05) == [("f", False)]
    assert compared(tmp_path, {"f": value(10.0)}, {"f": value(10.2)}, tolerance=0.01) == [("f", True)]


@pytest.mark.parametrize(
    ("before", "after", "relative", "said"),
    [
        (10.0, 20.0, 1.0, "f: 10 -> 20 N (+100 %)"),
        (10.0, 5.0, -0.5, "f: 10 -> 5 N (-50 %)"),
        (-10.0, -5.0, 0.5, "f: -10 -> -5 N (+50 %)"),
        (-10.0, -20.0, -1.0, "f: -10 -> -20 N (-100 %)"),
        (0.0, 2.0, None, "f: 0 -> 2 N"),
    ],
)
def test_a_change_is_a_share_of_what_it_was(tmp_path, before, after, relative, said):
    """A force that doubled was reported as +50 %: relative to the larger of both."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "metrics.json").write_text(json.dumps({"metrics": {"f": value(after)}}))
    (found,) = changes({"a": Earlier("complete", 0, {"f": value(before)})}, [one()], str(tmp_path))
    assert (found.relative, found.sentence, found.beyond) == (relative, said, True)


def test_a_run_that_ends_otherwise_is_a_change_whatever_its_metrics(tmp_path):
    failed = one(status="no_equilibrium", code=ExitCode.NO_SOLUTION)
    assert compared(tmp_path, {}, {}, failed) == [("status", True)]


def test_a_folder_that_is_none_of_a_batch_is_refused(folder):
    with pytest.raises(UsageError, match="is not the folder of a batch"):
        batch(compare=".")
    with pytest.raises(UsageError, match="must be >= 0"):
        batch(compare=".", compare_tolerance=-1.0)


HOSTILE = "a|b<script>%0A::error::,:\n*x*.yaml"


def nowhere(name, number):
    """Return that no place is known."""
    return 0, 0


def test_a_specification_has_one_annotation_that_says_all_of_it():
    missed = [
        {
            "metric": name,
            "min": None,
            "max": 1.0,
            "unit": "1",
            "over": None,
            "over_unit": None,
            "ok": False,
            "sentence": name,
        }
        for name in ("force_ripple", "deviation")
    ]
    warned = ({"name": "undercut", "message": "a corner"},)
    entry = one(code=ExitCode.REQUIREMENT_MISSED, requirements=tuple(missed), warnings=warned)
    (line,) = workflow_commands([entry], lambda name, number: (7 + number, 3))
    assert line.startswith("::error file=a.yaml,line=7,col=3,title=requirement missed::")
    assert line.endswith("::force_ripple%0Adeviation")


def test_the_page_counts_changes_and_names_specifications_that_are_missing():
    changed = tuple(MetricChange("a.yaml", f"metric_{number}", 1.0, 2.0, "N", 1.0, True) for number in range(20))
    compared = BatchComparison("accepted", 1e-6, changed, ("b", "c"))
    document = batch_document.document_of([one()], ExitCode.REQUIREMENT_MISSED, compared=compared)
    assert document.verdict == "20 values changed"
    assert document.notes[-1].text == "not in this batch: b, c"


def test_an_annotation_of_many_changes_lists_eight_and_counts_the_others():
    changed = [MetricChange("a.yaml", f"metric_{number}", 1.0, 2.0, "N", 1.0, True) for number in range(20)]
    (line,) = workflow_commands([one()], nowhere, changed)
    assert line.count("1 -> 2 N") == 8
    assert line.endswith("%0A12 more values in changes.csv")


def test_annotations_name_file_and_line_and_let_no_name_through(folder):
    broken = SPEC.replace("family: vcfm", "family: vcfm\nmechansim: 3")
    (folder / "a.yaml").write_text(broken)
    found = cfmkit.batch("a.yaml", "out", plots=False)
    lines = list(workflow_commands(found.entries, nowhere))
    number = broken.splitlines().index("mechansim: 3") + 1
    assert any(re.fullmatch(rf"::error file=a\.yaml,line={number},col=\d+::.*mechansim.*", line) for line in lines)
    hostile = one(spec=HOSTILE, warnings=({"name": "x,y", "message": "50 %\r\n::stop"},))
    (line,) = workflow_commands([hostile], nowhere)
    assert "\n" not in line
    assert line.count("::") == 3
    assert line.startswith("::warning file=a|b<script>%250A%3A%3Aerror%3A%3A%2C%3A%0A*x*.yaml,title=x%2Cy::50 %25%0D")


def test_a_missed_requirement_is_annotated_at_its_line(folder, capsys):
    strict = re.sub(r"metric: force_ripple, max: [^,}]+", "metric: force_ripple, max: 0.001 %", SPEC)
    line = next(number for number, row in enumerate(strict.splitlines(), 1) if "max: 0.001 %" in row)
    (folder / "a.yaml").write_text(strict)
    assert run_command(["batch", "a.yaml", "-o", "out", "--no-plots", "-j", "1", "-q", "--annotations", "github"]) == 5
    err = capsys.readouterr().err
    assert re.search(rf"^::error file=a\.yaml,line={line},col=\d+,title=requirement missed::", err, re.MULTILINE)


def test_the_summary_is_a_table_in_which_no_name_becomes_markup():
    text = summary([one(), one(spec=HOSTILE, code=ExitCode.INVALID, status="invalid", errors=("x: <b>",))]).decode()
    assert "| a.yaml | analyze | ok |" in text
    assert "<script>" not in text
    assert "<b>" not in text
    assert "**invalid**" in text
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == 4


def test_the_tolerance_needs_a_comparison(folder, capsys):
    assert run_command(["batch", "a.yaml", "--compare-tolerance", "1 %"]) == 2
    assert run_command(["batch", "a.yaml", "--compare", "out", "--compare-tolerance", "1 mm"]) == 2
    assert "--compare-tolerance" in capsys.readouterr().err


def test_the_action_and_the_hook_call_commands_that_exist():
    """What a runner would do with the action is done here with the shell of its last step."""
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    (step,) = (one for one in action["runs"]["steps"] if one.get("id") == "batch")
    words = step["run"].replace("\\\n", " ")
    known = {f"--{option.name.replace('_', '-')}" for option in fields(BatchOptions)}
    assert set(re.findall(r"--[a-z-]+", words)) <= known
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    assert hook["entry"] == "cfmkit check"
    checked = subprocess.run(["bash", "-n", "-c", step["run"]], env=os.environ, check=False)
    assert checked.returncode == 0


def test_the_action_passes_specifications_and_options_on_as_they_were_written(tmp_path):
    """Its step runs in a shell, as a runner runs it, with a cfmkit that notes what it was given and fails."""
    (step,) = (one for one in yaml.safe_load((ROOT / "action.yml").read_text())["runs"]["steps"] if "id" in one)
    (tmp_path / "cfmkit").write_text("#!/bin/sh\nprintf '%s\\n' \"$@\"\nexit 5\n")
    (tmp_path / "cfmkit").chmod(0o755)
    given = {"SPECS": "my parts/**/*.yaml\n\n  b.yaml\n", "OUT": "out dir", "OPTIONS": "--report\n--seed 3\n"}
    runner = {name: str(tmp_path / name) for name in ("GITHUB_STEP_SUMMARY", "GITHUB_OUTPUT")}
    ran = subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
        env=os.environ | given | runner | {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    words = ran.stdout.splitlines()
    assert (ran.returncode, ran.stderr) == (5, "")
    assert words[:5] == ["batch", "my parts/**/*.yaml", "b.yaml", "--out", "out dir"]
    assert words[-3:] == ["--report", "--seed", "3"]
    assert (tmp_path / "GITHUB_OUTPUT").read_text() == "exit-code=5\n"


def test_a_batch_that_fails_is_kept_in_the_cache_of_the_action():
    steps = yaml.safe_load((ROOT / "action.yml").read_text())["runs"]["steps"]
    (saved,) = (one for one in steps if one.get("uses", "").startswith("actions/cache/save@"))
    (restored,) = (one for one in steps if one.get("uses", "").startswith("actions/cache/restore@"))
    assert saved["if"] == "always()"
    assert saved["with"] == {name: restored["with"][name] for name in ("path", "key")}


@pytest.mark.parametrize(
    ("name", "left_out"), [(".github/workflows/a.yml", True), (".pre-commit-config.yaml", True), ("a/b.yaml", False)]
)
def test_the_hook_leaves_alone_what_other_tools_read(name, left_out):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    assert bool(re.search(hook["exclude"], name)) is left_out


def test_a_complete_curve_that_misses_a_requirement_now_is_a_change_in_words(tmp_path):
    (found,) = changes({"a": Earlier("complete", 0, {})}, [one(code=ExitCode.REQUIREMENT_MISSED)], str(tmp_path))
    assert found.sentence == "status: complete -> requirement missed"


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

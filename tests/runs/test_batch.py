"""Which files a batch takes, where they write, and the JUnit XML that comes of it."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

import cfmkit
from cfmkit.documents import html
from cfmkit.documents.annotations import workflow_commands
from cfmkit.documents.batch_document import document_of
from cfmkit.documents.junit import junit
from cfmkit.documents.markdown import plain, summary
from cfmkit.errors import ExitCode, UsageError
from cfmkit.metrics.compare import MetricChange
from cfmkit.store import RunFolder, file_hash, origin
from cfmkit.studies.batch_sources_and_outcomes import (
    Entry,
    files_below,
    folders,
    message,
    requirements_table,
    results_table,
    sources,
)
from cfmkit.studies.finished_batch_specs_in_journal import KeptRuns
from cfmkit.studies.journal import Journal
from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison, changes_table
from cfmkit.tables import to_csv


@pytest.fixture
def tree(tmp_path, monkeypatch):
    for name in ("a.yaml", "b.yml", "sub/a.yaml", "sub/deep/c.YAML", "note.txt", "cfm-out/batch/a/design.yaml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("family: cam")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("named", "found"),
    [
        (["a.yaml", "b.yml"], ["a.yaml", "b.yml"]),
        (["*.yaml"], ["a.yaml"]),
        (["**/*.yaml"], ["a.yaml", "sub/a.yaml"]),
        (["sub"], ["sub/a.yaml", "sub/deep/c.YAML"]),
        (["."], ["./a.yaml", "./b.yml", "./sub/a.yaml", "./sub/deep/c.YAML"]),
        (["sub/a.yaml", "**/a.yaml"], ["sub/a.yaml", "a.yaml"]),
        (["a.yaml", "./a.yaml", "sub/../a.yaml"], ["a.yaml"]),
        (["note.txt"], ["note.txt"]),
    ],
)
def test_files_folders_and_patterns_give_each_file_once(tree, named, found):
    assert list(sources(named, "cfm-out/batch")) == found


def test_results_of_an_earlier_batch_are_no_specifications(tree):
    (tree / "mine" / "a").mkdir(parents=True)
    (tree / "mine" / "a" / "design.yaml").write_text("family: cam")
    assert "mine/a/design.yaml" in sources(["**/*.yaml"], "cfm-out/batch")
    assert "mine/a/design.yaml" not in sources(["**/*.yaml"], "mine")


@pytest.mark.parametrize("named", [".", "**/*.yaml", "./**", "sub/../**/*.yaml"])
def test_links_that_lead_in_circles_are_followed_once(tree, named):
    """Three links upwards: each file would be found along 3^40 paths."""
    for name, target in (("sub/up", ".."), ("sub/deep/up", "../.."), ("sub/here", "."), ("self", "self")):
        (tree / name).symlink_to(target)
    (tree / "other").mkdir()
    (tree / "other" / "d.yaml").write_text("family: cam")
    (tree / "sub" / "other").symlink_to(tree / "other")
    found = [os.path.normpath(name) for name in sources([named], "cfm-out/batch")]
    assert {"a.yaml", "sub/a.yaml", "other/d.yaml"} <= set(found) <= {
        "a.yaml", "b.yml", "sub/a.yaml", "sub/deep/c.YAML", "other/d.yaml", "note.txt"
    }  # fmt: skip
    assert len(set(found)) == len(found)


def test_a_folder_that_is_only_linked_is_searched(tree, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "d.yaml").write_text("family: cam")
    (tree / "linked").symlink_to(elsewhere)
    assert "linked/d.yaml" in sources(["**/*.yaml"], "out")
    assert files_below("linked") == ["linked/d.yaml"]


def test_a_file_whose_name_looks_like_a_pattern_is_that_file(tree):
    (tree / "cam[1].yaml").write_text("family: cam")
    assert sources(["cam[1].yaml"], "out") == ("cam[1].yaml",)


@pytest.mark.parametrize(("name", "words"), [("c*.yaml", "no file matches"), ("x.yaml", "no such"), ("-", "a batch")])
def test_what_stands_for_no_file_is_refused(tree, name, words):
    with pytest.raises(UsageError, match=words):
        sources([name], "out")


def test_a_folder_without_specifications_is_refused(tree):
    (tree / "empty").mkdir()
    with pytest.raises(UsageError, match="no YAML file"):
        sources(["empty"], "out")


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["x/cam.yaml", "x/beam.yaml"], ["cam", "beam"]),
        (["x/cam.yaml", "y/cam.yaml"], ["x-cam", "y-cam"]),
        (["x/a/cam.yaml", "y/a/cam.yaml", "z/b/cam.yaml"], ["x-a-cam", "y-a-cam", "b-cam"]),
        (["x/cam.yaml", "x/cam.yml"], ["cam", "cam-2"]),
        (["results.csv.yaml", "manifest.json.yaml"], ["results.csv-2", "manifest.json-2"]),
        ([".cfmkit-run.yaml", "..yaml"], ["spec.cfmkit-run", "spec."]),
    ],
)
def test_every_specification_has_a_folder_of_its_own(files, names):
    assert list(folders(files)) == names


def test_folders_differ_even_where_capitals_do_not_count():
    found = folders(["Cam.yaml", "x/cam.yaml"])
    assert len({name.lower() for name in found}) == 2


MET = {
    "metric": "force_ripple", "value": 0.01, "min": None, "max": 0.05, "unit": "1", "over": [2.0, 240.0],
    "over_unit": "mm", "ok": True, "sentence": "force ripple 1 %, allowed <= 5 %: ok",
}  # fmt: skip
MISSED = MET | {"metric": "force_mean[load]", "min": 49.0, "max": 51.0, "unit": "N", "over": None, "ok": False}
ENTRIES = (
    Entry("ok.yaml", "ok", "design", "cam", "fine", "complete", ExitCode.OK, "", (MET,), seconds=1.5),
    Entry(
        "missed.yaml", "missed", "analyze", "cam", "weak", "complete", ExitCode.REQUIREMENT_MISSED, "x", (MET, MISSED)
    ),
    Entry(
        "bad.yaml", "bad", status="invalid", code=ExitCode.INVALID, message="1 fault", errors=("bad.yaml:1:1: \x00<&",)
    ),
    Entry("none.yaml", "none", "design", "cam", "n", "infeasible", ExitCode.NO_SOLUTION, "too stiff", (MISSED,)),
    Entry("part.yaml", "part", "analyze", "cam", "p", "partial", ExitCode.PARTIAL, "ends early", (MET,)),
    Entry("bug.yaml", "bug", status="bug", code=ExitCode.BUG, message="KeyError", bug="Traceback ..."),
    Entry("left.yaml", "left", message="not run"),
)


def suites():
    return {suite.get("name"): suite for suite in ElementTree.fromstring(junit(ENTRIES))}


def ends(suite):
    return [next((child.tag for child in case if child.tag != "system-out"), "passed") for case in suite]


def test_junit_has_a_suite_for_each_specification_and_a_test_for_each_requirement():
    found = suites()
    assert list(found) == [one.spec for one in ENTRIES]
    assert ends(found["ok.yaml"]) == ["passed", "passed"]
    assert ends(found["missed.yaml"]) == ["passed", "passed", "failure"]
    assert ends(found["bad.yaml"]) == ["error"]
    assert ends(found["none.yaml"]) == ["failure", "skipped"]
    assert ends(found["part.yaml"]) == ["failure", "passed"]
    assert ends(found["bug.yaml"]) == ["error"]
    assert ends(found["left.yaml"]) == ["skipped"]


def test_the_counts_of_junit_are_those_of_its_tests():
    root = ElementTree.fromstring(junit(ENTRIES))
    for element in (root, *root):
        cases = list(element.iter("testcase"))
        assert int(element.get("tests")) == len(cases)
        for key, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            assert int(element.get(key)) == len(list(element.iter(tag)))
        assert float(element.get("time")) == pytest.approx(sum(float(case.get("time")) for case in cases))
    assert float(root.get("time")) == 1.5


def test_the_name_of_a_test_holds_the_requirement_and_never_the_value():
    _, first, second = suites()["missed.yaml"]
    assert first.get("name") == "force_ripple <= 0.05 over 2 ... 240 mm"
    assert second.get("name") == "force_mean[load] >= 49 N and <= 51 N"
    assert second.find("failure").get("message") == MISSED["sentence"]


def test_the_same_requirement_twice_gives_two_tests():
    entry = Entry("a.yaml", "a", "analyze", "cam", "a", "complete", ExitCode.OK, "", (MET, MET))
    names = [case.get("name") for case in ElementTree.fromstring(junit([entry])).iter("testcase")]
    assert len(set(names)) == 3


def test_junit_survives_characters_that_xml_cannot_hold():
    text = ElementTree.tostring(suites()["bad.yaml"], encoding="unicode")
    assert "\x00" not in text
    assert "&lt;&amp;" in text


def test_the_tables_have_a_row_for_each_specification_and_each_requirement():
    table = results_table(ENTRIES)
    assert list(table["spec"]) == [one.spec for one in ENTRIES]
    assert list(table["missed"]) == [0, 1, 0, 1, 0, 0, 0]
    assert table["exit_code"][-1] is None
    assert list(requirements_table(ENTRIES)["ok"]) == ["true", "true", "false", "false", "true"]
    assert len(requirements_table(())) == 0


HOSTILE = "=cmd\x1b[31m\x07\r\n\t\x9b\u202e@.yaml"


def test_no_table_and_no_report_holds_a_raw_control_character():
    warned = {"name": HOSTILE, "message": HOSTILE}
    known = {"metric": HOSTILE, "min": None, "max": 1.0, "unit": "1", "over": None, "over_unit": None}
    missed = known | {"value": 2.0, "ok": False, "sentence": HOSTILE}
    fields = dict.fromkeys(("spec", "folder", "verb", "family", "name", "status", "message"), HOSTILE)
    ends = {"code": ExitCode.REQUIREMENT_MISSED, "requirements": (missed,), "warnings": (warned,)}
    entries = [Entry(**fields, **ends), Entry(**fields, code=ExitCode.INVALID, errors=(HOSTILE,))]
    changed = (MetricChange(HOSTILE, HOSTILE, HOSTILE, 1.0, HOSTILE, None, True),)
    written = {
        "results": to_csv(results_table(entries)),
        "requirements": to_csv(requirements_table(entries)),
        "changes": to_csv(changes_table(changed)),
        "summary": summary(entries, BatchComparison(HOSTILE, 0.1, changed, (HOSTILE,))),
        "junit": junit(entries),
        "annotations": "\n".join(workflow_commands(entries, lambda name, number: (0, 0), changed)).encode(),
        "page": html.page(document_of(entries, ExitCode.INVALID), command=HOSTILE),
    }
    for name, data in written.items():
        raw = {char for char in data.decode() if not char.isprintable()}
        assert raw <= {"\n"}, name
    for name in ("results", "requirements", "changes"):
        assert "'=cmd" in written[name].decode()
        assert not re.search(r"(^|,|\")[=@]", written[name].decode(), re.MULTILINE)


def test_a_summary_mentions_nobody_and_links_nowhere():
    assert plain("@somebody") != "@somebody"
    for hostile in (
        "@somebody",
        "a @b/c",
        "https://evil.example",
        "www.evil.example",
        "#1",
        "$x$",
        "= x",
        "- x",
        "+ x",
    ):
        text = plain(hostile)
        assert not re.search(r"@\w|://|www\.|(?<!\\)[#$](?!8203)|^[-=+]", text)


def test_the_message_counts_every_end():
    reported = "7 specs: 1 ok, 1 missed, 1 partial, 1 no solution, 1 invalid, 1 bug, 1 skipped"
    assert message(ENTRIES) == reported


def test_two_specifications_of_one_name_in_two_folders_are_told_apart():
    assert folders([str(Path("/p/a/cam.yaml")), str(Path("/p/b/cam.yaml"))]) == ("a-cam", "b-cam")


# ---- what an earlier batch has finished


SPEC_TEXT = "family: cam\n"
DONE = Entry("a.yaml", "a", "analyze", "cam", "one", "complete", data=(("flank.csv", None),), written=True)


@pytest.fixture
def finished(tmp_path, monkeypatch):
    """A folder in which a batch has finished one specification that names a data file."""
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(SPEC_TEXT)
    Path("flank.csv").write_text("x\n1\n")
    keep(replace(DONE, data=(("flank.csv", file_hash(Path("flank.csv"))),)))
    return tmp_path


def keep(entry, edit=lambda: None, options=()):
    with RunFolder("out/a") as folder:
        folder.write("curve.csv", b"1\n")
        folder.write("figures/loop.png", b"2")
        folder.commit({})
    with Journal(Path("out/journal")) as journal:
        kept = KeptRuns("out", list(options), journal)
        kept.recall("a.yaml", "a")
        edit()
        kept.keep(entry)


def recalled(*options, fresh=False):
    with Journal(Path("out/journal"), fresh) as journal:
        return KeptRuns("out", list(options), journal).recall("a.yaml", "a")


def test_what_is_as_it_was_is_reused(finished):
    found = recalled()
    assert (found, found.reused) == (DONE, True)


def test_nothing_is_reused_that_is_to_be_computed_anew(finished):
    assert recalled(fresh=True) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda: Path("a.yaml").write_text(SPEC_TEXT + "# another\n"),
        lambda: Path("flank.csv").write_text("x\n2\n"),
        lambda: Path("flank.csv").unlink(),
        lambda: Path("out/a/curve.csv").write_text("3\n"),
        lambda: Path("out/a/figures/loop.png").unlink(),
        lambda: Path("out/a/manifest.json").unlink(),
        lambda: Path("out/a/.cfmkit.lock").touch(),
        lambda: Path("out/a/.cfmkit-run").mkdir(),
    ],
    ids=["spec", "data", "data-gone", "edited", "deleted", "no-manifest", "in-use", "half-committed"],
)
def test_whatever_was_changed_since_is_computed_anew(finished, change):
    change()
    assert recalled() is None


def test_other_options_and_other_code_are_computed_anew(finished, monkeypatch):
    assert recalled("--seed 1") is None
    monkeypatch.setattr(
        "cfmkit.studies.finished_batch_specs_in_journal.origin",
        lambda libraries: origin(libraries) | {"content": "another"},
    )
    assert recalled() is None


@pytest.mark.parametrize(
    "entry",
    [
        replace(DONE, code=ExitCode.BUG, status="bug"),
        replace(DONE, code=ExitCode.IO, status="io"),
        replace(DONE, code=ExitCode.PARTIAL, status="timeout", written=False),
    ],
    ids=lambda entry: entry.status,
)
def test_an_end_that_may_differ_tomorrow_is_not_kept(tmp_path, monkeypatch, entry):
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(SPEC_TEXT)
    keep(replace(entry, data=()))
    assert recalled() is None


def test_what_was_saved_while_it_was_computed_is_not_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(SPEC_TEXT)
    keep(replace(DONE, data=()), edit=lambda: Path("a.yaml").write_text("family: beam\n"))
    assert recalled() is None


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

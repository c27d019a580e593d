"""Which files a batch takes, where they write, its tables, what it reuses, and what changed since an earlier one."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from batch_entries import ENTRIES, entry, hostile_entries

from cfmkit.errors import ExitCode, UsageError
from cfmkit.metrics import MetricChange
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
from cfmkit.studies.earlier_batch import Earlier, KeptRuns, changes, changes_table
from cfmkit.studies.journal import Journal
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


def test_the_tables_have_a_row_for_each_specification_and_each_requirement():
    table = results_table(ENTRIES)
    assert list(table["spec"]) == [one.spec for one in ENTRIES]
    assert list(table["missed"]) == [0, 1, 0, 1, 0, 0, 0]
    assert table["exit_code"][-1] is None
    assert list(requirements_table(ENTRIES)["ok"]) == ["true", "true", "false", "false", "true"]
    assert len(requirements_table(())) == 0


HOSTILE = "=cmd\x1b[31m\x07\r\n\t\x9b\u202e@.yaml"


def assert_is_printable(data, name):
    raw = {char for char in data.decode() if not char.isprintable()}
    assert raw <= {"\n"}, name


HOSTILE_CHANGE = MetricChange(HOSTILE, HOSTILE, HOSTILE, 1.0, HOSTILE, None, True)


def test_no_table_holds_a_raw_control_character_or_a_formula():
    entries = hostile_entries(HOSTILE)
    for table in (results_table(entries), requirements_table(entries), changes_table((HOSTILE_CHANGE,))):
        written = to_csv(table)
        assert_is_printable(written, "table")
        assert "'=cmd" in written.decode()
        assert not re.search(r"(^|,|\")[=@]", written.decode(), re.MULTILINE)


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
        "cfmkit.studies.earlier_batch.origin",
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


def compared(tmp_path, before, after, outcome=None, **more):
    (tmp_path / "a").mkdir(exist_ok=True)
    (tmp_path / "a" / "metrics.json").write_text(json.dumps({"metrics": after}))
    known = {"a": Earlier("complete", 0, before)}
    return [(change.name, change.beyond) for change in changes(known, [outcome or entry()], str(tmp_path), **more)]


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
    (found,) = changes({"a": Earlier("complete", 0, {"f": value(before)})}, [entry()], str(tmp_path))
    assert (found.relative, found.sentence, found.beyond) == (relative, said, True)


def test_a_run_that_ends_otherwise_is_a_change_whatever_its_metrics(tmp_path):
    failed = entry(status="no_equilibrium", code=ExitCode.NO_SOLUTION)
    assert compared(tmp_path, {}, {}, failed) == [("status", True)]


def test_a_complete_curve_that_misses_a_requirement_now_is_a_change_in_words(tmp_path):
    (found,) = changes({"a": Earlier("complete", 0, {})}, [entry(code=ExitCode.REQUIREMENT_MISSED)], str(tmp_path))
    assert found.sentence == "status: complete -> requirement missed"

"""What continuous integration reads of a batch: JUnit, a summary, annotations and the page."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from batch_entries import ENTRIES, MET, MISSED, entry, hostile_entries

import cfmkit
from cfmkit.documents import batch_document, html
from cfmkit.documents.batch_document import document_of
from cfmkit.documents.continuous_integration import junit, plain, summary, workflow_commands
from cfmkit.errors import ExitCode
from cfmkit.metrics import MetricChange
from cfmkit.studies import BatchComparison, Entry


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


HOSTILE = "=cmd\x1b[31m\x07\r\n\t\x9b\u202e@.yaml"


def assert_is_printable(data, name):
    raw = {char for char in data.decode() if not char.isprintable()}
    assert raw <= {"\n"}, name


HOSTILE_CHANGE = MetricChange(HOSTILE, HOSTILE, HOSTILE, 1.0, HOSTILE, None, True)


def test_no_report_holds_a_raw_control_character():
    entries, changed = hostile_entries(HOSTILE), (HOSTILE_CHANGE,)
    written = {
        "summary": summary(entries, BatchComparison(HOSTILE, 0.1, changed, (HOSTILE,))),
        "junit": junit(entries),
        "annotations": "\n".join(workflow_commands(entries, lambda name, number: (0, 0), changed)).encode(),
        "page": html.page(document_of(entries, ExitCode.INVALID), command=HOSTILE),
    }
    for name, data in written.items():
        assert_is_printable(data, name)


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


ROOT = Path(__file__).parents[2]


SPEC = (ROOT / "configs" / "vcfm_ding2022.yaml").read_text()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


MARKUP = "a|b<script>%0A::error::,:\n*x*.yaml"


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
    judged = entry(code=ExitCode.REQUIREMENT_MISSED, requirements=tuple(missed), warnings=warned)
    (line,) = workflow_commands([judged], lambda name, number: (7 + number, 3))
    assert line.startswith("::error file=a.yaml,line=7,col=3,title=requirement missed::")
    assert line.endswith("::force_ripple%0Adeviation")


def test_the_page_counts_changes_and_names_specifications_that_are_missing():
    changed = tuple(MetricChange("a.yaml", f"metric_{number}", 1.0, 2.0, "N", 1.0, True) for number in range(20))
    compared = BatchComparison("accepted", 1e-6, changed, ("b", "c"))
    document = batch_document.document_of([entry()], ExitCode.REQUIREMENT_MISSED, compared=compared)
    assert document.verdict == "20 values changed"
    assert document.notes[-1].text == "not in this batch: b, c"


def test_an_annotation_of_many_changes_lists_eight_and_counts_the_others():
    changed = [MetricChange("a.yaml", f"metric_{number}", 1.0, 2.0, "N", 1.0, True) for number in range(20)]
    (line,) = workflow_commands([entry()], nowhere, changed)
    assert line.count("1 -> 2 N") == 8
    assert line.endswith("%0A12 more values in changes.csv")


def test_annotations_name_file_and_line_and_let_no_name_through(folder):
    broken = SPEC.replace("family: vcfm", "family: vcfm\nmechansim: 3")
    (folder / "a.yaml").write_text(broken)
    found = cfmkit.batch("a.yaml", "out", plots=False)
    lines = list(workflow_commands(found.entries, nowhere))
    number = broken.splitlines().index("mechansim: 3") + 1
    assert any(re.fullmatch(rf"::error file=a\.yaml,line={number},col=\d+::.*mechansim.*", line) for line in lines)
    hostile = entry(spec=MARKUP, warnings=({"name": "x,y", "message": "50 %\r\n::stop"},))
    (line,) = workflow_commands([hostile], nowhere)
    assert "\n" not in line
    assert line.count("::") == 3
    assert line.startswith("::warning file=a|b<script>%250A%3A%3Aerror%3A%3A%2C%3A%0A*x*.yaml,title=x%2Cy::50 %25%0D")


def test_the_summary_is_a_table_in_which_no_name_becomes_markup():
    text = summary([entry(), entry(spec=MARKUP, code=ExitCode.INVALID, status="invalid", errors=("x: <b>",))]).decode()
    assert "| a.yaml | analyze | ok |" in text
    assert "<script>" not in text
    assert "<b>" not in text
    assert "**invalid**" in text
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == 4

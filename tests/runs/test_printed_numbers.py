"""Every number that the papers print: the verdicts of `cfmkit papers`, and that none is missing."""

from __future__ import annotations

import runpy
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from cfmkit.cli import run_command
from cfmkit.errors import ExitCode, UsageError
from cfmkit.runs import papers
from cfmkit.runs.papers import VERDICT_MEANINGS, check, choose_rows, number, rows

ROOT = Path(__file__).parents[2]
TABLES = {  # numbers in the body of each table, counted in the papers
    ("sanchez-salinas-2022", "Table 1"): 14,
    ("sanchez-salinas-2022", "Table 2"): 6,
    ("sanchez-salinas-2022", "Table 3"): 33,
    ("lan-2010", "Table 1"): 5,
    ("lan-2010", "Table 2"): 12,
    ("lan-2010", "Table 3"): 24,
    ("lan-2010", "Table 4"): 20,
    ("ding-2022", "Table I"): 8,
    ("ding-2022", "Table II"): 28,
    ("bilancia-2019", "Table 1"): 15,
    ("bilancia-2019", "Table 2"): 9,
    ("bilancia-2019", "Table 3"): 69,
}


@pytest.fixture(scope="module")
def done():
    """All rows but those that take long, computed once: some 4 s, the price of a hundred analyses."""
    return list(check(rows()))


def test_every_verdict_holds(done):
    assert [(one.row.place, one.row.what, one.trouble) for one in done if one.trouble] == []


@pytest.mark.slow
def test_the_verdicts_of_what_takes_long_hold():
    heavy = [row for row in rows() if row.heavy]
    assert heavy
    assert [one.trouble for one in check(heavy, everything=True)] == [""] * len(heavy)


def test_the_page_is_that_of_the_rows(done):
    page = runpy.run_path(str(ROOT / "docs/make_papers.py"))["page"]
    assert (ROOT / "docs/papers.md").read_text() == page(done), "run docs/make_papers.py"


def test_every_table_is_complete():
    # Where a derived claim stands beside a table's own numbers its row says "by eq.".
    found = Counter()
    for row in rows():
        if "by eq." not in row.what:
            found[row.paper, row.place] += len(row.printed)
    assert {key: found[key] for key in TABLES} == TABLES


def test_every_row_is_whole():
    for row in rows():
        assert row.verdict in VERDICT_MEANINGS, row
        assert row.why or row.verdict in ("agrees", "arithmetic", "given", "measured there"), row
        assert row.why or not row.tolerance, row
        assert bool(row.ask) or row.verdict in ("measured there", "not modelled"), row
        assert bool(row.expected) == (bool(row.ask) and row.verdict in ("misprint", "disagrees", "measured there")), row


@pytest.mark.parametrize(
    ("verdict", "printed", "said"),
    [
        ("agrees", "50.1 N", "is not 50.1 N"),
        ("disagrees", "50.0 N", "is what is printed"),
        ("arithmetic", "50 N", "a model computes it"),
    ],
)
def test_a_wrong_verdict_is_seen_and_ends_with_5(monkeypatch, capsys, verdict, printed, said):
    (row,) = [row for row in rows() if row.what == "force for a stiffness of 1.38 N/mm"]
    wrong = replace(row, printed=(printed,), verdict=verdict)
    monkeypatch.setattr(papers, "rows", lambda: (wrong,))
    assert run_command(["papers", "cam"]) == ExitCode.REQUIREMENT_MISSED
    shown = capsys.readouterr()
    assert said in shown.err
    assert "DOES NOT HOLD" in shown.out


def test_arithmetic_of_printed_numbers_is_no_agreement():
    """Ten numbers that follow from others of their paper were counted as results of the models."""
    (row,) = [row for row in rows() if row.what == "fluctuation of the constant force"]
    (found,) = check([replace(row, verdict="agrees")])
    assert "its verdict is 'arithmetic'" in found.trouble
    assert sum(len(row.printed) for row in rows() if row.verdict == "arithmetic") == 12


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        ("no_such_metric", "has no value"),
        ("mechanism.no_such_key", "cannot be computed"),
        ("__import__('os')", "cannot be computed"),
        ("(lambda: 1)()", "is no question"),
        ('force("999 mm")', "not on the curve"),
    ],
)
def test_what_cannot_be_asked_is_no_agreement(ask, said):
    (row,) = [row for row in rows() if row.what == "force for a stiffness of 1.38 N/mm"]
    (found,) = check([replace(row, ask=(ask,))])
    assert said in found.trouble


def test_a_printed_number_counts_to_its_last_digit():
    assert (number("49.46 N").last, number("2.57e-4 kg*m^2").last) == pytest.approx((0.01, 1e-6))
    assert number("> 53 %").sign == ">"


def test_papers_are_chosen_by_name_or_family():
    assert {row.paper for row in choose_rows("slider-crank")} == {"bilancia-2019", "li-2019"}
    assert {row.family for row in choose_rows("Lan-2010")} == {"beam"}
    with pytest.raises(UsageError, match="did you mean 'lan-2010'"):
        choose_rows("lan2010")

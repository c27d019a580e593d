"""Two versions of the program compared: what is a changed number, a lost one, a changed text."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest

COMPARE = runpy.run_path(str(Path(__file__).parents[2] / "tools" / "compare_runs.py"))


@pytest.fixture
def compared(tmp_path):
    """Compare two runs with a file each; return the exit code and the lists of differences."""

    def compare(name, before, after, tolerance=0.0):
        for side, content in (("before", before), ("after", after)):
            folder = tmp_path / side / "cam-analyze"
            folder.mkdir(parents=True)
            (folder / "exit.txt").write_text("0\n")
            (folder / name).write_text(content)
        found = COMPARE["Differences"](tolerance)
        found.run("cam-analyze", tmp_path / "before", tmp_path / "after")
        code = COMPARE["compare"](tmp_path / "before", tmp_path / "after", tolerance)
        return code, (len(found.names), len(found.numbers), len(found.texts))

    return compare


@pytest.mark.parametrize(
    ("before", "after", "code", "counts"),
    [
        ("1.5", "1.5", 0, (0, 0, 0)),
        ("1.5", "1.50", 0, (0, 0, 0)),
        ("1.5", "1.6", 1, (0, 1, 0)),
        ("1.5", "", 1, (1, 0, 0)),
        ("1.5", "nan", 1, (1, 0, 0)),
        ("nan", "1.5", 1, (1, 0, 0)),
        ("nan", "nan", 0, (0, 0, 0)),
        ("", "1.5", 1, (1, 0, 0)),
        ("1.5", "inf", 1, (0, 1, 0)),
        ("inf", "nan", 1, (1, 0, 0)),
        ("corner", "flank", 0, (0, 0, 1)),
        ("", "flank", 0, (0, 0, 1)),
    ],
)
def test_a_cell_that_is_a_number_on_one_side_only_is_no_change_of_a_text(compared, before, after, code, counts):
    table = "force [N],contact\n2.5,flank\n{},flank\n"
    assert compared("curve.csv", table.format(before), table.format(after)) == (code, counts)


@pytest.mark.parametrize(
    ("before", "after", "code", "counts"),
    [
        (1.5, 1.5, 0, (0, 0, 0)),
        (1.5, 1.6, 1, (0, 1, 0)),
        (1.5, None, 1, (1, 0, 0)),
        (1.5, float("nan"), 1, (1, 0, 0)),
        (float("nan"), float("nan"), 0, (0, 0, 0)),
        (None, 2, 1, (1, 0, 0)),
        (1.5, float("inf"), 1, (0, 1, 0)),
        (1, True, 1, (1, 0, 0)),
        (None, "why", 0, (0, 0, 1)),
    ],
)
def test_a_value_that_is_a_number_on_one_side_only_is_no_change_of_a_text(compared, before, after, code, counts):
    texts = (json.dumps({"metrics": {"force_mean": {"value": value}}}) for value in (before, after))
    assert compared("metrics.json", *texts) == (code, counts)


def test_numbers_that_are_gone_from_a_column_are_one_line(compared):
    table = "force [N]\n" + "{}\n" * 3
    code, counts = compared("curve.csv", table.format(1, 2, 3), table.format("", 2, ""), tolerance=0.1)
    assert (code, counts) == (1, (1, 0, 0))

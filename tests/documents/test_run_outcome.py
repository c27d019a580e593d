"""The report on a result: its exit code, warnings and files."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit
from cfmkit.documents import run_outcome
from cfmkit.errors import ExitCode
from cfmkit.results import Design, Finding, Result, Status


@pytest.fixture(scope="module")
def spec():
    return cfmkit.load("configs/cam.yaml")


@pytest.mark.parametrize(
    ("codes", "first"),
    [
        ([], ExitCode.OK),
        ([ExitCode.OK, ExitCode.REQUIREMENT_MISSED], ExitCode.REQUIREMENT_MISSED),
        ([ExitCode.REQUIREMENT_MISSED, ExitCode.PARTIAL], ExitCode.PARTIAL),
        ([ExitCode.PARTIAL, ExitCode.NO_SOLUTION], ExitCode.NO_SOLUTION),
        ([ExitCode.NO_SOLUTION, ExitCode.INVALID], ExitCode.INVALID),
        ([ExitCode.INVALID, ExitCode.IO], ExitCode.IO),
        ([ExitCode.IO, ExitCode.BUG], ExitCode.BUG),
        ([ExitCode.OK, ExitCode.INTERRUPTED], ExitCode.INTERRUPTED),
    ],
)
def test_of_several_exit_codes_the_gravest_counts(codes, first):
    assert run_outcome.worst(codes) is first
    assert run_outcome.worst(codes[::-1]) is first


def test_a_report_without_a_curve_has_no_metrics_and_misses_its_requirements(spec):
    found = run_outcome.report_on(Result(spec, Status.INFEASIBLE, "too much"))
    assert found.metrics == {}
    assert len(found.missed) == len(spec.requirements)
    assert found.exit_code is ExitCode.NO_SOLUTION
    assert found.as_json()["message"] == "too much"


def test_warnings_of_design_and_analysis_are_told_once(spec):
    one, other = Finding("a", "first"), Finding("b", "second")
    result = Result(spec, Status.COMPLETE, warnings=(other, one))
    found = run_outcome.Report(result, {}, (), Design(spec, Status.COMPLETE, warnings=(one,)))
    assert found.warnings == (one, other)
    assert found.as_json()["warnings"] == [{"name": "a", "message": "first"}, {"name": "b", "message": "second"}]


def test_not_a_number_never_reaches_a_file():
    with pytest.raises(ValueError, match="Out of range float values"):
        run_outcome.json_bytes({"value": np.nan})

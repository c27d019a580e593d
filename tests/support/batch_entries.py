"""Outcomes of specifications in a batch: one of every kind."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cfmkit.errors import ExitCode
from cfmkit.studies import Entry

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


def entry(**more: Any) -> Entry:
    """Return the outcome of one analysis that is written, with other values."""
    return replace(Entry("a.yaml", "a", "analyze", "vcfm", "a", "complete", written=True), **more)


def hostile_entries(text: str) -> list[Entry]:
    """Return two outcomes in which a text stands for everything that a user names."""
    known = {"metric": text, "min": None, "max": 1.0, "unit": "1", "over": None, "over_unit": None}
    missed = known | {"value": 2.0, "ok": False, "sentence": text}
    fields: dict[str, Any] = dict.fromkeys(("spec", "folder", "verb", "family", "name", "status", "message"), text)
    ends = {
        "code": ExitCode.REQUIREMENT_MISSED,
        "requirements": (missed,),
        "warnings": ({"name": text, "message": text},),
    }
    return [Entry(**fields, **ends), Entry(**fields, code=ExitCode.INVALID, errors=(text,))]

"""The page of a request, as it is written."""

from __future__ import annotations

from html_outline import HOSTILE, Outline

from cfmkit.errors import ExitCode
from cfmkit.runs import suggest


def test_a_request_has_a_page_with_every_proposal_and_why_there_are_no_more():
    one = {
        "family": "cam", "variant": HOSTILE, "mean": 20.0, "ripple": 0.0123, "hysteresis": None, "safety_factor": 1.7,
        "across": 80.0, "along": 90.5, "depth": None, "parts": 12, "life": None, "stiffening": None,
        "folder": "1-cam-a b", "misses": [], "notes": [HOSTILE], "model": "quasi-static", "unjudged": [HOSTILE],
        "warnings": [HOSTILE], "verdict": "meets", "yield": None,
    }  # fmt: skip
    reported = {
        "status": "complete", "message": "1 meets the requirements",
        "suggest": {"force": "20 N", "envelope": ["1 mm", "2 mm"]},
        "proposals": [one], "unjudged": [], "order": ["size"],
        "near_misses": [one | {"family": "beam", "variant": "b", "misses": ["ripple 9 % > 5 %"], "verdict": "fails"}],
        "families": [{"family": "vcfm", "proposals": 0, "reason": HOSTILE, "nearest": {"travel": "4 mm"}}],
        "warnings": [{"name": "search_cut_short", "message": HOSTILE}],
    }  # fmt: skip
    texts = {"1-cam-a b": f"name: {HOSTILE}"}
    text = suggest.page(reported, ExitCode.OK, texts, {}, HOSTILE).decode()
    outline = Outline(text)
    assert outline.unbalanced == []
    assert {tag for tag, _ in outline.tags}.isdisjoint({"script", "img"})
    assert [attributes["href"] for tag, attributes in outline.tags if tag == "a"] == ["1-cam-a%20b/report.html"]
    for part in ("20 N, envelope 1 mm x 2 mm", "1.2 %", "80x90.5 mm", "ripple 9 % > 5 %", "travel 4 mm", HOSTILE):
        assert part in outline.text, part

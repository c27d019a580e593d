"""Pages, messages and docstrings use the words of docs/glossary.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
INSTEAD = {
    r"\basked\s+for\b": "requested",
    r"\b[Oo]ne (row|line|column|curve|table|file|entry|record) an? (?!time\b)[a-z]+": "one ... per ...",
    r"\b(lay|lays|laid)\s+(\w+\s+){0,4}over(\s+each\s+other)?\b": "overlay",
    r"\bhas\s+no\s+bound\b|\bhave\s+no\s+bound\b": "unbounded",
    r"\bno\s+lever\b": "no leverage",
    r"\bwhatever\s+becomes\s+of\b": "whether it could be solved or not",
    r"\bfor\s+sure\b": "certain",
    r"\b(bifurcations?|errors?|events?|faults?|place|nearest three)\s+(is|are)\s+told\b": "reported",
    r"\b(takes|goes)\s+before\b|\b--seed` goes": "takes precedence",
    r"\bsorted\s+out\b": "rejected",
}
"""What stumbles, and the word that stands in its place."""


def texts() -> list[Path]:
    package = ROOT / "cfmkit"
    return [*package.rglob("*.py"), *package.rglob("*.yaml"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md"]


@pytest.mark.parametrize("pattern", INSTEAD, ids=INSTEAD.values())
def test_a_word_of_the_glossary_stands_instead(pattern):
    found = [
        f"{path.relative_to(ROOT)}: {match[0]!r}: write {INSTEAD[pattern]!r}"
        for path in texts()
        for match in re.finditer(pattern, path.read_text(encoding="utf-8"))
    ]
    assert found == []


PRIVATE = r"\b(wish(es|ed)?|as[- ]made|wound to measure|press(ed)? it to|to first order|near miss(es)?|half way)\b"
"""Words that pages had before and that only the synonyms of the glossary name."""


def test_pages_say_requirements_unloaded_custom_and_linear_estimate():
    pages = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
    pages["glossary.md"] = pages["glossary.md"].partition("## Synonyms")[0]
    pages["README.md"] = (ROOT / "README.md").read_text(encoding="utf-8")
    assert {name: re.search(PRIVATE, text)[0] for name, text in pages.items() if re.search(PRIVATE, text)} == {}


def test_the_glossary_has_each_word_once():
    rows = re.findall(r"^\| ([^|]+) \|", (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8"), re.M)
    words = [word.strip() for row in rows for word in row.split(",") if row not in ("word", "---")]
    assert len(words) > 60
    assert sorted({word for word in words if words.count(word) > 1}) == []

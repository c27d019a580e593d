"""Documentation pages for `cfmkit docs`: listed, found by name, searched by word; the terms of the glossary.

A search also finds the names by which cfmkit calls what a user calls otherwise. They are in the second of two tables of
docs/glossary.md: word and meaning; synonym and the words used here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from cfmkit.errors import UsageError, visible
from cfmkit.runs.shipped_folders import shipped_folder

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path


@dataclass(frozen=True)
class GuidePage:
    """One page of the documentation."""

    name: str  # of its file, without the ending
    title: str  # its first heading
    path: Path  # the file, in Markdown; what it links to stands beside it

    @property
    def text(self) -> str:
        """Its text."""
        return self.path.read_text(encoding="utf-8")


def pages() -> tuple[GuidePage, ...]:
    """Return every page in the order of the index, those that it does not list last.

    Examples
    --------
    >>> [page.name for page in pages()][:3]
    ['index', 'tutorial', 'howto']
    """
    files = {path.stem: path for path in sorted(shipped_folder("docs", "tutorial.md").glob("*.md"))}
    listed = re.findall(r"^(\w+)$", files["index"].read_text(encoding="utf-8"), re.M)
    names = dict.fromkeys(["index", *(name for name in listed if name in files), *files])
    return tuple(GuidePage(name, _read_title(files[name]), files[name]) for name in names)


def _read_title(path: Path) -> str:
    with path.open(encoding="utf-8") as lines:
        return next((line[2:].strip().replace("`", "") for line in lines if line.startswith("# ")), path.stem)


def page(name: str) -> GuidePage:
    """Return one page by its name; ``docs/cam.md``, as files link to it, is the page ``cam``.

    Raises UsageError if there is none of that name.
    """
    by_name = {guide_page.name: guide_page for guide_page in pages()}
    wanted = name.removeprefix("docs/").partition("#")[0].removesuffix(".md").replace("-", "_")
    if wanted in by_name:
        return by_name[wanted]
    from cfmkit.specs.yamlio import did_you_mean

    hint = did_you_mean(wanted, list(by_name)) or f"`cfmkit docs --search {wanted}` searches them"
    raise UsageError(f"there is no page {visible(name)!r}; {hint}")


@cache
def read_glossary(heading: str) -> tuple[tuple[tuple[str, ...], str], ...]:
    """Return the rows of the glossary's tables whose first column is called `heading`: words, and the other cell."""
    rows: list[tuple[tuple[str, ...], str]] = []
    inside = False
    for text in (shipped_folder("docs", "tutorial.md") / "glossary.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in text.strip("|").split("|")]
        if not text.startswith("|") or len(cells) != 2:
            inside = False
        elif cells[0] == heading:
            inside = True
        elif inside and set(cells[0]) != {"-"}:
            rows.append((tuple(re.split(r", (?![^(]*\))", cells[0])), cells[1].replace("`", "")))
    return tuple(rows)


def read_terms() -> dict[str, str]:
    """Return the meaning of every word of the glossary, without what stands in brackets behind a word.

    Examples
    --------
    >>> read_terms()["ripple"]
    '(max - min)/max of the effort in the window'
    """
    meanings: dict[str, str] = {}
    for words, meaning in read_glossary("word"):
        for word in words:
            name = re.sub(r" \(.*\)", "", word)
            meanings[name] = f"{meanings[name]}; {meaning}" if name in meanings else meaning
    return meanings


def words_for_synonym(word: str) -> tuple[str, ...]:
    """Return the words and names that the glossary gives for a synonym; empty if it is none.

    Examples
    --------
    >>> words_for_synonym("bill of materials")
    ('parts.csv', 'bought spring', 'catalogue')
    """
    wanted = compile_phrases((word,))
    rows = (
        targets
        for words, targets in read_glossary("synonym")
        if any(wanted.fullmatch(synonym) or compile_phrases((synonym,)).fullmatch(word.strip()) for synonym in words)
    )
    return tuple(target for targets in rows for target in targets.split(", "))


def compile_phrases(phrases: Iterable[str]) -> re.Pattern[str]:
    """Return a pattern for phrases as whole words: in any case, in the plural, with blanks, hyphens or underscores.

    Examples
    --------
    >>> bool(compile_phrases(["test plan"]).search("the Test-plans of parts"))
    True
    >>> bool(compile_phrases(["bom"]).search("a bomb"))
    False
    >>> bool(compile_phrases(["natural frequency"]).fullmatch("natural frequencies"))
    True
    """
    parts = (r"[\s_-]+".join(map(re.escape, re.split(r"[\s_-]+", phrase.strip()))) for phrase in phrases)
    ends = (re.sub(r"y$", "(?:y|ie)", part) for part in parts)
    return re.compile(rf"(?<![^\W_])(?:{'|'.join(ends)})(?:s|es)?(?![^\W_])", re.I)


class PageSection(NamedTuple):
    """One section of a page, as a search finds it."""

    page: str
    heading: str
    line: str  # the first that names what was searched for
    score: float


HEADING_WEIGHT, TEXT_WEIGHT, MAX_COUNT_IN_TEXT = 6.0, 1.0, 5
"""Weight of a phrase in a heading, and in the text for each of so many times."""
SYNONYM_WEIGHT = 0.5  # weight of what the glossary names in place of the word itself
NAVIGATION_PAGES = ("index", "glossary")  # pages that name every subject and explain none: no search leads there


def search(word: str) -> list[PageSection]:
    """Return the sections that name a word or what the glossary says to look for instead, the best first.

    Several words that no section has as a phrase are looked for one by one: sections that name all of them.
    """
    sections = _score_sections(word)
    if not sections and len(parts := word.split()) > 1:
        of_parts = [{section[:2]: section for section in _score_sections(part)} for part in parts]
        shared = set(of_parts[0]).intersection(*of_parts[1:])
        sections = [
            section._replace(score=min(scored[key].score for scored in of_parts))
            for key, section in of_parts[0].items()
            if key in shared
        ]
    return sorted(sections, key=lambda section: -section.score)


def _score_sections(phrase: str) -> list[PageSection]:
    wanted = [
        (compile_phrases([phrase]), 1.0),
        *((compile_phrases([target]), SYNONYM_WEIGHT) for target in words_for_synonym(phrase)),
    ]
    rated = (_score_section(name, heading, text, wanted) for name, heading, text in _read_sections())
    return [section for section in rated if section.score > 0]


@cache
def _read_sections() -> tuple[tuple[str, str, str], ...]:
    """Return the page, heading and text of every section, but for those of `NAVIGATION_PAGES`."""
    subjects = (subject for subject in pages() if subject.name not in NAVIGATION_PAGES)
    return tuple(
        (subject.name, heading, text) for subject in subjects for heading, text in _split_into_sections(subject.text)
    )


def _split_into_sections(text: str) -> Iterator[tuple[str, str]]:
    """Yield the headings of a page with the text below each; comments in code are no headings."""
    parts = re.split(r"^#{1,4} (.*)$", re.sub(r"^```.*?^```", _mask_comments, text, flags=re.M | re.S), flags=re.M)
    yield from zip(parts[1::2], parts[2::2], strict=True)


def _mask_comments(block: re.Match[str]) -> str:
    return re.sub(r"^#", " #", block[0], flags=re.M)


def _score_section(name: str, heading: str, text: str, wanted: Sequence[tuple[re.Pattern[str], float]]) -> PageSection:
    score, shown = 0.0, ""
    for phrase, weight in wanted:
        count = len(phrase.findall(text))
        score += weight * (HEADING_WEIGHT * bool(phrase.search(heading)) + TEXT_WEIGHT * min(count, MAX_COUNT_IN_TEXT))
        shown = shown or next((line for line in text.splitlines() if phrase.search(line)), "")
    return PageSection(name, heading.replace("`", ""), re.sub(r"[`*]|\]\([^)]*\)|\[", "", shown).strip(" |-"), score)

"""Answers of `cfmkit show` to a word that is no name: terms and names that mean it, and pages on it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from cfmkit.cli.guide import compile_phrases, read_terms, search, words_for_synonym
from cfmkit.cli.show_topics import TOPIC_KINDS
from cfmkit.documents.document import Document, Paragraph, field, record_table
from cfmkit.specs.block import STUDY_BLOCKS

if TYPE_CHECKING:
    import re
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.documents.document import Block

KINDS_OF_NAMES = {"metrics": "metric", "values": "metric", "keys": "key", "findings": "warning"}
"""Kinds of names whose texts are searched, and what one of them is called."""
MAX_NAMES, MAX_PAGES = 14, 5  # on the page; the JSON document has all


class NamedMeaning(NamedTuple):
    """A name with its kind and meaning, and its rank: 0 for those that the glossary names."""

    rank: int
    name: str
    kind: str
    meaning: str


def explain_by_meaning(word: str) -> Document | None:
    """Return what there is on a word that is a term, a synonym, or part of a definition; None if there is nothing."""
    targets = words_for_synonym(word)
    named = _names(word, targets) if word.strip() else []
    matching_terms = [name for name in read_terms() if name == word or name in targets]
    meanings = [{"name": name, "meaning": read_terms()[name]} for name in matching_terms]
    names = [{"name": entry.name, "kind": entry.kind, "meaning": entry.meaning} for entry in named]
    headings: dict[str, str] = {}
    for section in search(word) if word.strip() else ():
        headings.setdefault(section.page, section.heading)
    if not (matching_terms or targets or named or headings):
        return None
    pages = [{"page": name, "section": heading} for name, heading in headings.items()]

    def blocks() -> Iterator[Block]:
        if targets:
            yield Paragraph("see", ", ".join(targets))
        meaning = field("meaning", wraps=True)
        yield from record_table("terms", meanings, (field("name", "word"), meaning))
        yield from record_table("names", names[:MAX_NAMES], (field("name", wraps=True), field("kind"), meaning))
        if (more := len(names) - MAX_NAMES) > 0:
            yield Paragraph("more", f"{more} names; --json has all")
        yield from record_table(
            "pages", pages[:MAX_PAGES], (field("page", "cfmkit docs"), field("section", wraps=True))
        )

    return Document({"look_for": [*targets], "terms": meanings, "names": names, "pages": pages}, blocks())


def _names(word: str, targets: Sequence[str]) -> list[NamedMeaning]:
    """Return the names that match a word: those of its glossary entry, then names with it, then meanings with it.

    Of keys that have one name and meaning in several blocks the shortest path stands for all, one that is analysed.
    """
    by_target, by_word = compile_phrases(targets or (word,)), compile_phrases((word,))
    named: dict[tuple[str, str, str], NamedMeaning] = {}
    for kind, path, meaning in _named_texts():
        last = path.rpartition(".")[2].removesuffix("[]")
        ranks = (by_target.fullmatch(last), _is_part(by_word, last), by_word.search(meaning))
        rank = next((rank for rank, match in enumerate(ranks) if match), None)
        if rank is not None:
            present = named.get((kind, last, meaning))
            if present is None or _sorting_key(path) < _sorting_key(present.name):
                named[kind, last, meaning] = NamedMeaning(rank, path, kind, meaning)
    return sorted(named.values(), key=lambda entry: entry.rank)


def _sorting_key(path: str) -> tuple[bool, int]:
    return path.partition(".")[0] in STUDY_BLOCKS, len(path)


def _is_part(word: re.Pattern[str], name: str) -> bool:
    """Return True if a name has a word in it: ``hysteresis_area`` has ``hysteresis``."""
    return bool(word.search(name.replace("_", " ")))


@cache
def _named_texts() -> tuple[tuple[str, str, str], ...]:
    """Return the kind, name (path of a key) and meaning of everything in `KINDS_OF_NAMES`."""
    return tuple(
        (singular, *_name_and_meaning(record))
        for kind, singular in KINDS_OF_NAMES.items()
        for record in TOPIC_KINDS[kind].records()
    )


def _name_and_meaning(record: Mapping[str, Any]) -> tuple[str, str]:
    text = record.get("definition") or record.get("meaning") or record.get("description") or ""
    return str(record.get("path") or record["name"]), str(text)

"""``cfmkit docs``: list the documentation pages shipped with the package, print one, or search their sections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.guide import page, pages, search, words_for_synonym
from cfmkit.cli.options import Common, argument, option
from cfmkit.documents.document import Document, Paragraph, Verbatim, field, record_table
from cfmkit.errors import UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Block


HELP_POSITION = 62
HELP_EXAMPLE = "cfmkit docs --search creep"
MAX_SECTIONS = 12  # most sections that a search prints; ``--json`` has all


@dataclass(frozen=True, kw_only=True)
class DocsOptions(Common):
    """Arguments and options."""

    name: str | None = argument("PAGE", "Page to print, in Markdown; default: list all pages.", default=None)
    search: str | None = option("WORD", "List the sections on a word or its synonyms: creep, BOM, lifetime.")


def run(options: DocsOptions, terminal: Terminal) -> Document:
    """List the pages of the documentation, search them, or print one; they come with cfmkit and need no network."""
    if options.name is not None and options.search is not None:
        raise UsageError("give a page or --search, not both")
    if options.search is not None:
        return _search(options.search)
    if options.name is not None:
        shown = page(options.name)
        record = {"name": shown.name, "title": shown.title, "path": str(shown.path), "text": shown.text}
        return Document(record, (Verbatim(shown.text),))
    listing = pages()
    records = [{"name": item.name, "title": item.title, "path": str(item.path)} for item in listing]
    fields = (field("name"), field("title", wraps=True))
    where = Paragraph("files", f"{listing[0].path.parent}; a link to FILE.md in a page is `cfmkit docs FILE`")
    return Document({"pages": records}, (*record_table("pages", records, fields), where))


def _search(word: str) -> Document:
    """Return the sections on a word.

    Raises UsageError if there is none.
    """
    if not (sections := search(word) if word.strip() else []):
        raise UsageError(f"no section names {visible(word)!r}; `cfmkit docs` lists all pages")
    records = [{"page": section.page, "section": section.heading, "line": section.line} for section in sections]

    def blocks() -> Iterator[Block]:
        if targets := words_for_synonym(word):
            yield Paragraph("see", ", ".join(targets))
        columns = (field("page"), field("section", wraps=True), field("line", "", wraps=True))
        yield from record_table("", records[:MAX_SECTIONS], columns)
        if (more := len(records) - MAX_SECTIONS) > 0:
            yield Paragraph("more", f"{more} sections; --json has all")
        yield Paragraph("read", f"`cfmkit docs {records[0]['page']}` prints a page")

    return Document({"search": word, "look_for": [*words_for_synonym(word)], "sections": records}, blocks())

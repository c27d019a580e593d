"""``cfmkit docs``: the documentation that comes with the package."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cfmkit.cli.answer import Answer
from cfmkit.cli.options import Common, argument
from cfmkit.cli.page_blocks import Paragraph, Verbatim, field, listed

if TYPE_CHECKING:
    from cfmkit.cli.terminal import Terminal

PLACE = 62
EXAMPLE = "cfmkit docs tutorial"


@dataclass(frozen=True, kw_only=True)
class DocsOptions(Common):
    """Arguments and options."""

    name: Annotated[str | None, argument("PAGE", "Print this one, in Markdown; default: list all.")] = None


def run(options: DocsOptions, terminal: Terminal) -> Answer:
    """List the pages of the documentation, or print one; they come with cfmkit and need no network."""
    from cfmkit.runs.documentation import page, pages

    if options.name is not None:
        found = page(options.name)
        record = {"name": found.name, "title": found.title, "path": str(found.path), "text": found.text}
        return Answer(record, (Verbatim(found.text),))
    known = pages()
    records = [{"name": one.name, "title": one.title, "path": str(one.path)} for one in known]
    fields = (field("name"), field("title", wraps=True))
    where = Paragraph("files", f"{known[0].path.parent}; a link to FILE.md in a page is `cfmkit docs FILE`")
    return Answer({"pages": records}, (*listed("pages", records, fields), where))

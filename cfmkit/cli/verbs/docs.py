"""``cfmkit docs``: the documentation that comes with the package."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cfmkit.cli.options import Common, argument
from cfmkit.documents.document import Document, Paragraph, Verbatim, field, listed
from cfmkit.errors import UsageError, visible
from cfmkit.runs.find_shipped_folder import shipped_folder

if TYPE_CHECKING:
    from pathlib import Path

    from cfmkit.cli.output import Terminal


PLACE = 62
EXAMPLE = "cfmkit docs tutorial"


@dataclass(frozen=True, kw_only=True)
class DocsOptions(Common):
    """Arguments and options."""

    name: Annotated[str | None, argument("PAGE", "Page to print, in Markdown; default: list all pages.")] = None


def run(options: DocsOptions, terminal: Terminal) -> Document:
    """List the pages of the documentation, or print one; they come with cfmkit and need no network."""
    if options.name is not None:
        found = page(options.name)
        record = {"name": found.name, "title": found.title, "path": str(found.path), "text": found.text}
        return Document(record, (Verbatim(found.text),))
    known = pages()
    records = [{"name": one.name, "title": one.title, "path": str(one.path)} for one in known]
    fields = (field("name"), field("title", wraps=True))
    where = Paragraph("files", f"{known[0].path.parent}; a link to FILE.md in a page is `cfmkit docs FILE`")
    return Document({"pages": records}, (*listed("pages", records, fields), where))


FIRST = ("index", "tutorial", "howto", "reference")
"""Pages that a newcomer reads first."""


@dataclass(frozen=True)
class GuidePage:
    """One page."""

    name: str  # of its file, without the ending
    title: str  # its first heading
    path: Path  # the file, in Markdown; what it links to stands beside it

    @property
    def text(self) -> str:
        """Its text."""
        return self.path.read_text(encoding="utf-8")


def pages() -> tuple[GuidePage, ...]:
    """Return every page, those for newcomers first.

    Examples
    --------
    >>> [page.name for page in pages()][:3]
    ['index', 'tutorial', 'howto']
    """
    found = {path.stem: path for path in sorted(shipped_folder("docs", "tutorial.md").glob("*.md"))}
    names = [*(name for name in FIRST if name in found), *(name for name in found if name not in FIRST)]
    return tuple(GuidePage(name, _title(found[name]), found[name]) for name in names)


def _title(path: Path) -> str:
    with path.open(encoding="utf-8") as lines:
        return next((line[2:].strip().replace("`", "") for line in lines if line.startswith("# ")), path.stem)


def page(name: str) -> GuidePage:
    """Return one page by its name; ``docs/cam.md``, as files link to it, is the page ``cam``.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is none of that name.
    """
    known = {one.name: one for one in pages()}
    wanted = name.removeprefix("docs/").partition("#")[0].removesuffix(".md").replace("-", "_")
    if wanted in known:
        return known[wanted]
    near = difflib.get_close_matches(wanted, known, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else "; `cfmkit docs` lists them"
    raise UsageError(f"there is no page {visible(name)!r}{hint}")

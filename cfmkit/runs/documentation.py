"""The pages of the documentation, which come with the package: links between them work without a network.

In the tree they are the folder `docs`; a wheel has them as the package `cfmkit.docs`.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError, visible
from cfmkit.runs.shipped import shipped_folder

if TYPE_CHECKING:
    from pathlib import Path

FIRST = ("index", "tutorial", "howto", "reference")
"""Pages that a newcomer reads first."""


@dataclass(frozen=True)
class GuidePage:
    """One page.

    Attributes
    ----------
    name : str
        Of its file, without the ending.
    title : str
        Its first heading.
    path : Path
        The file, in Markdown; what it links to stands beside it.
    """

    name: str
    title: str
    path: Path

    @property
    def text(self) -> str:
        """What it says."""
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

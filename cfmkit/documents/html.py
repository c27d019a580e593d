"""A document as one HTML file to send to somebody, and what all pages need: templates, figures as SVG, escaped JSON.

Nothing in a page leads outside: figures, films and scripts stand in the file. Every text is escaped by the template,
what a script reads is JSON in which no tag can end the script, and without scripts all of it can be read.
"""

from __future__ import annotations

import json
from importlib.resources import files
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import Tone
from cfmkit.errors import visible

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.documents.document import Document, PageTable

REPORT_NAME = "report.html"


def page(
    document: Document,  # what was found
    drawn: Mapping[str, Figure | str] = MappingProxyType({}),  # the figures by their names, or their SVG
    *,
    subject: str = "",  # what it is of, in one line
    command: str = "",  # how it was started, for whoever wants to repeat it
    texts: Sequence[tuple[str, str]] = (),  # texts that are folded under a heading
    metrics: PageTable | None = None,  # every metric, folded
    **more: Any,  # what the template knows besides: `film`, `points`, `script`, `references`, `bibtex`, `versions`
) -> bytes:
    """Return the page of a document; the same document gives the same bytes."""
    figures = {name: figure if isinstance(figure, str) else drawing(figure, name) for name, figure in drawn.items()}
    text: str = template("document.html.j2").render(
        document=document,
        required=[row for row in document.headline if row.required],
        facts=[row for row in document.headline if not row.required],
        figures=figures,
        subject=subject,
        command=command,
        texts=texts,
        metrics=metrics,
        style=part("report.css"),
        GOOD=Tone.GOOD,
        BAD=Tone.BAD,
        **more,
    )
    return text.encode()


def drawing(figure: Figure, name: str) -> str:
    """Return a figure as SVG text for a page."""
    from cfmkit.plots.vector_formats import inline, svg

    return inline(svg(figure), identifier(name))


def template(name: str, package: str = "cfmkit.documents") -> Any:
    """Return a template of a package."""
    from jinja2 import Environment

    # escaping is on for every expression; only what is marked safe in the template is markup, and all of it is ours
    plain = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown_in_page)
    return plain.from_string(part(name, package))


def _shown_in_page(value: Any) -> Any:
    """Return a text with its control characters escaped, line feeds and tabs aside; markup and numbers as they are."""
    return "\n".join(map(visible, value.split("\n"))) if type(value) is str else value


def part(name: str, package: str = "cfmkit.documents") -> str:
    """Return the text of a file of a package: a template, a style or a script."""
    return files(package).joinpath(name).read_text(encoding="utf-8")


def identifier(name: str) -> str:
    """Return a name for parts of a page: letters, digits and ``-``."""
    return "".join(char if char.isalnum() and char.isascii() else "-" for char in name)


def references_of(name: str) -> dict[str, Any]:
    """Return the papers of a family and the versions of the software, for the end of a page."""
    from cfmkit._version import __version__
    from cfmkit.families import family
    from cfmkit.store.run_folder import imported_versions

    record = family(name)
    versions = {"cfmkit": __version__, **imported_versions()}
    return {"references": [paper.reference for paper in record.papers], "bibtex": record.bibtex, "versions": versions}


def escaped_json(data: Any) -> str:
    """Return JSON for a script of a page: no text in it can end the script."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")

"""``cfmkit show``: what the program knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer, told_of
from cfmkit.cli.options import Common

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from cfmkit.cli.pages import Page, Section
    from cfmkit.cli.terminal import Terminal

PLACE = 60

Topic = Annotated[
    str | None,
    typer.Argument(
        metavar="[FAMILY|units|metrics|materials|references|NAME]",
        help="What to explain: a topic, or anything by its name: pla, force_ripple, MPa; default: list what there is.",
        show_default=False,
        autocompletion=completion.topics,
    ),
]


@dataclass(frozen=True, kw_only=True)
class Options(Common):
    """Arguments and options."""

    topic: Topic = None


def run(options: Options, terminal: Terminal) -> Answer:
    """Explain a family with every key of its spec, list units, metrics, materials or papers, or explain one by name."""
    from cfmkit.cli.topics import page, skipped

    found = page(options.topic)
    answer = Answer({"show": options.topic} | dict(found.data), lambda screen: screen.show(*rendered(found)))
    return told_of(skipped(options.topic), answer)


def rendered(found: Page) -> Iterator[RenderableType]:
    """Yield the lines and tables of a page."""
    from rich.text import Text

    from cfmkit.cli.terminal import LABEL

    yield Text.assemble((found.title, LABEL), "  ", found.text)
    for section in found.sections:
        if section.records:
            yield Text()
            if section.heading:
                yield Text(section.heading, LABEL)
            yield _table(section)


def _table(section: Section) -> RenderableType:
    from rich.table import Table
    from rich.text import Text

    from cfmkit.cli.terminal import FAINT

    headed = any(column.head for column in section.columns)
    table = Table(box=None, show_header=headed, header_style=FAINT, padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column("", width=0)
    for column in section.columns:
        table.add_column(column.head, overflow="fold", no_wrap=not column.wraps, ratio=1 if column.wraps else None)
    for record in section.records:
        table.add_row("", *(Text(column.cell(record)) for column in section.columns))
    return table

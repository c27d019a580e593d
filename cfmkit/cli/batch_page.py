"""The summary of a batch on the terminal: one line a specification, what is wrong below it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from cfmkit.cli.layout import across, paragraph, written
from cfmkit.cli.terminal import BAD, FAINT, GOOD, LABEL
from cfmkit.errors import ExitCode, visible
from cfmkit.studies.batch import message, outcome

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rich.console import RenderableType

    from cfmkit.cli.terminal import Terminal
    from cfmkit.cli.verbs.batch import Ending
    from cfmkit.studies.batch import Entry


def show_batch(entries: Sequence[Entry], ending: Ending, terminal: Terminal) -> None:
    """Print the summary of a batch."""
    terminal.show(*_page(entries, ending, terminal))


def _page(entries: Sequence[Entry], ending: Ending, terminal: Terminal) -> Iterator[RenderableType]:
    count = sum(one.reused for one in entries)
    reused = f", {count} reused" if count else ""
    yield across(Text(message(entries), LABEL), f"{ending.seconds:.2f} s{reused}", terminal.width)
    yield Text()
    yield _table(entries)
    yield Text()
    for one in entries:
        for requirement in one.missed if one.verb and not one.errors else ():
            told = requirement["sentence"].removesuffix(": missed")
            yield from paragraph("missed", f"{visible(one.spec)}: {told}", terminal.width, BAD)
        if terminal.verbose:
            for item in one.warnings:
                yield from paragraph(
                    "warning", f"{visible(one.spec)}: {item['name']}: {item['message']}", terminal.width, BAD
                )
    yield from written(ending.folder, ending.files, terminal)
    if ending.junit:
        yield from paragraph("written", ending.junit, terminal.width, GOOD)


def _table(entries: Sequence[Entry]) -> Table:
    grid = Table.grid(padding=(0, 2, 0, 0))
    for _ in range(4):
        grid.add_column(overflow="fold")
    for one in entries:
        word = outcome(one)
        good = word == "ok"
        style = GOOD if good else FAINT if one.skipped else BAD
        grid.add_row(
            Text(f"  {visible(one.spec)}"),
            Text(one.verb),
            Text(word if good or one.skipped else word.upper(), style),
            _detail(one),
        )
    return grid


def _detail(one: Entry) -> Text:
    """Return how many requirements are met, or what went wrong before any could be."""
    if one.skipped:
        return Text("")
    if one.errors:
        return Text("see above")
    if one.missed and one.code is ExitCode.REQUIREMENT_MISSED:
        return Text(f"{len(one.missed)} of {len(one.requirements)} requirements")
    if one.code:
        return Text(one.message)
    told = f"{len(one.requirements)} requirement{'s' * (len(one.requirements) != 1)} met"
    count = len(one.warnings)
    return Text(told + (f", {count} warning{'s' * (count != 1)}" if count else ""))

"""The page that a run prints: a header, the numbers that matter, requirements, warnings, files."""

from __future__ import annotations

import shlex
import textwrap
from collections import defaultdict
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from cfmkit.cli.rows import rows, searched
from cfmkit.cli.terminal import BAD, FAINT, GOOD, LABEL
from cfmkit.errors import ExitCode, visible
from cfmkit.runs.specfile import STDIN

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rich.console import RenderableType

    from cfmkit.cli.rows import Row
    from cfmkit.cli.runs import Outcome
    from cfmkit.cli.terminal import Terminal
    from cfmkit.specs.spec import Spec

MARGIN = 9
"""Columns of the words that begin a paragraph: ``warning``, ``written``."""

MOST_NAMES = 2
"""How many files of one folder are named."""


def show_run(outcome: Outcome, terminal: Terminal) -> None:
    """Print the page of a finished run."""
    terminal.show(*_page(outcome, terminal))


def _page(outcome: Outcome, terminal: Terminal) -> Iterator[RenderableType]:
    yield _header(outcome, terminal.width)
    yield Text()
    found = outcome.report
    if listed := rows(found, everything=terminal.verbose > 0):
        yield _numbers(listed)
        yield Text()
    for word, text in found.supplement.lines:
        yield from paragraph(word, text, terminal.width)
    for text in searched(found.design.search) if found.design else ():
        yield from paragraph("search", text, terminal.width)
    yield from _verdict(outcome, terminal.width)
    yield from _warnings(outcome, terminal.width)
    yield from written(outcome.folder, [*outcome.written, "manifest.json"], terminal)
    yield from _kept(outcome, terminal.width)


def cure_command(outcome: Outcome, cure: str) -> str:
    """Return the command line that applies a cure to the spec of a run, changed as it was."""
    verb = "design" if cure.startswith("design.") else outcome.verb.name
    path = cure.partition("=")[0]
    kept = [change for change in outcome.changes if change.partition("=")[0].strip() != path]
    settings = [word for change in (*kept, cure) for word in ("--set", change)]
    folder = ["-o", outcome.folder] if outcome.source == STDIN else []
    return " ".join(map(quoted, ["cfmkit", verb, outcome.source, *settings, *folder]))


def quoted(word: str) -> str:
    """Return a word of a command line as a shell takes it, on one line whatever it holds."""
    if word.isprintable():
        return shlex.quote(word)
    escaped = word.replace("\\", "\\\\").replace("'", "\\'")
    return f"$'{visible(escaped)}'"


def _header(outcome: Outcome, width: int) -> Text:
    spec = outcome.report.result.spec
    done = outcome.verb.done if outcome.report.result.status.usable else "tried"
    left, right = title(spec), f"{done} in {outcome.seconds:.2f} s"
    return left if left.cell_len + len(right) + 2 > width else across(left, right, width)


def _numbers(listed: Iterable[Row]) -> Table:
    grid = Table.grid(padding=(0, 3, 0, 0))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_column(no_wrap=True)
    grid.add_column(no_wrap=True)
    for row in listed:
        verdict = Text() if row.ok is None else Text("ok", GOOD) if row.ok else Text("MISSED", BAD)
        grid.add_row(Text(f"  {row.label}"), Text(row.value), Text(row.bound), verdict)
    return grid


def _verdict(outcome: Outcome, width: int) -> Iterator[Text]:
    """Yield how the run ended, where that is not as asked, and what the design decided."""
    found = outcome.report
    status, design = found.status, found.design
    if status.exit_code is not ExitCode.OK:
        word = "partial" if status.usable else "failed"
        yield from paragraph(word, found.message, width, BAD)
    elif design is not None and design.message != design.status.value:
        yield from paragraph("design", design.message, width)
    if design is not None and design.nearest_feasible:
        near = ", ".join(f"{path} = {value}" for path, value in design.nearest_feasible.items())
        yield from paragraph("feasible", near, width)
    if found.missed:
        missed = f"{len(found.missed)} of {len(found.requirements)} requirements"
        yield from paragraph("missed", missed, width, BAD)


def _warnings(outcome: Outcome, width: int) -> Iterator[Text]:
    for item in outcome.report.warnings:
        if item.message == outcome.report.result.message:
            continue
        yield from paragraph("warning", f"{item.name}: {item.message}" + (":" if item.cures else ""), width, BAD)
        for cure in item.cures:
            yield Text(" " * MARGIN + cure_command(outcome, cure), no_wrap=True, overflow="ignore")


def written(folder: str, names: Iterable[str], terminal: Terminal) -> Iterator[Text]:
    """Yield the lines that say what stands in a folder now; all of it under ``-v``."""
    most = None if terminal.verbose else MOST_NAMES
    told = " ".join(_braced(names, most))
    yield from paragraph("written", f"{visible(folder.rstrip('/'))}/  {told}", terminal.width, GOOD)


def _kept(outcome: Outcome, width: int) -> Iterator[Text]:
    for name, spare in outcome.kept.items():
        yield from paragraph("kept", f"{name} had been edited; that version is now {spare}", width, BAD)


def _braced(names: Iterable[str], most: int | None) -> Iterator[str]:
    """Yield names, those of one folder together: ``geometry/{cam.dxf,cam.svg,...}``."""
    folders: dict[str, list[str]] = defaultdict(list)
    for name in names:
        folder, _, base = name.rpartition("/")
        folders[folder].append(base)
    for folder, bases in folders.items():
        if most is None or not folder:
            yield from (f"{folder}/{base}" if folder else base for base in bases)
        elif len(bases) == 1:
            yield f"{folder}/{bases[0]}"
        else:
            more = ["..."] if len(bases) > most else []
            yield f"{folder}/{{{','.join([*bases[:most], *more])}}}"


def title(spec: Spec) -> Text:
    """Return what a page is about: the family and the name, on one line."""
    return Text.assemble((spec.family, LABEL), "  ", " ".join(spec.name.split()))


def across(left: Text, right: str, width: int) -> Text:
    """Return a line with one text at each of its ends."""
    return Text.assemble(left, " " * max(2, width - left.cell_len - len(right)), (right, FAINT))


def paragraph(word: str, text: str, width: int, style: str = LABEL) -> Iterator[Text]:
    """Yield the lines of a paragraph that a word begins; nothing in it is cut."""
    lines = textwrap.wrap(text, width - MARGIN, break_long_words=False, break_on_hyphens=False) or [""]
    yield _line(Text.assemble((f"{word:<{MARGIN}}", style), lines[0]))
    for line in lines[1:]:
        yield _line(Text(" " * MARGIN + line))


def _line(text: Text) -> Text:
    """Return a line that keeps its length where it is too long: paths and commands are copied."""
    text.no_wrap, text.overflow = True, "ignore"
    return text

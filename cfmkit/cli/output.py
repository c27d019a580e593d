"""How results reach the user: text for people on a terminal, or one JSON document.

Results go to standard output, everything else to standard error. What a page consists of
is said in `cfmkit.cli.page_block_types`; here it becomes characters, and nowhere else.
"""

from __future__ import annotations

import io
import json
import shutil
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.cli import streams
from cfmkit.cli.page_block_types import FAINT, MARGIN, CellGrid, JsonText, Paragraph, Span, TextLine, Verbatim
from cfmkit.errors import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table
    from rich.text import Text

    from cfmkit.cli.page_block_types import Block

    Report = Callable[[float, str], None]

NARROWEST, WIDEST = 40, 108
"""Columns of a page. In 40 the page of a cam still shows every number beside its name; wider than 108 a paragraph is
hard to read, and few lines except commands to copy are that long."""

LEAST_GAP = 2
"""Columns between the two ends of a line: fewer would read as one text."""


@dataclass(frozen=True)
class Terminal:
    """What is known about the user's wishes for output."""

    arguments: tuple[str, ...] = ()  # the command line, without the program's name
    # json, quiet: whether results are a JSON document, or not shown
    json: bool = False
    quiet: bool = False
    verbose: int = 0  # how often ``-v`` was given

    @classmethod
    def guess(cls, arguments: Sequence[str]) -> Terminal:
        """Return what a command line that may be malformed seems to wish."""
        given = list(arguments[: arguments.index("--")] if "--" in arguments else arguments)
        flags = "".join(item[1:] for item in given if item.startswith("-") and item[1:].strip("vq") == "")
        verbose = flags.count("v") + given.count("--verbose")
        return cls(tuple(arguments), "--json" in given, verbose=verbose)

    @property
    def width(self) -> int:
        """Columns to fill; redirected output gets as many as a wide terminal."""
        return max(NARROWEST, min(shutil.get_terminal_size((WIDEST, 24)).columns, WIDEST))

    @property
    def tracebacks(self) -> bool:
        """Whether the user wants to see them."""
        return self.verbose >= 2

    def show(self, *blocks: Block) -> None:
        """Print blocks of a page to standard output."""
        streams.put("".join(map(self._printed, blocks)))

    def document(self, data: Mapping[str, Any]) -> None:
        """Print one JSON document to standard output."""
        streams.put(_json(data))

    def complain(self, lines: Sequence[str]) -> None:
        """Print lines to standard error."""
        for line in lines:
            streams.complain(f"{visible(line)}\n")

    @contextmanager
    def progress(self) -> Iterator[Report]:
        """Yield what reports progress: a bar, if somebody watches standard error."""
        if self.json or self.quiet or not sys.stderr.isatty():
            yield lambda _fraction, _text: None
            return
        bar = Bar()
        try:
            yield bar.report
        finally:
            bar.close()

    def _printed(self, block: Block) -> str:
        """Return a block as this terminal prints it."""
        if isinstance(block, Verbatim):
            return block.text
        if isinstance(block, JsonText):
            return _json(block.data)
        return self._rendered(block)

    def _rendered(self, block: TextLine | Paragraph | CellGrid) -> str:
        from rich.console import Console

        page = io.StringIO()
        colours = True if sys.stdout.isatty() else None
        console = Console(
            file=page, force_terminal=colours, width=self.width, highlight=False, markup=False, emoji=False
        )
        for item in _renderables(block, self.width):
            # What a text says about wrapping would be lost: rich prints a copy of it.
            no_wrap, overflow = getattr(item, "no_wrap", None), getattr(item, "overflow", None)
            console.print(_Visible(item), crop=False, no_wrap=no_wrap, overflow=overflow)
        return "\n".join(line.rstrip() for line in page.getvalue().split("\n"))


def _json(data: Mapping[str, Any]) -> str:
    ascii_only = not streams.speaks_utf8(sys.stdout)
    return json.dumps(data, indent=2, ensure_ascii=ascii_only, allow_nan=False) + "\n"


def _renderables(block: TextLine | Paragraph | CellGrid, width: int) -> Iterator[RenderableType]:
    """Yield what rich prints of a block; of a paragraph line by line."""
    if isinstance(block, CellGrid):
        yield _table(block, width)
    elif isinstance(block, Paragraph):
        import textwrap

        lines = textwrap.wrap(block.text, width - MARGIN, break_long_words=False, break_on_hyphens=False) or [""]
        yield _text(Span(f"{block.word:<{MARGIN}}", block.tone), Span(lines[0]), whole=True)
        for text in lines[1:]:
            yield _text(Span(" " * MARGIN + text), whole=True)
    else:
        yield _line(block, width)


def _line(block: TextLine, width: int) -> Text:
    left = _text(*block.spans, whole=block.whole)
    room = width - left.cell_len - len(block.right)
    if not block.right or (block.droppable and room < LEAST_GAP):
        return left
    return left.append(" " * max(LEAST_GAP, room)).append(block.right, FAINT)


def _text(*spans: Span, whole: bool = False) -> Text:
    from rich.text import Text

    text = Text.assemble(*((span.text, span.tone) for span in spans))
    if whole:
        text.no_wrap, text.overflow = True, "ignore"
    return text


SHORTEST = 8
"""Columns that a cell of several lines gets at least: most words of the pages are not longer."""


def _least_width(block: CellGrid, rows: Sequence[Sequence[Text]]) -> int:
    """Return how wide a page has to be for a table of which only the columns of texts wrap."""
    widths = (2 if block.indented else 0) + block.gap * (len(block.columns) - 1)
    for place, column in enumerate(block.columns):
        longest = max([len(column.head), *(row[place].cell_len for row in rows if place < len(row))])
        widths += min(longest, SHORTEST) if column.wraps else longest
    return widths


def _table(block: CellGrid, width: int) -> Table:
    from rich.table import Table

    headed = any(column.head for column in block.columns)
    table = Table(box=None, show_header=headed, header_style=FAINT, padding=(0, block.gap, 0, 0), pad_edge=False)
    if block.indented:
        table.add_column("", width=0)
    rows = [[_text(cell if isinstance(cell, Span) else Span(cell)) for cell in row] for row in block.rows]
    # Where the page is too narrow for what should not wrap, this is folded, too: a number that loses its last digit
    # or its unit at the margin would be a wrong one.
    folded = _least_width(block, rows) > width
    for column in block.columns:
        table.add_column(column.head, overflow="fold", no_wrap=not (column.wraps or folded))
    for cells in rows:
        table.add_row(*([""] if block.indented else []), *cells)
    return table


@dataclass(frozen=True)
class _Visible:
    """Something to print, in which a name that holds control characters commands nothing."""

    item: RenderableType

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        from rich.segment import Segment

        for text, style, control in console.render(self.item, options):
            yield Segment("\n".join(map(visible, text.split("\n"))), style, control)


class Bar:
    """The progress bar on standard error, one for all verbs: it appears with the first report and leaves nothing."""

    def __init__(self) -> None:
        """Show nothing yet."""
        self._progress: Any = None
        self._task: Any = None
        self._most = 0

    def report(self, fraction: float, text: str) -> None:
        """Show how far a run is, by the share that is done; a search that looks again does not move it back."""
        self._most = max(self._most, round(100 * fraction))
        self.show(self._most, 100, text)

    def show(self, done: int, total: int, text: str) -> None:
        """Show how many of how many things are done."""
        if self._progress is None:
            self._start(total)
        self._progress.update(self._task, completed=done, total=total, description=text)

    def close(self) -> None:
        """Remove the bar."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None

    def _start(self, total: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

        columns = BarColumn(), TaskProgressColumn(), TextColumn("{task.description}", markup=False)
        self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task = self._progress.add_task("", total=total)
        self._progress.start()

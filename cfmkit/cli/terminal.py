"""How results reach the user: text for people on a terminal, or one JSON document.

Results go to standard output, everything else to standard error. Colours only
repeat what a word says, and blue stands against yellow, which everybody can tell
apart.
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
from cfmkit.errors import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment

    Report = Callable[[float, str], None]

NARROWEST, WIDEST = 40, 108
GOOD, BAD, LABEL, FAINT = "cyan", "bold yellow", "bold", "dim"


@dataclass(frozen=True)
class Terminal:
    """What is known about the user's wishes for output.

    Attributes
    ----------
    arguments : tuple of str
        The command line, without the program's name.
    json, quiet : bool
        Whether results are a JSON document, or not shown.
    verbose : int
        How often ``-v`` was given.
    """

    arguments: tuple[str, ...] = ()
    json: bool = False
    quiet: bool = False
    verbose: int = 0

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

    def show(self, *items: RenderableType) -> None:
        """Print renderables to standard output."""
        page = io.StringIO()
        console = self._console(page)
        for item in items:
            # What a text says about wrapping would be lost: rich prints a copy of it.
            no_wrap, overflow = getattr(item, "no_wrap", None), getattr(item, "overflow", None)
            console.print(_Visible(item), crop=False, no_wrap=no_wrap, overflow=overflow)
        streams.put("\n".join(line.rstrip() for line in page.getvalue().split("\n")))

    def text(self, text: str) -> None:
        """Print text as it is."""
        streams.put(text)

    def document(self, data: Mapping[str, Any]) -> None:
        """Print one JSON document to standard output."""
        ascii_only = not streams.speaks_utf8(sys.stdout)
        streams.put(json.dumps(data, indent=2, ensure_ascii=ascii_only, allow_nan=False) + "\n")

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

    def _console(self, page: io.StringIO) -> Console:
        """Return a console that writes to a page what standard output could show."""
        from rich.console import Console

        colours = True if sys.stdout.isatty() else None
        return Console(file=page, force_terminal=colours, width=self.width, highlight=False, markup=False, emoji=False)


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

    def report(self, fraction: float, text: str) -> None:
        """Show how far a run is, by the share that is done."""
        self.show(round(100 * fraction), 100, text)

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

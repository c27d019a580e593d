"""Output of a command: results to standard output, all else to standard error, progress as a bar or as lines.

Standard output and error never end a run: not by a closed pipe, nor by a character that cannot be encoded.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.errors import OutputError, reason_of, visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import TextIO

    from cfmkit.documents.document import Block, Document

    Report = Callable[[float, str], None]


def make_tolerant() -> None:
    """Make both streams escape characters that their encoding lacks; a stream that is closed discards everything."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream := getattr(sys, name), "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def write_output(text: str) -> None:
    """Write to standard output; if the reading process has ended (``| head``) the rest is dropped.

    Raises OutputError if it cannot be written for another reason: a full disk behind a redirection.
    """
    try:
        _write_and_flush(sys.stdout, text)
    except BrokenPipeError:
        discard_output(sys.stdout)
    except OSError as error:
        discard_output(sys.stdout)
        raise OutputError(f"cannot write standard output: {reason_of(error)}") from None


def write_error(text: str) -> None:
    """Write to standard error, if that is possible; unprintable characters are escaped."""
    try:
        _write_and_flush(sys.stderr, "\n".join(map(visible, text.split("\n"))))
    except OSError:
        discard_output(sys.stderr)


def flush() -> None:
    """Flush both streams, so that nothing is left that could fail when the interpreter ends."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            discard_output(stream)


def discard_output(stream: TextIO) -> None:
    """Redirect a stream to the null device, with what its buffer still holds."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def can_encode_all(stream: TextIO) -> bool:
    """Return whether the encoding of a stream has every character."""
    return (stream.encoding or "").lower().replace("-", "") == "utf8"


def _write_and_flush(stream: TextIO, text: str) -> None:
    stream.write(text)
    stream.flush()


MIN_PAGE_COLUMNS, MAX_PAGE_COLUMNS = 40, 100
"""Columns of a page: in 40 every number still stands beside its name; wider than 100 a line is hard to read."""


@dataclass(frozen=True)
class Terminal:
    """Options of output of a command line."""

    arguments: tuple[str, ...] = ()  # the command line, without the program's name
    # json, quiet: whether results are a JSON document, or not shown
    json: bool = False
    quiet: bool = False
    verbose: int = 0  # how often ``-v`` was given

    @classmethod
    def guess(cls, arguments: Sequence[str]) -> Terminal:
        """Return what a command line that may be malformed seems to request."""
        options = list(arguments[: arguments.index("--")] if "--" in arguments else arguments)
        flags = "".join(item[1:] for item in options if item.startswith("-") and item[1:].strip("vq") == "")
        verbose = flags.count("v") + options.count("--verbose")
        return cls(tuple(arguments), "--json" in options, verbose=verbose)

    @property
    def width(self) -> int:
        """Columns to fill; redirected output gets as many as a wide terminal."""
        return max(MIN_PAGE_COLUMNS, min(shutil.get_terminal_size((MAX_PAGE_COLUMNS, 24)).columns, MAX_PAGE_COLUMNS))

    @property
    def excerpts(self) -> bool:
        """True if faults of a file are shown with its lines: on a terminal, or with ``-v``; scripts count lines."""
        return self.verbose > 0 or (sys.stderr is not None and sys.stderr.isatty())

    @property
    def tracebacks(self) -> bool:
        """Whether the user wants to see them."""
        return self.verbose >= 2

    def show(self, *blocks: Block) -> None:
        """Print blocks to standard output."""
        from cfmkit.documents.terminal import print_blocks

        ascii_only = not can_encode_all(sys.stdout)
        write_output(print_blocks(blocks, self.width, sys.stdout.isatty(), ascii_only))

    def show_page(self, document: Document) -> None:
        """Print the page of a document to standard output."""
        from cfmkit.documents.terminal import page

        self.show(*page(document, self.width, self.verbose > 0))

    def show_json(self, data: Mapping[str, Any]) -> None:
        """Print one JSON document to standard output."""
        ascii_only = not can_encode_all(sys.stdout)
        write_output(json.dumps(data, indent=2, ensure_ascii=ascii_only, allow_nan=False) + "\n")

    def complain(self, lines: Sequence[str]) -> None:
        """Print lines to standard error."""
        for line in lines:
            write_error(f"{visible(line)}\n")

    @contextmanager
    def progress(self, budget: float | None = None) -> Iterator[Report]:
        """Yield what reports progress: a bar on a terminal, else a line with the time left now and then.

        With a time budget [s] the share of it that is spent counts, where less of the work is done: its end is the end.
        """
        if self.json or self.quiet:
            yield lambda _fraction, _text: None
            return
        start, bar = time.monotonic(), Bar() if sys.stderr.isatty() else None
        report = ProgressLines().report if bar is None else bar.report

        def report_in_budget(fraction: float, text: str) -> None:
            spent = 0.0 if budget is None else (time.monotonic() - start) / budget
            report(max(fraction, min(spent, MAX_SHARE_SPENT)), text)

        try:
            yield report_in_budget
        finally:
            if bar is not None:
                bar.close()


MAX_SHARE_SPENT = 0.99  # share of a time budget that is reported at most while the work goes on
LINE_EVERY = 10.0  # seconds between two lines where nobody watches: a study of an hour leaves 360 lines in a log
FIRST_ESTIMATE = 0.05
"""Share of the work before which the time left is not told: what is done first says little of the rest."""


class ProgressLines:
    """A line on standard error now and then, with the time that is left."""

    def __init__(self) -> None:
        self._start_bar = self._reported = time.monotonic()
        self._most = 0.0

    def report(self, fraction: float, text: str) -> None:
        """Report the share of a run that is done, if the last line is old enough."""
        now, self._most = time.monotonic(), max(self._most, fraction)
        if now - self._reported >= LINE_EVERY and 0.0 < self._most < 1.0:
            self._reported = now
            left = (now - self._start_bar) * (1.0 - self._most) / self._most
            time_left = f", {duration(left)} left" if self._most >= FIRST_ESTIMATE else ""
            write_error(f"{100 * self._most:.0f} %{time_left}: {text}\n")


def duration(seconds: float) -> str:
    """Return a time in words: ``40 s``, ``3 min``, ``2.5 h``."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


class Bar:
    """The progress bar on standard error, one for all verbs: it appears with the first report and leaves nothing."""

    def __init__(self) -> None:
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
            self._start_bar(total)
        self._progress.update(self._task, completed=done, total=total, description=text)

    def close(self) -> None:
        """Remove the bar."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None

    def _start_bar(self, total: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

        columns = BarColumn(), TaskProgressColumn(), TextColumn("{task.description}", markup=False)
        self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task = self._progress.add_task("", total=total)
        self._progress.start()

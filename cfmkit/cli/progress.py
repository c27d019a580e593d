"""Progress of a study on standard error, with its rate and time left; Ctrl-C as a request to stop.

The first Ctrl-C asks the study to finish what runs and to write what there is; the second ends it at once.
"""

from __future__ import annotations

import signal
import sys
import time
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cfmkit.cli import output
from cfmkit.cli.failures import Stopped
from cfmkit.cli.output import LINE_EVERY, Bar, duration

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

    from cfmkit.cli.output import Terminal

DRAW_EVERY = 0.1
"""Seconds between two pictures of the bar: quicker than this nobody reads, and each costs some of the time."""
RATE_WINDOW = 30.0
"""Seconds over which the rate is taken: three lines of a log, so that it follows points that get slower and does not
jump with each."""
FIRST_RESULTS = 0.2
"""Share of the time up to the first result within which others are first results of other processes, too: they say how
long processes take to start and to compile, and not how long a point takes."""


class StudyProgress:
    """A monitor of a study: shows its progress, and takes the first Ctrl-C as a request to stop."""

    def __init__(self, terminal: Terminal, things: str = "points") -> None:
        """Show progress as a bar on a terminal, else as lines; nothing with ``--json`` or ``--quiet``."""
        self._things = things
        self._tells = not (terminal.json or terminal.quiet)
        self._bar = Bar() if self._tells and sys.stderr is not None and sys.stderr.isatty() else None
        self._stopped = False  # whether the user asked to stop
        self._all = self._done = self._failed = self._reused = 0
        self._start = self._reported = time.monotonic()
        self._first: float | None = None
        self._marks: deque[tuple[float, int]] = deque()

    def total(self, points: int) -> None:
        """Set how many points are to be computed beside those that are done."""
        self._all = self._done + points

    def add_finished(self, points: int, failed: int, reused: bool) -> None:
        """Add to the number of points that are finished, and show it."""
        self._done += points
        self._failed += failed
        self._reused += points if reused else 0
        now = time.monotonic()
        if not reused:
            self._remember_count(now)
        if self._tells and now - self._reported >= (LINE_EVERY if self._bar is None else DRAW_EVERY):
            self._reported = now
            self._show_progress(now)

    def stopping(self) -> bool:
        """Return whether the user asked to stop."""
        return self._stopped

    def _show_progress(self, now: float) -> None:
        if self._bar is not None:
            text = f"{self._done} of {self._all} {self._things}, {self._describe_rate(now)}"
            self._bar.show(self._done, self._all, text)
        else:
            output.write_error(f"{self._done} of {self._all} {self._things}, {self._describe_rate(now)}\n")

    def _describe_rate(self, now: float) -> str:
        rate = self._rate(now)
        left = f"{rate:.3g}/s, {duration((self._all - self._done) / rate)} left, " if rate else ""
        return f"{left}{self._failed} failed"

    def _remember_count(self, now: float) -> None:
        """Remember how many points were computed by now; what came from the journal does not count."""
        if self._first is None:
            self._first = now
        if now - self._first <= FIRST_RESULTS * (self._first - self._start):
            self._marks.clear()
        elif now - self._marks[-1][0] < DRAW_EVERY:
            return
        self._marks.append((now, self._done - self._reused))
        while len(self._marks) > 2 and now - self._marks[1][0] > RATE_WINDOW:
            self._marks.popleft()

    def _rate(self, now: float) -> float:
        """Return points a second over the last while; 0 as long as nothing is known but first results.

        Processes that work in step finish in bursts: until there are several of them, the mean since the start, which
        can only be too small, says more than the beginning of a burst.
        """
        if not self._marks:
            return 0.0
        fresh = self._done - self._reused
        since, before = self._marks[0]
        if fresh == before:
            return 0.0
        recent, mean = (fresh - before) / (now - since), fresh / (now - self._start)
        return recent if now - since >= RATE_WINDOW else max(recent, mean)

    def interrupt(self, number: int, _frame: FrameType | None) -> None:
        """Take Ctrl-C: the first time as a request to stop soon, the second time at once."""
        if self._stopped:
            signal.signal(number, signal.SIG_DFL)
            raise Stopped(number)
        self._stopped = True
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        output.write_error(f"stopping after the {self._things} that run now; press Ctrl-C again to end at once\n")

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()


@contextmanager
def watching(terminal: Terminal, things: str = "points") -> Iterator[StudyProgress]:
    """Yield a monitor that tells the user and listens to Ctrl-C; both end with the block."""
    monitor = StudyProgress(terminal, things)
    before = signal.signal(signal.SIGINT, monitor.interrupt)
    try:
        yield monitor
    finally:
        monitor.close()
        if not monitor.stopping():
            signal.signal(signal.SIGINT, before)

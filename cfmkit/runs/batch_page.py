"""``report.html`` of a batch: a verdict for each specification, with links to the pages in their folders."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import TYPE_CHECKING
from urllib.parse import quote

from cfmkit.errors import ExitCode
from cfmkit.runs.run_page import ENDS, NAME, part, template

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.studies.batch_entries import Entry


def page(entries: Sequence[Entry], message: str, command: str) -> bytes:
    """Return the page of a batch.

    Parameters
    ----------
    entries : sequence of Entry
        In the order of the specifications.
    message : str
        The batch in one line.
    command : str
        How it was started.
    """
    rows = [
        (one, _tone(one), _verdict(one), quote(str(PurePosixPath(one.folder) / NAME)) if one.written else "")
        for one in entries
    ]
    text: str = template("batch.html.j2").render(
        rows=rows,
        tone="good" if all(tone == "good" for _, tone, _, _ in rows) else "bad",
        message=message,
        command=command,
        style=part("report.css"),
    )
    return text.encode()


def _verdict(entry: Entry) -> str:
    """Return how a specification ended: that it was solved is no verdict where it misses a requirement."""
    return "requirement missed" if entry.code is ExitCode.REQUIREMENT_MISSED else entry.status.replace("_", " ")


def _tone(entry: Entry) -> str:
    return ENDS.get(int(entry.code), ("bad", ""))[0] if entry.status != "skipped" else "warn"


__all__ = ["NAME", "page"]

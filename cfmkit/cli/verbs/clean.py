"""``cfmkit clean``: takes away what runs have written, and nothing else."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cfmkit.cli.options import Common, NoLock, Quiet, argument, flag
from cfmkit.documents.document import Document, Verbatim, whole_line
from cfmkit.errors import ExitCode, FolderInUse, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import TextLine
    from cfmkit.runs.remove_files_that_runs_wrote import Remains

PLACE = 80
EXAMPLE = "cfmkit clean cfm-out"


@dataclass(frozen=True, kw_only=True)
class CleanOptions(Common):
    """Arguments and options."""

    folder: Annotated[str, argument("DIR", "Folder that runs have written to, or a parent of such folders.")]
    yes: Annotated[bool, flag("-y", "--yes", text="Remove without asking.")] = False
    quiet: Quiet = False
    no_lock: NoLock = False


def run(options: CleanOptions, terminal: Terminal) -> Document:
    """List the files that runs have written below a folder, ask for confirmation, and remove them.

    Only files that a manifest or a journal lists are removed. Files that were edited, and all others, stay.
    """
    from cfmkit.runs.remove_files_that_runs_wrote import remains_below

    _refuse_what_is_no_folder(options.folder)
    found = list(remains_below(options.folder))
    if not (terminal.json or terminal.quiet):
        terminal.show(*_lines(found, everything=terminal.verbose > 0))
    agreed = bool(found) and (options.yes or _agreed(found, terminal))
    removed, busy = _removed(found, options.folder) if agreed else ([], [])
    message = _message(found, removed)

    return Document(
        _data(removed, found) | {"message": message},
        (Verbatim(f"{message}\n"),),
        ExitCode.IN_USE if busy else ExitCode.OK,
        complaints=tuple(f"error    {error}" for error in busy),
        errors=tuple({"message": str(error)} for error in busy),
    )


def _refuse_what_is_no_folder(name: str) -> None:
    import os

    from cfmkit.errors import visible

    if not name or "\0" in name or not os.path.isdir(name):
        raise UsageError(f"{visible(name)}: there is no such folder")


def _agreed(found: Sequence[Remains], terminal: Terminal) -> bool:
    """Return whether the user says yes.

    Raises
    ------
    cfmkit.errors.UsageError
        If nobody is there to answer.
    """
    from cfmkit.cli import streams

    streams.complain(f"remove {_count(found)}? [y/N] ")
    answer = sys.stdin.readline() if sys.stdin is not None else ""
    if not answer:
        terminal.complain([""])
        raise UsageError("nothing was removed: no answer on standard input; use --yes")
    return answer.strip().lower() in ("y", "yes")


def _removed(found: Sequence[Remains], top: str) -> tuple[list[Remains], list[FolderInUse]]:
    """Remove what was found, innermost folders first; return what has gone, and where live runs are at work."""
    from cfmkit.runs.remove_files_that_runs_wrote import remove

    gone, busy = [], []
    for one in sorted(found, key=lambda one: len(one.folder.parts), reverse=True):
        try:
            gone.append(remove(one, top))
        except FolderInUse as error:
            busy.append(error)
    return gone[::-1], busy


def _count(found: Sequence[Remains]) -> str:
    files = sum(len(one.files) for one in found)
    size = sum(one.size for one in found) / 1e6
    return f"{files} file{'s' * (files != 1)} in {len(found)} folder{'s' * (len(found) != 1)}, {size:.3g} MB"


def _message(found: Sequence[Remains], removed: Sequence[Remains]) -> str:
    if not found:
        return "nothing here was written by cfmkit"
    return f"removed {_count(removed)}" if removed else "nothing was removed"


def _lines(found: Sequence[Remains], everything: bool) -> Iterator[TextLine]:
    from cfmkit.runs.remove_files_that_runs_wrote import EDITED
    from cfmkit.store.safe_disk_changes import shown

    for one in found:
        yield whole_line(f"{shown(one.folder)}/  {_count([one])}")
        for name in one.files if everything else ():
            yield whole_line(f"  {shown(name)}")
        for name in one.edited:
            yield whole_line(f"  stays: {shown(name)}: {EDITED}")


def _data(removed: Sequence[Remains], found: Sequence[Remains]) -> dict[str, Any]:
    def paths(groups: Iterator[tuple[Remains, tuple[str, ...]]]) -> list[str]:
        return [str(one.folder / name) for one, names in groups for name in names]

    return {
        "found": paths((one, one.files) for one in found),
        "removed": paths((one, one.files) for one in removed),
        "edited": paths((one, one.edited) for one in found),
        "bytes": sum(one.size for one in removed),
    }

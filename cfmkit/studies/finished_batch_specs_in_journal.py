"""Specifications that a batch finished before.

An end is kept by content: the text of the specification and what it is called, the options, cfmkit's own files and the
versions of its libraries. It is believed as long as the data files that the specification names and all files of the
run are as they were; who changes or deletes one gets the run anew.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode, OutputError
from cfmkit.families import origins
from cfmkit.results import Status
from cfmkit.store import Manifest, file_hash, origin, stable_hash
from cfmkit.store.file_names_and_overwrite_checks import MANIFEST_NAME
from cfmkit.store.lock import LOCK_NAME
from cfmkit.store.transaction import TRANSACTION_FOLDER
from cfmkit.studies.batch_sources_and_outcomes import Entry

if TYPE_CHECKING:
    from cfmkit.designing.run_many_starts import Notes

RECORD_VERSION = 1  # how records are written: those of another number are not found
FILE_LIBRARIES = ("SALib", "PyYAML", "ezdxf", "matplotlib", "numpy", "pint", "pydantic", "scipy", "shapely")
"""Those that can change a file of a run."""
KEPT_CODES = (ExitCode.OK, ExitCode.INVALID, ExitCode.NO_SOLUTION, ExitCode.PARTIAL, ExitCode.REQUIREMENT_MISSED)
"""Ends that would be the same tomorrow; a full disk, a folder in use, a time-out or a bug may not."""


class KeptRuns:
    """The runs that a batch has finished, in its journal.

    Parameters
    ----------
    out : str
        The batch's output folder.
    options : list
        Everything on the command line that decides what a run finds and writes.
    notes : Notes
        The journal.
    """

    def __init__(self, out: str, options: list[Any], notes: Notes) -> None:
        self._out, self._notes = out, notes
        self._about = stable_hash([RECORD_VERSION, options, origin(FILE_LIBRARIES), origins()])
        self._asked: dict[str, str | None] = {}

    def recall(self, spec: str, folder: str) -> Entry | None:
        """Return how a specification ended, if it is known and everything is as it was.

        One that was not valid comes back without a verb: whether it still is not must be asked again, since a
        file that it names may be there now.
        """
        key = self._asked[folder] = self._key(spec, folder)
        reported = None if key is None else self._notes.find(key)
        if reported is None:
            return None
        entry = _entry(reported["entry"])
        if not entry.verb:
            return entry
        data_there = all(_hash_beside(spec, name) == digest for name, digest in reported["data"])
        if not data_there or not self._is_untouched(folder, reported["manifest"]):
            return None
        # pages link to its folder, and comparisons read it, as if it had been written now
        return replace(entry, written=reported["manifest"] is not None)

    def keep(self, entry: Entry) -> None:
        """Note how a specification ended, unless that may be different tomorrow."""
        key = self._asked.get(entry.folder)
        if key is None or entry.code not in KEPT_CODES or entry.status == Status.TIMEOUT.key:
            return
        # The file may have been saved while it was computed; what was found is then of neither text.
        if self._key(entry.spec, entry.folder) != key:
            return
        manifest = file_hash(Path(self._out, entry.folder, MANIFEST_NAME)) if entry.written else None
        self._notes.add(key, {"entry": entry.as_json(), "data": list(entry.data), "manifest": manifest})

    def _key(self, spec: str, folder: str) -> str | None:
        """Return the name of a run by content; None if the specification cannot be read."""
        try:
            text = Path(spec).read_bytes()
        except (OSError, ValueError):
            return None
        head = f"{self._about}\0{spec}\0{folder}\0".encode("utf-8", "surrogateescape")
        return hashlib.sha256(head + text).hexdigest()[:32]

    def _is_untouched(self, folder: str, manifest: str | None) -> bool:
        """Return whether a run's folder holds what that run wrote, and nobody is at work there."""
        place = Path(self._out, folder)
        if manifest is None:
            return True
        if (
            os.path.lexists(place / TRANSACTION_FOLDER)
            or os.path.lexists(place / LOCK_NAME)
            or file_hash(place / MANIFEST_NAME) != manifest
        ):
            return False
        try:
            found = Manifest.read(place)
            return found is not None and not found.mismatches(place)
        except (OSError, OutputError):
            return False


def _hash_beside(spec: str, name: str) -> str | None:
    """Return the hash of a data file that a specification names."""
    path = Path(os.path.realpath(Path(spec).absolute().parent / name))
    try:
        return file_hash(path)
    except OSError:
        return None


def _entry(reported: dict[str, Any]) -> Entry:
    return Entry(
        reported["spec"],
        reported["folder"],
        reported["verb"] or "",
        reported["family"] or "",
        reported["name"] or "",
        reported["status"],
        ExitCode(reported["exit_code"]),
        reported["message"],
        tuple(reported["requirements"]),
        tuple(reported["warnings"]),
        tuple(reported["errors"]),
        reused=True,
    )

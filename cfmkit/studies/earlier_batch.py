"""An earlier batch: changed metrics and statuses (`cfmkit batch --compare`), and specifications finished before.

An end is kept by content: the text of the specification and what it is called, the options, cfmkit's own files and the
versions of its libraries. It is believed as long as the data files that the specification names and all files of the
run are as they were; who changes or deletes one gets the run anew.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode, OutputError, UsageError, visible
from cfmkit.families import origins
from cfmkit.metrics import flat_metrics
from cfmkit.metrics.compare import COMPARISON_RTOL, ComparedSide, MetricChange, compare
from cfmkit.results import Status
from cfmkit.store import Manifest, file_hash, origin, stable_hash
from cfmkit.store.file_names_and_overwrite_checks import MANIFEST_NAME
from cfmkit.store.lock import LOCK_NAME
from cfmkit.store.transaction import TRANSACTION_FOLDER
from cfmkit.studies.batch_sources_and_outcomes import Entry
from cfmkit.tables import Table, TableColumn, text_column

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.designing.run_many_starts import Notes

    Known = Mapping[str, "Earlier"]


@dataclass(frozen=True)
class Earlier:
    """Status and metrics of one specification in an earlier batch, as metrics.json has them."""

    status: str
    exit_code: int
    metrics: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class BatchComparison:
    """A batch beside an earlier one."""

    folder: str  # of the earlier batch
    tolerance: float  # relative change up to which a metric counts as the same
    changes: tuple[MetricChange, ...]  # everything that is not as it was
    gone: tuple[str, ...]  # folders of specifications that are not there any more

    @property
    def changes_beyond_tolerance(self) -> tuple[MetricChange, ...]:
        """The changes that are larger than the tolerance."""
        return tuple(change for change in self.changes if change.beyond)

    def as_json(self) -> dict[str, Any]:
        """Return what metrics.json says about it."""
        changes = [asdict(change) for change in self.changes]
        return {"with": self.folder, "tolerance": self.tolerance, "changes": changes, "gone": list(self.gone)}


def read_earlier_batch(folder: str) -> Known:
    """Return the results of an earlier batch by folder of the specification; one that wrote nothing has no metrics.

    Raises UsageError if the folder is not one of a batch.
    """
    whole = _read_json(os.path.join(folder, "metrics.json"))
    if whole is None or not isinstance(listed := whole.get("specs"), list):
        raise UsageError(f"--compare: {visible(folder)} is not the folder of a batch: it has no metrics.json of one")
    folders = {}
    for entry in listed:
        if isinstance(entry, dict) and isinstance(name := entry.get("folder"), str):
            record = _read_json(os.path.join(folder, name, "metrics.json")) or {}
            metrics = flat_metrics(record.get("metrics", {}))
            folders[name] = Earlier(str(entry.get("status", "")), int(entry.get("exit_code", 0)), metrics)
    return folders


def _read_json(path: str) -> dict[str, Any] | None:
    try:
        with open(path, encoding="utf-8") as file:
            content = json.load(file)
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def changes(
    earlier: Known,  # the earlier results, from `read_earlier_batch`
    entries: Sequence[Entry],  # what was found now; those that the earlier batch did not have are new, and no change
    folder: str,  # where they have their folders
    tolerance: float = COMPARISON_RTOL,  # relative change of a metric up to which it counts as the same
) -> tuple[MetricChange, ...]:
    """Return what is not as it was, in the order of the specifications and their metrics."""
    changes: list[MetricChange] = []
    for entry in entries:
        before = earlier.get(entry.folder)
        if before is None or entry.skipped:
            continue
        if (before.status, before.exit_code) != (entry.status, int(entry.code)):
            ends = _outcome_text(before.status, before.exit_code), _outcome_text(entry.status, int(entry.code))
            changes.append(MetricChange(entry.spec, "status", *ends, "", None, True))
        if entry.written:
            record = _read_json(os.path.join(folder, entry.folder, "metrics.json")) or {}
            now = flat_metrics(record.get("metrics", {}))
            sides = ComparedSide("the earlier batch", metrics=before.metrics), ComparedSide(entry.spec, metrics=now)
            changes += compare(*sides, tolerance=tolerance).changes
    return tuple(changes)


def _outcome_text(status: str, code: int) -> str:
    """Return the outcome of a specification in words: a curve may be complete and miss a requirement."""
    missed = code == ExitCode.REQUIREMENT_MISSED and status == Status.COMPLETE.key
    return "requirement missed" if missed else status


def list_gone(earlier: Known, entries: Sequence[Entry]) -> tuple[str, ...]:
    """Return the folders of specifications that the earlier batch had and this one has not."""
    folders = {entry.folder for entry in entries}
    return tuple(name for name in earlier if name not in folders)


def changes_table(changes: Sequence[MetricChange]) -> Table:
    """Return changes.csv: one row per value that is not as it was."""
    return Table(
        (
            text_column("spec", (change.spec for change in changes)),
            text_column("metric", (change.name for change in changes)),
            text_column("before", (_cell_text(change.before) for change in changes)),
            text_column("after", (_cell_text(change.after) for change in changes)),
            text_column("unit", (change.unit for change in changes)),
            TableColumn("relative_change", tuple(change.relative for change in changes)),
            TableColumn("beyond_tolerance", tuple(change.beyond for change in changes)),
        )
    )


def _cell_text(value: float | str | None) -> str:
    """Return a value as text: words and numbers stand in one column."""
    return "" if value is None else value if isinstance(value, str) else repr(float(value))


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
        entry = _read_entry(reported["entry"])
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
            earlier_manifest = Manifest.read(place)
            return earlier_manifest is not None and not earlier_manifest.mismatches(place)
        except (OSError, OutputError):
            return False


def _hash_beside(spec: str, name: str) -> str | None:
    """Return the hash of a data file that a specification names."""
    path = Path(os.path.realpath(Path(spec).absolute().parent / name))
    try:
        return file_hash(path)
    except OSError:
        return None


def _read_entry(reported: dict[str, Any]) -> Entry:
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

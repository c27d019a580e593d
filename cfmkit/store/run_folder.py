"""The output folder of one run: files written all together, and ``manifest.json``, their list with times, versions."""

from __future__ import annotations

import atexit
import json
import os
import platform
import re
import signal
import stat
import sys
import threading
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

from cfmkit._version import __version__
from cfmkit.errors import CfmError, OutputError
from cfmkit.store import safe_disk_changes, transaction
from cfmkit.store.content_hashes_and_versions import file_hash
from cfmkit.store.file_names_and_overwrite_checks import (
    JOURNAL_NAME,
    MANIFEST_NAME,
    OVERWRITE_REMEDY,
    checked_name,
    hash_in,
    mode_of,
    refuse_in_the_way,
)
from cfmkit.store.lock import FolderLock
from cfmkit.store.safe_disk_changes import TEMPORARY_NAME, FileRecord, quote_path, reporting
from cfmkit.store.transaction import NEW_FOLDER, TRANSACTION_FOLDER

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from types import TracebackType

    from cfmkit.store.safe_disk_changes import Data


RESULT_LIBRARIES = (
    "SALib",
    "ezdxf",
    "matplotlib",
    "numpy",
    "pandas",
    "pint",
    "pydantic",
    "scipy",
    "shapely",
    "typer",
    "yaml",
)
"""The libraries whose versions can change a result; those a run imported are listed."""
_OWN_KEYS = ("cfmkit", "duration_s", "files", "finished", "started", "versions")


@dataclass(frozen=True)
class Manifest:
    """The list of a run's files and the circumstances of the run."""

    files: Mapping[str, FileRecord]  # every file of the run but the manifest itself, by its name below the folder
    # everything in the file: ``cfmkit`` (version), ``versions``, ``started``, ``finished``, ``duration_s``, ``files``,
    # and what the run said about itself
    data: Mapping[str, Any]

    @classmethod
    def from_run(
        cls,
        # what the run says about itself (arguments, seed, hash of the spec, status, exit code); JSON values
        info: Mapping[str, Any],
        files: Mapping[str, FileRecord],  # what it wrote
        started: datetime,  # in UTC
        duration: timedelta,  # how long it took
    ) -> Manifest:
        """Return the manifest of a run that is about to be committed."""
        if taken := sorted(set(info) & set(_OWN_KEYS)):
            raise CfmError(f"the manifest itself says what {', '.join(taken)} is")
        data = {
            **info,
            "cfmkit": __version__,
            "versions": imported_versions(),
            "started": _utc_text(started),
            "finished": _utc_text(started + duration),
            "duration_s": round(duration.total_seconds(), 3),
            "files": {name: record._asdict() for name, record in files.items()},
        }
        return cls(MappingProxyType(dict(files)), MappingProxyType(data))

    def to_json(self) -> bytes:
        """Return the file's content: sorted keys, two spaces, one line feed at the end."""
        try:
            text = json.dumps(dict(self.data), sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise CfmError(f"the manifest takes JSON values: {error}") from None
        return (text + "\n").encode("utf-8", "backslashreplace")

    @classmethod
    def read(cls, folder: Path) -> Manifest | None:
        """Return the manifest in a folder, or None if there is none.

        Raises OutputError if a ``manifest.json`` is there that cfmkit did not write.
        """
        path = folder / MANIFEST_NAME
        mode = mode_of(path)
        if mode is None:
            return None
        with reporting(path, "read"):
            data = _parse(path.read_bytes()) if stat.S_ISREG(mode) else None
        if data is None:
            raise OutputError(f"{quote_path(path)} is in the way: cfmkit did not write it; {OVERWRITE_REMEDY}")
        files = {name: FileRecord(**record) for name, record in data["files"].items()}
        return cls(MappingProxyType(files), MappingProxyType(data))

    def mismatches(self, folder: Path) -> tuple[str, ...]:
        """Return the listed files that are missing from a folder or have another content."""
        return tuple(name for name, record in self.files.items() if hash_in(folder, name) != record.sha256)


def _parse(content: bytes) -> dict[str, Any] | None:
    """Return a manifest's data, or None if it is not one of ours.

    The names decide what the next run removes, so nothing odd may pass.
    """
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or not isinstance(data.get("cfmkit"), str):
        return None
    files = data.get("files")
    if not isinstance(files, dict) or not all(_is_entry(name, record) for name, record in files.items()):
        return None
    return data


def _is_entry(name: str, record: object) -> bool:
    try:
        checked_name(name)
    except OutputError:
        return False
    if not isinstance(record, dict) or set(record) != {"bytes", "sha256"}:
        return False
    size, digest = record["bytes"], record["sha256"]
    return type(size) is int and isinstance(digest, str) and bool(re.fullmatch("[0-9a-f]{64}", digest))


def imported_versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that this process has imported."""
    versions = {"python": platform.python_version()}
    for name in RESULT_LIBRARIES:
        if (module := sys.modules.get(name)) is not None:
            versions[name] = str(getattr(module, "__version__", "unknown"))
    return versions


def _utc_text(time: datetime) -> str:
    return time.isoformat(timespec="milliseconds").replace("+00:00", "Z")


_TEMPORARY_PATTERN = re.compile(
    re.escape(TEMPORARY_NAME).replace(r"\{pid\}", "([0-9]+)").replace(r"\{count\}", "[0-9]+")
)
_MOST_TRIES = 20


class RunFolder:
    """A context manager: enter to lock the folder, `write` files, `commit` them as a set.

    Leaving without `commit` leaves the folder as it was found. It is created on entry, with what is missing above it,
    which raises FolderInUse if another live run has it, and OutputError if it cannot be created, locked or repaired.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Remember the folder; nothing is touched yet."""
        if "\0" in os.fspath(path) or not os.fspath(path):
            raise OutputError(f"{os.fspath(path)!a} is not a name for a folder")
        self.path = Path(os.path.realpath(path))
        self.previous: Manifest | None = None  # what the run before wrote; after `commit`, what this one wrote
        # after `commit`: files that were edited since the run before -> the name under which the edited version is kept
        self.kept: Mapping[str, str] = MappingProxyType({})
        self._staged: dict[str, FileRecord] = {}
        self._created: list[Path] = []
        self._lock = FolderLock(self.path)
        self._owner = 0
        self._started = datetime.now(UTC)
        self._clock = time.monotonic()

    def __enter__(self) -> Self:
        """Create and lock the folder, repair what a killed run left, read the last manifest."""
        self._started = datetime.now(UTC)
        self._clock = time.monotonic()
        try:
            with _defer_signals(), reporting(self.path, "use the folder"):
                atexit.register(self._leave_folder)
                self._create_and_lock()
                self._take_over()
            self._owner = os.getpid()
            return self
        except BaseException:
            with _defer_signals():
                self._leave_folder()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Drop what was not committed and unlock the folder; a signal that comes meanwhile acts afterwards."""
        try:
            with _defer_signals():
                self._leave_folder()
        except BaseException:
            with _defer_signals():  # the signal may have come just before
                self._leave_folder()
            raise

    def check(self, *names: str) -> None:
        """Raise now what `write` would raise later: call it before a long computation.

        Raises OutputError if a name is not allowed, or something that is not ours is in its place.
        """
        for name in names:
            ours = self.previous is not None and name in self.previous.files
            with reporting(self.path / checked_name(name), "look at"):
                refuse_in_the_way(self.path, name, ours=ours)

    def write(
        self,
        name: str,  # path below the folder with forward slashes, e.g. ``figures/loop.png``
        data: Data,  # the content, whole or in pieces
    ) -> FileRecord:
        """Take a file into the set that `commit` will put in place.

        Raises OutputError if the name is refused or the data cannot be written.
        """
        self._require_open()
        self.check(name)
        self._staged.pop(name, None)
        self._staged[name] = self._stage_file(name, data)
        return self._staged[name]

    @property
    def journal(self) -> Path:
        """The file in which a long run may note what it has finished, for the run after it.

        It is written in place, belongs to whoever holds the lock, and is listed in no
        manifest: other runs into the folder leave it alone.
        """
        self._require_open()
        return self.path / JOURNAL_NAME

    def commit(
        self,
        # what the manifest is to say about the run: arguments, seed, hash of the spec, status, exit code
        info: Mapping[str, Any],
    ) -> Manifest:
        """Put the files and a manifest in place of those of the run before, all or none; once.

        Raises OutputError if anything fails; the files of the run before are still in place.
        """
        self._require_open()
        self._owner = 0
        self.check(*self._staged)
        duration = timedelta(seconds=time.monotonic() - self._clock)
        manifest = Manifest.from_run(info, self._staged, self._started, duration)
        with reporting(self.path):
            removed, kept = self._list_outdated()
            new = {name: record.sha256 for name, record in self._staged.items()}
            new |= {spare: self._stage_edited(name, spare) for name, spare in kept.items()}
            new[MANIFEST_NAME] = self._stage_file(MANIFEST_NAME, manifest.to_json()).sha256
            self._lock.check()
            transaction.execute(self.path, transaction.plan_for(self.path, new, removed))
        self.previous, self.kept = manifest, MappingProxyType(kept)
        return manifest

    def _create_and_lock(self) -> None:
        """Create and lock the folder; a run that ends just now may remove it in between."""
        for attempt in range(_MOST_TRIES):
            try:
                self._created = safe_disk_changes.make_folders(self.path)
                self._lock.acquire()
                return
            except FileNotFoundError:
                if attempt == _MOST_TRIES - 1:
                    raise
            except BaseException:
                safe_disk_changes.remove_empty(self._created)
                raise

    def _take_over(self) -> None:
        """Repair and clear what earlier runs left, and read what the last one wrote."""
        transaction.recover(self.path)
        self._clear_temporaries()
        self.previous = Manifest.read(self.path)

    def _clear_temporaries(self) -> None:
        """Remove what `atomic_write` left here in processes that have died."""
        for entry in os.scandir(self.path):
            match = _TEMPORARY_PATTERN.fullmatch(entry.name)
            if match and not _is_alive(int(match[1])):
                safe_disk_changes.discard(Path(entry.path))

    def _stage_file(self, name: str, data: Data) -> FileRecord:
        place = self.path / TRANSACTION_FOLDER / NEW_FOLDER / name
        with reporting(self.path / name):
            safe_disk_changes.make_folders(place.parent)
            if mode_of(place) is not None:
                safe_disk_changes.system.unlink(place)
            return safe_disk_changes.write_new(place, data)

    def _stage_edited(self, name: str, spare: str) -> str:
        """Stage an edited file under its spare name; return its hash."""
        place = self.path / TRANSACTION_FOLDER / NEW_FOLDER / spare
        safe_disk_changes.make_folders(place.parent)
        safe_disk_changes.duplicate(self.path / name, place)
        return file_hash(place) or ""

    def _list_outdated(self) -> tuple[list[str], dict[str, str]]:
        """Return the old files to remove, and the edited ones to keep under another name."""
        removed: list[str] = []
        kept: dict[str, str] = {}
        for name, record in (self.previous.files if self.previous else {}).items():
            digest = hash_in(self.path, name)
            if digest == record.sha256 and name not in self._staged:
                removed.append(name)
            elif name in self._staged and digest not in (None, record.sha256, self._staged[name].sha256):
                spare = self._spare_name(name, digest)
                kept |= {name: spare} if spare else {}
        return removed, kept

    def _spare_name(self, name: str, digest: str | None) -> str | None:
        """Return a free name for an edited file, or None if the same content is kept already."""
        stem, dot, suffix = name.rpartition(".") if "." in name.rpartition("/")[2] else (name, "", "")
        count = 1
        while True:
            spare = f"{stem}.edited{'' if count == 1 else f'-{count}'}{dot}{suffix}"
            if hash_in(self.path, spare) == digest:
                return None
            if mode_of(self.path / spare) is None and spare not in self._staged:
                return spare
            count += 1

    def _require_open(self) -> None:
        if self._owner != os.getpid():
            state = "is not open in this process, or was committed already"
            raise CfmError(f"cannot write to {quote_path(self.path)}: the run folder {state}")

    def _leave_folder(self) -> None:
        """Drop the working folder, unlock, and remove what was created for nothing; once.

        It is called again at the end of the process for a folder that a signal has kept from being left: Python may act
        on a signal before the first statement of `__exit__`.
        """
        if self._lock.mine:
            self._owner = 0
            transaction.clear(self.path)
            self._lock.release()
            safe_disk_changes.remove_empty(self._created)
        atexit.unregister(self._leave_folder)


@contextmanager
def _defer_signals() -> Iterator[None]:
    """Hold back the signals that end a run: between making a folder and remembering it they would leave it there.

    Not by the mask of signals of this thread: another thread would take them, and Python acts on them in this one.
    """
    if threading.current_thread() is not threading.main_thread():  # where Python acts on none
        yield
        return
    came: list[int] = []

    def deliver() -> None:
        for number in came:
            signal.raise_signal(number)

    with ExitStack() as afterwards:
        afterwards.callback(deliver)
        for number in (signal.SIGINT, signal.SIGTERM):
            if (usual := signal.getsignal(number)) is not None:  # None: of another language, it could not be put back
                afterwards.callback(signal.signal, number, usual)
                signal.signal(number, lambda number, _frame: came.append(number))
        yield


def _is_alive(process: int) -> bool:
    """Return whether a process lives; on Windows False, where a signal to find out would reach it."""
    if os.name == "nt":
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True

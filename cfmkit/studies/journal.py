"""The journal of a long run: finished points by content, in one SQLite file.

What `Journal.add` has returned from survives the death of the process at any moment (write-ahead log), and a failing
power supply if it is older than a second (`SYNC_INTERVAL`). Two writers do not disturb each other. A record whose
checksum (that of zlib) does not fit is computed again; so is everything, if the file as a whole is damaged.
"""

from __future__ import annotations

import json
import logging
import sqlite3
import time
import zlib
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Self

from cfmkit.errors import OutputError
from cfmkit.store.lock import locks_can_be_used
from cfmkit.store.safe_disk_changes import discard, quote_path, reporting

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

SYNC_INTERVAL = 1.0  # seconds after which the file is brought down to the disk
WRITER_TIMEOUT = 60.0  # seconds to wait for another writer, which may be making a large file small
_STUDIES_LOG = logging.getLogger("cfmkit.studies")
_CREATE_TABLE = "CREATE TABLE IF NOT EXISTS records (key BLOB PRIMARY KEY, session INTEGER, record BLOB) WITHOUT ROWID"
_ERROR_REASONS = {
    "SQLITE_FULL": "the disk is full",
    "SQLITE_READONLY": "permission denied",
    "SQLITE_CANTOPEN": "permission denied, or it is no ordinary file",
    "SQLITE_IOERR": "the disk reports an input/output error, or a quota is used up",
    "SQLITE_CORRUPT": "it is damaged; run the same command again",
    "SQLITE_BUSY": "another process is writing to it",
}


class Journal:
    """A context manager around the journal of a folder.

    Parameters
    ----------
    path : Path
        The file.
    fresh : bool
        Whether to find nothing that was there before; it stays in the file until something supersedes it.
    """

    def __init__(self, path: Path, fresh: bool = False) -> None:
        """Remember the file; it is made on entry."""
        self.path, self.fresh = path, fresh
        self._synced, self._session = 0.0, 0
        self.damaged = 0  # records whose checksum did not fit

    def __enter__(self) -> Self:
        """Open the file; one that is no sound database is begun anew."""
        if self.path.is_symlink():
            raise OutputError(f"cannot open {quote_path(self.path)}: it is a link")
        with reporting(self.path, "open"), self._reporting("open"):
            try:
                self._open()
            except sqlite3.DatabaseError as error:
                if _name_of(error) not in ("SQLITE_NOTADB", "SQLITE_CORRUPT"):
                    raise
                _remove(self.path)
                self._open()
                _STUDIES_LOG.warning("journal  %s was damaged: everything is computed again", quote_path(self.path))
        self._forget_older()
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file, which brings it down to the disk; one that holds nothing is removed."""
        try:
            with self._reporting("read"):
                empty = self._db.execute("SELECT 1 FROM records LIMIT 1").fetchone() is None
        finally:
            self._db.close()
        if empty:
            _remove(self.path)
        if self.damaged:
            _STUDIES_LOG.warning("journal  damaged records that were computed again: %d", self.damaged)

    def __len__(self) -> int:
        return int(self._db.execute("SELECT count(*) FROM records").fetchone()[0])

    def find(self, key: str) -> Any:
        """Return the record of a key that was there when the file was opened; None if there is none."""
        return self._find_record("AND session <= ?", key, 0 if self.fresh else self._known)

    def read(self, key: str) -> Any:
        """Return the record of a key.

        Raises OutputError if it is not there any more.
        """
        record = self._find_record("", key)
        if record is None:
            raise OutputError(f"cannot read {quote_path(self.path)}: it was changed during the run; run it again")
        return record

    def add(self, key: str, record: Any) -> None:
        """Keep a record of JSON values; it survives the death of the process from now on.

        Raises OutputError if it cannot be written.
        """
        packed = zlib.compress(json.dumps(record, separators=(",", ":")).encode(), 1)
        with self._reporting("write"):
            if not self._session:  # a run that adds nothing leaves the file as it is, to the byte
                self._session = self._newest_session() + 1
                self._db.execute(f"PRAGMA user_version={self._session}")
            row = (bytes.fromhex(key), self._session, packed)
            self._db.execute("INSERT OR REPLACE INTO records VALUES (?, ?, ?)", row)
            if time.monotonic() - self._synced > SYNC_INTERVAL:
                self._db.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
                self._synced = time.monotonic()

    def keep_only(self, keys: Iterable[bytes]) -> None:
        """Drop the records of all other keys, and make the file as small as it can be; all or nothing.

        Those of a writer that opened the file later stay.

        Raises OutputError if it cannot be written; what was there is still there.
        """
        with self._reporting("write"):
            self._db.execute("CREATE TEMP TABLE IF NOT EXISTS used (key BLOB PRIMARY KEY) WITHOUT ROWID")
            with self._db:  # commits, or takes all of it back
                self._db.execute("BEGIN")
                self._db.executemany("INSERT OR IGNORE INTO used VALUES (?)", ((key,) for key in keys))
                unused = "DELETE FROM records WHERE session <= ? AND key NOT IN (SELECT key FROM used)"
                dropped = self._db.execute(unused, (self._session or self._known,)).rowcount
                self._db.execute("DELETE FROM used")
            if dropped:
                self._db.execute("VACUUM")

    def _open(self) -> None:
        """Open the database and check it; on failure it is closed."""
        alone = not locks_can_be_used(self.path.parent)
        place = f"{self.path.absolute().as_uri()}{'?nolock=1' if alone else ''}"
        self._db = sqlite3.connect(place, WRITER_TIMEOUT, isolation_level=None, check_same_thread=False, uri=True)
        try:
            if alone:  # the log then needs no memory that processes share
                self._db.execute("PRAGMA locking_mode=EXCLUSIVE")
            for pragma in ("journal_mode=WAL", "synchronous=NORMAL", "temp_store=MEMORY"):
                self._db.execute(f"PRAGMA {pragma}").fetchall()
            self._db.execute(_CREATE_TABLE)
            if self._db.execute("PRAGMA quick_check(1)").fetchone() != ("ok",):
                raise _Damaged
            self._known = self._newest_session()
        except BaseException:
            self._db.close()
            raise
        self._synced = time.monotonic()

    def _newest_session(self) -> int:
        """Return the number of the last run that added something; 0 if there was none."""
        return int(self._db.execute("PRAGMA user_version").fetchone()[0])

    def _find_record(self, condition: str, key: str, *values: int) -> Any:
        with self._reporting("read"):
            query = f"SELECT record FROM records WHERE key = ? {condition}"
            row = self._db.execute(query, (bytes.fromhex(key), *values)).fetchone()
        try:
            return None if row is None else json.loads(zlib.decompress(row[0]))
        except (zlib.error, ValueError, TypeError):
            self.damaged += 1
            return None

    def _forget_older(self) -> None:
        """Remove a journal of version 0.1, which was a file of lines."""
        older = self.path.with_suffix(".jsonl")
        if older != self.path and older.is_file() and not older.is_symlink():
            discard(older)
            _STUDIES_LOG.warning(
                "journal  that of an earlier version of cfmkit is not read: its points are computed again"
            )

    @contextmanager
    def _reporting(self, doing: str) -> Iterator[None]:
        """Turn an error of the database into an `OutputError`: what failed, where and why."""
        try:
            yield
        except sqlite3.Error as error:
            name = _name_of(error)
            why = next((text for start, text in _ERROR_REASONS.items() if name.startswith(start)), str(error))
            raise OutputError(f"cannot {doing} {quote_path(self.path)}: {why}") from error


class _Damaged(sqlite3.DatabaseError):
    sqlite_errorname = "SQLITE_CORRUPT"


def _name_of(error: sqlite3.Error) -> str:
    """Return the name of SQLite's code of an error; it is missing where Python itself raised it."""
    return getattr(error, "sqlite_errorname", "")


def _remove(path: Path) -> None:
    """Remove a database and its log."""
    for ending in ("", "-wal", "-shm"):
        discard(path.with_name(path.name + ending))

"""The journal of a study: finished points by content, one JSON line each, only ever appended.

A line is ``{"c":"<crc32>","k":"<key>","r":{...}}``: the checksum covers all that follows
it. Every record is one ``write`` of the operating system, so that what `add` has
returned from survives the death of the process at any moment; the file is brought down
to the disk once a second and at the end, so that a failing power supply costs a second.

A line that is cut off at the end of the file (the process died while it was written) is
dropped. A line in the middle whose checksum does not fit is passed over and counted: its
point is computed again. There is one writer, which holds the lock of the folder; should
somebody remove the lock and a second one write, both append whole lines, and each still
reads its own: a record is found by its place and believed by its key.
"""

from __future__ import annotations

import json
import os
import time
from typing import TYPE_CHECKING, Any, Self
from zlib import crc32

import numpy as np

from cfmkit.errors import OutputError
from cfmkit.store.disk import discard, reporting

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from types import TracebackType

_HEAD = b'{"c":"'
_BODY = len(_HEAD) + 8 + 2
_KEY = len(b'"k":"')
_KEYS = 32
SYNC_EVERY = 1.0
"""Seconds between two moments at which the file is brought down to the disk."""

_CHUNK = 1 << 20
_ENCODE = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode


class Journal:
    """A context manager around the journal file of a folder.

    Parameters
    ----------
    path : Path
        The file.
    fresh : bool
        Whether to find nothing that was there before; it stays in the file, and what is added supersedes it.

    Attributes
    ----------
    damaged : int
        Records whose checksum did not fit when the file was opened.
    torn : bool
        Whether the last line was cut off.
    """

    def __init__(self, path: Path, fresh: bool = False) -> None:
        """Remember the file; it is made on entry."""
        self.path = path
        self.fresh = fresh
        self.damaged = 0
        self.torn = False
        self._file = -1
        self._synced = time.monotonic()
        self._known = (np.zeros(0, np.uint64), np.zeros(0, np.int64))

    def __enter__(self) -> Self:
        """Open the file, drop a torn last line, and learn which records are there."""
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0)
        with reporting(self.path, "open"):
            self._file = os.open(self.path, flags, 0o666)
            try:
                self._scan()
            except BaseException:
                os.close(self._file)
                raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Bring the file down to the disk and close it; one that holds nothing is removed."""
        try:
            self.sync()
            if not os.fstat(self._file).st_size:
                discard(self.path)
        finally:
            os.close(self._file)

    def __len__(self) -> int:
        """Return the number of sound records that were there when the file was opened."""
        return len(self._known[0])

    def find(self, key: str) -> int:
        """Return where the newest record of a key that was there at the start lies; -1 if there is none."""
        keys, places = self._known
        number = np.uint64(int(key[:16], 16))
        at = int(keys.searchsorted(number, side="right")) - 1
        while at >= 0 and keys[at] == number:
            if os.pread(self._file, _KEYS, int(places[at]) + _BODY + _KEY) == key.encode():
                return int(places[at])
            at -= 1
        return -1

    def add(self, key: str, record: Any) -> int:
        """Append a record; return where it lies. It survives the death of the process from now on.

        Raises
        ------
        cfmkit.errors.OutputError
            If it cannot be written.
        """
        line = _line(key, record)
        with reporting(self.path):
            rest = memoryview(line)
            while rest:
                rest = rest[os.write(self._file, rest) :]
            # Where the system appended it, which is not where this process left off if another one writes, too.
            place = os.lseek(self._file, 0, os.SEEK_CUR) - len(line)
        if time.monotonic() - self._synced > SYNC_EVERY:
            self.sync()
        return place

    def read(self, place: int, key: str) -> Any:
        """Return the record of a key that lies at a place.

        Raises
        ------
        cfmkit.errors.OutputError
            If it is not there any more, or the place holds another one.
        """
        with reporting(self.path, "read"):
            line = os.pread(self._file, 4096, place)
            while (end := line.find(b"\n")) < 0:
                more = os.pread(self._file, max(_CHUNK, len(line)), place + len(line))
                if not more:
                    break
                line += more
        if end < 0 or not _sound(line[: end + 1]) or line[_BODY + _KEY : _BODY + _KEY + _KEYS] != key.encode():
            raise OutputError(f"cannot read {self.path}: it was changed while the study ran; run it again")
        return json.loads(line[: end + 1])["r"]

    def sync(self) -> None:
        """Bring what was written down to the disk."""
        with reporting(self.path):
            os.fsync(self._file)
        self._synced = time.monotonic()

    def _scan(self) -> None:
        """Find every sound record; cut off a torn last line."""
        keys: list[int] = []
        places: list[int] = []
        for place, line in self._lines():
            if not line.endswith(b"\n"):
                self.torn = True
                os.ftruncate(self._file, place)
                break
            if _sound(line):
                keys.append(int(line[_BODY + _KEY : _BODY + _KEY + 16], 16))
                places.append(place)
            else:
                self.damaged += 1
        if self.fresh:
            return
        found, order = np.array(keys, np.uint64), np.argsort(np.array(keys, np.uint64), kind="stable")
        self._known = found[order], np.array(places, np.int64)[order]

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        with os.fdopen(os.dup(self._file), "rb") as file:
            file.seek(0)
            place = 0
            for line in file:
                yield place, line
                place += len(line)


def _line(key: str, record: Any) -> bytes:
    body = f'"k":"{key}","r":{_ENCODE(record)}}}'.encode()
    return b'%b%08x",%b\n' % (_HEAD, crc32(body), body)


def _sound(line: bytes) -> bool:
    """Return whether a line is a record whose checksum fits."""
    if not line.startswith(_HEAD) or line[_BODY - 2 : _BODY + _KEY] != b'","k":"':
        return False
    try:
        return int(line[len(_HEAD) : len(_HEAD) + 8], 16) == crc32(line[_BODY:-1])
    except ValueError:
        return False


class Memory:
    """The same for studies that write nothing: records in a list, forgotten with it."""

    damaged = 0
    torn = False

    def __init__(self) -> None:
        """Start without records."""
        self._records: list[Any] = []

    def find(self, _key: str) -> int:
        """Return -1: nothing is there from before."""
        return -1

    def add(self, _key: str, record: Any) -> int:
        """Keep a record; return where it lies."""
        self._records.append(record)
        return len(self._records) - 1

    def read(self, place: int, _key: str) -> Any:
        """Return the record that lies at a place."""
        return self._records[place]

    def sync(self) -> None:
        """Do nothing: there is no file."""

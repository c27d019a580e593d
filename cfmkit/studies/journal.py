"""The journal of a study: finished points by content, one JSON line each, only ever appended.

A line is ``{"c":"<crc32>","k":"<key>","r":{...}}``: the checksum covers all that follows
it. Every record is one ``write`` of the operating system, so that what `add` has
returned from survives the death of the process at any moment; the file is brought down
to the disk once a second and at the end, so that a failing power supply costs a second.

The journal of a finished study is written anew, in little room: hundreds of records stand in one line, which is
``{"c":"<crc32>","k":"<key of the first>","r":{"keys":"<key><key>...",...}}``.

JSON has no infinity: a record that holds one, or a number that is none, has ``{"float":"inf"}`` in its place and comes
back as it was. A start of a search is infinitely far from its limits where its network cannot be followed.

A line that is cut off at the end of the file (the process died while it was written) is
dropped. A line in the middle whose checksum does not fit is passed over and counted: its
point is computed again. There is one writer, which holds the lock of the folder; should
somebody remove the lock and a second one write, both append whole lines, and each still
reads its own: a record is found by its place and believed by its key.
"""

from __future__ import annotations

import json
import math
import os
import time
from typing import TYPE_CHECKING, Any, Self
from zlib import crc32

import numpy as np

from cfmkit.errors import OutputError
from cfmkit.store.safe_disk_changes import atomic_write, discard, read_at, reporting

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path
    from types import TracebackType

_HEAD = b'{"c":"'
_BODY = len(_HEAD) + 8 + 2
_KEY = len(b'"k":"')
_KEYS = 32
SYNC_EVERY = 1.0
"""Seconds between two moments at which the file is brought down to the disk."""

_PACK = b'","r":{"keys":"'
"""Between the key of a line that has many and the list of them."""

_BITS = 13
INSIDE = (1 << _BITS) - 1
"""Those bits of a place that say which record of a line is meant, counted from one; 0 where it is the only one."""

MOST_TOGETHER = 256
"""Records in one line: few enough to be read for the sake of one."""

_CHUNK = 1 << 20
_ENCODE = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode

_FLOAT = "float"
_MARK = b'{"float":"'
"""How a number that JSON lacks begins; lines without it, which are nearly all, are read at full speed."""


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
    held : int
        Records in the file, those that were found and those that were added.
    """

    def __init__(self, path: Path, fresh: bool = False) -> None:
        """Remember the file; it is made on entry."""
        self.path = path
        self.fresh = fresh
        self.damaged = 0
        self.torn = False
        self.held = 0
        self._file = -1
        self._last: tuple[int, dict[str, Any]] = (-1, {})
        self._synced = time.monotonic()
        self._known = (np.zeros(0, np.uint64), np.zeros(0, np.int64))

    def __enter__(self) -> Self:
        """Open the file, drop a torn last line, and learn which records are there."""
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
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
            empty = not os.fstat(self._file).st_size
        finally:
            os.close(self._file)
        if empty:
            discard(self.path)

    def __len__(self) -> int:
        """Return the number of sound records that were there when the file was opened."""
        return len(self._known[0])

    def find(self, key: str) -> int:
        """Return where the newest record of a key that was there at the start lies; -1 if there is none."""
        keys, places = self._known
        number = np.uint64(int(key[:16], 16))
        at = int(keys.searchsorted(number, side="right")) - 1
        while at >= 0 and keys[at] == number:
            if read_at(self._file, _KEYS, _key_place(int(places[at]))) == key.encode():
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
        line = line_of(key, record)
        with reporting(self.path):
            rest = memoryview(line)
            while rest:
                rest = rest[os.write(self._file, rest) :]
            # Where the system appended it, which is not where this process left off if another one writes, too.
            place = os.lseek(self._file, 0, os.SEEK_CUR) - len(line)
        self.held += 1
        if time.monotonic() - self._synced > SYNC_EVERY:
            self.sync()
        return place << _BITS

    def read(self, place: int, key: str) -> Any:
        """Return the record of a key that lies at a place; where others stand in its line all, and under ``at`` which.

        Raises
        ------
        cfmkit.errors.OutputError
            If it is not there any more, or the place holds another one.
        """
        start, inside = place >> _BITS, (place & INSIDE) - 1
        if inside < 0:
            return _record(self._line(start, key))
        if self._last[0] != start:
            self._last = start, _record(self._line(start))
        whole = self._last[1]
        if whole["keys"][_KEYS * inside : _KEYS * (inside + 1)] != key:
            raise self._changed()
        return {**whole, "at": inside}

    def line(self, place: int, key: str) -> bytes:
        """Return the line of a record that stands alone, as it is in the file."""
        return self._line(place >> _BITS, key)

    def rewrite(self, lines: Iterable[bytes]) -> None:
        """Put lines in place of all that is there, whole or not at all; nothing can be read after that.

        Raises
        ------
        cfmkit.errors.OutputError
            If they cannot be written; the old ones are still there.
        """
        atomic_write(self.path, lines)

    def _changed(self) -> OutputError:
        return OutputError(f"cannot read {self.path}: it was changed while the study ran; run it again")

    def _line(self, place: int, key: str = "") -> bytes:
        """Return a sound line, which has a certain key if one is given."""
        with reporting(self.path, "read"):
            line = read_at(self._file, 4096, place)
            while (end := line.find(b"\n")) < 0:
                more = read_at(self._file, max(_CHUNK, len(line)), place + len(line))
                if not more:
                    break
                line += more
        line = line[: end + 1]
        if not _sound(line) or (key and line[_BODY + _KEY : _BODY + _KEY + _KEYS] != key.encode()):
            raise self._changed()
        return line

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
            if not _sound(line):
                self.damaged += 1
                continue
            for inside, key in _keys_in(line):
                keys.append(int(key[:16], 16))
                places.append(place << _BITS | inside)
        self.held = len(keys)
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


def is_journal(path: Path) -> bool:
    """Return whether a file is a journal: an ordinary file, not a link, with a record whose checksum fits."""
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        return any(_sound(line) for line in file)


def has_foreign_lines(path: Path) -> bool:
    """Return whether somebody else wrote to a journal: a line in it that does not begin as a record does.

    A record that was damaged or cut off still begins so, and a power failure leaves zeros.
    """
    with path.open("rb") as file:
        return any(not _HEAD.startswith(begun) for line in file if (begun := line.strip(b"\0")[: len(_HEAD)]))


def line_of(key: str, record: Any) -> bytes:
    """Return a record as a line of a journal."""
    try:
        text = _ENCODE(record)
    except ValueError:  # infinite, or not a number
        text = _ENCODE(_marked(record))
    body = f'"k":"{key}","r":{text}}}'.encode()
    return b'%b%08x",%b\n' % (_HEAD, crc32(body), body)


def _record(line: bytes) -> Any:
    return json.loads(line, object_hook=_unmarked if _MARK in line else None)["r"]


def _marked(value: Any) -> Any:
    """Return a record with a word in place of each number that JSON lacks."""
    if isinstance(value, float) and not math.isfinite(value):
        return {_FLOAT: str(value)}
    if isinstance(value, dict):
        return {name: _marked(one) for name, one in value.items()}
    return [_marked(one) for one in value] if isinstance(value, list | tuple) else value


def _unmarked(found: dict[str, Any]) -> Any:
    """Return the number that an object stands for, or the object."""
    word = found.get(_FLOAT)
    return float(word) if len(found) == 1 and word in ("inf", "-inf", "nan") else found


def _keys_in(line: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield (number of a record in the line, its key); the number is 0 where the line has one record."""
    start = _BODY + _KEY + _KEYS
    if line[start : start + len(_PACK)] != _PACK:
        yield 0, line[_BODY + _KEY : start]
        return
    start += len(_PACK)
    keys = line[start : line.index(b'"', start)]
    for inside in range(len(keys) // _KEYS):
        yield inside + 1, keys[_KEYS * inside : _KEYS * (inside + 1)]


def _key_place(place: int) -> int:
    """Return where in the file the key of a record stands."""
    start, inside = (place >> _BITS) + _BODY + _KEY, place & INSIDE
    return start if not inside else start + _KEYS + len(_PACK) + _KEYS * (inside - 1)


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

    def line(self, _place: int, key: str) -> bytes:
        """Raise: there are no lines."""
        raise KeyError(key)

    def sync(self) -> None:
        """Do nothing: there is no file."""

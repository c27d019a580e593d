"""One live run per output folder.

The lock is a POSIX record lock (`fcntl.lockf`) on ``.cfmkit.lock``. It belongs to
the process: it dies with it, and forked workers that outlive it do not keep it,
as they would with `flock`. The price is that closing any descriptor of the file
in the process drops the lock; so nothing else in cfmkit opens it, and a second
run in the same process is turned away by a register before it could.

The file is removed at the end while the lock is still held. Whoever opened it
just before then locks a file without a name, notices, and tries again.
"""

from __future__ import annotations

import contextlib
import errno
import os
import platform
import re
import stat
import threading
import time
from typing import TYPE_CHECKING

from cfmkit.errors import FolderInUse, OutputError
from cfmkit.store import safe_disk_changes
from cfmkit.store.safe_disk_changes import shown

if TYPE_CHECKING:
    from pathlib import Path

LOCK = ".cfmkit.lock"
_PATIENCE = 0.3
"""Seconds to wait for the owner's name to appear in a lock file that was just made."""

_held: dict[tuple[int, int], int] = {}
"""Locked folders of this process by device and inode, with the process that locked them."""
_guard = threading.Lock()


class FolderLock:
    """The lock of one folder; `acquire` and `release` it."""

    def __init__(self, folder: Path) -> None:
        """Take the folder, which must exist by the time of `acquire`."""
        self._folder = folder
        self._file = folder / LOCK
        self._key: tuple[int, int] | None = None
        self._descriptor = -1
        self._owner = 0

    def acquire(self) -> None:
        """Lock the folder.

        Raises
        ------
        cfmkit.errors.FolderInUse
            If a live run has it, at once.
        OSError
            If the lock file cannot be made; FileNotFoundError if the folder has gone.
        """
        status = os.stat(self._folder)
        key = (status.st_dev, status.st_ino)
        with _guard:
            if _held.get(key) == os.getpid():
                raise _busy(self._folder, f"{os.getpid()}")
            _held[key] = os.getpid()
        self._key, self._owner = key, os.getpid()
        try:
            self._descriptor = _lock(self._file, self._folder)
        except BaseException:
            self._forget()
            raise

    @property
    def mine(self) -> bool:
        """Whether this process holds the lock through this object; a forked copy does not."""
        return self._descriptor >= 0 and self._owner == os.getpid()

    def check(self) -> None:
        """Raise if the lock file was removed or replaced, and another run may be at work."""
        if not _same(self._descriptor, self._file):
            raise OutputError(f"{shown(self._file)} was removed during the run: another run may be in the folder")

    def release(self) -> None:
        """Remove the lock file and unlock; in a forked copy of the owner nothing happens."""
        if not self.mine:
            return
        if _same(self._descriptor, self._file):
            safe_disk_changes.discard(self._file)
        os.close(self._descriptor)
        self._descriptor = -1
        self._forget()

    def _forget(self) -> None:
        with _guard:
            if self._key is not None:
                _held.pop(self._key, None)
        self._key = None


def has_signed_lock(folder: Path) -> bool:
    """Return whether a run has left its lock file in a folder, or has it there now: a file that says whose it is."""
    status, file = os.stat(folder), folder / LOCK
    if _held.get((status.st_dev, status.st_ino)) == os.getpid():
        return True  # to open and close it would drop the lock
    if not os.path.lexists(file) or not stat.S_ISREG(os.lstat(file).st_mode):
        return False
    return re.fullmatch(rb"[0-9]+ \S*\n", file.read_bytes()[:300]) is not None


def _lock(file: Path, folder: Path) -> int:
    """Return a descriptor of the lock file, which this process has locked."""
    while True:
        descriptor = safe_disk_changes.system.open(file, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        try:
            _try(descriptor, folder)
            if _same(descriptor, file):
                _sign(descriptor, file)
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _try(descriptor: int, folder: Path) -> None:
    try:
        import fcntl
    except ImportError:
        raise OutputError(f"cannot lock {shown(folder)}: this system has no POSIX locks") from None
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EAGAIN, errno.EACCES):
            raise _busy(folder, _signature(descriptor)) from None
        raise


def _same(descriptor: int, file: Path) -> bool:
    """Return whether the open file still has its name."""
    with contextlib.suppress(OSError):
        return os.path.samestat(os.fstat(descriptor), os.lstat(file))
    return False


def _sign(descriptor: int, file: Path) -> None:
    """Write into the lock file who holds it."""
    try:
        safe_disk_changes.system.ftruncate(descriptor, 0)
        safe_disk_changes.system.write(descriptor, f"{os.getpid()} {platform.node()}\n".encode())
    except BaseException:
        safe_disk_changes.discard(file)
        raise


def _signature(descriptor: int) -> str:
    """Return who holds the lock; the owner signs right after locking, so wait a little for it."""
    until = time.monotonic() + _PATIENCE
    while True:
        text = os.pread(descriptor, 200, 0).decode(errors="replace")
        if text.endswith("\n") or time.monotonic() > until:
            return text.strip()
        time.sleep(0.01)


def _busy(folder: Path, owner: str) -> FolderInUse:
    process, _, host = owner.partition(" ")
    place = f" on {shown(host)}" if host and host != platform.node() else ""
    who = f"process {process}{place}" if process.isdigit() else "another process"
    return FolderInUse(f"{shown(folder)} is in use by a live run ({who}); wait for it or give another --out")

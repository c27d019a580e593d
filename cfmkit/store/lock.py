"""One live run per output folder: a lock on a file in it, or a file that marks the run where no locks exist.

The lock is one of the operating system on the open file ``.cfmkit.lock``, which `filelock` takes: `flock`, or
`LockFileEx` on Windows. It dies with its process. A forked worker closes its copy of the file at once, so that it
does not keep the lock of a parent that has died.

The file is removed at the end while the lock is still held. Whoever opened it just before then locks a file without
a name, notices, and tries again. Windows removes no open file: there it goes after the lock, unless another run has
opened it since.

Some file systems have no locks: Lustre that is mounted without ``flock``, NFS without its lock service. Then a run
makes the file ``.cfmkit.softlock``, which says whose it is, and a log message says so. Such a lock outlives a run that
is killed; the next run on the same computer takes it over, a run on another computer cannot know and is refused.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import platform
import tempfile
import time
import warnings
from functools import cache
from typing import TYPE_CHECKING, Any

from cfmkit.errors import FolderInUse, OutputError
from cfmkit.store import safe_disk_changes
from cfmkit.store.safe_disk_changes import quote_path

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

LOCK_NAME = ".cfmkit.lock"
SOFT_LOCK = ".cfmkit.softlock"
_STORE_LOG = logging.getLogger("cfmkit.store")
SIGNATURE_TIMEOUT = 0.3  # seconds to wait for the owner's name to appear in a lock file that was just made
SOFT_LOCK_TIMEOUT = 0.5
"""Seconds to wait for a soft lock: `filelock` removes the one of a dead process in its first try, takes it in the
second."""
_NO_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL}
"""EINVAL is what Windows says of a network drive without locks."""
NO_LOCK = "CFMKIT_NO_LOCK"
"""Variable of the environment that says to lock nothing: workers in other processes write folders, too."""

_descriptors: set[int] = set()  # lock files that this process has open: a forked child closes them


@contextlib.contextmanager
def disable_locks() -> Iterator[None]:
    """Lock no folder inside the block: the user makes sure that one run at a time uses a folder (``--no-lock``)."""
    before = os.environ.get(NO_LOCK)
    os.environ[NO_LOCK] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[NO_LOCK]
        else:
            os.environ[NO_LOCK] = before


class FolderLock:
    """The lock of one folder; `acquire` and `release` it."""

    name = ""  # of the file that is the lock; "" for none

    def __init__(self, folder: Path) -> None:
        """Take the folder, which must exist by the time of `acquire`."""
        self._folder = folder
        self._descriptor = -1
        self._soft: Any = None
        self._owner = 0

    def acquire(self) -> None:
        """Lock the folder.

        Raises FolderInUse if a live run has it, at once; OSError if the lock file cannot be made; FileNotFoundError if
        the folder has gone.
        """
        os.stat(self._folder)
        if locks_wanted():
            self._descriptor = _lock(self._folder / LOCK_NAME, self._folder)
            if self._descriptor < 0:
                self._soft = _lock_softly(self._folder / SOFT_LOCK, self._folder)
            self.name = SOFT_LOCK if self._soft else LOCK_NAME
        self._owner = os.getpid()

    @property
    def mine(self) -> bool:
        """True if this process took the lock through this object; False in a forked copy."""
        return self._owner == os.getpid()

    def check(self) -> None:
        """Raise if the lock file was removed or replaced, and another run may be at work."""
        file = self._folder / self.name
        present = self._soft.is_lock_held_by_us if self._soft else not self.name or _is_named(self._descriptor, file)
        if not present:
            raise OutputError(f"{quote_path(file)} was removed during the run: another run may be in the folder")

    def release(self) -> None:
        """Remove the lock file and unlock; in a forked copy of the owner nothing happens."""
        if not self.mine:
            return
        self._owner = 0
        if self._soft is not None:
            with contextlib.suppress(OSError):
                self._soft.release()
        elif self.name:
            _unlock(self._descriptor, self._folder / LOCK_NAME)
        self._descriptor, self._soft, self.name = -1, None, ""


def locks_can_be_used(folder: Path) -> bool:
    """Return True if files in a folder may be locked (no ``--no-lock``), and can be."""
    return locks_wanted() and has_native_locks(folder)


def locks_wanted() -> bool:
    """Return True unless ``--no-lock`` or `NO_LOCK` switches locks off."""
    return os.environ.get(NO_LOCK, "") in ("", "0")


def has_native_locks(folder: Path) -> bool:
    """Return True if files in a folder can be locked by the operating system; the folder must be writable."""
    with tempfile.TemporaryFile(dir=folder) as file:
        return _try_to_lock(file.fileno()) is not None


def _lock(file: Path, folder: Path) -> int:
    """Return a descriptor of the lock file, which this process has locked; -1 if the file system has no locks."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    while True:
        descriptor = safe_disk_changes.system.open(file, flags, 0o666)
        try:
            locked = _try_to_lock(descriptor)
            if locked is None:
                _close_without_locks(descriptor, file)
                return -1
            if not locked:
                raise _refusal(folder, *_read_signature(descriptor))
            if _is_named(descriptor, file):
                _sign(descriptor, file)
                _descriptors.add(descriptor)
                return descriptor
        except BaseException:
            with contextlib.suppress(OSError):
                os.close(descriptor)
            raise
        os.close(descriptor)


def _try_to_lock(descriptor: int) -> bool | None:
    """Lock an open file; return False if another run has locked it, None if the file system has no locks."""
    try:
        return bool(_import_filelock().lock_descriptor(descriptor, blocking=False))
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return None
        raise


@cache
def _import_filelock() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that this Python has no locks is said once, by `_lock_softly`
        import filelock
    return filelock


def _close_without_locks(descriptor: int, file: Path) -> None:
    """Close a file that cannot be locked, and remove it if it says nothing: the soft lock has another one."""
    empty = not os.fstat(descriptor).st_size
    os.close(descriptor)
    if empty:
        safe_disk_changes.discard(file)


def _unlock(descriptor: int, file: Path) -> None:
    """Remove a lock file that this process holds, unless it has lost its name, and close it."""
    ours = os.fstat(descriptor) if _is_named(descriptor, file) else None
    if ours is not None:
        safe_disk_changes.discard(file)
    _descriptors.discard(descriptor)
    os.close(descriptor)
    with contextlib.suppress(OSError):
        if ours is not None and os.path.samestat(ours, os.lstat(file)):  # Windows removes no open file
            safe_disk_changes.discard(file)


def _lock_softly(file: Path, folder: Path) -> Any:
    """Return the lock that is a file which exists as long as the run lives."""
    filelock = _import_filelock()
    soft = filelock.SoftFileLock(file, thread_local=False)
    try:
        soft.acquire(timeout=SOFT_LOCK_TIMEOUT, poll_interval=SOFT_LOCK_TIMEOUT / 10)
    except filelock.Timeout:
        cure = f"if no run is there any more, remove {quote_path(file)} or add --no-lock"
        raise _refusal(folder, *_read_soft_signature(file), cure) from None
    _report_soft_locks(os.path.dirname(folder))
    return soft


@cache
def _report_soft_locks(folder: str) -> None:
    message = "warning  no file locks in %s: the file %s marks a live run (--no-lock: none)"
    _STORE_LOG.warning(message, quote_path(folder), SOFT_LOCK)


def _is_named(descriptor: int, file: Path) -> bool:
    """Return whether the open file still has its name."""
    with contextlib.suppress(OSError):
        return os.path.samestat(os.fstat(descriptor), os.lstat(file))
    return False


def _sign(descriptor: int, file: Path) -> None:
    """Write process and computer into the lock file, behind its first byte, which Windows lets nobody read."""
    try:
        safe_disk_changes.system.ftruncate(descriptor, 0)
        safe_disk_changes.system.write(descriptor, f" {os.getpid()} {platform.node()}\n".encode())
    except BaseException:
        safe_disk_changes.discard(file)
        raise


def _read_signature(descriptor: int) -> tuple[str, str]:
    """Return process and computer that hold the lock; the owner signs right after locking: wait a little for it."""
    until = time.monotonic() + SIGNATURE_TIMEOUT
    while True:
        text = safe_disk_changes.read_at(descriptor, 200, 1).decode(errors="replace")
        if text.endswith("\n") or time.monotonic() > until:
            process, _, host = text.strip().partition(" ")
            return process, host
        time.sleep(0.01)


def _read_soft_signature(file: Path) -> tuple[str, str]:
    """Return process and computer that a soft lock names; empty texts if it is not readable."""
    with contextlib.suppress(OSError):
        lines = file.read_text("utf-8", errors="replace").splitlines()
        if len(lines) > 1:
            return lines[0], lines[1].partition("?")[0]  # behind it filelock names the container
    return "", ""


def _refusal(folder: Path, process: str, host: str, cure: str = "wait for it or give another --out") -> FolderInUse:
    place = f" on {quote_path(host)}" if host and host != platform.node() else ""
    who = f"process {process}{place}" if process.isdigit() else "another process"
    return FolderInUse(f"{quote_path(folder)} is in use by a live run ({who}); {cure}")


def _close_in_child() -> None:
    """Close the lock files in a forked child: an open copy would keep the lock when the parent has died."""
    for descriptor in _descriptors:
        with contextlib.suppress(OSError):
            os.close(descriptor)
    _descriptors.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_close_in_child)

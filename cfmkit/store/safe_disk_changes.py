"""All changes of the disk: files written whole or linked, folders made and cleared; their errors as sentences."""

from __future__ import annotations

import errno
import itertools
import os
import stat
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from cfmkit.errors import OutputError, reason_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    Data = bytes | bytearray | memoryview | Iterable[bytes]


system = os  # every change to the disk goes through this name, so that tests can make each one fail

TEMPORARY_NAME = ".cfmkit-{pid}-{count}.tmp"
_counter = itertools.count()

_ERROR_REASONS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file is too large for this file system",
    errno.EROFS: "the file system is read-only",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.EISDIR: "it is a folder",
    errno.ENOTDIR: "a part of the path is a file, not a folder; give another path",
    errno.EEXIST: "the file exists",
    errno.ENOENT: "the folder is not there",
    errno.ENAMETOOLONG: "the name is too long",
    errno.ELOOP: "it is a link, or there are too many links on the way",
    errno.EIO: "the disk reports an input/output error",
    errno.EMFILE: "too many files are open",
    errno.ENOLCK: "the file system has no locks",
}
_NO_LINKS = {errno.EPERM, errno.EACCES, errno.EXDEV, errno.EMLINK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
_NO_LINKS |= {errno.EINVAL}  # what Windows says of a drive without links
_NO_FOLDER_SYNC = {errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP}


class FileRecord(NamedTuple):
    """Size and SHA-256 of a file's content."""

    bytes: int
    sha256: str


def quote_path(path: str | os.PathLike[str]) -> str:
    """Return a path for a message: on one line, whatever characters it holds."""
    text = os.fspath(path)
    return text if text.isprintable() else ascii(text)


@contextmanager
def reporting(path: str | os.PathLike[str], doing: str = "write") -> Iterator[None]:
    """Turn an `OSError` of the block into an `OutputError`: what failed, where and why."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"cannot {doing} {quote_path(path)}: {reason(error)}") from error


def reason(error: OSError) -> str:
    """Return why an operation of the system failed, for a message."""
    return _ERROR_REASONS.get(error.errno or 0) or reason_of(error)


def atomic_write(
    path: str | os.PathLike[str],  # the file; its folder must exist
    data: Data,  # the content, whole or in pieces
) -> FileRecord:
    """Write a file so that its path holds, at any moment, the old content or the new.

    The data goes to a hidden temporary file in the same folder, reaches the disk,
    and takes the name. A link is followed: its target is replaced.

    Raises OutputError if anything fails; the old file is still there and the temporary file is not.
    """
    if "\0" in os.fspath(path):
        raise OutputError(f"cannot write {quote_path(path)}: a path holds no NUL character")
    target = Path(os.path.realpath(path))
    temporary = target.parent / TEMPORARY_NAME.format(pid=os.getpid(), count=next(_counter))
    with reporting(path):
        _refuse_special(target)
        try:
            record = write_new(temporary, data)
            system.replace(temporary, target)
        except BaseException:
            discard(temporary)
            raise
        sync_folder(target.parent)
    return record


def _refuse_special(target: Path) -> None:
    """Raise where renaming would replace a folder, a device or a pipe."""
    with suppress(FileNotFoundError):
        mode = target.lstat().st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, "is a folder")
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is not an ordinary file")


def write_new(path: Path, data: Data) -> FileRecord:
    """Write a file that is not there yet, down to the disk; on failure it is not there either."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    descriptor = system.open(path, flags, 0o666)
    try:
        try:
            record = _write_pieces(descriptor, [data] if isinstance(data, bytes | bytearray | memoryview) else data)
            system.fsync(descriptor)
        finally:
            system.close(descriptor)
    except BaseException:
        discard(path)
        raise
    return record


def _write_pieces(descriptor: int, pieces: Iterable[bytes | bytearray | memoryview]) -> FileRecord:
    size, digest = 0, sha256()
    for piece in pieces:
        rest = memoryview(piece).cast("B")
        digest.update(rest)
        size += len(rest)
        while rest:
            rest = rest[system.write(descriptor, rest) :]
    return FileRecord(size, digest.hexdigest())


def discard(path: Path) -> None:
    """Remove a file if that is possible; a leftover is cleared by the next run."""
    with suppress(OSError):
        system.unlink(path)


def sync_folder(path: Path) -> None:
    """Bring the names in a folder down to the disk; Windows opens no folders and does this by itself."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = system.open(path, os.O_RDONLY)
    try:
        system.fsync(descriptor)
    except OSError as error:
        if error.errno not in _NO_FOLDER_SYNC:
            raise
    finally:
        system.close(descriptor)


def read_at(descriptor: int, count: int, place: int) -> bytes:
    """Return up to `count` bytes from a place of an open file; Windows has no `os.pread`. The position changes."""
    os.lseek(descriptor, place, os.SEEK_SET)
    return os.read(descriptor, count)


def make_folders(path: Path) -> list[Path]:
    """Create a folder and what is missing above it; return those created, outermost first."""
    missing = list(itertools.takewhile(lambda folder: not folder.is_dir(), (path, *path.parents)))
    created: list[Path] = []
    try:
        for folder in reversed(missing):
            with suppress(FileExistsError):
                system.mkdir(folder)
                created.append(folder)
            if not folder.is_dir():
                raise NotADirectoryError(errno.ENOTDIR, "is a file")
    except BaseException:
        remove_empty(created)
        raise
    return created


def remove_empty(folders: Iterable[Path]) -> None:
    """Remove those of some folders that are empty, innermost first."""
    for folder in sorted(folders, key=lambda folder: len(folder.parts), reverse=True):
        with suppress(OSError):
            system.rmdir(folder)


def duplicate(source: Path, target: Path) -> None:
    """Give a file a second name: a hard link, or a copy where the file system has no links."""
    try:
        system.link(source, target)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        write_new(target, source.read_bytes())


def clear_folder(path: Path) -> None:
    """Remove a folder with everything in it, as far as possible; links are not followed."""
    if path.is_symlink():
        return
    with suppress(OSError):
        for entry in list(os.scandir(path)):
            if entry.is_dir(follow_symlinks=False):
                clear_folder(Path(entry.path))
            else:
                discard(Path(entry.path))
        system.rmdir(path)

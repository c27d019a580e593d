"""What runs left below a folder, as far as a manifest or a journal proves that it is theirs, and taking it away.

A file is a run's if the manifest beside it lists it and its content is what was written; one that was edited since is
somebody's work and stays, as does whatever no manifest lists. A journal proves itself: its lines carry
their checksums; one to which somebody else wrote a line stays. A run that was killed leaves its lock file, which says
whose it was, and perhaps a journal without a record beside it. Links are neither followed nor removed.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit.errors import OutputError
from cfmkit.store import Manifest, RunFolder, safe_disk_changes
from cfmkit.store.file_names_and_overwrite_checks import JOURNAL, MANIFEST, hash_in, mode_of
from cfmkit.store.lock import lock_files
from cfmkit.store.safe_disk_changes import reporting
from cfmkit.studies.journal import has_foreign_lines, is_journal

if TYPE_CHECKING:
    from collections.abc import Iterator

EDITED = "it was changed since it was written"


@dataclass(frozen=True)
class Remains:
    """What is left of runs in one folder."""

    folder: Path  # where
    # names below it that are proven to be ours, the manifest last, so that it lists what is left at any moment
    files: tuple[str, ...]
    size: int  # bytes in them
    # names that a manifest lists, but whose content is another one now, and a journal with lines of somebody else: they
    # stay
    edited: tuple[str, ...] = ()


def remains_below(root: str | os.PathLike[str]) -> Iterator[Remains]:
    """Yield what is left of runs in a folder and in those below it, hidden ones left out.

    Raises
    ------
    cfmkit.errors.OutputError
        If a folder cannot be read.
    """

    def unreadable(error: OSError) -> None:
        raise OutputError(f"cannot read {safe_disk_changes.shown(error.filename)}: {safe_disk_changes.reason(error)}")

    for place, folders, _ in os.walk(os.path.realpath(root), onerror=unreadable):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found = remains_in(Path(place))
        if found.files:
            yield found


def remains_in(folder: Path) -> Remains:
    """Return what is left of runs in a folder; no files where nothing is proven to be ours."""
    manifest = _manifest(folder)
    listed = manifest.files if manifest is not None else {}
    with reporting(folder, "look at"):
        hashes = {name: hash_in(folder, name) for name in listed if mode_of(folder / name) is not None}
        files = [name for name, digest in hashes.items() if digest == listed[name].sha256]
        edited = [name for name in hashes if name not in files]
        locks = lock_files(folder)
        if is_journal(folder / JOURNAL) or (locks and _is_empty(folder / JOURNAL)):
            (edited if has_foreign_lines(folder / JOURNAL) else files).append(JOURNAL)
        files += locks
        if manifest is not None:
            files.append(MANIFEST)
        size = sum((folder / name).stat().st_size for name in files)
    return Remains(folder, tuple(files), size, tuple(edited))


def _is_empty(file: Path) -> bool:
    """Return whether an ordinary file is there that holds nothing."""
    return file.is_file() and not file.is_symlink() and not file.stat().st_size


def _manifest(folder: Path) -> Manifest | None:
    """Return the manifest of a folder; None if there is none, or one that cfmkit did not write."""
    try:
        return Manifest.read(folder)
    except OutputError:
        return None


def remove(remains: Remains, top: str | os.PathLike[str]) -> Remains:
    """Take away what is left of runs in a folder; return what was removed.

    Folders that are empty then go, too: its own, itself, and those above it up to `top`, which stays unless a run
    wrote to it.

    Raises
    ------
    cfmkit.errors.FolderInUse
        If a live run works there.
    cfmkit.errors.OutputError
        If a file cannot be removed (those before it are gone), or a run wrote there since `remains` was found.
    """
    root = remains.folder
    # Under the lock everything is looked at again: a run may have been there while the user was asked.
    with RunFolder(root) as folder:
        found = remains_in(folder.path)
        if set(found.files) - set(remains.files) - {folder.lock_file}:
            raise OutputError(f"{root}: a run wrote there after its files were listed: run 'cfmkit clean' again")
        found = replace(found, files=tuple(name for name in found.files if name in remains.files))
        for name in found.files:
            if name != folder.lock_file:  # which this process holds by now, and takes away at the end of the block
                with reporting(root / name, "remove"):
                    safe_disk_changes.system.unlink(root / name)
    inner = {root / above for name in found.files for above in Path(name).parents}
    outer = {above for above in root.parents if Path(os.path.realpath(top)) in above.parents}
    safe_disk_changes.remove_empty((inner | outer) - {Path.cwd()})
    return found

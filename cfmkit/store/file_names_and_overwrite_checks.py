"""Files that a run may write in its folder: plain names, not reserved, none in the place of somebody else's file."""

from __future__ import annotations

import os
import stat
from typing import TYPE_CHECKING

from cfmkit.errors import OutputError
from cfmkit.store.content_hashes_and_versions import file_hash
from cfmkit.store.safe_disk_changes import quote_path

if TYPE_CHECKING:
    from pathlib import Path

MANIFEST_NAME = "manifest.json"
RESERVED_PREFIX = ".cfmkit"
JOURNAL_NAME = ".cfmkit-journal.sqlite"
"""What a long run notes as it goes; unlike its other files it is there before the run ends, and stays."""
OVERWRITE_REMEDY = "move it away or give another output folder (--out)"


def checked_name(name: str) -> str:
    """Return `name` if it is a plain path below the folder: ``figures/loop.png``.

    Raises OutputError if it is absolute, leads upwards, holds control characters or backslashes, or is one of the names
    that the folder keeps for itself.
    """
    if problem := _name_problem(name):
        raise OutputError(f"{name!a} is not a name for a file in the output folder: {problem}")
    return name


def _name_problem(name: str) -> str | None:
    parts = name.split("/")
    if name.startswith("/"):
        return "it is absolute"
    if any(part in ("", ".", "..") for part in parts):
        return "it has an empty part, '.' or '..'"
    if "\\" in name or any(ord(char) < 32 or ord(char) == 127 for char in name):
        return "it holds a backslash or a control character"
    if name.lower() == MANIFEST_NAME or any(part.lower().startswith(RESERVED_PREFIX) for part in parts):
        return "the folder keeps it for itself"
    return None


def refuse_in_the_way(root: Path, name: str, *, ours: bool) -> None:
    """Raise if something other than a file of an earlier run stands where `name` is to go.

    A link on the way counts as in the way: what is behind it may lie outside the folder.
    """
    *above, _ = name.split("/")
    place = root
    for part in above:
        place = place / part
        mode = mode_of(place)
        if mode is not None and not stat.S_ISDIR(mode):
            raise OutputError(
                f"{quote_path(place)} is in the way: it is {_kind(mode)}, not a folder; {OVERWRITE_REMEDY}"
            )
    mode = mode_of(root / name)
    if mode is None or (ours and stat.S_ISREG(mode)):
        return
    raise OutputError(
        f"{quote_path(root / name)} is in the way: it is {_kind(mode)} that no earlier run wrote; {OVERWRITE_REMEDY}"
    )


def hash_in(root: Path, name: str) -> str | None:
    """Return the SHA-256 of an ordinary file in the folder; None if there is none, or only through a link."""
    place = root
    for part in name.split("/")[:-1]:
        place = place / part
        if place.is_symlink():
            return None
    return file_hash(root / name)


def mode_of(path: Path) -> int | None:
    """Return the mode of what is at `path` itself, None if there is nothing."""
    try:
        return os.lstat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _kind(mode: int) -> str:
    if stat.S_ISLNK(mode):
        return "a link"
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a file" if stat.S_ISREG(mode) else "a special file"

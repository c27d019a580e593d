"""A folder of this user alone, for what later runs may use again: a list of fonts."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from cfmkit.store import safe_disk_changes


def resolve_trusted(path: Path) -> Path | None:
    """Return a path without its links if only this user, or the system's owner, can have put there what stands there.

    None if others can. Code is loaded from the path that is returned, never from the one that was given: a link that
    is followed twice may lead elsewhere the second time. Everything on the way counts, from the root downwards: who can
    rename a folder can put another one in its place, unless the folder that it stands in lets nobody touch what is
    not theirs (as the temporary one does). What has been judged therefore cannot be exchanged by others afterwards.
    """
    try:
        real = path.resolve(strict=True)
        if hasattr(os, "getuid") and not all(_is_safe(step, step == real) for step in (*reversed(real.parents), real)):
            return None
    except OSError:
        return None
    return real


def _is_safe(step: Path, is_last: bool) -> bool:
    """Return whether others can change neither a file or folder nor what it is; a link is new since it was resolved."""
    about = step.lstat()
    shared = about.st_mode & 0o022 and (is_last or not about.st_mode & stat.S_ISVTX)
    return not shared and not stat.S_ISLNK(about.st_mode) and about.st_uid in (os.getuid(), 0)


def private_folder(
    name: str,  # what it is for, in a few letters
    make: bool = True,  # whether to make one where there is none; otherwise None
) -> Path | None:
    """Return a folder for files that this user's later runs may use again; None if there is no room for any.

    It has a fixed name, so that it serves every process of the user. What stands there and belongs to somebody
    else, or can be written by others, is not trusted (code and settings are loaded from it): then the folder is a new
    one. Where others can rename it, in a folder of temporary files that is shared without protection, there is none.
    """
    try:
        folder = place(name)
        if not make:
            return resolve_trusted(folder) if _is_ours(folder) else None
        try:
            safe_disk_changes.system.mkdir(folder, 0o700)
        except FileExistsError:
            if not _is_ours(folder):
                folder = Path(tempfile.mkdtemp(prefix=f"cfmkit-{name}-"))
        return resolve_trusted(folder)
    except OSError:
        return None


def place(name: str) -> Path:
    """Return where such a folder is, whether it exists or not."""
    user = os.getuid() if hasattr(os, "getuid") else "user"
    return Path(tempfile.gettempdir()) / f"cfmkit-{name}-{user}"


def _is_ours(folder: Path) -> bool:
    """Return whether it is a real folder of this user that nobody else may write to, and that can be written."""
    about = folder.lstat()
    if not stat.S_ISDIR(about.st_mode):
        return False
    if hasattr(os, "getuid") and (about.st_uid != os.getuid() or about.st_mode & 0o022):
        return False
    return os.access(folder, os.W_OK | os.X_OK)

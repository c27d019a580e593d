"""A folder of this user alone, for what later runs may use again: compiled code, a list of fonts."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from cfmkit.store import safe_disk_changes


def trusted(path: Path) -> bool:
    """Return whether only this user, or the system's owner, can have put what stands at a path there.

    Code is loaded only from such places. Everything on the way counts: who can rename a folder can put another one in
    its place, unless the folder that it stands in lets nobody touch what is not theirs (as the temporary one does).
    """
    if not hasattr(os, "getuid"):
        return True
    try:
        real = path.resolve(strict=True)
        for step in (real, *real.parents):
            about = step.stat()
            shared = about.st_mode & 0o022 and not (step != real and about.st_mode & stat.S_ISVTX)
            if shared or about.st_uid not in (os.getuid(), 0):
                return False
    except OSError:
        return False
    return True


def private_folder(name: str, make: bool = True) -> Path | None:
    """Return a folder for files that this user's later runs may use again; None where there is no room for any.

    It has a fixed name, so that it serves every process of the user. What stands there and belongs to somebody
    else, or can be written by others, is not trusted (code is loaded from it): then the folder is a new one.

    Parameters
    ----------
    name : str
        What it is for, in a few letters.
    make : bool
        Whether to make one where there is none; otherwise None.
    """
    try:
        folder = place(name)
        if not make:
            return folder if _is_ours(folder) else None
        try:
            safe_disk_changes.system.mkdir(folder, 0o700)
        except FileExistsError:
            if not _is_ours(folder):
                return Path(tempfile.mkdtemp(prefix=f"cfmkit-{name}-"))
        return folder
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

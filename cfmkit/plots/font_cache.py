"""Folder of matplotlib's list of fonts, a private one where its own cannot be written; the font of figures."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

CACHE_VARIABLE = "MPLCONFIGDIR"


def find_room() -> None:
    """Give matplotlib a folder to write to if it would find none: it complains then, and lists all fonts every time.

    Nothing is done where the user has named a folder, or where matplotlib is there already.
    """
    if CACHE_VARIABLE in os.environ or "matplotlib" in sys.modules or all(map(_is_writable, _own_folders())):
        return
    with suppress(OSError):
        os.environ[CACHE_VARIABLE] = str(_private_folder())


def _private_folder() -> Path:
    """Return a folder for temporary files that serves all processes of this user, and that nobody else can write.

    What stands in its place and belongs to somebody else is not trusted: then the folder is a new one.
    """
    user = os.getuid() if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir()) / f"cfmkit-fonts-{user}"
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    about = folder.lstat()
    ours = stat.S_ISDIR(about.st_mode) and (user == "user" or (about.st_uid == user and not about.st_mode & 0o022))
    return folder if ours and _is_writable(folder) else Path(tempfile.mkdtemp(prefix="cfmkit-fonts-"))


def _own_folders() -> Iterator[Path]:
    """Yield where matplotlib wants to write: its settings, its list of fonts."""
    for variable, usual in (("XDG_CONFIG_HOME", "~/.config"), ("XDG_CACHE_HOME", "~/.cache")):
        base = os.environ.get(variable) if sys.platform.startswith(("linux", "freebsd")) else None
        yield Path(base or os.path.expanduser(usual)) / "matplotlib"


def _is_writable(folder: Path) -> bool:
    """Return whether a folder can be written, or made; matplotlib would make it, too."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def kept_lists() -> Path:
    """Return where matplotlib keeps its list of fonts."""
    find_room()
    import matplotlib

    return Path(matplotlib.get_cachedir())


def font_of_figures() -> tuple[str, str]:
    """Return the name of the font that figures are written in, and its file; empty where it is missing."""
    find_room()
    from matplotlib.font_manager import FontProperties, findfont

    name = "DejaVu Sans"
    try:
        return name, str(findfont(FontProperties(family=name), fallback_to_default=False))
    except ValueError:
        return name, ""

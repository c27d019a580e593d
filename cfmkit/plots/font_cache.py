"""Where matplotlib keeps its list of fonts: in its own folder, or in a private one where that cannot be written."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from cfmkit.store.private_folder import private_folder

VARIABLE = "MPLCONFIGDIR"


def find_room() -> None:
    """Give matplotlib a folder to write to if it would find none: it complains then, and lists all fonts every time.

    Nothing is done where the user has named a folder, or where matplotlib is there already.
    """
    if VARIABLE in os.environ or "matplotlib" in sys.modules or _is_writable(_own_folder()):
        return
    if (folder := private_folder("fonts")) is not None:
        os.environ[VARIABLE] = str(folder)


def _own_folder() -> Path:
    base = os.environ.get("XDG_CONFIG_HOME") if sys.platform.startswith(("linux", "freebsd")) else None
    return Path(base or os.path.expanduser("~/.config")) / "matplotlib"


def _is_writable(folder: Path) -> bool:
    """Return whether a folder can be written, or made: then the nearest of those above it that exists counts."""
    there = next((one for one in (folder, *folder.parents) if os.path.exists(one)), Path("/"))
    return os.access(there, os.W_OK | os.X_OK)


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

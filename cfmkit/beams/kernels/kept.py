"""Where the compiled code is kept, and whether it is there: found out without compiling or loading it."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path


def digest() -> str:
    """Return a digest of the sources of all kernels."""
    whole = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        whole.update(path.read_bytes())
    return whole.hexdigest()


def folders() -> tuple[Path, ...]:
    """Return where the compiler may keep code, in the order in which it looks for a place that it can write to."""
    from numba.misc.appdirs import AppDirs

    from cfmkit.store.private import place

    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return (Path(given),)
    home = Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)
    return (Path(__file__).parent / "__pycache__", home, place("compiled"))


def kept_in() -> Path | None:
    """Return the folder that holds the code compiled from these sources; None if they have not been compiled yet."""
    pattern = f"*_{digest()[:16]}*.nbi"
    found = (path for folder in folders() if folder.is_dir() for path in folder.rglob(pattern))
    return next((path.parent for path in found), None)

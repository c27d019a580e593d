"""SHA-256 hashes of files, folders and values, and the versions of code and libraries that compute a result."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import platform
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit._version import __version__
from cfmkit.errors import CfmError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

NUMERICAL_LIBRARIES = ("numpy", "scipy")  # the libraries whose versions can change a number
_LEFT_BEHIND = (".pyc", ".pyo", ".so", ".pyd")  # endings of what Python and a compiler put beside source files


def file_hash(path: Path) -> str | None:
    """Return the SHA-256 of an ordinary file, or None if there is none (a link does not count)."""
    if path.is_symlink() or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def stable_hash(
    value: Any,  # none, truth values, numbers, texts, and sequences and mappings of them
) -> str:
    """Return the SHA-256 of a value's canonical JSON: the same on every machine and in every run.

    Mappings count by content, not by order; tuples, lists and arrays are the same;
    -0.0 is 0.0. An integer is not the float of the same size, nor a truth value.

    Raises CfmError if there is something else inside, or a number that is not finite.

    Examples
    --------
    >>> stable_hash({"a": 1, "b": [2.5]}) == stable_hash({"b": (2.5,), "a": 1})
    True
    """
    text = json.dumps(_make_canonical(value), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _make_canonical(value: Any) -> Any:
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise CfmError(f"{value} has no identity: only finite numbers have")
        return value + 0.0
    if isinstance(value, Mapping):
        if odd := [key for key in value if not isinstance(key, str)]:
            raise CfmError(f"{odd[0]!r} is a key that is not a text: it has no identity")
        return {key: _make_canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_make_canonical(item) for item in value]
    if hasattr(value, "tolist"):  # numpy's scalars and arrays, without importing numpy
        return _make_canonical(value.tolist())
    raise CfmError(f"a {type(value).__name__} has no identity: only texts, numbers and their collections have")


def origin(
    # distributions whose versions count; one that is not installed counts as that
    libraries: Iterable[str] = NUMERICAL_LIBRARIES,
) -> dict[str, str]:
    """Return what computes: cfmkit's version and content, and the versions of Python and of libraries.

    It belongs into the identity of every result that is kept for a later run.
    """
    versions = {"cfmkit": __version__, "content": code_stamp(), "python": platform.python_version()}
    return versions | {name: installed_version(name) or "not installed" for name in libraries}


@lru_cache(maxsize=32)
def installed_version(name: str) -> str | None:
    """Return the version of a distribution, None if it is not installed.

    It stands in the name of a folder beside the library's own. The standard library reads the file in that folder: to
    import what reads it, and to read three, takes longer than numpy's whole arithmetic in a short run.
    """
    start = name.lower().replace("-", "_") + "-"
    for place in sys.path:
        with contextlib.suppress(OSError), os.scandir(place or ".") as entries:
            folders = [entry.name for entry in entries if entry.name.lower().startswith(start)]
            versions = [
                folder[len(start) :].removesuffix(".dist-info") for folder in folders if folder.endswith(".dist-info")
            ]
            if len(versions) == 1 and len(folders) == 1:
                return versions[0]
            if folders:  # something unusual is there: the standard library knows
                break
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return None


@lru_cache(maxsize=1)
def code_stamp() -> str:
    """Return the SHA-256 of the package's own files, whose version is the same for every commit.

    It takes some 20 ms, once in a process.
    """
    return tree_hash(Path(__file__).parents[1])


def tree_hash(root: Path) -> str:
    """Return the SHA-256 of the names and the content of all files below a folder, but hidden and compiled ones."""
    digest = hashlib.sha256()
    for name in sorted(_files_below(os.fspath(root))):
        content = (root / name).read_bytes()
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def _files_below(root: str, above: str = "") -> Iterator[str]:
    """Yield the names of all files below a folder but hidden ones and compiled ones."""
    with os.scandir(os.path.join(root, above)) as entries:
        for entry in entries:
            name = f"{above}/{entry.name}" if above else entry.name
            if entry.name.startswith(".") or entry.name == "__pycache__":
                continue
            if entry.is_dir():
                yield from _files_below(root, name)
            elif not entry.name.endswith(_LEFT_BEHIND):
                yield name

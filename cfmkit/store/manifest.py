"""Files that a run wrote: ``manifest.json``, the last file of a run and the only one with a time in it."""

from __future__ import annotations

import json
import platform
import re
import stat
import sys
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cfmkit._version import __version__
from cfmkit.errors import CfmError, OutputError
from cfmkit.store.file_names_and_overwrite_checks import MANIFEST_NAME, OVERWRITE_REMEDY, checked_name, hash_in, mode_of
from cfmkit.store.safe_disk_changes import FileRecord, quote_path, reporting

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime, timedelta
    from pathlib import Path

RESULT_LIBRARIES = (
    "SALib",
    "ezdxf",
    "matplotlib",
    "numpy",
    "pandas",
    "pint",
    "pydantic",
    "scipy",
    "shapely",
    "typer",
    "yaml",
)
"""The libraries whose versions can change a result; those a run imported are listed."""
_OWN_KEYS = ("cfmkit", "duration_s", "files", "finished", "started", "versions")


@dataclass(frozen=True)
class Manifest:
    """The list of a run's files and the circumstances of the run."""

    files: Mapping[str, FileRecord]  # every file of the run but the manifest itself, by its name below the folder
    # everything in the file: ``cfmkit`` (version), ``versions``, ``started``, ``finished``, ``duration_s``, ``files``,
    # and what the run said about itself
    data: Mapping[str, Any]

    @classmethod
    def from_run(
        cls,
        # what the run says about itself (arguments, seed, hash of the spec, status, exit code); JSON values
        info: Mapping[str, Any],
        files: Mapping[str, FileRecord],  # what it wrote
        started: datetime,  # in UTC
        duration: timedelta,  # how long it took
    ) -> Manifest:
        """Return the manifest of a run that is about to be committed."""
        if taken := sorted(set(info) & set(_OWN_KEYS)):
            raise CfmError(f"the manifest itself says what {', '.join(taken)} is")
        data = {
            **info,
            "cfmkit": __version__,
            "versions": imported_versions(),
            "started": _text(started),
            "finished": _text(started + duration),
            "duration_s": round(duration.total_seconds(), 3),
            "files": {name: record._asdict() for name, record in files.items()},
        }
        return cls(MappingProxyType(dict(files)), MappingProxyType(data))

    def to_json(self) -> bytes:
        """Return the file's content: sorted keys, two spaces, one line feed at the end."""
        try:
            text = json.dumps(dict(self.data), sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise CfmError(f"the manifest takes JSON values: {error}") from None
        return (text + "\n").encode("utf-8", "backslashreplace")

    @classmethod
    def read(cls, folder: Path) -> Manifest | None:
        """Return the manifest in a folder, or None if there is none.

        Raises OutputError if a ``manifest.json`` is there that cfmkit did not write.
        """
        path = folder / MANIFEST_NAME
        mode = mode_of(path)
        if mode is None:
            return None
        with reporting(path, "read"):
            data = _parse(path.read_bytes()) if stat.S_ISREG(mode) else None
        if data is None:
            raise OutputError(f"{quote_path(path)} is in the way: cfmkit did not write it; {OVERWRITE_REMEDY}")
        files = {name: FileRecord(**record) for name, record in data["files"].items()}
        return cls(MappingProxyType(files), MappingProxyType(data))

    def mismatches(self, folder: Path) -> tuple[str, ...]:
        """Return the listed files that are missing from a folder or have another content."""
        return tuple(name for name, record in self.files.items() if hash_in(folder, name) != record.sha256)


def _parse(content: bytes) -> dict[str, Any] | None:
    """Return a manifest's data, or None if it is not one of ours.

    The names decide what the next run removes, so nothing odd may pass.
    """
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or not isinstance(data.get("cfmkit"), str):
        return None
    files = data.get("files")
    if not isinstance(files, dict) or not all(_is_entry(name, record) for name, record in files.items()):
        return None
    return data


def _is_entry(name: str, record: object) -> bool:
    try:
        checked_name(name)
    except OutputError:
        return False
    if not isinstance(record, dict) or set(record) != {"bytes", "sha256"}:
        return False
    size, digest = record["bytes"], record["sha256"]
    return type(size) is int and isinstance(digest, str) and bool(re.fullmatch("[0-9a-f]{64}", digest))


def imported_versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that this process has imported."""
    versions = {"python": platform.python_version()}
    for name in RESULT_LIBRARIES:
        if (module := sys.modules.get(name)) is not None:
            versions[name] = str(getattr(module, "__version__", "unknown"))
    return versions


def _text(time: datetime) -> str:
    return time.isoformat(timespec="milliseconds").replace("+00:00", "Z")

"""Folders that come with the package: beside its modules in a wheel, beside the package in its source."""

from __future__ import annotations

from pathlib import Path

from cfmkit.errors import UsageError


def shipped_folder(
    name: str,  # as it stands in the tree: ``configs``, ``docs``
    sample: str,  # a file that it must have: another package's folder of that name may stand beside this one
) -> Path:
    """Return a folder that comes with the package.

    Raises UsageError if this installation has none.
    """
    package = Path(__file__).parents[1]
    for place in (package / name, package.parent / name):
        if (place / sample).is_file():
            return place
    raise UsageError(f"this installation has no {name}; install cfmkit from a wheel or from its source")

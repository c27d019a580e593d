"""Names of data files in a specification (recordings, profiles): relative to its folder, and never outside of it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

TAKEN_NAMES = ("curve.csv", "data.csv", "residuals.csv", "parameters.csv", "cycles.csv", "results.csv")
"""Names that data files may not have, because runs write files of these names."""


class DataSource(str):
    """The name of a data file as a specification writes it, which knows the folder it is relative to."""

    __slots__ = ("folder",)
    folder: str

    def __new__(cls, name: str, folder: str | os.PathLike[str]) -> DataSource:
        """Return `name` as a data file below `folder`.

        Raises ValueError if it is not below, or not there.
        """
        source = super().__new__(cls, name)
        source.folder = os.fspath(folder)
        root, path = os.path.realpath(folder), os.path.realpath(source.path)
        if not name or "\0" in name or os.path.isabs(name) or os.path.commonpath([root, path]) != root:
            raise ValueError("must be a file in the folder of the specification, or below it")
        if name in TAKEN_NAMES:
            raise ValueError(f"{name!r} is what runs call a file of their own; rename it")
        if not os.path.isfile(path):
            raise ValueError(f"there is no file {name!r} in the folder of the specification")
        return source

    def __reduce__(self) -> tuple[type[DataSource], tuple[str, str]]:
        return type(self), (str(self), self.folder)

    @property
    def path(self) -> Path:
        """Path of the file."""
        return Path(self.folder) / str(self)


def list_data_files(tree: Any) -> Iterator[DataSource]:
    """Yield every data file that a nested specification names."""
    if isinstance(tree, DataSource):
        yield tree
    elif isinstance(tree, Mapping):
        for item in tree.values():
            yield from list_data_files(item)
    elif isinstance(tree, list | tuple):
        for item in tree:
            yield from list_data_files(item)

"""Packages as an installer leaves them: a module and a folder that says what it offers."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cfmkit.families import forget_installed

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import pytest

RECORD = (
    "from dataclasses import replace\nfrom spare_family import FAMILY_RECORD as SPARE\n"
    "from cfmkit.families.base import DesignMethod, ResultNames, Pictures\n"
)


def record(name: str, interface: int | None = 1) -> str:
    """Return the source of a module with a family that works."""
    return f"{RECORD}FAMILY = replace(SPARE, name={name!r}, interface={interface})\n"


def install(folder: Path, package: str, source: str, *entries: str, kind: str = "dist") -> str:
    """Put a package with one module in a folder; return the module's name."""
    module = package.replace("-", "_")
    (folder / f"{module}.py").write_text(source)
    info = folder / f"{module}-1.0.{kind}-info"
    info.mkdir()
    lines = [entry if "=" in entry else f"{entry} = {module}:FAMILY" for entry in entries]
    text = "\n".join(["[console_scripts]", "x = y:z", "", "[cfmkit.families]", *lines, "", "[other]", "a = b:c", ""])
    (info / "entry_points.txt").write_text(text)
    return module


@contextmanager
def empty_site(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Give an empty folder on the path of modules; what is installed there is forgotten afterwards."""
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    forget_installed()
    yield folder
    for path in folder.glob("*.py"):
        sys.modules.pop(path.stem, None)
    forget_installed()

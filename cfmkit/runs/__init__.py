"""A run over one specification or many: read and check it, compute, and write a folder of files."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cfmkit.runs.explorer import Explorer
    from cfmkit.runs.explorer_server import ExplorerServer

_MODULE_BY_NAME = {"Explorer": "explorer", "ExplorerServer": "explorer_server"}

__all__ = ["Explorer", "ExplorerServer"]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULE_BY_NAME[name]}"), name)
    globals()[name] = value
    return value

"""A run over one specification or many: read and check it, compute, and write a folder of files."""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "explorer": "Explorer",
    "explorer_server": "ExplorerServer",
    "suggest_api": "read_request",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

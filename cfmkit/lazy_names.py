"""Names that a package offers from its modules, each imported when first used: commands start without the rest."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazy_names(package: str, names_by_module: Mapping[str, str]) -> tuple[Callable[[str], Any], list[str]]:
    """Return `__getattr__` and `__all__` of a package.

    Parameters
    ----------
    package : str
        Its ``__name__``.
    names_by_module : mapping
        Module below the package -> the names that it offers, with blanks between them.
    """
    module_by_name = {
        name: f"{package}.{module}" for module, names in names_by_module.items() for name in names.split()
    }

    def import_name(name: str) -> Any:
        if name not in module_by_name:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(module_by_name[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return import_name, sorted(module_by_name)

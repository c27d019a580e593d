"""From text to a specification and back: YAML with places, quantities with units, the models of what may be said."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cfmkit.specs.keys_and_schema import keys, schema

__all__ = ["keys", "schema"]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed: pydantic is half of a start."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.keys_and_schema"), name)
    globals()[name] = value
    return value

"""Springs that can be bought: own lists, and a generic series that is computed from wire, coil and turns."""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "helical_spring_formulas": "HelicalSpring",
    "offer_type_and_generic_series": "generic",
    "wire_materials": "WIRES_BY_NAME",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

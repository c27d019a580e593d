"""From text to a specification and back: YAML with places, quantities with units, the models of what may be said."""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "evaluable_target_curve": "TargetCurve",
    "keys_and_schema": "keys",
    "spec": "Analysis Model Requirement Spec",
    "study_spec": "Sensitivity Sweep",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

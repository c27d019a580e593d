"""From text to a specification and back: YAML with places, quantities with units, the models of what may be said."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cfmkit.specs.evaluable_target_curve import TargetCurve as TargetCurve
    from cfmkit.specs.keys_and_schema import keys as keys
    from cfmkit.specs.keys_and_schema import schema as schema
    from cfmkit.specs.spec import Analysis as Analysis
    from cfmkit.specs.spec import Model as Model
    from cfmkit.specs.spec import PositiveForce as PositiveForce
    from cfmkit.specs.spec import PositiveLength as PositiveLength
    from cfmkit.specs.spec import Requirement as Requirement
    from cfmkit.specs.spec import Spec as Spec
    from cfmkit.specs.study_spec import Sensitivity as Sensitivity
    from cfmkit.specs.study_spec import Sweep as Sweep

_NAMES_BY_MODULE = {
    "evaluable_target_curve": "TargetCurve",
    "keys_and_schema": "keys schema",
    "spec": "Analysis Model PositiveForce PositiveLength Requirement Spec",
    "study_spec": "Sensitivity Sweep",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

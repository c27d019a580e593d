"""Planar finite elements on the outline of a part: nodes, fillets and the true boundary, which beams leave out."""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "adaptive_solution": "DrivenPart",
    "equilibrium": "SolidProblem",
    "meshed_part": "HeldOrDriven Part rings_of",
    "path_following": "PathEnd",
    "plane_stress_law": "MATERIAL_LAWS",
    "stress_along_fillets": "FilletArc",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

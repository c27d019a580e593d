"""The laws of leaves and of springs that are made of them, in closed form."""

from importlib import import_module
from typing import Any

_MODULE_BY_NAME = {
    "CosineLeaf": "cosine",
    "LeafStrip": "dimensions_and_material",
    "HybridLeaf": "hybrid",
    **dict.fromkeys(("Diamond", "Folded", "StraightSpring", "TrussDiamond", "UShape"), "positive_stiffness_springs"),
    **dict.fromkeys(("force_change", "measured_stiffness_for", "rest_shift"), "positive_stiffness_springs"),
    **dict.fromkeys(("FLAT_BUCKLED_ABOVE", "NEGATIVE_ABOVE", "TrussLeaf", "VBeam", "buckled_stress"), "v_beam"),
    **dict.fromkeys(("first_stiffness", "negative_stiffness", "onset_and_exit"), "v_beam"),
}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULE_BY_NAME[name]}"), name)

"""Rigid links with springs at their joints: torque at the crank, or force at the slider, in closed form.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.1.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "bistability_class": "scale_factors small_angle_number",
    "fit_nonnegative_rates": "RateGoal least_squares",
    "sprung_linkage": "assemble",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

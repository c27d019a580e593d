"""Measured curves: reading lab files, branches, filters, hysteresis, and what a model makes of them.

`reading` reads a file as it comes, `branches` splits it
at reversals, `low_pass` smooths each branch, `curves_and_metrics_of_recording` puts the numbers together.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "comparison": "compare",
    "value_definitions": "define_recorded_values",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

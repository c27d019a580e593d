"""The kit that optimised designs are made with, whatever the mechanism: it knows no family.

`objective_and_constraints`
    What a family sees at a point, an objective and limits by name, becomes a program of `cfmkit.numerics.sqp`; which
    limits the point misses, and which of them hold it.
`bounds_and_rounding`
    Numbers within bounds: rounded to what is written, and those that are at a bound.
`run_many_starts`
    Many starts, in this process or several, each noted when it is finished, within a time budget.
`reported_values_of_finished_design`
    What is reported of a design is what the analysis of its written specification measures.
`robust_design`
    Values for which made parts are good: margins from tolerances by linear estimate, and drawn parts.

What a design is to do, the start it begins with and the words for what blocks it belong to the family.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "robust_design": "RobustProblem with_margins",
    "run_many_starts": "UNLIMITED_CLOCK Clock",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

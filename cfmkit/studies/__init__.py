"""Studies: many variants of one specification, each evaluated once, whether it can be solved or not.

A study sees a specification, dotted paths and names of metrics; it knows no family.

`variable_paths` and `varied_axes` say what may vary and how, `plan` enumerates the points,
`point_evaluation` evaluates one of them, `variants_in_rows` many at once where the family solves them together,
`serial_and_cluster_executors` and `pool` are ways to get that done, `journal` and `row_blocks_for_journal`
remember what is finished, `engine` puts these together, `choose_metrics_to_note` names what is
noted, `tables` writes it, `summary` sums it up, and `sweep_request_and_files` is the study that
varies a specification.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "batch_sources_and_outcomes": "Entry",
    "choose_metrics_to_note": "metrics_of",
    "comparison_of_fidelities": "choices_of compare",
    "metric_changes_since_earlier_batch": "BatchComparison",
    "point_evaluation": "Study",
    "serial_and_cluster_executors": "Lost serial",
    "variable_paths": "leaf paths",
    "variants_in_rows": "are_solved_together evaluate_rows",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)

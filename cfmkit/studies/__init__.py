"""Studies: many variants of one specification, each evaluated once, whether it can be solved or not.

A study sees a specification, dotted paths and names of metrics; it knows no family.

`variable_paths` and `varied_axes` say what may vary and how, `plan` enumerates the points,
`point_evaluation` evaluates one of them, `variants_in_rows` many at once where the family solves them together,
`serial_and_cluster_executors` and `pool` are ways to get that done, `journal` and `row_blocks_for_journal`
remember what is finished, `engine` puts these together, `choose_metrics_to_note` names what is
noted, `tables` writes it, `summary` sums it up, and `sweep_request_and_files` is the study that
varies a specification.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.comparison_of_fidelities import choices_of, compare
    from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison

_MODULE_BY_NAME = {
    "BatchComparison": "metric_changes_since_earlier_batch",
    "Entry": "batch_sources_and_outcomes",
    "choices_of": "comparison_of_fidelities",
    "compare": "comparison_of_fidelities",
}

__all__ = ["BatchComparison", "Entry", "choices_of", "compare"]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed: a check of a specification needs none."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULE_BY_NAME[name]}"), name)
    globals()[name] = value
    return value

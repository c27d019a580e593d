"""Studies: many variants of one specification, each evaluated once, whether it can be solved or not.

A study sees a specification, dotted paths and names of metrics; it knows no family.

`variations` says what may vary and how, `plan` enumerates the points, `point_evaluation` says what is noted of each,
`variants_in_rows` evaluates them as rows, `serial_and_cluster_executors` and `pool` do jobs, `journal` and
`row_blocks_for_journal` keep what is finished, `engine` puts these together, `summary_and_tables` writes and sums up,
and `sweep_request_and_files` is the study that varies a specification.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "batch_sources_and_outcomes": "Entry",
        "point_evaluation": "metrics_of Study",
        "comparison_of_fidelities": "choices_of compare",
        "earlier_batch": "BatchComparison",
        "serial_and_cluster_executors": "Lost serial",
        "variations": "FIXED_BLOCKS CannotVary leaf paths",
        "variants_in_rows": "evaluate_rows points_at_once",
    },
)

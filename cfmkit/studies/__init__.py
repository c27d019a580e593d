"""Studies: many variants of one specification, each evaluated once, whether it can be solved or not.

A study sees a specification, dotted paths and names of metrics; it knows no family.

`variable_paths` and `varied_axes` say what may vary and how, `plan` enumerates the points,
`point_evaluation` evaluates one of them, `variants_in_rows` many at once where the family solves them together,
`serial_and_cluster_executors` and `pool` are ways to get that done, `journal` and `row_blocks_for_journal`
remember what is finished, `engine` puts these together, `choose_metrics_to_note` names what is
noted, `tables` writes it, `summary` sums it up, and `sweep_request_and_files` is the study that
varies a specification.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "choose_metrics_to_note": "metrics_of",
        "point_evaluation": "Study",
        "serial_and_cluster_executors": "Lost serial",
        "variable_paths": "leaf paths",
        "variants_in_rows": "are_solved_together evaluate_rows",
    },
)

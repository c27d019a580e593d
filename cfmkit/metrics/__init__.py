"""Constant-force metrics by name, over a stated window, per branch; and requirements on them.

`metric_definitions` lists what there is and what a name may mean, `window_metrics` and `ranges` compute it,
`branches` cuts windows, `curve_rows` and `rows_in_window` are what a metric looks at, `metric_values` runs the
definitions over a curve and writes border units, `requirements` compares with bounds.
"""

from cfmkit.metrics.branches import BranchTrace, Undefined, Window, restrict, traces
from cfmkit.metrics.compare import MetricChange
from cfmkit.metrics.definition import Definition
from cfmkit.metrics.measuring_frame import MeasuringFrame
from cfmkit.metrics.metric_definitions import (
    METRIC_TABLE,
    definition_of,
    definitions,
    known_metrics,
    metrics_by_name,
    other_name,
    split_name,
    unknown_metric,
    values_of_family,
)
from cfmkit.metrics.metric_values import (
    Survey,
    as_json,
    evaluate,
    flat_metrics,
    frame_of,
    gaps,
    mean_effort,
    measure,
    metrics_json,
    search_json,
    shorten_window,
    survey,
    travel_of,
    warn_of_uncovered_windows,
    window_of,
)
from cfmkit.metrics.requirements import Outcome, check, requirement_problems
from cfmkit.metrics.usable_interval_of_all_branches import CycleRows, metric_of_rows

__all__ = [
    "METRIC_TABLE",
    "BranchTrace",
    "CycleRows",
    "Definition",
    "MeasuringFrame",
    "MetricChange",
    "Outcome",
    "Survey",
    "Undefined",
    "Window",
    "as_json",
    "check",
    "definition_of",
    "definitions",
    "evaluate",
    "flat_metrics",
    "frame_of",
    "gaps",
    "known_metrics",
    "mean_effort",
    "measure",
    "metric_of_rows",
    "metrics_by_name",
    "metrics_json",
    "other_name",
    "requirement_problems",
    "restrict",
    "search_json",
    "shorten_window",
    "split_name",
    "survey",
    "traces",
    "travel_of",
    "unknown_metric",
    "values_of_family",
    "warn_of_uncovered_windows",
    "window_of",
]

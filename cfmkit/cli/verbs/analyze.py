"""``cfmkit analyze``: curve, metrics and requirements of a mechanism as specified."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING

from cfmkit.cli.options import (
    REPORT_FLAG,
    ComputeOptions,
    MeasurementOptions,
    RunPictures,
    data_record,
    flag,
    given_measurement_options,
    option,
    read_measured,
    refuse_without_data,
)

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document

HELP_POSITION = 20
HELP_EXAMPLE = "cfmkit analyze cam.yaml --set mechanism.rolling_friction=0.004 --report"


@dataclass(frozen=True, kw_only=True)
class AnalyzeOptions(ComputeOptions, MeasurementOptions, RunPictures):
    """Arguments and options."""

    report: bool = REPORT_FLAG()
    data: str | None = option("FILE.csv", "Measured curve to overlay; reports the errors of the model.")
    compare_fidelity: bool = flag("Overlay the curves of all models and report their differences.")


def run(options: AnalyzeOptions, terminal: Terminal) -> Document:
    """Analyse a mechanism as it is: curve, metrics, requirements, figures; with --data also a measured curve."""
    from cfmkit.cli.run_spec_and_print_page import execute
    from cfmkit.runs.run import Verb, run_analysis

    work, inputs = run_analysis, {}
    words: tuple[str, ...] = ()
    if options.data is not None:
        inputs, words = data_record(options.data), ("--data", options.data, *chain(*given_measurement_options(options)))
        from cfmkit.runs.comparisons_and_corrections import analyze_beside_recording

        work = partial(analyze_beside_recording, read_measured(options.data, options))
    else:
        refuse_without_data(options)
    if options.compare_fidelity:
        from cfmkit.runs.comparisons_and_corrections import analyze_by_each_model

        work = partial(analyze_by_each_model, work)
    verb = Verb("analyze", work, inputs, words=words)
    return execute(verb, options, terminal, options.report)

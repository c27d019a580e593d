"""``cfmkit correct``: a drawing corrected by the recording of its part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING

from cfmkit.cli.options import (
    REPORT_FLAG,
    ComputeOptions,
    MeasurementOptions,
    argument,
    data_record,
    given_measurement_options,
    option,
    read_measured,
)

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document

HELP_POSITION = 36
HELP_EXAMPLE = "cfmkit correct design.yaml loop.csv --tare start"


@dataclass(frozen=True, kw_only=True)
class CorrectOptions(ComputeOptions, MeasurementOptions):
    """Arguments and options."""

    data: str = argument("DATA.csv", "The measured curve of the part, as for `measure`.")
    fit: str | None = option(
        "A.B,C.D",
        "What errs in the part, as for `calibrate`; default: whichever of modulus, thickness, friction and "
        "spring rates the recording tells apart.",
    )
    report: bool = REPORT_FLAG()


def run(options: CorrectOptions, terminal: Terminal) -> Document:
    """Correct a design by the recording of its part: what differs is fitted, what is made is drawn anew."""
    from cfmkit.cli.run_spec_and_print_page import execute
    from cfmkit.errors import UsageError
    from cfmkit.runs.comparisons_and_corrections import report_on_corrected
    from cfmkit.runs.run import Verb

    if options.fit is not None and not options.fit.strip():
        raise UsageError("--fit is empty; name one or more values, e.g. --fit mechanism.material.youngs_modulus")
    source = read_measured(options.data, options)
    fit = [] if options.fit is None else ["--fit", options.fit]
    words = (options.data, *fit, *chain(*given_measurement_options(options)))
    compute = partial(report_on_corrected, source, options.fit, options.tare is not None)
    verb = Verb("correct", compute, data_record(options.data), words=words)
    return execute(verb, options, terminal, options.report)

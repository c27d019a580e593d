"""``cfmkit calibrate``: values of a spec fitted to a measured curve."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
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
    from cfmkit.documents.run_outcome import Report
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.families.run_control import Run
    from cfmkit.specs.spec import Spec

HELP_POSITION = 34
HELP_EXAMPLE = "cfmkit calibrate cam.yaml loop.csv --fit mechanism.rolling_friction"


@dataclass(frozen=True, kw_only=True)
class CalibrateOptions(ComputeOptions, MeasurementOptions):
    """Arguments and options."""

    data: str = argument("DATA.csv", "The measured curve, as for `measure`.")
    fit: str = option(
        "A.B,C.D",
        "Numbers of the spec to fit, e.g. mechanism.rolling_friction; separate several with commas.",
        default=MISSING,
    )
    bounds: list[str] | None = option("A.B=LOW:HIGH", "Bounds of a fitted value, with units. Repeatable.")
    loss: str = option(
        "NAME", "Loss function of the residuals: linear, soft_l1, huber, cauchy.", shown=True, default="soft_l1"
    )
    report: bool = REPORT_FLAG()


def run(options: CalibrateOptions, terminal: Terminal) -> Document:
    """Fit values of a spec to a measured curve: values, intervals, correlation, and what the data cannot determine."""
    from cfmkit.cli.run_spec_and_print_page import execute
    from cfmkit.errors import UsageError
    from cfmkit.numerics.least_squares import LOSS_NAMES
    from cfmkit.runs.run import Verb

    if options.loss not in LOSS_NAMES:
        raise UsageError(f"--loss: there is no {options.loss!r}; there are {', '.join(LOSS_NAMES)}")
    source = read_measured(options.data, options)
    bounds = [("--bounds", text) for text in options.bounds or ()]
    loss = [] if options.loss == CalibrateOptions.loss else [("--loss", options.loss)]
    words = (options.data, "--fit", options.fit, *chain(*bounds, *loss, *given_measurement_options(options)))
    verb = Verb("calibrate", partial(compute, options, source), data_record(options.data), words=words)
    return execute(verb, options, terminal, options.report)


def compute(options: CalibrateOptions, source: MeasuredCurves, spec: Spec, run: Run) -> Report:
    """Return the report on the fitted mechanism."""
    from cfmkit.experiment.parameters_to_fit import split_bounds
    from cfmkit.numerics.least_squares import LOSS_NAMES
    from cfmkit.runs.comparisons_and_corrections import report_on_calibration
    from cfmkit.runs.measure_and_calibrate_api import calibrate

    loss = next(name for name in LOSS_NAMES if name == options.loss)
    bounds = split_bounds(options.bounds or ())
    return report_on_calibration(calibrate(spec, source, options.fit, bounds=bounds, loss=loss), source)

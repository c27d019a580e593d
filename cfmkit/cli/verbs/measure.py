"""``cfmkit measure``: metrics of a recorded force curve, raw and filtered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.options import (
    NO_LOCK_FLAG,
    QUIET_FLAG,
    FigureChoice,
    MeasurementOptions,
    argument,
    data_record,
    flag,
    option,
)
from cfmkit.documents.document import Written
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document

HELP_POSITION = 32
HELP_EXAMPLE = "cfmkit measure loop.csv --window '40 mm:210 mm'"


@dataclass(frozen=True, kw_only=True)
class MeasureOptions(MeasurementOptions, FigureChoice):
    """Arguments and options."""

    data: str = argument("DATA.csv", "Columns with displacement and force, optionally time.")
    out: str | None = option("DIR", "Output folder; default: cfm-out/DATA-measure/.", "-o", "--out")
    window: str | None = option(
        "FROM:TO", "Window to evaluate, e.g. '40 mm:210 mm'; default: the travel that every branch covers."
    )
    filter: str | None = option(
        "CUT-OFF",
        "Low-pass per branch: '2 Hz', '0.24 1/mm, order 3', '2 Hz, corrected', 'none'; "
        "default: 60 cycles over the travel, order 6 per pass.",
    )
    target: str | None = option("FORCE", "Target force or torque.")
    one_branch: bool = flag("Accept a recording without a return stroke.")
    as_recorded: bool = flag("Keep spikes and the points next to reversals.")
    max_hole: str | None = option(
        "SHARE",
        "Part of the window that may be missing in one piece, e.g. '5 %'; default: 2 %. With a larger hole "
        "numbers have no value.",
    )
    quiet: bool = QUIET_FLAG()
    no_lock: bool = NO_LOCK_FLAG()


def run(options: MeasureOptions, terminal: Terminal) -> Document:
    """Measure a recorded force curve: branches, filter, metrics raw and filtered, hysteresis, repeatability."""
    from cfmkit.cli.options import folder_of
    from cfmkit.documents.recording_document import document_of
    from cfmkit.experiment.measurement_and_calibration_outputs import data_of, files
    from cfmkit.runs.measure_and_calibrate_api import MeasurementSettings, measure_each
    from cfmkit.store import RunFolder

    out, form = folder_of(options.out, options.data, "measure"), options.form
    how = MeasurementSettings(
        options.window,
        options.filter or "default",
        options.target,
        options.tare,
        options.zero,
        options.flips,
        options.as_recorded,
        options.one_branch,
        options.cycles,
        options.max_hole,
    )
    reports = measure_each(options.data, options.units, options.group, how)
    data = data_of(reports)
    code = next((report.status.exit_code for report in reports.values() if report.numbers.holes), ExitCode.OK)
    with RunFolder(out) as folder:
        folder.check("metrics.json", "curve.csv", "cycles.csv")
        for name, content in files(reports, not options.no_plots, form):
            folder.write(name, content)
        manifest = folder.commit(
            {
                "command": "measure",
                "arguments": list(terminal.arguments),
                **data_record(options.data),
                "status": data["status"],
                "exit_code": int(code),
            }
        )
    written = Written(out, (*manifest.files, "manifest.json"))
    return document_of(reports, data | written.data, code, written)

"""``cfmkit measure``: what a measured force curve says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cfmkit.cli.options import FigureChoice, MeasurementOptions, NoLock, Quiet, argument, data_record, flag, option
from cfmkit.documents.document import Document, GridColumn, Note, PageTable, Written
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.cli.output import Terminal
    from cfmkit.experiment.measurement_and_calibration_outputs import MeasureReport

HELP_POSITION = 32
HELP_EXAMPLE = "cfmkit measure loop.csv --window '40 mm:210 mm'"


@dataclass(frozen=True, kw_only=True)
class MeasureOptions(MeasurementOptions, FigureChoice):
    """Arguments and options."""

    data: Annotated[str, argument("DATA.csv", "Columns with displacement and force, optionally time.")]
    out: Annotated[
        str | None, option("-o", "--out", metavar="DIR", text="Output folder; default: cfm-out/DATA-measure/.")
    ] = None
    window: Annotated[
        str | None,
        option(
            "--window",
            metavar="FROM:TO",
            text="Window to evaluate, e.g. '40 mm:210 mm'; default: the travel that every branch covers.",
        ),
    ] = None
    filter: Annotated[
        str | None,
        option(
            "--filter",
            metavar="CUT-OFF",
            text="Low-pass per branch: '2 Hz', '0.24 1/mm, order 3', '2 Hz, corrected', 'none'; "
            "default: 60 cycles over the travel, order 6 per pass.",
        ),
    ] = None
    target: Annotated[str | None, option("--target", metavar="FORCE", text="Target force or torque.")] = None
    one_branch: Annotated[bool, flag("--one-branch", text="Accept a recording without a return stroke.")] = False
    as_recorded: Annotated[bool, flag("--as-recorded", text="Keep spikes and the points next to reversals.")] = False
    max_hole: Annotated[
        str | None,
        option(
            "--max-hole",
            metavar="SHARE",
            text="Part of the window that may be missing in one piece, e.g. '5 %'; default: 2 %. With a larger hole "
            "numbers have no value.",
        ),
    ] = None
    quiet: Quiet = False
    no_lock: NoLock = False


def run(options: MeasureOptions, terminal: Terminal) -> Document:
    """Measure a recorded force curve: branches, filter, metrics raw and filtered, hysteresis, repeatability."""
    from cfmkit.cli.output_folder import folder_of
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
    return _document(reports, data | written.data, code, written)


def _document(
    reports: Mapping[str, MeasureReport], data: Mapping[str, Any], code: ExitCode, written: Written
) -> Document:
    """Return the document of one recording, or of several of one file."""
    from cfmkit.documents.run_document import warning_of

    found = list(reports.values())
    source, record = found[0].source, found[0].data
    window = record["window"]
    points = f"{len(source.recording)} points, {len(source.raw)} cycle{'s' * (len(source.raw) > 1)}"
    where = f"window {window['from']:.6g} to {window['to']:.6g} {window['unit']}"
    notes = [Note("read", text) for report in found for text in report.data["reading"]]
    notes += [Note("filter", report.source.low_pass.sentence) for report in found if report.source.low_pass]
    return Document(
        data=data,
        exit_code=code,
        title=source.recording.name if len(found) == 1 else f"{len(found)} recordings",
        summary=f"{points}, {where}" if len(found) == 1 else "",
        verdict="" if code is ExitCode.OK else "partial",
        tables=tuple(_numbers(report, "" if len(found) == 1 else report.source.recording.name) for report in found),
        notes=tuple(dict.fromkeys(notes)),
        warnings=tuple(warning_of(item) for item in dict.fromkeys(one for report in found for one in report.warnings)),
        files=written,
    )


def _numbers(report: MeasureReport, heading: str) -> PageTable:
    """Return the table of what matters most: per branch, raw and filtered."""
    from cfmkit.metrics.metric_definitions import words

    heads = ("", "raw", "filtered" if report.source.filtered else "")
    rows = []
    for name in _shown_warnings(report):
        raw, smooth = report.numbers.raw[name], report.numbers.filtered.get(name)
        rows.append((words(name), _short(raw), _short(smooth) if smooth else ""))
    return PageTable(heading, tuple(GridColumn(head, wraps=not at) for at, head in enumerate(heads)), tuple(rows))


def _shown_warnings(report: MeasureReport) -> list[str]:
    from cfmkit.experiment.coverage import NOT_RECORDED_TEXT

    curve = report.source.raw[0]
    stems = ("mean", "sd", "max", "min")
    several = len(curve.branches) > 1
    names = [f"{curve.kind}_{stem}{f'[{branch}]' if several else ''}" for branch in curve.branches for stem in stems]
    names += [f"{curve.kind}_ripple", "hysteresis_area", "deviation_from_target"]
    names += [f"{curve.kind}_repeatability[{branch}]" for branch in curve.branches]
    raw = report.numbers.raw
    names += [f"coverage[{branch}]" if several else "coverage" for branch in curve.branches]
    full = [name for name in names if name.startswith("coverage") and raw[name].value == 1.0]
    unknown = [name for name in names if raw[name].reason.startswith(NOT_RECORDED_TEXT)]
    return [name for name in names if name not in full and (raw[name].value is not None or name in unknown)]


def _short(quantity: Any) -> str:
    from cfmkit.specs.units import format_short

    return "no value" if quantity.value is None else format_short(quantity.value, quantity.dimension, 4)

"""``cfmkit measure``: what a measured force curve says."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cfmkit.cli import shell_completion
from cfmkit.cli.options import FigureChoice, Measuring, NoLock, Quiet, argument, data_record, flag, option
from cfmkit.cli.page_block_types import BAD, BLANK, LABEL, CellGrid, GridColumn, Paragraph, Span, TextLine, Written
from cfmkit.cli.verb_result import Answer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.output import Terminal
    from cfmkit.cli.page_block_types import Block
    from cfmkit.experiment.measurement_and_calibration_outputs import MeasureReport

PLACE = 32
EXAMPLE = "cfmkit measure loop.csv --window '40 mm:210 mm'"


@dataclass(frozen=True, kw_only=True)
class MeasureOptions(Measuring, FigureChoice):
    """Arguments and options."""

    data: Annotated[
        str, argument("DATA.csv", "Columns with displacement and force, optionally time.", shell_completion.tables)
    ]
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
    quiet: Quiet = False
    no_lock: NoLock = False


def run(options: MeasureOptions, terminal: Terminal) -> Answer:
    """Measure a recorded force curve: branches, filter, metrics raw and filtered, hysteresis, repeatability."""
    from cfmkit.experiment.measurement_and_calibration_outputs import files
    from cfmkit.runs.measure_and_calibrate_api import measure
    from cfmkit.store import RunFolder

    out, form = _folder(options), options.form
    report = measure(
        options.data,
        units=options.units,
        window=options.window,
        filter=options.filter or "default",
        target=options.target,
        tare=options.tare,
        zero=options.zero,
        flip=options.flips,
        as_recorded=options.as_recorded,
        one_branch=options.one_branch,
    )
    with RunFolder(out) as folder:
        folder.check("metrics.json", "curve.csv", "cycles.csv")
        for name, data in files(report, not options.no_plots, form):
            folder.write(name, data)
        manifest = folder.commit(
            {
                "command": "measure",
                "arguments": list(terminal.arguments),
                **data_record(options.data),
                "status": "complete",
                "exit_code": 0,
            }
        )
    written = Written(out, (*manifest.files, "manifest.json"))
    return Answer(report.data | written.data, _page(report, written, terminal.verbose > 0))


def _folder(options: MeasureOptions) -> str:
    from cfmkit.errors import UsageError

    if options.out is not None and not options.out.strip():
        raise UsageError("--out is empty; give a folder")
    return options.out or str(Path("cfm-out") / f"{Path(options.data).stem}-measure")


def _page(report: MeasureReport, written: Written, everything: bool) -> Iterator[Block]:
    source, data = report.source, report.data
    points = f"{len(source.recording)} points, {len(source.raw)} cycle{'s' * (len(source.raw) > 1)}"
    yield TextLine((Span(source.recording.name, LABEL), Span(f"  {points}")))
    for text in data["reading"]:
        yield Paragraph("read", text)
    if source.low_pass:
        yield Paragraph("filter", source.low_pass.sentence)
    window = data["window"]
    yield Paragraph("window", f"{window['from']:.6g} ... {window['to']:.6g} {window['unit']}")
    yield BLANK
    yield _numbers(report)
    yield BLANK
    for item in report.warnings:
        yield Paragraph("warning", f"{item.name}: {item.message}", BAD)
    yield written.block(everything)


def _numbers(report: MeasureReport) -> CellGrid:
    """Return the table of what matters most: per branch, raw and filtered."""
    from cfmkit.metrics.metric_definitions import words

    heads = ("", "raw", "filtered" if report.source.filtered else "")
    rows = []
    for name in _shown(report):
        raw, smooth = report.numbers.raw[name], report.numbers.filtered.get(name)
        rows.append((f"  {words(name)}", _short(raw), _short(smooth) if smooth else ""))
    return CellGrid(tuple(map(GridColumn, heads)), rows)


def _shown(report: MeasureReport) -> list[str]:
    curve = report.source.raw[0]
    stems = ("mean", "sd", "max", "min")
    several = len(curve.branches) > 1
    names = [f"{curve.kind}_{stem}{f'[{branch}]' if several else ''}" for branch in curve.branches for stem in stems]
    names += [f"{curve.kind}_ripple", "hysteresis_area", "deviation_from_target"]
    names += [f"{curve.kind}_repeatability[{branch}]" for branch in curve.branches]
    return [name for name in names if report.numbers.raw[name].value is not None]


def _short(quantity: Any) -> str:
    from cfmkit.specs.units import format_short

    return "no value" if quantity.value is None else format_short(quantity.value, quantity.dimension, 6)

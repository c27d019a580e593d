"""``cfmkit measure``: what a measured force curve says."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer
from cfmkit.cli.measuring import Measuring, data_record
from cfmkit.cli.options import Common, NoPlots, Quiet

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from cfmkit.cli.terminal import Terminal
    from cfmkit.experiment.report import MeasureReport

PLACE = 32

DataFile = Annotated[
    str,
    typer.Argument(
        metavar="DATA.csv",
        help="Columns with displacement and force, perhaps time.",
        show_default=False,
        autocompletion=completion.tables,
    ),
]
MeasureFolder = Annotated[
    str | None,
    typer.Option(
        "-o", "--out", metavar="DIR", help="Output folder; default: cfm-out/DATA-measure/.", show_default=False
    ),
]
WindowOption = Annotated[
    str | None,
    typer.Option(
        "--window", metavar="FROM:TO", show_default=False,
        help="Where to measure, e.g. '40 mm:210 mm'; default: all that is measured on every branch.",
    ),
]  # fmt: skip
Filter = Annotated[
    str | None,
    typer.Option(
        "--filter", metavar="CUT-OFF", show_default=False,
        help="Low-pass per branch: '2 Hz', '0.24 1/mm, order 3', '2 Hz, corrected', 'none'; "
        "default: 60 cycles over the travel, order 6 per pass.",
    ),
]  # fmt: skip
Target = Annotated[
    str | None,
    typer.Option("--target", metavar="FORCE", help="Force or torque it should have.", show_default=False),
]
AsRecorded = Annotated[
    bool, typer.Option("--as-recorded", help="Leave out neither spikes nor what is next to reversals.")
]
OneBranch = Annotated[bool, typer.Option("--one-branch", help="Accept a recording that has no way back.")]


@dataclass(frozen=True, kw_only=True)
class Options(Measuring, Common):
    """Arguments and options."""

    data: DataFile
    out: MeasureFolder = None
    window: WindowOption = None
    filter: Filter = None
    target: Target = None
    one_branch: OneBranch = False
    as_recorded: AsRecorded = False
    no_plots: NoPlots = False
    quiet: Quiet = False


def run(options: Options, terminal: Terminal) -> Answer:
    """Measure a recorded force curve: branches, filter, metrics raw and filtered, hysteresis, repeatability."""
    from cfmkit.experiment.report import files
    from cfmkit.store import RunFolder

    out = _folder(options)
    report = _report(options)
    with RunFolder(out) as folder:
        folder.check("metrics.json", "curve.csv", "cycles.csv")
        for name, data in files(report, plots=not options.no_plots):
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
    written = [*manifest.files, "manifest.json"]

    def view(screen: Terminal) -> None:
        from cfmkit.cli.layout import written as lines

        screen.show(*_page(report, screen), *lines(out, written, screen))

    return Answer(report.data | {"out": out, "files": written}, view)


def _folder(options: Options) -> str:
    from cfmkit.errors import UsageError

    if options.out is not None and not options.out.strip():
        raise UsageError("--out is empty; give a folder")
    return options.out or str(Path("cfm-out") / f"{Path(options.data).stem}-measure")


def _report(options: Options) -> MeasureReport:
    from cfmkit.runs.recordings import measure

    return measure(
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


def _page(report: MeasureReport, screen: Terminal) -> Iterator[RenderableType]:
    from rich.text import Text

    from cfmkit.cli.layout import paragraph
    from cfmkit.cli.terminal import BAD, LABEL

    source, data = report.source, report.data
    points = f"{len(source.recording)} points, {len(source.raw)} cycle{'s' * (len(source.raw) > 1)}"
    yield Text.assemble((source.recording.name, LABEL), "  ", points)
    for line in data["reading"]:
        yield from paragraph("read", line, screen.width)
    if source.low_pass:
        yield from paragraph("filter", source.low_pass.sentence, screen.width)
    window = data["window"]
    yield from paragraph("window", f"{window['from']:.6g} ... {window['to']:.6g} {window['unit']}", screen.width)
    yield Text()
    yield _numbers(report)
    yield Text()
    for item in report.warnings:
        yield from paragraph("warning", f"{item.name}: {item.message}", screen.width, BAD)


def _numbers(report: MeasureReport) -> RenderableType:
    """Return the table of what matters most: per branch, raw and filtered."""
    from rich.table import Table
    from rich.text import Text

    from cfmkit.cli.rows import words
    from cfmkit.cli.terminal import FAINT

    grid = Table(box=None, header_style=FAINT, padding=(0, 3, 0, 0), pad_edge=False)
    for head in ("", "raw", "filtered" if report.source.filtered else ""):
        grid.add_column(head)
    for name in _shown(report):
        raw, smooth = report.numbers.raw[name], report.numbers.filtered.get(name)
        grid.add_row(Text(f"  {words(name)}"), _short(raw), _short(smooth) if smooth else "")
    return grid


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

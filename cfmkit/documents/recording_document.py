"""The document of a recording, or of several of one file: the metrics that matter most, raw and filtered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import Document, GridColumn, Note, PageTable
from cfmkit.documents.run_document import short_value, warning_of
from cfmkit.errors import ExitCode
from cfmkit.experiment.recorded_values import NOT_RECORDED_TEXT
from cfmkit.metrics.metric_definitions import words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.documents.document import Written
    from cfmkit.experiment.measurement_and_calibration_outputs import MeasureReport


def document_of(
    reports: Mapping[str, MeasureReport], data: Mapping[str, Any], code: ExitCode, written: Written
) -> Document:
    """Return the document of one recording, or of several of one file."""
    listed = list(reports.values())
    source, window = listed[0].source, listed[0].data["window"]
    points = f"{len(source.recording)} points, {len(source.raw)} cycle{'s' * (len(source.raw) > 1)}"
    where = f"window {window['from']:.6g} to {window['to']:.6g} {window['unit']}"
    notes = [Note("read", text) for report in listed for text in report.data["reading"]]
    notes += [Note("filter", report.source.low_pass.sentence) for report in listed if report.source.low_pass]
    return Document(
        data=data,
        exit_code=code,
        title=source.recording.name if len(listed) == 1 else f"{len(listed)} recordings",
        summary=f"{points}, {where}" if len(listed) == 1 else "",
        verdict="" if code is ExitCode.OK else "partial",
        tables=tuple(_numbers(report, "" if len(listed) == 1 else report.source.recording.name) for report in listed),
        notes=tuple(dict.fromkeys(notes)),
        warnings=tuple(
            warning_of(item) for item in dict.fromkeys(finding for report in listed for finding in report.warnings)
        ),
        files=written,
    )


def _numbers(report: MeasureReport, heading: str) -> PageTable:
    """Return the table of what matters most: per branch, raw and filtered."""
    heads = ("", "raw", "filtered" if report.source.filtered else "")
    rows = []
    for name in _shown_metrics(report):
        raw, smooth = report.numbers.raw[name], report.numbers.filtered.get(name)
        rows.append((words(name), short_value(raw), short_value(smooth) if smooth else ""))
    return PageTable(heading, tuple(GridColumn(head, wraps=not at) for at, head in enumerate(heads)), tuple(rows))


def _shown_metrics(report: MeasureReport) -> list[str]:
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

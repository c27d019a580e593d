"""Outputs of measurements, comparisons and calibrations: tables, files, metrics.json, lines of the page, findings.

Nothing here touches a disk.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import Column
from cfmkit.experiment.calibration import MAX_HALF_INTERVAL, UNDETERMINED_MESSAGE, table
from cfmkit.experiment.corrections_and_low_pass import raw_zeros, words_of
from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves, Measurement, numbers_of
from cfmkit.experiment.recorded_values import hole_finding, number_of
from cfmkit.metrics import flat_metrics, metrics_json, split_name
from cfmkit.metrics.branches import span_text
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE
from cfmkit.results import Status
from cfmkit.specs.units import border_unit, format_short, to_border
from cfmkit.tables import Table, TableColumn, border_column, curve_table, to_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.curves import Curve
    from cfmkit.experiment.calibration import Calibration
    from cfmkit.experiment.comparison import Comparison, Zeros
    from cfmkit.experiment.reading import Recording
    from cfmkit.metrics import MeasuringFrame, Window
    from cfmkit.plots.figure_options import FigureForm
    from cfmkit.results import Finding, Quantity

SHOWN_METRICS = 6  # metrics in the text of a report


@dataclass(frozen=True, repr=False)
class MeasureReport:
    """A measured mechanism with everything that is read off it."""

    source: MeasuredCurves
    """The curves."""
    numbers: Measurement
    """Their metrics."""

    def __repr__(self) -> str:
        """Return the recording, the first metrics that have a value, and the names of the warnings."""
        values = [
            f"{name} {item}" for name, item in self.numbers.raw.items() if "[" not in name and item.value is not None
        ]
        names = ", ".join(dict.fromkeys(item.name for item in self.warnings)) or "none"
        count = len(self.source.raw)
        head = f"{self.source.recording.name}, {count} cycle{'s' * (count != 1)}"
        return f"<MeasureReport of {head}; {', '.join(values[:SHOWN_METRICS])}; warnings: {names}>"

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Findings about recording and window."""
        return (*self.source.warnings, *self.numbers.warnings)

    @property
    def status(self) -> Status:
        """Partial where some numbers cannot be known."""
        return Status.PARTIAL if self.numbers.holes else Status.COMPLETE

    @cached_property
    def data(self) -> dict[str, Any]:
        """Content of metrics.json: metrics of the raw and of the filtered curve, and how the file was read."""
        source, low_pass = self.source, self.source.low_pass
        return {
            "status": self.status.key,
            "message": self.numbers.shortfall,
            "metrics": metrics_json(self.numbers.raw),
            "requirements": [],
            "warnings": [{"name": item.name, "message": item.message} for item in self.warnings],
            "metrics_filtered": metrics_json(self.numbers.filtered),
            "filter": low_pass.sentence if low_pass else None,
            "window": _window_json(self.numbers.window, source.raw[0].motion_dimension),
            "cycles": len(source.raw),
            "data": source.recording.name,
            "reading": source.recording.lines,
        }


def _window_json(window: Window, dimension: str) -> dict[str, Any]:
    low, high = (float(to_border(end, dimension)) for end in (window.lo, window.hi))
    return {"from": low, "to": high, "unit": border_unit(dimension)}


def data_of(reports: Mapping[str, MeasureReport]) -> dict[str, Any]:
    """Return what metrics.json says of one specimen, or of several: their metrics by name as ``force_mean[A,load]``."""
    if len(reports) == 1:
        return next(iter(reports.values())).data
    data_by_group = {name: report.data for name, report in reports.items()}
    short = {name: data["message"] for name, data in data_by_group.items() if data["message"]}
    return {
        "status": (Status.PARTIAL if short else Status.COMPLETE).key,
        "message": "; ".join(f"{name}: {message}" for name, message in short.items()),
        "metrics": _tag_metrics(data_by_group, "metrics"),
        "requirements": [],
        "warnings": [
            {"name": item["name"], "message": f"{name}: {item['message']}"}
            for name, data in data_by_group.items()
            for item in data["warnings"]
        ],
        "metrics_filtered": _tag_metrics(data_by_group, "metrics_filtered"),
        "groups": {
            name: {key: data[key] for key in ("filter", "window", "cycles", "data", "reading")}
            for name, data in data_by_group.items()
        },
    }


def _tag_metrics(data_by_group: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, Any]:
    """Return the metrics of all specimens, each with its specimen in brackets."""
    tagged = {}
    for group, data in data_by_group.items():
        for name, value in flat_metrics(data[key]).items():
            metric, branch = split_name(name)
            tagged[f"{metric}[{','.join(part for part in (group, branch) if part)}]"] = value
    return tagged


def report_on(
    source: MeasuredCurves,
    frame: MeasuringFrame | None = None,
    window: Window | None = None,
    largest_hole: float = MAX_HOLE_SHARE,
) -> MeasureReport:
    """Return the report on a measured mechanism."""
    return MeasureReport(source, numbers_of(source, frame, window, largest_hole))


def _stack_tables(tables: Mapping[str, Table]) -> Table:
    """Return the tables of several specimens as one, the specimen first; that of one as it is."""
    if len(tables) == 1:
        return next(iter(tables.values()))
    names = list(dict.fromkeys(column.name for table in tables.values() for column in table.columns))
    columns = [TableColumn("group", tuple(name for name, table in tables.items() for _ in range(_count_rows(table))))]
    for name in names:
        values: list[Any] = []
        for part_table in tables.values():
            values_of_column = next((column.values for column in part_table.columns if column.name == name), None)
            values += [""] * _count_rows(part_table) if values_of_column is None else list(values_of_column)
        columns.append(TableColumn(name, tuple(values)))
    return Table(tuple(columns))


def _count_rows(table: Table) -> int:
    return len(table.columns[0].values)


def curves_table(source: MeasuredCurves) -> Table:
    """Return all cycles, raw and filtered, as one table in border units."""
    curves = [_add_filtered(raw, number, source) for number, raw in enumerate(source.raw)]
    table = curve_table([replace(curve, label={}) for curve in curves])
    if len(curves) == 1:
        return table
    cycle = np.repeat([number_of(curve) for curve in source.raw], [len(curve) for curve in source.raw])
    return Table((TableColumn("cycle", cycle), *table.columns))


def _add_filtered(raw: Curve, number: int, source: MeasuredCurves) -> Curve:
    if not source.filtered:
        return raw
    smooth = {f"{raw.kind}_filtered": Column(source.filtered[number].effort, raw.kind)}
    return replace(raw, extra=smooth | dict(raw.extra))


def cycles_table(report: MeasureReport) -> Table:
    """Return the raw metrics that have a value, one row per cycle."""
    cycles = report.numbers.cycle_metrics
    names = [name for name in cycles[0] if any(item[name].value is not None for item in cycles)]
    numbers = [number_of(curve) or 1 for curve in report.source.raw]
    columns = [
        border_column(
            _column_name(name), [np.nan if item[name].value is None else item[name].value for item in cycles],
            cycles[0][name].dimension,
        )
        for name in names
    ]  # fmt: skip
    return Table((TableColumn("cycle", np.array(numbers)), *columns))


def _column_name(name: str) -> str:
    """Return a metric's name for a header, where brackets hold units: ``force_mean load``."""
    metric, branch = split_name(name)
    return f"{metric} {branch}" if branch else metric


def files(
    reports: Mapping[str, MeasureReport],  # by specimen
    plots: bool = True,  # whether to draw
    form: FigureForm | None = None,  # how figures are written; default: as PNG, as they are drawn
) -> Iterator[tuple[str, bytes]]:
    """Yield every file of a measurement as (name below the folder, content)."""
    from cfmkit.tables.csv_and_json import json_bytes

    yield "curve.csv", to_csv(_stack_tables({name: curves_table(report.source) for name, report in reports.items()}))
    yield "cycles.csv", to_csv(_stack_tables({name: cycles_table(report) for name, report in reports.items()}))
    yield "metrics.json", json_bytes(data_of(reports))
    if plots:
        from cfmkit.experiment.figures import figures
        from cfmkit.plots.figure_options import DEFAULT_FORM

        for number, report in enumerate(reports.values(), 1):
            drawn = figures(report.source, report.numbers)
            yield from (form or DEFAULT_FORM).files(
                drawn if len(reports) == 1 else {f"{k}-{number}": v for k, v in drawn.items()}
            )


def comparison_data(comparison: Comparison, source: MeasuredCurves) -> dict[str, Any]:
    """Return what metrics.json says about the data besides the errors, which are metrics."""
    return {
        "data": {
            "file": source.recording.name,
            "window": _window_json(comparison.window, comparison.curve.motion_dimension),
            "points": sum(len(item.motion) for item in comparison.samples),
            "reading": source.recording.lines,
        }
    }


def comparison_lines(comparison: Comparison, source: MeasuredCurves) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs that a page shows: how the file was read, and by how much the model differs from it."""
    metrics, kind = comparison.metrics(), comparison.curve.kind
    several = len(comparison.samples) > 1
    over = span_text(comparison.window.lo, comparison.window.hi, kind).replace(" ... ", " to ")
    residuals = []
    for word, name in (("rms", "data_rmse"), ("mean", "data_offset"), ("largest", "data_error_max")):
        values = []
        for item in comparison.samples:
            value = metrics[name + (f"[{item.branch}]" if several else "")].value
            text = "no value" if value is None else format_short(value, kind)
            values.append(f"{text} {item.branch}" if several else text)
        residuals.append(f"{word} {', '.join(values)}")
    reading = reading_line(source.recording.lines)
    return (*reading, ("residual", f"{'; '.join(residuals)} (model - measured, {over})"))


def reading_line(decisions: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return the paragraph on how a file was read, and what was subtracted; empty for arrays."""
    columns = next((k for k, text in enumerate(decisions) if " = " in text), 0)
    return (("read", ", ".join((*decisions[columns:], *decisions[:columns]))),) if decisions else ()


def causes_lines(causes: Mapping[str, Quantity]) -> tuple[tuple[str, str], ...]:
    """Return the paragraph that a page shows about the causes of a departure: every number with its name."""
    reported = [
        f"{name.removeprefix('data_').replace('_', ' ')} {_text(item.value, item.dimension, 4)}"
        for name, item in causes.items()
        if item.value is not None
    ]
    return (("causes", ", ".join(reported)),) if reported else ()


def shortfall(comparison: Comparison) -> str:
    """Return why the errors have no value; "" where they have one."""
    return "".join(item.message for item in _hole_findings(comparison))


def _hole_findings(comparison: Comparison) -> tuple[Finding, ...]:
    holes = comparison.holes
    return (hole_finding(holes, comparison.window, comparison.curve.kind),) if holes else ()


def comparison_warnings(comparison: Comparison, source: MeasuredCurves) -> tuple[Finding, ...]:
    """Return what the user must know of a recording beside a model."""
    return (*source.warnings, *_hole_findings(comparison))


def comparison_files(source: MeasuredCurves) -> Mapping[str, Callable[[], bytes]]:
    """Return what makes the file of a comparison: the measured curve."""
    return {"data.csv": lambda: to_csv(curves_table(source))}


def comparison_figures(
    comparison: Comparison, name: str, before: Comparison | None = None
) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws the figure of a comparison: the curves overlaid."""
    return {"data": partial(_draw_overlay, comparison, before, name)}


def _draw_overlay(comparison: Comparison, before: Comparison | None, name: str) -> Figure:
    from cfmkit.experiment.figures import overlay

    subject = "fitted model and measurement" if before else "model and measurement"
    return overlay(comparison, before, (name, subject))


def calibration_data(calibration: Calibration) -> dict[str, Any]:
    """Return what metrics.json says about a fit."""
    fit, kind = calibration.fit, calibration.after.curve.kind
    unit = border_unit(kind)
    return {
        "parameters": table(calibration),
        "correlation": [[float(value) for value in row] for row in fit.correlation],
        "fit": {
            "noise": {"value": float(to_border(fit.noise, kind)), "unit": unit},
            "samples_that_count_as_one": float(fit.inflation),
            "degrees_of_freedom": float(fit.freedom),
            "rms_at_the_start": {"value": float(to_border(_weighted_rms(calibration.before), kind)), "unit": unit},
            "converged": fit.converged,
        },
    }


def _weighted_rms(comparison: Comparison) -> float:
    errors = np.concatenate([item.errors(comparison.curve) for item in comparison.samples])
    weight = np.concatenate([item.weight for item in comparison.samples])
    return float(np.sqrt(np.average(errors**2, weights=weight)))


def calibration_lines(calibration: Calibration, recording: Recording) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs that a page shows: each value with its interval, and how to take fitted zeros out."""
    half = calibration.fit.half_widths()
    lines = []
    for k, item in enumerate(calibration.parameters):
        value, width = float(calibration.fit.values[k]), float(half[k])
        if width > MAX_HALF_INTERVAL * item.size and not calibration.fit.at_bound[k]:
            lines.append(("fitted", f"{item.label} {UNDETERMINED_MESSAGE}"))
            continue
        low, high = max(value - width, item.low), min(value + width, item.high)
        reported = f"± {_text(width, item.dimension, 2)} (95 %)"
        if (low, high) != (value - width, value + width):
            reported = f"({_text(low, item.dimension)} to {_text(high, item.dimension)}, 95 %, within its bounds)"
        lines.append(
            (
                "fitted",
                f"{item.label} = {_text(value, item.dimension)} {reported}, from {_text(item.start, item.dimension)}",
            )
        )
    lines += _loss_lines(calibration.after)
    zeros = calibration.zeros
    if zeros.effort or zeros.motion:
        options = _options_with_zeros(recording, zeros)
        lines.append(("data", f"{options} gives the recording the zeros of the fitted model (analyze --data, measure)"))
    if zeros.drift:
        lines.append(("data", "no option subtracts the fitted drift from a recording (analyze --data, measure)"))
    return tuple(lines)


def _loss_lines(after: Comparison) -> list[tuple[str, str]]:
    """Return the paragraph for a measurement with losses beside a model without any."""
    if not after.branches:
        return []
    loss = after.loss()
    area, half = (loss[name].value for name in ("data_loss", "data_half_gap"))
    if area is None or half is None:
        return [("loss", "the model has no losses: it is fitted to the mean of the branches")]
    gap = f"{format_short(half, after.curve.kind)} to either side"
    reported = f"a measured cycle loses {format_short(area, 'energy')}, on average {gap}"
    return [("loss", f"the model has no losses: it is fitted to the mean of the branches; {reported}")]


def _options_with_zeros(recording: Recording, zeros: Zeros) -> str:
    """Return the options that replace those with which a recording was read, and take fitted zeros out as well."""
    raw, fitted = raw_zeros(recording, zeros.effort, zeros.motion), (zeros.effort, zeros.motion)
    dimensions = (recording.kind, recording.motion_dimension)
    options = [
        f'{name} "{_text(value, dimension, 6)}"'
        for name, value, more, dimension in zip(("--tare", "--zero"), raw, fitted, dimensions, strict=True)
        if value or more
    ]
    turned = [word for word, sign in zip(words_of(recording.kind), recording.signs, strict=True) if sign < 0]
    return " ".join([*options, *([f"--flip {','.join(turned)}"] if turned else [])])


def _text(value: float, dimension: str, digits: int = 5) -> str:
    return f"{value:.{digits}g}" if dimension == "ratio" else format_short(value, dimension, digits)


def parameters_table(calibration: Calibration) -> Table:
    """Return the fitted values as a table: units differ from row to row, so they have a column."""
    records = table(calibration)
    return Table(tuple(TableColumn(name, tuple(record[name] for record in records)) for name in records[0]))


def residuals_table(calibration: Calibration) -> Table:
    """Return what is left between model and measurement at every point that was fitted."""
    after, curve = calibration.after, calibration.after.curve
    branch = np.repeat([item.branch for item in after.samples], [len(item.motion) for item in after.samples])
    motion = np.concatenate([item.motion for item in after.samples])
    return Table(
        (
            TableColumn("branch", tuple(branch.tolist())),
            border_column(curve.motion_name, motion, curve.motion_dimension),
            border_column("residual", np.concatenate([item.errors(curve) for item in after.samples]), curve.kind),
        )
    )

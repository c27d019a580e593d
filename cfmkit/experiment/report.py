"""A measurement as the files that `measure` writes; nothing here touches a disk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import Column
from cfmkit.experiment.evaluation import MeasuredCurves, Measurement, numbers_of
from cfmkit.metrics import metrics_json, split_name
from cfmkit.tables import Table, TableColumn, border_column, curve_table, to_csv

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.curves import Curve
    from cfmkit.metrics import MeasuringFrame, Window
    from cfmkit.plots.figure_options import FigureForm
    from cfmkit.results import Finding


@dataclass(frozen=True)
class MeasureReport:
    """A measured mechanism with everything that is read off it.

    Attributes
    ----------
    source : MeasuredCurves
        The curves.
    numbers : Measurement
        Their metrics.
    """

    source: MeasuredCurves
    numbers: Measurement

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What the user must know of recording and window."""
        return (*self.source.warnings, *self.numbers.warnings)

    @cached_property
    def data(self) -> dict[str, Any]:
        """What metrics.json says: the contract's keys for the raw curve, the filtered one, and what was decided."""
        source, low_pass = self.source, self.source.low_pass
        return {
            "status": "complete",
            "message": "",
            "metrics": metrics_json(self.numbers.raw),
            "requirements": [],
            "warnings": [{"name": item.name, "message": item.message} for item in self.warnings],
            "metrics_filtered": metrics_json(self.numbers.filtered),
            "filter": low_pass.sentence if low_pass else None,
            "window": _ends(self),
            "cycles": len(source.raw),
            "data": source.recording.name,
            "reading": source.recording.lines,
        }


def _ends(report: MeasureReport) -> dict[str, Any]:
    from cfmkit.specs.units import border_unit, to_border

    dimension = report.source.raw[0].motion_dimension
    low, high = (float(to_border(end, dimension)) for end in (report.numbers.window.lo, report.numbers.window.hi))
    return {"from": low, "to": high, "unit": border_unit(dimension)}


def report_on(
    source: MeasuredCurves, frame: MeasuringFrame | None = None, window: Window | None = None
) -> MeasureReport:
    """Return the report on a measured mechanism."""
    return MeasureReport(source, numbers_of(source, frame, window))


def curves_table(source: MeasuredCurves) -> Table:
    """Return all cycles, raw and filtered, as one table in border units."""
    curves = [_with_filtered(raw, number, source) for number, raw in enumerate(source.raw)]
    table = curve_table([replace(curve, label={}) for curve in curves])
    if len(curves) == 1:
        return table
    cycle = np.repeat([int(curve.label["cycle"][0]) for curve in source.raw], [len(curve) for curve in source.raw])
    return Table((TableColumn("cycle", cycle), *table.columns))


def _with_filtered(raw: Curve, number: int, source: MeasuredCurves) -> Curve:
    if not source.filtered:
        return raw
    smooth = {f"{raw.kind}_filtered": Column(source.filtered[number].effort, raw.kind)}
    return replace(raw, extra=smooth | dict(raw.extra))


def cycles_table(report: MeasureReport) -> Table:
    """Return the raw metrics that have a value, one row per cycle."""
    each = report.numbers.each
    names = [name for name in each[0] if any(item[name].value is not None for item in each)]
    numbers = [int(curve.label["cycle"][0]) if curve.label else 1 for curve in report.source.raw]
    columns = [
        border_column(
            _column_name(name), [np.nan if item[name].value is None else item[name].value for item in each],
            each[0][name].dimension,
        )
        for name in names
    ]  # fmt: skip
    return Table((TableColumn("cycle", np.array(numbers)), *columns))


def _column_name(name: str) -> str:
    """Return a metric's name for a header, where brackets hold units: ``force_mean load``."""
    metric, branch = split_name(name)
    return f"{metric} {branch}" if branch else metric


def files(report: MeasureReport, plots: bool = True, form: FigureForm | None = None) -> Iterator[tuple[str, bytes]]:
    """Yield every file of a measurement as (name below the folder, content).

    Parameters
    ----------
    report : MeasureReport
        Of one recording.
    plots : bool
        Whether to draw.
    form : FigureForm, optional
        How figures are written; default: as PNG, as they are drawn.
    """
    from cfmkit.tables.json_writing import json_bytes

    yield "curve.csv", to_csv(curves_table(report.source))
    yield "cycles.csv", to_csv(cycles_table(report))
    yield "metrics.json", json_bytes(report.data)
    if plots:
        from cfmkit.experiment.figures import figures
        from cfmkit.plots.figure_options import PLAIN

        yield from (form or PLAIN).files(figures(report.source, report.numbers))

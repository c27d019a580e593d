"""From the rows of a study to its pictures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.findings import PERCENT, DrawnScale, StudyCurve, StudyMarks, short_names
from cfmkit.plots.study import figures
from cfmkit.specs.keys import keys
from cfmkit.tables import Table, TableColumn, border_values, read_csv

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.engine import Records
    from cfmkit.studies.plan import Plan, Variable
    from cfmkit.studies.study import Metric
    from cfmkit.studies.summary import Summary


def makers(records: Records, summary: Summary) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a study, by name; nothing for one that was not finished."""
    if records.finished < len(records) or not summary.usable:
        return {}
    found = findings(records, summary)
    lines, labels = curves(records, found) if len(found.varied) <= 2 else ([], ("", ""))
    return figures(found, lines, labels)


def findings(records: Records, summary: Summary) -> StudyMarks:
    """Return what the pictures show."""
    study, plan = records.work.study, records.work.plan
    values = np.concatenate([values for _, values, _ in summary.kept])
    meets = np.concatenate([meets for _, _, meets in summary.kept])
    metrics = [_drawn(study.metrics[column], values[:, k]) for k, column in enumerate(summary.shown)]
    drawn = [metric for metric in metrics if np.isfinite(metric.values).any()]
    names = short_names([item.path for item in plan.variables])
    about = {key.path: key.description for key in keys(type(study.spec))}
    varied = [
        _scale(item, shown, name, about.get(_place(item.path), ""))
        for item, shown, name in zip(plan.variables, plan.shown(0, len(plan)), names, strict=True)
    ]
    return StudyMarks(tuple(varied), tuple(drawn), _shape(plan), meets, summary.best, study.spec.name, _best(summary))


def _best(summary: Summary) -> str:
    """Return what makes the best point the best, for the key."""
    told = summary.best_by
    if told is None:
        return ""
    name, sense = told
    more = f", first of {summary.ties} as good" if summary.ties > 1 else ""
    return f"best: {sense} {name.replace('_', ' ')}{more}"


def _drawn(metric: Metric, values: FloatArray) -> DrawnScale:
    if metric.words:
        return DrawnScale(metric.name, metric.dimension, values, metric.words)
    if metric.dimension == "ratio":  # as the page says it
        return DrawnScale(metric.name, PERCENT, 100.0 * values)
    return DrawnScale(metric.name, metric.dimension, border_values(values, metric.dimension))


def _place(path: str) -> str:
    """Return a path as the list of keys has it: ``springs[].stiffness`` for ``springs.0.stiffness``."""
    return re.sub(r"\.\d+", "[]", path)


def _scale(item: Variable, shown: np.ndarray, name: str, about: str) -> DrawnScale:
    if item.dimension != "text":
        return DrawnScale(item.path, item.dimension, shown.astype(np.float64), short=name, about=about)
    words = tuple(dict.fromkeys(map(str, item.shown)))
    return DrawnScale(
        item.path, item.dimension, np.array([float(words.index(str(one))) for one in shown]), words, name, about
    )


def _shape(plan: Plan) -> tuple[int, ...]:
    return () if plan.joint else tuple(len(item.values) for item in plan.variables)


def curves(records: Records, found: StudyMarks) -> tuple[list[StudyCurve], tuple[str, str]]:
    """Return the curves that the study kept, with the labels of their axes."""
    lines: list[StudyCurve] = []
    labels = ("", "")
    for indices, rows in records.batches():
        for k, text in rows.curves.items():
            table = _nominal(read_csv(text))
            motion, effort = table.columns[1], table.columns[2]
            labels = (motion.header.replace("_", " "), effort.header.replace("_", " "))
            *panel, parameter = (float(one.values[int(indices[k])]) for one in found.varied)
            lines.append(StudyCurve(parameter, _branches(table), *panel))
    return lines, labels


def _nominal(table: Table) -> Table:
    """Return branch, motion and effort of the first curve; columns before them tell curves of one point apart."""
    labels = [column.name for column in table.columns].index("branch")
    rows = list(zip(*(column.cells() for column in table.columns[:labels]), strict=True)) or [()] * len(table)
    first = [number for number, row in enumerate(rows) if row == rows[0]]
    # the cells of a column once, not once a row: a study has thousands of these
    return Table(tuple(_taken(one, first) for one in table.columns[labels : labels + 3]))


def _taken(column: TableColumn, rows: list[int]) -> TableColumn:
    cells = column.cells()
    return TableColumn(column.name, tuple(cells[k] for k in rows), column.unit)


def _branches(table: Table) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the branches of the nominal curve, in path order."""
    branch = np.array(table.columns[0].cells())
    motion, effort = (np.array(column.cells(), dtype=np.float64) for column in table.columns[1:3])
    return {name: (motion[branch == name], effort[branch == name]) for name in dict.fromkeys(branch.tolist())}

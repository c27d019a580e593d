"""From the rows of a study, or from the files of a finished one, to its pictures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots.study import figures
from cfmkit.plots.study_data_and_marks import PERCENT_DIMENSION, DrawnScale, StudyCurve, StudyMarks, short_names
from cfmkit.results import Status
from cfmkit.specs.keys_and_schema import keys
from cfmkit.tables import Table, TableColumn, border_values, read_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.engine import Records
    from cfmkit.studies.plan import Plan
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.summary_and_tables import Summary
    from cfmkit.tables import Cell


def list_pictures(records: Records, summary: Summary) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a study, by name; nothing for one that was not finished."""
    if records.finished < len(records) or not summary.usable:
        return {}
    study_findings = study_marks(records, summary)
    lines, labels = curves(records, study_findings) if len(study_findings.varied) <= 2 else ([], ("", ""))
    return figures(study_findings, lines, labels)


def study_marks(records: Records, summary: Summary) -> StudyMarks:
    """Return what the pictures show."""
    study, plan = records.work.study, records.work.plan
    values = np.concatenate([values for _, values, _ in summary.kept])
    meets = np.concatenate([meets for _, _, meets in summary.kept])
    metrics = [_drawn_scale(study.metrics[column], values[:, k]) for k, column in enumerate(summary.shown)]
    drawn = [metric for metric in metrics if np.isfinite(metric.values).any()]
    kinds = [(item.path, item.dimension) for item in plan.variables]
    varied = scales(
        study.spec,
        kinds,
        [*plan.list_shown_values(0, len(plan))],
        [[*map(str, variable.shown)] for variable in plan.variables],
    )
    best = "" if summary.best_by is None else best_words(*summary.best_by, summary.ties)
    return StudyMarks(varied, tuple(drawn), shape_of(plan), meets, summary.best, study.spec.name, best)


def scales(
    spec: Spec,  # whose keys they are
    varied: Sequence[tuple[str, str]],  # path and dimension of each
    shown: Sequence[Any],  # their values at every point, in border units
    words: Sequence[Sequence[str]],  # of those that are not numbers: what they may be, in order
) -> tuple[DrawnScale, ...]:
    """Return what varied as it is drawn."""
    about = {key.path: key.description for key in keys(type(spec))}
    names = short_names([path for path, _ in varied])
    return tuple(
        _varied_scale(kind, values, tuple(dict.fromkeys(names_of_values)), (name, about.get(_place(kind[0]), "")))
        for kind, values, names_of_values, name in zip(varied, shown, words, names, strict=True)
    )


def best_words(name: str, sense: str, ties: int) -> str:
    """Return what makes the best point the best, for the key."""
    more = f" ({ties} tie)" if ties > 1 else ""
    return f"best: {sense} {name.replace('_', ' ')}{more}"


def _drawn_scale(metric: Metric, values: FloatArray) -> DrawnScale:
    if metric.words:
        return DrawnScale(metric.name, metric.dimension, values, metric.words)
    return measured_scale(metric.name, metric.dimension, border_values(values, metric.dimension))


def measured_scale(name: str, dimension: str, values: FloatArray) -> DrawnScale:
    """Return a metric in border units as it is drawn: shares in per cent, as the page says them."""
    if dimension == "ratio":
        return DrawnScale(name, PERCENT_DIMENSION, 100.0 * values)
    return DrawnScale(name, dimension, values)


def _place(path: str) -> str:
    """Return a path as the list of keys has it: ``springs[].stiffness`` for ``springs.0.stiffness``."""
    return re.sub(r"\.\d+", "[]", path)


def _varied_scale(kind: tuple[str, str], shown: Any, words: tuple[str, ...], reported: tuple[str, str]) -> DrawnScale:
    path, dimension = kind
    name, about = reported
    if dimension != "text":
        return DrawnScale(path, dimension, np.asarray(shown, dtype=np.float64), short=name, about=about)
    return DrawnScale(path, dimension, np.array([float(words.index(str(word))) for word in shown]), words, name, about)


def shape_of(plan: Plan) -> tuple[int, ...]:
    """Return the numbers of values of the parameters of a grid; nothing where the points are no grid."""
    return () if plan.joint else tuple(len(item.values) for item in plan.variables)


def curves(records: Records, marks: StudyMarks) -> tuple[list[StudyCurve], tuple[str, str]]:
    """Return the curves that the study kept, with the labels of their axes."""
    lines: list[StudyCurve] = []
    labels = ("", "")
    for indices, rows in records.batches():
        for k, text in rows.curves.items():
            line, labels = study_curve(read_csv(text), marks, int(indices[k]))
            lines.append(line)
    return lines, labels


def study_curve(curve: Table, marks: StudyMarks, point: int) -> tuple[StudyCurve, tuple[str, str]]:
    """Return the curve of one point of a study, with the labels of its axes."""
    table = _nominal(curve)
    motion, effort = (column.header.replace("_", " ") for column in table.columns[1:3])
    *panel, parameter = (float(parameter_marks.values[point]) for parameter_marks in marks.varied)
    return StudyCurve(parameter, _branches(table), *panel), (motion, effort)


def _nominal(table: Table) -> Table:
    """Return branch, motion and effort of the first curve; columns before them tell curves of one point apart."""
    labels = [column.name for column in table.columns].index("branch")
    rows = list(zip(*(column.cells() for column in table.columns[:labels]), strict=True)) or [()] * len(table)
    first = [number for number, row in enumerate(rows) if row == rows[0]]
    # the cells of a column once, not once a row: a study has thousands of these
    return Table(tuple(_take_rows(column, first) for column in table.columns[labels : labels + 3]))


def _take_rows(column: TableColumn, rows: list[int]) -> TableColumn:
    cells = column.cells()
    return TableColumn(column.name, tuple(cells[k] for k in rows), column.unit)


def _branches(table: Table) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the branches of the nominal curve, in path order."""
    branch = np.array(table.columns[0].cells())
    motion, effort = (np.array(column.cells(), dtype=np.float64) for column in table.columns[1:3])
    return {name: (motion[branch == name], effort[branch == name]) for name in dict.fromkeys(branch.tolist())}


def list_pictures_of_tables(
    spec: Spec,  # what was swept
    summary: Mapping[str, Any],  # as metrics.json
    # table, curves: as results.csv and curves.csv, which not every sweep has
    table: Table,
    curves: Table | None,
) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a sweep, by name."""
    marks = _marks(spec, summary, table)
    lines, labels = _curves(curves, marks)
    return figures(marks, lines, labels)


def _marks(spec: Spec, summary: Mapping[str, Any], table: Table) -> StudyMarks:
    """Return what the pictures show."""
    drawn = summary["drawn"]
    columns = {column.name: column for column in table.columns}
    varied = [(parameter["path"], parameter["dimension"]) for parameter in drawn["varied"]]
    shown = [columns[path].cells() for path, _ in varied]
    metrics = [_metric_scale(metric, columns[metric["column"]]) for metric in drawn["metrics"]]
    best = summary["best"]
    return StudyMarks(
        scales(spec, varied, shown, [parameter["words"] for parameter in drawn["varied"]]),
        tuple(metric for metric in metrics if np.isfinite(metric.values).any()),
        tuple(drawn["grid"]),
        _find_meeting(columns),
        None if best is None else best["point"] - 1,
        spec.name,
        "" if best is None else best_words(best["by"], best["sense"], best["ties"]),
    )


def _metric_scale(reported: Mapping[str, Any], column: TableColumn) -> DrawnScale:
    cells = column.cells()
    if not reported["words"]:
        return measured_scale(reported["name"], reported["dimension"], _to_numbers(cells))
    words = tuple(reported["words"])
    places = [np.nan if cell is None else float(words.index(str(cell))) for cell in cells]
    return DrawnScale(reported["name"], reported["dimension"], np.array(places), words)


def _to_numbers(cells: Sequence[Cell]) -> FloatArray:
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)


def _find_meeting(columns: Mapping[str, TableColumn]) -> NDArray[np.bool_]:
    """Return whether each point was solved and meets every requirement."""
    usable = {status.key for status in Status if status.usable}
    solved = [cell in usable for cell in columns["status"].cells()]
    met = columns["requirements_met"].cells() if "requirements_met" in columns else ["true"] * len(solved)
    return np.array([good and answer == "true" for good, answer in zip(solved, met, strict=True)], dtype=bool)


def _curves(table: Table | None, marks: StudyMarks) -> tuple[list[StudyCurve], tuple[str, str]]:
    """Return the curves in a table; none where there is none, or where more than two values vary."""
    lines: list[StudyCurve] = []
    labels = ("", "")
    if len(marks.varied) > 2 or table is None:
        return lines, labels
    parameter_columns = [
        next(column for column in table.columns if column.name == parameter_marks.name)
        for parameter_marks in marks.varied
    ]
    points = {values: at for at, values in enumerate(zip(*map(_cells_of_scale, marks.varied), strict=True))}
    rows: dict[int, list[int]] = {}
    for row, values in enumerate(zip(*(column.cells() for column in parameter_columns), strict=True)):
        rows.setdefault(points[values], []).append(row)
    for point, chosen in sorted(rows.items()):
        curve = Table(
            tuple(
                TableColumn(
                    column.name,
                    column.values[chosen]
                    if isinstance(column.values, np.ndarray)
                    else tuple(column.values[row] for row in chosen),
                    column.unit,
                )
                for column in table.columns
            )
        )
        line, labels = study_curve(curve, marks, point)
        lines.append(line)
    return lines, labels


def _cells_of_scale(scale: DrawnScale) -> list[Cell]:
    """Return the values of a scale as the cells of a table have them."""
    return [scale.words[int(value)] for value in scale.values] if scale.words else [*scale.values.tolist()]

"""The pictures of a finished sweep, from the files in its folder: no point is computed again."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import UsageError, visible
from cfmkit.plots.study import figures
from cfmkit.plots.study_data import DrawnScale, StudyMarks
from cfmkit.results import Status
from cfmkit.studies.pictures import best_words, measured_scale, scales, study_curve
from cfmkit.tables import Table, TableColumn, read_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.plots.study_data import StudyCurve
    from cfmkit.specs.spec import Spec
    from cfmkit.tables import Cell


def makers_of(folder: Path, spec: Spec) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a sweep, by name; its curves where curves.csv has them.

    Parameters
    ----------
    folder : Path
        Output folder of a sweep.
    spec : Spec
        What was swept.

    Raises
    ------
    cfmkit.errors.CfmError
        If a file is missing or is not as it was written.
    """
    try:
        summary = json.loads((folder / "metrics.json").read_bytes())
        curves = folder / "curves.csv"
        known = read_csv(curves) if curves.is_file() else None
        table = read_csv(folder / "results.csv")
        found = _marks(spec, summary, table)
        makers = makers_of_tables(spec, summary, table, known)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise UsageError(f"the sweep in {visible(str(folder))} cannot be drawn from its files: run it again") from None
    if len(table) < int(summary["points"]["total"]) or not np.isfinite([one.values for one in found.varied]).all():
        raise UsageError(f"the sweep in {visible(str(folder))} was not finished: run the same command again")
    return makers


def makers_of_tables(
    spec: Spec, summary: Mapping[str, Any], table: Table, curves: Table | None
) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a sweep, by name.

    Parameters
    ----------
    spec : Spec
        What was swept.
    summary : mapping
        As metrics.json.
    table, curves : Table
        As results.csv and curves.csv, which not every sweep has.
    """
    found = _marks(spec, summary, table)
    lines, labels = _curves(curves, found)
    return figures(found, lines, labels)


def _marks(spec: Spec, summary: Mapping[str, Any], table: Table) -> StudyMarks:
    """Return what the pictures show."""
    drawn = summary["drawn"]
    columns = {column.name: column for column in table.columns}
    varied = [(one["path"], one["dimension"]) for one in drawn["varied"]]
    shown = [columns[path].cells() for path, _ in varied]
    metrics = [_metric(one, columns[one["column"]]) for one in drawn["metrics"]]
    best = summary["best"]
    return StudyMarks(
        scales(spec, varied, shown, [one["words"] for one in drawn["varied"]]),
        tuple(one for one in metrics if np.isfinite(one.values).any()),
        tuple(drawn["grid"]),
        _meets(columns),
        None if best is None else best["point"] - 1,
        spec.name,
        "" if best is None else best_words(best["by"], best["sense"], best["ties"]),
    )


def _metric(told: Mapping[str, Any], column: TableColumn) -> DrawnScale:
    cells = column.cells()
    if not told["words"]:
        return measured_scale(told["name"], told["dimension"], _numbers(cells))
    words = tuple(told["words"])
    places = [np.nan if cell is None else float(words.index(str(cell))) for cell in cells]
    return DrawnScale(told["name"], told["dimension"], np.array(places), words)


def _numbers(cells: Sequence[Cell]) -> FloatArray:
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)


def _meets(columns: Mapping[str, TableColumn]) -> NDArray[np.bool_]:
    """Return whether each point was solved and meets every requirement."""
    usable = {status.key for status in Status if status.usable}
    solved = [cell in usable for cell in columns["status"].cells()]
    met = columns["requirements_met"].cells() if "requirements_met" in columns else ["true"] * len(solved)
    return np.array([good and one == "true" for good, one in zip(solved, met, strict=True)], dtype=bool)


def _curves(table: Table | None, found: StudyMarks) -> tuple[list[StudyCurve], tuple[str, str]]:
    """Return the curves in a table; none where there is none, or where more than two values vary."""
    lines: list[StudyCurve] = []
    labels = ("", "")
    if len(found.varied) > 2 or table is None:
        return lines, labels
    own = [next(column for column in table.columns if column.name == one.name) for one in found.varied]
    points = {values: at for at, values in enumerate(zip(*map(_spoken, found.varied), strict=True))}
    rows: dict[int, list[int]] = {}
    for row, values in enumerate(zip(*(column.cells() for column in own), strict=True)):
        rows.setdefault(points[values], []).append(row)
    for point, chosen in sorted(rows.items()):
        curve = Table(
            tuple(
                TableColumn(
                    one.name,
                    one.values[chosen]
                    if isinstance(one.values, np.ndarray)
                    else tuple(one.values[row] for row in chosen),
                    one.unit,
                )
                for one in table.columns
            )
        )
        line, labels = study_curve(curve, found, point)
        lines.append(line)
    return lines, labels


def _spoken(scale: DrawnScale) -> list[Cell]:
    """Return the values of a scale as the cells of a table have them."""
    return [scale.words[int(value)] for value in scale.values] if scale.words else [*scale.values.tolist()]

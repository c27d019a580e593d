"""Rows of a study as tables: results.csv and curves.csv, written piece by piece in the order of the points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.specs.units import border_unit
from cfmkit.studies.row_blocks_for_journal import WARNINGS_JOINT
from cfmkit.tables import Table, TableColumn, border_column, csv_chunks, read_csv, text_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.engine import Records
    from cfmkit.studies.plan import Plan, Variable
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.row_blocks_for_journal import ResultRows

    Watch = Callable[[NDArray[np.int64], ResultRows], None]


def results_csv(
    records: Records,  # finished rows; others are left out
    watch: Watch | None = None,  # is shown every piece, (indices, rows), on the way
) -> Iterator[bytes]:
    """Yield results.csv: what varies, the metrics, whether the requirements are met, status, warnings, message."""
    first = True
    for indices, rows in records.batches():
        if watch is not None:
            watch(indices, rows)
        yield from _pieces(results_table(records, indices, rows), first)
        first = False
    if first:
        yield from _pieces(results_table(records, np.arange(0), records.work.gather()), first)


def results_table(records: Records, indices: NDArray[np.int64], rows: ResultRows) -> Table:
    """Return some rows as a table in border units."""
    study = records.work.study
    metrics = (_noted_column(one, rows.values[:, k]) for k, one in enumerate(study.metrics))
    met = [TableColumn("requirements_met", _met_words(rows))] if study.spec.part_requirements else []
    reported = [rows.status(k) for k in range(len(rows))] if rows.odd else None
    status = tuple(one.key for one, _ in reported) if reported else ("complete",) * len(rows)
    message = tuple(text or None for _, text in reported) if reported else (None,) * len(rows)
    ends = TableColumn("status", status), TableColumn("warnings", _warnings(rows)), text_column("message", message)
    return Table((*varied_columns(records.work.plan, indices), *metrics, *met, *ends))


def _noted_column(one: Metric, values: FloatArray) -> TableColumn:
    """Return a metric as a column: numbers in the border unit, or words."""
    if not one.words:
        return border_column(one.label, values, one.dimension)
    words = np.array([*one.words, None], dtype=object)
    return TableColumn(one.label, tuple(words[np.where(np.isfinite(values), values, -1).astype(int)].tolist()))


def varied_columns(plan: Plan, indices: NDArray[np.int64]) -> Iterator[TableColumn]:
    """Yield the columns of what varies, in border units."""
    if not len(indices):
        yield from (_column(item, ()) for item in plan.variables)
        return
    start, stop = int(indices[0]), int(indices[-1]) + 1
    for item, shown in zip(plan.variables, plan.list_shown_values(start, stop), strict=True):
        yield _column(item, shown if len(indices) == stop - start else shown[indices - start])


def _column(item: Variable, shown: Any) -> TableColumn:
    if item.dimension in ("text", "count"):
        return TableColumn(item.path, shown)
    return TableColumn(item.path, shown, border_unit(item.dimension))


def _met_words(rows: ResultRows) -> tuple[str | None, ...]:
    """Return ``true`` or ``false`` for each row; nothing where nothing was solved."""
    words = np.where(rows.met.all(axis=1), "true", "false").tolist()
    unsolved = {k for k, (status, _) in rows.odd.items() if not status.usable}
    return tuple(None if k in unsolved else word for k, word in enumerate(words)) if unsolved else tuple(words)


def _warnings(rows: ResultRows) -> tuple[str | None, ...]:
    """Return the names of the warnings of each row: ``high_pressure_angle; undercut``."""
    combined = np.zeros(len(rows), dtype=np.int64)
    names = sorted(rows.warned)
    for k, name in enumerate(names):
        combined |= rows.warned[name].astype(np.int64) << k
    found, place = np.unique(combined, return_inverse=True)
    texts = [WARNINGS_JOINT.join(name for k, name in enumerate(names) if code >> k & 1) or None for code in found]
    return tuple(texts[at] for at in place.tolist())


def _pieces(table: Table, first: bool) -> Iterator[bytes]:
    """Yield the CSV of a table, its header only for the first one of a file."""
    pieces = csv_chunks(table)
    header = next(pieces)
    if first:
        yield header
    yield from pieces


def curves_csv(records: Records) -> Iterator[bytes]:
    """Yield curves.csv: the curves of all points below each other, the varied values leading."""
    headers = _headers(records)
    first = True
    for indices, rows in records.batches(1):
        for k, text in rows.curves.items():
            table = _with_values(records.work.plan, int(indices[k]), read_csv(text), headers)
            yield from _pieces(table, first)
            first = False
    if first:
        yield from _pieces(Table(tuple(varied_columns(records.work.plan, np.arange(0)))), first)


def _headers(records: Records) -> tuple[str, ...]:
    """Return every header that occurs in a curve, in order."""
    found: dict[str, None] = {}
    seen: set[bytes] = set()
    for _, rows in records.batches(1):
        for text in rows.curves.values():
            line = text[: text.index(b"\n") + 1]
            if line not in seen:
                seen.add(line)
                found |= dict.fromkeys(read_csv(line).headers)
    return tuple(found)


def _with_values(plan: Plan, index: int, curve: Table, headers: tuple[str, ...]) -> Table:
    """Return the curve of one point with the point's values in front and every column of the file."""
    count = len(curve)
    leading = (
        TableColumn(one.name, tuple(one.cells()) * count, one.unit) for one in varied_columns(plan, np.array([index]))
    )
    own = {column.header: column for column in curve.columns}
    return Table((*leading, *(own.get(header) or _empty(header, count) for header in headers)))


def _empty(header: str, count: int) -> TableColumn:
    name, bracket, unit = header.partition(" [")
    return TableColumn(name, (None,) * count, unit.removesuffix("]") if bracket else None)

"""Outcome of a study: a summary in one record, and results.csv and curves.csv, written piece by piece.

The record says how many points ended how, the best of them, requirements, extremes. The best point is the one with the
best value of one metric, among those that meet every requirement, else among all that were solved. The metric is that
of the first requirement, over its window where the study notes it there, and better means farther inside its bound, or
from the nearer of two; without requirements it is the ripple of the force or torque, and smaller is better.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import ExitCode
from cfmkit.metrics import other_name
from cfmkit.metrics.requirements import Bounds
from cfmkit.results import WINDOW_OUTSIDE, Status
from cfmkit.specs.units import border_unit, to_border
from cfmkit.studies.row_blocks_for_journal import WARNINGS_JOINT
from cfmkit.studies.serial_and_cluster_executors import Lost
from cfmkit.studies.variations import write_value
from cfmkit.tables import Table, TableColumn, border_column, csv_chunks, read_csv, text_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.engine import Records
    from cfmkit.studies.plan import Plan, Variable
    from cfmkit.studies.point_evaluation import Metric, Study
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
        nothing = records.work.fail(0, Lost(Status.COMPLETE, ""))
        yield from _pieces(results_table(records, np.arange(0), nothing), first)


def results_table(records: Records, indices: NDArray[np.int64], rows: ResultRows) -> Table:
    """Return some rows as a table in border units."""
    study = records.work.study
    metrics = (_noted_column(metric, rows.values[:, k]) for k, metric in enumerate(study.metrics))
    met = [TableColumn("requirements_met", _met_words(rows))] if study.spec.part_requirements else []
    reported = [rows.status(k) for k in range(len(rows))] if rows.odd else None
    status = tuple(reported_row.key for reported_row, _ in reported) if reported else ("complete",) * len(rows)
    message = tuple(text or None for _, text in reported) if reported else (None,) * len(rows)
    ends = TableColumn("status", status), TableColumn("warnings", _warnings(rows)), text_column("message", message)
    return Table((*varied_columns(records.work.plan, indices), *metrics, *met, *ends))


def _noted_column(metric: Metric, values: FloatArray) -> TableColumn:
    """Return a metric as a column: numbers in the border unit, or words."""
    if not metric.words:
        return border_column(metric.label, values, metric.dimension)
    words = np.array([*metric.words, None], dtype=object)
    return TableColumn(metric.label, tuple(words[np.where(np.isfinite(values), values, -1).astype(int)].tolist()))


def varied_columns(plan: Plan, indices: NDArray[np.int64]) -> Iterator[TableColumn]:
    """Yield the columns of what varies, in border units."""
    if not len(indices):
        yield from (_varied_column(item, ()) for item in plan.variables)
        return
    start, stop = int(indices[0]), int(indices[-1]) + 1
    for item, shown in zip(plan.variables, plan.list_shown_values(start, stop), strict=True):
        yield _varied_column(item, shown if len(indices) == stop - start else shown[indices - start])


def _varied_column(item: Variable, shown: Any) -> TableColumn:
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
    codes, place = np.unique(combined, return_inverse=True)
    texts = [WARNINGS_JOINT.join(name for k, name in enumerate(names) if code >> k & 1) or None for code in codes]
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
    headers: dict[str, None] = {}
    seen: set[bytes] = set()
    for _, rows in records.batches(1):
        for text in rows.curves.values():
            line = text[: text.index(b"\n") + 1]
            if line not in seen:
                seen.add(line)
                headers |= dict.fromkeys(read_csv(line).headers)
    return tuple(headers)


def _with_values(plan: Plan, index: int, curve: Table, headers: tuple[str, ...]) -> Table:
    """Return the curve of one point with the point's values in front and every column of the file."""
    count = len(curve)
    leading = (
        TableColumn(variable.name, tuple(variable.cells()) * count, variable.unit)
        for variable in varied_columns(plan, np.array([index]))
    )
    columns = {column.header: column for column in curve.columns}
    return Table((*leading, *(columns.get(header) or _empty_column(header, count) for header in headers)))


def _empty_column(header: str, count: int) -> TableColumn:
    name, bracket, unit = header.partition(" [")
    return TableColumn(name, (None,) * count, unit.removesuffix("]") if bracket else None)


DEFAULT_OBJECTIVES = ("force_ripple", "torque_ripple")
MOST_SHOWN = 4  # metrics that are drawn
TIE_RTOL = 1e-9  # points whose values differ by less than this, relative to the value, count as equally good


@dataclass(frozen=True)
class Objective:
    """Order of points from best to worst: the column of a metric, and which of its values are better."""

    column: int  # of the study
    largest: bool  # whether more is better
    middle: float | None = None  # of two bounds [SI]: the nearer, the better, whatever `largest` says

    @property
    def sense(self) -> str:
        """Which value of the metric is the best, in words before its name."""
        return "most central" if self.middle is not None else "largest" if self.largest else "smallest"

    def scores(self, values: FloatArray) -> FloatArray:
        """Return numbers that are smaller for better values of the metric."""
        if self.middle is not None:
            return np.abs(values - self.middle)
        return values * (-1.0 if self.largest else 1.0)

    def slack(self, score: float) -> float:
        """Return by how much scores may differ that count as equally good."""
        return TIE_RTOL * max(abs(score), abs(self.middle or 0.0))


def objective(study: Study) -> Objective | None:
    """Return by what the best point is chosen; None if the study notes nothing of the kind."""
    for requirement in study.spec.part_requirements:
        names = requirement.metric, other_name(requirement.metric)
        noted = [column for column, item in enumerate(study.metrics) if item.name in names]
        # over another window is the next best that is known: points that meet the requirement come first anyway
        best = min(
            noted,
            key=lambda column: (
                study.metrics[column].over != requirement.over,
                study.metrics[column].name != requirement.metric,
            ),
            default=None,
        )
        if best is not None:
            limits = Bounds.from_requirement(requirement, study.metrics[best].dimension)
            middle = None if limits.min is None or limits.max is None else 0.5 * (limits.min + limits.max)
            return Objective(best, requirement.max is None, middle)
    for name in DEFAULT_OBJECTIVES:
        if name in study.names:
            return Objective(study.names.index(name), False)
    return None


def main_columns(study: Study, headline: tuple[str, ...]) -> tuple[int, ...]:
    """Return the columns that are looked at first: the objective, the requirements, the family's headline."""
    required = [
        name
        for requirement in study.spec.part_requirements
        for name in (requirement.metric, other_name(requirement.metric))
    ]
    wanted = [*required, *DEFAULT_OBJECTIVES, *headline, *study.names]
    chosen = objective(study)
    first = [] if chosen is None else [chosen.column]
    columns = dict.fromkeys([*first, *(study.names.index(name) for name in wanted if name in study.names)])
    return tuple(columns)[:MOST_SHOWN]


@dataclass
class Summary:
    """Sums up rows as they pass by."""

    study: Study  # whose rows they are
    shown: tuple[int, ...] = ()  # columns whose values are kept for pictures
    counts: Counter[Status] = field(default_factory=Counter)  # points by status
    met: NDArray[np.int64] = field(init=False)  # (r,) how many points meet each requirement
    all_met: int = 0  # how many solved ones meet them all
    # gapped, first_gap: complete points without a value over some window, and what the first of them says
    gapped: int = 0
    first_gap: str = ""
    # best, best_values, best_meets: the best point so far, its metrics, and whether it meets every requirement
    best: int | None = None
    # points that are as good as the best, it included: to 1e-9 of its value, which is what rounding leaves
    ties: int = 0
    best_values: FloatArray | None = None
    best_meets: bool = False
    # of each block of rows for pictures: their indices, their values in the columns `shown`, and whether they meet
    # every requirement
    kept: list[tuple[NDArray[np.int64], FloatArray, NDArray[np.bool_]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.met = np.zeros(len(self.study.spec.part_requirements), dtype=np.int64)
        columns = len(self.study.metrics)
        self._low, self._high = np.full(columns, np.inf), np.full(columns, -np.inf)
        self._goal = objective(self.study)

    def add(self, indices: NDArray[np.int64], rows: ResultRows) -> None:
        """Take some rows."""
        self.counts[Status.COMPLETE] += len(rows) - len(rows.odd)
        self.counts.update(status for status, _ in rows.odd.values())
        self.met += rows.met.sum(axis=0)
        gaps = [(k, text) for k, (status, text) in rows.odd.items() if status is Status.COMPLETE]
        if gaps and not self.gapped:
            self.first_gap = f"point {int(indices[gaps[0][0]]) + 1}: {gaps[0][1]}"
        self.gapped += len(gaps)
        usable = np.ones(len(rows), dtype=bool)
        usable[[k for k, (status, _) in rows.odd.items() if not status.usable]] = False
        meets = usable & rows.met.all(axis=1)
        self.all_met += int(meets.sum())
        self._low = np.fmin(self._low, np.fmin.reduce(rows.values, axis=0, initial=np.inf))
        self._high = np.fmax(self._high, np.fmax.reduce(rows.values, axis=0, initial=-np.inf))
        self._look_for_the_best(indices, rows, meets)
        if self.shown:
            self.kept.append((indices, rows.values[:, list(self.shown)], meets))

    def _look_for_the_best(self, indices: NDArray[np.int64], rows: ResultRows, meets: NDArray[np.bool_]) -> None:
        if self._goal is None:
            return
        score = self._goal.scores(rows.values[:, self._goal.column])
        for group, meeting in ((meets, True), (~meets, False)):
            inside = np.where(group, score, np.nan)
            if np.isnan(inside).all() or (self.best_meets and not meeting):
                continue
            least = float(np.nanmin(inside))
            as_good = np.flatnonzero(np.abs(inside - least) <= self._goal.slack(least))
            before = self._best_score()
            same = (
                self.best is not None and self.best_meets == meeting and abs(least - before) <= self._goal.slack(before)
            )
            # of points that only rounding tells apart the first is the best
            if self.best is None or meeting > self.best_meets or (least < before and not same):
                self.best, self.best_meets = int(indices[as_good[0]]), meeting
                self.best_values = rows.values[as_good[0]].copy()
                self.ties = 0
            score_now = self._best_score()
            self.ties += int((np.abs(inside - score_now) <= self._goal.slack(score_now)).sum())

    @property
    def best_by(self) -> tuple[str, str] | None:
        """Name of the metric that the best point is chosen by, and which of its values is the best."""
        if self._goal is None or self.best is None:
            return None
        return self.study.names[self._goal.column], self._goal.sense

    def _best_score(self) -> float:
        if self._goal is None or self.best_values is None:
            return np.inf
        return float(self._goal.scores(self.best_values)[self._goal.column])

    @property
    def total(self) -> int:
        """Number of rows seen."""
        return sum(self.counts.values())

    @property
    def usable(self) -> int:
        """Number of points that were solved, wholly or in part."""
        return sum(count for status, count in self.counts.items() if status.usable)

    def exit_code(self) -> ExitCode:
        """Return the exit code of the process.

        0 if every point is complete; 6 if some are not; with none that was solved 70 if all of them hit a bug or lost
        their processes, 3 if all are invalid, 6 if one ran out of time and may have a solution,
        else 4; 5 if all is well but the requirements, which no point meets together.
        """
        if not self.usable:
            if self.total and self.counts[Status.CRASHED] == self.total:
                return ExitCode.BUG
            if self.counts[Status.TIMEOUT]:
                return ExitCode.PARTIAL
            invalid = self.counts[Status.INVALID] == self.total
            return ExitCode.INVALID if invalid else ExitCode.NO_SOLUTION
        if self.counts[Status.COMPLETE] < self.total:
            return ExitCode.PARTIAL
        return ExitCode.REQUIREMENT_MISSED if len(self.met) and not self.all_met else ExitCode.OK

    @property
    def message(self) -> str:
        """Number of points of each status, in one line."""
        ends = ", ".join(f"{count} {status.key.replace('_', ' ')}" for status, count in self._list_counts() if count)
        return f"{self.total} points: {ends}" if self.total else "no point was finished"

    def _list_counts(self) -> list[tuple[Status, int]]:
        return [(status, self.counts[status]) for status in Status]

    def as_json(self, records: Records) -> dict[str, Any]:
        """Return what metrics.json says of a study: the metrics are those of the best point."""
        counts = {"total": self.total, **{status.key: count for status, count in self._list_counts() if count}}
        best = self._describe_best(records)
        return {
            "status": _status_of_study(self),
            "message": self.message,
            "points": counts,
            "best": best,
            "metrics": {} if best is None else self._metrics(),
            "range": self._range(),
            "requirements": self._requirements(),
            "warnings": self._warnings(),
        }

    def _describe_best(self, records: Records) -> dict[str, Any] | None:
        if self.best is None or self._goal is None:
            return None
        plan = records.work.plan
        values = zip(plan.variables, plan.point(self.best), strict=True)
        return {
            "point": self.best + 1,
            "values": {item.path: write_value(value, item.dimension) for item, value in values},
            "by": self.study.names[self._goal.column],
            "sense": self._goal.sense,
            "ties": self.ties,
            "requirements_met": self.best_meets if len(self.met) else None,
        }

    def _metrics(self) -> dict[str, Any]:
        values = [] if self.best_values is None else self.best_values.tolist()
        return {
            metric.name: {
                "value": self.study.format_metric(k, value),
                "unit": border_unit(metric.dimension),
                "definition": metric.definition,
            }
            for k, (metric, value) in enumerate(zip(self.study.metrics, values, strict=False))
        }

    def _range(self) -> dict[str, Any]:
        """Return the smallest and largest value of each metric over all points; words have none."""
        values_by_name = {}
        for k, metric in enumerate(self.study.metrics):
            low, high = float(self._low[k]), float(self._high[k])
            if low <= high and not metric.words:
                ends = {"min": float(to_border(low, metric.dimension)), "max": float(to_border(high, metric.dimension))}
                values_by_name[metric.name] = ends | {"unit": border_unit(metric.dimension)}
        return values_by_name

    def _warnings(self) -> list[dict[str, str]]:
        if not self.gapped:
            return []
        reported = f"{self.gapped} of {self.total} points have no value over a window that their curve does not cover"
        cure = "state windows as shares of the travel, which follow the curve: [1 %, 100 %]"
        return [{"name": WINDOW_OUTSIDE, "message": f"{reported} ({self.first_gap}); {cure}"}]

    def _requirements(self) -> list[dict[str, Any]]:
        listed = zip(self.study.spec.part_requirements, self.met.tolist(), strict=True)
        return [
            {
                "metric": warning.metric,
                "min": warning.min,
                "max": warning.max,
                "met": count,
                "of": self.usable,
                "ok": count > 0,
            }
            for warning, count in listed
        ]


def _status_of_study(summary: Summary) -> str:
    if not summary.usable:
        return "no_result"
    return "complete" if summary.counts[Status.COMPLETE] == summary.total else "partial"

"""Points of a study as rows: what is noted of variants that a family solves together, or of one by itself.

Whatever goes wrong at a point becomes a row with a status and without values: an invalid value, a mechanism that
cannot exist, a design that fails, a solver that gives up. An exception that cfmkit does not raise on purpose is a bug;
it costs its own point only (status ``crashed``), and the row keeps the traceback.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.families.rows import Variants
from cfmkit.families.variant_rows import SingleRow, analyze_alone, count_together, solve_variants
from cfmkit.metrics import CycleRows, Window, metric_of_rows, split_name
from cfmkit.metrics.branches import WINDOW_RTOL
from cfmkit.metrics.metric_definitions import time_of
from cfmkit.metrics.metric_values import find_uncovered, worst_branch
from cfmkit.metrics.requirements import Bounds
from cfmkit.results import WINDOW_OUTSIDE, Status
from cfmkit.specs.units import TravelShare, window_places
from cfmkit.studies.row_blocks_for_journal import ResultRows, failed_rows, scatter_rows, select_rows
from cfmkit.studies.serial_and_cluster_executors import lose_to_bug
from cfmkit.tables import curve_table, to_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.variant_rows import Rows
    from cfmkit.metrics import Definition
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.units import Ends
    from cfmkit.studies.plan import Plan
    from cfmkit.studies.point_evaluation import Study

    ByBranch = Mapping[str, FloatArray]
    Places = tuple[FloatArray, FloatArray]


BLOCK_SIZE = 4096  # points that are evaluated and noted together
_OF_WINDOWS = ("analysis.window", "requirements")  # where specifications state windows
_STATUS_OF_EXIT_CODE = {3: Status.INVALID, 4: Status.NO_EQUILIBRIUM, 70: Status.CRASHED}


class SolvedVariants:
    """Columns of a study for variants that are solved together, or for one by itself.

    Parameters
    ----------
    study : Study
        What is noted.
    variants : Variants
        Those that the rows are some of.
    rows : (m,) array of int
        Which of them.
    solved : SolvedRows or SingleRow
        Their solutions.
    """

    def __init__(self, study: Study, variants: Variants, rows: NDArray[np.intp], solved: Rows) -> None:
        """Read nothing yet."""
        self.study, self.variants, self.members, self.solved = study, variants, rows, solved
        self.result = solved.result if isinstance(solved, SingleRow) else None
        self.faults: dict[int, CfmError] = {}  # what is wrong with windows, by row
        self._values: dict[tuple[str, Ends | None, bool], ByBranch] = {}
        self._cycles: dict[tuple[Ends | None, bool], CycleRows] = {}

    def __len__(self) -> int:
        """Return the number of variants."""
        return len(self.members)

    @cached_property
    def specs(self) -> list[Spec]:
        """The specification of each, or the one that has the windows of all."""
        if self.result is not None:
            return [self.result.spec]
        if not any(path.startswith(_OF_WINDOWS) for path in self.variants.values):
            return [self.study.plain]
        return [self.variants[row] for row in self.members.tolist()]

    @cached_property
    def _travels(self) -> Places:
        """Start and end of the motion of each, (m,)."""
        curves = next(iter(self.solved.branches.values()))
        return curves.travel or curves.extent

    @cached_property
    def _common(self) -> Places:
        """Ends of the motion that all branches of each cover, (m,)."""
        extents = [curves.extent for curves in self.solved.branches.values()]
        return np.max([low for low, _ in extents], axis=0), np.min([high for _, high in extents], axis=0)

    def _places(self, ends: Sequence[Ends | None]) -> Places | None:
        """Return windows of the variants in places, (m,) each; None for the full travel."""
        if all(end is None for end in ends):
            return None
        start, stop = self._travels
        if len(ends) == 1 and ends[0] is not None and (first := _window_places(ends[0], start, stop)) is not None:
            return first
        every = list(ends) if len(ends) == len(self) else list(ends) * len(self)
        places = np.full((len(self), 2), np.nan)
        for row, window in enumerate(every):
            try:
                if window is not None:
                    places[row] = window_places(window, (float(start[row]), float(stop[row])))
            except CfmError as error:
                self.faults[row] = error
        return places[:, 0], places[:, 1]

    def _window(self, over: Ends | None, left: bool) -> Places | None:
        """Return the window of a metric: its own, else that of the analysis.

        `left`: what is left of it where the curve of a partial result ends inside it.
        """
        windows = [getattr(getattr(spec, "analysis", None), "window", None) for spec in self.specs]
        window = self._places(windows if over is None else [over])
        if window is None or not left:
            return window
        low, high = np.maximum(window[0], self._common[0]), np.minimum(window[1], self._common[1])
        return (low, high) if low[0] < high[0] else window

    def values(self, name: str, over: Ends | None, left: bool = True) -> ByBranch:
        """Return a metric or a value of the family by branch, (m,) each; of the branch that is named alone.

        What is no matter of one branch stands under the name "".
        """
        left = left and self.result is not None and self.result.status is Status.PARTIAL  # of others it is the same
        if (name, over, left) not in self._values:
            self._values[name, over, left] = self._compute(name, over, left)
        return self._values[name, over, left]

    def _compute(self, name: str, over: Ends | None, left: bool) -> ByBranch:
        plain, bracket = split_name(name)
        definition = self._definitions[plain]
        values = self.solved.value(name)
        if values is None and (bracket is None or definition.scope == "value"):
            values = self.solved.value(plain)
        if values is not None:
            return {"": values}
        if (over, left) not in self._cycles:
            self._cycles[over, left] = CycleRows.from_curves(self.solved.branches, self._window(over, left))
        cycle = self._cycles[over, left]
        if bracket is None:
            return metric_of_rows(definition, cycle)
        if definition.argument:
            return metric_of_rows(definition, cycle, time_of(bracket))
        chosen = {branch: rows for branch, rows in cycle.branches.items() if branch == bracket}
        return metric_of_rows(definition, CycleRows(chosen))

    @property
    def _asked(self) -> tuple[tuple[str, Ends | None], ...]:
        """Name and window of everything that is read: the metrics, then the requirements."""
        metrics = [(metric.name, metric.over) for metric in self.study.metrics]
        return (
            *metrics,
            *((requirement.metric, requirement.over) for requirement in self.study.spec.part_requirements),
        )

    @property
    def known(self) -> bool:
        """True if rows have every column of the study."""
        if isinstance(self.solved, SingleRow):
            return True
        names, quantities = {split_name(name)[0] for name, _ in self._asked}, self.solved.quantities
        return all(name in quantities or self._definitions[name].is_known_in_rows for name in names)

    @cached_property
    def _definitions(self) -> Mapping[str, Definition]:
        return self.study.definitions(next(iter(self.solved.branches.values())).kind)

    def rows(self) -> ResultRows:
        """Return what the study notes of the variants.

        Raises CfmError if a requirement is not well put for such curves.
        """
        shape = len(self), len(self.study.metrics), len(self.study.spec.part_requirements)
        result = self.result
        if result is not None and not result.status.usable:
            return failed_rows(shape, result.status, result.message, warned=self._findings())
        self.study.check_requirements(next(iter(self.solved.branches.values())).kind)
        values = np.empty(shape[:2])
        for k, (name, over) in enumerate(self._asked[: shape[1]]):
            values[:, k] = self._worst(name, over)
        values[~np.isfinite(values)] = np.nan
        met = np.ones((shape[0], shape[2]), dtype=bool)
        for k, requirement in enumerate(self.study.spec.part_requirements):
            limits = Bounds.from_requirement(
                requirement, self._definitions[split_name(requirement.metric)[0]].dimension
            )
            by_branch = self.values(requirement.metric, requirement.over, left=False).values()
            met[:, k] = np.logical_and.reduce([limits.met_by(item) for item in by_branch]) if by_branch else False
        warned = self._findings()  # behind the values: many paths are solved at once for these
        if result is None or result.status is Status.COMPLETE:
            odd = {row: (Status.COMPLETE, text) for row, text in self._find_gaps()}
            outside = np.isin(np.arange(shape[0]), list(odd))
            warned |= {WINDOW_OUTSIDE: outside} if odd and self.study.findings else {}
        else:
            odd = {0: (result.status, result.message)}
        for row, error in self.faults.items():
            values[row], met[row], odd[row] = np.nan, False, (Status.INVALID, describe_error(error))
        return ResultRows(values, met, odd, warned=warned)

    def _findings(self) -> dict[str, NDArray[np.bool_]]:
        return self.solved.findings() if self.study.findings else {}

    def _find_gaps(self) -> Iterator[tuple[int, str]]:
        """Yield rows with windows that some branch does not cover, and why cells have no value."""
        all_windows = [list(spec.windows()) for spec in self.specs]
        places = [self._places([window for _, window in windows]) for windows in zip(*all_windows, strict=True)]
        low, high = self._common
        is_uncovered = np.zeros(len(self), dtype=bool)
        for start, stop in filter(None, places):
            slack = WINDOW_RTOL * (stop - start)
            is_uncovered |= ~((low <= start + slack) & (high >= stop - slack))
        curves = next(iter(self.solved.branches.values()))
        for row in np.flatnonzero(is_uncovered).tolist():
            if row in self.faults:
                continue
            paths = [path for path, _ in all_windows[row if len(all_windows) > 1 else 0]]
            windows = [Window(float(start[row]), float(stop[row])) for start, stop in filter(None, places)]
            common = float(low[row]), float(high[row])
            gaps = find_uncovered(zip(paths, windows, strict=True), [common], curves.kind)
            yield row, "; ".join(gap.short for gap in gaps)

    def _worst(self, name: str, over: Ends | None) -> FloatArray:
        """Return a metric of the branch that is named, or of the worst, (m,)."""
        by_branch = self.values(name, over)
        if not by_branch:
            return np.full(len(self), np.nan)
        if len(by_branch) == 1:
            return next(iter(by_branch.values()))
        stack = np.stack(list(by_branch.values()))
        target = next(iter(self.solved.branches.values())).target
        rule = self._definitions[split_name(name)[0]].worst
        chosen = worst_branch(rule, stack, None if np.isnan(target).any() else target)
        return np.asarray(np.take_along_axis(stack, chosen[None], axis=0)[0])


def _window_places(ends: Ends, start: FloatArray, stop: FloatArray) -> Places | None:
    """Return a window of all in places, (m,) each; None where it has no width for one of them."""
    places = [
        start + float(end) * (stop - start) if isinstance(end, TravelShare) else np.full(len(start), float(end))
        for end in ends
    ]
    low, high = np.minimum(*places), np.maximum(*places)
    return None if (low == high).any() else (low, high)


def describe_error(error: CfmError) -> str:
    """Return an error in one line; of a specification, paths and messages without the empty source."""
    if isinstance(error, SpecError):
        return "; ".join(": ".join(filter(None, (problem.path, problem.message))) for problem in error.problems)
    return " ".join(str(error).split())


def points_at_once(study: Study, plan: Plan) -> int:
    """Return of how many points a block of rows is at least; 1 if the first, middle or last is analysed by itself."""
    if study.design or not len(plan) or "analysis.points" in plan.paths:  # curves of other lengths
        return 1
    variants = _variants(study, plan, sorted({0, len(plan) // 2, len(plan) - 1}))
    return count_together(variants, family(study.spec.family).rows, _know_columns(study, variants))


def _know_columns(study: Study, variants: Variants) -> Callable[[Rows], bool]:
    return lambda solved: SolvedVariants(study, variants, np.arange(len(solved.complete)), solved).known


def evaluate_rows(study: Study, plan: Plan, start: int, stop: int, together: bool = True) -> ResultRows:
    """Return the rows of the points from `start` up to `stop`.

    Whatever goes wrong at a point becomes a row with a status and without values.

    Parameters
    ----------
    study, plan : Study, Plan
        What is noted of which points.
    start, stop : int
        Points.
    together : bool, optional
        Whether to solve those together that the family can; else each is analysed by itself.
    """
    variants = _variants(study, plan, range(start, stop))
    batches = family(study.spec.family).rows if together and not study.design else None
    parts: list[tuple[NDArray[np.intp], ResultRows]] = []

    def note(group: tuple[NDArray[np.intp], Rows]) -> None:
        """Note a group, which ends before the next one begins."""
        members, solved = group
        kept = np.flatnonzero(solved.complete)
        rows = _note_rows(study, variants, members, solved)
        parts.append((members[kept], select_rows(rows, kept)))

    for _ in map(note, solve_variants(variants, batches, study.solve, _know_columns(study, variants))):
        pass
    return scatter_rows(stop - start, parts)


def _note_rows(study: Study, variants: Variants, members: NDArray[np.intp], solved: Rows) -> ResultRows:
    """Return what a study notes of rows, or why it notes nothing."""
    shape = len(members), len(study.metrics), len(study.spec.part_requirements)
    try:
        if isinstance(solved, SingleRow) and solved.error is not None:
            raise solved.error
        rows = SolvedVariants(study, variants, members, solved).rows()
        return replace(rows, curves=_write_curves(study, variants, members, solved)) if study.curves else rows
    except CfmError as error:
        status = _STATUS_OF_EXIT_CODE.get(error.exit_code, Status.INVALID)
        if status is not Status.CRASHED:
            return failed_rows(shape, status, describe_error(error))
        lost = lose_to_bug(error)
    except Exception as error:
        if not isinstance(solved, SingleRow):
            raise
        lost = lose_to_bug(error)
    return failed_rows(shape, lost.status, lost.message, lost.bug)


def _write_curves(study: Study, variants: Variants, members: NDArray[np.intp], solved: Rows) -> dict[int, bytes]:
    """Return the curves of rows as CSV; those of variants that are solved together are computed once more."""
    results = {
        row: (solved if isinstance(solved, SingleRow) else analyze_alone(variants, index, study.solve)).result
        for row, index in enumerate(members.tolist())
    }
    return {
        row: to_csv(curve_table(result.curves))
        for row, result in results.items()
        if result is not None and result.status.usable
    }


def evaluate_result(study: Study, result: Result) -> ResultRows:
    """Return what a study notes of a result.

    Raises CfmError if a window of it has no width, or a requirement is not well put.
    """
    solved = SolvedVariants(study, Variants(study.spec, {}, lambda _k: result.spec, 1), np.arange(1), SingleRow(result))
    rows = solved.rows()
    for error in solved.faults.values():
        raise error
    return rows


def _variants(study: Study, plan: Plan, indices: Sequence[int]) -> Variants:
    """Return some points of a study as variants."""
    start, stop = indices[0], indices[-1] + 1
    some = np.array(indices) - start
    columns = (column[some] for column in plan.block(start, stop))
    values = dict(zip(plan.paths, columns, strict=True))
    return Variants(
        study.plain, values, lambda k: study.variant(plan.point(indices[k])), len(indices), study.manufactured
    )

"""Points of a study as rows of one solution, for families whose mechanisms are solved together."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.rows import Variants, valid
from cfmkit.metrics import CycleRows, metric_of_rows, split_name
from cfmkit.metrics.branches import WINDOW_RTOL
from cfmkit.metrics.metric_values import worst_branch
from cfmkit.metrics.requirements import Bounds
from cfmkit.specs.units import TravelShare, window_places
from cfmkit.studies.row_blocks_for_journal import ResultRows, gather_rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.rows import SolvedRows
    from cfmkit.metrics import Definition
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.units import Ends
    from cfmkit.studies.plan import Plan
    from cfmkit.studies.point_evaluation import Study

    ByBranch = Mapping[str, FloatArray]


BLOCK_SIZE = 4096  # points that are evaluated and noted together
_OF_WINDOWS = ("analysis.window", "requirements")  # where specifications state windows


class SolvedVariants:
    """Columns of a study for variants that are solved together.

    Parameters
    ----------
    study : Study
        What is noted.
    variants : Variants
        Those that the rows are some of.
    rows : (m,) array of int
        Which of them.
    solved : SolvedRows
        Their solutions.
    """

    def __init__(self, study: Study, variants: Variants, rows: NDArray[np.intp], solved: SolvedRows[Any]) -> None:
        """Read nothing yet."""
        self.study, self.variants, self.members, self.solved = study, variants, rows, solved
        self._values: dict[tuple[str, str | None, Ends | None], ByBranch] = {}
        self._cycles: dict[Ends | None, CycleRows] = {}
        self._windows: dict[Ends | None, tuple[FloatArray, FloatArray] | None] = {}

    def __len__(self) -> int:
        """Return the number of variants."""
        return len(self.members)

    @cached_property
    def specs(self) -> list[Spec]:
        """The specification of each, or the one that has the windows of all."""
        if not any(path.startswith(_OF_WINDOWS) for path in self.variants.values):
            return [self.study.plain]
        return [self.variants[row] for row in self.members.tolist()]

    @cached_property
    def _travels(self) -> tuple[FloatArray, FloatArray]:
        """Start and end of the motion of each, (m,)."""
        curves = next(iter(self.solved.branches.values()))
        return curves.travel or curves.extent

    def _places(self, ends: Sequence[Ends | None]) -> tuple[FloatArray, FloatArray] | None:
        """Return windows of the variants in places, (m,) each; None for the full travel."""
        if all(one is None for one in ends):
            return None
        start, stop = self._travels
        if len(ends) == 1 and ends[0] is not None and (first := _window_places(ends[0], start, stop)) is not None:
            return first
        every = list(ends) if len(ends) == len(self) else list(ends) * len(self)
        travels = zip(start.tolist(), stop.tolist(), strict=True)
        found = [window_places(one, travel) for one, travel in zip(every, travels, strict=True) if one is not None]
        low, high = np.array(found).T
        return low, high

    def _window(self, over: Ends | None) -> tuple[FloatArray, FloatArray] | None:
        """Return the window of a metric: its own, else that of the analysis."""
        if over not in self._windows:
            own = [getattr(getattr(spec, "analysis", None), "window", None) for spec in self.specs]
            self._windows[over] = self._places(own if over is None else [over])
        return self._windows[over]

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """Which variants have a complete curve that covers every window of their specification, (m,)."""
        good = self.solved.complete.copy()
        windows = [[ends for _, ends in spec.windows()] for spec in self.specs]
        for ends in zip(*windows, strict=True):
            low, high = self._places(ends) or (0.0, 0.0)
            for curves in self.solved.branches.values():
                slack = WINDOW_RTOL * (high - low)
                good &= (curves.extent[0] <= low + slack) & (curves.extent[1] >= high - slack)
        return good

    def values(self, name: str, over: Ends | None) -> ByBranch:
        """Return a metric or a value of the family by branch, (m,) each; of the branch that is named alone.

        What is no matter of one branch stands under the name "".
        """
        plain, branch = split_name(name)
        alone = branch if self._definitions[plain].scope == "cycle" else None
        if (plain, alone, over) not in self._values:
            self._values[plain, alone, over] = self._compute(plain, alone, over)
        by_branch = self._values[plain, alone, over]
        chosen = branch is None or alone is not None
        return by_branch if chosen else {name: item for name, item in by_branch.items() if name == branch}

    def _compute(self, plain: str, alone: str | None, over: Ends | None) -> ByBranch:
        """Return a metric of all branches, or of one alone."""
        own = self.solved.value(plain)
        if own is not None:
            return {"": own}
        if over not in self._cycles:
            self._cycles[over] = CycleRows.from_curves(self.solved.branches, self._window(over))
        cycle = self._cycles[over]
        if alone is not None:
            cycle = CycleRows({name: rows for name, rows in cycle.branches.items() if name == alone})
        return metric_of_rows(self._definitions[plain], cycle)

    @property
    def _asked(self) -> tuple[tuple[str, Ends | None], ...]:
        """Name and window of everything that is read: the metrics, then the requirements."""
        metrics = [(one.name, one.over) for one in self.study.metrics]
        return (*metrics, *((one.metric, one.over) for one in self.study.spec.part_requirements))

    @property
    def known(self) -> bool:
        """True if rows have every column of the study."""
        names = {split_name(name)[0] for name, _ in self._asked}
        definitions = self._definitions
        return all(name in self.solved.quantities or definitions[name].is_known_in_rows for name in names)

    @cached_property
    def _definitions(self) -> Mapping[str, Definition]:
        return self.study.definitions(next(iter(self.solved.branches.values())).kind)

    def rows(self) -> ResultRows:
        """Return what the study notes of the variants, as if all of them were usable."""
        values = np.empty((len(self), len(self.study.metrics)))
        for k, (name, over) in enumerate(self._asked[: len(self.study.metrics)]):
            values[:, k] = self._worst(name, over)
        values[~np.isfinite(values)] = np.nan
        met = np.ones((len(self), len(self.study.spec.part_requirements)), dtype=bool)
        for k, one in enumerate(self.study.spec.part_requirements):
            limits = Bounds.from_requirement(one, self._definitions[split_name(one.metric)[0]].dimension)
            by_branch = self.values(one.metric, one.over).values()
            met[:, k] = np.logical_and.reduce([limits.met_by(item) for item in by_branch]) if by_branch else False
        return ResultRows(values, met, warned=self._findings() if self.study.findings else {})

    def _worst(self, name: str, over: Ends | None) -> FloatArray:
        """Return a metric of the branch that is named, or of the worst, (m,)."""
        by_branch = self.values(name, over)
        if not by_branch:
            return np.full(len(self), np.nan)
        if len(by_branch) == 1:
            return next(iter(by_branch.values()))
        stack = np.stack(list(by_branch.values()))
        target = next(iter(self.solved.branches.values())).target
        chosen = worst_branch(self._definitions[name].worst, stack, None if np.isnan(target).any() else target)
        return np.asarray(np.take_along_axis(stack, chosen[None], axis=0)[0])

    def _findings(self) -> dict[str, NDArray[np.bool_]]:
        return self.solved.findings()


def _window_places(ends: Ends, start: FloatArray, stop: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return a window of all in places, (m,) each; None where it has no width for one of them."""
    places = [
        start + float(end) * (stop - start) if isinstance(end, TravelShare) else np.full(len(start), float(end))
        for end in ends
    ]
    low, high = np.minimum(*places), np.maximum(*places)
    return None if (low == high).any() else (low, high)


MIN_BLOCK_SIZES, SMALLEST_TRACED = 64, 8
"""Points in a block at least, of closed forms and of traced models: a traced one takes milliseconds."""


def are_solved_together(study: Study, plan: Plan) -> int:
    """Return of how many points a block of rows is at least; 0 if the first, middle and last point are no rows."""
    solve = family(study.spec.family).rows
    if solve is None or study.design or not len(plan) or "analysis.points" in plan.paths:  # curves of other lengths
        return 0
    indices = sorted({0, len(plan) // 2, len(plan) - 1})
    try:
        variants = _variants(study, plan, indices)
        known = sum(1 for _ in valid(variants))  # of those that are not valid each says so by itself
        found = [(members, SolvedVariants(study, variants, members, part)) for members, part in solve(variants)]
        traced = any(part.solved.traced for _, part in found)
        together = 0 < sum(len(members) for members, _ in found) == known and all(part.known for _, part in found)
    except CfmError:
        return 0
    if not together or (study.curves and traced):
        return 0
    return SMALLEST_TRACED if traced else MIN_BLOCK_SIZES


def evaluate_rows(study: Study, plan: Plan, start: int, stop: int) -> ResultRows:
    """Return the rows of the points from `start` up to `stop`; those that no rows know are analysed one by one."""
    members, parts = _parts(study, _variants(study, plan, range(start, stop)))
    count = stop - start, len(study.metrics), len(study.spec.part_requirements)
    values, met = np.full(count[:2], np.nan), np.zeros((count[0], count[2]), dtype=bool)
    warned: dict[str, NDArray[np.bool_]] = {}
    for chosen, rows, usable in parts:
        values[chosen], met[chosen] = rows.values, rows.met
        for name, mask in rows.warned.items():
            warned.setdefault(name, np.zeros(count[0], dtype=bool))[chosen[usable]] = mask[usable]
    singly = sorted(set(range(count[0])) - members)
    rest = gather_rows([study.evaluate(plan.point(start + k)) for k in singly], *count[1:])
    values[singly], met[singly] = rest.values, rest.met
    for name, mask in rest.warned.items():
        warned.setdefault(name, np.zeros(count[0], dtype=bool))[singly] = mask
    odd = {singly[k]: item for k, item in rest.odd.items()}
    bugs = {singly[k]: item for k, item in rest.bugs.items()}
    curves = {singly[k]: item for k, item in rest.curves.items()}
    if study.curves:
        curves |= {k: study.evaluate(plan.point(start + k)).curve for k in sorted(members)}
    warned = {name: warned[name] for name in sorted(warned) if warned[name].any()}
    return ResultRows(values, met, odd, curves, bugs, warned)


def _variants(study: Study, plan: Plan, indices: Sequence[int]) -> Variants:
    """Return some points of a study as variants."""
    start, stop = indices[0], indices[-1] + 1
    some = np.array(indices) - start
    columns = (column[some] for column in plan.block(start, stop))
    values = dict(zip(plan.paths, columns, strict=True))
    return Variants(
        study.plain, values, lambda k: study.variant(plan.point(indices[k])), len(indices), study.manufactured
    )


def _parts(
    study: Study, variants: Variants
) -> tuple[set[int], list[tuple[NDArray[np.intp], ResultRows, NDArray[np.bool_]]]]:
    """Return which variants are known as rows, and for each solution its variants, their rows, and which are usable."""
    solve = family(study.spec.family).rows
    members: set[int] = set()
    parts: list[tuple[NDArray[np.intp], ResultRows, NDArray[np.bool_]]] = []
    if solve is None:
        return members, parts

    def read(group: tuple[NDArray[np.intp], SolvedRows[Any]]) -> None:
        """Read the columns of a group, which ends before the next one begins."""
        part = SolvedVariants(study, variants, *group)
        if part.known:
            usable = part.usable
            parts.append((part.members, part.rows(), usable))
            members.update(part.members[usable].tolist())

    try:
        for _ in map(read, solve(variants)):
            pass
    except CfmError:  # of a window without a width, say: each point says so by itself
        return set(), []
    return members, parts

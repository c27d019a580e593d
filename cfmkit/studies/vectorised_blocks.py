"""Whole blocks of points for families whose model is vectorised."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families import family
from cfmkit.families.base import Block, Measure
from cfmkit.metrics import metrics_by_name, other_name, split_name, values_of_family
from cfmkit.metrics.metric_values import worst_branch
from cfmkit.metrics.requirements import Bounds
from cfmkit.specs.units import Share
from cfmkit.studies.row_blocks_for_journal import ResultRows, gathered
from cfmkit.studies.variants_in_rows import SMALLEST, are_solved_together, evaluate_rows

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import BlockAnswer
    from cfmkit.metrics import Definition
    from cfmkit.specs.units import Ends
    from cfmkit.studies.plan import Plan
    from cfmkit.studies.point_evaluation import Study

BLOCK = 4096
"""Points that are evaluated and noted together."""

NOT_JUDGED = "not_judged"
"""In place of warnings where a block model does not know them: an empty cell would say that there are none."""


def vectorised(study: Study, plan: Plan) -> int:
    """Return of how many points a block is at least, as rows or by the family's block model; 0: one by one."""
    if family(study.spec.family).rows is not None:
        return are_solved_together(study, plan)
    if family(study.spec.family).analyze_block is None or study.design or not len(plan):
        return 0
    return SMALLEST if _answer(study, plan, 0, 1) is not None else 0


def evaluate_block(study: Study, plan: Plan, start: int, stop: int) -> ResultRows:
    """Return the rows of the points from `start` up to `stop`.

    What the block model leaves undone is analysed point by point.
    """
    if family(study.spec.family).rows is not None:
        return evaluate_rows(study, plan, start, stop)
    answer = _answer(study, plan, start, stop)
    done = np.zeros(stop - start, dtype=bool) if answer is None else answer.done
    singly = np.flatnonzero(~done).tolist()
    rest = gathered(
        [study.evaluate(plan.point(start + k)) for k in singly], len(study.metrics), len(study.spec.part_requirements)
    )
    if answer is None:
        return rest
    values, met = _columns(study, answer), _met(study, answer)
    values[singly], met[singly] = rest.values, rest.met
    odd = {singly[k]: item for k, item in rest.odd.items()}
    bugs = {singly[k]: item for k, item in rest.bugs.items()}
    curves = {singly[k]: item for k, item in rest.curves.items()}
    if study.curves:
        # Rows are those of the block, whether curves are wanted or not.
        curves |= {int(k): study.evaluate(plan.point(start + int(k))).curve for k in np.flatnonzero(done)}
    return ResultRows(values, met, odd, curves, bugs, _warned(answer, singly, rest))


def _warned(answer: BlockAnswer, singly: list[int], rest: ResultRows) -> dict[str, NDArray[np.bool_]]:
    """Return which rows have which warnings: those of the block model, of the rows analysed one by one their own."""
    warned = {}
    reported = {NOT_JUDGED: answer.done} if answer.warnings is None else answer.warnings
    for name in sorted({*reported, *rest.warned}):
        mask = np.array(reported.get(name, np.zeros(len(answer.done))), dtype=bool)
        mask[singly] = rest.warned.get(name, False)
        if mask.any():
            warned[name] = mask
    return warned


def _answer(study: Study, plan: Plan, start: int, stop: int) -> BlockAnswer | None:
    record = family(study.spec.family)
    model = record.analyze_block
    if model is None or (_follows_the_travel(study) and not record.block_shares):
        return None
    values, asked = dict(zip(plan.paths, plan.block(start, stop), strict=True)), measures(study)
    renamed = tuple(Measure(other_name(one.name), one.window) for one in asked)
    with np.errstate(all="ignore"):
        found = model(study.spec, Block(values, asked, stop - start))
        if found is None and renamed != asked:
            found = model(study.spec, Block(values, renamed, stop - start))
    return found


def _follows_the_travel(study: Study) -> bool:
    """Return whether some window is a share of the travel, which each point may have of its own."""
    windows = [*(ends for _, ends in study.spec.windows()), *(one.over for one in study.metrics if one.over)]
    return any(isinstance(end, Share) for ends in windows for end in ends)


def measures(study: Study) -> tuple[Measure, ...]:
    """Return what is requested of each point: the metrics, then the requirements."""
    asked = [(one.name, one.over) for one in study.metrics]
    asked += [(one.metric, one.over) for one in study.spec.part_requirements]
    return tuple(Measure(split_name(name)[0], _window(study, over)) for name, over in asked)


def _window(study: Study, over: Ends | None) -> Ends | None:
    ends = over or getattr(getattr(study.spec, "analysis", None), "window", None)
    if ends is None:
        return None
    start, stop = (end if isinstance(end, Share) else float(end) for end in ends)
    return start, stop


def _columns(study: Study, answer: BlockAnswer) -> FloatArray:
    """Return the metrics, (n, m): of the branch that is named, or of the worst."""
    known = _known(study, answer)
    columns = np.empty((len(answer.done), len(study.metrics)))
    for k, name in enumerate(study.names):
        plain, branch = split_name(name)
        columns[:, k] = _one(known[plain], branch, answer.values[k], answer.target)
    columns[~np.isfinite(columns)] = np.nan
    return columns


def _known(study: Study, answer: BlockAnswer) -> Mapping[str, Definition]:
    return metrics_by_name(answer.kind, values_of_family(family(study.spec.family).values))


def _one(
    definition: Definition, branch: str | None, by_branch: Mapping[str, FloatArray], target: FloatArray | None
) -> FloatArray:
    found = list(by_branch.values())
    if branch is not None:
        return by_branch[branch] if branch in by_branch else np.full_like(found[0], np.nan)
    if len(found) == 1:
        return found[0]
    stack = np.stack(found)
    return np.asarray(np.take_along_axis(stack, worst_branch(definition.worst, stack, target)[None], axis=0)[0])


def _met(study: Study, answer: BlockAnswer) -> NDArray[np.bool_]:
    """Return whether each requirement is met, (n, r): by the branch that is named, or by all."""
    known = _known(study, answer)
    met = np.ones((len(answer.done), len(study.spec.part_requirements)), dtype=bool)
    for k, one in enumerate(study.spec.part_requirements):
        plain, branch = split_name(one.metric)
        limits = Bounds.of(one, known[plain].dimension)
        by_branch = answer.values[len(study.metrics) + k]
        chosen = [values for name, values in by_branch.items() if branch in (None, name)]
        for values in chosen:
            met[:, k] &= limits.met_by(values)
        if not chosen:
            met[:, k] = False
    return met

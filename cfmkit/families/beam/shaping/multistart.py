"""All starts of a design: each searched, the best of them widened, and what orders them.

For the widest window each start is searched twice: over the requested window, and over one that begins farther. Most
starts end in one family of shapes, and what is flattest over the requested window seldom is in another one whose window
can be widened farther.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.run_many_starts import Done, OneStart, Stage, from_record, run_stage
from cfmkit.families.beam.shaping.search import (
    VIOLATION_TOL,
    ShapeCandidate,
    StartBudget,
    nearer,
    refine,
    search_start,
    searched_far,
    widen,
)
from cfmkit.families.beam.shaping.shape_soundness_and_scatter import Audit, audit_design
from cfmkit.families.beam.shaping.variables import Variables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from cfmkit.families.beam.shaping.task import Task
    from cfmkit.families.run_control import Run


_N_REFINED = 3  # of the widest: one in a finer order takes as long as a widening, and others gain little
_N_LEADERS = 3  # of the flattest over a wider window: finishing one takes as long as a start
_STAGE_DURATIONS = {
    "starts": 9.0,
    "widenings": 5.0,
    "starts over a wider window": 4.0,
    "widenings of the flattest of these": 2.0,
    "refinements": 5.0,
}
"""How long the stages of a search for the widest window last, one in units of another; where they are done in turn."""


@dataclass(frozen=True)
class Explored:
    """Results of the starts."""

    designs: dict[int, ShapeCandidate | None]  # number of the start -> the design, None if nothing could be followed
    reused: int  # starts that were noted by a run before
    missing: int  # starts that led to nothing: the time did not suffice, or a process died
    lost: tuple[str, ...] = ()  # why processes died
    # number of the start -> the audit of its design, of those that meet all limits
    audits: Mapping[int, Audit] = field(default_factory=dict)


def explore(
    # task, plan: what is shaped, and how much is tried
    task: Task,
    plan: StartBudget,
    counts: tuple[int, int],  # (int, int): starts, and how many of the best are widened
    identity: str,  # of everything that decides the outcome of a start but its number
    run: Run,  # seed, progress, processes, notes
) -> Explored:
    """Return what all starts lead to, the best of them widened if that is the objective, as far as the time allows."""
    starts, wide = counts
    jobs = _Jobs(task, plan, identity, run)
    begun = jobs.run_stage("starts", partial(search_start, task.started, run.seed, plan=plan), range(starts))
    designs, missing = _found_in(begun), starts - len(begun.records)
    if task.objective == "range":
        best = dict(list(rank(task, designs))[:wide])
        designs |= _found_in(jobs.run_stage("widenings", partial(_widen, task.started, best, plan), best))
        distant = partial(searched_far, task.started, run.seed, plan=plan)
        far = _found_in(jobs.run_stage("starts over a wider window", distant, range(starts)))
        leaders = dict(sorted(_keep_within_limits(far), key=lambda item: item[1].objective)[:_N_LEADERS])
        work = partial(_nearer, task.started, leaders, plan)
        led = _found_in(jobs.run_stage("widenings of the flattest of these", work, leaders))
        designs |= {index: design for index, design in led.items() if _better(task, design, designs.get(index))}
    if task.orders != task.started.orders:
        widest = dict(list(rank(task, designs))[:_N_REFINED])
        designs |= _found_in(jobs.run_stage("refinements", partial(_refine, task, widest, plan), widest))
    audits = {index: audit_design(Variables(task, design.order), design) for index, design in rank(task, designs)}
    return Explored(designs, begun.reused, missing, tuple(jobs.lost), audits)


@dataclass
class _Jobs:
    """Stages of a search one after the other, with progress and why processes died."""

    task: Task
    plan: StartBudget
    identity: str
    run: Run
    lost: list[str] = field(default_factory=list)

    def run_stage(self, what: str, search: Callable[[int], ShapeCandidate | None], numbers: Iterable[int]) -> Done:
        """Return what the jobs of a stage led to; it is called by what its jobs are."""
        numbers = tuple(numbers)
        stage = Stage(OneStart(search, self.plan.clock), numbers, f"{self.identity} {what}")
        begun, ended = _shares(self.task)[what]

        def tell(records: Mapping[int, dict[str, Any]]) -> None:
            designs = [record["found"] for record in records.values() if record["found"]]
            feasible = sum(design["violation"] <= VIOLATION_TOL for design in designs)
            text = f"{len(records)} of {len(numbers)} {what}, {feasible} meet all limits"
            self.run.progress(begun + (ended - begun) * len(records) / max(1, len(numbers)), text)

        outcome = run_stage(stage, self.run, self.plan.clock, tell)
        self.lost += outcome.lost
        return outcome


def _shares(task: Task) -> dict[str, tuple[float, float]]:
    """Return between which shares of the whole search each stage of a task lies."""
    lasts = dict(_STAGE_DURATIONS)
    if task.objective != "range":
        lasts = {"starts": 1.0}
    elif task.orders == task.started.orders:
        del lasts["refinements"]
    ends = np.cumsum([0.0, *lasts.values()]) / sum(lasts.values())
    return dict(zip(lasts, pairwise(ends.tolist()), strict=True))


def _widen(task: Task, designs: dict[int, ShapeCandidate], plan: StartBudget, index: int) -> ShapeCandidate:
    return widen(task, designs[index], plan)


def _nearer(task: Task, designs: dict[int, ShapeCandidate], plan: StartBudget, index: int) -> ShapeCandidate:
    return nearer(task, designs[index], plan)


def _refine(task: Task, designs: dict[int, ShapeCandidate], plan: StartBudget, index: int) -> ShapeCandidate:
    return refine(task, designs[index], plan)


def _found_in(stage: Done) -> dict[int, ShapeCandidate | None]:
    """Return the designs of a stage by the number of the start; None if nothing could be followed."""
    records = {index: stage.records[index]["found"] for index in sorted(stage.records)}
    return {index: from_record(ShapeCandidate, record) if record else None for index, record in records.items()}


def _better(task: Task, candidate: ShapeCandidate | None, design: ShapeCandidate | None) -> bool:
    """Return True if one design of a start takes the place of the other."""
    if candidate is None or not candidate.feasible:
        return False
    return design is None or not design.feasible or rank_of(task, candidate) < rank_of(task, design)


def rank(task: Task, designs: Mapping[int, ShapeCandidate | None]) -> Iterator[tuple[int, ShapeCandidate]]:
    """Yield the designs that meet all limits, the best first."""
    yield from sorted(_keep_within_limits(designs), key=lambda item: rank_of(task, item[1]))


def _keep_within_limits(designs: Mapping[int, ShapeCandidate | None]) -> list[tuple[int, ShapeCandidate]]:
    return [(index, design) for index, design in designs.items() if design is not None and design.feasible]


def rank_of(task: Task, design: ShapeCandidate) -> tuple[bool, float, float]:
    """Return what orders designs: whether the band is kept and where the window begins, if it counts; the objective."""
    if task.objective != "range":
        return False, 0.0, design.objective
    return design.objective > task.half_band, design.start, design.objective

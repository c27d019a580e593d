"""All starts of a design: each searched, the best of them widened, and what orders them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.designing.run_many_starts import OneStart, Stage, done, restored
from cfmkit.families.beam.shaping.search import VIOLATION, Found, StartBudget, refined, searched, widened
from cfmkit.families.beam.shaping.shape_soundness_and_scatter import Audit, audited
from cfmkit.families.beam.shaping.variables import Variables

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.families.base import Run
    from cfmkit.families.beam.shaping.task import Task


_REFINED = 3  # of the widest: one in a finer order takes as long as a widening, and others gain little


@dataclass(frozen=True)
class Explored:
    """What the starts led to.

    Attributes
    ----------
    found : mapping
        Number of the start -> the design, None where nothing could be followed.
    reused : int
        Starts that were noted by a run before.
    missing : int
        Starts that led to nothing: the time did not suffice, or a process died.
    lost : tuple of str
        Why processes died.
    audits : mapping
        Number of the start -> the audit of its design, of those that meet all limits.
    """

    found: dict[int, Found | None]
    reused: int
    missing: int
    lost: tuple[str, ...] = ()
    audits: Mapping[int, Audit] = field(default_factory=dict)


def explored(task: Task, plan: StartBudget, counts: tuple[int, int], identity: str, run: Run) -> Explored:
    """Return what all starts lead to, the best of them widened if that is the objective, as far as the time allows.

    Parameters
    ----------
    task, plan : Task and StartBudget
        What is shaped, and how much is tried.
    counts : (int, int)
        Starts, and how many of the best are widened.
    identity : str
        Of everything that decides the outcome of a start but its number.
    run : Run
        Seed, progress, processes, notes.
    """
    starts, wide = counts
    widens = task.objective == "range"
    share = 0.75 if widens else 1.0
    one = OneStart(partial(searched, task.started, run.seed, plan=plan), plan.clock)
    first = Stage(one, tuple(range(starts)), identity)
    begun = done(first, run, plan.clock, partial(_tell, run, "starts", starts, (0.0, share)))
    found, lost = {index: _found(begun.records[index]["found"]) for index in sorted(begun.records)}, begun.lost
    if widens:
        best = dict(list(ranked(task, found))[:wide])
        wider = OneStart(partial(_widened, task.started, best, plan), plan.clock)
        second = Stage(wider, tuple(best), f"{identity} widened")
        more = done(second, run, plan.clock, partial(_tell, run, "widenings", len(best), (share, 1.0)))
        lost += more.lost
        found |= {index: _found(record["found"]) for index, record in more.records.items()}
    if task.orders != task.started.orders:
        widest = dict(list(ranked(task, found))[:_REFINED])
        finer = OneStart(partial(_refined, task, widest, plan), plan.clock)
        third = Stage(finer, tuple(widest), f"{identity} refined")
        last = done(third, run, plan.clock, partial(_tell, run, "refinements", len(widest), (share, 1.0)))
        lost += last.lost
        found |= {index: _found(record["found"]) for index, record in last.records.items()}
    audits = {index: audited(Variables(task, one.order), one) for index, one in ranked(task, found)}
    return Explored(found, begun.reused, starts - len(found), lost, audits)


def _tell(run: Run, what: str, count: int, share: tuple[float, float], records: Mapping[int, dict[str, Any]]) -> None:
    found = [record["found"] for record in records.values() if record["found"]]
    feasible = sum(one["violation"] <= VIOLATION for one in found)
    text = f"{len(records)} of {count} {what}, {feasible} meet all limits"
    run.progress(share[0] + (share[1] - share[0]) * len(records) / max(1, count), text)


def _widened(task: Task, designs: dict[int, Found], plan: StartBudget, index: int) -> Found:
    return widened(task, designs[index], plan)


def _refined(task: Task, designs: dict[int, Found], plan: StartBudget, index: int) -> Found:
    return refined(task, designs[index], plan)


def _found(record: dict[str, Any]) -> Found | None:
    return restored(Found, record) if record else None


def ranked(task: Task, found: dict[int, Found | None]) -> Iterator[tuple[int, Found]]:
    """Yield the designs that meet all limits, the best first."""
    feasible = [(index, one) for index, one in found.items() if one is not None and one.feasible]
    yield from sorted(feasible, key=lambda item: rank_of(task, item[1]))


def rank_of(task: Task, one: Found) -> tuple[bool, float, float]:
    """Return what orders designs: whether the band is kept and where the window begins, if it counts; the objective."""
    if task.objective != "range":
        return False, 0.0, one.objective
    return one.objective > task.half_band, one.start, one.objective

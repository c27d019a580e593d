"""Many starts, in one process or several, each noted when it is finished, so that a run that was ended goes on."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, replace
from time import time
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.shaping.search import VIOLATION, Found, Plan, searched, widened

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.base import Run
    from cfmkit.families.beam.shaping.task import Task


@dataclass(frozen=True)
class OneStart:
    """What a process does: from the number of a start to a record of what it led to."""

    task: Task
    seed: int
    plan: Plan

    def __call__(self, index: int) -> dict[str, Any]:
        """Return the record; empty where there is nothing."""
        return _record(searched(self.task, self.seed, index, self.plan), self.plan)


@dataclass(frozen=True)
class OneWidening:
    """The same for the widening of the window: from the number of the start whose design is widened."""

    task: Task
    designs: dict[int, Found]
    plan: Plan

    def __call__(self, index: int) -> dict[str, Any]:
        """Return the record."""
        return _record(widened(self.task, self.designs[index], self.plan), self.plan)


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
    """

    found: dict[int, Found | None]
    reused: int
    missing: int
    lost: tuple[str, ...] = ()


@dataclass(frozen=True)
class Stage:
    """One round of jobs: what each does, which they are, and what the notes call them.

    Attributes
    ----------
    work : OneStart or OneWidening
        What is done.
    jobs : tuple of int
        Numbers of starts.
    identity : str
        Of everything that decides an outcome but the number.
    share : (float, float)
        Of the progress, from and to.
    """

    work: OneStart | OneWidening
    jobs: tuple[int, ...]
    identity: str
    share: tuple[float, float] = (0.0, 1.0)


def explored(task: Task, plan: Plan, counts: tuple[int, int], identity: str, run: Run) -> Explored:
    """Return what all starts lead to, the best of them widened if that is the objective, as far as the time allows.

    Parameters
    ----------
    task, plan : Task and Plan
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
    share = (0.0, 0.75 if widens else 1.0)
    records, reused, lost = _done(Stage(OneStart(task, run.seed, plan), tuple(range(starts)), identity, share), run)
    found = {index: _found(records[index]["found"]) for index in sorted(records)}
    if widens:
        best = dict(list(ranked(task, found))[:wide])
        stage = Stage(OneWidening(task, best, plan), tuple(best), f"{identity} widened", (share[1], 1.0))
        more, _, also = _done(stage, run)
        lost += also
        found |= {index: _found(record["found"]) for index, record in more.items()}
    return Explored(found, reused, starts - len(found), lost)


def _done(stage: Stage, run: Run) -> tuple[dict[int, Any], int, tuple[str, ...]]:
    """Return the records of a stage by number, how many were noted before, and why processes died."""
    keys = {job: hashlib.sha256(f"{stage.identity} {job}".encode()).hexdigest()[:32] for job in stage.jobs}
    places = {job: run.notes.find(key) for job, key in keys.items()}
    records = {job: run.notes.read(place, keys[job]) for job, place in places.items() if place >= 0}
    reused, lost = len(records), list[str]()
    _tell(stage, run, records)
    left = [job for job in stage.jobs if job not in records]
    for job, record in run.executor(stage.work, iter(left), stage.work.plan.late):
        if not isinstance(record, dict):
            lost.append(str(getattr(record, "message", record)))
            continue
        records[job] = record
        if not record["late"]:
            run.notes.add(keys[job], record)
        _tell(stage, run, records)
    return records, reused, tuple(dict.fromkeys(lost))


def _tell(stage: Stage, run: Run, records: dict[int, Any]) -> None:
    first, last = stage.share
    found = [record["found"] for record in records.values() if record["found"]]
    feasible = sum(one["violation"] <= VIOLATION for one in found)
    what = "starts" if isinstance(stage.work, OneStart) else "widenings"
    text = f"{len(records)} of {len(stage.jobs)} {what}, {feasible} meet all limits"
    run.progress(first + (last - first) * len(records) / max(1, len(stage.jobs)), text)


def _record(found: Found | None, plan: Plan) -> dict[str, Any]:
    record = {} if found is None else asdict(replace(found, x=found.x.tolist()))
    return {"found": record, "late": plan.late()}


def _found(record: dict[str, Any]) -> Found | None:
    return Found(**{**record, "x": np.array(record["x"])}) if record else None


def deadline_of(*budgets: float | None) -> float | None:
    """Return the time at which the shortest of some budgets [s] is used up; None without any."""
    given = [budget for budget in budgets if budget is not None]
    return time() + min(given) if given else None


def ranked(task: Task, found: dict[int, Found | None]) -> Iterator[tuple[int, Found]]:
    """Yield the designs that meet all limits, the best first."""
    feasible = [(index, one) for index, one in found.items() if one is not None and one.feasible]
    yield from sorted(feasible, key=lambda item: rank_of(task, item[1]))


def rank_of(task: Task, one: Found) -> tuple[bool, float, float]:
    """Return what orders designs: whether the band is kept and where the window begins, if it counts; the objective."""
    if task.objective != "range":
        return False, 0.0, one.objective
    return one.objective > task.half_band, one.start, one.objective

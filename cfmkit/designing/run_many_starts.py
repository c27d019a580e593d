"""Many starts of a search, in one process or several, in a time budget; results are noted, so that a run can go on."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from enum import Enum
from time import time
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from cfmkit.specs.block import STUDY_BLOCKS
from cfmkit.store import origin, stable_hash

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.specs.spec import Spec

Anything = TypeVar("Anything")

NOT_DECIDING = {"name", "description", "requirements", *STUDY_BLOCKS}
"""Blocks of a specification that no search looks at."""
KEY_DIGITS = 32  # hexadecimal digits of the key under which a start is noted


class Notes(Protocol):
    """Notes of a long run on what it has finished, for the run after it: `cfmkit.studies.journal.Journal`."""

    def find(self, key: str, /) -> Any:
        """Return the record of a key (32 hexadecimal digits) from an earlier run; None if there is none."""

    def add(self, key: str, record: Any, /) -> None:
        """Keep a record of plain numbers, words, lists and mappings."""


class Means(Protocol):
    """Processes and notes that starts use."""

    @property
    def executor(self) -> Callable[..., Iterator[tuple[Any, Any]]]:
        """Yields (job, outcome) as jobs finish."""

    @property
    def notes(self) -> Notes:
        """Keeps what is finished."""


@dataclass(frozen=True)
class Clock:
    """A deadline in seconds of `time.time`, which is the same in every process; None: no deadline."""

    deadline: float | None = None

    @classmethod
    def from_budgets(cls, *budgets: float | None) -> Clock:
        """Return the clock that runs out after the shortest of some budgets [s], counted from now."""
        limits = [budget for budget in budgets if budget is not None]
        return cls(time() + min(limits) if limits else None)

    def late(self) -> bool:
        """Return whether the time is up."""
        return self.deadline is not None and time() > self.deadline

    def get_time_left(self) -> float | None:
        """Return the time that is left [s], at least 0; None: all the time."""
        return None if self.deadline is None else max(self.deadline - time(), 0.0)


UNLIMITED_CLOCK = Clock()  # the clock of a search that has all the time


@dataclass(frozen=True)
class OneStart:
    """Work of a process: from the number of a start to the record of what it led to."""

    # from the number to a dataclass of numbers, words and arrays; None: nothing. It is sent to other processes
    search: Callable[[int], Any]
    clock: Clock  # when the search ends whether it is done or not

    def __call__(self, number: int) -> dict[str, Any]:
        """Return the record; what was found is empty where there is nothing."""
        outcome = self.search(number)
        return {"found": {} if outcome is None else to_record(outcome), "late": self.clock.late()}


def to_record(outcome: Any) -> dict[str, Any]:
    """Return a dataclass as plain data for a journal: arrays as lists, enumerations by name."""

    def plain(value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray) else value.name if isinstance(value, Enum) else value

    return {attribute.name: plain(getattr(outcome, attribute.name)) for attribute in fields(outcome)}


def from_record(kind: type[Anything], record: Mapping[str, Any]) -> Anything:
    """Return the dataclass of such a record: lists become arrays, names of members stay names."""
    return kind(**{name: np.array(value) if isinstance(value, list) else value for name, value in record.items()})


@dataclass(frozen=True)
class Stage:
    """One round of jobs."""

    # from the number of a job to its record, of plain numbers, words, lists and mappings: what it found, under "found",
    # and under "late" whether the time was up before it was done (`OneStart`). Sent to other processes
    work: Callable[[int], dict[str, Any]]
    jobs: tuple[int, ...]  # their numbers
    identity: str  # of everything that decides an outcome but the number


@dataclass(frozen=True)
class Done:
    """Results of the jobs of a stage."""

    records: Mapping[int, dict[str, Any]]  # number of the job -> its record; those that were not done are left out
    reused: int  # how many were noted by a run before
    lost: tuple[str, ...]  # why processes died


def run_stage(
    stage: Stage,  # the jobs
    means: Means,  # the processes, and where finished jobs are noted: a job that ran out of time is not
    clock: Clock,  # late, no more jobs are begun
    # takes the records so far, at the beginning and after each job
    report: Callable[[Mapping[int, dict[str, Any]]], None],
) -> Done:
    """Return what the jobs of a stage led to, as far as the time allows."""
    keys = {job: hashlib.sha256(f"{stage.identity} {job}".encode()).hexdigest()[:KEY_DIGITS] for job in stage.jobs}
    records = {job: record for job, key in keys.items() if (record := means.notes.find(key)) is not None}
    reused, lost = len(records), list[str]()
    report(records)
    left = [job for job in stage.jobs if job not in records]
    for job, record in means.executor(stage.work, iter(left), clock.late):
        if not isinstance(record, dict):
            lost.append(str(getattr(record, "message", record)))
            continue
        records[job] = record
        if not record["late"]:
            means.notes.add(keys[job], record)
        report(records)
    return Done(records, reused, tuple(dict.fromkeys(lost)))


def identity_of(spec: Spec, seed: int) -> str:
    """Return the identity of everything that decides a search: the specification, the seed, the package's own code."""
    return stable_hash([spec.model_dump(mode="json", exclude=NOT_DECIDING), seed, origin()])

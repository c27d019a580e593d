"""Engine of studies: computes the row of each point once, in jobs of any executor, with journal and progress."""

from __future__ import annotations

import hashlib
from contextlib import closing, suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from cfmkit.errors import OutputError, UsageError
from cfmkit.families import family
from cfmkit.families.variant_rows import MIN_BLOCK_SIZES
from cfmkit.studies.row_blocks_for_journal import (
    ResultRows,
    cut_rows,
    failed_rows,
    join_rows,
    recall_rows,
    record,
)
from cfmkit.studies.serial_and_cluster_executors import Lost, serial
from cfmkit.studies.variants_in_rows import BLOCK_SIZE, evaluate_rows, points_at_once

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.studies.journal import Journal
    from cfmkit.studies.plan import Plan
    from cfmkit.studies.point_evaluation import Study
    from cfmkit.studies.serial_and_cluster_executors import Executor

TARGET_JOB_COUNT = 64  # blocks that a study is cut into unless they become too large, or too small
MAX_POINTS_PER_TASK, MIN_TASKS = 512, 12
"""Points that small blocks are computed together up to; of slow models, where that leaves a dozen processes some.

A made cam takes a quarter less time in 512 at a time than in 128.
"""
MOST_QUICK_POINTS = 2000  # of a curve of a closed model, of which hundreds together take a fraction of a second
ROW_MISSING, ROW_IN_MEMORY, ROW_IN_JOURNAL = 0, 1, 2  # where a row is: nowhere yet, in memory, in the journal


@dataclass(frozen=True)
class Job:
    """The points from `start` up to `stop`, and what the journal calls them."""

    # start, stop: points
    start: int
    stop: int
    key: str = field(compare=False)  # name by content
    # neighbours that are computed together and noted one by one; empty: the job itself
    blocks: tuple[Job, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class Work:
    """Everything a worker needs to do any job of a study."""

    study: Study
    plan: Plan

    def __call__(self, job: Job) -> ResultRows:
        """Return the rows of a job."""
        return evaluate_rows(self.study, self.plan, job.start, job.stop, self.vectorised)

    @cached_property
    def smallest(self) -> int:
        """Number of points that a block has at least; 1 where each is analysed by itself."""
        return points_at_once(self.study, self.plan)

    @property
    def vectorised(self) -> bool:
        """Whether points are done in blocks."""
        return self.smallest > 1

    @property
    def step(self) -> int:
        """Number of points in a job: of small studies few, so that every process has some; few with their curves."""
        if not self.vectorised:
            return 1
        if self.study.curves:
            return self.smallest
        # A power of two, so that a study with a few more points has the same blocks and finds them in the journal.
        return 1 << (min(BLOCK_SIZE, max(self.smallest, len(self.plan) // TARGET_JOB_COUNT)).bit_length() - 1)

    @property
    def together(self) -> int:
        """Number of points that a process computes at once: those of one block, or of a few small ones."""
        if not self.vectorised or self.study.curves:
            return self.step
        most = MAX_POINTS_PER_TASK if self._is_quick else min(MAX_POINTS_PER_TASK, len(self.plan) // MIN_TASKS)
        return self.step * max(1, most // self.step)

    @property
    def _is_quick(self) -> bool:
        """Whether a full task takes a fraction of a second: whoever interrupts a study waits for those that run."""
        points = getattr(self.study.spec.get_value("analysis"), "points", 0)
        return self.smallest >= MIN_BLOCK_SIZES and points <= MOST_QUICK_POINTS

    def jobs(self) -> Iterator[Job]:
        """Yield every job in the order of the points."""
        for start in range(0, len(self.plan), self.step):
            yield self.job(start, min(start + self.step, len(self.plan)))

    def job(self, start: int, stop: int) -> Job:
        """Return one job; a block's key counts every value in it."""
        if stop - start == 1 and not self.vectorised:
            return Job(start, stop, self.study.key(self.plan.point(start)))
        digest = hashlib.sha256(b"block" + self.study.identity)
        for column in self.plan.block(start, stop):
            digest.update(repr(column.tolist()).encode() if column.dtype == object else column.tobytes())
        return Job(start, stop, digest.hexdigest()[:32])

    def fail(self, count: int, lost: Lost) -> ResultRows:
        """Return rows of points that were lost."""
        shape = count, len(self.study.metrics), len(self.study.spec.part_requirements)
        return failed_rows(shape, lost.status, lost.message, lost.bug)

    def recall(self, reported: Any) -> ResultRows:
        """Return the rows that are stored in a record of the journal."""
        return recall_rows(reported, len(self.study.metrics), len(self.study.spec.part_requirements))


class Monitor(Protocol):
    """Progress callbacks of a study, which may stop it."""

    def total(self, points: int) -> None:
        """Take how many points there are."""

    def add_finished(self, points: int, failed: int, reused: bool) -> None:
        """Take that more points are finished."""

    def stopping(self) -> bool:
        """Return whether to finish what runs and end."""


class NullMonitor:
    """A monitor that does nothing."""

    def total(self, points: int) -> None:
        """Ignore how many there are."""

    def add_finished(self, points: int, failed: int, reused: bool) -> None:
        """Ignore what is finished."""

    def stopping(self) -> bool:
        """Return False: go on to the end."""
        return False


class Records:
    """The rows of a study, as far as they are finished, in the order of the points."""

    def __init__(self, work: Work, journal: Journal | None) -> None:
        """Start without rows."""
        self.work, self._journal = work, journal
        self._places = np.full(len(work.plan), ROW_MISSING, dtype=np.uint8)
        self._keys = np.zeros((len(work.plan), 16), dtype=np.uint8)
        self._held: dict[int, ResultRows] = {}
        self.reused = 0  # points whose rows were in the journal before
        self.bugs = 0  # points that a bug ended
        self.bug = ""  # the first traceback

    def __len__(self) -> int:
        """Return the number of points of the study."""
        return len(self._places)

    @property
    def finished(self) -> int:
        """Number of points that have a row."""
        return int((self._places != ROW_MISSING).sum())

    def recall(self, job: Job) -> ResultRows | None:
        """Return rows that the journal had from before, and remember them; None if it had not."""
        reported = None if self._journal is None else self._journal.find(job.key)
        if reported is None:
            return None
        rows = self.work.recall(reported)
        if len(rows) != job.stop - job.start:
            return None
        self._mark_noted(job)
        self.reused += len(rows)
        return rows

    def keep(self, job: Job, rows: ResultRows) -> None:
        """Note rows: in the journal if they would be the same anywhere, else until the process ends."""
        if self._journal is not None and rows.keepable:
            self._journal.add(job.key, record(rows))
            self._mark_noted(job)
            return
        self._places[job.start : job.stop] = ROW_IN_MEMORY
        self._held[job.start] = rows
        self.bugs += len(rows.bugs)
        self.bug = self.bug or next(iter(rows.bugs.values()), "")

    def _mark_noted(self, job: Job) -> None:
        self._places[job.start : job.stop] = ROW_IN_JOURNAL
        self._keys[job.start : job.stop] = np.frombuffer(bytes.fromhex(job.key), dtype=np.uint8)

    def batches(self, size: int = BLOCK_SIZE) -> Iterator[tuple[NDArray[np.int64], ResultRows]]:
        """Yield (indices of points, their rows) in order, about `size` at a time; unfinished points are left out."""
        starts: list[NDArray[np.int64]] = []
        parts: list[ResultRows] = []
        for start, part in self._read_pieces():
            starts.append(np.arange(start, start + len(part)))
            parts.append(part)
            if sum(map(len, parts)) >= size:
                yield np.concatenate(starts), join_rows(parts)
                starts, parts = [], []
        if parts:
            yield np.concatenate(starts), join_rows(parts)

    def _read_pieces(self) -> Iterator[tuple[int, ResultRows]]:
        at = 0
        while at < len(self._places):
            place = int(self._places[at])
            if place == ROW_MISSING:
                at += 1
                continue
            part = self._held[at] if place == ROW_IN_MEMORY else self._read_journal(at)
            yield at, part
            at += len(part)

    def noted_keys(self) -> Iterator[bytes]:
        """Yield the keys of all rows that are in the journal; rows of one block have the same."""
        noted = self._keys[self._places == ROW_IN_JOURNAL]
        first = np.append(True, (noted[1:] != noted[:-1]).any(axis=1))[: len(noted)]
        yield from (key.tobytes() for key in noted[first])

    def _journal_key(self, index: int) -> str:
        key: bytes = self._keys[index].tobytes()
        return key.hex()

    def _read_journal(self, index: int) -> ResultRows:
        assert self._journal is not None  # some row is in it
        return self.work.recall(self._journal.read(self._journal_key(index)))

    def row(self, index: int) -> ResultRows:
        """Return the row of one finished point."""
        if int(self._places[index]) == ROW_IN_MEMORY:
            start = max(at for at in self._held if at <= index)
            return cut_rows(self._held[start], index - start, index - start + 1)
        rows, start = self._read_journal(index), index - index % self.work.step
        return rows if len(rows) == 1 else cut_rows(rows, index - start, index - start + 1)


def run(
    work: Work,  # study and plan
    executor: Executor = serial,  # how jobs get done: `serial`, a `Pool`, a `Cluster`
    journal: Journal | None = None,  # where rows are noted; without one they are kept in memory
    monitor: Monitor | None = None,  # progress callback with cancellation
) -> Records:
    """Return the rows of a study; those that the journal has are not computed again."""
    study = work.study
    if study.design and family(study.spec.family).design is None:
        raise UsageError(f"{family(study.spec.family).phrase} cannot be designed, only analysed")
    records, watch = Records(work, journal), monitor or NullMonitor()
    watch.total(len(work.plan))
    queue = _join_neighbours(_skip_noted(records, work.jobs(), watch), work.together)
    while True:
        lost = _do_jobs(records, executor, queue, watch)
        if not lost or watch.stopping():
            return records
        # A block that was lost costs only those of its points that are lost alone, too.
        alone = (work.job(at, at + 1) for block in lost for at in range(block.start, block.stop))
        queue = _skip_noted(records, alone, watch)


def _do_jobs(records: Records, executor: Executor, queue: Iterator[Job], watch: Monitor) -> list[Job]:
    """Do the jobs of a queue; return the blocks that were lost."""
    lost: list[Job] = []
    work = records.work
    with closing(executor(work, queue, watch.stopping)) as outcomes:  # type: ignore[type-var]
        for job, outcome in outcomes:
            if isinstance(outcome, Lost):
                if job.stop - job.start > 1:
                    lost.append(job)
                    continue
                outcome = work.fail(1, outcome)
            for block in job.blocks or (job,):
                records.keep(block, cut_rows(outcome, block.start - job.start, block.stop - job.start))
            watch.add_finished(len(outcome), outcome.failed, False)
    return lost


def _skip_noted(records: Records, queue: Iterator[Job], watch: Monitor) -> Iterator[Job]:
    """Yield the jobs that the journal does not know."""
    for job in queue:
        rows = records.recall(job)
        if rows is None:
            yield job
        else:
            watch.add_finished(len(rows), rows.failed, True)


def _join_neighbours(queue: Iterator[Job], most: int) -> Iterator[Job]:
    """Yield jobs whose points follow each other as one, of at most so many points."""
    held: list[Job] = []
    for job in queue:
        if held and (job.start != held[-1].stop or job.stop - held[0].start > most):
            yield _merge_jobs(held)
            held = []
        held.append(job)
        if job.stop - held[0].start >= most:
            yield _merge_jobs(held)
            held = []
    if held:
        yield _merge_jobs(held)


def _merge_jobs(jobs: list[Job]) -> Job:
    first, last = jobs[0], jobs[-1]
    return first if first is last else Job(first.start, last.stop, first.key, tuple(jobs))


def compact(journal: Journal, pieces: Sequence[Records]) -> None:
    """Make the journal of a finished study small; a later run with more points still finds its rows.

    What it holds of other studies is dropped: most of it is of older code or another specification. If it cannot be
    written anew it stays as it is.
    """
    with suppress(OutputError):
        journal.keep_only(key for piece in pieces for key in piece.noted_keys())


__all__ = ["Job", "Monitor", "NullMonitor", "Records", "Work", "compact", "run"]

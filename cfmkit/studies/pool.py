"""Process pool that retries a job once if its worker dies and gives it up if it exceeds its time; no other job is lost.

Each worker has pipes of its own, its standard input and output, and no lock is shared: killing one at any moment
leaves the others untouched. A thread for each worker sends it the work and waits for what it says: there is no other
way to wait for several pipes on Windows. A worker says when it starts a job, so that its death
is held against that job alone; jobs that were only waiting in its pipe go to others.
A job is tried a second time on a new worker and given up after two deaths. A job that
exceeds the time allowed, or runs when the time of all is up, is given up at once, with its worker.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import threading
import time
from collections import Counter, deque
from contextlib import suppress
from dataclasses import dataclass, field, replace
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError, UsageError
from cfmkit.numerics.one_blas_thread import ONE_THREAD
from cfmkit.results import Status
from cfmkit.studies import worker_process
from cfmkit.studies.serial_and_cluster_executors import BUG_PREFIX, Lost, never

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cfmkit.families.base import Family
    from cfmkit.specs.further_metrics import OwnMetric
    from cfmkit.studies.serial_and_cluster_executors import Executor, Stopping, Work

    Messages = SimpleQueue[tuple["_Worker", bytes | None]]

MAX_WORKER_DEATHS = 2  # a job is given up after so many of its workers have died
POLL_INTERVAL = 0.1  # seconds between two looks at the clock and at whether to stop
OUT_OF_TIME_MESSAGE = "the time allowed for all jobs was used up"
QUICK_JOB_DURATION, JOBS_AHEAD = 0.02, 4
"""Jobs that take less than so many seconds are handed out so many at a time: the pipe is never empty."""
MOST_STILLBORN = {True: 60, False: 4}
"""Workers in a row that may die before their first job: by a signal, and by themselves."""


@dataclass(eq=False)
class _Worker:
    """A process, the thread that listens to it, and the jobs it was given, the one it works on first."""

    process: subprocess.Popen[bytes]
    unfinished_jobs: deque[Any] = field(default_factory=deque)
    ready: bool = False
    started: float | None = None
    listener: threading.Thread = field(init=False)

    def listen(self, what: Iterable[bytes], messages: Messages) -> None:
        """Send registrations and work, then put (worker, message) on a queue as the worker reports; None at its end."""

        def serve() -> None:
            with suppress(OSError):
                for message in what:
                    worker_process.send(self.process.stdin, message)
                while (reported := worker_process.receive(self.process.stdout)) is not None:
                    messages.put((self, reported))
            messages.put((self, None))

        self.listener = threading.Thread(target=serve, daemon=True)
        self.listener.start()

    def give(self, job: Any) -> None:
        """Send a job, or keep it until the worker has the work."""
        self.unfinished_jobs.append(job)
        if self.ready:
            self.send(job)

    def begin(self) -> None:
        """Send the jobs that were kept."""
        self.ready = True
        for job in self.unfinished_jobs:
            self.send(job)

    def send(self, job: Any) -> None:
        # A broken pipe shows as the end of the other one in a moment.
        with suppress(OSError):
            worker_process.send(self.process.stdin, pickle.dumps(job))

    def end(self) -> None:
        """Kill the process and close the pipes."""
        self.process.kill()
        self.process.wait()
        self.listener.join()
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):  # what the dead process has not read
                pipe.close()  # type: ignore[union-attr]


@dataclass(frozen=True)
class Pool:
    """An executor that works in several processes."""

    processes: int  # how many
    timeout: float | None = None  # seconds that one job may take
    deadline: float | None = None  # when the time of all jobs is up, in `time.time` [s]

    def __call__(self, work: Work, jobs: Iterator[Any], stopping: Stopping = never) -> Iterator[tuple[Any, Any]]:
        """Yield (job, outcome) as they finish; a lost job's outcome is `Lost`.

        Raises CfmError if the processes cannot be started.
        """
        with _Crew(self, work, jobs, stopping) as crew:
            while crew.hand_out_jobs():
                yield from crew.collect_finished()


class _Crew:
    """The workers of one run and the jobs that are to be done again."""

    def __init__(self, pool: Pool, work: Work, jobs: Iterator[Any], stopping: Stopping) -> None:
        self.pool, self.jobs, self.stopping = pool, jobs, stopping
        self.workers: list[_Worker] = []
        self.again: deque[Any] = deque()
        self.deaths: Counter[Any] = Counter()
        self.stillborn = 0
        self.pace: float | None = None
        self.empty = False
        self.messages: Messages = SimpleQueue()
        self.what = pack_registrations(), pickle.dumps(work, pickle.HIGHEST_PROTOCOL)

    def __enter__(self) -> _Crew:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self.workers:
            worker.end()

    def hand_out_jobs(self) -> bool:
        """Hand out jobs, to new workers where there are too few; tell whether anything is going on."""
        for worker in self.workers:
            while len(worker.unfinished_jobs) < self._n_jobs_ahead() and (job := self._next()) is not None:
                worker.give(job)
        while len(self.workers) < self.pool.processes and (job := self._next()) is not None:
            self.workers.append(_start_worker())
            self.workers[-1].give(job)
            self.workers[-1].listen(self.what, self.messages)
        return any(worker.unfinished_jobs for worker in self.workers)

    def _n_jobs_ahead(self) -> int:
        return JOBS_AHEAD if self.pace is not None and self.pace < QUICK_JOB_DURATION else 1

    def _next(self) -> Any:
        """Return the next job, None if there is none now."""
        if self.stopping():
            return None
        if self.again:
            return self.again.popleft()
        job = None if self.empty else next(self.jobs, None)
        self.empty = job is None
        return job

    def collect_finished(self) -> Iterator[tuple[Any, Any]]:
        """Yield what has finished since the last look, or nothing after a short while."""
        with suppress(Empty):
            worker, message = self.messages.get(timeout=POLL_INTERVAL)
            while True:
                if worker in self.workers:
                    yield from self._remove_worker(worker) if message is None else self._handle_message(worker, message)
                worker, message = self.messages.get_nowait()
        yield from self._end_late_jobs()

    def _handle_message(self, worker: _Worker, message: bytes) -> Iterator[tuple[Any, Any]]:
        kind, rest = message[:1], message[1:]
        if kind == worker_process.READY_MESSAGE:
            worker.begin()
        elif kind == worker_process.STARTED_MESSAGE:
            worker.started, self.stillborn = time.monotonic(), 0
        else:
            took = time.monotonic() - (worker.started or 0.0)
            self.pace = took if self.pace is None else 0.9 * self.pace + 0.1 * took
            worker.started = None
            job, outcome = worker.unfinished_jobs.popleft(), pickle.loads(rest)
            if kind == worker_process.BROKEN_MESSAGE:
                outcome = Lost(Status.CRASHED, f"{BUG_PREFIX}{outcome[0]}", outcome[1])
            yield job, outcome

    def _remove_worker(self, worker: _Worker) -> Iterator[tuple[Any, Any]]:
        """Yield the job that a dead worker took with it, if it was the second time; do the rest again."""
        self.workers.remove(worker)
        worker.end()
        self._count_stillborn(worker)
        if worker.started is not None:
            job = worker.unfinished_jobs.popleft()
            self.deaths[job] += 1
            if self.deaths[job] < MAX_WORKER_DEATHS:
                self.again.appendleft(job)
            else:
                reported = (
                    f"the process that worked on this point died {MAX_WORKER_DEATHS} times "
                    f"({_describe_exit(worker.process.returncode)})"
                )
                yield job, Lost(Status.CRASHED, reported)
        self.again.extend(worker.unfinished_jobs)

    def _count_stillborn(self, worker: _Worker) -> None:
        if worker.started is not None or worker.ready:
            return
        self.stillborn += 1
        if self.stillborn >= MOST_STILLBORN[worker.process.returncode < 0]:
            raise CfmError(f"worker processes end before they begin ({_describe_exit(worker.process.returncode)})")

    def _end_late_jobs(self) -> Iterator[tuple[Any, Any]]:
        """Yield the jobs that have used up their time, and end their workers."""
        over = self.pool.deadline is not None and time.time() > self.pool.deadline
        if over:
            self.empty = True
            self.again.clear()
        elif self.pool.timeout is None:
            return
        now, allowed = time.monotonic(), self.pool.timeout
        # a worker that has not begun yet is still loading: with all time up nobody waits for it
        for worker in [
            worker for worker in self.workers if worker.unfinished_jobs and (over or worker.started is not None)
        ]:
            late = over or (allowed is not None and now - (worker.started or now) > allowed)
            if late:
                self.workers.remove(worker)
                worker.end()
                job = worker.unfinished_jobs.popleft()
                if not over:
                    self.again.extend(worker.unfinished_jobs)
                yield job, Lost(Status.TIMEOUT, OUT_OF_TIME_MESSAGE if over else f"not finished within {allowed:g} s")


def pack_registrations() -> bytes:
    """Return what a worker registers before it begins: families and metrics that were added to this process.

    Raises UsageError if another process cannot import one of them.
    """
    from cfmkit import families
    from cfmkit.specs import further_metrics

    records = families.list_registered().values()
    metrics = further_metrics.own_metrics().values()
    additions: list[Family | OwnMetric] = [*records, *metrics]
    for added in additions:
        try:
            sent = pickle.dumps(added)
        except (pickle.PicklingError, AttributeError, TypeError):
            sent = _MAIN_MODULE
        if _MAIN_MODULE in sent:
            raise UsageError(
                f"{added.name!r} cannot be computed in other processes: put it in a module that they can import, "
                "or use jobs=1"
            )
    entries = (
        [(families.register, record) for record in records],
        [(further_metrics.enter, metric) for metric in metrics],
    )
    return pickle.dumps([*entries[0], *entries[1]])


_MAIN_MODULE = b"__main__"
"""Name of the module of a notebook or a script, as pickles have it: in a worker it is another one."""


def give_up_at(executor: Executor, deadline: float | None) -> Executor:
    """Return an executor that gives up what runs at a deadline, in `time.time` [s]; as it is if it has one process."""
    return replace(executor, deadline=deadline) if isinstance(executor, Pool) else executor


def _describe_exit(code: int) -> str:
    import signal

    if code >= 0:
        return f"exit code {code}"
    with suppress(ValueError):
        return f"signal {signal.Signals(-code).name}"
    return f"signal {-code}"


def _start_worker() -> _Worker:
    """Return a new worker."""
    if not sys.executable:
        raise UsageError("this Python cannot start other processes; use one job (-j 1)")
    parent = os.getpid() if threading.current_thread() is threading.main_thread() else 0
    setup = json.dumps({"path": sys.path, "parent": parent})
    return _Worker(
        subprocess.Popen(
            [sys.executable, "-P", "-c", worker_process.WORKER_PROGRAM, setup],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | ONE_THREAD,
        )
    )

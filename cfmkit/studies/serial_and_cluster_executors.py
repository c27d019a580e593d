"""Executors of jobs, which yield outcomes as they finish: in this process, or on a Dask cluster.

``executor(work, jobs, stopping)`` yields (job, outcome) in any order. It pulls from `jobs` only as fast as it works,
and once ``stopping()`` is true it pulls no more, finishes what runs and ends. `cfmkit.studies.pool` is one, too.

A Dask cluster (`Cluster`) runs somewhere, or is started here for the study. A worker that dies costs its points a
second try elsewhere; a point whose workers die again is given up (``crashed``), as in a pool. What a worker needs
travels with each job, so that workers may come and go. A single point cannot be ended from outside.

Rows of a study are of one code and one set of libraries. The stamp of both travels with each job; a worker that has
another one computes nothing and is refused by name, whether it is there at the start or joins later.
"""

from __future__ import annotations

import gc
import logging
import os
import pickle
import re
import socket
import time
import traceback
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from cfmkit.errors import UsageError
from cfmkit.numerics.one_blas_thread import ONE_THREAD
from cfmkit.results import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    Stamp = Mapping[str, str]
    Work = Callable[[Any], Any]
    Stopping = Callable[[], bool]
    Executor = Callable[[Work, Iterator[Any], Stopping], Iterator[tuple[Any, Any]]]


BUG_PREFIX = "a bug in cfmkit: "
"""What the message of a job begins with that an exception ended which cfmkit does not raise on purpose."""


@dataclass(frozen=True)
class Lost:
    """The outcome of a job that nothing came back from."""

    status: Status
    message: str
    bug: str = ""


def lose_to_bug(error: Exception) -> Lost:
    """Return the outcome of a job that a bug ended, with its traceback."""
    return Lost(Status.CRASHED, f"{BUG_PREFIX}{_one_line(error)}", "".join(traceback.format_exception(error)))


def do_or_lose(work: Work, job: Any) -> Any:
    """Return what comes of a job; `Lost` where a bug ends it."""
    try:
        return work(job)
    except Exception as error:
        return lose_to_bug(error)


def never() -> bool:
    """Return False: go on."""
    return False


def serial(work: Work, jobs: Iterator[Any], stopping: Stopping = never) -> Iterator[tuple[Any, Any]]:
    """Do one job after the other in this process."""
    with garbage_collector() as collect:
        for job in jobs:
            if stopping():
                return
            yield job, work(job)
            collect()


COLLECTION_SHARE = 0.03  # of the time of a study that may go into freeing memory


@contextmanager
def garbage_collector() -> Iterator[Callable[[], None]]:
    """Yield a function to call after each job: it frees what finished jobs have left, if that is worth its time.

    Models keep arrays in objects that refer to each other: few objects, but 20 to 55 kB for each row of a sweep. Python
    counts objects and not their size, so that in a long study it would begin to collect them too late, or never. What
    is there before the study (all modules) is not looked through each time.
    """
    freezes = not gc.get_freeze_count()  # else the program around this does it
    if freezes:
        gc.freeze()
    ended, took = time.monotonic(), 0.0

    def collect() -> None:
        nonlocal ended, took
        begun = time.monotonic()
        if took > COLLECTION_SHARE * (begun - ended):
            return
        gc.collect()
        ended = time.monotonic()
        took = ended - begun

    try:
        yield collect
    finally:
        if freezes:
            gc.unfreeze()


def cores() -> int:
    """Return how many processors this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


LOCAL_CLUSTER = "local"
ADDRESS_PATTERN = re.compile(r"([a-z]+://)?[^\s/]+:[0-9]{1,5}")
MAX_RETRIES = 1  # other workers that get a job after its worker has died
JOBS_PER_THREAD = 4  # jobs under way for each thread of the cluster: none of them waits for this process
CONNECT_WITHIN = 10  # seconds to wait for a scheduler
WORKERS_WITHIN = 60  # seconds to wait for a worker, at the start and when all have left
POLL_INTERVAL = 0.2  # seconds between two looks at whether to stop


@dataclass(frozen=True)
class Cluster:
    """An executor that works on a Dask cluster."""

    address: str  # of the scheduler, ``tcp://host:8786``; ``local`` starts one here, with its workers
    workers: int = 1  # how many a local cluster has

    def __call__(self, work: Work, jobs: Iterator[Any], stopping: Stopping = never) -> Iterator[tuple[Any, Any]]:
        """Yield (job, outcome) as they finish; a lost job's outcome is `Lost`.

        Raises UsageError if Dask is not installed, the scheduler does not answer or goes away, there are no workers, or
        a worker has other code or libraries.
        """
        _refuse_odd(self.address)
        with _client(self.address, self.workers) as client:
            yield from _ClusterRun(client, self.address, work).outcomes(jobs, stopping)


def _refuse_odd(address: str) -> None:
    """Raise if an address cannot be one: Dask would try, and print its own errors."""
    if address != LOCAL_CLUSTER and not ADDRESS_PATTERN.fullmatch(address):
        raise UsageError(f"--cluster {address!r} is not an address; write e.g. tcp://host:8786, or local")


@contextmanager
def _client(address: str, workers: int) -> Iterator[Any]:
    """Yield a connection to a cluster; a local one ends with it."""
    try:
        import dask
        import distributed
    except ImportError:
        raise UsageError("--cluster needs Dask: pip install distributed") from None
    settings = {
        "distributed.scheduler.allowed-failures": MAX_RETRIES,
        "distributed.comm.timeouts.connect": CONNECT_WITHIN,
    }
    library: Any = distributed
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(settings))
        stack.enter_context(_silent_logs())
        place: Any = address
        if address == LOCAL_CLUSTER:
            place = stack.enter_context(
                library.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    host="127.0.0.1",
                    dashboard_address=None,
                    env=ONE_THREAD,
                    silence_logs=50,
                )
            )
        try:
            client = stack.enter_context(library.Client(place, timeout=CONNECT_WITHIN, set_as_default=False))
        except (OSError, ValueError) as error:
            reported = " ".join(str(error).split()) or type(error).__name__
            raise UsageError(f"--cluster {address}: no Dask scheduler answers there ({reported})") from None
        yield client


@contextmanager
def _silent_logs() -> Iterator[None]:
    """Keep Dask's log messages off the screen: what concerns the user is raised."""
    loggers = [logging.getLogger(name) for name in list(logging.root.manager.loggerDict) if _DASK_LOGGERS.match(name)]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


_DASK_LOGGERS = re.compile(r"(distributed|tornado)\b")
_RESUME_MESSAGE = "what is finished is kept: run the same command again to continue"


class _ClusterRun:
    """One study on a cluster that is connected."""

    def __init__(self, client: Any, address: str, work: Any) -> None:
        self.client, self.address, self.work = client, address, work
        self.family = work.study.spec.family
        self.stamp = stamp_of(self.family)
        self.finished: SimpleQueue[Any] = SimpleQueue()
        self.under_way: dict[Any, Any] = {}
        self.last_worker = time.monotonic()

    def outcomes(self, jobs: Iterator[Any], stopping: Stopping) -> Iterator[tuple[Any, Any]]:
        """Keep the cluster busy and yield what comes back."""
        self._wait_for_workers()
        self._refuse_other_code()
        empty = False
        while True:
            threads = self._threads()
            while not (empty or stopping()) and len(self.under_way) < JOBS_PER_THREAD * max(1, threads):
                job = next(jobs, None)
                empty = job is None
                if job is not None:
                    self._submit(job)
            if not self.under_way:
                return
            with suppress(Empty):
                future, job = self.under_way.pop(self.finished.get(timeout=POLL_INTERVAL).key)
                yield job, self._outcome(future)

    def _submit(self, job: Any) -> None:
        parcel = pickle.dumps(_parcel(self.work, job), pickle.HIGHEST_PROTOCOL)
        with self._check_connection():
            future = self.client.submit(do_parcel, dict(self.stamp), self.family, parcel, pure=False)
        self.under_way[future.key] = future, job
        future.add_done_callback(self.finished.put)

    def _outcome(self, future: Any) -> Any:
        """Return what came of a job."""
        if future.status == "finished":
            with self._check_connection():
                outcome = future.result()
            if isinstance(outcome, OtherCode):
                raise self._refusal(outcome.worker, outcome.stamp)
            return outcome
        error = future.exception() if future.status == "error" else None
        if error is None:
            raise self._connection_error()
        if type(error).__name__ == "KilledWorker":
            return Lost(Status.CRASHED, f"the workers that worked on this point died {MAX_RETRIES + 1} times")
        # `do_parcel` lets no error of a point out: this worker could not even read the job.
        self._refuse_other_code()
        raise UsageError(
            f"--cluster {self.address}: a worker cannot do this study ({_one_line(error)}); {_RESUME_MESSAGE}"
        )

    def _threads(self) -> int:
        """Return how many threads the workers have.

        Raises UsageError if the scheduler has gone, or there has been no worker for too long.
        """
        with self._check_connection():
            threads = int(sum(self.client.nthreads().values()))
        if threads:
            self.last_worker = time.monotonic()
        elif time.monotonic() - self.last_worker > WORKERS_WITHIN:
            raise self._no_workers(f"; {_RESUME_MESSAGE}")
        return threads

    def _wait_for_workers(self) -> None:
        with suppress(TimeoutError), self._check_connection():
            self.client.wait_for_workers(1, timeout=WORKERS_WITHIN)
            return
        raise self._no_workers()

    def _no_workers(self, more: str = "") -> UsageError:
        start = f"start some with 'dask worker {self.address}'"
        return UsageError(f"--cluster {self.address}: no worker for {WORKERS_WITHIN} s; {start}{more}")

    @contextmanager
    def _check_connection(self) -> Iterator[None]:
        """Raise if the scheduler has gone: it forgets the jobs of a client that it has lost."""
        if self.client.status != "running":
            raise self._connection_error()
        try:
            yield
        except TimeoutError:
            if self.client.status == "running":
                raise
            raise self._connection_error() from None
        except OSError:
            raise self._connection_error() from None

    def _connection_error(self) -> UsageError:
        return UsageError(f"--cluster {self.address}: the Dask scheduler has gone; {_RESUME_MESSAGE}")

    def _refuse_other_code(self) -> None:
        """Raise if a worker that is there now has other code; it may be too old to compare stamps itself."""
        with self._check_connection():
            stamps = self.client.run(_stamp_function(self.family), on_error="return")
        for worker, stamp in sorted(stamps.items()):
            if stamp != self.stamp:
                raise self._refusal(worker, stamp)

    def _refusal(self, worker: str, stamp: Stamp | Exception) -> UsageError:
        if isinstance(stamp, Exception):
            problem = f"cannot import this cfmkit ({_one_line(stamp)})"
        else:
            ours = self.stamp
            differing = [key for key in {**ours, **stamp} if stamp.get(key) != ours.get(key)]
            problem = "has other code: " + ", ".join(
                f"{key} {_short(stamp.get(key))} instead of {_short(ours.get(key))}" for key in differing
            )
        cure = "install the same on every worker and start it again"
        return UsageError(f"--cluster {self.address}: the worker {worker} {problem}; {cure}")


def _short(version: str | None) -> str:
    """Return a version, or the first digits of a hash, for a message."""
    return "none" if version is None else version[:12]


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def stamp_of(family: str) -> Stamp:
    """Return what a row of a study follows from beside its specification: code and libraries of this process."""
    return _stamp_function(family)()


def _stamp_function(family: str) -> Callable[[], Stamp]:
    """Return a function that Dask sends as code, because it is inside another one: an older worker has none such."""

    def stamp() -> Stamp:
        from cfmkit.families import origin as family_origin
        from cfmkit.store import origin

        return origin() | {f"family {key}": value for key, value in family_origin(family).items()}

    return stamp


@dataclass(frozen=True)
class OtherCode:
    """The outcome of a job on a worker whose code or libraries are not those of the study."""

    worker: str
    stamp: Stamp


def _parcel(work: Any, job: Any) -> tuple[Any, Any]:
    """Return work and job with nothing but this job's points in it."""
    plan = work.plan.part(job.start, job.stop)
    return replace(work, plan=plan), replace(job, start=0, stop=job.stop - job.start)


def do_parcel(stamp: Stamp, family: str, parcel: bytes) -> Any:
    """Do a job on a worker of the cluster, if it has the code of the study."""
    ours = _stamp_of_worker(family)
    if ours != stamp:
        return OtherCode(_worker_name(), ours)
    work, job = _unpack(parcel)
    return do_or_lose(work, job)


@lru_cache(maxsize=8)
def _stamp_of_worker(family: str) -> Stamp:
    return stamp_of(family)


@lru_cache(maxsize=1)
def _unpack(parcel: bytes) -> Any:
    return pickle.loads(parcel)


def _worker_name() -> str:
    """Return address and host of the worker that this runs on."""
    from distributed import get_worker

    return f"{get_worker().address} on {socket.gethostname()}"

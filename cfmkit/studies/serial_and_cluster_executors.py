"""How work gets done: an executor takes jobs as they come and yields outcomes as they finish.

``executor(work, jobs, stopping)`` yields (job, outcome) in any order. It pulls from
`jobs` only as fast as it works, and once ``stopping()`` is true it pulls no more,
finishes what runs and ends. `serial` is the simplest, `Cluster` hands jobs to Dask;
`cfmkit.studies.pool` has processes of this computer.

An executor on a Dask cluster: one that runs somewhere, or one that is started here for the study. A worker that dies
costs its points a second try elsewhere; a point whose workers die again is given up (``crashed``), as in a pool. What
a worker needs travels with each job, so that workers may come and go. A single point cannot be ended from outside.
"""

from __future__ import annotations

import os
import pickle
import re
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
    from collections.abc import Callable, Iterator

    Work = Callable[[Any], Any]
    Stopping = Callable[[], bool]
    Executor = Callable[[Work, Iterator[Any], Stopping], Iterator[tuple[Any, Any]]]


BUG = "a bug in cfmkit: "
"""What the message of a job begins with that an exception ended which cfmkit does not raise on purpose."""


@dataclass(frozen=True)
class Lost:
    """The outcome of a job that nothing came back from."""

    status: Status
    message: str
    bug: str = ""


def lost_to(error: Exception) -> Lost:
    """Return the outcome of a job that a bug ended, with its traceback."""
    reported = " ".join(f"{type(error).__name__}: {error}".split())
    return Lost(Status.CRASHED, f"{BUG}{reported}", "".join(traceback.format_exception(error)))


def surviving(work: Work, job: Any) -> Any:
    """Return what comes of a job; `Lost` where a bug ends it."""
    try:
        return work(job)
    except Exception as error:
        return lost_to(error)


def never() -> bool:
    """Return False: go on."""
    return False


def serial(work: Work, jobs: Iterator[Any], stopping: Stopping = never) -> Iterator[tuple[Any, Any]]:
    """Do one job after the other in this process."""
    for job in jobs:
        if stopping():
            return
        yield job, work(job)


def cores() -> int:
    """Return how many processors this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


LOCAL = "local"
ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:[0-9]{1,5}")
RETRIES = 1
"""Other workers that get a job after its worker has died."""

AHEAD = 4
"""Jobs under way for each thread of the cluster: none of them waits for this process."""

CONNECT_WITHIN = 10
"""Seconds to wait for a scheduler."""

PATIENCE = 0.2
"""Seconds between two looks at whether to stop."""


@dataclass(frozen=True)
class Cluster:
    """An executor that works on a Dask cluster.

    Attributes
    ----------
    address : str
        Of the scheduler, ``tcp://host:8786``; ``local`` starts one here, with its workers.
    workers : int
        How many a local cluster has.
    """

    address: str
    workers: int = 1

    def __call__(self, work: Work, jobs: Iterator[Any], stopping: Stopping = never) -> Iterator[tuple[Any, Any]]:
        """Yield (job, outcome) as they finish; a lost job's outcome is `Lost`.

        Raises
        ------
        cfmkit.errors.UsageError
            If Dask is not installed, or the scheduler does not answer.
        """
        _refuse_odd(self.address)
        with _client(self.address, self.workers) as client:
            yield from _worked(client, work, jobs, stopping)


def _refuse_odd(address: str) -> None:
    """Raise if an address cannot be one: Dask would try, and print its own errors."""
    if address != LOCAL and not ADDRESS.fullmatch(address):
        raise UsageError(f"--cluster {address!r} is not an address; write e.g. tcp://host:8786, or local")


@contextmanager
def _client(address: str, workers: int) -> Iterator[Any]:
    """Yield a connection to a cluster; a local one ends with it."""
    try:
        import dask
        import distributed
    except ImportError:
        raise UsageError("--cluster needs Dask: pip install 'cfmkit[cluster]'") from None
    settings = {"distributed.scheduler.allowed-failures": RETRIES, "distributed.comm.timeouts.connect": CONNECT_WITHIN}
    library: Any = distributed
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(settings))
        place: Any = address
        if address == LOCAL:
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


def _worked(client: Any, work: Work, jobs: Iterator[Any], stopping: Stopping) -> Iterator[tuple[Any, Any]]:
    """Keep the cluster busy and yield what comes back."""
    finished: SimpleQueue[Any] = SimpleQueue()
    under_way: dict[Any, Any] = {}
    empty = False
    while True:
        while not (empty or stopping()) and len(under_way) < AHEAD * max(1, sum(client.nthreads().values())):
            job = next(jobs, None)
            empty = job is None
            if job is not None:
                parcel = pickle.dumps(_parcel(work, job), pickle.HIGHEST_PROTOCOL)
                future = client.submit(_do, parcel, pure=False)
                under_way[future.key] = future, job
                future.add_done_callback(finished.put)
        if not under_way:
            return
        with suppress(Empty):
            future, job = under_way.pop(finished.get(timeout=PATIENCE).key)
            yield job, _outcome(future)


def _parcel(work: Any, job: Any) -> tuple[Any, Any]:
    """Return work and job with nothing but this job's points in it."""
    plan = work.plan.part(job.start, job.stop)
    return replace(work, plan=plan), replace(job, start=0, stop=job.stop - job.start)


def _do(parcel: bytes) -> Any:
    """Do a job on a worker of the cluster."""
    work, job = _unpacked(parcel)
    return work(job)


@lru_cache(maxsize=1)
def _unpacked(parcel: bytes) -> Any:
    return pickle.loads(parcel)


def _outcome(future: Any) -> Any:
    if future.status == "finished":
        return future.result()
    error = future.exception() if future.status == "error" else None
    reported = " ".join(f"{type(error).__name__}: {error}".split()) if error else "the cluster abandoned it"
    if type(error).__name__ == "KilledWorker":
        reported = f"the workers that worked on this point died {RETRIES + 1} times"
        return Lost(Status.CRASHED, reported)
    return Lost(Status.CRASHED, f"{BUG}{reported}")

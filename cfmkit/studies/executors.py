"""How work gets done: an executor takes jobs as they come and yields outcomes as they finish.

``executor(work, jobs, stopping)`` yields (job, outcome) in any order. It pulls from
`jobs` only as fast as it works, and once ``stopping()`` is true it pulls no more,
finishes what runs and ends. `serial` is the simplest; `cfmkit.studies.pool` and
`cfmkit.studies.cluster` have the others.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.results import Status

    Work = Callable[[Any], Any]
    Stopping = Callable[[], bool]
    Executor = Callable[[Work, Iterator[Any], Stopping], Iterator[tuple[Any, Any]]]

ONE_THREAD = {
    name: "1"
    for name in (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "BLIS_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    )
}
"""What keeps the libraries of a process to one thread: processes share the cores, and sums come out the same."""


@dataclass(frozen=True)
class Lost:
    """The outcome of a job that nothing came back from."""

    status: Status
    message: str
    bug: str = ""


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

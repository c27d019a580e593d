"""The wall time of a task, as the other benchmarks take it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


def best(task: Callable[[], object], rounds: int = 7) -> float:
    """Return the least wall time of a task over some rounds [s]: what else the machine does only adds to it."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        task()
        times.append(time.perf_counter() - start)
    return min(times)

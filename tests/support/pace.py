"""Time in tests: processor time in units of a known task, so that no test fails on a slow machine; waiting."""

from __future__ import annotations

import time
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@cache
def usual(task: Callable[[], object]) -> float:
    """Return the least processor time of a task in ten rounds [s]."""
    spent = []
    for _ in range(10):
        start = time.process_time()
        task()
        spent.append(time.process_time() - start)
    return min(spent)


@contextmanager
def within(times: float, task: Callable[[], object]) -> Iterator[None]:
    """Check that the block takes no longer than a task would so many times."""
    limit, start = times * usual(task), time.process_time()
    yield
    spent = time.process_time() - start
    assert spent < limit, f"{spent:.3g} s, allowed is {times:g} times the usual task, {limit:.3g} s"


def wait_until(condition: Callable[[], bool], seconds: float) -> None:
    """Wait until a condition holds; fail if it does not in so many seconds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.02)

"""BLAS on one thread: while a function runs (a decorator), or in a whole process (environment variables).

BLAS libraries start as many threads as there are cores, which wait for each other busily: frequencies of a network of
beams took 14 s of time and 28 s of processor time in Python, and 1.9 s with one thread. Commands ask for one thread by
environment variables, before a library is loaded; a program in Python has mostly loaded it before.
"""

from __future__ import annotations

import functools
import os
from typing import TYPE_CHECKING, ParamSpec, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

Arguments = ParamSpec("Arguments")
ReturnT = TypeVar("ReturnT")
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)  # variables of the environment that libraries read when they are loaded: who sets one has chosen how many threads
ONE_THREAD = dict.fromkeys(THREAD_VARIABLES, "1")
"""What keeps the libraries of a process to one thread: processes share the cores, and sums come out the same."""


def one_blas_thread(function: Callable[Arguments, ReturnT]) -> Callable[Arguments, ReturnT]:
    """Return the function with one thread for BLAS while it runs, unless the environment chooses how many."""

    @functools.wraps(function)
    def call_limited(*arguments: Arguments.args, **options: Arguments.kwargs) -> ReturnT:
        if any(name in os.environ for name in THREAD_VARIABLES):
            return function(*arguments, **options)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return function(*arguments, **options)

    return call_limited

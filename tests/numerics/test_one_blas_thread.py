"""BLAS keeps to one thread in rooms that ask for it, and to what the environment says where it says something."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from cfmkit.numerics.one_blas_thread import THREAD_VARIABLES, one_blas_thread
from cfmkit.solid import DrivenPart


@one_blas_thread
def threads() -> set[int]:
    """Return the numbers of threads of the BLAS libraries that are loaded."""
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.mark.parametrize(("variable", "within"), [(None, {1}), ("OMP_NUM_THREADS", {2})])
def test_blas_has_one_thread_inside_unless_the_environment_says_how_many(monkeypatch, variable, within):
    assert np.linalg.norm(np.eye(2)) > 0
    for name in THREAD_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    if variable is not None:
        monkeypatch.setenv(variable, "2")
    with threadpool_limits(2, user_api="blas"):
        assert threads() == within
        assert threads.__wrapped__() == {2}


def test_solids_ask_for_one_thread():
    assert DrivenPart.solve.__wrapped__ is not None

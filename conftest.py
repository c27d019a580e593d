"""Settings of all tests.

The families in `plugins` take part, installed or not. Property tests try the same examples in every run, unless a
search for new ones is requested: ``CFMKIT_TEST_SEARCH=1 pytest`` draws new examples.
"""

from __future__ import annotations

import os
from pathlib import Path

import blas_threads  # noqa: F401 before numpy
import plugin_support
import pytest
from hypothesis import settings

plugin_support.register()

settings.register_profile("repeat", derandomize=True)
settings.register_profile("search", derandomize=False)
settings.load_profile("search" if os.environ.get("CFMKIT_TEST_SEARCH") else "repeat")


SLOW_CASES = Path(__file__).parent / "tests" / "slow_cases.txt"


@pytest.hookimpl(tryfirst=True)  # before pytest itself picks by marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the cases that are listed as slow."""
    listed = {line for line in SLOW_CASES.read_text(encoding="utf-8").splitlines() if not line.startswith("#")}
    for item in items:
        if item.nodeid in listed:
            item.add_marker(pytest.mark.slow)

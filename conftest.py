"""Settings of all tests.

The families in `plugins` take part, installed or not. Property tests try the same examples in every run, unless a
search for new ones is requested: ``CFMKIT_TEST_SEARCH=1 pytest`` draws new examples.
"""

from __future__ import annotations

import gc
import os
from pathlib import Path
from typing import TYPE_CHECKING

import blas_threads  # noqa: F401 before numpy
import plugin_support
import pytest
import sources
from hypothesis import settings

if TYPE_CHECKING:
    from collections.abc import Iterator

plugin_support.register()

os.environ["COLUMNS"] = "110"  # as redirected output: no text depends on the terminal in which tests run

settings.register_profile("repeat", derandomize=True)
settings.register_profile("search", derandomize=False)
settings.load_profile("search" if os.environ.get("CFMKIT_TEST_SEARCH") else "repeat")


gc.set_threshold(100_000, 20, 20)  # by default half the time of collecting tests is a search for garbage


@pytest.fixture(scope="module", autouse=True)
def _trees_are_forgotten() -> Iterator[None]:
    """Forget the trees of the source after a file whose tests have read them."""
    yield
    sources.forget()


@pytest.fixture(autouse=True)
def _registrations_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave neither metrics nor families that a test registers to the next one."""
    from cfmkit import families
    from cfmkit.specs import further_metrics

    monkeypatch.setattr(further_metrics, "_METRICS_BY_NAME", {})
    monkeypatch.setattr(further_metrics, "_TABLE_STAMP", [""])
    monkeypatch.setattr(families, "_REGISTERED_FAMILIES", {})
    monkeypatch.setattr(families, "_REGISTRATION_STAMPS", {})
    monkeypatch.setattr(families, "_WITH_OWN_METRICS", {})


SLOW_CASES = Path(__file__).parent / "tests" / "slow_cases.txt"


@pytest.hookimpl(tryfirst=True)  # before pytest itself picks by marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the cases that are listed as slow."""
    listed = {line for line in SLOW_CASES.read_text(encoding="utf-8").splitlines() if not line.startswith("#")}
    for item in items:
        if item.nodeid in listed:
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish() -> None:
    """Hide what collecting left, ten thousand tests, from the garbage collector, which walks all it sees again."""
    gc.collect()
    gc.freeze()

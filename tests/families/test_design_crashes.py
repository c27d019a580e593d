"""A fault of the program in the starts of a design is reported as one, never as targets that cannot be met."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import cfmkit
from cfmkit import Run
from cfmkit.results import Status
from cfmkit.studies import Lost, serial

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

CONFIGS = Path(__file__).parents[2] / "configs"
FAULT = "a bug in cfmkit: ZeroDivisionError: division by zero"


def all_lost(work: Any, jobs: Iterator[int], stopping: Callable[[], bool]) -> Iterator[tuple[int, Lost]]:
    """Do no job: the process of each died."""
    for job in jobs:
        yield job, Lost(Status.CRASHED, FAULT)


def broken(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError


@pytest.mark.parametrize(
    ("name", "changes"), [("beam_design_arch", []), ("slider_crank_taper_design", ["design.beam.seeds=2"])]
)
def test_a_design_all_of_whose_starts_crash_ends_as_a_bug(name: str, changes: list[str]) -> None:
    design = cfmkit.design(cfmkit.load(CONFIGS / f"{name}.yaml", changes), Run(executor=all_lost))
    assert design.status is Status.CRASHED
    assert design.message == f"no start was completed: {FAULT}"


@pytest.mark.parametrize(
    ("name", "function"),
    [
        ("beam_design_arch", "beam.shaping.multistart.search_start"),
        ("slider_crank_taper_design", "slider_crank.printed.strip_thickness_search.descend"),
    ],
)
def test_a_fault_in_the_process_itself_is_not_swallowed(
    name: str, function: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"cfmkit.families.{function}", broken)
    with pytest.raises(ZeroDivisionError):
        cfmkit.design(cfmkit.load(CONFIGS / f"{name}.yaml"), Run(executor=serial))

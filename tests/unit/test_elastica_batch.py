"""Many networks at once: the same numbers in the same order, whatever is the number of processes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest
from batch_networks import bent, last_effort, standing

from cfmkit.elastica import (
    Control,
    Displacement,
    Network,
    PathStatus,
    trace,
    trace_many,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

DRIVE = Displacement("d", -np.pi / 2, np.array([1e-3, 2e-3]))


def test_a_batch_gives_each_network_its_own_curve_in_order() -> None:
    sweeps = [0.3, -0.5, 0.9]
    found = list(trace_many([bent(s) for s in sweeps], DRIVE))
    for sweep, outcome in zip(sweeps, found, strict=True):
        path = trace(bent(sweep), DRIVE)
        assert outcome.status == PathStatus.COMPLETE.name
        np.testing.assert_array_equal(outcome.value.effort, path.effort[path.at_requested])


def test_a_network_that_cannot_exist_fails_alone() -> None:
    closed = bent(2 * np.pi)
    found = list(trace_many([bent(0.3), closed, bent(0.5)], DRIVE, Control(tolerance=1e-6)))
    assert [outcome.status for outcome in found] == ["COMPLETE", "INVALID", "COMPLETE"]
    assert "returns to its start" in found[1].message
    assert found[1].value is None


def test_two_processes_give_the_same_as_one() -> None:
    networks = [bent(s) for s in (0.2, 0.4, 0.6, 0.8)]
    one, two = (list(trace_many(networks, DRIVE, workers=w)) for w in (1, 2))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.value.effort, b.value.effort)


@pytest.mark.parametrize("workers", [1, 2])
def test_functions_are_called_for_networks_where_they_are_traced(workers: int) -> None:
    heights = [0.03, 0.0, 0.02]  # the second one cannot be built
    found = list(trace_many([partial(standing, h) for h in heights], DRIVE, workers=workers))
    assert [outcome.status for outcome in found] == ["COMPLETE", "INVALID", "COMPLETE"]
    assert "thickness must be positive" in found[1].message
    path = trace(standing(0.03), DRIVE)
    np.testing.assert_array_equal(found[0].value.effort, path.effort[path.at_requested])


def test_what_a_function_collects_comes_from_processes_as_it_is() -> None:
    found = list(trace_many([bent(0.3), bent(2 * np.pi), bent(0.5)], DRIVE, collect=last_effort, workers=2))
    assert [outcome.value for outcome in found] == [
        last_effort(trace(bent(0.3), DRIVE)),
        None,
        last_effort(trace(bent(0.5), DRIVE)),
    ]


@pytest.mark.parametrize(("workers", "most"), [(1, 1), (2, 5 * 64)])
def test_networks_are_taken_as_they_are_needed(workers: int, most: int) -> None:
    """Endlessly many networks do not fill the memory."""
    taken = 0

    def endless() -> Iterator[Network]:
        nonlocal taken
        while True:
            taken += 1
            yield bent(0.3)

    outcomes = trace_many(endless(), DRIVE, Control(tolerance=1e-4), workers=workers)
    assert next(outcomes).status == "COMPLETE"
    outcomes.close()  # type: ignore[attr-defined]
    assert 1 <= taken <= most

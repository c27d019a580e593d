"""Many networks at once: the same numbers in the same order, whatever is the number of processes."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest
from batch_networks import bent, last_effort, standing, two_leaves

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.march import engine
from cfmkit.elastica.tracing.trace_many import follow_alike

if TYPE_CHECKING:
    from collections.abc import Iterator

LEAVES = el.Displacement("d", np.pi, np.linspace(0, 5e-3, 17)[1:])
DRIVE = el.Displacement("d", -np.pi / 2, np.array([1e-3, 2e-3]))


def test_networks_of_one_topology_are_followed_together_within_the_tolerance() -> None:
    rng, tolerance = np.random.default_rng(3), 1e-5
    networks = [two_leaves(*(1 + 0.1 * rng.standard_normal(6))) for _ in range(20)]
    path = el.trace(networks[0], LEAVES, el.Control(tolerance=tolerance))
    together = follow_alike(path, networks[1:], el.Control(tolerance=tolerance))
    if engine() == "C":
        assert together is not None
        assert np.isfinite(together).all()
    found = list(el.trace_many(networks, LEAVES, el.Control(tolerance=tolerance)))
    for network, outcome in zip(networks, found, strict=True):
        path = el.trace(network, LEAVES, el.Control(tolerance=1e-10))
        exact = path.effort[path.at_requested]
        assert outcome.value.effort == pytest.approx(exact, abs=tolerance * np.abs(exact).max())
        assert outcome.value.drive == pytest.approx(LEAVES.points, rel=1e-15)
        assert outcome.value.stable.all()


@pytest.mark.skipif(engine() != "C", reason="networks are followed together by compiled code")
def test_networks_are_traced_by_themselves_if_they_buckle_or_differ_in_their_make_up() -> None:
    leaves = two_leaves()
    straight = {name: replace(beam, shape=el.STRAIGHT_SHAPE) for name, beam in leaves.beams.items()}
    columns = replace(leaves, beams=straight)
    sprung = replace(leaves, springs=(el.SlideSpring("d", 0.0, 100.0),))
    pinned = replace(leaves, nodes=leaves.nodes | {"b": el.Node(0, 0.01, el.PINNED_SUPPORT)})
    others = [columns, sprung, pinned, two_leaves(thick=0.7)]
    path = el.trace(two_leaves(1), LEAVES)
    together = follow_alike(path, others, el.Control())
    assert together is not None
    assert np.isfinite(together).all(axis=1).tolist() == [False, False, False, True]
    for network, outcome in zip(others, list(el.trace_many([leaves, *others], LEAVES))[1:], strict=True):
        alone = el.trace(network, LEAVES)
        assert outcome.status == alone.status.name
        assert outcome.value.effort == pytest.approx(alone.effort[alone.at_requested], rel=1e-6)
        assert (outcome.value.stable == alone.stable[alone.at_requested]).all()


@pytest.mark.skipif(engine() != "C", reason="networks are followed together by compiled code")
def test_nothing_is_followed_with_a_network_that_bears_something_at_rest_or_is_made_imperfect() -> None:
    leaves = two_leaves()
    loaded = replace(leaves, loads=(el.PointLoad("d", fx=0.1),))
    tight = replace(leaves, springs=(el.SlideSpring("d", 0.0, 100.0, free_displacement=1e-3),))
    for network in (loaded, tight):
        assert follow_alike(el.trace(network, LEAVES), [network], el.Control()) is None
    assert follow_alike(el.trace(leaves, LEAVES), [leaves], el.Control(imperfection=1e-4)) is None
    assert follow_alike(el.trace(leaves, LEAVES), [leaves], el.Control()) is not None


def test_two_processes_give_the_same_as_one() -> None:
    networks = [bent(s) for s in (0.2, 0.4, 0.6, 0.8)]
    one, two = (list(el.trace_many(networks, DRIVE, workers=w)) for w in (1, 2))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.value.effort, b.value.effort)


@pytest.mark.parametrize("workers", [1, 2])
def test_functions_are_called_for_networks_where_they_are_traced(workers: int) -> None:
    heights = [0.03, 0.0, 0.02]  # the second one cannot be built
    found = list(el.trace_many([partial(standing, h) for h in heights], DRIVE, workers=workers))
    assert [outcome.status for outcome in found] == ["COMPLETE", "INVALID", "COMPLETE"]
    assert "thickness must be positive" in found[1].message
    path = el.trace(standing(0.03), DRIVE)
    np.testing.assert_array_equal(found[0].value.effort, path.effort[path.at_requested])


def test_what_a_function_collects_comes_from_processes_as_it_is() -> None:
    found = list(el.trace_many([bent(0.3), bent(2 * np.pi), bent(0.5)], DRIVE, collect=last_effort, workers=2))
    assert [outcome.value for outcome in found] == [
        last_effort(el.trace(bent(0.3), DRIVE)),
        None,
        last_effort(el.trace(bent(0.5), DRIVE)),
    ]


@pytest.mark.parametrize(("workers", "most"), [(1, 256), (2, 5 * 256)])
def test_networks_are_taken_as_they_are_needed(workers: int, most: int) -> None:
    """Endlessly many networks do not fill the memory."""
    taken = 0

    def endless() -> Iterator[el.Network]:
        nonlocal taken
        while True:
            taken += 1
            yield bent(0.3)

    outcomes = el.trace_many(endless(), DRIVE, el.Control(tolerance=1e-4), workers=workers)
    assert next(outcomes).status == "COMPLETE"
    outcomes.close()  # type: ignore[attr-defined]
    assert 1 <= taken <= most

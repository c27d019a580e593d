"""Derivatives of the outputs of Lan's network by its design variables: what they agree with, and what has none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from varied_networks import LAN, lan

from cfmkit.elastica import (
    Control,
    Displacement,
    gradient,
    trace,
)
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.equations import NumpyEquations, SolvedStates
from cfmkit.errors import InputError

FINE = Control(tolerance=1e-11)


def test_force_is_proportional_to_the_modulus_and_the_gradient_knows() -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([5e-3])), FINE)
    found = gradient(path, lan, LAN)
    assert found.effort[0, 13] * LAN[13] == pytest.approx(path.effort[-1], rel=1e-9)
    np.testing.assert_allclose(found.motion("n3")[:, :, 13], 0, atol=1e-12)


def test_efforts_are_the_same_with_all_unknowns_and_without_them() -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([2e-3, 6e-3])), FINE)
    alone, last = gradient(path, lan, LAN), gradient(path, lan, LAN)
    assert last.unknowns.shape == (2, len(LAN), path.mesh.size)
    np.testing.assert_allclose(alone.effort, last.effort, rtol=1e-9)


def test_states_at_other_elements_and_fractions_are_not_mistaken_for_each_other() -> None:
    """Their numbers in a row are the same: elements 0 and 1 at 0.5, and element 0 at 1 and 0.5."""
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([2e-3])), Control(tolerance=1e-5))
    slopes = gradient(path, lan, LAN)
    two_elements, two_places = slopes.dual_states([0, 1], [0.5]).x, slopes.dual_states([0], [1, 0.5]).x
    assert two_elements.shape == two_places.shape == (1, 2)
    assert (two_elements.value != two_places.value).any()


@pytest.mark.parametrize("output", ["effort", "unknowns", "energy"])
def test_a_singular_tangent_is_told_where_a_derivative_is_asked_for(
    output: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([2e-3])), Control(tolerance=1e-5))
    found = gradient(path, lan, LAN)
    for kind in (NumpyEquations, CompiledEquations):
        monkeypatch.setattr(kind, "solve_each", nowhere)
        monkeypatch.setattr(kind, "resolve", singular)
    with pytest.raises(InputError, match="singular"):
        getattr(found, output)


def nowhere(_: Any, free: Any, way: Any, **options: Any) -> SolvedStates:
    """Return what is told where Newton's method does not converge."""
    unknown = np.full(free.shape, np.nan)
    return SolvedStates(np.zeros(len(way), bool), unknown, unknown, np.zeros(len(way), int), unknown[:, 0])


def singular(*_: Any) -> None:
    raise np.linalg.LinAlgError

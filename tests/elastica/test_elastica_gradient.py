"""Derivatives by design variables against differences of high order, for Lan's network and one with offsets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from varied_networks import LAN, arms, lan

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


@pytest.mark.parametrize(
    ("build", "x", "node", "watched"),
    [(lan, LAN, "n5", "n3"), (arms, np.array([1.3e-3, 4e-3, 2e-3, 3e-3]), "d", "b")],
)
def test_gradients_are_those_of_differences(build: Any, x: np.ndarray, node: str, watched: str) -> None:
    drive = Displacement(node, -np.pi / 2, np.array([2e-3, 6e-3]))
    path = trace(build(x), drive, FINE)
    found = gradient(path, build, x)
    for k in range(len(x)):
        h = 1e-3 * abs(x[k])
        effort, motion = [], []
        for step in (-2, -1, 1, 2):
            moved = x.copy()
            moved[k] += step * h
            p = trace(build(moved), drive, FINE)
            effort.append(p.effort[p.at_requested])
            motion.append(p.motion(watched)[p.at_requested])
        for values, exact in ((effort, found.effort[:, k]), (motion, found.motion[watched][:, :, k])):
            slope = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)
            np.testing.assert_allclose(exact, slope, rtol=1e-6, atol=2e-7 * np.abs(slope).max() + 1e-11)


def test_force_is_proportional_to_the_modulus_and_the_gradient_knows() -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([5e-3])), FINE)
    found = gradient(path, lan, LAN)
    assert found.effort[0, 13] * LAN[13] == pytest.approx(path.effort[-1], rel=1e-9)
    np.testing.assert_allclose(found.motion["n3"][:, :, 13], 0, atol=1e-12)


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

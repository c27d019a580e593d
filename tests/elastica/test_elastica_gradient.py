"""Derivatives of the outputs of Lan's network by its design variables: what they agree with, and what has none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from varied_networks import LAN, lan

import cfmkit.elastica as el
from cfmkit.elastica import Control, Displacement, gradient, trace
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


def hinged(x: Any, offset: Any = (0.0, 0.0)) -> el.Network:
    """Return two beams that meet at a hinge, whose pin is moved away from its node by x [m]."""
    section = el.Section(2e9, 8e-3, 1e-3, axial=False)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(0.05, 0.03),
        "pin": el.Node(0.05 + x[0], 0.03 + x[1]),
        "c": el.Node(0.1, 0, el.CLAMPED_SUPPORT),
    }
    beams = {
        "ab": el.Beam("a", "b", section, el.arc(1.0)),
        "pc": el.Beam("pin", "c", section, el.arc(0.7), start_offset=offset),
    }
    springs = (el.TorsionSpring("b", "pin", 0.05),)
    return el.Network(nodes, beams, (el.Link("b", "pin", turns=False),), springs)


def test_a_pin_may_be_moved_away_from_its_node() -> None:
    """Its arm turns with the node, not with the pin: efforts of neighbours by central differences."""
    drive, step = el.Rotation("b", np.array([0.2])), 1e-5
    slopes = gradient(trace(hinged(np.zeros(2)), drive, FINE), hinged, np.zeros(2)).effort[0]
    for k, shift in enumerate(step * np.eye(2)):
        ahead, behind = (trace(hinged(sign * shift), drive, FINE).effort[-1] for sign in (1, -1))
        assert slopes[k] == pytest.approx((ahead - behind) / (2 * step), rel=1e-6)


def test_a_pin_with_an_offset_cannot_be_moved_away_from_its_node() -> None:
    path = trace(hinged(np.zeros(2), (0.002, 0.0)), el.Rotation("b", np.array([0.2])))
    with pytest.raises(InputError, match="make-up"):
        gradient(path, lambda x: hinged(x, (0.002, 0.0)), np.zeros(2))


def nowhere(_: Any, free: Any, way: Any, **options: Any) -> SolvedStates:
    """Return what is told where Newton's method does not converge."""
    unknown = np.full(free.shape, np.nan)
    return SolvedStates(np.zeros(len(way), bool), unknown, unknown, np.zeros(len(way), int), unknown[:, 0])


def singular(*_: Any) -> None:
    raise np.linalg.LinAlgError

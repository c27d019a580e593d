"""Derivatives by design variables against differences of high order, for Lan's network and one with offsets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lan_2010 import SHAPES, half

from cfmkit.elastica import (
    CLAMPED,
    Beam,
    Control,
    Displacement,
    LineLoad,
    Link,
    Network,
    Node,
    Polynomial,
    Section,
    Taper,
    gradient,
    guided,
    trace,
)
from cfmkit.elastica.kernels import compiled
from cfmkit.errors import InputError

FINE = Control(tolerance=1e-11)
LAN = np.array([1.877, 3.05, 1.244, 2.40, 1.3092, -1.5707, -0.7560, 1.5707, 0.3013, 1.5707, 0.226, -1.148, 1.0, 2.0])


def lan(x: Any) -> Network:
    """Node positions [cm], shape coefficients, thickness [mm] and modulus [GPa] of Lan's network, extensible."""
    nodes = {"n3": (x[1] * 1e-2, x[0] * 1e-2), "n4": (x[2] * 1e-2, x[3] * 1e-2)}
    varied = {name: (shape[0], x[4 + 2 * k], x[5 + 2 * k]) for k, (name, (_, _, shape)) in enumerate(SHAPES.items())}
    return half(Section(x[13] * 1e9, 10e-3, x[12] * 1e-3), nodes=nodes, coefficients=varied)


def arms(x: Any) -> Network:
    """A tapered beam on a rigid arm, with its weight, and a linked node whose places vary."""
    section = Section(2e9, 8e-3, Taper(np.array([0, 0.5, 1]), np.array([1e-3, x[0], 1.2e-3])), shear=True)
    nodes = {
        "a": Node(0, 0, CLAMPED),
        "b": Node(0.05, 0.02),
        "bb": Node(0.05 + x[1], 0.02 + x[2]),
        "c": Node(0.1, 0.0, CLAMPED),
        "d": Node(0.06, 0.08, guided(np.pi / 2)),
    }
    beams = {
        "ab": Beam("a", "b", section, Polynomial((0.0, 0.7)), end_offset=(x[3], 0.001)),
        "bc": Beam("bb", "c", section, end_joint="pin"),
        "bd": Beam("b", "d", section),
    }
    return Network(nodes, beams, links=(Link("b", "bb"),), loads=(LineLoad("ab", 20.0, -60.0),))


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
    assert last.unknowns.shape == (2, path.points.y.shape[1], len(LAN))
    np.testing.assert_allclose(alone.effort, last.effort, rtol=1e-9)


@pytest.mark.parametrize("output", ["effort", "unknowns", "rows"])
def test_a_singular_tangent_is_told_where_a_derivative_is_asked_for(
    output: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([2e-3])), Control(tolerance=1e-5))
    found = gradient(path, lan, LAN)
    monkeypatch.setattr(compiled, "slopes", lambda *_: False)
    with pytest.raises(InputError, match="singular"):
        getattr(found, output)

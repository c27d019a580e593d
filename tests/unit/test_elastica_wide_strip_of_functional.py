"""Wide strips by the functional: their law, and paths, stresses and derivatives beside those of a fine mesh.

The law is no polynomial where a strip is bent from one side to the other: four elements a beam resolve it to 1e-8.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from functional_paths import beam_stress, functional_path

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    Beam,
    Control,
    Displacement,
    Network,
    Node,
    Polynomial,
    Section,
    Taper,
    slider_support,
    trace,
)
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.march import equations
from cfmkit.numerics.dual_array import COMPLEX_STEP

X = np.array([0.3, 0.02, 2e9, 0.35, 0.9])  # thickness [mm], width [m], modulus [Pa], Poisson's ratio, curvature


def strips(x: Any) -> tuple[Network, Displacement]:
    """A bent wide strip with a taper, and a narrow one beside it."""
    thickness = Taper(np.array([0.0, 0.4, 1.0]), np.array([1.0, 0.8, 1.1]) * x[0] * 1e-3)
    wide = Section(x[2], x[1], thickness, poisson_ratio=x[3], wide=True)
    narrow = Section(x[2], 5e-3, x[0] * 1e-3, poisson_ratio=x[3])
    nodes = {
        "a": Node(0, 0, CLAMPED_SUPPORT),
        "c": Node(0.12, 0, CLAMPED_SUPPORT),
        "b": Node(0.06, 0.02, slider_support(np.pi / 2)),
    }
    beams = {
        "w": Beam("a", "b", wide, Polynomial((0.0, x[4], -0.5))),
        "n": Beam("c", "b", narrow, Polynomial((0.0, -x[4], 0.5))),
    }
    return Network(nodes, beams), Displacement("b", -np.pi / 2, np.array([2e-3, 6e-3, 1.2e-2]))


def test_the_hessian_of_a_wide_strip_is_the_derivative_of_its_gradient() -> None:
    net, drive = strips(X)
    network = discretise(net, drive, 4)
    z = 0.3 * np.random.default_rng(1).standard_normal(network.size)
    stepped = [energy.gradient(network, z + 1j * COMPLEX_STEP * unit, 0.1).imag for unit in np.eye(network.size)]
    tangent = energy.hessian(network, z, 0.1)
    size = float(np.abs(tangent).max())
    assert tangent == pytest.approx(np.stack(stepped, axis=1) / COMPLEX_STEP, rel=1e-11, abs=1e-11 * size)


def test_c_and_numpy_have_the_same_wide_strips() -> None:
    """Bent a little, where the law is a series, and much, where it is not."""
    net, drive = strips(X)
    network = discretise(net, drive, 7, 2)
    own = equations(network)
    if not isinstance(own, CompiledEquations):
        pytest.skip("the compiled module was not built")
    for size in (0.01, 0.3, 3.0):
        z = size * np.random.default_rng(2).standard_normal(network.size)
        gradient, hessian = own.evaluate(z, 0.1, 0.6)
        right = energy.gradient(network, z, 0.1, 0.6), energy.hessian(network, z, 0.1, 0.6)
        for found, known in zip((gradient, hessian), right, strict=True):
            assert np.abs(found - known).max() < 1e-12 * np.abs(known).max()


def test_paths_stresses_and_energies_are_those_of_a_fine_mesh() -> None:
    net, drive = strips(X)
    old, path = trace(net, drive, Control(tolerance=1e-10)), functional_path(net, drive, 16, 4)
    keep = old.at_requested
    assert path.effort == pytest.approx(old.effort[keep], rel=1e-7)
    assert path.energy == pytest.approx(old.energy[keep], rel=1e-7)
    for beam in net.beams:
        assert beam_stress(path, beam)[0] == pytest.approx(beam_stress(old, beam)[0][keep], rel=1e-6)
    from dataclasses import replace

    bare = {name: replace(beam, section=replace(beam.section, wide=False)) for name, beam in net.beams.items()}
    narrow = functional_path(replace(net, beams=bare), drive, 8)
    assert np.abs(narrow.effort / path.effort - 1).max() > 1e-3

"""The functional of a network: its derivatives, its quadrature, how fast it converges."""

from __future__ import annotations

import beam_networks
import numpy as np
import pytest
from functional_paths import functional_path

import cfmkit.elastica as el
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.polynomials import basis, integrals, integrals_to_points, interpolation

LENGTH, STRIP = 0.1, el.Section(2e9, 1e-2, 1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_the_hessian_is_the_derivative_of_the_gradient(seed: int) -> None:
    net = beam_networks.network(seed, follower=seed % 2 == 0)
    for drive in beam_networks.drives(net, seed)[::3]:
        network = discretise(net, drive, 4)
        z = 0.1 * np.random.default_rng(seed).standard_normal(network.size)
        stepped = [energy.gradient(network, z + 1e-30j * unit, 0.3, 0.7).imag for unit in np.eye(network.size)]
        tangent = energy.hessian(network, z, 0.3, 0.7)
        assert tangent == pytest.approx(np.stack(stepped, axis=1) / 1e-30, rel=1e-12, abs=1e-12 * np.abs(tangent).max())


@pytest.mark.parametrize("degree", [2, 7])
def test_integrals_and_interpolation_are_exact_for_polynomials(degree: int) -> None:
    rule = basis(degree)
    power = len(rule.places) - 1
    assert integrals_to_points(degree) @ rule.places**power == pytest.approx(rule.places ** (power + 1) / (power + 1))
    ends = np.array([0.0, 0.3, 1.0])
    assert integrals(rule.places, ends) @ rule.places**2 == pytest.approx(ends**3 / 3)
    assert interpolation(rule.places, ends) @ rule.places**power == pytest.approx(ends**power)


def test_a_pulled_strip_converges_spectrally() -> None:
    load = el.Loading((el.PointLoad("b", fy=0.3),), np.array([1.0]))
    net = el.Network({"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, 0)}, {"x": el.Beam("a", "b", STRIP)})
    tips = [functional_path(net, load, degree).motion("b")[-1, 1] / LENGTH for degree in (3, 5, 7, 14)]
    errors = np.abs(np.array(tips[:-1]) - tips[-1])
    assert (errors[1:] < 0.1 * errors[:-1]).all()
    assert errors[-1] < 1e-8

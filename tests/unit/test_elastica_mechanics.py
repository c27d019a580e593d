"""The functional of a network: its derivatives, its equilibria beside those of a trace, its inertia."""

from __future__ import annotations

from typing import Any

import beam_networks
import numpy as np
import pytest
from scipy.special import ellipk

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PointLoad,
    Section,
    slider_support,
    trace,
)
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.discretise import Discretisation, discretise
from cfmkit.elastica.mechanics.polynomials import basis, integrals, integrals_to_points, interpolation

LENGTH, STRIP = 0.1, Section(2e9, 1e-2, 1e-3)


def equilibrium(network: Discretisation, free: Any, drive: float, share: float) -> Any:
    """Return the free unknowns at an equilibrium near a guess, by Newton's method."""
    for _ in range(12):
        z = energy.values(network, free, drive, share)
        residual = energy.gradient(network, z, drive, share)[network.free]
        tangent = energy.hessian(network, z, drive, share)[np.ix_(network.free, network.free)]
        step = np.linalg.solve(tangent, -residual)
        free = free + step
        if np.abs(step).max() < 1e-10 * (1 + np.abs(free).max()):
            return free
    raise AssertionError("no equilibrium")


def follow(network: Discretisation, drives: Any) -> Any:
    """Return the free unknowns at the last of some drives, from rest: what is constant is applied first."""
    free = np.zeros(len(network.free))
    for share in np.linspace(0.25, 1.0, 4):
        free = equilibrium(network, free, 0.0, share)
    for drive in drives:
        free = equilibrium(network, free, drive, 1.0)
    return free


def effort(network: Discretisation, free: Any, drive: float) -> float:
    """Return the force or moment of a drive by a motion, SI."""
    residual = energy.gradient(network, energy.values(network, free, drive), drive)
    return float(residual @ network.rate) * network.scales.moment / network.scales.drive


def column(clamped: bool = True) -> tuple[Network, Displacement]:
    support = slider_support(0.0, rotates=not clamped)
    net = Network({"a": Node(0, 0, CLAMPED_SUPPORT), "b": Node(LENGTH, 0, support)}, {"x": Beam("a", "b", STRIP)})
    return net, Displacement("b", np.pi, np.linspace(1e-4, 1.3e-3, 5) * LENGTH)


@pytest.mark.parametrize("seed", range(6))
def test_the_hessian_is_the_derivative_of_the_gradient(seed: int) -> None:
    net = beam_networks.network(seed, follower=seed % 2 == 0)
    for drive in beam_networks.drives(net, seed)[::3]:
        network = discretise(net, drive, 4)
        z = 0.1 * np.random.default_rng(seed).standard_normal(network.size)
        stepped = [energy.gradient(network, z + 1e-30j * unit, 0.3, 0.7).imag for unit in np.eye(network.size)]
        tangent = energy.hessian(network, z, 0.3, 0.7)
        assert tangent == pytest.approx(np.stack(stepped, axis=1) / 1e-30, rel=1e-12, abs=1e-12 * np.abs(tangent).max())


@pytest.mark.parametrize("seed", [1, 3, 4, 8])
def test_equilibria_of_one_high_degree_have_the_forces_of_a_trace(seed: int) -> None:
    net = beam_networks.network(seed)
    for drive in beam_networks.drives(net, seed)[:3]:
        path = trace(net, drive, Control(tolerance=1e-9))
        assert not path.events
        network = discretise(net, drive, 18)
        last = float(drive.points[-1]) / network.scales.drive
        free = follow(network, np.linspace(0.25, 1.0, 4) * last)
        assert effort(network, free, last) == pytest.approx(path.effort[-1], rel=1e-7)
        z = energy.values(network, free, last)
        assert energy.strain_energy(network, z, last) * network.scales.moment == pytest.approx(
            path.energy[-1], rel=1e-7
        )


def test_a_pulled_strip_converges_spectrally() -> None:
    load = Loading((PointLoad("b", fy=0.3),), np.array([1.0]))
    net = Network({"a": Node(0, 0, CLAMPED_SUPPORT), "b": Node(LENGTH, 0)}, {"x": Beam("a", "b", STRIP)})
    tips = []
    for degree in (3, 5, 7, 14):
        network = discretise(net, load, degree)
        z = energy.values(network, follow(network, [0.5, 1.0]), 1.0)
        tips.append(z[network.bodies["b"][1]])
    errors = np.abs(np.array(tips[:-1]) - tips[-1])
    assert (errors[1:] < 0.1 * errors[:-1]).all()
    assert errors[-1] < 1e-8


def test_negative_pivots_count_unstable_directions_beyond_buckling() -> None:
    net, drive = column()
    path = trace(net, drive, Control(branch="primary"))
    assert path.unstable[path.at_requested].max() >= 2
    network = discretise(net, drive, 14)
    free = np.zeros(len(network.free))
    for point, value in enumerate(drive.points / network.scales.drive):
        free = equilibrium(network, free, value, 1.0)
        z = energy.values(network, free, value)
        tangent = energy.hessian(network, z, value)[np.ix_(network.free, network.free)]
        assert energy.count_unstable(network, tangent) == path.unstable[path.at_requested[point]]


def test_a_column_that_does_not_stretch_is_stable_below_its_critical_load() -> None:
    stiff = Section(2e9, 1e-2, 1e-3, axial=False)
    net = Network(
        {"a": Node(0, 0, CLAMPED_SUPPORT), "b": Node(LENGTH, 0, slider_support(0.0))}, {"x": Beam("a", "b", stiff)}
    )
    critical = 4 * np.pi**2 * 2e9 * 1e-2 * 1e-9 / 12 / LENGTH**2  # both ends clamped
    network = discretise(net, Loading((PointLoad("b", fx=-critical),), np.array([1.0])), 10)
    counts = []
    for factor in (0.999, 1.001):
        free = equilibrium(network, np.zeros(len(network.free)), factor, 1.0)
        z = energy.values(network, free, factor)
        counts.append(
            energy.count_unstable(network, energy.hessian(network, z, factor)[np.ix_(network.free, network.free)])
        )
    assert counts == [0, 1]


def test_a_buckled_strut_has_the_load_of_the_elliptic_integral() -> None:
    stiff = Section(2e9, 1e-2, 1e-3, axial=False)
    net = Network({"a": Node(0, 0, CLAMPED_SUPPORT), "b": Node(LENGTH, 0)}, {"x": Beam("a", "b", stiff)})
    turn = 1.0  # rotation of the loaded end [rad]
    load = (2e9 * 1e-2 * 1e-9 / 12) / LENGTH**2 * ellipk(np.sin(turn / 2) ** 2) ** 2
    network = discretise(net, Loading((PointLoad("b", fx=-load),), np.array([1.0])), 14)
    free = np.zeros(len(network.free))
    guess = energy.values(network, free, 1.0)
    guess[network.elements.unknowns[0, 7]] = turn
    found = energy.values(network, equilibrium(network, guess[network.free], 1.0, 1.0), 1.0)
    assert abs(found[network.bodies["b"][2]]) == pytest.approx(turn, rel=1e-9)


@pytest.mark.parametrize("degree", [2, 7])
def test_integrals_and_interpolation_are_exact_for_polynomials(degree: int) -> None:
    rule = basis(degree)
    power = len(rule.places) - 1
    assert integrals_to_points(degree) @ rule.places**power == pytest.approx(rule.places ** (power + 1) / (power + 1))
    ends = np.array([0.0, 0.3, 1.0])
    assert integrals(rule.places, ends) @ rule.places**2 == pytest.approx(ends**3 / 3)
    assert interpolation(rule.places, ends) @ rule.places**power == pytest.approx(ends**power)

"""Answers for random networks against mechanics stated anew: Reissner's equations, balances, energy and work."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from beam_equilibrium import Judge, mean_motion
from beam_networks import drives, network
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import cfmkit.elastica as el

FINE = el.Control(tolerance=1e-9)
SEEDS = st.integers(0, 2**32 - 1)


def solved(net: Any, drive: Any) -> el.Path:
    path = el.trace(net, drive, FINE)
    assert path.status is el.PathStatus.COMPLETE, path.message
    return path


def solved_drawn(net: Any, drive: Any, points: Any = None) -> el.Path:
    """Return the path of a drawn network; some have no way on before the drive's end."""
    path = el.trace(net, drive if points is None else dataclasses.replace(drive, points=points), FINE)
    assume(path.status is el.PathStatus.COMPLETE)
    return path


@given(seed=SEEDS, kind=st.integers(0, 3))
@settings(max_examples=16, deadline=None)
def test_every_beam_and_every_body_is_in_equilibrium(seed: int, kind: int) -> None:
    net = network(seed)
    path = solved_drawn(net, drives(net, seed)[kind])
    scales = path.mesh.scales
    forces = np.array([scales.force, scales.force, scales.moment])
    judge = Judge(path, int(path.at_requested[-1]))
    largest = max(1.0, *(np.abs(path.end_force(beam, 0)[-1] / forces).max() for beam in net.beams))
    for beam in net.beams:
        gap, jump = judge.gaps(beam)
        np.testing.assert_allclose(gap[:, :2] / scales.length, 0.0, atol=2e-8)
        np.testing.assert_allclose(gap[:, 2], 0.0, atol=1e-7)  # the tolerance is that of nodes and forces
        np.testing.assert_allclose(jump / forces, 0.0, atol=2e-8 * largest)
    for total in judge.imbalance().values():
        np.testing.assert_allclose(total / forces, 0.0, atol=1e-9 * largest)


def dead_work(path: el.Path, point: int) -> float:
    """Return the work of the constant dead loads up to a point, from the first."""
    total = 0.0
    for load in path.network.loads:
        if isinstance(load, el.PointLoad):
            moved = path.motion(load.node)[point] - path.motion(load.node)[0]
            total += float(np.dot([load.fx, load.fy, load.moment], moved))
        elif isinstance(load, el.LineLoad):
            moved = mean_motion(path, load.beam)
            total += float((moved[point] - moved[0]) @ [load.wx, load.wy])
    return total


@given(seed=SEEDS, kind=st.integers(0, 2))
@settings(max_examples=9, deadline=None)
def test_energy_grows_by_the_work_of_the_drive_and_of_dead_loads(seed: int, kind: int) -> None:
    """With prestressed springs and moved supports, which do no work while the drive goes on."""
    net = network(seed, follower=False)
    drive = drives(net, seed)[kind]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    end = float(drive.points[-1])
    path = solved_drawn(net, drive, np.array([0.0, *(0.5 * end * (nodes + 1)), end]))
    at = path.at_requested
    waves = np.abs(np.polynomial.legendre.legfit(nodes, path.effort[at[1:-1]], 19))
    assume(waves[-4:].max() < 1e-8 * waves.max())  # the points show all of the effort: none locks on the way
    work = 0.5 * end * weights @ path.effort[at[1:-1]]
    grown = path.energy[at[-1]] - path.energy[0]
    size = 0.5 * abs(end) * weights @ np.abs(path.effort[at[1:-1]])
    assert grown == pytest.approx(work + dead_work(path, int(at[-1])), abs=1e-7 * size)


def test_energy_grows_by_the_work_of_dead_loads_that_are_driven() -> None:
    """The factor's work: its effort is the loads' displacement by unit factor, less that at the start."""
    net = network(2, follower=False)
    loads = (el.PointLoad("bb", 0.1, -0.15, 2e-3), el.PointLoad("d", 0.05, 0.1), el.LineLoad("cd", 3.0, 5.0))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    path = solved(net, el.Loading(loads, np.array([0.0, *(0.5 * (nodes + 1)), 1.0])))
    at = path.at_requested
    shift = path.effort[at] - path.effort[0]
    work = shift[-1] - 0.5 * weights @ shift[1:-1]
    assert path.energy[at[-1]] - path.energy[0] == pytest.approx(work + dead_work(path, int(at[-1])), rel=1e-7)


def pulled_strip(thin: float) -> el.Path:
    """Return a clamped strip whose thickness at a quarter of its length is `thin` [m], its end pulled."""
    thickness = el.Taper(np.linspace(0, 1, 5), np.array([1e-3, thin, 0.9e-3, 1.1e-3, 1e-3]))
    section = el.Section(1.8e9, 5e-3, thickness, shear=True)
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.12, 0.0, el.Support(rotation=True))}
    net = el.Network(nodes, {"ab": el.Beam("a", "b", section)})
    return el.trace(
        net, el.Loading((el.PointLoad("b", 2.0, 0.1),), np.linspace(0.1, 1.0, 10)), el.Control(tolerance=1e-7)
    )


@pytest.mark.parametrize("thin", [0.1e-3, 0.04e-3])
def test_a_strip_with_a_thin_place_is_in_equilibrium(thin: float) -> None:
    """The thin place bears a thousandth of what its neighbours do."""
    path = pulled_strip(thin)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.error <= 1e-7
    judge = Judge(path, -1)
    gap, _ = judge.gaps("ab")
    np.testing.assert_allclose(gap / [0.12, 0.12, 1.0], 0.0, atol=2e-6)

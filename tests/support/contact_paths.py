"""Paths of networks with contacts: rows and places, and what holds at every row."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el

DOWN = -np.pi / 2
EXACT = el.Control(tolerance=1e-9)
TIP_LOAD = (el.PointLoad("tip", 0.0, -1.0),)
SECTION = el.Section(1.0, 12.0, 1.0, axial=False, shear=False)  # EI = 1
HALF = 0.005  # half the thickness of the next one: radii of references are those of the centre line
THIN = el.Section(1.2e7, 1.0, 2 * HALF, axial=False, shear=False)  # EI = 1


def at_drive(path, drive):
    """Return the first row at a value of the drive."""
    return int(np.flatnonzero(np.abs(path.drive - drive) < 1e-12)[0])


def place_of(path, node, point):
    """Return where a node is at a row, (2,)."""
    at = path.network.nodes[node]
    return path.motion(node)[point, :2] + [at.x, at.y]


def check_complementarity(path):
    """Forces press, nothing overlaps, and what is apart has no force."""
    for number in range(len(path.network.contacts)):
        force, gap = path.contact_force(number), path.contact_gap(number)
        assert force.min() > -1e-9 * max(1.0, force.max())
        assert gap.min() > -1e-9
        assert np.minimum(gap, force).max() < 1e-8


def assert_work_is_energy(net, node, begin, end):
    """Check that the work of a drive downwards between two places, without an event, is the change of the energy."""
    shares, weights = np.polynomial.legendre.leggauss(12)
    drives = np.concatenate([[begin], begin + (end - begin) * (shares + 1) / 2, [end]])
    path = el.trace(net, el.Displacement(node, DOWN, drives), EXACT)
    efforts, energy = path.effort[path.at_requested], path.energy[path.at_requested]
    work = 0.5 * (end - begin) * (weights @ efforts[1:-1])
    assert work == pytest.approx(energy[-1] - energy[0], rel=1e-10)


def shoot(start, force, length, curvature=0.0):
    """Return x, y, angle and moment at the end of a leaf, EI = 1, from those at its start [DOP853]."""
    from scipy.integrate import solve_ivp

    def slopes(_, state):
        cos, sin = np.cos(state[2]), np.sin(state[2])
        return [cos, sin, curvature + state[3], force[0] * sin - force[1] * cos]

    return solve_ivp(slopes, (0, length), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def residual_slopes(equations, free, drive, step=1e-6):
    """Return the derivatives of the residual by the unknowns, as central differences, (n, n)."""
    sides = [[equations.linearise(free + way * step * unit, drive).residual for way in (1, -1)]
             for unit in np.eye(len(free))]  # fmt: skip
    return np.array([after - before for after, before in sides]).T / (2 * step)

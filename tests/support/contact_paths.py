"""Paths of networks with contacts: rows and places, and what holds at every row."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.elastica import Control, Displacement, trace


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
    path = trace(net, Displacement(node, -np.pi / 2, drives), Control(tolerance=1e-9))
    efforts, energy = path.effort[path.at_requested], path.energy[path.at_requested]
    work = 0.5 * (end - begin) * (weights @ efforts[1:-1])
    assert work == pytest.approx(energy[-1] - energy[0], rel=1e-10)

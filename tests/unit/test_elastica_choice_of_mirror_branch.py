"""Which of two mirror-image branches a path takes is decided by the network, not by rounding."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Control, Displacement, Network, Node, Section, slider_support, trace


def side_of_leaf(change: float, sign: int) -> float:
    """Return to which side of its chord the middle of a V-beam's leaf lies beyond the first bifurcation."""
    nodes = {
        "wall": Node(0, 0, CLAMPED_SUPPORT),
        "shuttle": Node(0.0299250, 4.265e-3 * (1 + change), slider_support(np.pi / 2)),
    }
    section = Section(1.477e9, 3.6e-3, 1.00998e-3, shear=True, poisson_ratio=0.3)
    network = Network(nodes, {"leaf": Beam("wall", "shuttle", section)})
    drive = Displacement("shuttle", -np.pi / 2, 4.743e-3 * np.arange(1, 128) / 127)
    path = trace(network, drive, Control(sign=sign))
    shape = path.shape("leaf", int(np.abs(path.drive - 2.5e-3).argmin()))
    return float(np.sign(shape[len(shape) // 2, 1] - 0.5 * shape[-1, 1]))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_tiny_change_does_not_change_the_side(sign: int) -> None:
    sides = {side_of_leaf(1e-9 * change, sign) for change in range(8)}
    assert len(sides) == 1


def test_the_signs_are_the_two_sides() -> None:
    assert side_of_leaf(0.0, 1) == -side_of_leaf(0.0, -1)
